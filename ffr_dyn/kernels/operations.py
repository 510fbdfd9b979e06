"""Operations on functions of time: value, first and second derivative by forward differentiation.

A function of time that a formula describes is a row of the table of functions for each of its operations; the rows it works
on come before it.

Twin: `ffr_dyn.functions.operations`.
"""

import math

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.vectors import get

# as in ffr_dyn.functions.operations
ADD, SUBTRACT, MULTIPLY, DIVIDE, MIN, MAX = 0, 1, 2, 3, 4, 5
POWER, SIN, COS, EXP, LOG, SQRT, TANH, ATAN, ASIN, ACOS, ABS, SIGN, STEP, SMOOTH = range(6, 20)


@kernel
def power(u, n):
    """u^n and two derivatives; those of whole exponents down to zero stay finite at u = 0."""
    first = 0.0 if n == 0.0 else n * u ** (n - 1.0)
    second = 0.0 if n == 0.0 or n == 1.0 else n * (n - 1.0) * u ** (n - 2.0)
    return u**n, first, second


@kernel
def smooth(u):
    """10 u^3 - 15 u^4 + 6 u^5 between 0 and 1."""
    x = min(max(u, 0.0), 1.0)
    return (
        x * x * x * (10.0 + x * (6.0 * x - 15.0)),
        30.0 * x * x * (1.0 - x) ** 2,
        60.0 * x * (1.0 - x) * (1.0 - 2.0 * x),
    )


@kernel
def ramp(u):
    """The integral of `smooth`, and two derivatives."""
    x = min(max(u, 0.0), 1.0)
    rate, second, _ = smooth(u)
    return x**4 * (2.5 + x * (x - 3.0)) + max(u - 1.0, 0.0), rate, second


@kernel
def of_one(op, parameter, u):
    """(f, f', f'') of a function of one variable at u."""
    if op == POWER:
        return power(u, parameter)
    if op == SIN:
        return math.sin(u), math.cos(u), -math.sin(u)
    if op == COS:
        return math.cos(u), -math.sin(u), -math.cos(u)
    if op == EXP:
        return math.exp(u), math.exp(u), math.exp(u)
    if op == LOG:
        return math.log(u), 1.0 / u, -1.0 / (u * u)
    if op == SQRT:
        root = math.sqrt(u)
        return root, 0.5 / root, -0.25 / (u * root)
    if op == TANH:
        slope = 1.0 - math.tanh(u) ** 2
        return math.tanh(u), slope, -2.0 * math.tanh(u) * slope
    if op == ATAN:
        slope = 1.0 / (1.0 + u * u)
        return math.atan(u), slope, -2.0 * u * slope * slope
    if op in (ASIN, ACOS):
        slope = 1.0 / math.sqrt(1.0 - u * u)
        if op == ASIN:
            return math.asin(u), slope, u * slope**3
        return math.acos(u), -slope, -u * slope**3
    if op == ABS:
        return abs(u), math.copysign(1.0, u), 0.0
    if op == SIGN:
        return (0.0 if u == 0.0 else math.copysign(1.0, u)), 0.0, 0.0
    if op == STEP:
        return (1.0 if u >= 0.0 else 0.0), 0.0, 0.0
    if op == SMOOTH:
        return smooth(u)
    return ramp(u)


@kernel
def of_two(op, a, b):
    """(value, rate, second derivative) of a sum, difference, product, quotient or choice of two functions of time."""
    if op == ADD:
        return a[0] + b[0], a[1] + b[1], a[2] + b[2]
    if op == SUBTRACT:
        return a[0] - b[0], a[1] - b[1], a[2] - b[2]
    if op == MULTIPLY:
        return a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]
    if op == DIVIDE:
        value = a[0] / b[0]
        rate = (a[1] - value * b[1]) / b[0]
        return value, rate, (a[2] - 2.0 * rate * b[1] - value * b[2]) / b[0]
    if (op == MAX) == (a[0] >= b[0]):  # where both are one as `ffr_dyn.kernels.functions.switched` has it
        return a
    return b


@kernel
def operate(data, start, functions):
    """The function data = [operation, parameter, first, second operand] from rows of `functions` (F, 3)."""
    op, a = int(data[start]), get(functions, int(data[start + 2]))
    if op <= MAX:
        return of_two(op, a, get(functions, int(data[start + 3])))
    value, first, second = of_one(op, data[start + 1], a[0])
    return value, first * a[1], second * a[1] * a[1] + first * a[2]
