"""Checks of the fields of forces; each raises InputError that begins with `what`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.time_functions import as_time_function
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


def check_number(value: Any, what: str, least: float = -np.inf) -> None:
    """InputError unless the value is a finite number, not below `least`."""
    if not isinstance(value, (int, float, np.floating, np.integer)) or not np.isfinite(value):
        raise InputError(f"{what} must be a finite number, not {value!r}")
    if value < least:
        raise InputError(f"{what} is {value:g}; it must not be below {least:g}")


def check_positive(value: Any, what: str) -> None:
    """InputError unless the value is a finite number above zero."""
    check_number(value, what)
    if value <= 0:
        raise InputError(f"{what} is {value:g}; it must be positive")


def check_function(value: Any, what: str, least: float = -np.inf) -> None:
    """InputError unless the value is a function of time or a finite number, not below `least`."""
    if isinstance(value, (int, float, np.floating, np.integer)):
        check_number(value, what, least)
    else:
        as_time_function(value, what)


def check_number_or_curve(value: Any, what: str) -> None:
    """InputError unless the value is a finite number or a `Curve`."""
    if not isinstance(value, Curve):
        check_number(value, what)


def check_damping(value: Any, what: str) -> None:
    """InputError for damping that feeds energy: a negative number, or a curve whose force is not along the velocity."""
    if not isinstance(value, Curve):
        check_number(value, what, least=0.0)
    elif (value.at * value.values < 0).any():
        at = value.at[np.argmin(value.at * value.values)]
        raise InputError(f"{what}: at the velocity {at:g} the curve has a force of the other sign, which feeds energy")


def check_array(value: Any, shape: tuple[int, ...], what: str) -> Array:
    """The value as an array of this shape; InputError when it is none, or not finite."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} must be numbers of shape {shape}, not {value!r}") from None
    if array.shape != shape:
        raise InputError(f"{what} must have the shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{what} holds values that are not finite")
    return array


def check_symmetric(matrix: Array, what: str) -> None:
    """InputError unless the matrix is symmetric."""
    off = np.abs(matrix - matrix.T).max()
    if off > 1e-9 * np.abs(matrix).max():
        raise InputError(f"{what} must be symmetric (it is off by {off:g}); other matrices make or lose energy")
