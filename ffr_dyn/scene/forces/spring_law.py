"""The law of springs on one coordinate, whose stiffness and damping are numbers or curves."""

from __future__ import annotations

from ffr_dyn.functions.curves import Curve, corners, curve_integral, curve_slope, curve_value
from ffr_dyn.scene.forces.force import Kink, LawNumbers, LoadTable
from ffr_prep.common.arrays import Array


def spring_force(
    stiffness: float | Curve, damping: float | Curve, preload: float, stretch: float, rate: float
) -> float:
    """The force that increases the stretch [m]."""
    return -_of(stiffness, stretch) - _of(damping, rate) - preload


def spring_slopes(stiffness: float | Curve, damping: float | Curve, stretch: float, rate: float) -> tuple[float, float]:
    """By stretch and by rate; of a curve over the rate at least the chord from rest, for those that grow less and less."""
    d = damping
    if isinstance(damping, Curve):
        chord = (curve_value(damping, rate) - curve_value(damping, 0.0)) / rate if rate else 0.0
        d = max(curve_slope(damping, rate), chord)
    return curve_slope(stiffness, stretch) if isinstance(stiffness, Curve) else stiffness, float(d)  # type: ignore[arg-type]


def stiff(stiffness: float | Curve, damping: float | Curve) -> tuple[int, ...]:
    """The one coordinate of a spring, unless it is none."""
    return (0,) if any(isinstance(factor, Curve) or factor > 0 for factor in (stiffness, damping)) else ()


def spring_kinks(stiffness: float | Curve, free: float) -> tuple[Kink, ...]:
    """Where the curve of the force has corners. Steps that ended at those of a curve of damping, whose slope implicit methods
    take as a chord, would err more evenly, but by more than two of them differ by."""
    return tuple(Kink(-free - at) for at in corners(stiffness)) if isinstance(stiffness, Curve) else ()


def compiled_spring(
    stiffness: float | Curve, damping: float | Curve, free: float, preload: float, table: LoadTable
) -> LawNumbers:
    """Stiffness, damping, free coordinate, preload, start of the curves of force and damping or -1."""
    k, d = (0.0 if isinstance(factor, Curve) else factor for factor in (stiffness, damping))
    return LawNumbers([k, d, free, preload, table.curve(stiffness), table.curve(damping)])


def stored(stiffness: float | Curve, preload: float, stretch: Array) -> Array:
    """(T,) [J], zero where the spring is not stretched."""
    return elastic_energy(stiffness, stretch) + preload * stretch


def elastic_energy(stiffness: float | Curve, stretch: Array) -> Array:
    """(T,) [J] without preload."""
    return curve_integral(stiffness, stretch) if isinstance(stiffness, Curve) else 0.5 * stiffness * stretch**2


def _of(factor: float | Curve, x: float) -> float:
    return curve_value(factor, x) if isinstance(factor, Curve) else factor * x
