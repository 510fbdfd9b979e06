"""The second-order displacement of a reduced body at the points of its surface, and the stress there.

For each pair of modes one static problem under the reference conditions, with the one factorisation that there is:
n (n + 1) / 2 right-hand sides. Held by conditions L on coordinates that move to second order themselves, L u_ij is what
makes them stay (see `ffr_prep.model.second_order`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.body import Surface, compressed, compressed_groups
from ffr_prep.common.arrays import Array
from ffr_prep.common.progress import Advance
from ffr_prep.model.model import Model
from ffr_prep.model.reactions import known_loads, supports
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.model.second_order import SecondOrder
from ffr_prep.reduction.basis import Basis
from ffr_prep.solvers.factor import SupportedBody, solve_refined


def with_second_order(
    surface: Surface, model: Model, held: SupportedBody, conditions: ReferenceConditions, basis: Basis, advance: Advance
) -> Surface:
    """The surface with its second-order displacement, and second-order stress where it has stress.

    held : the body under its reference conditions

    Raises ComputationError when a static problem fails.
    """
    second, n = model.second(basis.Z), basis.omega2.size
    prescribed = _prescribed(model, held, conditions, second)
    shown = second.surface if surface.stress is None else second.stressed
    parts = []
    for i in range(n):
        u = solve_refined(held, -second.forces(i), prescribed[:, i, i:])[0]
        part = shown(i, u)
        assert part is not None  # the model has a surface
        parts.append(part)
        advance((i + 1) / n, f"second order of {i + 1} of {n} modes")
    return _collected(surface, parts, basis.omega2)


def _collected(surface: Surface, parts: Sequence[Surface], omega2: Array) -> Surface:
    """The surface with the fields of all pairs, in the place of the modes of `parts`."""
    second = compressed(np.concatenate([part.Phi for part in parts], axis=-1), omega2)
    stress = [part.stress for part in parts if part.stress is not None]
    second_stress = compressed(np.concatenate(stress, axis=-1), omega2) if stress else None
    forces = [part.beams.modes for part in parts if part.beams is not None]
    beams = surface.beams
    if beams is not None and forces:
        forces_and_moments = (slice(0, 3), slice(3, 6))
        pairs = np.concatenate(forces, axis=-1)
        beams = replace(beams, second=compressed_groups(pairs, omega2, forces_and_moments))
    return replace(surface, second=second, second_stress=second_stress, beams=beams)


def _prescribed(model: Model, held: SupportedBody, conditions: ReferenceConditions, second: SecondOrder) -> Array:
    """(r, n, n) what L u_ij is: the conditions are made of the known loads, and the coordinates of these are displaced by
    -E_ij beside what the independent coordinates say.
    """
    rows = supports(model.coupled, conditions)
    of_loads = np.linalg.lstsq((known_loads(model.coupled) @ rows.T), held.C.T, rcond=None)[0].T
    return np.tensordot(of_loads @ rows, second.known, 1)
