"""How a scene is to be analysed: the analysis and its settings, times, what to keep. `ffr_dyn.analyses.run` does
what they say.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, fields
from typing import Any

from ffr_dyn.analyses.bounded import Bounded
from ffr_dyn.analyses.efforts import Effort
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.mixed import Causal
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import Stabilisation


@dataclass(frozen=True)
class Forward:
    """Forward dynamics, with events to find."""

    events: tuple[Event, ...] = ()


@dataclass(frozen=True)
class Kinematic:
    """Positions, velocities and accelerations of a driven scene."""


@dataclass(frozen=True)
class Inverse:
    """Inverse dynamics; elastic coordinates are dynamic, or quasi-static."""

    quasi_static: bool = False


@dataclass(frozen=True)
class Mixed:
    """Mixed dynamics; see `ffr_dyn.analyses.mixed.mixed`."""

    unknown: tuple[Effort, ...]
    known: tuple[str, ...] | None = None
    solution: Causal | Bounded | None = None


@dataclass(frozen=True)
class Assemble:
    """Consistent positions and velocities."""


@dataclass(frozen=True)
class Static:
    """Static equilibrium."""


@dataclass(frozen=True)
class Linearise:
    """Linearised equations; inputs are efforts and names of loads, quantities such as "rod.tip.position.y" their outputs."""

    inputs: tuple[Effort | str, ...] = ()
    quantities: tuple[str, ...] = ()
    at_equilibrium: bool = False


OverTime = Forward | Kinematic | Inverse | Mixed
OfMoment = Assemble | Static | Linearise


@dataclass(frozen=True)
class Charted:
    """What `ffr-dyn chart` compares (docs/chart.md).

    measures : such as "deflection:rod"; () for those that fit the scene
    methods  : (name, steps [s] or tolerances), without numbers where a ladder is to be chosen; () for all methods
    modes    : elastic coordinates to keep of every flexible body, None for all
    drops    : terms to leave out, one set after the other, beside none
    """

    _: KW_ONLY
    measures: tuple[str, ...] = ()
    methods: tuple[tuple[str, tuple[float, ...]], ...] = ()
    modes: tuple[int | None, ...] = (None,)
    drops: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True)
class Settings:
    """An analysis over a time [s]; `method` and `stabilisation` are of those that integrate, `chart` of forward dynamics."""

    _: KW_ONLY
    start: float
    end: float
    output_step: float
    method: Integrator
    stabilisation: Stabilisation
    outputs: tuple[str, ...] = ("default",)
    analysis: OverTime = Forward()
    chart: Charted = Charted()


@dataclass(frozen=True)
class MomentSettings:
    """An analysis at one `time` [s]."""

    _: KW_ONLY
    time: float = 0.0
    outputs: tuple[str, ...] = ("default",)
    analysis: OfMoment = Static()


def settings_of(method: type[Any]) -> list[str]:
    """Names of what a method of fixed steps takes beside its step."""
    return [field.name for field in fields(method) if field.name != "step"]
