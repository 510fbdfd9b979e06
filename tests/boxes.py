"""Meshes small enough to reason about: boxes of every element kind, straight or mapped, with named faces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from ffr_prep.mesh.mesh import Block, Mesh
from ffr_prep.model.material import Material

STEEL = Material(name="steel", E=2.1e11, nu=0.3, rho=7850.0)
KINDS = ("tet4", "tet10", "hex8", "hex20", "hex27")
SIDES = {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (2, 0), "top": (2, 1)}

# Corners, edges, faces and centre of a cell of the doubled lattice, in VTK's order.
_HEX = np.vstack(
    [
        [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
        [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
        [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
        [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2), (1, 1, 1)],
    ]
)
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_TET_FACES = ((0, 1, 2, 4, 5, 6), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (2, 0, 3, 6, 7, 9))
_HEX_FACES = (
    (0, 3, 7, 4, 11, 19, 15, 16, 20),
    (1, 2, 6, 5, 9, 18, 13, 17, 21),
    (0, 1, 5, 4, 8, 17, 12, 16, 22),
    (3, 2, 6, 7, 10, 18, 14, 19, 23),
    (0, 1, 2, 3, 8, 9, 10, 11, 24),
    (4, 5, 6, 7, 12, 13, 14, 15, 25),
)
_HEX_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_MEANS = {
    "tet4": (),
    "tet10": _TET_EDGES,
    "hex8": (),
    "hex20": _HEX_EDGES,
    "hex27": (*_HEX_EDGES, *(face[:4] for face in _HEX_FACES), tuple(range(8))),
}
_NODES = {"tet4": 4, "tet10": 10, "hex8": 8, "hex20": 20, "hex27": 27}
_FACE_NODES = {"tet4": 3, "tet10": 6, "hex8": 4, "hex20": 8, "hex27": 9}


def _kuhn_tetrahedra() -> np.ndarray:
    """(6, 10, 3) the six tetrahedra of a cell of the doubled lattice, mid-edge nodes last."""
    tetrahedra = []
    for axes in permutations(range(3)):
        corners = np.cumsum(np.vstack([np.zeros(3, int)] + [2 * np.eye(3, dtype=int)[a] for a in axes]), axis=0)
        if np.linalg.det(np.eye(3)[list(axes)]) < 0:
            corners = corners[[1, 0, 2, 3]]
        tetrahedra.append(np.vstack([corners, [(corners[a] + corners[b]) // 2 for a, b in _TET_EDGES]]))
    return np.array(tetrahedra)


def box_mesh(
    kind: str,
    size: tuple[float, float, float],
    cells: tuple[int, int, int],
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    mapped: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Mesh:
    """The box origin + [0, size] of one element kind, its six sides as face groups; `mapped` moves the points."""
    local = _HEX[None] if kind.startswith("hex") else _kuhn_tetrahedra()
    faces = _HEX_FACES if kind.startswith("hex") else _TET_FACES
    cell_origins = 2 * np.array(list(product(*(range(n) for n in cells))))
    lattice = (cell_origins[:, None, None] + local[None]).reshape(-1, local.shape[1], 3)[:, : _NODES[kind]]
    nodes, connectivity = np.unique(lattice.reshape(-1, 3), axis=0, return_inverse=True)
    connectivity = connectivity.reshape(-1, _NODES[kind])
    points = np.array(origin) + nodes * np.array(size) / (2 * np.array(cells))
    every_face = np.vstack([connectivity[:, face[: _FACE_NODES[kind]]] for face in faces])
    groups = {
        side: (every_face[(nodes[every_face][..., axis] == end * 2 * cells[axis]).all(axis=1)],)
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
        corners = block.nodes[:, : 4 if block.kind.startswith("tet") else 8]
        for k, of in enumerate(_MEANS[block.kind]):
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
