"""Vibrations of a blade that turns, by a geometrically exact beam in axes that turn with it: no floating frames, no modes.

The beam of Simo and Reissner with the stretch that twist gives to the outer fibres (Wagner), of elements with two nodes, one
point of integration and six coordinates u, theta each; sections turn by exp(theta). In axes that turn at W about z

    V - T_0 = 1/2 int C gamma^2 + D kappa^2 + E I_p gamma_1 kappa_1^2 - W^2 rho (section's second moment about z) ds

is least, and its second derivative with the mass is that of vibrations across the plane of rotation (in which no velocity
across it has a Coriolis force, but for the thickness of the blade). Gradients are complex steps, Hessians their differences;
frequencies of two meshes are extrapolated. (Simo & Vu-Quoc, CMAME 58 (1986) 79-116; Hodges & Dowell, NASA TN D-7818, 1974.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigsh, spsolve

from ffr_prep.structures.sections import Section

Array = np.ndarray
STEP, TINY, ITERATIONS, LEFT = 1e-5, 1e-30, 30, 1e-12  # of differences, of complex steps; of Newton's method


@dataclass(frozen=True)
class Blade:
    """Points (nodes, 3) [m] of the axis, the hub's included, directions (elements, 3, 3) of its sections in columns: along,
    across in the plane, z;  E, G [N/m^2], rho [kg/m^3]."""

    points: Array
    axes: Array
    section: Section
    E: float
    G: float
    rho: float

    @property
    def lengths(self) -> Array:
        return np.linalg.norm(np.diff(self.points, axis=0), axis=1)

    @property
    def second(self) -> Array:
        """(2,) [m^4] of the area: of its width, of its thickness."""
        both = (self.section.Iy, self.section.Iz)
        return np.array([max(both), min(both)])


def swept_blade(counts: tuple[int, int], lengths: tuple[float, float], angle: float, hub: float, **of: object) -> Blade:
    """Straight along x from the hub's radius, then at an angle [rad] in the plane, in so many elements."""
    along = np.concatenate([hub + np.linspace(0, lengths[0], counts[0] + 1), np.full(counts[1], hub + lengths[0])])
    out = np.concatenate([np.zeros(counts[0] + 1), np.linspace(0, lengths[1], counts[1] + 1)[1:]])
    points = np.stack([along + out * np.cos(angle), out * np.sin(angle), 0 * out], axis=-1)
    ahead = np.diff(points, axis=0)
    e1 = ahead / np.linalg.norm(ahead, axis=1)[:, None]
    e3 = np.tile([0.0, 0.0, 1.0], (len(e1), 1))
    return Blade(points, np.stack([e1, np.cross(e3, e1), e3], axis=-1), **of)  # type: ignore[arg-type]


def flaps(blades: Sequence[Blade], speeds: Sequence[float], count: int = 3) -> Array:
    """(speeds, count) [rad/s] of the lowest vibrations across the plane of rotation, extrapolated from a blade and one of
    twice as many elements."""
    coarse, fine = (
        np.array([_flaps(blade, u, speed, count) for speed, u in _turned(blade, speeds)]) for blade in blades
    )
    return (4 * fine - coarse) / 3


def _turned(blade: Blade, speeds: Sequence[float]) -> list[tuple[float, Array]]:
    """Every speed [rad/s] with the displacements and turns (nodes * 6,) of its steady motion."""
    numbers, u, found = _numbers(blade), np.zeros(6 * len(blade.points)), []
    for speed in speeds:
        for _ in range(ITERATIONS):
            forces = np.zeros(u.size)
            np.add.at(forces, numbers, _gradient(blade, speed, u[numbers]))
            step = spsolve(_assembled(blade, _hessian(blade, speed, u[numbers])), -forces[6:])
            u[6:] += step
            if np.abs(step).max() <= LEFT:
                break
        found.append((speed, u.copy()))
    return found


def _flaps(blade: Blade, u: Array, speed: float, count: int) -> Array:
    numbers = _numbers(blade)
    K, M = (_assembled(blade, of) for of in (_hessian(blade, speed, u[numbers]), _mass(blade, u[numbers])))
    squares, shapes = eigsh(K, k=2 * count + 1, M=M, sigma=0.0)
    reach = np.abs(shapes).reshape(-1, 6, squares.size).max(axis=0)
    found: Array = np.sqrt(np.sort(squares[reach[2] > reach[1]])[:count])
    return found


def _numbers(blade: Blade) -> Array:
    """(elements, 12) of the coordinates."""
    return 6 * np.arange(len(blade.lengths))[:, None] + np.arange(12)


def _assembled(blade: Blade, of: Array) -> sparse.csc_matrix:
    """Without the first node, which the hub holds; symmetric."""
    numbers = _numbers(blade)
    rows, columns = np.repeat(numbers, 12, axis=1).ravel(), np.tile(numbers, (1, 12)).ravel()
    size = 6 * len(blade.points)
    whole = sparse.coo_matrix((of.ravel(), (rows, columns)), (size, size)).tocsc()[6:][:, 6:]
    return (whole + whole.T) / 2


def _energy(blade: Blade, speed: float, u: Array) -> Array:
    """(..., elements) V - T_0 of coordinates (..., elements, 12)."""
    one, turn_one, two, turn_two = (u[..., 3 * k : 3 * k + 3] for k in range(4))
    L, section, (wide, thick) = blade.lengths, blade.section, blade.second
    ends = blade.points[:-1] + one, blade.points[1:] + two
    turn = 0.5 * (turn_one + turn_two)
    axes = _rotation(turn) @ blade.axes
    gamma = _in(axes, (ends[1] - ends[0]) / L[:, None]) - [1.0, 0.0, 0.0]
    kappa = _in(blade.axes, np.einsum("...ij,...j->...i", _tangent(turn), (turn_two - turn_one) / L[:, None]))
    stretch = [blade.E * section.A, section.ky * blade.G * section.A, section.kz * blade.G * section.A]
    bend = [blade.G * section.J, blade.E * thick, blade.E * wide]
    outer = blade.E * (wide + thick) * gamma[..., 0] * kappa[..., 0] ** 2
    from_axis = sum(ends[i][..., :2] * ends[j][..., :2] for i, j in ((0, 0), (0, 1), (1, 1))).sum(-1) / 3
    sections = wide * (axes[..., :2, 1] ** 2).sum(-1) + thick * (axes[..., :2, 2] ** 2).sum(-1)
    turning = blade.rho * (section.A * from_axis + sections)
    return 0.5 * L * ((stretch * gamma**2 + bend * kappa**2).sum(-1) + outer - speed**2 * turning)


def _gradient(blade: Blade, speed: float, u: Array) -> Array:
    """(elements, 12)"""
    shifted = u + 1j * TINY * np.eye(12)[:, None, :]
    return (_energy(blade, speed, shifted).imag / TINY).T


def _hessian(blade: Blade, speed: float, u: Array) -> Array:
    """(elements, 12, 12)"""
    steps = STEP * np.eye(12)
    return np.stack(
        [(_gradient(blade, speed, u + h) - _gradient(blade, speed, u - h)) / (2 * STEP) for h in steps], axis=-1
    )


def _mass(blade: Blade, u: Array) -> Array:
    """(elements, 12, 12)"""
    L, section, (wide, thick) = blade.lengths, blade.section, blade.second
    back = _tangent(0.5 * (u[:, 3:6] + u[:, 9:12]))
    inertia = blade.axes @ np.diag(blade.rho * np.array([wide + thick, thick, wide])) @ blade.axes.swapaxes(1, 2)
    inertia = back.swapaxes(1, 2) @ inertia @ back
    M = np.zeros((len(L), 12, 12))
    for i in (0, 6):
        for j in (0, 6):
            share = (L / (3 if i == j else 6))[:, None, None]
            M[:, i : i + 3, j : j + 3] = share * blade.rho * section.A * np.eye(3)
            M[:, i + 3 : i + 6, j + 3 : j + 6] = share * inertia
    return M


def _in(axes: Array, vectors: Array) -> Array:
    found: Array = np.einsum("...ji,...j->...i", axes, vectors)
    return found


def _rotation(turn: Array) -> Array:
    """exp of rotation vectors (..., 3), of less than half a radian."""
    return _series(turn, (1, -1 / 6, 1 / 120, -1 / 5040), (1 / 2, -1 / 24, 1 / 720, -1 / 40320), 1)


def _tangent(turn: Array) -> Array:
    """(..., 3, 3) of rates in the turned axes by those of the rotation vector."""
    return _series(turn, (1 / 2, -1 / 24, 1 / 720, -1 / 40320), (1 / 6, -1 / 120, 1 / 5040, -1 / 362880), -1)


def _series(turn: Array, first: Sequence[float], second: Sequence[float], sign: int) -> Array:
    square, S = (turn * turn).sum(-1)[..., None, None], _skew(turn)
    value: Callable[[Sequence[float]], Array] = lambda of: sum(c * square**k for k, c in enumerate(of))  # noqa: E731
    return np.eye(3) + sign * value(first) * S + value(second) * (S @ S)


def _skew(v: Array) -> Array:
    x, y, z = (v[..., k] for k in range(3))
    none = np.zeros_like(x)
    rows = ([none, -z, y], [z, none, -x], [-y, x, none])
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
