"""
Frequency response of a cantilever
==================================

A force at the tip of an undamped cantilever and the motion of the tip: the receptance of the Euler-Bernoulli beam is
known in closed form. Sixteen modes (eight in each plane) and the static shapes of the interfaces follow it over three
resonances.

Source: R. E. D. Bishop, D. C. Johnson, The Mechanics of Vibration, Cambridge University Press 1960, table of beam
receptances: (sin u cosh u - cos u sinh u) / (EI b^3 (1 + cos u cosh u)), u = b L, b^4 = m w^2 / EI.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, E, rho = 1.0, 2.1e11, 7850.0
section = fp.shear_rigid(fp.circle(0.004))
line = fp.polyline([(0, 0, 0), (L, 0, 0)], fp.Member(section, fp.Material("steel", E, 0.3, rho)), elements=60)
ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
request = fp.Request(name="beam", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(16))
beam = fp.reduce(fp.from_frame(fp.named(line, root=(0, 0, 0), tip=(L, 0, 0)), ends), request)
clamp = fd.Joint("clamp", "fixed", "ground.wall", "beam.root")
scene = fd.Scene([fd.Body("beam", beam)], [clamp], ground={"wall": (0, 0, 0)})
f = np.linspace(0.5, 60.0, 400)
found = fd.response(scene, input="beam.tip.force.y", outputs=["beam.tip.position.y"], frequencies=f)

u = L * (rho * section.A * (2 * np.pi * f) ** 2 / (E * section.Iy)) ** 0.25
stiffness = E * section.Iy * (u / L) ** 3 * (1 + np.cos(u) * np.cosh(u))
exact = (np.sin(u) * np.cosh(u) - np.cos(u) * np.sinh(u)) / stiffness  # m/N
plt.semilogy(f, found["gain"][:, 0], label="reduced body")
plt.semilogy(f[::8], np.abs(exact[::8]), "ko", fillstyle="none", label="closed form")
plt.gca().set(xlabel="frequency [Hz]", ylabel="receptance of the tip [m/N]")
plt.legend()
# Near a resonance a shift of the frequency by 1e-5 is an error without bound: what counts is the median.
error = np.abs(found["transfer"][:, 0, 0] / exact - 1)
print(f"error: median {np.median(error):.1e}, nineteen of twenty below {np.quantile(error, 0.95):.1e}")
assert np.median(error) < 2e-4
assert np.quantile(error, 0.95) < 2e-3
