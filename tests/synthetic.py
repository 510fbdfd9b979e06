"""Flexible bodies made of a few mass points with random mass-orthonormal modes: every integral is a short sum."""

from __future__ import annotations

import numpy as np

from ffr_prep.body import FlexibleBody, Interface, Surface


def cloud(n: int, *, seed: int = 0, points: int = 12, stiffness: float = 40.0, name: str = "cloud") -> FlexibleBody:
    """n modes on `points` mass points in a box of about 1 x 0.4 x 0.3 m; interfaces "a", "b", "c" at three of them."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.2, 1.0, points)
    at = rng.uniform(-0.5, 0.5, (points, 3)) * [1.0, 0.4, 0.3] + [0.5, 0.1, 0.0]
    raw = rng.normal(size=(3 * points, n))
    weight = np.repeat(mass, 3)
    cholesky = np.linalg.cholesky(raw.T @ (weight[:, None] * raw)) if n else np.zeros((0, 0))
    Phi = np.linalg.solve(cholesky, raw.T).T.reshape(points, 3, n) if n else np.zeros((points, 3, 0))
    spin = rng.normal(size=(3, 3, n))
    omega = stiffness * (1 + np.arange(n))
    return FlexibleBody(
        name=name,
        mass=mass.sum(),
        r_dm=mass @ at,
        rr_dm=np.einsum("p,pk,pl->kl", mass, at, at),
        P_dm=np.einsum("p,pkj->kj", mass, Phi),
        rP_dm=np.einsum("p,pk,plj->klj", mass, at, Phi),
        PP_dm=np.einsum("p,pki,plj->klij", mass, Phi, Phi),
        omega2=omega**2,
        interfaces=tuple(Interface(c, at[k], Phi[k], spin[k]) for k, c in enumerate("abc")),
        surface=Surface(at, [[0, 1, 2], [1, 2, 3]], Phi),
        provenance={"masses": mass.tolist()},
    )
