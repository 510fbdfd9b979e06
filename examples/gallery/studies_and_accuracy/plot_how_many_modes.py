"""
How many modes
==============

A clamped beam with an interface at its other end: the static shapes of the interface, and so many modes of the beam
that is held at both ends (Craig and Bampton). The error of the first frequency is known for the continuous beam; the
reduced body has just this error, so that a handful of modes is plenty. `fp.Accuracy` finds the number by itself.

Source: R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319;
the errors are those of the Ritz matrices in closed form, by this project, to eight digits.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_prep as fp

EXACT = {0: 4.7543236e-3, 1: 3.4702439e-4, 2: 5.8375818e-5, 4: 5.4086114e-6}  # by the number of modes in a plane
E, rho, section = 2.1e11, 7850.0, fp.shear_rigid(fp.circle(0.001))
line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(section, fp.Material("steel", E, 0.3, rho)), elements=40)
ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
model = fp.from_frame(fp.named(line, root=(0, 0, 0), tip=(1, 0, 0)), ends)
first = 1.8751040687**2 * np.sqrt(E * section.Iy / (rho * section.A)) / (2 * np.pi)  # Hz

errors = {}
for modes in EXACT:
    request = fp.Request(name="beam", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(2 * modes), linear=True)
    errors[modes] = fp.reduce(model, request).frequencies[0] / first - 1
plt.semilogy(EXACT.keys(), EXACT.values(), "ko", fillstyle="none", label="continuous beam")
plt.semilogy(errors.keys(), errors.values(), "x", label="reduced body")
plt.gca().set(xlabel="modes in each plane, beside the static shapes", ylabel="relative error of the first frequency")
plt.legend()
assert np.allclose(list(errors.values()), list(EXACT.values()), rtol=0.03)
