"""Tolerances of the error of a step, for methods that choose their steps.

Twin: none, data.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass

import numpy as np

from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class Tolerances:
    """The error of a step is held below these absolute values, plus `relative` [1] of each coordinate's size.

    position : of points [m] and rotations [rad]
    velocity : of points [m/s] and angular velocities [rad/s]
    elastic  : of elastic displacements [m] (root mean square over the mass of a body), and of their rates over the time
               that the step takes

    The error at the end of a run is usually some ten times larger. Raises InputError for values that are not positive.

    >>> method = fd.DormandPrince(fd.Tolerances(1e-8, position=1e-9))
    """

    relative: float = 1e-6
    _: KW_ONLY
    position: float = 1e-7
    velocity: float = 1e-6
    elastic: float = 1e-8

    def __post_init__(self) -> None:
        for name in ("relative", "position", "velocity", "elastic"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"tolerance {name!r} is {value}; it must be positive")


def tolerances(relative: float) -> Tolerances:
    """All tolerances in the proportions of the default ones; relative : [1] that of a step, a share of each quantity's size.

    Raises InputError for a number that is not positive.

    >>> method = fd.AdaptiveROS3(fd.tolerances(1e-5))
    """
    return Tolerances(relative, position=0.1 * relative, velocity=relative, elastic=0.01 * relative)


def tightened(wanted: Tolerances, times: float) -> Tolerances:
    """All of them divided by a number."""
    return Tolerances(**{key: value / times for key, value in asdict(wanted).items()})
