"""Vibrations of a clamped solid that turns, in axes that turn with it: large displacements, without beams or floating frames.

Green's strain and a linear law between it and the second Piola-Kirchhoff stress; the balance under centrifugal forces by
Newton's method, and small vibrations across the plane of rotation about it (of a blade in that plane no velocity has a
Coriolis force across it). Quadratic hexahedra of scikit-fem.

    int S : F^T grad v = W^2 int rho (r, 0) . v        S = lambda tr E + 2 mu E,  E = (F^T F - 1) / 2
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse.linalg as sparse
import skfem
from skfem.helpers import ddot, dot, grad, trace

Array = np.ndarray
STEPS, LEFT = 12, 1e-7  # of Newton's method; of the forces, relative
ONE = np.eye(3)[:, :, None, None]


def blade_mesh(straight: float, swept: float, angle: float, section: tuple[float, float]) -> skfem.MeshHex:
    """Along x from its root, `straight` [m] long, and on by `swept` [m] at an angle [rad] in the plane xy; width and
    thickness of the section [m]."""
    along = np.concatenate([np.linspace(0, straight, 49), straight + np.linspace(0, swept, 11)[1:]])
    width, thick = section
    mesh = skfem.MeshHex.init_tensor(
        along, np.linspace(-width / 2, width / 2, 3), np.linspace(-thick / 2, thick / 2, 2)
    )
    x, y, z = mesh.p
    beyond, c, s = x - straight, np.cos(angle), np.sin(angle)
    places = np.array(
        [np.where(beyond > 0, straight + beyond * c - y * s, x), np.where(beyond > 0, beyond * s + y * c, y), z]
    )
    corner = np.abs(beyond) < 1e-9
    places[0, corner] -= y[corner] * np.tan(angle / 2)
    return skfem.MeshHex(places, mesh.t)


def flaps(mesh: skfem.MeshHex, law: tuple[float, float, float], hub: float, speeds: Sequence[float]) -> Array:
    """(speeds, 3) [rad/s] of the lowest vibrations across the plane of rotation, at speeds [rad/s] about z at x = -hub.

    law : lambda, mu [N/m^2] and rho [kg/m^3]
    """
    lame, mu, rho = law
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHexS2()), intorder=4)
    M = skfem.BilinearForm(lambda u, v, w: rho * dot(u, v)).assemble(basis)
    out = skfem.BilinearForm(lambda u, v, w: rho * (u[0] * v[0] + u[1] * v[1])).assemble(basis)
    pull = skfem.LinearForm(lambda v, w: rho * ((hub + w.x[0]) * v[0] + w.x[1] * v[1])).assemble(basis)
    free = np.setdiff1d(np.arange(M.shape[0]), basis.get_dofs(lambda x: np.abs(x[0]) < 1e-9).all())
    u, found = np.zeros(M.shape[0]), []
    for speed in speeds:
        for _ in range(STEPS):
            forces, K = _elastic(basis, u, lame, mu)
            left = speed**2 * (pull + out @ u) - forces
            K = (K - speed**2 * out)[free][:, free].tocsc()
            if np.abs(left[free]).max() <= LEFT * speed**2 * np.abs(pull).max():
                break
            u[free] += sparse.spsolve(K, left[free])
        found.append(_across(basis, K, M[free][:, free].tocsc(), free))
    return np.array(found)


def _elastic(basis: skfem.Basis, u: Array, lame: float, mu: float) -> tuple[Array, Array]:
    """Elastic forces and their derivative."""

    def stress(w: dict[str, Array]) -> tuple[Array, Array]:
        F = ONE + w["g"]
        E = 0.5 * (np.einsum("ki...,kj...->ij...", F, F) - ONE)
        return F, 2 * mu * E + lame * ONE * trace(E)

    def forces(v: Array, w: dict[str, Array]) -> Array:
        F, S = stress(w)
        return ddot(np.einsum("ik...,kj...->ij...", F, S), grad(v))

    def stiffness(u: Array, v: Array, w: dict[str, Array]) -> Array:
        F, S = stress(w)
        du, dv = (np.einsum("ki...,kj...->ij...", F, grad(one)) for one in (u, v))
        eu, ev = 0.5 * (du + np.swapaxes(du, 0, 1)), 0.5 * (dv + np.swapaxes(dv, 0, 1))
        by_stress = np.einsum("kj...,ij...,ik...->...", S, grad(u), grad(v))
        return 2 * mu * ddot(eu, ev) + lame * trace(eu) * trace(ev) + by_stress

    g = basis.interpolate(u).grad
    return skfem.LinearForm(forces).assemble(basis, g=g), skfem.BilinearForm(stiffness).assemble(basis, g=g)


def _across(basis: skfem.Basis, K: Array, M: Array, free: Array) -> Array:
    """(3,) [rad/s] of the lowest vibrations that move most along z."""
    squares, shapes = sparse.eigsh(K, k=7, M=M, sigma=0.0)
    whole = np.zeros((basis.N, squares.size))
    whole[free] = shapes
    reach = [np.abs(whole[basis.nodal_dofs[c]]).max(axis=0) for c in range(3)]
    return np.sqrt(np.sort(squares[reach[2] > reach[1]]))[:3]
