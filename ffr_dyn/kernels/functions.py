"""Functions of time and piecewise polynomials, compiled; declared in `ffr_dyn.functions.time_functions` and
`ffr_dyn.functions.curves`. Where they break: `ffr_dyn.functions.breaks`.

Twin: `ffr_dyn.functions.time_functions.evaluate`.
"""

import math

from ffr_dyn.kernels.operations import operate
from ffr_dyn.kernels.options import entry, inlined, kernel
from ffr_dyn.kernels.tables import SEEN, SINCE, UNTIL

POLYNOMIAL, HARMONIC, PIECEWISE, USER, OPERATION = 0, 1, 2, 3, 4
ROUNDING = 4e-15  # of a time, by which that of a sign that changes is not known


@kernel
def horner(data, start, count, t):
    """(value, first, second derivative) of the polynomial with ascending coefficients data[start : start + count]."""
    value, rate, second = 0.0, 0.0, 0.0
    for k in range(count - 1, -1, -1):
        second = second * t + 2.0 * rate
        rate = rate * t + value
        value = value * t + data[start + k]
    return value, rate, second


@kernel
def piecewise(data, start, t):
    """Piecewise polynomial: data = [pieces, coefficients per piece, breaks (pieces + 1), coefficients (ascending)].

    Beyond the breaks the value at the nearest break holds, at rest.
    """
    pieces, count = int(data[start]), int(data[start + 1])
    breaks = start + 2
    first, last = data[breaks], data[breaks + pieces]
    low, high = 0, pieces
    while high - low > 1:
        middle = (low + high) // 2
        if t >= data[breaks + middle]:
            low = middle
        else:
            high = middle
    clipped = min(max(t, first), last)
    value, rate, second = horner(data, breaks + pieces + 1 + low * count, count, clipped - data[breaks + low])
    if t < first or t > last:
        return value, 0.0, 0.0
    return value, rate, second


@entry
def evaluate_functions(functions, user, t, out):
    """out (F, 3) = value and two time derivatives of every time function at t; `user` holds what Python gave."""
    data = functions.data
    for f in range(functions.kind.size):
        start = functions.start[f]
        kind = functions.kind[f]
        if kind == POLYNOMIAL:
            value, rate, second = horner(data, start, functions.start[f + 1] - start, t)
        elif kind == HARMONIC:
            mean, amplitude, speed = data[start], data[start + 1], data[start + 2]
            angle = speed * t + data[start + 3]
            value = mean + amplitude * math.sin(angle)
            rate = amplitude * speed * math.cos(angle)
            second = -amplitude * speed * speed * math.sin(angle)
        elif kind == PIECEWISE:
            value, rate, second = piecewise(data, start, t)
        elif kind == OPERATION:
            value, rate, second = operate(data, start, out)
        else:
            slot = int(data[start])
            value, rate, second = user[slot], user[slot + 1], user[slot + 2]
        out[f, 0], out[f, 1], out[f, 2] = value, rate, second


@entry
def sample_functions(functions, user, times, out):
    """out (T, F, 3) = `evaluate_functions` at times (T,); user (T, U) what Python gives then."""
    for k in range(times.size):
        evaluate_functions(functions, user[k], times[k], out[k])


# ---- where they break ------------------------------------------------------------------------------------------------------


@kernel
def has_breaks(functions):
    """Whether there is anything to look for."""
    return functions.breaks.shape[0] + functions.switches.shape[0] > 0


@kernel
def switched(switches, k, values):
    """Whether the operation number k has switched, at these values of the functions."""
    a, b = switches[k, 0], switches[k, 1]
    return values[a, 0] >= (values[b, 0] if b >= 0 else 0.0)


@kernel
def first_declared(breaks, start):
    """Number of the first break after a time."""
    low, high = 0, breaks.shape[0]
    while low < high:
        middle = (low + high) // 2
        if breaks[middle, SINCE] > start:
            high = middle
        else:
            low = middle + 1
    return low


@inlined
def search_break(functions, w, start, end, found):
    """found (3,) = the first break of functions of time within (start, end], infinite where there is none.

    What a Python function gives stays as it is meanwhile.
    """
    k = first_declared(functions.breaks, start)
    found[UNTIL] = found[SINCE] = found[SEEN] = math.inf
    if k < functions.breaks.shape[0] and functions.breaks[k, SINCE] <= end:
        for c in range(3):
            found[c] = functions.breaks[k, c]
    if functions.switches.shape[0] == 0:
        return
    evaluate_functions(functions, w.user, start, w.earlier)
    evaluate_functions(functions, w.user, end, w.functions)
    for k in range(functions.switches.shape[0]):
        before = switched(functions.switches, k, w.earlier)
        if switched(functions.switches, k, w.functions) != before:
            low, high = start, end
            least = ROUNDING * max(abs(start), abs(end))
            while high - low > least:
                middle = 0.5 * (low + high)
                evaluate_functions(functions, w.user, middle, w.functions)
                if switched(functions.switches, k, w.functions) == before:
                    low = middle
                else:
                    high = middle
            evaluate_functions(functions, w.user, end, w.functions)
            if high < found[SINCE]:
                found[UNTIL], found[SINCE], found[SEEN] = low - least, high + least, high + least
