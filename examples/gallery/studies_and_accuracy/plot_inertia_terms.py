"""
Which inertia terms
===================

A soft rod turns about its end, and stretches by tan(k)/k - 1, k^2 = rho w^2 L^2 / E. In the kinetic energy of a body
the terms I8 are linear and I9 quadratic in the deformation, I5 are the Coriolis forces among modes. What a steady
rotation owes to each is seen by leaving it out: nothing to I5, 2 % to I9, a quarter to I8. The mean-axis frame allows
that; in a frame that is fixed at the axle modes carry nearly all of the mass, and the scene is refused.

Source: one-dimensional elasticity. With the displacement U of a rod of length 1, its mean m, and the frame in the
centre of mass: U" + k^2 (x + U) = 0; without I9 U" + k^2 (x + m) = 0; without I8 U" + k^2 (1/2 + U) = 0; always U(0) =
0, U'(1) = 0.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

E, rho, k = 1e7, 1000.0, 0.5
line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.2), fp.Material("rubber", E, 0.3, rho)), elements=20)
ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
request = fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.CraigBampton(40), linear=True)
rod = fp.reduce(fp.from_frame(fp.named(line, root=(0, 0, 0), tip=(1, 0, 0)), ends), request)
axle = fd.Joint("axle", "revolute", "ground.O", "rod.root")
motor = fd.Driver("motor", "axle", fd.polynomial(0, k * np.sqrt(E / rho)))
scene = fd.Scene([fd.Body("rod", rod)], [axle], [motor], ground={"O": (0, 0, 0)})

mean = 5 * k**2 / 24 / (1 - k**2 / 3)
exact = {"": np.tan(k) / k - 1, "I5": np.tan(k) / k - 1, "I9": k**2 * (1 / 3 + mean / 2), "I8": (1 / np.cos(k) - 1) / 2}
stretch = []
for term in exact:
    found = fd.steady(fd.vary(scene, drop=[term] if term else []))
    stretch.append(np.linalg.norm(found["rod.tip.position"][0]) - 1)
plt.bar([f"without {term}" if term else "all terms" for term in exact], 100 * np.array(stretch))
plt.gca().set(xlabel="inertia terms", ylabel="stretch of the turning rod [%]")
assert np.allclose(stretch, list(exact.values()), rtol=2e-4), stretch
