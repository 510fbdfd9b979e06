"""Force laws of a joint coordinate or a length: what acts on it, positive where it increases it.

Twin: `ffr_dyn.equations.forces.applied`.
"""

import math

from ffr_dyn.kernels.functions import piecewise
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.tables import ACTUATOR, FRICTION, SERVO, SPRING


@kernel
def curve_value(data, start, x):
    """A curve (piecewise polynomial, see `piecewise`) at x; straight beyond its ends."""
    first, last = data[start + 2], data[start + 2 + int(data[start])]
    inside = min(max(x, first), last)
    value, slope, _ = piecewise(data, start, inside)
    return value + slope * (x - inside)


@kernel
def spring(data, start, c, rate):
    """data: stiffness, damping, free coordinate, preload, start of the curves of force and damping or -1."""
    stretch = c - data[start + 2]
    pull = data[start] * stretch + data[start + 1] * rate + data[start + 3]
    if data[start + 4] >= 0.0:
        pull += curve_value(data, int(data[start + 4]), stretch)
    if data[start + 5] >= 0.0:
        pull += curve_value(data, int(data[start + 5]), rate)
    return -pull


@kernel
def friction(data, start, rate, normal):
    """data: Coulomb friction, what friction at rest has more, Stribeck's velocity, creep velocity, viscous damping."""
    fall = rate / data[start + 2]
    size = data[start] + data[start + 1] * math.exp(-fall * fall)
    if normal < 0.0:  # lifted off
        size = 0.0
    return -normal * size * math.tanh(rate / data[start + 3]) - data[start + 4] * rate


@kernel
def push(data, start, depth, speed):
    """Force of a stop at a depth that grows with `speed`; data: stiffness, damping, entry."""
    if depth <= 0.0:
        return 0.0
    stiffness, damping, entry = data[start], data[start + 1], data[start + 2]
    share = min(depth / entry, 1.0)
    force = stiffness * (depth - entry * share * (1.0 - 0.5 * share)) + damping * speed * share * share * (
        3.0 - 2.0 * share
    )
    return 0.0 if force < 0.0 else force


@kernel
def servo(data, start, c, rate, target, target_rate):
    """data: kp, kd, limit."""
    force, limit = data[start] * (target - c) + data[start + 1] * (target_rate - rate), data[start + 2]
    if force > limit:
        return limit
    return -limit if force < -limit else force


@kernel
def law(kind, data, start, c, rate, drive, user):
    """Force on the coordinate c; drive: value and rate of the law's time function; user: values of Python functions."""
    if kind == SPRING:
        return spring(data, start, c, rate)
    if kind == FRICTION:
        return friction(data, start, rate, drive[0])
    if kind == ACTUATOR:
        slot = int(data[start])
        return drive[0] + (user[slot] if slot >= 0 else 0.0)
    if kind == SERVO:
        return servo(data, start, c, rate, drive[0], drive[1])
    return push(data, start + 2, data[start] - c, -rate) - push(data, start + 2, c - data[start + 1], rate)
