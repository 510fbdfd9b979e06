"""A given force or torque on a joint coordinate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

from ffr_dyn.scene.fields import DAMPING, FORCE, STIFFNESS, In, OfMotion
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_function, check_number
from ffr_dyn.scene.forces.force import Force, LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.given import given_numbers
from ffr_dyn.scene.forces.places import OnJoint


@register_force
@dataclass(frozen=True)
class Actuator(Force):
    """A force [N] or torque [N m] on a joint coordinate.

    joint : name of the joint
    coordinate : "angle" or "stroke"
    force    : a number, a time function (constant, harmonic, table, ...) or a Python function of time
    function : added to it, a Python function (t, state) -> number; `state` is a `ffr_dyn.equations.state_view.StateView`
    stiffness, damping : how much the function falls with the coordinate and its rate, or more [N/m], [N s/m]: implicit
        methods, which cannot see it, then bear any step. They change no force

    Raises InputError for a force that is neither a finite number nor a function, and for negative stiffness or damping.

    >>> motor = fd.Actuator("motor", "hinge", force=fd.harmonic(amplitude=2.0, frequency=5.0))
    """

    word = "actuator"
    kernel = "ffr_dyn.kernels.forces.actuator:actuator"
    acts = "number, time function, Python function of t or of (t, state)"
    positive = "increases c"
    given = 1

    name: str
    joint: str
    force: Annotated[Any, OfMotion(FORCE)] = 0.0
    function: Callable[..., Any] | None = None
    coordinate: str = "angle"
    stiffness: Annotated[float, In(STIFFNESS)] = 0.0
    damping: Annotated[float, In(DAMPING)] = 0.0

    def __post_init__(self) -> None:
        check_function(self.force, f"{self.place.who}: force")
        check_number(self.stiffness, f"{self.place.who}: stiffness", least=0.0)
        check_number(self.damping, f"{self.place.who}: damping", least=0.0)

    @cached_property
    def place(self) -> OnJoint:
        return OnJoint(f"force {self.name!r}", self.joint, self.coordinate)

    def law(self, now: Moment, c: float, rate: float) -> float:
        added = 0.0 if self.function is None else float(self.function(now.t, now.state))
        return now.value(self.force)[0] + added

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        return (0,) if self.stiffness or self.damping else ()

    def slopes(self, now: Moment, c: float, rate: float) -> tuple[float, float]:
        return self.stiffness, self.damping

    def compiled(self, table: LoadTable) -> LawNumbers:
        numbers = [*given_numbers((self.force,), self.place.who, table), self.stiffness, self.damping]
        return LawNumbers(numbers, user=table.callback(self.function, 1))
