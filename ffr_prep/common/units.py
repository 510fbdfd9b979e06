"""Units as people read them: 0.0032 m is shown as 3.2 mm, 4500 N as 4.5 kN; and as they write them: "3.2 mm" is 0.0032."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from difflib import get_close_matches

from ffr_prep.common.errors import InputError

SEPARATOR = ", "  # of units of the labels of an axis
_PREFIXES = {-9: "n", -6: "µ", -3: "m", 3: "k", 6: "M", 9: "G"}
_TAKES_PREFIX = re.compile(r"(m|s|N|J|W|Pa|Hz)(?![\w^²³])")


def readable(unit: str, largest: float) -> tuple[float, str]:
    """Factor and unit in which values up to ``largest`` (in ``unit``) are read easily: values * factor in that unit.

    The unit stays when the values lie between 0.1 and 10000, when it takes no prefix (such as rad, kg, m^2), or when
    the values are zero or not finite.
    """
    if not (0.0 < abs(largest) < float("inf")) or 0.1 <= abs(largest) < 1e4 or not _TAKES_PREFIX.match(unit):
        return 1.0, pretty(unit)
    fitting = [power for power in _PREFIXES if 10.0**power <= abs(largest)]
    power = max(fitting, default=-9)
    return 10.0**-power, _PREFIXES[power] + pretty(unit)


def pretty(unit: str) -> str:
    """The unit as it is printed: "m/s^2" as m/s², "m sqrt(kg)" as m √kg, "1" as nothing."""
    text = re.sub(r"sqrt\((\w+)\)", r"√\1", unit).replace("^2", "²").replace("^3", "³")
    return "" if text == "1" else text


def bracketed(name: str, unit: str) -> str:
    """A label such as "position [mm]"; without brackets for a number."""
    return f"{name} [{unit}]".strip() if unit else name


def quotient(unit: str, by: str) -> str:
    """The unit of one quantity over another: "m/N", "m/(N m)", "1/N"; "1" of two alike."""
    if by in ("", "1"):
        return unit or "1"
    return "1" if unit == by else f"{unit or '1'}/{f'({by})' if set(by) & set(' /') else by}"


def square(unit: str) -> str:
    """The unit of the square: "m^2", "(m/s^2)^2"."""
    if unit in ("", "1"):
        return "1"
    return f"{unit}^2" if unit.isalpha() else f"({unit})^2"


def listed_units(units: Sequence[str]) -> str:
    """Those of labels of an axis as one text: "m" where they are alike, "m, rad" where they are not."""
    return units[0] if len(set(units)) == 1 else SEPARATOR.join(units)


def unit_of_label(units: str, number: int) -> str:
    """That of one label of the text that `listed_units` has made."""
    return units.split(SEPARATOR)[number] if SEPARATOR in units else units


# ---- units as people write them -----------------------------------------------------------------------------------

# Factor to SI and powers of kg, m, s, rad. A turn is not a radian: Hz and rad/s are different things here.
_UNITS: dict[str, tuple[float, tuple[int, int, int, int]]] = {
    "kg": (1.0, (1, 0, 0, 0)),
    "g": (1e-3, (1, 0, 0, 0)),
    "m": (1.0, (0, 1, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "h": (3600.0, (0, 0, 1, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "J": (1.0, (1, 2, -2, 0)),
    "W": (1.0, (1, 2, -3, 0)),
    "Pa": (1.0, (1, -1, -2, 0)),
    "bar": (1e5, (1, -1, -2, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "rad": (1.0, (0, 0, 0, 1)),
    "deg": (math.pi / 180, (0, 0, 0, 1)),
    "rev": (2 * math.pi, (0, 0, 0, 1)),
    "rpm": (2 * math.pi / 60, (0, 0, -1, 1)),
    "in": (0.0254, (0, 1, 0, 0)),
    "1": (1.0, (0, 0, 0, 0)),
}
_SCALES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6, "G": 1e9}
_TAKES_SCALE = ("m", "g", "s", "N", "J", "W", "Pa", "Hz", "rad")
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?+)\s*([A-Za-zµ].*?)\s*")  # "1e3*t" is none
_IN_FORMULAS = re.compile(r"[+()]|(?<!\^)-|\*\*|[*/]\s*[\d.]")
_APART = re.compile(r"\*|\s/|/\s")
_WORDS = re.compile(r"[A-Za-zµ]+")
_FACTOR = re.compile(r"([*/ ]?)\s*([A-Za-zµ]+|1)(?:\^(-?\d+))?\s*")

Dimension = tuple[int, int, int, int]
_PURE: Dimension = (0, 0, 0, 0)


def split_quantity(text: str) -> tuple[float, str] | None:
    """(3.0, "mm") of "3 mm"; None for a text of another form, such as the formula "3 mm * x"."""
    found = _QUANTITY.fullmatch(text)
    if found is None or _IN_FORMULAS.search(found[2]):
        return None
    words = _WORDS.findall(found[2])
    divides = _APART.search(found[2]) is not None  # by a parameter, where a word is no unit
    return None if divides and not all(map(is_unit, words)) else (float(found[1]), found[2])


def is_unit(word: str) -> bool:
    """Whether a word is a unit, such as mm."""
    return word in _UNITS or (word[0] in _SCALES and word[1:] in _TAKES_SCALE)


def dimension_of(unit: str) -> Dimension:
    """The powers of kg, m, s and rad in a unit. Raises InputError as `to_si`."""
    return _parsed(unit)[1]


def in_words(dimension: Dimension) -> str:
    """A dimension as a unit, N where it is one: "kg m/s"."""
    known = {of: name for name, (size, of) in reversed(_UNITS.items()) if size == 1.0}
    if dimension in known:
        return known[dimension] if dimension != _PURE else "a pure number"
    powers = [(name, power) for name, power in zip(("kg", "m", "s", "rad"), dimension, strict=True) if power]
    above, below = (
        [f"{name}^{abs(p)}" if abs(p) > 1 else name for name, p in powers if p * sign > 0] for sign in (1, -1)
    )
    return "/".join([" ".join(above) or "1", *below])


def to_si(value: float, unit: str, expected: str | None = None) -> float:
    """The value in SI units. `unit` such as "mm", "N/mm", "kg m^2", "rpm"; a "/" divides by the unit after it.

    expected : a unit of the same dimension, several with " or " between them, or None for any
    Raises InputError for an unknown unit, with the nearest known one, and for one of another dimension.
    """
    factor, dimension = _parsed(unit)
    if expected is not None and dimension not in [_parsed(one)[1] for one in expected.split(" or ")]:
        raise InputError(
            f"the unit {unit!r} does not fit: this is given in {expected if expected != '1' else 'numbers'}"
        )
    return value * factor


def si_number(text: str, unit: str) -> float:
    """A number as people write it, in SI units: "0.012" of this unit, or "12 mm".

    Raises ValueError for a text that is no number; InputError as `to_si`, for a unit that is unknown or does not fit.
    """
    quantity = split_quantity(text)
    return float(text) if quantity is None else to_si(*quantity, unit)


def natural(unit: str, mass: float, length: float, time: float) -> float:
    """One of an SI unit made of a mass [kg], a length [m] and a time [s]: of "N" mass length / time^2."""
    roots = unit.count("sqrt(kg)")  # of elastic coordinates
    kg, m, s, _ = _parsed(unit.replace("sqrt(kg)", "1"))[1]
    return mass ** (kg + 0.5 * roots) * length**m * time**s


def _parsed(unit: str) -> tuple[float, Dimension]:
    factor, powers, at = 1.0, [0, 0, 0, 0], 0
    while at < len(unit):
        found = _FACTOR.match(unit, at)
        if found is None or found.end() == at:
            raise InputError(f"{unit!r} is not a unit; write units such as 'mm', 'N/mm', 'kg m^2', 'deg', 'rpm'")
        power = int(found[3] or 1) * (-1 if found[1] == "/" else 1)
        size, dimension = _unit(found[2])
        factor *= size**power
        powers = [old + power * new for old, new in zip(powers, dimension, strict=True)]
        at = found.end()
    return factor, (powers[0], powers[1], powers[2], powers[3])


def _unit(name: str) -> tuple[float, Dimension]:
    if name in _UNITS:
        return _UNITS[name]
    if name[0] in _SCALES and name[1:] in _TAKES_SCALE:
        factor, dimension = _UNITS[name[1:]]
        return _SCALES[name[0]] * factor, dimension
    scaled = [scale + unit for unit in _TAKES_SCALE for scale in _SCALES]
    close = get_close_matches(name, [*_UNITS, *scaled], 1)
    hint = (
        f"did you mean {close[0]!r}?" if close else f"known are {', '.join(_UNITS)}, with n, u, m, c, d, k, M, G before"
    )
    raise InputError(f"unknown unit {name!r}; {hint}")
