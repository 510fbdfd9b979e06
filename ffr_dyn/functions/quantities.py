"""Numbers with units within formulas, "0.2 m + 100 mm/s * t": how they are found in the text, and what unit comes of them.

What can be known is known: a number with a unit, and t, in seconds. Other numbers, and values of functions, are pure where
they multiply, and take the unit of what they are added to. A parameter that is a number with a unit is known, too, where no
number without one stands beside it: "-g", but not "3 * g", whose 3 may be of any unit. Of other parameters, which are
numbers in SI units here, of inputs and of measured quantities nothing is known, nor of what they multiply. A formula without
any unit is not looked at.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass

from ffr_prep.common.errors import InputError
from ffr_prep.common.units import Dimension, dimension_of, in_words, is_unit, to_si

_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?+(?=\s*[A-Za-zµ])")
_WORD = re.compile(r"\s*([A-Za-zµ]+)(?:\^-?\d+)?")
_NEXT = re.compile(r"(/| +)([A-Za-zµ]+)(?:\^-?\d+)?")
_FIRST = 0x3400  # letters that no formula has stand for quantities in what Python parses
_PURE: Dimension = (0, 0, 0, 0)
_SECONDS: Dimension = (0, 0, 1, 0)
_ANGLES = ("sin", "cos", "tan")
_LIKE_THEIRS = ("abs", "min", "max")


class WithUnit(float):
    """A number in SI units that remembers the unit it was given in."""

    unit: str


def with_unit(value: float, unit: str) -> WithUnit:
    """The number in SI units."""
    found = WithUnit(to_si(value, unit))
    found.unit = unit
    return found


@dataclass(frozen=True)
class Marked:
    """A formula in which a name of the same length stands for each number with a unit."""

    text: str
    quantities: Mapping[str, WithUnit]
    written: Mapping[str, str]

    def back(self, piece: str) -> str:
        """A piece of the text as it was written."""
        for name, words in self.written.items():
            piece = piece.replace(name, words)
        return piece


def marked(text: str) -> Marked:
    """A formula with its numbers with units marked.

    A unit follows its number at once or after a space. A "/" without spaces belongs to it, one with spaces divides:
    "3 N/mm * x", "3 N / length". Raises InputError for an unknown unit.
    """
    quantities: dict[str, WithUnit] = {}
    written: dict[str, str] = {}
    pieces, at = [], 0
    while found := _NUMBER.search(text, at):
        end = _end_of_unit(text, found.end())
        name = f"{chr(_FIRST + len(written)):_<{end - found.start()}}"
        quantities[name] = with_unit(float(found[0]), text[found.end() : end].strip())
        written[name] = text[found.start() : end]
        pieces += [text[at : found.start()], name]
        at = end
    return Marked("".join([*pieces, text[at:]]), quantities, written)


def _end_of_unit(text: str, start: int) -> int:
    first = _WORD.match(text, start)
    assert first is not None  # the pattern of numbers looks ahead for it
    end = first.end()
    while (following := _NEXT.match(text, end)) and (following[1] == "/" or is_unit(following[2])):
        end = following.end()
    return end


def known_quantities(
    tree: ast.expr, quantities: Mapping[str, WithUnit], parameters: Mapping[str, object]
) -> Mapping[str, WithUnit]:
    """What has a unit in a formula: its numbers, and parameters unless numbers without one stand beside them."""
    if any(isinstance(node, ast.Constant) for node in ast.walk(tree)):
        return quantities
    names = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, (ast.Name, ast.Attribute))} & set(
        parameters
    )
    given = {name: parameters[name] for name in sorted(names - set(quantities))}
    return {**quantities, **{name: value for name, value in given.items() if isinstance(value, WithUnit)}}


# ---- what unit comes of them ----------------------------------------------------------------------------------------


def check_dimension(tree: ast.expr, quantities: Mapping[str, WithUnit], wanted: str | None) -> None:
    """InputError for a formula with units that adds different ones, or comes to another than the wanted, if one is.

    Radians are pure numbers here, so that arcs are lengths.
    """
    if not quantities:
        return
    found = _dimension(tree, quantities)
    if wanted is None or found is None or found == _PURE:
        fits = True
    else:
        fits = any(found[:3] == dimension_of(one)[:3] for one in wanted.split(" or "))
    if not fits:
        raise InputError(
            f"it comes to {in_words(found or _PURE)}, and is given in {wanted}: give all its numbers their units, or none"
        )
    turns = wanted is not None and any(dimension_of(one)[3] for one in wanted.split(" or "))
    if turns and found == _PURE:
        _check_turns(tree, quantities)


def _check_turns(tree: ast.expr, quantities: Mapping[str, WithUnit]) -> None:
    """Hz counts turns: an angle of it needs 2 pi."""
    inside = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name)]
    if "pi" not in inside and any("Hz" in quantities[name].unit for name in inside if name in quantities):
        raise InputError(
            "Hz counts turns, and an angle is wanted: write 2 * pi before it, or rad/s or rpm in its place"
        )


def _dimension(node: ast.expr, quantities: Mapping[str, WithUnit]) -> Dimension | None:
    """Of a piece of a formula; None where it is not known."""
    if isinstance(node, ast.UnaryOp):
        return _dimension(node.operand, quantities)
    if isinstance(node, ast.BinOp):
        return _of_two(node, quantities)
    if isinstance(node, ast.Call):
        return _of_call(node, quantities)
    if isinstance(node, ast.Constant):
        return _PURE
    name = ast.unparse(node)
    if name in quantities:
        return dimension_of(quantities[name].unit)
    return {"t": _SECONDS, "pi": _PURE, "e": _PURE}.get(name)


def _of_two(node: ast.BinOp, quantities: Mapping[str, WithUnit]) -> Dimension | None:
    one, other = _dimension(node.left, quantities), _dimension(node.right, quantities)
    if isinstance(node.op, (ast.Add, ast.Sub)):
        return _same(one, other)
    if one is None or other is None:
        return None
    if isinstance(node.op, ast.Pow):
        return _power(one, node.right)
    sign = -1 if isinstance(node.op, ast.Div) else 1
    a, b, c, d = (x + sign * y for x, y in zip(one, other, strict=True))
    return a, b, c, d


def _power(base: Dimension, exponent: ast.expr) -> Dimension | None:
    if base == _PURE:
        return _PURE
    if isinstance(exponent, ast.Constant) and isinstance(exponent.value, int):
        a, b, c, d = (exponent.value * x for x in base)
        return a, b, c, d
    return None


def _same(one: Dimension | None, other: Dimension | None) -> Dimension | None:
    """Of a sum."""
    if one is None or other is None:
        return one if other is None else other
    if _PURE in (one, other) or one[:3] == other[:3]:
        return one if other == _PURE else other
    raise InputError(f"it adds {in_words(one)} and {in_words(other)}: give all its numbers their units, or none")


def _of_call(node: ast.Call, quantities: Mapping[str, WithUnit]) -> Dimension | None:
    function, given = ast.unparse(node.func), [_dimension(argument, quantities) for argument in node.args]
    if function in _LIKE_THEIRS and given:
        return _same(given[0], given[-1])
    wrong = next((of for of in given if of is not None and of[:3] not in (_PURE[:3], _SECONDS[:3])), None)
    if wrong is not None and function != "sqrt":
        raise InputError(
            f"{function} is of a pure number or an angle, and is given {in_words(wrong)}: divide it by its unit"
        )
    if function in _ANGLES and _PURE in given:
        _check_turns(node, quantities)
    return None if function == "sqrt" else _PURE
