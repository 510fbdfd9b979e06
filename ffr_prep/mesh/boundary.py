"""The sides of volume elements: which are shared, which are outside, which belong to a named surface.

Blocks are pairs (kind, nodes (E, k)) as in `elements`; element numbers count through them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.cells import KINDS, face_corners

Blocks = Sequence[tuple[str, Array]]


def outer_faces(blocks: Blocks) -> tuple[Array, ...]:
    """The faces that only one element has, one array (F, k) per face size, outward."""
    faces, _, face = _numbered(blocks, [])
    return _chosen(faces, np.bincount(face)[face] == 1)


def whole_faces(blocks: Blocks, corners: Sequence[Array]) -> tuple[Array, ...]:
    """The faces of the elements that have these corners (F, 3) or (F, 4), each once; corners of no face are left out.

    One array (F, k) per face size, outward where the face is outside.
    """
    return groups_of_whole_faces(blocks, [corners])[0]


def groups_of_whole_faces(blocks: Blocks, groups: Sequence[Sequence[Array]]) -> list[tuple[Array, ...]]:
    """`whole_faces` of several groups of corners; the sides of the elements are numbered once."""
    faces, wanted, face = _numbered(blocks, [part for group in groups for part in group])
    first = np.full(max(face.max(initial=-1), wanted.max(initial=-1)) + 1, -1)
    first[face[::-1]] = np.arange(face.size)[::-1]
    ends = np.cumsum([0, *(sum(map(len, group)) for group in groups)])
    found = []
    for own in (wanted[start:end] for start, end in pairwise(ends)):
        keep = np.zeros(face.size, bool)
        sides = first[own]
        keep[sides[sides >= 0]] = True
        found.append(_chosen(faces, keep))
    return found


def joined_by_faces(blocks: Blocks) -> Array:
    """(E,) number of the part that each element belongs to, parts being joined by whole faces."""
    return parts_and_overlaps(blocks)[0]


def parts_and_overlaps(blocks: Blocks) -> tuple[Array, Array]:
    """`joined_by_faces`, and the elements (m,) on that side of a face on which another element lies, too."""
    faces, _, face = _numbered(blocks, [])
    owner = _owners(blocks)
    seen = 2 * face + np.concatenate([_turns(of[:, : face_corners(of.shape[1])]) for of in faces])
    return _parts(owner, face), np.unique(owner[np.bincount(seen)[seen] > 1])


def _turns(corners: Array) -> Array:
    """(F,) whether the corner after the least one is less than that before it: which way round a face is seen."""
    rows, least, size = np.arange(len(corners)), corners.argmin(axis=1), corners.shape[1]
    return corners[rows, (least + 1) % size] < corners[rows, (least - 1) % size]


def _owners(blocks: Blocks) -> Array:
    """(F,) the element of every side, in the order of `_sides`."""
    first = np.cumsum([0, *(len(nodes) for _, nodes in blocks)])
    parts = [
        np.repeat(np.arange(*first[k : k + 2]), len(of))
        for k, (kind, _) in enumerate(blocks)
        for of in KINDS[kind].faces
    ]
    return np.concatenate(parts)


def _sides(blocks: Blocks) -> tuple[Array, ...]:
    """The sides of all elements, an array (F, k) for each block and size of face."""
    return tuple(nodes[:, of].reshape(-1, of.shape[1]) for kind, nodes in blocks for of in KINDS[kind].faces)


def misfits(blocks: Blocks) -> tuple[Array, Array]:
    """Where elements of several kinds do not fit: edges (m, 2) with a node in the middle for some of their elements and none
    for others; and quadrilaterals (q, 4) of some that are two triangles of others."""
    edges, middle = (np.concatenate(of) for of in zip(*(_edges(kind, nodes) for kind, nodes in blocks), strict=True))
    unique, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    has = [np.bincount(which.ravel(), weights=middle == there, minlength=len(unique)) > 0 for there in (True, False)]
    outside = [faces[:, : face_corners(faces.shape[1])] for faces in outer_faces(blocks)]
    triangles = {tuple(sorted(of)) for faces in outside if faces.shape[1] == 3 for of in faces.tolist()}
    squares = [of for faces in outside if faces.shape[1] == 4 for of in faces.tolist()]
    split = [of for of in squares if any(tuple(sorted(part)) in triangles for part in combinations(of, 3))]
    return unique[has[0] & has[1]], np.array(split, np.int64).reshape(-1, 4)


def _edges(kind: str, nodes: Array) -> tuple[Array, Array]:
    """(m, 2) the edges of elements by their ends, and (m,) whether they have a node in the middle."""
    corners = [of[:, : face_corners(of.shape[1])] for of in KINDS[kind].faces]
    around = [np.stack([of, np.roll(of, 1, axis=1)], axis=-1).reshape(-1, 2) for of in corners]
    ends = np.unique(np.sort(np.concatenate(around), axis=1), axis=0)
    found = nodes[:, ends].reshape(-1, 2)
    return found, np.full(len(found), KINDS[kind].size > KINDS[kind].corners)


def neighbours(blocks: Blocks) -> Array:
    """(P, 2) pairs of elements that share a whole face."""
    _, _, face = _numbered(blocks, [])
    owner = _owners(blocks)
    order = np.argsort(face, kind="stable")
    same = face[order][1:] == face[order][:-1]
    return np.stack([owner[order][:-1][same], owner[order][1:][same]], axis=1)


def joined_by_nodes(blocks: Blocks) -> Array:
    """(E,) number of the part that each element belongs to, parts being joined by at least one node."""
    sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for _, nodes in blocks])
    return _parts(np.repeat(np.arange(sizes.size), sizes), np.concatenate([nodes.ravel() for _, nodes in blocks]))


def _parts(elements: Array, shared: Array) -> Array:
    """(E,) connected components of elements through what they share."""
    count = int(elements.max()) + 1
    size = count + int(shared.max()) + 1
    bonds = sp.coo_array((np.ones(elements.size, np.int8), (elements, count + shared)), shape=(size, size))
    _, part = connected_components(bonds.tocsr(), directed=False)
    return np.unique(part[:count], return_inverse=True)[1].ravel()


def _numbered(blocks: Blocks, corners: Sequence[Array]) -> tuple[tuple[Array, ...], Array, Array]:
    """The sides (`_sides`), the face number of the given corners, and the face number of every side."""
    faces = _sides(blocks)
    of_sides = [_keys(side[:, : face_corners(side.shape[1])]) for side in faces]
    keys = np.concatenate([*of_sides, *map(_keys, corners)])
    base = keys.max(initial=0) + 2
    high, low = (
        (keys[:, k] + 1) * base + keys[:, k + 1] + 1 for k in (0, 2)
    )  # sorted in a third of the time of the rows
    order = np.lexsort((low, high))
    new = (np.diff(high[order]) != 0) | (np.diff(low[order]) != 0)
    number = np.empty(len(keys), int)
    number[order] = np.cumsum(np.concatenate([np.zeros(min(len(keys), 1), int), new]))
    count = sum(map(len, faces))
    return faces, number[count:], number[:count]


def _keys(corners: Array) -> Array:
    """(F, 4) corners in ascending order, so that a face is the same from both sides; triangles padded by -1."""
    padded = np.full((len(corners), 4), -1, dtype=np.int64)
    padded[:, : corners.shape[1]] = corners
    return np.sort(padded, axis=1)


def _chosen(faces: Sequence[Array], keep: Array) -> tuple[Array, ...]:
    """The sides that are kept, one array per face size."""
    kept = [of[here] for of, here in zip(faces, np.split(keep, np.cumsum([len(f) for f in faces])[:-1]), strict=True)]
    sizes = dict.fromkeys(part.shape[1] for part in kept if len(part))
    return tuple(np.concatenate([part for part in kept if part.shape[1] == size]) for size in sizes)
