"""Meshes in archives of Ansys Mechanical APDL (.cdb, written by CDWRITE or by Workbench).

Nodes stand in blocks NBLOCK, elements in EBLOCK, both in columns whose width the line below tells; element types in ET and
ETBLOCK; components of nodes and of elements in CMBLOCK, where a negative number closes a range. Bricks whose corners
coincide are the tetrahedra, wedges and pyramids that they mean.

Source: Ansys Mechanical APDL Programmer's Reference, section 3 (archive files); Element Reference, SOLID185 to SOLID187.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_count, read_text
from ffr_prep.mesh.file_mesh import FileMesh, supported_kind
from ffr_prep.mesh.left_out import left_out_of_ansys

_SOLIDS = frozenset((5, 45, 62, 64, 65, 69, 70, 87, 90, 92, 95, 96, 97, 98, 122, 123, 147, 148, 185, 186, 187, 190))
_SOLIDS |= {226, 227, 231, 232, 236, 237, 238, 239, 240, 278, 279, 285}
_SKETCHES = (200,)  # MESH200 is what solids were made of
_UNITS = {"SI": "m", "MKS": "m", "CGS": "cm", "MPA": "mm", "BIN": "in"}
_FORMAT = re.compile(r"\(\s*(\d+)i(\d+)(?:,\s*\d+(?:a\d+|e(\d+)\.\d+(?:e\d+)?))?\s*\)", re.IGNORECASE)
_PLAIN = {4: "tet4", 8: "hex8", 10: "tet10", 20: "hex20"}
# Of bricks by which of their eight corners are one: kind, and the nodes that it has of the brick's twenty.
_COLLAPSED = {
    (0, 1, 2, 2, 4, 5, 6, 6): ("wedge6", "wedge15", (0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18)),
    (0, 1, 2, 3, 4, 4, 4, 4): ("pyramid5", "pyramid13", (0, 1, 2, 3, 4, 8, 9, 10, 11, 16, 17, 18, 19)),
    (0, 1, 2, 2, 4, 4, 4, 4): ("tet4", "tet10", (0, 1, 2, 4, 8, 9, 11, 16, 17, 18)),
}


@dataclass
class _Archive:
    """The definitions of a file, by number and by name."""

    nodes: dict[int, list[float]] = field(default_factory=dict)
    types: dict[int, int] = field(default_factory=dict)
    solids: dict[str, list[tuple[int, int, list[int]]]] = field(default_factory=lambda: defaultdict(list))
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    unit: str | None = None
    current: int = 1
    found: Counter[str] = field(default_factory=Counter)


def from_ansys(path: Path) -> FileMesh:
    """The mesh of an archive. Materials are groups material_N of elements; components keep their names.

    Raises InputError for a file that is none or is damaged, and for elements without some of their nodes.
    """
    lines = iter(enumerate(read_text(path, "an archive of Ansys").splitlines(), start=1))
    archive, begun = _Archive(), 0
    try:
        while command := next(lines, None):
            begun = command[0]
            _take(archive, command[1], lines)
        if not archive.nodes:
            raise InputError("it has no NBLOCK: is it an archive of Ansys? Write it in blocks (CDWRITE,DB,name,cdb)")
        return _file_mesh(archive)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (ValueError, IndexError, StopIteration):
        raise InputError(f"{path} is damaged: what begins on line {begun} does not end, or lacks numbers") from None


Lines = Iterator[tuple[int, str]]


def _take(archive: _Archive, line: str, lines: Lines) -> None:
    words = [word.strip() for word in line.split("!")[0].split(",")]
    command = words[0].upper()
    if command in _BLOCKS:
        _BLOCKS[command](archive, words, lines)
    elif command == "ET" and len(words) > 2:
        archive.types[int(words[1])] = int(re.sub(r"\D", "", words[2]))
    elif command == "TYPE" and len(words) > 1:
        archive.current = int(words[1])
    elif command == "/UNITS" and len(words) > 1:
        archive.unit = _UNITS.get(words[1].upper())
    elif re.fullmatch(r"[A-Z]{1,6}", command):
        archive.found[command] += 1


def _columns(lines: Lines) -> tuple[int, int, int]:
    """How many whole numbers stand on a line, their width, and that of the others (0 without)."""
    found = _FORMAT.search(next(lines)[1])
    if not found:
        raise ValueError("no format")
    return int(found[1]), int(found[2]), int(found[3] or 0)


def _whole(line: str, width: int) -> list[int]:
    return [int(line[k : k + width]) for k in range(0, len(line.rstrip()), width)]


def _rows(lines: Lines) -> Iterator[str]:
    """The lines of a block, which -1 ends. Raises ValueError where nothing ends it."""
    for _, line in lines:
        if line.lstrip()[:2] in ("-1", "N,"):
            return
        yield line
    raise ValueError("no end")


def _read_nodes(archive: _Archive, words: list[str], lines: Lines) -> None:
    count, width, wide = _columns(lines)
    for line in _rows(lines):
        rest = line[count * width :].rstrip()
        xyz = [float(rest[k : k + wide]) for k in range(0, min(len(rest), 3 * wide), wide)]
        archive.nodes[int(line[:width])] = xyz + [0.0] * (3 - len(xyz))


def _read_types(archive: _Archive, words: list[str], lines: Lines) -> None:
    _, width, _ = _columns(lines)
    for line in _rows(lines):
        number, kind = int(line[:width]), line[width : 2 * width]
        archive.types[number] = int(re.sub(r"\D", "", kind))


def _read_elements(archive: _Archive, words: list[str], lines: Lines) -> None:
    """Of solids material, type, ..., number of nodes (9th), number (11th) and nodes; of others, whose type TYPE has set, how
    many they are."""
    _, width, _ = _columns(lines)
    solid = len(words) > 2 and words[2].upper() == "SOLID"
    for line in _rows(lines):
        if not solid:
            archive.found[str(archive.types.get(archive.current))] += 1
            continue
        numbers = _whole(line, width)
        nodes = numbers[11:]
        check_count(numbers[8], "nodes of an element")
        while len(nodes) < numbers[8]:
            nodes += _whole(next(lines)[1], width)
        _take_element(archive, numbers, nodes)


def _take_element(archive: _Archive, numbers: list[int], nodes: list[int]) -> None:
    material, kind, number = numbers[0], numbers[1], numbers[10]
    if kind not in archive.types:
        raise InputError(f"element {number} is of type {kind}, which no ET or ETBLOCK defines")
    if archive.types[kind] not in _SOLIDS:
        if archive.types[kind] not in _SKETCHES:
            archive.found[str(archive.types[kind])] += 1
        return
    ours, own = _solid(number, nodes)
    archive.solids[ours].append((number, material, own))


def _solid(number: int, nodes: list[int]) -> tuple[str, list[int]]:
    """The kind that an element means, and its nodes."""
    if len(nodes) in (10, 20) and not any(nodes[4 if len(nodes) == 10 else 8 :]):
        nodes = nodes[: 4 if len(nodes) == 10 else 8]
    if not all(nodes):
        raise InputError(
            f"element {number} lacks some of the nodes in the middle of its edges; give it all or none (EMID)"
        )
    if len(nodes) not in (8, 20) or len(set(nodes[:8])) == 8:
        return supported_kind(_PLAIN.get(len(nodes), ""), f"of {len(nodes)} nodes"), nodes
    pattern = tuple(nodes[:8].index(node) for node in nodes[:8])
    if pattern not in _COLLAPSED:
        raise InputError(
            f"element {number} is a brick whose corners {nodes[:8]} make no wedge, pyramid or tetrahedron: write each apart"
        )
    first, second, of = _COLLAPSED[pattern]
    return (first, [nodes[k] for k in of if k < 8]) if len(nodes) == 8 else (second, [nodes[k] for k in of])


def _read_component(archive: _Archive, words: list[str], lines: Lines) -> None:
    name, kind, count = words[1], words[2].upper(), int(words[3])
    _, width, _ = _columns(lines)
    numbers: list[int] = []
    while len(numbers) < count:
        numbers += _whole(next(lines)[1], width)
    members: list[int] = []
    for number in numbers:
        check_count(-number - members[-1] if number < 0 and members else 0, "members of a component")
        members += range(members[-1] + 1, 1 - number) if number < 0 else [number]
    (archive.node_sets if kind == "NODE" else archive.element_sets)[name] = members


_BLOCKS: Mapping[str, Callable[[_Archive, list[str], Lines], None]] = {
    "NBLOCK": _read_nodes,
    "ETBLOCK": _read_types,
    "EBLOCK": _read_elements,
    "CMBLOCK": _read_component,
}


# ---- to arrays ----------------------------------------------------------------------------------------------------


def _file_mesh(archive: _Archive) -> FileMesh:
    index = {number: k for k, number in enumerate(archive.nodes)}
    elements = [element for of in archive.solids.values() for element in of]
    place = {number: k for k, (number, _, _) in enumerate(elements)}
    materials = np.array([material for _, material, _ in elements], np.int64)
    sets = {name: [place[n] for n in of if n in place] for name, of in archive.element_sets.items()}
    volumes = {f"material_{n}": np.flatnonzero(materials == n) for n in np.unique(materials).tolist()}
    return FileMesh(
        points=np.array(list(archive.nodes.values()), float).reshape(-1, 3),
        blocks=tuple((kind, _indices(index, of)) for kind, of in archive.solids.items()),
        volumes=volumes | {name: np.array(of, np.int64) for name, of in sets.items() if of},
        faces={},
        nodes={
            name: np.array([index[n] for n in of if n in index], np.int64) for name, of in archive.node_sets.items()
        },
        notes=left_out_of_ansys(archive.found),
        unit=archive.unit,
    )


def _indices(index: Mapping[int, int], elements: list[tuple[int, int, list[int]]]) -> Array:
    try:
        return np.array([[index[n] for n in nodes] for _, _, nodes in elements], np.int64)
    except KeyError as error:
        raise InputError(f"an element refers to node {error.args[0]}, which no NBLOCK defines") from None
