"""Formulas as text: numbers, with units or without, + - * / **, pi, named functions, t, parameters, inputs, measured
quantities; nothing else.

formula("0.1 * smooth(t / 0.2) * sin(2 * pi * f * t)", {"f": 12.0}) is a `TimeFunction` with exact derivatives, which the
kernels evaluate. The text is parsed, never run: it can name what is listed above and reach nothing.
"""

from __future__ import annotations

import ast
import difflib
import math
import re
from collections import ChainMap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ffr_dyn.functions.operations import ADD, DIVIDE, EXP, FUNCTIONS, LOG, MAX, MULTIPLY, POWER, SUBTRACT, value
from ffr_dyn.functions.quantities import Marked, check_dimension, known_quantities, marked
from ffr_dyn.functions.time_functions import (
    OPERATION,
    POLYNOMIAL,
    TimeFunction,
    constant,
    evaluate,
    operation,
    polynomial,
)
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import is_unit

CONSTANTS = {"pi": math.pi, "e": math.e}
TIME = polynomial(0.0, 1.0)
_DEEPEST = 100

_OPERATORS = {ast.Add: ADD, ast.Sub: SUBTRACT, ast.Mult: MULTIPLY, ast.Div: DIVIDE}
_SIGNS = {ADD: "+", SUBTRACT: "-", MULTIPLY: "*", DIVIDE: "/"}


@dataclass(frozen=True)
class Measured:
    """A quantity of the moving system by name, such as "rod.tip.position.x"."""

    name: str


@dataclass(frozen=True)
class Operation:
    """An operation on expressions, where one of them is measured."""

    op: int
    parameter: float
    operands: tuple[Expression, ...]


Expression = TimeFunction | Measured | Operation


def formula(
    text: str, parameters: Mapping[str, Any] = {}, what: str = "formula", unit: str | None = None
) -> TimeFunction:
    """The function of time that a formula describes, with exact derivatives.

    unit : in which it is wanted, SI; None for any
    Raises InputError that names `what`, the place in the text and the nearest known name.

    >>> push = fd.formula("100 * sin(2 * pi * f * t)", {"f": 5.0})
    """
    found = parse(text, parameters, what, unit)
    if isinstance(found, TimeFunction):
        return found
    raise InputError(
        f"{what}: {text!r} depends on {next(names_in(found))!r}, which is not a parameter; only t and parameters can be "
        f"used here{_nearest(next(names_in(found)), parameters)}"
    )


def number(text: str, parameters: Mapping[str, Any] = {}, what: str = "formula", unit: str | None = None) -> float:
    """The value of a formula without t. Raises InputError when it depends on time or on the motion."""
    function = formula(text, parameters, what, unit)
    if not is_constant(function):
        raise InputError(f"{what}: {text!r} depends on t; a number is needed here")
    return function.data[0]


def is_constant(function: TimeFunction) -> bool:
    """Whether the function is a number."""
    return function.kind == POLYNOMIAL and len(function.data) == 1


def parse(text: str, parameters: Mapping[str, Any], what: str, unit: str | None = None) -> Expression:
    """A formula as a function of time or, where it names measured quantities, as an expression of those.

    Names that are no parameters are taken for measured quantities when they contain a dot.
    unit : in which it is wanted, SI; None for any (`ffr_dyn.functions.quantities`)
    """
    try:
        plain = marked(text.strip())
        names = ChainMap(dict(plain.quantities), parameters)  # type: ignore[arg-type]
        tree = ast.parse(plain.text, mode="eval").body
        check_dimension(tree, known_quantities(tree, plain.quantities, parameters), unit)
    except InputError as error:
        raise InputError(f"{what}: in the formula {text!r}: {error}") from None
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else error
        raise InputError(f"{what}: {text!r} is not a formula ({reason})") from None
    return _Reader(text, plain, names, what).read(tree, 0)


def names_in(expression: Expression) -> Iterator[str]:
    """Measured quantities that an expression names, in order."""
    if isinstance(expression, Measured):
        yield expression.name
    elif isinstance(expression, Operation):
        for operand in expression.operands:
            yield from names_in(operand)


def value_of(expression: Expression, t: float, measured: Mapping[str, float]) -> float:
    """The value at time t [s], given the measured quantities; NaN where it has none."""
    if isinstance(expression, Measured):
        return measured[expression.name]
    try:
        if isinstance(expression, TimeFunction):
            return evaluate(expression, t)[0]
        given = [value_of(operand, t, measured) for operand in expression.operands]
        return value(expression.op, expression.parameter, given[0], given[-1])
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


@dataclass(frozen=True)
class _Reader:
    """Turns the syntax tree of one text into an expression, and refuses whatever is not listed."""

    text: str
    plain: Marked
    parameters: Mapping[str, Any]
    what: str

    def read(self, node: ast.expr, depth: int) -> Expression:
        if depth > _DEEPEST:
            raise self._refusal(node, f"is nested more than {_DEEPEST} deep")
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return self._number(node)
        if isinstance(node, (ast.Name, ast.Attribute, ast.Subscript)):
            return self._named(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            inside = self.read(node.operand, depth + 1)
            return inside if isinstance(node.op, ast.UAdd) else self._apply(node, MULTIPLY, constant(-1.0), inside)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            return self._power(node, self.read(node.left, depth + 1), self.read(node.right, depth + 1))
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            sides = self.read(node.left, depth + 1), self.read(node.right, depth + 1)
            return self._apply(node, _OPERATORS[type(node.op)], *sides)
        if isinstance(node, ast.Call):
            return self._call(node, depth)
        raise self._refusal(node, "is not allowed; a formula has numbers, + - * / **, names and functions of numbers")

    def _number(self, node: ast.Constant) -> Expression:
        try:
            return constant(float(node.value))  # type: ignore[arg-type]
        except (OverflowError, InputError):
            raise self._refusal(node, "is too large a number") from None

    def _named(self, node: ast.expr) -> Expression:
        name = self._dotted(node)
        if name in self.parameters:
            return self._parameter(node, self.parameters[name])
        if name in CONSTANTS:
            return constant(CONSTANTS[name])
        if name == "t":
            return TIME
        if "." in name:
            return Measured(name)
        if is_unit(name):
            raise self._refusal(node, "is not known; if it is a unit, write it behind its number, without *: '3 N m'")
        known = [*(one for one in self.parameters if one.isascii()), *CONSTANTS, "t", *FUNCTIONS]
        raise self._refusal(node, f"is not known{_nearest(name, known)}")

    def _parameter(self, node: ast.expr, given: object) -> Expression:
        if isinstance(given, TimeFunction):  # an input of the scene
            return given
        if not isinstance(given, (int, float)) or isinstance(given, bool):
            raise self._refusal(node, f"is the parameter {given!r}, which is not a number")
        return constant(float(given))  # type: ignore[arg-type]

    def _dotted(self, node: ast.expr) -> str:
        """a.b.c, and a.b[3] for what has a number in its name."""
        if isinstance(node, ast.Name):
            return node.id
        if isinstance(node, ast.Attribute):
            return f"{self._dotted(node.value)}.{node.attr}"
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and type(node.slice.value) is int:
            return f"{self._dotted(node.value)}.{node.slice.value}"
        raise self._refusal(node, "is not a name")

    def _call(self, node: ast.Call, depth: int) -> Expression:
        name = self.plain.back(ast.unparse(node.func))
        if name not in FUNCTIONS:
            raise self._refusal(node, f"calls {name!r}, which is not a known function{_nearest(name, FUNCTIONS)}")
        op = FUNCTIONS[name]
        wanted = 2 if op <= MAX else 1
        if node.keywords or len(node.args) != wanted or any(isinstance(a, ast.Starred) for a in node.args):
            raise self._refusal(node, f"does not give {name} its {wanted} argument{'s' * (wanted - 1)}")
        return self._apply(node, op, *(self.read(argument, depth + 1) for argument in node.args))

    def _power(self, node: ast.expr, base: Expression, exponent: Expression) -> Expression:
        """u ** n, or exp(v log u) where the exponent varies."""
        if isinstance(exponent, TimeFunction) and is_constant(exponent):
            return self._apply(node, POWER, base, parameter=exponent.data[0])
        return self._apply(node, EXP, self._apply(node, MULTIPLY, exponent, self._apply(node, LOG, base)))

    def _apply(self, node: ast.expr, op: int, *operands: Expression, parameter: float = 0.0) -> Expression:
        """The operation, carried out at once where all operands are numbers."""
        functions = tuple(operand for operand in operands if isinstance(operand, TimeFunction))
        if len(functions) < len(operands):
            return Operation(op, parameter, operands)
        whole = operation(op, *functions, parameter=parameter)
        if not all(map(is_constant, functions)):
            return whole
        try:
            return constant(value(op, parameter, functions[0].data[0], functions[-1].data[0]))
        except (ValueError, ZeroDivisionError, OverflowError) as error:
            raise self._refusal(node, f"has no value ({error})") from None

    def _refusal(self, node: ast.expr, why: str) -> InputError:
        piece = self.plain.back(ast.get_source_segment(self.plain.text, node) or self.plain.text)
        return InputError(f"{self.what}: in the formula {self.text!r}, {piece[:80]!r} {why}")


def _nearest(name: str, known: Mapping[str, Any] | list[str]) -> str:
    close = difflib.get_close_matches(name, list(known), 1)
    return f"; did you mean {close[0]!r}?" if close else f"; known are: {', '.join(dict.fromkeys(known)) or 'none'}"


# ---- back to text -------------------------------------------------------------------------------------------------


def text_of(expression: Expression) -> str:
    """A formula that `parse` reads back as the same expression. Raises InputError for what has no formula (a table)."""
    if isinstance(expression, Measured):
        return re.sub(r"\.(\d+)", r"[\1]", expression.name)
    if isinstance(expression, Operation) or expression.kind == OPERATION:
        op, parameter = (
            (expression.op, expression.parameter) if isinstance(expression, Operation) else _coded(expression)
        )
        return _written(op, parameter, [text_of(operand) for operand in expression.operands])
    if expression.name:
        return expression.name
    if expression == TIME:
        return "t"
    if is_constant(expression):
        return repr(expression.data[0])
    raise InputError(
        "a table or another function of time is part of a formula; formulas in text cannot hold it: write "
        "it in terms of t"
    )


def _coded(function: TimeFunction) -> tuple[int, float]:
    return int(function.data[0]), function.data[1]


def _written(op: int, parameter: float, operands: list[str]) -> str:
    if op in _SIGNS:
        return f"({operands[0]} {_SIGNS[op]} {operands[1]})"
    if op == POWER:
        return f"({operands[0]}) ** ({parameter!r})"
    name = next(name for name, number_ in FUNCTIONS.items() if number_ == op)
    return f"{name}({', '.join(operands)})"
