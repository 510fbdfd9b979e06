"""Functions of time for drivers and loads: each with two derivatives, compiled to numbers for the kernels.

constant(5.0)   polynomial(0, 150)   harmonic(amplitude=.1, frequency=2)   table(times, values)   user(f)
signal("torque") and, by `ffr_dyn.functions.formula`, formula("0.1 * sin(2 * pi * t)")
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from numbers import Real
from reprlib import repr as brief
from typing import ParamSpec

import numpy as np

from ffr_dyn.functions.operations import SUBTRACT, operate
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

# Kinds, as in ffr_dyn.kernels.functions (which must not be imported before it is needed: it loads the compiler).
POLYNOMIAL, HARMONIC, PIECEWISE, USER, OPERATION = 0, 1, 2, 3, 4


@dataclass(frozen=True, repr=False)
class TimeFunction(Brief):
    """A function of time as the kernels read it: its kind and its numbers; `callback` for a Python function.

    data     : as the kind has them, in the unit of what the function is for, and times [s]
    operands : what an operation of a formula (data: its number, its parameter) works on
    name     : of an input of the scene, see `signal`

    >>> isinstance(fd.polynomial(0, 150), fd.TimeFunction)
    """

    kind: int
    data: tuple[float, ...]
    callback: Callable[[float], object] | None = None
    operands: tuple[TimeFunction, ...] = ()
    name: str = ""


def constant(value: float) -> TimeFunction:
    """The same `value` at all times, in the unit of what it is for: a joint's angle [rad], a component of a force [N].

    Raises InputError for a number that is not finite.

    >>> speed = fd.constant(150.0)
    """
    return polynomial(value)


def polynomial(*coefficients: float) -> TimeFunction:
    """c0 + c1 t + c2 t^2 + ..., t [s]; `polynomial(0, 150)` is a crank that turns at 150 rad/s.

    coefficients : c0 in the unit of what it is for, as [rad], c1 in that per second [rad/s], ...

    Raises InputError for a number that is not finite.

    >>> angle = fd.polynomial(0, 150)
    """
    return TimeFunction(POLYNOMIAL, _numbers("polynomial", coefficients))


P = ParamSpec("P")


def _by_name(function: Callable[P, TimeFunction]) -> Callable[P, TimeFunction]:
    """The function, which answers numbers that are missing or without their names by an InputError with the names."""

    @wraps(function)
    def named(*args: P.args, **kwargs: P.kwargs) -> TimeFunction:
        try:
            signature(function).bind(*args, **kwargs)
        except TypeError as error:
            given = ", ".join([*map(repr, args), *(f"{name}={value!r}" for name, value in kwargs.items())])
            names = ", ".join(f"{name}=..." for name in signature(function).parameters)
            name = function.__name__
            raise InputError(f"{name}({given}): {error}; its numbers have names: {name}({names})") from None
        return function(*args, **kwargs)

    return named


@_by_name
def harmonic(*, amplitude: float, frequency: float, phase: float = 0.0, mean: float = 0.0) -> TimeFunction:
    """mean + amplitude sin(2 pi frequency t + phase).

    amplitude, mean : in the unit of what it is for: a stroke [m], a force [N];  frequency : [Hz];  phase : [rad]

    Raises InputError for a number that is not finite.

    >>> shake = fd.harmonic(amplitude=0.01, frequency=5.0)
    """
    return TimeFunction(HARMONIC, _numbers("harmonic", (mean, amplitude, 2 * np.pi * frequency, phase)))


def table(times: Array, values: Array) -> TimeFunction:
    """Not-a-knot cubic spline through values (T,) at times (T,) [s], twice differentiable; holds its end values outside.

    Raises InputError unless there are two or more times, increasing, with as many values,
    that a spline can go through.

    >>> angle = fd.table(np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.2, 0.0]))
    """
    from scipy.interpolate import CubicSpline

    t, y = numbers_in("times of a table", times), numbers_in("values of a table", values)
    if t.ndim != 1 or t.shape != y.shape or t.size < 2:
        raise InputError(f"a table needs two or more times and as many values, not {t.size} and {y.size}")
    _numbers("table", (*t, *y))
    if not (np.diff(t) > 0).all():
        first = int(np.argmin(np.diff(t) > 0))
        raise InputError(
            f"the times of a table must increase; after {t[first]:g} s comes {t[first + 1]:g} s, in row {first + 2}"
        )
    try:
        with np.errstate(all="ignore"):
            c = CubicSpline(t, y).c
    except ValueError:  # slopes that are no numbers
        c = np.full((4, 1), np.nan)
    if not np.isfinite(c).all():
        raise InputError("a table rises too steeply between two of its rows for a spline: check its times and values")
    return piecewise(t, c[::-1].T)


def piecewise(breaks: Array, coefficients: Array) -> TimeFunction:
    """Piecewise polynomial between breaks (pieces + 1,); coefficients (pieces, k) of the powers of t less the piece's start.

    Raises InputError for other shapes, breaks that do not increase, and numbers that are not finite.

    >>> ramp = fd.piecewise(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 1.0], [1.0, 0.0]]))
    """
    given, breaks = numbers_in("coefficients", coefficients), numbers_in("breaks", breaks)
    shape, steps = given.shape, np.diff(breaks)
    if len(shape) != 2 or steps.shape != shape[:1] or not (steps > 0).all():
        raise InputError(
            f"a piecewise polynomial needs coefficients (pieces, k) and increasing breaks (pieces + 1,); here are {shape} "
            f"coefficients and {np.size(breaks)} breaks. For values at times use `table`"
        )
    return TimeFunction(
        PIECEWISE,
        (float(shape[0]), float(shape[1]), *_numbers("piecewise polynomial", (*breaks, *given.ravel()))),
    )


def user(function: Callable[[float], object], breaks: Sequence[float] = ()) -> TimeFunction:
    """A Python function of t [s] -> value, or -> (value, rate, second derivative) where it drives a joint coordinate.

    breaks : times [s] at which it jumps or has a kink: steps end there, which keeps their order

    Raises InputError for a time that is not finite.

    >>> push = fd.user(lambda t: 100.0 * np.exp(-t))
    >>> on = fd.user(lambda t: 100.0 if t >= 0.3 else 0.0, breaks=[0.3])
    """
    if np.ndim(breaks) != 1:
        raise InputError(f"breaks: {breaks!r} is no list of times [s]; give breaks=[{breaks!r}]")
    times = _numbers("breaks", tuple(breaks)) if len(breaks) else ()
    return TimeFunction(USER, (0.0, *times), function)


def signal(name: str, value: float = 0.0) -> TimeFunction:
    """An input of the scene, by name: it has its initial `value`, in the unit of where it stands, such as [N], until a
    `ffr_dyn.realtime.stepper.Stepper` sets another.

    The same signal may stand in several places. Raises InputError for a name that is no word, or a value not finite.

    >>> motor = fd.Actuator("motor", "hinge", force=fd.signal("torque", 2.0))
    """
    if not isinstance(name, str) or not name.isidentifier():
        raise InputError(f"{name!r} cannot be the name of an input: use letters, digits and '_', a letter first")
    return TimeFunction(PIECEWISE, (*SIGNAL, *_numbers(f"input {name!r}", (value, 0.0, 0.0))), name=name)


# One piece of three coefficients from the time when it was set, for ever.
SIGNAL = (1.0, 3.0, 0.0, 1e300)


def signals_in(function: TimeFunction) -> Iterator[TimeFunction]:
    """The signals of which a function is made."""
    if function.name:
        yield function
    for operand in function.operands:
        yield from signals_in(operand)


def operation(op: int, *operands: TimeFunction, parameter: float = 0.0) -> TimeFunction:
    """An operation of `ffr_dyn.functions.operations` on one or two functions of time."""
    return TimeFunction(OPERATION, (float(op), parameter), None, operands)


def less(a: TimeFunction, b: TimeFunction) -> TimeFunction:
    """a - b, of the kind of b where a is zero, so that what is written as a table stays one."""
    if not is_zero(a) or b.name or b.kind in (USER, OPERATION):
        return operation(SUBTRACT, a, b)
    kept = int(b.data[0]) + 3 if b.kind == PIECEWISE else 0  # counts and breaks
    data = np.array(b.data)
    data[kept:] *= -1
    if b.kind == HARMONIC:
        data[2:] *= -1  # speed and phase
    return TimeFunction(b.kind, tuple(data.tolist()))


def as_time_function(value: object, what: str) -> TimeFunction:
    """A number, a Python function or a TimeFunction as a TimeFunction; InputError names `what` otherwise."""
    if isinstance(value, TimeFunction):
        return value
    if callable(value):
        return user(value)
    if isinstance(value, (int, float, np.floating, np.integer)):
        return constant(float(value))
    raise InputError(f"{what} must be a number, a time function or a Python function of time, not {value!r}")


def is_zero(function: TimeFunction) -> bool:
    """Whether a function is the constant zero by its declaration."""
    return function.kind == POLYNOMIAL and function.callback is None and not any(function.data)


def numbers_in(what: str, given: object) -> Array:
    """An array of the numbers; InputError where there are others than numbers in it, or rows of different lengths."""
    try:
        return np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(f"{what}: give numbers, as many in each row, not {brief(given)}") from None


def _numbers(what: str, values: tuple[float, ...]) -> tuple[float, ...]:
    if not values or not all(isinstance(value, Real) and np.isfinite(value) for value in values):
        raise InputError(f"{what}: all of these must be finite numbers: {values}")
    return tuple(float(v) for v in values)


def evaluate(function: TimeFunction, t: float) -> tuple[float, float, float]:
    """(value, rate, second derivative) at t; the readable twin of `ffr_dyn.kernels.functions.evaluate_functions`."""
    if function.callback is not None:
        returned = np.atleast_1d(np.asarray(function.callback(t), float))
        return tuple(np.concatenate([returned, np.zeros(3)])[:3])
    if function.kind == OPERATION:
        given = [evaluate(operand, t) for operand in function.operands]
        return operate(int(function.data[0]), function.data[1], given[0], given[-1])
    data = np.array(function.data)
    if function.kind == HARMONIC:
        mean, amplitude, speed, phase = data
        angle = speed * t + phase
        wave = amplitude * np.sin(angle)
        return mean + wave, amplitude * speed * np.cos(angle), -(speed**2) * wave
    if function.kind == POLYNOMIAL:
        return _derivatives(data, t)
    pieces, count = int(data[0]), int(data[1])
    breaks = data[2 : pieces + 3]
    inside = min(max(t, breaks[0]), breaks[-1])
    piece = min(int(np.searchsorted(breaks, inside, side="right")) - 1, pieces - 1)
    coefficients = data[pieces + 3 :].reshape(pieces, count)[piece]
    value, rate, second = _derivatives(coefficients, inside - breaks[piece])
    return (value, rate, second) if inside == t else (value, 0.0, 0.0)


def _derivatives(coefficients: Array, t: float) -> tuple[float, float, float]:
    """Value and derivatives of a polynomial, lowest power first: Horner's rule, and its derivatives by the product rule."""
    value = rate = half = 0.0
    for c in reversed(coefficients.tolist()):
        half = half * t + rate
        rate = rate * t + value
        value = value * t + c
    return value, rate, 2 * half
