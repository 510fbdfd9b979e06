"""A cloud of mass points with modes, from which every inertia integral is a plain sum written out with loops."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Field:
    """mass (N,), at (N, 3), Phi (N, 3, n), spin (N, 3, n) rotations, rotary (N, 3, 3) inertia of the points, K (n, n)."""

    mass: np.ndarray
    at: np.ndarray
    Phi: np.ndarray
    spin: np.ndarray
    rotary: np.ndarray
    K: np.ndarray

    @property
    def n(self) -> int:
        return self.Phi.shape[2]

    @property
    def modes(self) -> range:
        return range(self.n)

    @property
    def points(self) -> range:
        return range(len(self.mass))

    def total(self, integrand):
        """The sum of mass times integrand(position, (n, 3) shapes)."""
        return sum(self.mass[p] * integrand(self.at[p], self.Phi[p].T) for p in self.points)

    def M(self) -> np.ndarray:
        turning = sum(self.spin[p].T @ self.rotary[p] @ self.spin[p] for p in self.points)
        return self.total(lambda r, phi: phi @ phi.T) + turning


def tilde(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def field(n: int, *, seed: int = 0, points: int = 9, rotary: float = 0.0) -> Field:
    """Random modes that are neither mass-orthonormal nor uncoupled; `rotary` [kg m^2] turns with the points."""
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(n, n))
    return Field(
        mass=rng.uniform(0.2, 1.0, points),
        at=rng.uniform(-0.5, 0.5, (points, 3)) * [1.0, 0.4, 0.3] + [0.5, 0.1, 0.0],
        Phi=rng.normal(size=(points, 3, n)),
        spin=rng.normal(size=(points, 3, n)),
        rotary=rotary * np.tile(np.diag([1.0, 2.0, 2.5]), (points, 1, 1)),
        K=400 * (half @ half.T + np.eye(n)),
    )


def in_coordinates(given: Field, V: np.ndarray) -> Field:
    """The same field with the modes Phi V."""
    return replace(given, Phi=given.Phi @ V, spin=given.spin @ V, K=V.T @ given.K @ V)


def orthonormal(given: Field) -> Field:
    """The same field with modes of unit modal mass and a diagonal stiffness."""
    L = np.linalg.cholesky(given.M())
    values, W = np.linalg.eigh(np.linalg.solve(L, np.linalg.solve(L, given.K).T))
    exact = in_coordinates(given, np.linalg.solve(L.T, W))
    return replace(exact, K=np.diag(values))


def of_body(body) -> Field:
    """The field of a `synthetic.cloud` body."""
    points, n = len(body.surface.points), body.n
    nothing = np.zeros((points, 3, n))
    mass = np.array(body.provenance["masses"])
    return Field(mass, body.surface.points, body.surface.Phi, nothing, np.zeros((points, 3, 3)), np.diag(body.omega2))


def integrals(given: Field) -> dict[str, np.ndarray]:
    """The integrals of FlexibleBody in the coordinates of the field, without rotary inertia."""
    PP = np.zeros((3, 3, given.n, given.n))
    for k in range(3):
        for m in range(3):
            PP[k, m] = given.total(lambda r, phi, k=k, m=m: np.outer(phi[:, k], phi[:, m]))
    return {
        "mass": given.mass.sum(),
        "r_dm": given.total(lambda r, phi: r),
        "rr_dm": given.total(lambda r, phi: np.outer(r, r)),
        "P_dm": given.total(lambda r, phi: phi.T),
        "rP_dm": given.total(lambda r, phi: np.einsum("k,jl->klj", r, phi)),
        "PP_dm": PP,
    }
