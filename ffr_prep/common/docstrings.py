"""The lists "name : meaning" of a docstring, from which schemas and pages are made.

An item is `name : text` or `name, other : text` at the margin of the docstring; lines that are indented further go on with
it. Two items may share a line, with `;` and two spaces between them.
"""

from __future__ import annotations

import re
from inspect import cleandoc

_ITEM = re.compile(r"(\w+(?:, \w+)*) *: +(?=\S)")
_NEXT = re.compile(r"; {2,}(?=\w+(?:, \w+)* *: )")


def meanings(docstring: str | None) -> dict[str, str]:
    """Name -> its meaning, in one line; {} where the docstring has no list."""
    found: dict[str, str] = {}
    for block in blocks(docstring):
        if isinstance(block, dict):
            found |= {name: text for names, text in block.items() for name in names}
    return found


def prose(docstring: str | None) -> str:
    """The docstring without its lists, errors and examples: for readers who call nothing."""
    said = (block for block in blocks(docstring) if isinstance(block, str))
    return "\n\n".join(block for block in said if not block.startswith((">>> ", "Raises ")))


def blocks(docstring: str | None) -> list[str | dict[tuple[str, ...], str]]:
    """Paragraphs, and lists as names -> meaning, in the order in which they stand."""
    found: list[str | dict[tuple[str, ...], str]] = []
    for paragraph in re.split(r"\n\s*\n", cleandoc(docstring or "")):
        found += [_items(part) if _ITEM.match(part) else part for part in _runs(paragraph.rstrip()) if part]
    return found


def _runs(paragraph: str) -> list[str]:
    """A paragraph cut where its list begins: a sentence may stand right above it."""
    lines = paragraph.split("\n")
    first = next((k for k, line in enumerate(lines) if _ITEM.match(line)), len(lines))
    return ["\n".join(lines[:first]), "\n".join(lines[first:])]


def _items(text: str) -> dict[tuple[str, ...], str]:
    """The items of a list, each line at the margin the beginning of one."""
    found: dict[tuple[str, ...], str] = {}
    for item in re.split(r"\n(?=\S)", text):
        for piece in _NEXT.split(" ".join(line.strip() for line in item.split("\n"))):
            match = _ITEM.match(piece)
            if match:
                found[tuple(match[1].split(", "))] = piece[match.end() :].strip()
    return found
