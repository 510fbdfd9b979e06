"""How a scene is to be analysed: the analysis and its settings, times, what to keep. `ffr_dyn.analyses.run` does
what they say.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, fields
from numbers import Real
from typing import Any

from ffr_dyn.analyses.registry import OfMoment, OverTime, analysis
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_prep.common.errors import require_kind


@dataclass(frozen=True)
class Charted:
    """The variants that `ffr-dyn chart` compares (docs/chart.md).

    measures : such as "deflection:rod"; () for those that fit the scene
    methods  : (name, steps [s] or tolerances), without numbers where a ladder is to be chosen; () for all methods
    modes    : elastic coordinates to keep of every flexible body, None for all
    drops    : terms to leave out, one set after the other, beside none

    >>> chart = fd.Charted(measures=("deflection:rod",), modes=(2, 4, None))
    """

    _: KW_ONLY
    measures: tuple[str, ...] = ()
    methods: tuple[tuple[str, tuple[float, ...]], ...] = ()
    modes: tuple[int | None, ...] = (None,)
    drops: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True)
class Settings:
    """An analysis over a time.

    start, end : of the time [s];  output_step : between rows [s];  outputs : names or patterns of the quantities to keep
    method, stabilisation : of analyses that integrate;  chart : of forward dynamics

    Raises InputError for times that are no numbers.

    >>> result = fd.run(scene, fd.Settings(start=0.0, end=1.0, output_step=0.01, method=fd.ROS2(1e-3)))
    """

    _: KW_ONLY
    start: float
    end: float
    output_step: float
    method: Integrator | Within
    stabilisation: Stabilisation = Projection()  # noqa: RUF009 - frozen
    outputs: tuple[str, ...] = ("default",)
    analysis: OverTime = field(default_factory=lambda: analysis("forward")())
    chart: Charted = Charted()

    def __post_init__(self) -> None:
        for name in ("start", "end", "output_step"):
            require_kind(getattr(self, name), Real, name, "seconds, such as 0.1")

    @property
    def span(self) -> dict[str, Any]:
        """The times and what to keep, as the functions of analyses take them."""
        return {key: getattr(self, key) for key in ("start", "end", "output_step", "outputs")}


@dataclass(frozen=True)
class MomentSettings:
    """An analysis at one `time` [s].

    Raises InputError for a time that is no number.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Static()))
    """

    _: KW_ONLY
    time: float = 0.0
    outputs: tuple[str, ...] = ("default",)
    analysis: OfMoment = field(default_factory=lambda: analysis("static")())

    def __post_init__(self) -> None:
        require_kind(self.time, Real, "time", "seconds, such as 0.1")

    @property
    def span(self) -> dict[str, Any]:
        """The time and what to keep, as the functions of analyses take them."""
        return {"time": self.time, "outputs": self.outputs}


def settings_of(method: type[Any]) -> list[str]:
    """Names of what a method of fixed steps takes beside its step."""
    return [field.name for field in fields(method) if field.name != "step"]
