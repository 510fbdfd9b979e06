"""Operations of formulas in readable form: the specification of `ffr_dyn.kernels.operations`, and its test twin.

A function of time is a triple (value, rate, second derivative); forward differentiation carries it through a formula.
"""

from __future__ import annotations

import math
from collections.abc import Callable

Triple = tuple[float, float, float]

ADD, SUBTRACT, MULTIPLY, DIVIDE, MIN, MAX = 0, 1, 2, 3, 4, 5
POWER, SIN, COS, EXP, LOG, SQRT, TANH, ATAN, ASIN, ACOS, ABS, SIGN, STEP, SMOOTH, RAMP = range(6, 21)

# What formulas call by name. step(u): 0 before u = 0, 1 from there; smooth(u): rises from 0 to 1 between u = 0 and 1 with
# two continuous derivatives; ramp(u): its integral, an angle whose speed does not overshoot.
FUNCTIONS = {
    "sin": SIN,
    "cos": COS,
    "exp": EXP,
    "log": LOG,
    "sqrt": SQRT,
    "tanh": TANH,
    "atan": ATAN,
    "asin": ASIN,
    "acos": ACOS,
    "abs": ABS,
    "sign": SIGN,
    "step": STEP,
    "smooth": SMOOTH,
    "ramp": RAMP,
    "min": MIN,
    "max": MAX,
}


def _derivatives_of_power(u: float, n: float) -> tuple[float, float]:
    first = 0.0 if n == 0 else n * u ** (n - 1)
    return first, 0.0 if n in (0, 1) else n * (n - 1) * u ** (n - 2)


def _derivatives_of_tanh(t: float) -> tuple[float, float]:
    return (1 - t) * (1 + t), -2 * t * (1 - t) * (1 + t)


def _smooth(u: float) -> float:
    x = min(max(u, 0.0), 1.0)
    return 10 * x**3 - 15 * x**4 + 6 * x**5


def _derivatives_of_smooth(u: float) -> tuple[float, float]:
    x = min(max(u, 0.0), 1.0)
    return 30 * x**2 * (1 - x) ** 2, 60 * x * (1 - x) * (1 - 2 * x)


def _ramp(u: float) -> float:
    x = min(max(u, 0.0), 1.0)
    return 2.5 * x**4 - 3 * x**5 + x**6 + max(u - 1.0, 0.0)


_VALUE: dict[int, Callable[[float], float]] = {
    SIN: math.sin,
    COS: math.cos,
    EXP: math.exp,
    LOG: math.log,
    SQRT: math.sqrt,
    TANH: math.tanh,
    ATAN: math.atan,
    ASIN: math.asin,
    ACOS: math.acos,
    ABS: abs,
    SIGN: lambda u: float((u > 0) - (u < 0)),
    STEP: lambda u: float(u >= 0),
    SMOOTH: _smooth,
    RAMP: _ramp,
}

# f', f'' of the functions of one variable.
_DERIVATIVES: dict[int, Callable[[float], tuple[float, float]]] = {
    SIN: lambda u: (math.cos(u), -math.sin(u)),
    COS: lambda u: (-math.sin(u), -math.cos(u)),
    EXP: lambda u: (math.exp(u), math.exp(u)),
    LOG: lambda u: (1 / u, -1 / u**2),
    SQRT: lambda u: _derivatives_of_power(u, 0.5),
    TANH: lambda u: _derivatives_of_tanh(math.tanh(u)),
    ATAN: lambda u: (1 / (1 + u**2), -2 * u / (1 + u**2) ** 2),
    ASIN: lambda u: ((1 - u**2) ** -0.5, u * (1 - u**2) ** -1.5),
    ACOS: lambda u: (-((1 - u**2) ** -0.5), -u * (1 - u**2) ** -1.5),
    ABS: lambda u: (math.copysign(1.0, u), 0.0),
    SIGN: lambda u: (0.0, 0.0),
    STEP: lambda u: (0.0, 0.0),
    SMOOTH: _derivatives_of_smooth,
    RAMP: lambda u: (_smooth(u), _derivatives_of_smooth(u)[0]),
}


def value(op: int, parameter: float, a: float, b: float) -> float:
    """The operation on one (a) or two (a, b) numbers; `parameter` is the exponent of a power.

    Raises ValueError, ZeroDivisionError or OverflowError where it has no value.
    """
    if op == ADD:
        return a + b
    if op == SUBTRACT:
        return a - b
    if op == MULTIPLY:
        return a * b
    if op == DIVIDE:
        return a / b
    if op in (MIN, MAX):
        return a if (op == MAX) == (a >= b) else b
    return math.pow(a, parameter) if op == POWER else _VALUE[op](a)


def operate(op: int, parameter: float, a: Triple, b: Triple) -> Triple:
    """The operation on one (a) or two (a, b) functions of time."""
    f = value(op, parameter, a[0], b[0])
    if op == ADD:
        return f, a[1] + b[1], a[2] + b[2]
    if op == SUBTRACT:
        return f, a[1] - b[1], a[2] - b[2]
    if op == MULTIPLY:
        return f, a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]
    if op == DIVIDE:
        rate = (a[1] - f * b[1]) / b[0]
        return f, rate, (a[2] - 2 * rate * b[1] - f * b[2]) / b[0]
    if op in (MIN, MAX):
        return a if (op == MAX) == (a[0] >= b[0]) else b  # where both are one as behind a switch (`breaks.switches`)
    first, second = _derivatives_of_power(a[0], parameter) if op == POWER else _DERIVATIVES[op](a[0])
    return f, first * a[1], second * a[1] ** 2 + first * a[2]
