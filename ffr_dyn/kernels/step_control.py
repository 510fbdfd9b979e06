"""Steps that end where functions of time break; steps chosen by their error, and the states between two of them.

A step that has a jump or a kink of a force, a target or a driver within it is of first order, whatever the method, and by how
much it errs depends on where it lies. So a step ends there, its functions looked at before the break alone, and another one
goes on from there: what a method keeps from earlier steps is worth nothing then.

A method leaves an estimate of its error in `stages.x[0]`, `stages.v[0]`, and does its step again, shorter, when told so. The
controller is proportional-integral (Gustafsson 1991; Hairer & Wanner 1996, IV.8).

Twin: the statement above, held by
`tests/ffr_dyn/integrators/test_integrators_adaptive.py::test_the_error_follows_the_tolerance`.
"""

import math

from ffr_dyn.kernels.bodies import normalise, position_rates
from ffr_dyn.kernels.functions import ROUNDING, has_breaks
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.singular_positions import BESIDE
from ffr_dyn.kernels.tables import (
    AT_LAST,
    BEFORE,
    CLOSEST,
    END,
    ERROR,
    FROM,
    HERE,
    IN_V,
    IN_X,
    LONGEST,
    NOW,
    OK,
    ORDER,
    RELATIVE,
    RESTART,
    SEEN,
    SHORTEST,
    SINCE,
    SPACING,
    STEP,
    STEP_TOO_SMALL,
    UNTIL,
    UP_TO,
    USER_FAILED,
    H,
    N,
)
from ffr_dyn.kernels.vectors import copy

SAFETY, SMALLEST, LARGEST = 0.9, 0.2, 5.0
# A step with its end, or a stage that spoils it, beside a singular position is tried in these lengths before it gets shorter:
# shorter ones alone would come ever nearer to the position and never over it. Beside is nearer than about a fifth of the
# distance from where the step began (independence is the square of a distance).
LENGTHS = (0.83, 1.2, 0.7, 1.45)
CLOSER = 0.05
SHORTER = 0.8  # where none of them will do for the end
NEAR = 1e-9  # of a step: a break so near to its ends is at them


@inlined
def look_anywhere(time):
    """Functions of time are looked at where they are asked for."""
    time[FROM], time[UP_TO] = -math.inf, math.inf


@inlined
def look_at_row(r, find, t):
    """Functions of time that break at a row of results are looked at on the side that the row shows."""
    time, found = r.clock.time, r.clock.found
    if not has_breaks(r.model.functions):
        return
    least = ROUNDING * (abs(t) + time[SPACING])
    find(r, t - least, t + least)
    if found[SEEN] < math.inf:
        time[FROM] = time[UP_TO] = found[SEEN]


@inlined
def look_behind(r, find, t, near):
    """Functions of time are looked at from the start of a step on, behind what breaks there. Returns whether one does."""
    found, since = r.clock.found, t
    find(r, t - near, t + near)
    breaks = found[SINCE] < math.inf
    while found[SINCE] < math.inf:
        since = found[SINCE]
        find(r, since, t + near)
    r.clock.time[FROM], r.clock.time[UP_TO] = since, math.inf
    return breaks


@inlined
def step_in_pieces(r, step, find, close, settle, t, again):
    """One step from time t in pieces that end where functions of time break. Returns a status.

    What steps and pieces have left the constraints by is closed as longer steps do it, before a short piece would: that
    excites stiff modes. Only what jumps at a break is an impulse (`settle`).
    """
    time, found = r.clock.time, r.clock.found
    h = time[H]
    if not has_breaks(r.model.functions):
        return step(r, t, again)
    end, near = t + h, NEAR * h + ROUNDING * abs(t)
    find(r, t - h - near, t + near)
    before = found[SINCE]
    find(r, t + near, end + near)
    if before == math.inf and found[SINCE] == math.inf:
        return step(r, t, again)
    now, last = t, False
    status = close(r, t) if before == math.inf else OK
    while status == OK and not last:
        if look_behind(r, find, now, near):
            status = settle(r, now)
        find(r, now + near, end + near)
        last = not found[SINCE] < end - near
        since, time[UP_TO] = found[SINCE], found[UNTIL]
        time[H] = (end if last else found[UNTIL]) - now
        if status == OK:
            status = step(r, now, RESTART)
        if status == OK and since < math.inf:
            status = close(r, time[UP_TO])
        now = since
    time[H] = h
    look_anywhere(time)
    return status


@kernel
def worst(error, before, after, weight, relative, h):
    """The largest error relative to its tolerance; infinite when it is no number. A negative weight counts over a step."""
    result = 0.0
    for k in range(error.size):
        size = max(abs(before[k]), abs(after[k]))
        absolute = weight[k] if weight[k] > 0.0 else -weight[k] / h
        share = abs(error[k]) / (absolute + relative * size)
        if not share <= result:  # also NaN
            result = share if share > result else 1e300
    return result


@inlined
def step_to_break(r, step, find, close, settle):
    """One accepted step that ends, at the latest, where a function of time breaks. Returns a status."""
    numbers, time, found = r.control.numbers, r.clock.time, r.clock.found
    numbers[STEP] = min(numbers[STEP], numbers[LONGEST])
    if not has_breaks(r.model.functions):
        return controlled_step(r, step, 0)
    now, wanted = numbers[NOW], numbers[STEP]
    near = numbers[SHORTEST] + ROUNDING * abs(now)
    fresh = look_behind(r, find, now, near)
    find(r, now + near, now + wanted + near)
    time[UP_TO], end = found[UNTIL], found[UNTIL]
    if end < math.inf:
        numbers[STEP] = end - now
    status = settle(r, now) if fresh else OK
    if end < math.inf and not fresh:
        status = close(r, now)
    if status == OK:
        status = controlled_step(r, step, RESTART if fresh else 0)
    if not numbers[NOW] < end - near:
        numbers[STEP] = max(numbers[STEP], wanted)
        if status == OK:
            status = close(r, end)
    look_anywhere(time)
    return status


@inlined
def controlled_step(r, step, again):
    """One accepted step, of those that `step` does. Returns a status."""
    c, stages = r.control, r.stages
    numbers = c.numbers
    copy(c.x, r.x)
    copy(c.v, r.v)
    share, tried, length = r.work.independence, 0, numbers[STEP]
    while True:
        h = numbers[STEP]
        r.clock.time[H] = h
        share[CLOSEST], share[END] = 1.0, numbers[NOW] + h
        status = step(r, numbers[NOW], again)
        if status == USER_FAILED:
            return status
        error = 1e300
        if status == OK:
            position = worst(stages.x[0], c.x, r.x, c.weight_x, numbers[RELATIVE], h)
            error = max(position, worst(stages.v[0], c.v, r.v, c.weight_v, numbers[RELATIVE], h))
        power = 1.0 / numbers[ORDER]
        near = share[CLOSEST] if error > 1.0 else share[HERE]
        beside = near < BESIDE and near < CLOSER * share[AT_LAST]
        if error <= 1.0 and not beside:
            share[AT_LAST] = share[HERE]
            error = max(error, 1e-8)
            factor = SAFETY * error ** (-0.7 * power) * numbers[ERROR] ** (0.4 * power)
            if again == 1:
                factor = min(factor, 1.0)
            numbers[ERROR] = max(error, 1e-4)
            numbers[BEFORE], numbers[NOW] = numbers[NOW], numbers[NOW] + h
            numbers[STEP] = h * min(LARGEST, max(SMALLEST, factor))
            c.counts[0] += 1
            return OK
        copy(r.x, c.x)
        copy(r.v, c.v)
        again = 1
        c.counts[1] += 1
        if beside and tried < len(LENGTHS):
            numbers[STEP] = LENGTHS[tried] * length
            tried += 1
        else:
            numbers[STEP] = h * (SHORTER if error <= 1.0 else max(SMALLEST, SAFETY * min(error, 1e30) ** -power))
        if numbers[STEP] < numbers[SHORTEST]:
            return STEP_TOO_SMALL if status == OK else status


@kernel
def slopes_to_velocities(where, x, slope, v):
    """v = [R_dot, omega_bar = 2 G_bar p_dot, q_dot] of positions that move with these slopes."""
    for b in range(where.shape[0] - 1):
        n, i, j = where[b, N], where[b, IN_X], where[b, IN_V]
        p0, p1, p2, p3 = x[i + 3], x[i + 4], x[i + 5], x[i + 6]
        d0, d1, d2, d3 = slope[i + 3], slope[i + 4], slope[i + 5], slope[i + 6]
        for c in range(3):
            v[j + c] = slope[i + c]
        v[j + 3] = 2.0 * (-p1 * d0 + p0 * d1 + p3 * d2 - p2 * d3)
        v[j + 4] = 2.0 * (-p2 * d0 - p3 * d1 + p0 * d2 + p1 * d3)
        v[j + 5] = 2.0 * (-p3 * d0 + p2 * d1 - p1 * d2 + p0 * d3)
        for c in range(n):
            v[j + 6 + c] = slope[i + 7 + c]


@inlined
def interpolate(r, t):
    """The engine's state at a time t within the last step: on the cubic through positions and velocities at its ends."""
    c = r.control
    h = c.numbers[NOW] - c.numbers[BEFORE]
    if not t < c.numbers[NOW] or not h > 0.0:
        return
    s = (t - c.numbers[BEFORE]) / h
    before, after = r.stages.x[1], r.stages.x[2]
    position_rates(r.model.bodies, c.x, c.v, before)
    position_rates(r.model.bodies, r.x, r.v, after)
    square, rest = s * s, 1.0 - s
    for k in range(r.x.size):
        first, last, d0, d1 = c.x[k], r.x[k], before[k], after[k]
        r.x[k] = (
            (1.0 + 2.0 * s) * rest * rest * first
            + square * (3.0 - 2.0 * s) * last
            + h * s * rest * (rest * d0 - s * d1)
        )
        before[k] = 6.0 * s * rest * (last - first) / h + rest * (1.0 - 3.0 * s) * d0 + s * (3.0 * s - 2.0) * d1
    normalise(r.model.bodies, r.x)
    slopes_to_velocities(r.model.bodies.where, r.x, before, r.v)
