"""Position control of a joint coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.scene.fields import COORDINATE, DAMPING, FORCE, STIFFNESS, In, OfTime
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_function, check_number
from ffr_dyn.scene.forces.force import Force, LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.places import OnJoint
from ffr_prep.common.errors import InputError


@register_force
@dataclass(frozen=True)
class Servo(Force):
    """Position control of a joint coordinate c: kp (target - c) + kd (target_dot - dc/dt), held within +-limit.

    target : a number, a time function, or a Python function t -> (value, rate); without kd, t -> value will do
    kp, kd : gains of position [N/m] and rate [N s/m], not negative
    limit  : largest force [N]; default: none;  turns : whole turns at the start
    joint : name of the joint
    coordinate : "angle" or "stroke"

    Raises InputError for a limit that is not positive.

    >>> control = fd.Servo("control", "hinge", target=0.5, kp=400.0, kd=20.0, limit=50.0)
    """

    word = "servo"
    kernel = "ffr_dyn.kernels.forces.servo:servo"
    acts = "kp (target − c) + kd (target rate − ċ), within ± limit"
    positive = "increases c"

    name: str
    joint: str
    target: Annotated[Any, OfTime(COORDINATE)]
    kp: Annotated[float, In(STIFFNESS)]
    kd: Annotated[float, In(DAMPING)] = 0.0
    limit: Annotated[float, In(FORCE)] = np.inf
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        who = self.place.who
        check_function(self.target, f"{who}: target")
        check_number(self.kp, f"{who}: kp", least=0.0)
        check_number(self.kd, f"{who}: kd", least=0.0)
        if not self.limit > 0:
            raise InputError(f"{who}: limit is {self.limit}; it must be positive")

    @cached_property
    def place(self) -> OnJoint:
        return OnJoint(f"force {self.name!r}", self.joint, self.coordinate, self.turns)

    def law(self, now: Moment, c: float, rate: float) -> float:
        return float(np.clip(self._wanted(now, c, rate), -self.limit, self.limit))

    def _wanted(self, now: Moment, c: float, rate: float) -> float:
        target, speed, _ = now.value(self.target)
        return self.kp * (target - c) + self.kd * (speed - rate)

    @property
    def deaf(self) -> bool:
        return self.limit < np.inf

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        return (0,) if self.kp or self.kd else ()

    def slopes(self, now: Moment, c: float, rate: float) -> tuple[float, float]:
        """Less where it is limited: those of the line from zero to the limit."""
        wanted = abs(self._wanted(now, c, rate))
        share = self.limit / wanted if wanted > self.limit else 1.0
        return share * self.kp, share * self.kd

    def compiled(self, table: LoadTable) -> LawNumbers:
        return LawNumbers([self.kp, self.kd, self.limit], table.function(self.target, derivatives=1 if self.kd else 0))
