"""Free vibrations of bodies in a row, of which each holds the next: of the parts that a body is cut into, or of one body.

Their frames coincide while they are undeformed, so a body is carried along by the rigid motion that the cuts before it ask
for, and the elastic coordinates are all that is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ffr_prep.body.accelerations import turns
from ffr_prep.body.frame_change import mass_of_motions
from ffr_prep.body.reduced import FlexibleBody, Interface, cut_names
from ffr_prep.common.arrays import Array

_CLOSE = 1e-9  # of a squared frequency
_MOST = 100  # iterations


@dataclass(frozen=True)
class Vibrations:
    """omega (k,) [rad/s], ascending, and the elastic coordinates of all bodies in turn per motion of unit mass, (n, k)."""

    omega: Array
    shapes: Array


def free_vibrations(bodies: Sequence[FlexibleBody], count: int) -> Vibrations:
    """The slowest vibrations of the parts of a body, or of one body, that nothing holds.

    Found by subspace iteration, of twice as many vectors as are wanted and more, so that a few iterations do (Bathe, Finite
    Element Procedures, section 11.6).
    """
    rates = np.sqrt(np.concatenate([body.omega2 for body in bodies]))[:, None]
    chain = _chain(bodies)
    size = min(2 * count + 4, len(rates))
    space = np.random.default_rng(0).standard_normal((len(rates), size)) if size < len(rates) else np.eye(size)
    squares, found = np.zeros(size), space
    for _ in range(_MOST):
        space = np.linalg.qr(space)[0]
        moved = chain.momenta(space / rates) / rates  # the compliance times the mass
        before, (squares, turn) = squares, np.linalg.eigh(space.T @ moved)
        found, space = space @ turn, moved
        if np.allclose(squares[-count:], before[-count:], rtol=_CLOSE, atol=0.0) or size == len(rates):
            break
    squares, found = np.maximum(squares[::-1][:count], np.finfo(float).tiny), found[:, ::-1][:, :count]
    return Vibrations(1 / np.sqrt(squares), found / rates / np.sqrt(squares))


def damping_ratio(vibrations: Vibrations, k: int, damping: Sequence[Array]) -> float:
    """Of the k-th vibration, from 0, by the damping matrices (n, n) of the bodies."""
    shape, first = vibrations.shapes[:, k], np.cumsum([0, *(len(D) for D in damping)])
    power = sum(shape[a:b] @ D @ shape[a:b] for (a, b), D in zip(pairwise(first), damping, strict=True))
    return float(power / (2 * vibrations.omega[k]))


@dataclass(frozen=True)
class _Chain:
    """Bodies in a row, moving by their elastic coordinates alone.

    masses : (6 + n, 6 + n) of the motions of each body
    before, behind : at each cut, the rigid motion that brings the body behind it to the place where the one before it has it,
             (6, n) by the elastic coordinates of either
    first  : of each body the number of its first coordinate
    """

    masses: list[Array]
    before: list[Array]
    behind: list[Array]
    first: Array

    def momenta(self, q: Array) -> Array:
        """(n, m) what accelerations q (n, m) of the elastic coordinates ask for, with the rigid motion that keeps the whole
        free of momentum."""
        own = [q[a:b] for a, b in pairwise(self.first)]
        rigid = [np.zeros((6, q.shape[1]))]
        for k, (a, b) in enumerate(zip(self.before, self.behind, strict=True)):
            rigid.append(rigid[-1] + a @ own[k] - b @ own[k + 1])
        forces = [M @ np.vstack([g, of]) for M, g, of in zip(self.masses, rigid, own, strict=True)]
        floating = np.linalg.solve(sum(M[:6, :6] for M in self.masses), sum(f[:6] for f in forces))
        forces = [f - M[:, :6] @ floating for M, f in zip(self.masses, forces, strict=True)]
        found, carried = [f[6:] for f in forces], np.zeros_like(rigid[0])
        for k in range(len(self.before) - 1, -1, -1):
            carried = carried + forces[k + 1][:6]
            found[k] = found[k] + self.before[k].T @ carried
            found[k + 1] = found[k + 1] - self.behind[k].T @ carried
        return np.vstack(found)


def _chain(bodies: Sequence[FlexibleBody]) -> _Chain:
    cuts = [
        (one.interface(a), other.interface(b))
        for (one, other), (a, b) in zip(pairwise(bodies), map(cut_names, range(1, len(bodies))), strict=True)
    ]
    return _Chain(
        masses=[mass_of_motions(body) for body in bodies],
        before=[_motion_of_body(a) for a, _ in cuts],
        behind=[_motion_of_body(b) for _, b in cuts],
        first=np.cumsum([0, *(body.n for body in bodies)]),
    )


def _motion_of_body(at: Interface) -> Array:
    """(6, n) the rigid motion about the origin that moves a place as its elastic shapes do."""
    return np.vstack([at.phi_t - np.einsum("akm,m,aj->kj", turns(), at.position, at.phi_r), at.phi_r])
