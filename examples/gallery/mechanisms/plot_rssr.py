"""
RSSR: a four-bar in space
=========================

A crank about the axis z moves a rocker about the axis y by way of a bar with a ball at either end. The bar needs no
body of its own: a *distance* joint keeps the balls apart by its length.

With the ball of the crank at A(θ) and that of the rocker at B(ψ), the length of the bar between them makes h cos(ψ − α)
= k, solved in closed form.

Source: R. S. Hartenberg, J. Denavit, *Kinematic Synthesis of Linkages*, 1964, chapter 12; closed form.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd

a, b, bar, P = 0.1, 0.25, 0.46, np.array([0.25, 0.3, 0.05])  # lengths and pivot of the rocker [m]
crank = fd.rigid_body("crank", mass=0.5, inertia=(1e-3,) * 3, points={"hub": (0, 0, 0), "ball": (a, 0, 0)})
rocker = fd.rigid_body("rocker", mass=1.0, inertia=(5e-3,) * 3, points={"hub": (0, 0, 0), "ball": (0, 0, b)})
joints = [
    fd.Joint("motor", "revolute", "ground.O", "crank.hub"),
    fd.Joint("rocking", "revolute", "ground.P", "rocker.hub", axis=(0, 1, 0)),
    fd.Joint("bar", "distance", "crank.ball", "rocker.ball", length=bar),
]
bodies = [fd.Body("crank", crank), fd.Body("rocker", rocker, position=P)]
turn = fd.Driver("turn", "motor", fd.polynomial(0, 2 * np.pi))
scene = fd.Scene(bodies, joints, [turn], ground={"O": (0, 0, 0), "P": P})

# %%
# The ball of the rocker is at P + b (sin ψ, 0, cos ψ).
result = fd.kinematic(scene, end=1.0, output_step=0.01)
theta, psi = result["motor.angle"], result["rocking.angle"]
dx, dy, dz = P[0] - a * np.cos(theta), P[1] - a * np.sin(theta), P[2]
k = (bar**2 - b**2 - dx**2 - dy**2 - dz**2) / (2 * b)
exact = np.arctan2(dx, dz) - np.arccos(k / np.hypot(dx, dz))
plt.plot(np.degrees(theta), np.degrees(psi), label="computed")
plt.plot(np.degrees(theta[::5]), np.degrees(exact[::5]), "o", label="closed form")
plt.gca().set(xlabel="crank [°]", ylabel="rocker [°]")
plt.legend()

assert np.abs(psi - exact).max() < 1e-9
