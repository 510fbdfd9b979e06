"""Meshes of Medit (.mesh) as text, of first and second order: of gmsh, mmg, FreeFem and tetgen.

A file is a sequence of keywords, each with a count and that many rows, of which the last number is a reference. Nodes in
the middle of edges stand in no agreed order (the format has a keyword for it that hardly any program writes); they are
taken by where they lie.

Source: L. Marechal, Handling unstructured meshes with the libMeshb, INRIA; P. J. Frey, MEDIT, report RT-0253, INRIA (2001).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import meshio
import numpy as np
from scipy.optimize import linear_sum_assignment

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_text
from ffr_prep.mesh.cells import KINDS

_CELLS = {  # meshio's name and the number of nodes
    "Edges": ("line", 2),
    "EdgesP2": ("line3", 3),
    "Triangles": ("triangle", 3),
    "TrianglesP2": ("triangle6", 6),
    "Quadrilaterals": ("quad", 4),
    "QuadrilateralsQ2": ("quad9", 9),
    "Tetrahedra": ("tetra", 4),
    "TetrahedraP2": ("tetra10", 10),
    "Prisms": ("wedge", 6),
    "PrismsP2": ("wedge18", 18),
    "Pyramids": ("pyramid", 5),
    "PyramidsP2": ("pyramid14", 14),
    "Hexahedra": ("hexahedron", 8),
    "Hexaedra": ("hexahedron", 8),  # as the report that describes the format spells it
    "HexahedraQ2": ("hexahedron27", 27),
}
_CURVED = {"tetra10": "tet10", "hexahedron27": "hex27", "wedge18": "wedge18"}
_KEYWORD = re.compile(r"^[ \t]*([A-Za-z]\w*)", re.MULTILINE)
_FIRST = "MeshVersionFormatted"
_WHAT = "a mesh of Medit"
_MOST = 1e15  # beyond it no coordinate is one, and no reference


def from_medit(path: Path) -> meshio.Mesh:
    """The mesh of a .mesh file; references are data of nodes and of cells. Raises InputError for a damaged file."""
    text = re.sub(r"#.*", "", read_text(path, _WHAT))
    if not text.lstrip().startswith(_FIRST):
        raise InputError(f"{path} is not {_WHAT}: it does not begin with {_FIRST}; does its ending name its format?")
    points, cells, references, dimension = np.zeros((0, 4)), [], [], 0
    for keyword, numbers in _sections(path, text):
        if keyword == "Dimension":
            dimension = int(numbers[0]) if numbers.size else 0
        elif keyword == "Vertices":
            points = _rows(path, keyword, numbers, dimension + 1)
        elif keyword in _CELLS:
            kind, size = _CELLS[keyword]
            rows = _rows(path, keyword, numbers, size + 1)
            cells.append((kind, rows[:, :size] - 1))
            references.append(rows[:, size])
    if dimension != 3:
        raise InputError(f"{path} has the dimension {dimension}; bodies are made of solids, in three dimensions")
    for kind, nodes in cells:
        _check_nodes(path, kind, nodes, len(points))
    return meshio.Mesh(
        points[:, :3],
        [(kind, _in_order(points[:, :3], kind, nodes)) for kind, nodes in cells],
        point_data={"medit:ref": points[:, 3].astype(np.int64)},
        cell_data={"medit:ref": references},
    )


def _sections(path: Path, text: str) -> Iterator[tuple[str, Array]]:
    """Each keyword with the numbers behind it."""
    found = list(_KEYWORD.finditer(text))
    for one, following in zip(found, [*found[1:], None], strict=True):
        if one[1] in _CELLS or one[1] in ("Dimension", "Vertices"):  # others hold what a body does not need
            words = text[one.end() : following.start() if following else len(text)].split()
            try:
                numbers = np.array(words, np.float64 if one[1] == "Vertices" else np.int64)
            except (ValueError, OverflowError) as error:
                raise InputError(f"{path}: {one[1]} has what is no number ({error}); is the file complete?") from None
            if not np.all(np.abs(numbers) < _MOST):
                raise InputError(f"{path}: {one[1]} has a number that is not finite, or too large; is the file sound?")
            yield one[1], numbers


def _rows(path: Path, keyword: str, numbers: Array, width: int) -> Array:
    """(count, width): what follows a count."""
    count = int(numbers[0]) if numbers.size else 0
    if numbers.size != 1 + count * width:
        raise InputError(
            f"{path}: {keyword} announces {count} rows of {width} numbers, and {max(numbers.size - 1, 0)} numbers follow; is "
            "the file complete?"
        )
    return numbers[1:].reshape(count, width)


def _check_nodes(path: Path, kind: str, nodes: Array, count: int) -> None:
    if nodes.size and not 0 <= nodes.min() <= nodes.max() < count:
        raise InputError(
            f"{path}: elements of kind {kind!r} refer to a vertex that the file does not have; it has {count}"
        )


def _in_order(points: Array, kind: str, nodes: Array) -> Array:
    """Volume elements with their further nodes in our order: each where it lies nearest to the mean of its corners."""
    if kind not in _CURVED or not len(nodes):
        return nodes
    ours = KINDS[_CURVED[kind]]
    at = points[nodes]  # (E, k, 3)
    means = np.stack([at[:, list(of)].mean(axis=1) for of in ours.means], axis=1)
    away = np.linalg.norm(means[:, :, None] - at[:, None, ours.corners :], axis=-1)
    _, order = linear_sum_assignment(away.mean(axis=0))
    return nodes[:, [*range(ours.corners), *(ours.corners + order)]]
