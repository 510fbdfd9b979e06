"""Curves in place of a stiffness or damping.

Twin: `ffr_dyn.functions.curves.curve_value`.
"""

from ffr_dyn.kernels.functions import piecewise
from ffr_dyn.kernels.options import kernel


@kernel
def curve_value(data, start, x):
    """A curve (piecewise polynomial, see `piecewise`) at x; straight beyond its ends."""
    first, last = data[start + 2], data[start + 2 + int(data[start])]
    inside = min(max(x, first), last)
    value, slope, _ = piecewise(data, start, inside)
    return value + slope * (x - inside)


@kernel
def curve_slope(data, start, x):
    """The slope of a curve at x."""
    first, last = data[start + 2], data[start + 2 + int(data[start])]
    return piecewise(data, start, min(max(x, first), last))[1]
