"""
Stress at a hole
================

A strip with a hole is pulled at its ends. A body that is reduced with its stress modes knows where it is stressed most,
and how much: at the edge of the hole, across the pull. In a strip of five times the diameter of the hole that is 3.15
times the stress far away.

Source: W. D. Pilkey, Peterson's Stress Concentration Factors, 2nd ed. 1997, chart 4.1, after R. C. J. Howland,
Philosophical Transactions of the Royal Society A 229 (1930) 49-86: (2 + 0.284 s - 0.600 s^2 + 1.32 s^3) / s, s = 1 - d
/ w.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import ffr_dyn as fd
import ffr_prep as fp

# Length, width, thickness and diameter in mm; gmsh makes elements of a fortieth of the hole's circumference there.
GEOMETRY = """SetFactory("OpenCASCADE"); Mesh.MeshSizeFromCurvature = 40;
Box(1) = {-100, -50, 0, 200, 100, 3}; Cylinder(2) = {0, 0, 0, 0, 0, 3, 10};
strip() = BooleanDifference{ Volume{1}; Delete; }{ Volume{2}; Delete; }; Physical Volume("strip") = {strip()};
"""
Path("out").mkdir(exist_ok=True)
Path("out/strip.geo").write_text(GEOMETRY)
regions = [fp.InterfaceRegion(name, f"plane x={x}mm", kind="mean") for name, x in (("left", -100), ("right", 100))]
request = fp.Request(name="strip", reference=fp.FixedTo("left"), reduction=fp.CraigBampton(0), stress=True)
strip = fp.reduce(
    fp.from_mesh(fp.read_mesh("out/strip.geo", unit="mm", size=10), fp.material("steel"), regions), request
)
clamp = fd.Joint("clamp", "fixed", "ground.wall", "strip.left")
pull = fd.Load("pull", "strip.right", force=(30e3, 0, 0))  # N: 100 MPa
scene = fd.Scene([fd.Body("strip", strip)], [clamp], loads=[pull], ground={"wall": (-0.1, 0, 0.0015)})
found = fd.static(scene)
hottest = fd.hot_spots(found, count=1)[0]  # von Mises

points, values = strip.surface.points, fd.peaks(found, "strip", "von-mises")[0]
plt.scatter(*1e3 * points[:, :2].T, c=values / 1e6, s=4, cmap="turbo")
plt.colorbar(label="von Mises stress [MPa]", orientation="horizontal")
plt.gca().set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title=f"{hottest.value / 1e6:.1f} MPa at the hole")
assert abs(hottest.value / 100e6 - (2 + 0.284 * 0.8 - 0.6 * 0.8**2 + 1.32 * 0.8**3) / 0.8) < 0.05
