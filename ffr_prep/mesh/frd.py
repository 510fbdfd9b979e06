"""Meshes in result files of CalculiX (.frd), written as text.

Nodes stand in the block 2C, elements in 3C; of the results behind them nothing is read. Elements are grouped by their
material number, material_N.

Source: K. Wittig, CalculiX GraphiX user's manual, section "Result Format" (element types, order of the nodes).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_text
from ffr_prep.mesh.file_mesh import FileMesh

_KINDS = {1: "hex8", 2: "wedge6", 3: "tet4", 4: "hex20", 5: "wedge15", 6: "tet10"}
_SIZES = {1: 8, 2: 6, 3: 4, 4: 20, 5: 15, 6: 10, 7: 3, 8: 6, 9: 4, 10: 8, 11: 2, 12: 3}
# The edges between both ends stand before those of the second one.
_ORDER = {"hex20": [*range(12), *range(16, 20), *range(12, 16)], "wedge15": [*range(9), *range(12, 15), *range(9, 12)]}


def from_frd(path: Path) -> FileMesh:
    """The mesh of a .frd file. Raises InputError for a binary or damaged one."""
    lines = read_text(path, "a result file of CalculiX").splitlines()
    nodes: dict[int, list[float]] = {}
    elements: dict[int, list[tuple[int, list[int]]]] = defaultdict(list)
    try:
        for start, line in enumerate(lines):
            if line[:6].strip() == "2C":
                nodes |= _nodes(lines[start + 1 :], _width(line))
            elif line[:6].strip() == "3C":
                for kind, material, of in _elements(lines[start + 1 :], _width(line)):
                    elements[kind].append((material, of))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (ValueError, IndexError):
        raise InputError(
            f"{path} is no result file of CalculiX, or damaged: a line of nodes or elements has no numbers"
        ) from None
    ignored = {kind: len(of) for kind, of in elements.items() if kind not in _KINDS}
    solids = {kind: of for kind, of in elements.items() if kind in _KINDS}
    index = {number: k for k, number in enumerate(nodes)}
    try:
        blocks = {kind: np.array([[index[n] for n in row] for _, row in of], np.int64) for kind, of in solids.items()}
    except KeyError as error:
        raise InputError(f"{path}: an element refers to node {error.args[0]}, which the file does not define") from None
    materials = np.array([material for of in solids.values() for material, _ in of], np.int64)
    return FileMesh(
        points=np.array(list(nodes.values()), float).reshape(-1, 3),
        blocks=tuple((_KINDS[kind], of[:, _ORDER.get(_KINDS[kind], slice(None))]) for kind, of in blocks.items()),
        volumes={f"material_{n}": np.flatnonzero(materials == n) for n in np.unique(materials).tolist()},
        faces={},
        nodes={},
        notes=tuple(
            f"{count} elements of type {kind} are ignored; only solids are reduced" for kind, count in ignored.items()
        ),
    )


def _width(header: str) -> int:
    """Columns of a node number: five, or ten, as the last number of the header of a block says."""
    words = header.split()
    form = header[73:74].strip() or (words[-1] if len(words) > 2 else "0")
    if form not in ("0", "1"):
        raise InputError("the file is binary; write it as text (in CalculiX without the parameter OUTPUT=BINARY)")
    return 5 if form == "0" else 10


def _nodes(lines: list[str], width: int) -> dict[int, list[float]]:
    found = {}
    for line in lines:
        if line[:3] != " -1":
            break
        start = 3 + width
        found[int(line[3:start])] = [float(line[start + 12 * k : start + 12 * (k + 1)]) for k in range(3)]
    return found


def _elements(lines: list[str], width: int) -> Iterator[tuple[int, int, list[int]]]:
    """Type, material and nodes."""
    own: tuple[int, int] | None = None
    nodes: list[int] = []
    for line in lines:
        if line[:3] == " -1":
            kind, _, material = (int(word) for word in (line[3 + width :].split())[:3])
            if kind not in _SIZES or (own and len(nodes) != _SIZES[own[0]]):
                raise ValueError(kind)
            own, nodes = (kind, material), []
        elif line[:3] == " -2" and own:
            nodes += [int(line[k : k + width]) for k in range(3, len(line.rstrip()), width)]
            if len(nodes) == _SIZES[own[0]]:
                yield (*own, nodes)
        else:
            break
