"""How many modes a reduction keeps: a number, all up to a frequency, or as many as an accuracy needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

_POINTS = 200


@dataclass(frozen=True)
class Band:
    """Frequencies from low [Hz] to high [Hz]; InputError unless 0 < low < high.

    >>> request = fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Rubin(8), quality=fp.Band(1.0, 2000.0))
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0 < self.low < self.high < np.inf:
            raise InputError(f"the band from {self.low:g} to {self.high:g} Hz: it must be 0 < low < high")

    def frequencies(self) -> Array:
        """(200,) logarithmically spaced frequencies [Hz]."""
        return np.geomspace(self.low, self.high, _POINTS)


@dataclass(frozen=True)
class UpTo:
    """All modes up to a frequency [Hz]; InputError unless it is positive.

    Their number is not known beforehand, so up to two or three runs of the eigenvalue iteration are made.

    >>> reduction = fp.CraigBampton(fp.UpTo(2000.0))
    """

    frequency: float

    def __post_init__(self) -> None:
        if not 0 < self.frequency < np.inf:
            raise InputError(f"modes up to {self.frequency:g} Hz: the frequency must be positive")


@dataclass(frozen=True)
class Accuracy:
    """As few modes as keep the error of the interface receptances below a tolerance [1], over a band of frequencies [Hz].

    The error is that of `ffr_prep.reduction.receptance.receptance_error`: relative to the size that each receptance has
    away from antiresonances. It is measured against a richer basis of the same model (all free modes up to twice the band and
    three Krylov blocks), whose own error is checked. Modes are then added up to 2, 4, 8 and 16 times the band, until the
    error is small, and as many are left out as bisection finds needless. All that uses the one factorisation, and costs
    three to ten times as much as a reduction by number.

    A resonance must be right to a fraction of its half-power width for its receptance to be right: with the loss factor
    of 2 per cent, a tolerance of 0.1 means frequencies within 0.1 per cent.

    Raises InputError unless 0 < tolerance < 1.

    >>> modes = fp.Accuracy(fp.Band(1.0, 2000.0), 0.01)
    """

    band: Band
    tolerance: float

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < 1:
            raise InputError(f"the tolerance of the receptances is {self.tolerance:g}; it must be between 0 and 1")


Selection = int | UpTo | Accuracy


def check_selection(name: str, given: object, kinds: tuple[type, ...] = (UpTo, Accuracy)) -> None:
    """Raises InputError unless it is a whole number or of these kinds; which numbers a model allows, it knows itself."""
    if not isinstance(given, (Integral, *kinds)):
        others = " or ".join(f"{kind.__name__}(...)" for kind in kinds)
        raise InputError(f"{name} is {given!r}; give a whole number, or {others}")


def selection_of(given: Mapping[str, Any], default: int) -> Selection:
    """The selection that `modes`, `frequency` [Hz] or `accuracy` (low, high, error) says; InputError where two are given."""
    named = [name for name in ("modes", "frequency", "accuracy") if given.get(name) is not None]
    if len(named) > 1:
        raise InputError(f"{named[0]} and {named[1]} both say how many modes to keep: give one of them")
    if named == ["frequency"]:
        return UpTo(given["frequency"])
    if named == ["accuracy"]:
        low, high, tolerance = given["accuracy"]
        return Accuracy(Band(low, high), tolerance)
    return int(given["modes"]) if named else default
