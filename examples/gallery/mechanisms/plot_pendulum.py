"""
Period of a pendulum of large amplitude
=======================================

A rigid rod of 1 m swings from the horizontal. Its period is that of small oscillations, times 2 K(sin²(θ₀/2)) / π with the
complete elliptic integral K of the first kind: at θ₀ = 90° it is 18 % longer.

Source of the number: L. D. Landau, E. M. Lifshitz, *Mechanics*, § 11, problem 1.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import ellipk

import ffr_dyn as fd

length, mass, gravity = 1.0, 2.0, 9.81
inertia = [1e-4, mass * length**2 / 12, mass * length**2 / 12]
ends = {"pin": (-length / 2, 0, 0), "tip": (length / 2, 0, 0)}
rod = fd.rigid_body("rod", mass=mass, inertia=inertia, points=ends)

# %%
# The rod starts at rest: its position is given for t = 0, and assembly closes the joint.
hinge = fd.Joint("hinge", "revolute", "ground.wall", "rod.pin", axis=(0, 0, 1))
body = fd.Body("rod", rod, position=(length / 2, 0, 0))
scene = fd.Scene([body], [hinge], ground={"wall": (0, 0, 0)}, gravity=(0, -gravity, 0))
result = fd.forward(scene, end=4.0, output_step=0.005, method=fd.RK4(1e-3))

# %%
# At the turning points the angular velocity changes its sign: half a period lies between two of them.
speed = result["rod.omega_bar"][:, 2]
turn = np.flatnonzero(speed[1:-1] * speed[2:] < 0)[:2] + 1
turning = result.time[turn] - speed[turn] * 0.005 / (speed[turn + 1] - speed[turn])
period = 2 * np.diff(turning)[0]
exact = 4 * np.sqrt(2 * length / 3 / gravity) * ellipk(0.5)

plt.plot(result.time, result["rod.tip.position"][:, :2], label=["x", "y"])
plt.xlabel("time [s]")
plt.ylabel("tip [m]")
plt.legend()
plt.title(f"period {period:.4f} s, exact {exact:.4f} s")

assert abs(period / exact - 1) < 1e-5
