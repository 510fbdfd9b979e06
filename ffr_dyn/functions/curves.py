"""Characteristics: a force tabulated over a displacement or a velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.functions.time_functions import numbers_in
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

SHORT = 0.05  # of a curve: a piece that may be shorter than what a step moves by
MUCH = 0.25  # of the steepest slope: a change that a step must not pass unseen
WITHIN = 8  # steps at least over a short piece with such a change


@dataclass(frozen=True, repr=False)
class Curve(Brief):
    """values (P,) over at (P,), increasing: a smooth curve through the points, straight beyond them.

    Between the points it is the monotone cubic of Fritsch and Carlson (1980), which does not overshoot; through two
    points it is a line. Raises InputError unless there are two or more increasing places and as many values.

    >>> buffer = fd.SpringDamper("buffer", "ground.wall", "rod.tip", stiffness=fd.Curve([-0.01, 0, 0.01], [-500, 0, 100]))
    """

    at: Any
    values: Any

    def __post_init__(self) -> None:
        at, values = numbers_in("places of a curve", self.at), numbers_in("values of a curve", self.values)
        if at.ndim != 1 or at.shape != values.shape or at.size < 2:
            raise InputError(f"a curve needs two or more places and as many values, not {at.size} and {values.size}")
        if not (np.isfinite(at).all() and np.isfinite(values).all()):
            raise InputError("a curve holds values that are not finite")
        if not (np.diff(at) > 0).all():
            first = int(np.argmin(np.diff(at) > 0))
            raise InputError(f"the places of a curve must increase; after {at[first]:g} comes {at[first + 1]:g}")
        for key, array in (("at", at), ("values", values)):
            array.setflags(write=False)
            object.__setattr__(self, key, array)


def corners(curve: Curve) -> list[float]:
    """Where the slope of a curve changes much over a short way: places that steps end at, and within such a way more of them.

    A way is a piece that is short beside all of the curve. Over many small pieces the slope counts as changed where the
    change since the last corner is large.
    """
    widths, slopes = np.diff(curve.at), np.diff(curve.values) / np.diff(curve.at)
    much, short = MUCH * np.abs(slopes).max(), widths < SHORT * (curve.at[-1] - curve.at[0])
    found, last = list[float](), slopes[0]
    for k in range(1, len(slopes)):
        if abs(slopes[k] - last) > much:
            last = slopes[k]
            found += [curve.at[k]] if short[k - 1] or short[k] else []
    for k in range(1, len(slopes) - 1):
        if short[k] and abs(slopes[k + 1] - slopes[k - 1]) > much:
            found += np.linspace(curve.at[k], curve.at[k + 1], 1 + WITHIN)[1:-1].tolist()
    return sorted(map(float, found))


def pieces(curve: Curve) -> Array:
    """The numbers of a curve as the kernels read them: pieces, 4, breaks, ascending coefficients piece by piece."""
    from scipy.interpolate import PchipInterpolator

    coefficients = PchipInterpolator(curve.at, curve.values).c[::-1].T
    return np.concatenate([[curve.at.size - 1, 4], curve.at, coefficients.ravel()])


def curve_value(curve: Curve, x: float) -> float:
    """The curve at x; the readable twin of `ffr_dyn.kernels.forces.curve.curve_value`."""
    from scipy.interpolate import PchipInterpolator

    through = PchipInterpolator(curve.at, curve.values)
    inside = float(np.clip(x, curve.at[0], curve.at[-1]))
    return float(through(inside) + through(inside, 1) * (x - inside))


def curve_slope(curve: Curve, x: float) -> float:
    """The slope of the curve at x."""
    from scipy.interpolate import PchipInterpolator

    return float(PchipInterpolator(curve.at, curve.values)(np.clip(x, curve.at[0], curve.at[-1]), 1))


def curve_integral(curve: Curve, x: Array) -> Array:
    """Integral of the curve from 0 to x, of the shape of x: the energy that a spring of this curve stores."""
    found: Array = _primitive(curve, np.asarray(x, float)) - _primitive(curve, np.zeros(()))
    return found


def _primitive(curve: Curve, x: Array) -> Array:
    from scipy.interpolate import PchipInterpolator

    through = PchipInterpolator(curve.at, curve.values)
    inside = np.clip(x, curve.at[0], curve.at[-1])
    beyond = x - inside
    found: Array = through.antiderivative()(inside) + beyond * (through(inside) + 0.5 * beyond * through(inside, 1))
    return found
