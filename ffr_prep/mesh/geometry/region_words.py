"""The language of regions: names, ranges, patterns, and queries for faces by kind and place.

    region    = term {"+" term}
    term      = name | range | pattern | query
    range     = surface_1..4                    the names surface_1 to surface_4
    pattern   = bore*, pin_?                    every name that fits; at least one must
    query     = ["all"] kind {condition}        the faces of one surface; with "all" those of every surface that fits
              | "nearest" point                 the feature nearest to a point
    kind      = plane | bore | cylinder | cone | sphere | torus | face        (a bore is a hollow cylinder; face is any)
    condition = r=LENGTH | d=LENGTH             radius, diameter
              | x=LENGTH | y=LENGTH | z=LENGTH  plane across an axis, at this place
              | normal=DIRECTION | axis=DIRECTION          x, -z, or three numbers
              | colour=#rrggbb                  as the file has it
              | solid=NAME                      of this solid; 'NAME' where it has blanks; may be a pattern
              | at point                        the surface, or its axis, passes there
              | near point                      of those that fit the feature nearest to it
    point     = LENGTH,LENGTH,LENGTH
    LENGTH    = 6, 6mm, 0.25in                  without a unit in that of the file

A name of the mesh is always that, whatever it looks like.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ffr_prep.common.errors import InputError
from ffr_prep.mesh.geometry.face import METRES

WORDS = ("plane", "bore", "cylinder", "cone", "sphere", "torus", "face")
EXAMPLES = "cylinder r=6mm at 0,0,0 | plane z=0 | nearest 10,0,5 | surface_1+surface_2 | surface_1..4 | bore*"

Point = tuple[float, float, float]

_FAR = 1e9  # [m]
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = rf"{_NUMBER}\s*(?:mm|cm|m|in)?(?![\w.])"
_POINT = rf"\(?\s*({_LENGTH})\s*,\s*({_LENGTH})\s*,\s*({_LENGTH})\s*\)?"
_TERMS = re.compile(r"\s*(?<![\d.][eE])\+\s*")  # not the sign of an exponent
_CONDITION = re.compile(
    rf"\s*(?:(?P<key>[rdxyz])\s*=\s*(?P<length>{_LENGTH})"
    rf"|(?P<turned>normal|axis)\s*=\s*(?P<direction>[-+]?[xyz](?!\w)|\(?\s*{_NUMBER}\s*,\s*{_NUMBER}\s*,\s*{_NUMBER}\s*\)?)"
    rf"|colou?r\s*=\s*(?P<colour>#[0-9a-fA-F]{{6}})"
    rf"|solid\s*=\s*(?P<solid>'[^']+'|[^\s,']+)"
    rf"|(?P<place>at|near)\s+(?P<point>{_POINT}))\s*,?"
)


@dataclass(frozen=True)
class Query:
    """A query in metres: kind, and what is asked of it.

    every : all surfaces that fit are meant; through : (axis 0 to 2, place) of planes across an axis
    """

    text: str
    kind: str
    every: bool = False
    radius: float | None = None
    through: tuple[int, float] | None = None
    normal: Point | None = None
    axis: Point | None = None
    colour: str = ""
    solid: str = ""
    at: Point | None = None
    near: Point | None = None


@dataclass(frozen=True)
class Names:
    """Names that are all meant, or a pattern for some."""

    text: str
    names: tuple[str, ...]
    pattern: bool = False


def parsed(text: str, unit: str = "m") -> tuple[Query | Names, ...]:
    """The terms of a region. Raises InputError for a text that is none, with what may be written."""
    terms = _TERMS.split(text.strip())
    if not all(terms):
        raise InputError(f"region {text!r}: a name or a query is missing beside the +; {_such()}")
    return tuple(_term(term, unit) for term in terms)


def is_query(text: str) -> bool:
    """Whether a text begins like a query."""
    words = text.split()
    first = words[1] if words[:1] == ["all"] and len(words) > 1 else (words or [""])[0]
    return first in (*WORDS, "nearest") and (len(words) > 1)


def _term(text: str, unit: str) -> Query | Names:
    if is_query(text):
        return _query(text, unit)
    found = re.fullmatch(r"(.*?)(\d{1,9})\.\.(\d{1,9})", text)
    if found:
        first, last = int(found[2]), int(found[3])
        if not first <= last < first + 10_000:
            raise InputError(f"region {text!r}: a range goes from the lower number to the higher, such as surface_1..4")
        return Names(text, tuple(f"{found[1]}{k}" for k in range(first, last + 1)))
    return Names(text, (text,), pattern=bool(re.search(r"[*?\[]", text)))


def _query(text: str, unit: str) -> Query:
    every = text.startswith("all ")
    kind, _, rest = text.removeprefix("all ").strip().partition(" ")
    if kind == "nearest":
        point = re.fullmatch(rf"\s*{_POINT}\s*", rest)
        if point is None or every:
            raise InputError(f"region {text!r}: write nearest x,y,z; {_such()}")
        return Query(text, "face", near=_point(point.groups(), unit))
    made: dict[str, object] = {}
    at = 0
    while rest[at:].strip():
        found = _CONDITION.match(rest, at)
        if found is None:
            raise InputError(f"region {text!r}: {rest[at:].strip()!r} is not understood; {_such()}")
        key, value = _condition(found, unit)
        if key in made:
            raise InputError(f"region {text!r}: {found[0].strip(' ,')!r} says a second time what was said before")
        made[key] = value
        at = found.end()
    return Query(text, kind, every, **made)  # type: ignore[arg-type]


def _condition(found: re.Match[str], unit: str) -> tuple[str, object]:
    if found["key"] in ("r", "d"):
        return "radius", _length(found["length"], unit) / (2 if found["key"] == "d" else 1)
    if found["key"]:
        return "through", ("xyz".index(found["key"]), _length(found["length"], unit))
    if found["turned"]:
        return found["turned"], _direction(found["direction"])
    if found["colour"]:
        return "colour", found["colour"].lower()
    if found["solid"]:
        return "solid", found["solid"].strip("'")
    inner = re.fullmatch(_POINT, found["point"])
    assert inner is not None  # it was matched as a part
    return found["place"], _point(inner.groups(), unit)


def _direction(text: str) -> Point:
    if text[-1] in "xyz":
        sign = -1.0 if text[0] == "-" else 1.0
        x, y, z = (sign * (text[-1] == one) for one in "xyz")
        return x, y, z
    x, y, z = (float(word) for word in text.strip(" ()").split(","))
    if not (x or y or z):
        raise InputError(f"the direction {text!r} has no length; write x, -z, or three numbers such as 1,0,1")
    return x, y, z


def point_of(text: str, unit: str) -> Point | None:
    """A point [m] of a text such as "10,0,5 mm"; None for another text."""
    found = re.fullmatch(_POINT, text.strip())
    return None if found is None else _point(found.groups(), unit)


def _point(words: tuple[str, ...], unit: str) -> Point:
    """A unit behind the last of three bare numbers is that of all."""
    last = re.search(r"[a-z]+$", words[2])
    if last and last[0] in METRES and not any(re.search(r"[a-z]+$", word.strip()) for word in words[:2]):
        unit = last[0]
    x, y, z = (_length(word, unit) for word in words)
    return x, y, z


def _length(text: str, unit: str) -> float:
    found = re.fullmatch(rf"({_NUMBER})\s*([a-z]*)", text.strip())
    assert found is not None  # it was matched as a length
    length = float(found[1]) * METRES[found[2] or unit]
    if not abs(length) < _FAR:
        raise InputError(f"{text.strip()[:40]!r} is no length in a part; {_such()}")
    return length


def _such() -> str:
    return f"regions are such as  {EXAMPLES}"
