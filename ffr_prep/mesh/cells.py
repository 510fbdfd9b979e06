"""Volume elements: node order, edges, faces.

Nodes are ordered as in VTK and meshio: corners, then mid-edge nodes, then face centres, then the centre. Faces are
listed with their corners first, counter-clockwise seen from outside, then their mid-edge nodes, then their centre.

Source: W. Schroeder, K. Martin, B. Lorensen, The Visualization Toolkit, 4th ed. (2006), chapter 5 (cell types).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array

Corners = tuple[tuple[int, ...], ...]

_TET_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_HEX_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_HEX_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_WEDGE_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1))
_WEDGE_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_WEDGE_QUADS = ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_WEDGE_FACES = ((0, 2, 1), (3, 4, 5), *_WEDGE_QUADS)
_PYRAMID_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1))
_PYRAMID_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4))
_PYRAMID_FACES = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
_HEX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (2, 3, 7, 6), (0, 3, 2, 1), (4, 5, 6, 7))

_CORNERS = {4: _TET_CORNERS, 8: _HEX_CORNERS, 6: _WEDGE_CORNERS, 5: _PYRAMID_CORNERS}


@dataclass(frozen=True)
class ElementKind:
    """A volume element.

    corners : number of corner nodes
    means   : for every further node, the corners whose mean it is
    faces   : (f, k) nodes of the faces, one array for each size of face
    shapes  : name of the element in scikit-fem, or in `ffr_prep.mesh.own_elements`
    """

    corners: int
    means: Corners
    faces: tuple[Array, ...]
    shapes: str

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.corners + len(self.means)

    @property
    def nodes(self) -> Array:
        """(k, 3) positions of the nodes in the reference element: the unit simplex or cube, the wedge between two unit
        triangles, the pyramid over the unit square."""
        corners = np.array(_CORNERS[self.corners], float)
        return np.vstack([corners, *(corners[list(of)].mean(axis=0) for of in self.means)])


def _kind(
    corners: int, means: tuple[tuple[int, ...], ...], faces: tuple[tuple[int, ...], ...], shapes: str
) -> ElementKind:
    node_of = {frozenset(of): corners + k for k, of in enumerate(means)}
    whole = [_whole_face(face, node_of) for face in faces]
    sizes = dict.fromkeys(map(len, whole))
    return ElementKind(corners, means, tuple(np.array([f for f in whole if len(f) == k]) for k in sizes), shapes)


def _whole_face(face: tuple[int, ...], node_of: Mapping[frozenset[int], int]) -> list[int]:
    """The corners of a face followed by the further nodes that lie on it."""
    edges = [frozenset(edge) for edge in zip(face, (*face[1:], face[0]), strict=True)]
    return [*face, *(node_of[part] for part in (*edges, frozenset(face)) if part in node_of)]


KINDS: Mapping[str, ElementKind] = {
    "tet4": _kind(4, (), _TET_FACES, "ElementTetP1"),
    "tet10": _kind(4, _TET_EDGES, _TET_FACES, "ElementTetP2"),
    "hex8": _kind(8, (), _HEX_FACES, "ElementHex1"),
    "hex20": _kind(8, _HEX_EDGES, _HEX_FACES, "ElementHexS2"),
    "hex27": _kind(8, (*_HEX_EDGES, *_HEX_FACES, tuple(range(8))), _HEX_FACES, "ElementHex2"),
    "wedge6": _kind(6, (), _WEDGE_FACES, "ElementWedge1"),
    "wedge15": _kind(6, _WEDGE_EDGES, _WEDGE_FACES, "ElementWedgeS2"),
    "wedge18": _kind(6, (*_WEDGE_EDGES, *_WEDGE_QUADS), _WEDGE_FACES, "ElementWedge2"),
    "pyramid5": _kind(5, (), _PYRAMID_FACES, "ElementPyramid1"),
    "pyramid13": _kind(5, _PYRAMID_EDGES, _PYRAMID_FACES, "ElementPyramidS2"),
}

# How a face of k nodes is drawn: triangles between its nodes, counter-clockwise like the face.
FACE_TRIANGLES: Mapping[int, Array] = {
    3: np.array([(0, 1, 2)]),
    6: np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]),
    4: np.array([(0, 1, 2), (0, 2, 3)]),
    8: np.array([(0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 7), (5, 6, 7)]),
    9: np.array([(0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8)]),
}


def face_corners(size: int) -> int:
    """Number of corners of a face of `size` nodes."""
    return 3 if size in (3, 6) else 4


# A wedge the other way up: what was its lower triangle is the upper one.
WEDGE_TURNED: Mapping[str, Array] = {
    "wedge6": np.array([3, 4, 5, 0, 1, 2]),
    "wedge18": np.array([3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8, 12, 13, 14, 15, 16, 17]),
}


def node_order(kind: str, positions: Array) -> Array:
    """(k,) for each node in the order used here, the index of the same node among `positions` (k, 3).

    positions : where another program has the nodes, in the reference element
    """
    distance = np.linalg.norm(KINDS[kind].nodes[:, None] - positions[None], axis=-1)
    return np.asarray(np.argmin(distance, axis=1))
