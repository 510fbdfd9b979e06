"""The second-order displacement of models joined at interfaces (`ffr_prep.model.second_order`).

F of the whole is that of the parts; besides, static displacements load parts through ties, whose forces do work on what
the interfaces and arms there move to second order. The coordinates that a tie eliminates follow the other side by the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import Surface
from ffr_prep.body.accelerations import INERTIAL, turned
from ffr_prep.common.arrays import Array
from ffr_prep.model.model import Model, merged
from ffr_prep.model.second_order import SecondOrder

Flow = tuple[list[tuple[Array, sp.csr_array]], list[Array]]


@dataclass(frozen=True)
class Eliminated:
    """A tie: moves (Z_1 + Z_2 + ..., 6) what its dependent coordinates move, of all coordinates; master (6, ...) the
    coordinates that they follow by rigid (6, 6) at the arm (3,) [m]; at: part and interface of these."""

    moves: sp.csr_array
    master: sp.csr_array
    rigid: Array
    arm: Array
    at: tuple[int, int]


def tied_second_order(
    models: Sequence[Model],
    X: sp.csr_array,
    own: Sequence[sp.csr_array],
    steps: Sequence[Eliminated],
    flow: Flow,
    known: Array,
    basis: Array,
) -> SecondOrder:
    """That of the basis (Z, n) of models with the coordinates own (Z_p, Z), together X.

    flow  : what unit coordinates make ties carry: forces times arms (Z, 3, 3) with the rotations (3, Z) of these, and for
            each part the amplitudes (12 + 6 I, Z) of its known loads
    known : (12 + 6 I, n, n) of the whole
    """
    parts = [model.second(x @ basis) for model, x in zip(models, own, strict=True)]
    arms, loads = flow

    def forces(some: range) -> Array:
        through_ties = np.hstack([carried(i) for i in some])
        return np.asarray(sum((x.T @ part.forces(some) for part, x in zip(parts, own, strict=True)), through_ties))

    def carried(i: int) -> Array:
        total = np.zeros((X.shape[1], basis.shape[1] - i))
        for part, load in zip(parts, loads, strict=True):
            total += load.T @ part.known[:, i, i:]
        for S, rotation in arms:
            total += S.reshape(len(S), 9) @ turned(rotation @ basis[:, i], rotation @ basis[:, i:]).reshape(9, -1)
        return total

    def followed(i: int) -> Array:
        whole = X @ basis
        beside = np.zeros((X.shape[0], basis.shape[1] - i))
        for step in steps:
            rotation = step.master[3:] @ whole
            six = step.master @ beside - parts[step.at[0]].known[_six(step.at[1]), i, i:]
            six = step.rigid @ six
            six[:3] += np.einsum("klm,l->km", turned(rotation[:, i], rotation[:, i:]), step.arm)
            beside += step.moves @ six
        return beside

    def shown(
        of_part: Callable[[SecondOrder], Callable[[int, Array], Surface | None]], i: int, z: Array
    ) -> Surface | None:
        ends = np.cumsum([x.shape[0] for x in own])[:-1]
        of_parts = np.split(X @ z + followed(i), ends)
        return merged([of_part(part)(i, mine) for part, mine in zip(parts, of_parts, strict=True)])

    return SecondOrder(
        known=known,
        forces=forces,
        surface=lambda i, z: shown(lambda part: part.surface, i, z),
        stressed=lambda i, z: shown(lambda part: part.stressed, i, z),
    )


def _six(interface: int) -> slice:
    return slice(INERTIAL + 6 * interface, INERTIAL + 6 * interface + 6)
