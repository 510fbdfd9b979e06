"""Frames of beams: nodes and the members between them, built from a few lines of Python, joined, named and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ffr_prep.body import content_hash
from ffr_prep.errors import InputError
from ffr_prep.material import Material
from ffr_prep.section import Section

Array = np.ndarray
Vector = tuple[float, float, float]

_SAME_PLACE = 1e-9


@dataclass(frozen=True)
class Member:
    """What a beam is made of.

    orientation : vector (body axes) that lies in the x'y' plane of the elements, so that y', the direction of the
                  section's height, is its part across the beam; a round section needs none

    Raises InputError for an orientation that is not a direction.
    """

    section: Section
    material: Material
    orientation: Vector | None = None

    def __post_init__(self) -> None:
        given = self.orientation
        if given is not None and (np.shape(given) != (3,) or not 0 < np.linalg.norm(given) < np.inf):
            raise InputError(f"member of {self.section.name!r}: orientation {given} is not a direction (x, y, z)")


@dataclass(frozen=True)
class Frame:
    """Nodes with six coordinates each and straight beam elements between them; frozen, SI units.

    points      : (N, 3) [m]
    elements    : (E, 2) nodes of each element, x' runs from the first to the second
    members     : what the elements are made of
    member_of   : (E,) index into members
    node_groups : name -> (m,) nodes, where interfaces attach

    Raises InputError for arrays of other shapes and coordinates that are not finite.
    """

    points: Array
    elements: Array
    members: tuple[Member, ...]
    member_of: Array
    node_groups: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _freeze(self, "points", np.array(self.points, float), (-1, 3))
        _freeze(self, "elements", np.array(self.elements, np.int64), (-1, 2))
        _freeze(self, "member_of", np.array(self.member_of, np.int64), (len(self.elements),))
        groups = {name: np.array(nodes, np.int64) for name, nodes in self.node_groups.items()}
        object.__setattr__(self, "node_groups", groups)
        wrong = np.flatnonzero(~np.isfinite(self.points).all(axis=1))
        if wrong.size:
            raise InputError(
                f"node {wrong[0]} has the coordinates {self.points[wrong[0]]}; they must be finite numbers"
            )


def _freeze(frame: Frame, key: str, value: Array, shape: tuple[int, ...]) -> None:
    if value.ndim != len(shape) or any(size not in (-1, given) for size, given in zip(shape, value.shape, strict=True)):
        raise InputError(f"frame: {key} has the shape {value.shape}; it must be {str(shape).replace('-1', 'any')}")
    value.setflags(write=False)
    object.__setattr__(frame, key, value)


# ---- building -----------------------------------------------------------------------------------------------------


def polyline(corners: Sequence[Vector] | Array, member: Member, *, elements: int = 1) -> Frame:
    """Straight beams from corner to corner (P, 3) [m], each of `elements` elements of equal length.

    Raises InputError for fewer than two corners, one that is not finite, or no elements.
    """
    at = np.asarray(corners, float)
    if at.ndim != 2 or at.shape[1] != 3 or len(at) < 2:
        raise InputError(f"a polyline needs two or more corners (x, y, z); it has the shape {at.shape}")
    if not np.isfinite(at).all():
        wrong = at[~np.isfinite(at).all(axis=1)][0]
        raise InputError(f"a polyline has the corner {wrong.tolist()}; it must be three finite numbers")
    if elements < 1:
        raise InputError(f"a polyline of {elements} elements a leg cannot be built; ask for one or more")
    part = np.arange(elements)[:, None] / elements
    points = np.vstack([*((1 - part) * a + part * b for a, b in pairwise(at)), at[-1:]])
    pairs = np.stack([np.arange(len(points) - 1), np.arange(1, len(points))], axis=1)
    if np.array_equal(at[0], at[-1]) and len(at) > 2:
        points, pairs = points[:-1], pairs % (len(points) - 1)
    return Frame(points, pairs, (member,), np.zeros(len(pairs), np.int64))


def joined(*frames: Frame) -> Frame:
    """One frame of several: nodes at the same place become one, and members meet there rigidly."""
    points = np.vstack([frame.points for frame in frames])
    first = np.cumsum([0, *(len(frame.points) for frame in frames)])
    kept, new = _merged(points)
    members = tuple(dict.fromkeys(member for frame in frames for member in frame.members))
    groups: dict[str, Array] = {}
    for frame, start in zip(frames, first[:-1], strict=True):
        for name, nodes in frame.node_groups.items():
            groups[name] = np.union1d(groups.get(name, np.zeros(0, np.int64)), new[nodes + start])
    renumbered = [np.array([members.index(m) for m in frame.members])[frame.member_of] for frame in frames]
    return Frame(
        points=points[kept],
        elements=np.vstack([new[f.elements + start] for f, start in zip(frames, first[:-1], strict=True)]),
        members=members,
        member_of=np.concatenate(renumbered),
        node_groups=groups,
    )


def _merged(points: Array) -> tuple[Array, Array]:
    """The nodes to keep, and the new number of every node, when those at the same place become one."""
    pairs = cKDTree(points).query_pairs(_SAME_PLACE * _size(points), output_type="ndarray")
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    _, labels = connected_components(graph, directed=False)
    _, kept, places = np.unique(labels, return_index=True, return_inverse=True)
    order = np.argsort(kept)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return kept[order], rank[places]


def named(frame: Frame, **positions: Vector) -> Frame:
    """The frame with names for the nodes at these positions [m].

    Raises InputError where there is no node.
    """
    groups = dict(frame.node_groups)
    tree = cKDTree(frame.points)
    for name, position in positions.items():
        distance, node = tree.query(np.asarray(position, float))
        if not distance <= _SAME_PLACE * _size(frame.points):
            raise InputError(
                f"there is no node at {tuple(position)} m to be called {name!r}; the nearest is node {node} at "
                f"{frame.points[node].tolist()} m, {distance:.3g} m away"
            )
        groups[name] = np.array([node])
    return replace(frame, node_groups=groups)


def _size(points: Array) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


# ---- questions ----------------------------------------------------------------------------------------------------


def group_nodes(frame: Frame, name: str) -> Array:
    """(m,) nodes of a group, ascending; InputError lists the groups there are."""
    if name not in frame.node_groups:
        near = get_close_matches(name, frame.node_groups, n=1, cutoff=0.5)
        known = ", ".join(repr(one) for one in frame.node_groups) or "none; name nodes with named(frame, ...)"
        raise InputError(
            f"the frame has no group of nodes {name!r}; {f'did you mean {near[0]!r}? ' if near else ''}There are: {known}"
        )
    return np.unique(frame.node_groups[name])


def ends(frame: Frame) -> Array:
    """(E, 2, 3) positions of the ends of every element [m]."""
    return frame.points[frame.elements]


def orientations(frame: Frame) -> Array:
    """(E, 3) orientation of every element; NaN where none is given."""
    of_members = [(np.nan,) * 3 if m.orientation is None else m.orientation for m in frame.members]
    return np.array(of_members, float).reshape(-1, 3)[frame.member_of]


def frame_hash(frame: Frame) -> str:
    """A short hash of nodes, elements and groups."""
    parts = [frame.points, np.asarray(frame.elements, np.int64), np.asarray(frame.member_of, np.int64)]
    for name in sorted(frame.node_groups):
        parts += [np.frombuffer(name.encode(), np.uint8), np.asarray(frame.node_groups[name], np.int64)]
    return content_hash(*parts)


# ---- checks -------------------------------------------------------------------------------------------------------


def check_frame(frame: Frame) -> None:
    """Raises InputError for a frame that no computation should start from.

    Guarded: no elements, numbers of nodes and members that do not exist, nodes of no element, empty groups, elements that
    are repeated, nodes at the same place and parts that nothing connects. The elements guard their own length and
    orientation.
    """
    _check_numbers(frame)
    _check_groups(frame)
    _check_repeated(frame)
    _check_coincident(frame)
    _check_connected(frame)


def _check_numbers(frame: Frame) -> None:
    count = len(frame.points)
    if not len(frame.elements):
        raise InputError("the frame has no elements; build one with polyline(...)")
    if frame.elements.min() < 0 or frame.elements.max() >= count:
        raise InputError(
            f"elements refer to nodes {frame.elements.min()} to {frame.elements.max()}, but there are {count} nodes"
        )
    if not np.isin(frame.member_of, range(len(frame.members))).all():
        raise InputError(f"every element must have one of the {len(frame.members)} members of the frame")
    unused = np.setdiff1d(np.arange(count), frame.elements)
    if unused.size:
        raise InputError(f"{unused.size} nodes belong to no element, the first being node {unused[0]}; remove them")


def _check_groups(frame: Frame) -> None:
    for name, nodes in frame.node_groups.items():
        if not len(nodes) or np.min(nodes) < 0 or np.max(nodes) >= len(frame.points):
            raise InputError(f"node group {name!r} is empty or names nodes that the frame does not have")


def _check_repeated(frame: Frame) -> None:
    _, index, counts = np.unique(np.sort(frame.elements, axis=1), axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        element = int(index[counts > 1].min())
        raise InputError(
            f"{np.sum(counts > 1)} elements are there more than once, the first being element {element} between nodes "
            f"{frame.elements[element].tolist()}: remove the copies"
        )


def _check_coincident(frame: Frame) -> None:
    pairs = cKDTree(frame.points).query_pairs(_SAME_PLACE * _size(frame.points), output_type="ndarray")
    linked = {tuple(pair) for pair in np.sort(frame.elements, axis=1).tolist()}
    apart = sorted(tuple(pair) for pair in pairs.tolist() if tuple(pair) not in linked)
    if apart:
        a, b = apart[0]
        raise InputError(
            f"{len(apart)} pairs of nodes are at the same place, the first being nodes {a} and {b} at "
            f"{frame.points[a].tolist()} m; nothing holds them together: join the parts with joined(...)"
        )


def _check_connected(frame: Frame) -> None:
    count = len(frame.points)
    graph = sp.coo_array((np.ones(len(frame.elements)), tuple(frame.elements.T)), shape=(count, count))
    parts, labels = connected_components(graph, directed=False)
    if parts > 1:
        places = ", ".join(str(frame.points[np.argmax(labels == part)].tolist()) for part in range(min(parts, 5)))
        raise InputError(
            f"the frame has {parts} parts that nothing connects, with nodes at {places} m: a body is one piece; let "
            "members share nodes (joined(...) merges nodes at the same place), or make each part a body of its own"
        )
