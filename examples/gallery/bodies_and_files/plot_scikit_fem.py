"""
A body from scikit-fem
======================

Stiffness and mass matrices that you assemble with another finite-element library become a body like any other. Here
scikit-fem assembles a slender bar of quadratic hexahedra; the body, in its mean-axis frame, has the frequencies of a
free beam.

Source: R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1: u^2 / (2 pi L^2) sqrt(E I / m)
with cos u cosh u = 1, u = 4.73004074, 7.85320462, 10.9956078.
"""

import matplotlib.pyplot as plt
import numpy as np
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import ffr_dyn as fd
import ffr_prep as fp

along, across = np.linspace(0, 1, 31), np.linspace(0, 0.01, 2)
mesh = skfem.MeshHex.init_tensor(along, across, across).with_defaults()  # names its ends "left" and "right"
basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=4)
K = linear_elasticity(*lame_parameters(2.1e11, 0.3)).assemble(basis)
M = skfem.BilinearForm(lambda u, v, w: 7850.0 * dot(u, v)).assemble(basis)
model = fp.from_matrices(fp.from_skfem(basis, K, M), [fp.InterfaceRegion("left"), fp.InterfaceRegion("right")])
body = fp.reduce(model, fp.Request(name="bar", reference=fp.MeanAxis(), reduction=fp.Eigenmodes(6)))

u = np.array([4.73004074, 7.85320462, 10.9956078])
exact = u**2 / (2 * np.pi) * np.sqrt(2.1e11 * 0.01**2 / (12 * 7850.0))  # Hz, each in two planes
order = np.argsort(body.surface.points[:, 0])
for k, frequency in enumerate(body.frequencies[::2]):
    shape = np.linalg.norm(body.surface.Phi[order, :, 2 * k], axis=1)
    plt.plot(body.surface.points[order, 0], shape, label=f"{frequency:.2f} Hz, exact {exact[k]:.2f} Hz")
plt.gca().set(xlabel="x [m]", ylabel="size of the displacement [1/√kg]", title="bending modes of the free bar")
plt.legend()

# %%
# The body, as scenes draw it:
fd.show(body)

# %%
# Frequencies of the free beam:
assert np.allclose(body.frequencies, np.repeat(exact, 2), rtol=2e-3), body.frequencies / np.repeat(exact, 2)
