"""
Is the mesh fine enough
=======================

A clamped strip, meshed with bricks of first order and of second order, one and more through its thickness. Bricks of first
order lock in bending: the strip is up to fifty times too stiff. Every reduction of a solid tells how much too high its
frequencies are by its mesh, from jumps and free surfaces of its own stress, without another mesh.

Source: S. S. Rao, Mechanical Vibrations, 5th ed. (2011), section 8.5: the first frequency of a slender cantilever is
1.87510407^2 / (2 pi L^2) sqrt(E I / (rho A)).
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_prep as fp

E, rho, L, h = 7e10, 2700.0, 0.6, 0.01
errors: list[tuple[float, float]] = []
exact = 1.87510407**2 / (2 * np.pi * L**2) * np.sqrt(E * h**2 / 12 / rho)  # Hz
for order, mark in ((1, "o"), (2, "s")):
    true, told = [], []
    for layers in (1, 2, 3):
        size = {"length": L, "thickness": h, "width": 0.02, "along": 30 * layers, "across": 1, "layers": layers}
        mesh = fp.read_mesh("meshes/pendulum.geo", numbers=size, order=order)
        model = fp.from_mesh(mesh, fp.Material("aluminium", E, 0.33, rho), [fp.InterfaceRegion("hinge")])
        body = fp.reduce(model, fp.Request(name="strip", reference=fp.FixedTo("hinge"), reduction=fp.Eigenmodes(2)))
        true.append(body.frequencies[0] / exact - 1)
        told.append(body.provenance["mesh_error"]["too_high"][0])
    plt.loglog(true, told, mark, label=f"bricks of order {order}")
    errors += zip(true, told, strict=True)
plt.plot([1e-3, 3], [1e-3, 3], "k:", lw=1)
plt.gca().set(xlabel="relative error of the first frequency", ylabel="relative error that the body tells")
plt.title("1, 2, 3 elements through the thickness")
plt.legend()
assert np.allclose(*np.transpose(errors), rtol=0.15, atol=4e-3)
