"""What writers of standard input data do to a sound file, one habit each, as changes of its text."""

from __future__ import annotations

import re
from collections.abc import Callable

Lines = list[str]


def block(lines: Lines, name: str) -> range:
    """Indices of the lines of the last block of that name."""
    start = max(k for k, text in enumerate(lines) if text.split() == [name])
    return range(start, next(k for k in range(start, len(lines)) if lines[k].split() == ["end", name]) + 1)


def values(lines: Lines, name: str, matrix: str) -> dict[tuple[int, ...], float]:
    """The numbers of m0 or m1 of a block by their indices, from 1."""
    found = {}
    for k in block(lines, name):
        if match := re.match(rf"\s*{matrix}\(([\d ,]+)\)\s*= +(\S+)", lines[k]):
            found[tuple(int(i) for i in match[1].split(","))] = float(match[2].replace("D", "E"))
    return found


def rewritten(lines: Lines, name: str, matrix: str, entries: dict[tuple[int, ...], float]) -> Lines:
    """The lines with other numbers in m0 or m1 of a block."""
    span = block(lines, name)
    kept = [text for k in span if not (text := lines[k]).lstrip().startswith(f"{matrix}(")]
    new = [f"   {matrix}({', '.join(map(str, at))}) = {value:.16E}".replace("E", "D") for at, value in entries.items()]
    order = 1 if matrix == "m1" and entries else None
    kept = [re.sub(r"(order\s*=).*", rf"\1 {order}", text) if order else text for text in kept]
    kept = [re.sub(r"(structure\s*=).*", r"\1 3", text) if entries else text for text in kept]
    return [*lines[: span[0]], *kept[:-1], *new, kept[-1], *lines[span[-1] + 1 :]]


def ones_of_unit_blocks(lines: Lines) -> Lines:
    """Structure 4 with its ones listed all the same."""
    span = block(lines, "Me")
    return [re.sub(r"(structure\s*=) 3", r"\1 4", text) if k in span else text for k, text in enumerate(lines)]


def raw_Ge(lines: Lines) -> Lines:
    """Cr.m1 with a symmetric part that Ge, axis-major, repeats: FEMBS."""
    Cr1 = values(lines, "Cr", "m1")
    n = max(j for _, j, _ in Cr1)
    Cr1 = {**Cr1, (1, 1, 3): 0.02, (1, 2, 3): Cr1[1, 2, 3] + 0.03, (2, 1, 3): Cr1[2, 1, 3] + 0.03}
    Ge = {(k, (a - 1) * n + j): 2 * value for (k, j, a), value in Cr1.items()}
    return rewritten(rewritten(lines, "Cr", "m1", Cr1), "Ge", "m0", Ge)


def one_sided_products(lines: Lines) -> Lines:
    """Columns 4 to 6 of Oe.m1 that hold twice the moment of one order: PY_SID."""
    Oe1, Cr1 = values(lines, "Oe", "m1"), values(lines, "Cr", "m1")
    for column, axis, sign in ((4, 3, 1.0), (5, 1, 1.0), (6, 2, -1.0)):
        for (k, j, a), value in Cr1.items():
            if a == axis:
                Oe1[k, j, column] = Oe1.get((k, j, column), 0.0) + sign * value
    return rewritten(lines, "Oe", "m1", Oe1)


def rotary_inertia(lines: Lines) -> Lines:
    """A mode of which nearly all mass is rotary: its second moments are a hundredth of Me."""
    Oe1 = {at: 0.01 * value if 2 in at[:2] else value for at, value in values(lines, "Oe", "m1").items()}
    return rewritten(lines, "Oe", "m1", Oe1)


def other_order_of_indices(lines: Lines) -> Lines:
    """m1(row, column, mode)."""
    return [re.sub(r"m1\(([ \d]+),([ \d]+),([ \d]+)\)", r"m1(\1,\3,\2)", text) for text in lines]


def exponents_without_a_letter(lines: Lines) -> Lines:
    """0.5+000 for 0.5D+000, as Fortran writes exponents of three digits."""
    return [re.sub(r"D([+-])(\d\d)$", r"\g<1>0\2", text) for text in lines]


def end_of_file_mark(lines: Lines) -> Lines:
    return [*lines, "\x1a"]


def capitals(lines: Lines) -> Lines:
    """Words in capitals, tabs, blanks at the end of lines."""
    return [lines[0], *(re.sub(r"^ +", "\t", text).upper() + "   " for text in lines[1:])]


HARMLESS: tuple[Callable[[Lines], Lines], ...] = (
    ones_of_unit_blocks,
    raw_Ge,
    one_sided_products,
    other_order_of_indices,
    exponents_without_a_letter,
    end_of_file_mark,
    capitals,
)
