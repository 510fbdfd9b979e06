"""
A body that turns over as it flies
==================================

Rotation about the axis of middle inertia is unstable: a racket, a wing nut, any free body with three different moments
of inertia turns over again and again, and angular momentum stays what it is. With J = (1, 2, 3) kg m² and ω₀ = (0.001,
1, 0.001) rad/s the rate about the middle axis comes back after T = 55.0616811 s.

Source: the elliptic functions of the free rigid body, L. D. Landau, E. M. Lifshitz, *Mechanics*, § 37; V. A.
Dzhanibekov saw it in orbit in 1985.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd

nut = fd.rigid_body("nut", mass=1.0, inertia=(1.0, 2.0, 3.0), points={"tip": (0, 0.5, 0)})
scene = fd.Scene([fd.Body("nut", nut, omega_bar=(1e-3, 1.0, 1e-3))])
result = fd.forward(scene, end=111.0, output_step=0.05, method=fd.RK4(1e-2))
omega, t = result["nut.omega_bar"], result.time
momentum = np.array([1, 2, 3]) * omega
plt.plot(t, omega, label=["x: least inertia", "y: middle", "z: greatest"])
plt.gca().set(xlabel="time [s]", ylabel="angular velocity in body axes [rad/s]")
plt.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=3)

# %%
# Half a period lies between two moments when the rate about the middle axis changes its sign.
k = np.flatnonzero(np.diff(np.sign(omega[:, 1])))
changes = t[k] - omega[k, 1] * 0.05 / (omega[k + 1, 1] - omega[k, 1])

assert abs(2 * np.diff(changes)[0] / 55.0616811 - 1) < 1e-6
