"""
Flexible pendulum
=================

A strip of 1.2 m, 0.2 m wide and 9 mm thick, swings from the horizontal. A pendulum of this kind was the test of a
program for real-time simulation in the floating frame of reference. Its middle leaves the chord by 1.6 mm, and the
tension of the swing shifts the frequency of that vibration: the load matrices of the body bring this in.

Tip at 0.5, 1 and 2 s and the largest deflection: (0.17374, −1.18736), (−1.19975, −0.02461), (1.19574, −0.10095) m, and
1.600 mm.

Source: the pendulum after the thesis of Rantalainen, 2007; the numbers by a geometrically exact beam of high order,
right to 3·10⁻⁶ m.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, strip = 1.2, fp.Member(fp.rectangle(b=0.2, h=0.009), fp.Material("metal", 7e10, 0.3, 5540.0), (0, 1, 0))
line = fp.polyline([(0, 0, 0), (L, 0, 0)], strip, elements=12)
line = fp.named(line, hinge=(0, 0, 0), middle=(L / 2, 0, 0), tip=(L, 0, 0))
model = fp.from_frame(line, [fp.InterfaceRegion(name) for name in ("hinge", "middle", "tip")])
rod = fp.reduce(model, fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.CraigBampton(8)))

# %%
hinge = fd.Joint("hinge", "revolute", "ground.O", "rod.hinge")
scene = fd.Scene([fd.Body("rod", rod)], [hinge], ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))
result = fd.forward(scene, end=2.0, output_step=5e-3, method=fd.ROS3(5e-4))
tip, middle = (result[f"rod.{name}.position"] @ (1, 1j, 0) for name in ("tip", "middle"))
w = (middle * np.conj(tip)).imag / np.abs(tip)  # from the chord

figure, (path, bent) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
path.plot(tip.real, tip.imag)
path.set(title="path of the tip", xlabel="x [m]", ylabel="y [m]", aspect="equal")
bent.plot(result.time, 1e3 * w)
bent.set(title="middle of the strip", xlabel="time [s]", ylabel="from the chord [mm]")

assert (
    np.abs(tip[[100, 200, 400]] - (0.1737356 - 1.1873578j, -1.1997451 - 0.0246135j, 1.1957429 - 0.1009467j)).max()
    < 2e-5
)
assert abs(np.abs(w).max() - 1.600e-3) < 5e-6
