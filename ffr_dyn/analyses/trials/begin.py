"""How a run begins: as its scene says, quasi-static, steady or periodic."""

from __future__ import annotations

from typing import Literal, get_args

from ffr_dyn.analyses.rotating.periodic import periodically
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.quasi_static import quasi_static
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.linear.steady_state import steadily
from ffr_prep.common.errors import InputError

Beginning = Literal["as-given", "quasi-static", "steady", "periodic"]  # the default and the others


def begun(assembled: Assembled, start: float, begin: Beginning, method: Integrator | Within | None = None) -> Assembled:
    """The state that a run begins in; a method without steps of its own is no method of a periodic motion."""
    if begin not in get_args(Beginning):
        raise InputError(f"begin is {begin!r}; it must be one of {', '.join(map(repr, get_args(Beginning)))}")
    if begin == "quasi-static":
        return quasi_static(assembled, start)
    if begin == "periodic":
        return periodically(assembled, start, None if isinstance(method, Within) else method)
    return steadily(assembled, start) if begin == "steady" else assembled
