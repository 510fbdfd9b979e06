"""
The cheapest model for a tolerance
==================================

A fast slider-crank whose rod has twenty coordinates: what of them does it take to know the bending of the rod within
one per cent? The economiser looks for it, says what it left out, and verifies the model that it found, which does what
a geometrically exact beam does.

Source of the numbers, the offset of the rod's middle from the line between its ends at 20, 40 and 50 ms: a planar
geometrically exact beam of high order, Radau IIA, right to 5e-7 m.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

at = {"a": (0, 0, 0), "middle": (0.15, 0, 0), "b": (0.3, 0, 0)}
line = fp.polyline([at["a"], at["b"]], fp.Member(fp.circle(0.006), fp.Material("steel", 2e11, 0.3, 7870)), elements=20)
model = fp.from_frame(fp.named(line, **at), [fp.InterfaceRegion(name) for name in at])
rod = fp.reduce(model, fp.Request(name="rod", reference=fp.SimplySupported("a", "b"), reduction=fp.CraigBampton(8)))
slider = fd.rigid_body("slider", mass=rod.mass / 2, inertia=(1e-5, 1e-5, 1e-5), points={"pin": (0, 0, 0)})
bodies = [fd.Body("rod", rod, position=(0.15, 0, 0)), fd.Body("slider", slider, position=(0.45, 0, 0))]
guide = fd.Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0))
# The crank of 0.15 m turns at 150 rad/s: where it leads the rod.
crank = fd.PointDriver("crank", "ground.O", "rod.a", x=fd.formula("0.15*cos(150*t)"), y=fd.formula("0.15*sin(150*t)"))
joints = [guide, fd.Joint("wrist", "revolute", "rod.b", "slider.pin")]
scene = fd.Scene(bodies, joints, [crank], ground={"O": (0, 0, 0)})

# Tolerances of 4e-5 m: a hundredth of the deflection.
found = fd.economise(scene, [f"rod.middle.position.{c}=4e-5" for c in "xy"], end=0.05, output_step=5e-4, verify=True)
print(fd.as_text(found).partition("cost of a run")[0])
run = fd.run(found.scene, found.settings)
a, middle, b = (run[f"rod.{name}.position"][:, :2] @ (1, 1j) for name in at)  # places as complex numbers
offset = ((middle - a) / (b - a)).imag * 0.3
exact = np.array([0.9695e-3, -2.3706e-3, 3.8813e-3])  # m, at 20, 40 and 50 ms
plt.plot(1e3 * run.time, 1e3 * offset, [20, 40, 50], 1e3 * exact, "ko", fillstyle="none")
plt.legend(["economised model", "geometrically exact beam"])
plt.gca().set(xlabel="time [ms]", ylabel="deflection of the rod [mm]")

# %%
# What the model that was found does, with ten times its deflection:
fd.animate(run, scale=10)

# %%
# Within its tolerance of the exact beam:
assert np.allclose(offset[[40, 80, 100]], exact, atol=4e-5)
