"""The text of a standard input data file taken apart: nested sections, and the Taylor blocks in them.

A section opens with a word alone (`frame`) or with `new word = label`, and closes with `end word`; between are
`key = value` lines, entries `m0(i, j) = real`, `m1(i, q, j) = real`, and further sections. Indices count from 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import IDENTITY_TOLERANCE, real, whole

_ENTRY = re.compile(r"(m[01])\s*\(([0-9 ,\t]*)\)\s*=\s*(\S+)", re.IGNORECASE)
_KEYS = ("order", "nrow", "ncol", "nq", "nqn", "structure")


@dataclass(frozen=True)
class Entry:
    """A number of a Taylor block: its matrix m0 or m1, indices from 0, value, and line in the file."""

    matrix: str
    index: tuple[int, ...]
    value: float
    line: int


@dataclass
class Section:
    """A section while the file is taken apart. Words are in lower case; `values` hold text and line."""

    word: str
    label: str
    line: int
    values: dict[str, tuple[str, int]] = field(default_factory=dict)
    entries: list[Entry] = field(default_factory=list)
    parts: list[Section] = field(default_factory=list)

    def __str__(self) -> str:
        return f"block {self.word} {self.label}".rstrip() + f" (line {self.line})"


@dataclass(frozen=True)
class Taylor:
    """A block m0 + m1 q: m0 (rows, columns), m1 (rows, n, columns), zero where the order is 0."""

    m0: Array
    m1: Array


# ---- sections -----------------------------------------------------------------------------------------------------


def sections(lines: Sequence[str], first: int) -> Section:
    """The section that `lines` from index `first` consist of. Raises InputError naming the line that does not fit."""
    root = Section("file", "", first + 1)
    open_sections = [root]
    for number, text in enumerate(lines[first:], start=first + 1):
        line = text.strip(" \t\r\n\x1a\x00")  # the mark of the end of a file in old systems among them
        if line:
            _take(line, number, open_sections)
    if len(open_sections) > 1:
        raise InputError(f"the file ends at line {len(lines)} inside {open_sections[-1]}: it is truncated")
    return root


def _take(line: str, number: int, open_sections: list[Section]) -> None:
    here = open_sections[-1]
    words = line.split()
    key, equals, value = (part.strip() for part in line.partition("="))
    if words[0].lower() == "end" and not equals:
        _close(words[1:], number, open_sections)
    elif words[0].lower() == "new" and equals:
        _open(key[3:].strip(), value, number, open_sections)
    elif entry := _ENTRY.fullmatch(line):
        here.entries.append(_entry(entry, number))
    elif equals:
        name = "".join(key.split()).lower()
        if name in here.values:
            raise InputError(f"line {number}: {key!r} is given twice in {here}")
        here.values[name] = (value, number)
    elif len(words) == 1:
        _open(words[0], "", number, open_sections)
    else:
        raise InputError(f"line {number}: {line[:60]!r} in {here} is not standard input data")


def _open(word: str, name: str, number: int, open_sections: list[Section]) -> None:
    section = Section(word.lower(), name, number)
    open_sections[-1].parts.append(section)
    open_sections.append(section)


def _close(words: Sequence[str], number: int, open_sections: list[Section]) -> None:
    here = open_sections[-1]
    if [word.lower() for word in words] != [here.word]:
        raise InputError(f"line {number}: 'end {' '.join(words)}' where {here} is open; lines are missing or misplaced")
    open_sections.pop()


def _entry(match: re.Match[str], number: int) -> Entry:
    matrix, indices, value = match.groups()
    index = tuple(whole(text.strip(), f"line {number}: index") - 1 for text in indices.split(","))
    return Entry(matrix.lower(), index, real(value, f"line {number}: {matrix}"), number)


def part(section: Section, word: str) -> Section:
    """The one part of that name. Raises InputError when there is none or more than one."""
    found = [p for p in section.parts if p.word == word.lower()]
    if len(found) != 1:
        where = ", ".join(str(p.line) for p in found) or "none"
        raise InputError(f"{section} must hold one block {word!r}; lines: {where}")
    return found[0]


def only(section: Section, parts: Sequence[str]) -> None:
    """Raises InputError where the section holds a part that is not listed."""
    for other in section.parts:
        if other.word not in {p.lower() for p in parts}:
            raise InputError(f"line {other.line}: block {other.word!r} is not known in {section}")


def value(section: Section, key: str) -> str:
    """The text of a `key = value` line. Raises InputError when it is missing."""
    if key not in section.values:
        raise InputError(f"{section} has no line '{key} = ...'")
    return section.values[key][0]


def integer(section: Section, key: str) -> int:
    """The whole number of a `key = value` line. Raises InputError when it is missing or none."""
    return whole(value(section, key), f"{section}: {key}")


def in_standard_order(modal: Section, n: int) -> bool:
    """Puts the indices of all m1 into the order (row, mode, column), where a file has (row, column, mode) throughout.

    Whether it had: blocks with one column tell the two orders apart. Raises InputError as `integer`.
    """
    found = [block for block in _blocks_below(modal) if any(entry.matrix == "m1" for entry in block.entries)]
    if all(_fit(block, n, 2) for block in found) or not all(_fit(block, n, 1) for block in found):
        return True
    for block in found:
        block.entries[:] = [
            replace(e, index=(e.index[0], e.index[2], e.index[1])) if e.matrix == "m1" else e for e in block.entries
        ]
    return False


def _blocks_below(section: Section) -> Iterator[Section]:
    for inner in section.parts:
        if inner.entries:
            yield inner
        yield from _blocks_below(inner)


def _fit(block: Section, n: int, column: int) -> bool:
    """Whether all indices of m1 lie within the block, the column standing at that place."""
    columns = integer(block, "ncol")
    return all(
        len(e.index) == 3 and e.index[column] < columns and e.index[3 - column] < n
        for e in block.entries
        if e.matrix == "m1"
    )


# ---- Taylor blocks ------------------------------------------------------------------------------------------------


def taylor(section: Section, rows: int, columns: int, n: int) -> Taylor:
    """The numbers of a block that must be rows x columns, for n modes. Raises InputError naming line and block."""
    only(section, ())
    unknown = [key for key in section.values if key not in _KEYS]
    if unknown:
        text, line = section.values[unknown[0]]
        raise InputError(f"line {line}: '{unknown[0]} = {text[:40]}' is not known in {section}")
    order, structure = _head(section, rows, columns, n)
    m0, m1 = np.zeros((rows, columns)), np.zeros((rows, n, columns))
    given: set[tuple[str, tuple[int, ...]]] = set()
    for entry in section.entries:
        _check_entry(section, entry, order, structure)
        target = m0 if entry.matrix == "m0" else m1
        _check_index(section, entry, target.shape)
        if (entry.matrix, entry.index) in given:
            raise InputError(f"line {entry.line}: {_named(entry)} is given twice in {section}")
        given.add((entry.matrix, entry.index))
        target[entry.index] = entry.value
    return Taylor(_structured(section, m0, structure), m1)


def _head(section: Section, rows: int, columns: int, n: int) -> tuple[int, int]:
    order, nrow, ncol, nq, _, structure = (integer(section, key) for key in _KEYS)
    if (nrow, ncol) != (rows, columns):
        raise InputError(f"{section} is {nrow} x {ncol}; for {n} modes it must be {rows} x {columns}")
    if order > 1:
        raise InputError(f"{section} has order {order}; this program reads order 0 and 1")
    if nq != n and (order == 1 or nq != 0):
        raise InputError(f"{section} has nq = {nq}, but the file has {n} modes")
    if structure > 4:
        raise InputError(f"{section} has structure {structure}; known are 0 to 4")
    if structure in (1, 2, 4) and rows != columns:
        raise InputError(f"{section} has structure {structure}, which only a square block can have")
    return order, structure


def _check_entry(section: Section, entry: Entry, order: int, structure: int) -> None:
    if entry.matrix == "m1" and order == 0:
        raise InputError(f"line {entry.line}: {_named(entry)} in {section}, whose order is 0")
    implied = float(structure == 4 and len(set(entry.index)) == 1)
    if entry.matrix == "m0" and structure in (0, 4) and abs(entry.value - implied) > IDENTITY_TOLERANCE:
        kind = "zero" if structure == 0 else "unit"
        raise InputError(f"line {entry.line}: {_named(entry)} in {section}, whose structure {structure} says {kind}")
    if entry.matrix == "m0" and structure == 1 and len(set(entry.index)) > 1:
        raise InputError(f"line {entry.line}: {_named(entry)} in {section}, whose structure 1 says diagonal")


def _check_index(section: Section, entry: Entry, shape: tuple[int, ...]) -> None:
    if len(entry.index) != len(shape) or any(not 0 <= i < size for i, size in zip(entry.index, shape, strict=True)):
        order = " (row, mode, column)" if entry.matrix == "m1" else " (row, column)"
        raise InputError(f"line {entry.line}: {_named(entry)} is outside {section}: indices{order} go up to {shape}")


def _named(entry: Entry) -> str:
    return f"{entry.matrix}({', '.join(str(i + 1) for i in entry.index)})"


def _structured(section: Section, m0: Array, structure: int) -> Array:
    """m0 with what its structure leaves out: the unit matrix, or the second triangle of a symmetric one."""
    if structure == 4:
        return np.eye(len(m0))
    if structure != 2:
        return m0
    if not np.tril(m0, -1).any() or not np.triu(m0, 1).any():
        return m0 + m0.T - np.diag(np.diag(m0))
    off = np.abs(m0 - m0.T).max() / np.abs(m0).max()
    if off > IDENTITY_TOLERANCE:
        raise InputError(f"{section} has structure 2 (symmetric), but its triangles differ by {off:.1e} of the largest")
    return m0
