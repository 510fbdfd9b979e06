"""Time functions and applied loads: wrenches on markers, spring-dampers, values of the user's Python functions."""

import math

from numba import types
from numba.extending import intrinsic

from ffr_dyn.kernels.markers import apply_wrench
from ffr_dyn.kernels.operations import operate
from ffr_dyn.kernels.options import entry, inlined, kernel
from ffr_dyn.kernels.vectors import dot, fill, get, scale, subtract, to_body

POLYNOMIAL, HARMONIC, PIECEWISE, USER, OPERATION = 0, 1, 2, 3, 4


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


@intrinsic
def _call_address(typing, address, t, x, v, out):
    """int function(double t, double *x, double *v, double *out) at a machine address."""
    signature = types.int64(types.intp, types.float64, types.intp, types.intp, types.intp)

    def generate(context, builder, sig, args):
        from llvmlite import ir

        integer, real = ir.IntType(64), ir.DoubleType()
        function = ir.FunctionType(integer, [real, integer, integer, integer])
        pointer = builder.inttoptr(args[0], function.as_pointer())
        return builder.call(pointer, list(args[1:]))

    return signature, generate


@kernel
def call_user(address, t, x, v, user):
    """Let the user's Python functions fill `user`. Returns True when they did."""
    if user.size == 0:
        return True
    return _call_address(address, t, x.ctypes.data, v.ctypes.data, user.ctypes.data) == 0  # type: ignore[call-arg]


@kernel
def load_component(loads, functions, user, k, c):
    value = loads.value[k, c]
    function = loads.function[k, c]
    if function >= 0:
        value *= functions[function, 0]
    slot = loads.wrench[k, 2]
    if slot >= 0:
        value += user[slot + c]
    return value


@inlined
def given_wrench(loads, functions, user, A, k):
    """(force, moment) of wrench k in body axes; A (3, 3) of the marker's body."""
    force = (
        load_component(loads, functions, user, k, 0),
        load_component(loads, functions, user, k, 1),
        load_component(loads, functions, user, k, 2),
    )
    moment = (
        load_component(loads, functions, user, k, 3),
        load_component(loads, functions, user, k, 4),
        load_component(loads, functions, user, k, 5),
    )
    if loads.wrench[k, 1] == 0:
        return to_body(A, force), to_body(A, moment)
    return force, moment


@kernel
def spring_force(loads, markers, k):
    """(force, direction i -> j) of spring-damper k; the force is positive in tension. markers: MarkerWork."""
    i, j = loads.spring[k, 0], loads.spring[k, 1]
    d = subtract(get(markers.r, j), get(markers.r, i))
    length = dot(d, d) ** 0.5
    if length == 0.0:
        return 0.0, d
    direction = scale(1.0 / length, d)
    rate = dot(direction, subtract(get(markers.rd, j), get(markers.rd, i)))
    data = loads.spring_data[k]
    return data[0] * (length - data[2]) + data[1] * rate + data[3], direction


@inlined
def apply_loads(where, markers, loads, w, functions, user, f):
    """Add all wrenches and springs to the right-hand sides f, and to w.load; w: MarkerWork."""
    for k in range(w.load.shape[0]):
        fill(w.load[k], 0.0)
    for k in range(loads.wrench.shape[0]):
        marker = loads.wrench[k, 0]
        force, moment = given_wrench(loads, functions, user, w.A[marker], k)
        apply_wrench(where, markers, get(w.u, marker), f, w.load[marker], marker, force, moment)
    for k in range(loads.spring.shape[0]):
        force, direction = spring_force(loads, w, k)
        for side in range(2):
            marker = loads.spring[k, side]
            pull = to_body(w.A[marker], scale(force if side == 0 else -force, direction))
            apply_wrench(where, markers, get(w.u, marker), f, w.load[marker], marker, pull, (0.0, 0.0, 0.0))
