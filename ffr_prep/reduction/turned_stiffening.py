"""The load matrices of a body in another frame, from the body alone.

Conversion of the reference conditions (`ffr_prep.reduction.conversion`) changes the matrices of `FlexibleBody.stiffening`
twice. The shapes: the new modes are old ones and rigid motions (`ffr_prep.body.frame_change`). The loads: each matrix
belongs to a unit load and the reactions that hold it under the reference conditions, and those of the new conditions are
loads that have matrices of their own: forces and moments at interfaces or, for the mean axis, inertial loads.

So the converted matrices are those that a reduction in the new frame computes: of solids and beams to rounding. Of plates,
whose bending moments stiffen nothing and whose fields turn up to the size of an element, they are nearly that.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from ffr_prep.body import FlexibleBody
from ffr_prep.body.accelerations import INERTIAL
from ffr_prep.body.frame_change import loads_on_motions, stiffening_in
from ffr_prep.body.mean_axis import idle_loads
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reactions import supports
from ffr_prep.model.reference import ReferenceConditions

_ROUNDING = 1e-9  # beside one: of what a support carries
_LEAVE_OUT = "or leave them out (replace(body, stiffening=None) in Python, --linear)"


def turned_stiffening(body: FlexibleBody, model: CoupledModel, conditions: ReferenceConditions, Z: Array) -> Array:
    """(12 + 6 I, k, k) load matrices of the modes Z (6 + n, k) under the new reference conditions.

    model : the body in the coordinates of its six rigid and n elastic motions

    Raises InputError when the new frame is held at an interface whose loads have no matrices.
    """
    loads, held = loads_on_motions(body), supports(model, conditions)
    idle = np.concatenate([np.zeros(INERTIAL, bool), idle_loads(body)])
    _check_known(body, idle, held)
    new = stiffening_in(body, Z, _reactions(body, loads, held @ loads) @ held)
    new[idle] = 0.0
    return new


def _reactions(body: FlexibleBody, loads: Array, L: Array) -> Array:
    """(12 + 6 I, r) the reactions of the conditions L (r, 6 + n) to the loads (12 + 6 I, 6 + n).

    Six follow from equilibrium; more are shared as the flexibility of the body says, as far as its modes know it.
    """
    held, wanted = L[:, :6].T, -loads[:, :6].T
    balanced = np.linalg.lstsq(held, wanted, rcond=None)[0]
    free = scipy.linalg.null_space(held, rcond=1e-9)
    flexible = L[:, 6:] / body.omega2
    gap = free.T @ (flexible @ L[:, 6:].T @ balanced + flexible @ loads[:, 6:].T)
    shared = np.linalg.lstsq(free.T @ flexible @ L[:, 6:].T @ free, -gap, rcond=None)[0]
    return np.asarray((balanced + free @ shared).T)


def _check_known(body: FlexibleBody, idle: Array, held: Array) -> None:
    lost = np.flatnonzero((idle & (np.abs(held) > _ROUNDING).any(axis=0))[INERTIAL:])
    if lost.size:
        name = body.interfaces[lost[0] // 6].name
        raise InputError(
            f"loads at interface {name!r} have no load matrices in body {body.name!r} (a point that was added after "
            f"the reduction?): the frame cannot be held there; choose other interfaces, {_LEAVE_OUT}"
        )
