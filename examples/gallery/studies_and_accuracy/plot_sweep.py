"""
A sweep of two parameters
=========================

A box is clamped at one end and pulled down at the other. Its length and its height are parameters of the geometry: a
sweep meshes and reduces it anew for every pair, runs the scene, and keeps a row for each. Runs that fail are rows with
a message, and a sweep that was stopped goes on where it was.

Source: W. C. Young, R. G. Budynas, Roark's Formulas for Stress and Strain, 7th ed. 2002, table 8.1, case 1a, and
section 8.10: F L^3 / (3 E I), and 6 F L / (5 G A) of shear.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd

Path("out").mkdir(exist_ok=True)
Path("out/beam.toml").write_text("""
analysis = {kind = "static"}
ground = {wall = [0, 0, 0]}
bodies.beam = {file = "beam.ffr"}
joints.clamp = {kind = "fixed", i = "ground.wall", j = "beam.left"}
loads.weight = {marker = "beam.right", force = [0, -1000, 0]}
""")
parameters = {"length": [0.5, 0.75, 1.0], "height": [0.05, 0.075, 0.1]}  # m
make = """reduce meshes/box.geo --set x=${length} --set y=${height} --set z=0.05 --set nx=20
    --material E=2.1e11,nu=0.3,rho=7850 --interface left --interface right --reference fixed:left --modes 0"""
study = fd.study("out/beam.toml", parameters, {"y": "beam.right.displacement.y: last"}, bodies={"beam": make})
table = fd.sweep(study, "out/beams.nc", workers=0)

L, h = table.parameters["length"], table.parameters["height"]
exact = 1000 * (4 * L**3 / (2.1e11 * 0.05 * h**3) + 6 * L / (5 * 2.1e11 / 2.6 * 0.05 * h))
plt.scatter(L, h, s=4e5 * -table["y"], c=-1e3 * table["y"])
plt.colorbar(label="deflection [mm]")
plt.gca().set(xlabel="length [m]", ylabel="height [m]", xlim=(0.4, 1.1), ylim=(0.04, 0.11))
print(np.column_stack([L, h, -1e3 * table["y"], 1e3 * exact]).round(4))
assert np.allclose(-table["y"], exact, rtol=0.015)
