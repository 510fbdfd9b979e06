"""Dry friction on a joint coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.scene.fields import COULOMB, DAMPING, RATE, In, OfTime
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_function, check_number, check_positive
from ffr_dyn.scene.forces.force import Force, LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.given import is_number
from ffr_dyn.scene.forces.places import OnJoint
from ffr_prep.common.errors import InputError


@register_force
@dataclass(frozen=True)
class JointFriction(Force):
    """Dry friction against the rate c_dot of a joint coordinate, made smooth over the velocity `creep`:

        -normal (coulomb + (static - coulomb) exp(-(c_dot / stribeck)^2)) tanh(c_dot / creep) - viscous c_dot

    joint : name of the joint
    coordinate : "angle" or "stroke"
    coulomb : without `normal` the friction force [N], of an angle the torque [N m]; with `normal` [N] the coefficient of
              friction [1], of an angle times the radius on which the surfaces slide [m]
    normal  : a number not below zero, a time function or a Python function of time, below zero while the surfaces are
              apart. It is given: the joint's reaction does not enter
    creep   : [m/s]; a load below friction is not held but creeps, at creep atanh(load / coulomb)
    static  : friction at rest, in the unit of coulomb, not below it: both, with stribeck, or neither
    stribeck : velocity [m/s] over which friction falls from static to coulomb (Stribeck 1902)
    viscous : force over the rate [N s/m]

    Raises InputError for static without stribeck, and for numbers that are not positive where they must be.

    >>> bearing = fd.JointFriction("bearing", "hinge", coulomb=0.3, creep=1e-3)
    """

    word = "joint-friction"
    kernel = "ffr_dyn.kernels.forces.friction:friction"
    acts = "−N (μ + (μ_s − μ) exp(−(ċ/v_s)²)) tanh(ċ/creep) − viscous ċ"
    positive = "increases c"
    sudden = True

    name: str
    joint: str
    coulomb: Annotated[float, In(COULOMB)]
    creep: Annotated[float, In(RATE)]
    normal: Annotated[Any, OfTime("N")] = 1.0
    static: Annotated[float | None, In(COULOMB)] = None
    stribeck: Annotated[float | None, In(RATE)] = None
    viscous: Annotated[float, In(DAMPING)] = 0.0
    coordinate: str = "angle"

    def __post_init__(self) -> None:
        who = self.place.who
        check_number(self.coulomb, f"{who}: coulomb", least=0.0)
        check_positive(self.creep, f"{who}: creep")
        check_number(self.viscous, f"{who}: viscous", least=0.0)
        check_function(self.normal, f"{who}: normal", least=0.0)
        if (self.static is None) != (self.stribeck is None):
            raise InputError(f"{who}: static and stribeck belong together; give both or neither")
        if self.static is not None:
            check_number(self.static, f"{who}: static", least=self.coulomb)
            check_positive(self.stribeck, f"{who}: stribeck")

    @cached_property
    def place(self) -> OnJoint:
        return OnJoint(f"force {self.name!r}", self.joint, self.coordinate)

    def law(self, now: Moment, c: float, rate: float) -> float:
        return float(-self._size(now, rate) * np.tanh(rate / self.creep) - self.viscous * rate)

    def _size(self, now: Moment, rate: float) -> float:
        """Dry friction beyond creep."""
        size = self.coulomb
        if self.static is not None and self.stribeck is not None:
            size += (self.static - self.coulomb) * float(np.exp(-((rate / self.stribeck) ** 2)))
        return max(now.value(self.normal)[0], 0.0) * size  # below zero it is lifted off

    def at_rest(self, rate: float) -> str | None:
        if not self.coulomb > 0 or abs(rate) > self.creep:
            return None
        units = ("m/s", "N", "N s/m") if self.coordinate == "stroke" else ("rad/s", "N m", "N m s/rad")
        holds, damps = "a load", "steeply"
        if is_number(self.normal):
            most = self.normal * (self.coulomb if self.static is None else self.static)
            holds, damps = f"{most:.4g} {units[1]}", f"by {most / self.creep:.4g} {units[2]}"
        return (
            f"force {self.name!r} is dry friction made smooth: at rest it does not hold {holds}, but damps {damps} below "
            f"{self.creep:.3g} {units[0]}; where it is to stick, put a stiff spring or a driver in its place"
        )

    @property
    def damps_unevenly(self) -> bool:
        return True

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        return (0,)

    def slopes(self, now: Moment, c: float, rate: float) -> tuple[float, float]:
        """The force over the rate: its slope says nothing where friction has its full size."""
        share = rate / self.creep
        steep = np.tanh(share) / share if abs(share) > 1e-6 else 1.0
        return 0.0, float(self._size(now, rate) * steep / self.creep + self.viscous)

    def compiled(self, table: LoadTable) -> LawNumbers:
        """Coulomb friction, what friction at rest has more, Stribeck's velocity, creep velocity, viscous damping."""
        more = 0.0 if self.static is None else self.static - self.coulomb
        fall = 1.0 if self.stribeck is None else self.stribeck
        return LawNumbers([self.coulomb, more, fall, self.creep, self.viscous], table.function(self.normal))
