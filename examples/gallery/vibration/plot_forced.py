"""
A spring that hardens: Duffing's oscillator
===========================================

A mass on a spring that hardens is pushed to and fro. Its amplitude leans over towards higher frequencies, and between
the jumps there are three periodic motions, the middle one unstable: the branch is followed around its turning points.
Where the mass lags by a quarter of a period it moves as if it were free, on the backbone, which is known in closed
form.

Source: F. W. J. Olver et al., NIST Handbook of Mathematical Functions 2010, section 22.19(ii): a free vibration of the
amplitude a has the frequency sqrt(k + s) / (4 K(s / (2 k + 2 s))), s = k3 a^2, with the complete elliptic integral K,
of a mass of 1 kg.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import ellipk

import ffr_dyn as fd

k, k3, c, F = 40.0, 800.0, 0.3, 1.0  # N/m, N/m^3, N s/m, N, of a mass of 1 kg
x = np.linspace(-0.5, 0.5, 801)  # m
mass = fd.rigid_body("mass", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
rail = fd.Joint("rail", "translational", "ground.O", "mass.c", axis=(1, 0, 0))
spring = fd.JointSpring("spring", "rail", stiffness=fd.Curve(x, k * x + k3 * x**3), damping=c, coordinate="stroke")
scene = fd.Scene([fd.Body("mass", mass)], [rail], forces=[spring], ground={"O": (0, 0, 0)})
found = fd.forced(scene, input="rail.force", amplitude=F, outputs=["mass.c.position.x"], band_of=(1.0, 1.8))

f, a, stable = found["frequency"], found["amplitude"][:, 0], found["stable"] > 0
stretch = k3 * np.linspace(0, 0.35, 50) ** 2
free = np.sqrt(k + stretch) / (4 * ellipk(stretch / (2 * (k + stretch))))
plt.plot(f, a, ":", f[stable], a[stable], "o", free, np.sqrt(stretch / k3), "k--", markersize=3)
plt.gca().set(xlabel="frequency [Hz]", ylabel="amplitude [m]", title="dots: stable; dashed: free vibration")
lag = -found["phase"][:, 0]
assert abs(np.interp(90, lag, f) / np.interp(np.interp(90, lag, a), np.sqrt(stretch / k3), free) - 1) < 1e-4
