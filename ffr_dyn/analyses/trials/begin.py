"""How a run begins: as its scene says, quasi-static, steady or periodic."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Literal, get_args

from ffr_dyn.analyses.rotating.periodic import periodically
from ffr_dyn.analyses.states import held
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.mobility import rigid_freedom
from ffr_dyn.consistency.quasi_static import quasi_static
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.linear.steady_state import steadily
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

Beginning = Literal["as-given", "quasi-static", "steady", "periodic"]  # the default and the others


def begun(assembled: Assembled, start: float, begin: Beginning, method: Integrator | Within | None = None) -> Assembled:
    """The state that a run begins in; a method without steps of its own is no method of a periodic motion."""
    if begin not in get_args(Beginning):
        raise InputError(f"begin is {begin!r}; it must be one of {', '.join(map(repr, get_args(Beginning)))}")
    if begin == "quasi-static":
        return _quasi_statically(assembled, start)
    if begin == "periodic":
        return periodically(assembled, start, None if isinstance(method, Within) else method)
    return steadily(assembled, start) if begin == "steady" else assembled


def _quasi_statically(assembled: Assembled, start: float) -> Assembled:
    """Found from the bodies as they are assembled; where that leads nowhere, from where the driven scene would rest."""
    try:
        return quasi_static(assembled, start)
    except ComputationError:
        x = _at_rest(assembled, start)
        if x is None:
            raise
        return quasi_static(replace(assembled, x=x), start)


def _at_rest(assembled: Assembled, start: float) -> Array | None:
    """(X,) the equilibrium with all drivers held; None where there is none, or rigid motion is free."""
    scene = assembled.system.scene
    with suppress(InputError, ComputationError):
        if not rigid_freedom(scene, assembled, start):
            return steadily(assemble(held(scene, start), time=start), start).x
    return None
