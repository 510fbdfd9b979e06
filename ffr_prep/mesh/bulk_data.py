"""Nastran bulk data taken apart into cards: small, large and free fields, mixed as they come, with any continuation.

A card is a name and its fields; a field is a text, "" where it is blank. Small fields are ten of eight columns, large ones (a
name with *) six of which four have sixteen, free ones stand between commas. A line whose first field is blank, or begins with
+ or *, goes on with a card: with that one whose last line ends with the same mark, wherever it stands, else with the last.

Source: MSC Nastran Quick Reference Guide, section 5 (format of bulk data entries).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_ordinary, read_text

# 1.5, 1.5E3, 1.5D3, 1.5+3; and 15, which a real field may hold as well
_REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]?([+-]\d+)|[EeDd](\d+))?")
_BEGIN = re.compile(r"^\s*BEGIN\s*(?:BULK)?\b.*$", re.MULTILINE | re.IGNORECASE)
_PARAMETER = re.compile(r"\s*PARAM\s*,", re.IGNORECASE)
_INCLUDE = re.compile(r"\s*INCLUDE\s+'?\"?([^'\"]+)", re.IGNORECASE)


@dataclass
class Card:
    """A name in capitals, its data fields in turn, the line on which it begins, and the mark of what goes on with it."""

    name: str
    fields: list[str]
    line: int
    mark: str = field(default="", compare=False)

    def __str__(self) -> str:
        return f"line {self.line}: {self.name} {self.fields[0] if self.fields else ''}".rstrip()

    def text(self, k: int) -> str:
        """Field k, counted from 1 behind the name; "" where it is blank or beyond the end."""
        return self.fields[k - 1] if 0 < k <= len(self.fields) else ""

    def integer(self, k: int, default: int | None = None) -> int:
        """Field k as a whole number. Raises InputError for anything else."""
        text = self.text(k)
        if not text and default is not None:
            return default
        if not re.fullmatch(r"[+-]?\d{1,18}", text):
            raise InputError(f"{self}: field {k + 1} is {text[:40]!r}, where a whole number belongs")
        return int(text)

    def real(self, k: int, default: float | None = None) -> float:
        """Field k as a real number, whose exponent may go without its letter. Raises InputError for anything else."""
        text = self.text(k)
        if not text and default is not None:
            return default
        match = _REAL.fullmatch(text)
        if match is None:
            raise InputError(f"{self}: field {k + 1} is {text[:40]!r}, where a number belongs")
        return float(f"{match[1]}E{match[2] or match[3] or 0}")


def cards(path: Path, above: tuple[Path, ...] = ()) -> Iterator[Card]:
    """The cards of a file, through the files that it includes; of the control before the bulk data the parameters alone.

    Raises InputError for a file that cannot be read, includes itself, or begins with a continuation.
    """
    text = read_text(path, "Nastran bulk data")
    bulk = list(_BEGIN.finditer(text))
    first = text.count("\n", 0, bulk[0].end()) + 1 if bulk else 0
    card: Card | None = None
    waiting: dict[str, Card] = {}  # by the marks with which they end
    early: dict[str, Card] = {}  # what goes on with a card that is not there yet, by the marks with which it begins
    lines = text.splitlines()
    for number, line in enumerate(lines[:first], start=1):
        if _PARAMETER.match(line):
            name, fields, _ = _fields(line.partition("$")[0].strip(), f"{path}: line {number}")
            yield Card(name.upper(), fields, number)
    for number, line in enumerate(lines[first:], start=first + 1):
        plain = line.partition("$")[0].rstrip().expandtabs(8)
        if not plain:
            continue
        if found := _INCLUDE.match(plain):
            yield from _put_away(card, waiting)
            card = None
            yield from _included(path, found[1].strip(), above)
            continue
        if plain.split()[0].upper() == "ENDDATA":
            break
        name, fields, mark = _fields(plain, f"{path}: line {number}")
        if name[:1] not in ("", "+", "*"):
            yield from _put_away(card, waiting)
            card = _with_early(Card(name.rstrip("*_").upper(), fields, number, mark), early)
            continue
        own = _mark(name)
        if own and own not in waiting and (card is None or card.mark not in ("", own)):
            early[own] = Card(name, fields, number, mark)
            continue
        if own in waiting and not (card and card.mark == own):
            yield from _put_away(card, waiting)
            card = waiting.pop(own)
        if card is None:
            raise InputError(f"{path}: line {number} goes on with a card, but there is none above it")
        card.fields += fields
        card.mark = mark
        card = _with_early(card, early)
    yield from _put_away(card, waiting)
    yield from waiting.values()
    for left in early.values():
        raise InputError(
            f"{path}: line {left.line} goes on with a card that ends with the mark {left.name}, but none does"
        )


def _with_early(card: Card, early: dict[str, Card]) -> Card:
    """The card with all that goes on with it and was read before it."""
    while card.mark in early:
        more = early.pop(card.mark)
        card.fields += more.fields
        card.mark = more.mark
    return card


def _put_away(card: Card | None, waiting: dict[str, Card]) -> Iterator[Card]:
    """A card that is complete; one that ends with a mark waits for what goes on with it."""
    if card and card.mark:
        earlier = waiting.pop(card.mark, None)
        if earlier:
            yield earlier
        waiting[card.mark] = card
    elif card:
        yield card


def _mark(text: str) -> str:
    """What the mark of a continuation says."""
    return text.strip("+* ").upper()


def _included(path: Path, name: str, above: tuple[Path, ...]) -> Iterator[Card]:
    inner = path.parent / name
    if inner.resolve() in (*above, path.resolve()):
        raise InputError(f"{path} includes itself: {' -> '.join(one.name for one in (*above, path, inner))}")
    check_ordinary(inner, f"bulk data, which {path} includes")
    yield from cards(inner, (*above, path.resolve()))


def _fields(line: str, where: str) -> tuple[str, list[str], str]:
    """The first field of a line; its data fields, four or eight of them however it is written; and its mark at the end.

    Raises InputError for more fields than a line has, and for a card that repeats the one above.
    """
    if line.lstrip().startswith("="):
        raise InputError(f"{where} repeats the card above it (=), which is not read; write the cards out")
    if "," in line:
        name, *fields = (text.strip() for text in line.split(","))
        count = 4 if name.endswith("*") or name.startswith("*") else 8
        if any(fields[count + 1 :]) or (len(fields) > count and fields[count][:1] not in ("", "+", "*")):
            raise InputError(
                f"{where} has {len(fields)} fields behind the name; {count} is the most, then go on in the next line"
            )
        return name, _padded(fields[:count], count), _mark("".join(fields[count:]))
    name = line[:8].strip()
    width, count = (16, 4) if name.endswith("*") or name.startswith("*") else (8, 8)
    fields = [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]
    return name, fields, _mark(line[72:80])


def _padded(fields: list[str], count: int) -> list[str]:
    return [*fields, *[""] * (count - len(fields))]
