"""
Tolerances: Monte Carlo with its confidence
===========================================

Crank and rod of a slider-crank are made within tolerances. How far does the slider scatter at a crank angle of 60
degrees? A hundred runs with random lengths tell, and how sure the answer is: the 95 % confidence of the standard
deviation holds what the derivatives of x = r cos a + sqrt(l^2 - r^2 sin^2 a) say.

Source: ISO/IEC Guide 98-3/Suppl. 1 (2008), propagation of distributions by Monte Carlo; the confidence is that of the
chi-squared distribution.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import chi2

import ffr_dyn as fd

Path("out").mkdir(exist_ok=True)
Path("out/slider.toml").write_text("""
parameters = {r = 0.1, l = 0.3}
analysis = {kind = "assemble"}
ground = {o = [0, 0, 0], pin = ["r / 2", "r * sqrt(3) / 2", 0]}
bodies.slider = {mass = 1, inertia = [1, 1, 1], points = {pin = [0, 0, 0]}, position = [0.34, 0, 0]}
joints.guide = {kind = "translational", i = "ground.o", j = "slider.pin", axis = [1, 0, 0]}
joints.rod = {kind = "distance", i = "ground.pin", j = "slider.pin", length = "l"}
""")
lengths = {"r": {"normal": [0.1, 1e-4]}, "l": {"normal": [0.3, 2e-4]}}  # mean and deviation [m]
study = fd.study("out/slider.toml", lengths, {"x": "slider.pin.position.x: last"}, samples=100, seed=1)
table = fd.sweep(study, "out/tolerances.nc", workers=0)

n = np.arange(10, 101)
deviation = 1e3 * np.array([np.std(table["x"][:k], ddof=1) for k in n])  # mm, of the first runs
least, most = (deviation * np.sqrt((n - 1) / chi2.ppf(p, n - 1)) for p in (0.975, 0.025))
# The derivatives of x by r and l; l^2 - r^2 sin^2 a is 0.0825 m^2.
exact = 1e3 * np.hypot((0.5 - 0.075 / np.sqrt(0.0825)) * 1e-4, 0.3 / np.sqrt(0.0825) * 2e-4)
plt.fill_between(n, least, most, alpha=0.3)
plt.plot(n, deviation, n, np.full(n.size, exact), "k:")
plt.gca().set(xlabel="runs", ylabel="deviation of the slider [mm]", title="with its 95 % confidence")
assert least[-1] < exact < most[-1], (least[-1], exact, most[-1])
