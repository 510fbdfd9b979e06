"""
An error bar on a reaction
==========================

A run tells of each of its outputs what the length of its steps costs. A rod swings from the horizontal, with steps that
are too long on purpose; the force of its hinge has the closed form beside it, and the run's own estimate holds the true
error.

Source: pendulum by elliptic functions, F. W. J. Olver et al., NIST Handbook of Mathematical Functions 2010, section
22.19: sin(a/2) = k sn(w t + K(k)), k = sin(a0/2); the force along the rod is m g cos a + m c a'^2.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import ellipj, ellipk

import ffr_dyn as fd

m, c, J, g = 2.0, 0.5, 2.0 / 3, 9.81  # kg, m, kg m^2 about the hinge, m/s^2: a rod of 1 m
rod = fd.rigid_body("rod", mass=m, inertia=(1e-3, 1 / 6, 1 / 6), centre_of_mass=(c, 0, 0), points={"a": (0, 0, 0)})
hinge = fd.Joint("hinge", "revolute", "ground.O", "rod.a")
scene = fd.Scene([fd.Body("rod", rod)], [hinge], ground={"O": (0, 0, 0)}, gravity=(0, -g, 0))
found = fd.forward(scene, end=2.0, output_step=0.02, method=fd.ROS2(0.02), check=True)
error = found.attributes["errors"]["hinge.force"][0]  # N; the second number is its share of the range

w = np.sqrt(m * g * c / J)
sn, cn, dn, _ = ellipj(w * found.time + ellipk(0.5), 0.5)
a, rate = 2 * np.arcsin(np.sqrt(0.5) * sn), 2 * np.sqrt(0.5) * w * cn
along, across = m * g * np.cos(a) + m * c * rate**2, m * g * np.sin(a) * (1 - m * c**2 / J)
exact = np.column_stack([across * np.cos(a) - along * np.sin(a), across * np.sin(a) + along * np.cos(a)])  # N
own = found["hinge.force"][:, :2]
figure, (upper, lower) = plt.subplots(2, 1, sharex=True)
upper.plot(found.time, own, found.time, exact, "k:")
upper.set(ylabel="force of the hinge [N]")
lower.plot(found.time, own - exact)
lower.axhspan(-error, error, alpha=0.2)  # what the run itself says
lower.set(xlabel="time [s]", ylabel="error [N]")
true = np.abs(own - exact).max()
assert true < 1.2 * error < 4 * true, (true, error)
