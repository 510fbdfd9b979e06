"""The text of MBDyn's FEM data taken apart: record groups and the numbers in them.

A record begins with a line `** RECORD GROUP <id>, <text>`; other lines that begin with ** are comments. In record 8
every mode has one line of comment before its numbers, whatever that line says.

Source: MBDyn Input File Format (P. Masarati, Politecnico di Milano), section "modal" joint.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import real, whole

_TITLE = re.compile(r"\*\*\s*RECORD GROUP\s+([0-9]{1,4})\b", re.IGNORECASE)
_NAME = re.compile(r"\*\* (body|node ([0-9]{1,9})) = (\S+)\s*")
_MANDATORY = (2, 5, 6, 7, 8, 9, 10)
_KNOWN = range(1, 20)

# Shapes of the numeric records: N nodes, n modes.
COUNTS = {
    3: ("n",),
    4: ("n",),
    5: ("N",),
    6: ("N",),
    7: ("N",),
    9: ("n", "n"),
    10: ("n", "n"),
    11: ("N", 6),
    12: (13,),
    13: ("n", "n"),
    14: (3, "n"),
    15: (3, "n"),
    16: (3, "n", 3),
    17: (3, "n", "n"),
    18: (3, "n", "n", 3),
}


@dataclass(frozen=True)
class Record:
    """A record group: its number, its lines with their numbers in the file, and the line after it."""

    group: int
    lines: tuple[tuple[int, str], ...]
    end: int


@dataclass(frozen=True)
class Header:
    """Labels of the nodes and number of modes."""

    labels: tuple[str, ...]
    n: int


def records(lines: Sequence[str]) -> tuple[Header, dict[int, Record]]:
    """The records of a file. Raises InputError for missing, repeated, misplaced and unknown ones."""
    starts = [(k, int(match[1])) for k, text in enumerate(lines) if (match := _TITLE.match(text.strip()))]
    if not starts or starts[0][1] != 1:
        raise InputError("the first record group is not 1, the header: this is not a FEM file of MBDyn, or damaged")
    ends = [k for k, _ in starts[1:]] + [len(lines)]
    found: dict[int, Record] = {}
    for (start, group), end in zip(starts, ends, strict=True):
        if group not in _KNOWN:
            raise InputError(f"line {start + 1}: record group {group} is not known; there are 1 to 19")
        if group in found:
            raise InputError(f"line {start + 1}: record group {group} is there twice")
        inside = tuple((k + 1, lines[k]) for k in range(start + 1, end) if lines[k].strip())
        found[group] = Record(group, inside, end)
    missing = [group for group in _MANDATORY if group not in found]
    if missing:
        raise InputError(f"the file ends at line {len(lines)} without record group {missing[0]}: it is truncated")
    return _header(found), found


def _header(found: Mapping[int, Record]) -> Header:
    lines = [(k, text.split()) for k, text in found[1].lines if text.split()[0].upper().startswith("REV")]
    if len(lines) != 1 or len(lines[0][1]) != 6:
        raise InputError("record 1 must hold one line 'REV0 nodes normal attachment constraint rejected'")
    line, words = lines[0]
    count, *modes, rejected = (whole(word, f"line {line}: record 1") for word in words[1:])
    n = sum(modes) - rejected
    if n < 0 or count < 1:
        raise InputError(
            f"line {line}: record 1 announces {count} nodes and {n} modes; there is at least "
            "one node, and no mode is rejected that is not there"
        )
    labels = tuple(word for _, word in _words(_without_comments(found[2])))
    if len(labels) != count:
        raise InputError(f"record 2 ends at line {found[2].end} with {len(labels)} labels; record 1 announces {count}")
    return Header(labels, n)


def numbers(record: Record, header: Header) -> Array:
    """The numbers of a record of COUNTS in its shape. Raises InputError naming record and line."""
    sizes = {"N": len(header.labels), "n": header.n}
    shape = tuple(sizes[size] if isinstance(size, str) else size for size in COUNTS[record.group])
    return _exactly(record, _words(_without_comments(record)), shape)


def shapes(record: Record, header: Header) -> Array:
    """(N, 6, n) motions of the nodes from record 8. Raises InputError naming record and line."""
    return _exactly(record, _words(_of_modes(record, header)), (header.n, len(header.labels), 6)).transpose(1, 2, 0)


def _of_modes(record: Record, header: Header) -> Iterable[tuple[int, str]]:
    """The lines of record 8 that hold numbers. A comment inside a mode tells that its numbers are too many or too few."""
    per_mode = 6 * len(header.labels)
    left, modes, opened_by = 0, 0, ""
    for line, text in record.lines:
        comment = text.lstrip().startswith("**")
        if left <= 0 and modes < header.n:
            left, modes, opened_by = per_mode, modes + 1, text.lstrip()
        elif comment and left > 0 and (left < per_mode or not opened_by.startswith("**")):
            raise InputError(f"line {line}: record 8: a comment inside mode {modes}, which lacks {left} numbers")
        elif not comment:
            left -= len(text.split())
            yield line, text


def _without_comments(record: Record) -> Iterable[tuple[int, str]]:
    return ((line, text) for line, text in record.lines if not text.lstrip().startswith("**"))


def _words(lines: Iterable[tuple[int, str]]) -> list[tuple[int, str]]:
    return [(line, word) for line, text in lines for word in text.split()]


def stiffening_matrices(record: Record, header: Header) -> dict[int, Array]:
    """The matrices (n, n) of record 19 by their index: their number, then for each its index and its numbers.

    Raises InputError naming record and line, for an index that no load has or that is there twice.
    """
    words = _words(_without_comments(record))
    if not words:
        raise InputError(f"record 19 (line {record.end}) is empty; it begins with the number of its matrices")
    count, size, most = whole(words[0][1], f"line {words[0][0]}: record 19"), header.n**2, 12 + 6 * len(header.labels)
    if len(words) != 1 + count * (1 + size):
        raise InputError(
            f"record 19 ends at line {record.end} with {len(words)} numbers; {count} matrices need {1 + count * (1 + size)}"
        )
    found: dict[int, Array] = {}
    for start in range(1, len(words), 1 + size):
        line, word = words[start]
        index = whole(word, f"line {line}: record 19")
        if not 1 <= index <= most or index in found:
            raise InputError(f"line {line}: record 19: index {index} is there twice or not among 1 to {most}")
        values = [real(text, f"line {at}: record 19") for at, text in words[start + 1 : start + 1 + size]]
        found[index] = np.array(values).reshape(header.n, header.n)
    return found


def _exactly(record: Record, words: Sequence[tuple[int, str]], shape: tuple[int, ...]) -> Array:
    count = prod(shape)
    if len(words) != count:
        raise InputError(
            f"record {record.group} ends at line {record.end} with {len(words)} numbers instead of {count}"
        )
    values = [real(word, f"line {line}: record {record.group}") for line, word in words]
    return np.array(values, dtype=float).reshape(shape)


def names(lines: Sequence[str]) -> tuple[str, dict[int, str]]:
    """The names of the body and of nodes, from 1, in the comments that ffr-prep writes; empty in other files."""
    found = [match for text in lines if (match := _NAME.fullmatch(text))]
    title = next((match[3] for match in found if match[1] == "body"), "")
    return title, {int(match[2]): match[3] for match in found if match[2]}
