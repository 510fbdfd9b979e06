"""Meshes small enough to reason about: boxes of every element kind, straight or mapped, with named faces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from ffr_prep.mesh.mesh import Block, Mesh
from ffr_prep.model.material import Material

STEEL = Material(name="steel", E=2.1e11, nu=0.3, rho=7850.0)
PLAIN = ("tet4", "tet10", "hex8", "hex20", "hex27")  # those that scikit-fem has
KINDS = (*PLAIN, "wedge6", "wedge15", "wedge18", "pyramid5", "pyramid13")
SIDES = {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (2, 0), "top": (2, 1)}

# Corners of a cell of the lattice, 4 long so that all further nodes are on it; edges and faces in VTK's order.
_CUBE = 4 * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_HEX_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_WEDGE_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_PYRAMID_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4))
_HEX_FACES = ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))
_FACES = {
    "tet": ((0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "hex": _HEX_FACES,
    "wedge": ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
_MEANS = {
    "tet10": _TET_EDGES,
    "hex20": _HEX_EDGES,
    "hex27": (*_HEX_EDGES, *_HEX_FACES, tuple(range(8))),
    "wedge15": _WEDGE_EDGES,
    "wedge18": (*_WEDGE_EDGES, *_FACES["wedge"][2:]),
    "pyramid13": _PYRAMID_EDGES,
}


def _kuhn_tetrahedra() -> np.ndarray:
    """(6, 4, 3) the six tetrahedra of a cell."""
    tetrahedra = []
    for axes in permutations(range(3)):
        corners = np.cumsum(np.vstack([np.zeros(3, int)] + [4 * np.eye(3, dtype=int)[a] for a in axes]), axis=0)
        tetrahedra.append(corners if np.linalg.det(np.eye(3)[list(axes)]) > 0 else corners[[1, 0, 2, 3]])
    return np.array(tetrahedra)


def _pyramids() -> np.ndarray:
    """(6, 5, 3) pyramids over the faces of a cell, with their apex in its middle."""
    inward = [face[::-1] if np.linalg.det(_CUBE[list(face[:3])] - 2) > 0 else face for face in _HEX_FACES]
    return np.array([[*_CUBE[list(face)], (2, 2, 2)] for face in inward])


_CELLS = {
    "tet": _kuhn_tetrahedra(),
    "hex": _CUBE[None],
    "wedge": np.array([_CUBE[[0, 1, 2, 4, 5, 6]], _CUBE[[0, 2, 3, 4, 6, 7]]]),
    "pyramid": _pyramids(),
}


def _shape(kind: str) -> str:
    return kind.rstrip("0123456789")


def _whole(kind: str, corners: tuple[int, ...]) -> list[int]:
    """The corners of a face, then the nodes on its edges in turn, then that in its middle."""
    first = _CELLS[_shape(kind)].shape[1]
    further = {frozenset(of): first + k for k, of in enumerate(_MEANS.get(kind, ()))}
    around = [frozenset(edge) for edge in zip(corners, (*corners[1:], corners[0]), strict=True)]
    return [*corners, *(further[of] for of in (*around, frozenset(corners)) if of in further)]


def on_side(points: np.ndarray, axis: int, place: float) -> np.ndarray:
    """(F,) whether all points of faces (F, k, 3) have this coordinate."""
    return (points[..., axis] == place).all(axis=1)


def box_mesh(
    kind: str,
    size: tuple[float, float, float],
    cells: tuple[int, int, int],
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    mapped: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Mesh:
    """The box origin + [0, size] of one element kind, its six sides as face groups; `mapped` moves the points."""
    corners = _CELLS[_shape(kind)]
    local = np.concatenate(
        [corners, *(corners[:, list(of)].mean(axis=1, keepdims=True) for of in _MEANS.get(kind, ()))], axis=1
    )
    cell_origins = 4 * np.array(list(product(*(range(n) for n in cells))))
    lattice = (cell_origins[:, None, None] + local[None]).reshape(-1, 3)
    nodes, connectivity = np.unique(lattice, axis=0, return_inverse=True)
    connectivity = connectivity.reshape(-1, local.shape[1])
    points = np.array(origin) + nodes * np.array(size) / (4 * np.array(cells))
    faces = [connectivity[:, _whole(kind, face)] for face in _FACES[_shape(kind)]]
    sizes = dict.fromkeys(of.shape[1] for of in faces)
    every_face = [np.vstack([of for of in faces if of.shape[1] == k]) for k in sizes]
    groups = {
        side: tuple(of[there] for of in every_face if (there := on_side(nodes[of], axis, 4 * end * cells[axis])).any())
        for side, (axis, end) in SIDES.items()
    }
    return Mesh(
        points=points if mapped is None else mapped(points),
        blocks=(Block(kind, connectivity),),
        volume_groups={"body": np.arange(len(connectivity))},
        face_groups=groups,
        node_groups={},
    )


def rotation(seed: int) -> np.ndarray:
    """A proper rotation matrix, arbitrary but always the same."""
    Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


def straightened(mesh: Mesh) -> Mesh:
    """The mesh with every further node at the mean of the corners of its edge, face or cell."""
    points = mesh.points.copy()
    for block in mesh.blocks:
        corners = block.nodes[:, : _CELLS[_shape(block.kind)].shape[1]]
        for k, of in enumerate(_MEANS.get(block.kind, ())):
            points[block.nodes[:, corners.shape[1] + k]] = points[corners[:, list(of)]].mean(axis=1)
    return replace(mesh, points=points)


def shaken(mesh: Mesh, amplitude: float, seed: int = 0) -> Mesh:
    """The box mesh with its inner corner nodes moved at random by up to `amplitude` [m], straight elements."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    inner = ((mesh.points > low + 1e-9) & (mesh.points < high - 1e-9)).astype(float)
    step = np.random.default_rng(seed).uniform(-amplitude, amplitude, mesh.points.shape)
    return straightened(replace(mesh, points=mesh.points + inner * step))


def moved(mesh: Mesh, R: np.ndarray, by: np.ndarray) -> Mesh:
    """The mesh turned by R and then shifted."""
    return replace(mesh, points=mesh.points @ R.T + by)


def rigid_motions(points: np.ndarray) -> np.ndarray:
    """(N, 3, 6) the six rigid motions about the origin."""
    motions = np.zeros((len(points), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for k, axis in enumerate(np.eye(3)):
        motions[:, :, 3 + k] = np.cross(axis, points)
    return motions


def box_inertia(mass: float, size: np.ndarray) -> np.ndarray:
    """(3, 3) central inertia of a homogeneous box [kg m^2]."""
    a, b, c = size
    return mass / 12 * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2])
