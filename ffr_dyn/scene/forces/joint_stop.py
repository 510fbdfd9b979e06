"""End stops of a joint coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from ffr_dyn.scene.fields import COORDINATE, DAMPING, STIFFNESS, In
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_number, check_positive
from ffr_dyn.scene.forces.force import Force, Kink, LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.places import OnJoint
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

ENTRY_STEPS = 8  # at least, in which a stop is entered


@register_force
@dataclass(frozen=True)
class JointStop(Force):
    """End stops: one-sided spring-dampers beyond `lower` and `upper` [m] of a joint coordinate. They never pull.

    joint : name of the joint
    coordinate : "angle" or "stroke"
    lower, upper : values of the coordinate where the stops begin [m]; default: no stop on that side
    stiffness : [N/m];  damping : [N s/m], grows from zero over the depth `entry`,
                as 3 u^2 - 2 u^3 of u = depth / entry
    entry     : [m] depth over which the stiffness grows from zero: the force is stiffness depth^2 / (2 entry) down to it,
                stiffness (depth - entry / 2) below
    turns     : whole turns of an angle at the start

    Raises InputError without a stop, and for lower not below upper.

    >>> stop = fd.JointStop("stop", "hinge", stiffness=1e4, entry=0.01, lower=-1.0, upper=1.0)
    """

    word = "joint-stop"
    kernel = "ffr_dyn.kernels.forces.stop:stop"
    acts = "one-sided spring-dampers beyond lower and upper"
    positive = "increases c"
    stores_energy = True
    sudden = True
    throws_back = True

    name: str
    joint: str
    stiffness: Annotated[float, In(STIFFNESS)]
    entry: Annotated[float, In(COORDINATE)]
    lower: Annotated[float | None, In(COORDINATE)] = None
    upper: Annotated[float | None, In(COORDINATE)] = None
    damping: Annotated[float, In(DAMPING)] = 0.0
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        who = self.place.who
        check_positive(self.stiffness, f"{who}: stiffness")
        check_positive(self.entry, f"{who}: entry")
        check_number(self.damping, f"{who}: damping", least=0.0)
        if self.lower is None and self.upper is None:
            raise InputError(f"{who} stops nothing: give lower, upper or both")
        for key in ("lower", "upper"):
            if getattr(self, key) is not None:
                check_number(getattr(self, key), f"{who}: {key}")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise InputError(f"{who}: lower is {self.lower:g} and upper {self.upper:g}; lower must be below upper")

    @cached_property
    def place(self) -> OnJoint:
        return OnJoint(f"force {self.name!r}", self.joint, self.coordinate, self.turns)

    def law(self, now: Moment, c: float, rate: float) -> float:
        below = 0.0 if self.lower is None else self._push(self.lower - c, -rate)
        return below if self.upper is None else below - self._push(c - self.upper, rate)

    def _push(self, depth: float, speed: float) -> float:
        if depth <= 0:
            return 0.0
        elastic = depth**2 / (2 * self.entry) if depth < self.entry else depth - self.entry / 2
        share = min(depth / self.entry, 1.0)
        return max(self.stiffness * elastic + self.damping * speed * share**2 * (3 - 2 * share), 0.0)

    def energy(self, c: Array) -> Array:
        below = np.zeros(len(c)) if self.lower is None else self._stored(self.lower - c)
        return below if self.upper is None else below + self._stored(c - self.upper)

    def rebound(self, mass: float, rate: float) -> tuple[float, float]:
        """Half a vibration, as deep as the energy of the approach goes, which damping of a ratio zeta leaves
        exp(-2 pi zeta / sqrt(1 - zeta^2)) of."""
        k, energy = self.stiffness, 0.5 * mass * rate**2
        if not energy < np.inf:
            return np.inf, 0.0
        soft = k * self.entry**2 / 6  # stored where the full stiffness begins
        if energy < soft:
            depth = (6 * self.entry * energy / k) ** (1 / 3)
        else:
            depth = 0.5 * (self.entry + np.sqrt(self.entry**2 + 8 * (energy - soft) / k))
        ratio = 0.5 * self.damping / np.sqrt(k * mass)
        returned = energy * np.exp(-2 * np.pi * ratio / np.sqrt(1 - ratio**2)) if ratio < 1 else 0.0
        return float(np.pi * depth / rate), float(returned)

    def _stored(self, depth: Array) -> Array:
        entered = np.clip(depth, 0.0, self.entry)
        beyond = np.maximum(depth - self.entry, 0.0)
        found: Array = self.stiffness * (entered**3 / (6 * self.entry) + 0.5 * beyond * (beyond + self.entry))
        return found

    @cached_property
    def kinks(self) -> tuple[Kink, ...]:
        """Where a stop is met and where it is entered, and where damping would begin to pull, beyond that and before.

        Between the first two are more places, so that steps that are longer than the entry see how the force grows in it.
        """
        found = list[Kink]()
        for end, out in ((self.lower, -1.0), (self.upper, 1.0)):
            if end is None:
                continue
            depths = np.linspace(0.0, self.entry, 1 + ENTRY_STEPS).tolist()
            found += [Kink(-end - out * depth) for depth in depths]
            if self.damping > 0:
                found += [self._pulls(end, out), self._pulls_in_entry(end, out)]
        return tuple(found)

    def _pulls(self, end: float, out: float) -> Kink:
        """stiffness (depth - entry / 2) + damping speed = 0"""
        return Kink(-end - out * self.entry / 2, 1.0, self.damping / self.stiffness)

    def _pulls_in_entry(self, end: float, out: float) -> Kink:
        """stiffness entry / 2 + damping speed (3 - 2 depth / entry) = 0, times entry / (2 damping)"""
        return Kink(self.stiffness * self.entry**2 / (4 * self.damping), 0.0, 1.5 * out * self.entry + end, -1.0)

    @property
    def damps_unevenly(self) -> bool:
        return self.damping > 0

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        return (0,)

    def slopes(self, now: Moment, c: float, rate: float) -> tuple[float, float]:
        """W-methods go by the depth that the step reaches, where that is more."""
        below = (0.0, 0.0) if self.lower is None else self._slopes(self.lower - c, -rate)
        above = (0.0, 0.0) if self.upper is None else self._slopes(c - self.upper, rate)
        return below[0] + above[0], below[1] + above[1]

    def _slopes(self, depth: float, speed: float) -> tuple[float, float]:
        share = min(max(depth, 0.0) / self.entry, 1.0)
        growth = 6 * self.damping * max(speed, 0.0) * share * (1 - share) / self.entry
        return self.stiffness * share + growth, self.damping * share**2 * (3 - 2 * share)

    def compiled(self, table: LoadTable) -> LawNumbers:
        """Lower and upper end, stiffness, damping, entry."""
        lower = -np.inf if self.lower is None else self.lower
        upper = np.inf if self.upper is None else self.upper
        return LawNumbers([lower, upper, self.stiffness, self.damping, self.entry])
