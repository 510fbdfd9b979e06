"""The second-order displacement of a reduced body at the points of its surface, and the stress there.

For each pair of modes one static problem under the reference conditions, with the one factorisation that there is:
n (n + 1) / 2 right-hand sides, solved without refinement, as less is kept. Held by conditions L on coordinates that move to
second order themselves, L u_ij is what makes them stay (see `ffr_prep.model.second_order`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.body import Surface, compressed, compressed_beside, reach_of, recoordinated
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.progress import Advance
from ffr_prep.model.model import Model
from ffr_prep.model.reactions import known_loads, supports
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.model.second_order import SecondOrder
from ffr_prep.reduction.basis import Basis
from ffr_prep.solvers.factor import SupportedBody, solve_supported

_PAIRS = 48  # solved at once
MOST = 4e9  # bytes: what the load matrices of a body may have, and what its surface may take for a while; some minutes


def check_size(n: int, interfaces: int, surface: Surface | None, drawn_modes: int | None) -> None:
    """InputError where the second order of n modes would take more than `MOST` bytes: (12 + 6 I, n, n) load matrices, or,
    on the surface, the fields of all pairs of modes a few times over, and their products with one another."""
    size, drawn = 8.0 * (12 + 6 * interfaces) * n**2, min(n, drawn_modes or n)
    if size > MOST:
        raise InputError(
            f"the load matrices of {n} modes and {interfaces} interfaces would have {size / 1e9:.1f} GB: ask for fewer "
            "modes, cut the body into parts, or leave them out (linear)"
        )
    size = 0.0 if surface is None else _taken(drawn, surface)
    if size > MOST:
        raise InputError(
            f"the surface needs {drawn * (drawn + 1) // 2} static problems and {size / 1e9:.1f} GB of memory for the second "
            f"order of {drawn} modes: have only the lowest foreshorten it (drawn_modes), ask for fewer modes, cut the body "
            "into parts, or leave out the second order (linear)"
        )


def _taken(n: int, surface: Surface) -> float:
    beside = (surface.stress, None if surface.beams is None else surface.beams.modes)
    values = surface.points.size + sum(of[..., 0].size for of in beside if of is not None)
    pairs = n * (n + 1) // 2
    return 32.0 * pairs * (values + pairs)


def with_second_order(
    surface: Surface, model: Model, held: SupportedBody, conditions: ReferenceConditions, basis: Basis, advance: Advance
) -> Surface:
    """The surface with its second-order displacement, and second-order stress where it has stress.

    held : the body under its reference conditions; basis : of the modes that foreshorten, the first of those of the surface
    """
    second, n = model.second(basis.Z), basis.omega2.size
    prescribed = _prescribed(model, held, conditions, second)
    shown = second.surface if surface.stress is None else second.stressed
    parts = []
    for some in _blocks(n):
        moved = np.hstack([prescribed[:, i, i:] for i in some])
        u = solve_supported(held, -second.forces(some), moved)[0]
        for i, of_one in zip(some, np.split(u, np.cumsum([n - i for i in some])[:-1], axis=1), strict=True):
            part = shown(i, of_one)
            assert part is not None  # the model has a surface
            parts.append(part)
        advance(some.stop / n, f"second order of {some.stop} of {n} modes")
    return _collected(surface, parts, basis.omega2)


def _blocks(n: int) -> list[range]:
    """The modes in blocks that make few pairs, each with those from it on, but not one by one."""
    starts, pairs = [0], 0
    for i in range(n):
        if pairs and pairs + n - i > _PAIRS:
            starts.append(i)
            pairs = 0
        pairs += n - i
    return [range(first, last) for first, last in zip(starts, [*starts[1:], n], strict=True) if last > first]


def _collected(surface: Surface, parts: Sequence[Surface], omega2: Array) -> Surface:
    """The surface with the fields of all pairs, in the place of the modes of `parts`."""
    n, picked = surface.Phi.shape[2], slice(0, omega2.size)
    among = np.eye(n)[picked]  # the amplitudes of these modes among all
    reach = reach_of(surface.points, surface.Phi[..., picked], omega2)
    second = compressed(np.concatenate([part.Phi for part in parts], axis=-1), omega2)
    second_stress, beams = None, surface.beams
    if surface.stress is not None:
        stress = np.concatenate([part.stress for part in parts if part.stress is not None], axis=-1)
        field = compressed_beside(surface.stress[..., picked], stress, omega2, reach, (slice(0, 6),))
        second_stress = recoordinated(field, among)
    if beams is not None:
        forces = np.concatenate([part.beams.modes for part in parts if part.beams is not None], axis=-1)
        field = compressed_beside(beams.modes[..., picked], forces, omega2, reach, (slice(0, 3), slice(3, 6)))
        beams = replace(beams, second=recoordinated(field, among))
    return replace(surface, second=recoordinated(second, among), second_stress=second_stress, beams=beams)


def _prescribed(model: Model, held: SupportedBody, conditions: ReferenceConditions, second: SecondOrder) -> Array:
    """(r, n, n) what L u_ij is: the conditions are made of the known loads, and the coordinates of these are displaced by
    -E_ij beside what the independent coordinates say.
    """
    rows = supports(model.coupled, conditions)
    of_loads = np.linalg.lstsq((known_loads(model.coupled) @ rows.T), held.C.T.toarray(), rcond=None)[0].T
    return np.tensordot(of_loads @ rows, second.known, 1)
