"""Nodes that lie on elements without being theirs: nothing joins them there, and the model opens under load.

Such places are left where parts with different numbers of elements along a common edge share only some of their nodes, or
where the nodes of one part are beside those of the other by more than rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import cKDTree

from ffr_prep.common.arrays import Array, among, distinct

_ON = 1e-4  # of the length of an edge: within which a node lies on it
_FEW = 64  # nodes in a ball that are looked at one by one
_HALVINGS = 12  # of long edges between many nodes
_CORNERS = {2: 2, 3: 3, 6: 3}


def nodes_on_edges(points: Array, elements: Sequence[Array]) -> Array:
    """(m,) nodes that lie on an edge of beams or faces (E, k), which have k = 2, 3, 4, 6, 8 or 9 nodes, corners in turn
    first, and belong to none that has this edge."""
    edges, own = _edges(elements, len(points))
    nodes = distinct(np.concatenate([of.ravel() for of in elements]))
    tree = cKDTree(points[nodes])
    found = [np.zeros(0, np.int64)]
    for edge, k in _near(tree, points[edges]):
        node = nodes[k]
        a, b = points[edges[edge, 0]], points[edges[edge, 1]]
        length = np.linalg.norm(b - a, axis=1)
        share = np.einsum("pc,pc->p", points[node] - a, b - a) / np.maximum(length, np.finfo(float).tiny) ** 2
        off = np.linalg.norm(points[node] - a - np.clip(share, 0, 1)[:, None] * (b - a), axis=1)
        on = (off <= _ON * length) & ~among(edge * len(points) + node, own)
        found.append(node[on])
    return np.unique(np.concatenate(found))


def nodes_on_faces(points: Array, triangles: Array, nodes: Array) -> Array:
    """(m,) those of the nodes that lie in triangles (T, 3) without being a corner of them."""
    corners = points[triangles]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    near = cKDTree(points[nodes]).query_ball_point(centres, radii)
    triangle = np.repeat(np.arange(len(near)), [len(of) for of in near])
    node = nodes[np.array([k for of in near for k in of], np.int64)]
    strange = (node[:, None] != triangles[triangle]).all(axis=1)
    triangle, node = triangle[strange], node[strange]
    return np.unique(node[_inside(corners[triangle], points[node])])


def _inside(corners: Array, places: Array) -> Array:
    """(P,) whether places (P, 3) lie each in its triangle of corners (P, 3, 3)."""
    sides, away = corners[:, 1:] - corners[:, :1], places - corners[:, 0]
    products, along = np.einsum("pic,pjc->pij", sides, sides), np.einsum("pic,pc->pi", sides, away)
    area = np.maximum(products[:, 0, 0] * products[:, 1, 1] - products[:, 0, 1] ** 2, np.finfo(float).tiny)
    first = (products[:, 1, 1] * along[:, 0] - products[:, 0, 1] * along[:, 1]) / area
    second = (products[:, 0, 0] * along[:, 1] - products[:, 0, 1] * along[:, 0]) / area
    off = np.linalg.norm(away - first[:, None] * sides[:, 0] - second[:, None] * sides[:, 1], axis=1)
    size = np.sqrt(np.maximum(products[:, 0, 0], products[:, 1, 1]))
    return np.asarray((off <= _ON * size) & (first >= -_ON) & (second >= -_ON) & (first + second <= 1 + _ON))


def _edges(elements: Sequence[Array], count: int) -> tuple[Array, Array]:
    """(m, 2) the edges by their ends; and the nodes of the elements of each, as m count + node."""
    corners = [of[:, : _CORNERS.get(of.shape[1], 4)] for of in elements]
    ends = [np.stack([of, np.roll(of, -1, axis=1)], axis=-1).reshape(-1, 2) for of in corners]
    edges, which = np.unique(np.sort(np.concatenate(ends), axis=1), axis=0, return_inverse=True)
    starts = np.cumsum([0, *map(len, ends)])
    own = [
        which.ravel()[start : start + len(pairs), None] * count + np.repeat(of, len(pairs) // max(len(of), 1), axis=0)
        for start, pairs, of in zip(starts, ends, elements, strict=False)
    ]
    return edges, distinct(np.concatenate([of.ravel() for of in own]))


def _near(tree: cKDTree, ends: Array) -> Iterator[tuple[Array, Array]]:
    """Numbers of edges with ends (m, 2, 3) and of points of the tree close to them; those of long edges piece by piece."""
    edge, pieces = np.arange(len(ends)), ends
    for halving in range(_HALVINGS + 1):
        middle = pieces.mean(axis=1)
        whole = np.linalg.norm(ends[edge, 1] - ends[edge, 0], axis=1)
        radius = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1) / 2 + 2 * _ON * whole
        few = tree.query_ball_point(middle, radius, return_length=True) <= _FEW
        few |= halving == _HALVINGS
        near = tree.query_ball_point(middle[few], radius[few])
        counts = [len(of) for of in near]
        yield np.repeat(edge[few], counts), np.array([k for of in near for k in of], np.int64)
        halves = [np.stack([pieces[~few, 0], middle[~few]], axis=1), np.stack([middle[~few], pieces[~few, 1]], axis=1)]
        edge, pieces = np.tile(edge[~few], 2), np.concatenate(halves)
        if not len(edge):
            return
