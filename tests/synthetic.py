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
    spin = rng.normal(size=(3, 3, n))
    return _body(name, mass, at, _orthonormal(mass, raw), spin, stiffness * (1 + np.arange(n)))


def mirrored(n: int, planes: int, *, rounding: float = 0.0, name: str = "mirrored") -> FlexibleBody:
    """n modes, in equal numbers of each family, on mass points that one or two planes of symmetry share, in any order."""
    rng = np.random.default_rng(11)
    normals = [2, 1][:planes]
    at, mass = rng.uniform(0.1, 0.5, (12, 3)), rng.uniform(0.2, 1.0, 12)
    families = [rng.normal(size=(12, 3, n // 2**planes)) for _ in range(2**planes)]
    for number, k in enumerate(normals):
        flip = np.where(np.arange(3) == k, -1.0, 1.0)
        signs = [1 - 2 * (family >> number & 1) for family in range(len(families))]
        families = [
            np.concatenate([Phi, sign * flip[:, None] * Phi]) for sign, Phi in zip(signs, families, strict=True)
        ]
        at, mass = np.concatenate([at, flip * at]), np.concatenate([mass, mass])
    Phi = np.concatenate([_orthonormal(mass, Phi.reshape(3 * mass.size, -1)) for Phi in families], axis=2)
    Phi = Phi[:, :, rng.permutation(n)] + rounding * rng.normal(size=Phi.shape)
    return _body(name, mass, at, Phi, rng.normal(size=(3, 3, n)), 40.0 * (1 + np.arange(n)))


def _orthonormal(mass: np.ndarray, raw: np.ndarray) -> np.ndarray:
    """(points, 3, n) shapes as `raw` (3 points, n) spans them, with unit modal masses."""
    n = raw.shape[1]
    if not n:
        return np.zeros((mass.size, 3, 0))
    cholesky = np.linalg.cholesky(raw.T @ (np.repeat(mass, 3)[:, None] * raw))
    return np.linalg.solve(cholesky, raw.T).T.reshape(mass.size, 3, n)


def _body(
    name: str, mass: np.ndarray, at: np.ndarray, Phi: np.ndarray, spin: np.ndarray, omega: np.ndarray
) -> FlexibleBody:
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
