"""What springs on one coordinate have in common, whose stiffness and damping are numbers or curves."""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property

from ffr_dyn.functions.curves import Curve, corners, curve_integral, curve_slope, curve_value
from ffr_dyn.scene.forces.force import Force, Kink, LawNumbers, LoadTable, Moment
from ffr_prep.common.arrays import Array


class Spring(Force):
    """A spring and damper on one coordinate: -(stiffness stretch + damping rate + preload)."""

    kernel = "ffr_dyn.kernels.forces.spring:spring"
    stores_energy = True

    stiffness: float | Curve
    damping: float | Curve
    preload: float

    @property
    @abstractmethod
    def slack(self) -> float:
        """The coordinate [m] at which it is not stretched."""

    def law(self, now: Moment, c: float, rate: float) -> float:
        return -_of(self.stiffness, c - self.slack) - _of(self.damping, rate) - self.preload

    @cached_property
    def kinks(self) -> tuple[Kink, ...]:
        """Where the curve of the force has corners. Steps that ended at those of a curve of damping, whose slope implicit
        methods take as a chord, would err more evenly, but by more than two of them differ by."""
        curve = self.stiffness
        return tuple(Kink(-self.slack - at) for at in corners(curve)) if isinstance(curve, Curve) else ()

    @property
    def damps_unevenly(self) -> bool:
        return isinstance(self.damping, Curve)

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        """The one coordinate, unless it is no spring at all."""
        return (0,) if any(isinstance(k, Curve) or k > 0 for k in (self.stiffness, self.damping)) else ()

    def slopes(self, now: Moment, c: float, rate: float) -> tuple[float, float]:
        """Of a curve over the rate at least the chord from rest, for those that grow less and less."""
        k, d = self.stiffness, self.damping
        if isinstance(d, Curve):
            chord = (curve_value(d, rate) - curve_value(d, 0.0)) / rate if rate else 0.0
            d = max(curve_slope(d, rate), chord)
        return curve_slope(k, c - self.slack) if isinstance(k, Curve) else k, float(d)

    def compiled(self, table: LoadTable) -> LawNumbers:
        """Stiffness, damping, coordinate without stretch, preload, start of the curves of force and damping or -1."""
        k, d = (0.0 if isinstance(factor, Curve) else factor for factor in (self.stiffness, self.damping))
        return LawNumbers([k, d, self.slack, self.preload, table.curve(self.stiffness), table.curve(self.damping)])

    def energy(self, c: Array) -> Array:
        """(T,) [J], zero where it is not stretched."""
        return elastic_energy(self.stiffness, c - self.slack) + self.preload * (c - self.slack)


def elastic_energy(stiffness: float | Curve, stretch: Array) -> Array:
    """(T,) [J] without preload."""
    return curve_integral(stiffness, stretch) if isinstance(stiffness, Curve) else 0.5 * stiffness * stretch**2


def _of(factor: float | Curve, x: float) -> float:
    return curve_value(factor, x) if isinstance(factor, Curve) else factor * x
