"""A spring and damper on a joint coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

from ffr_dyn.functions.curves import Curve
from ffr_dyn.scene.fields import COORDINATE, DAMPING, FORCE, RATE, STIFFNESS, Curved, In
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_damping, check_number, check_number_or_curve
from ffr_dyn.scene.forces.places import OnJoint
from ffr_dyn.scene.forces.spring_law import Spring


@register_force
@dataclass(frozen=True)
class JointSpring(Spring):
    """-(stiffness (c - free) + damping dc/dt + preload) on a joint coordinate c: a torsion spring, or one along a guide.

    joint : name of the joint
    coordinate : "angle" or "stroke"
    stiffness : [N/m], or a `Curve` of the force over c - free;  damping : [N s/m], not negative, or a `Curve` over dc/dt
    free      : coordinate without force [m];  preload : [N], positive pulls back;  turns : whole turns at the start

    Raises InputError for numbers that are not finite, negative damping, and a curve of damping that feeds energy.

    >>> spring = fd.JointSpring("spring", "hinge", stiffness=20.0, damping=0.1)
    """

    word = "joint-spring"
    acts = "joint coordinate c: −(k (c − free) + d ċ + preload)"
    positive = "increases c"

    name: str
    joint: str
    stiffness: Annotated[float | Curve, Curved(STIFFNESS, COORDINATE, FORCE)] = 0.0
    damping: Annotated[float | Curve, Curved(DAMPING, RATE, FORCE)] = 0.0
    free: Annotated[float, In(COORDINATE)] = 0.0
    preload: Annotated[float, In(FORCE)] = 0.0
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        who = self.place.who
        check_number_or_curve(self.stiffness, f"{who}: stiffness")
        check_damping(self.damping, f"{who}: damping")
        check_number(self.free, f"{who}: free")
        check_number(self.preload, f"{who}: preload")

    @cached_property
    def place(self) -> OnJoint:
        return OnJoint(f"force {self.name!r}", self.joint, self.coordinate, self.turns)

    @property
    def slack(self) -> float:
        return self.free
