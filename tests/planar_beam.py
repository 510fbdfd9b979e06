"""A slender beam along x that bends in the x-y plane, as mass points with Ritz modes: light enough for many runs."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from ffr_prep.body import FlexibleBody, Interface, Surface


def planar_beam(
    name: str,
    length: float,
    mass: float,
    bending: float,
    modes: int,
    *,
    start: float = 0.0,
    points: int = 40,
    out_of_plane: bool = False,
) -> FlexibleBody:
    """Clamped to its frame at "root" (x = start), free at "tip"; bending = EI; modes of x^2, x^3, ... by Rayleigh and Ritz.

    out_of_plane : bends along z as well, with as many modes
    """
    s = (np.arange(points) + 0.5) / points * length
    powers = np.arange(2, 2 + modes + 2)
    shape = (s[:, None] / length) ** powers
    at, weight = np.polynomial.legendre.leggauss(12)
    g, w = 0.5 * length * (at + 1), 0.5 * length * weight
    curvature = powers * (powers - 1) * (g[:, None] / length) ** (powers - 2) / length**2
    K, M = bending * curvature.T @ (w[:, None] * curvature), mass / points * shape.T @ shape
    omega2, vectors = eigh(K, M)
    omega2, vectors = omega2[:modes], vectors[:, :modes]
    slope = (powers * 1.0 / length) @ vectors
    across = [1, 2] if out_of_plane else [1]
    n = modes * len(across)
    Phi, tip_t, tip_r = np.zeros((points, 3, n)), np.zeros((3, n)), np.zeros((3, n))
    for k, axis in enumerate(across):
        own = slice(k * modes, (k + 1) * modes)
        Phi[:, axis, own] = shape @ vectors
        tip_t[axis, own] = vectors.sum(axis=0)
        tip_r[3 - axis, own] = slope if axis == 1 else -slope
    u = np.zeros((points, 3))
    u[:, 0] = start + s
    m = np.full(points, mass / points)
    rr = np.einsum("p,pk,pl->kl", m, u, u) + np.diag([0, 0.5, 0.5]) * 1e-4 * mass * length**2
    zero = np.zeros((3, n))
    return FlexibleBody(
        name=name,
        mass=mass,
        r_dm=m @ u,
        rr_dm=rr,
        P_dm=np.einsum("p,pkj->kj", m, Phi),
        rP_dm=np.einsum("p,pk,plj->klj", m, u, Phi),
        PP_dm=np.einsum("p,pki,plj->klij", m, Phi, Phi),
        omega2=np.tile(omega2, len(across)),
        interfaces=(
            Interface("root", np.array([start, 0, 0]), zero, zero),
            Interface("tip", np.array([start + length, 0, 0]), tip_t, tip_r),
        ),
        surface=Surface(u, [[0, 1, 2]], Phi),
        provenance={},
    )
