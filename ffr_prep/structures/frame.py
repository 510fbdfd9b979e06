"""Frames of beams and plates: nodes and what is between them, built from a few lines of Python, joined, named, checked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ffr_prep.body import content_hash
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.common.errors import InputError, require_kind
from ffr_prep.common.in_words import extent_in_words
from ffr_prep.common.reading import check_count
from ffr_prep.mesh.geometry.node_regions import nodes_of_region
from ffr_prep.mesh.open_joints import nodes_on_edges, nodes_on_faces
from ffr_prep.model.material import Material, check_isotropic
from ffr_prep.structures.sections import Section

Vector = tuple[float, float, float]
Place = tuple[int, ...]  # nodes
Seen = tuple[int, Array]  # an element, and the unit vector along which it leaves a place

_SAME_PLACE = 1e-9
_SAME_WAY = 1 - 1e-9  # the cosine between two ways that are one

_MOST_ELEMENTS = 10_000_000
_THICK = 0.2  # thickness over the size of a sheet; shear then takes a tenth of its lowest frequencies
_FAR = 1e100  # m; squares of coordinates must be finite


@dataclass(frozen=True)
class Member:
    """Section, material and orientation of a beam.

    orientation : vector (body axes) that lies in the x'y' plane of the elements, so that y', the direction of the
                  section's height, is its part across the beam; a round section needs none

    Raises InputError for an orientation that is not a direction.

    >>> member = fp.Member(fp.tube(0.04, 0.002), fp.material("aluminium"))
    """

    section: Section
    material: Material
    orientation: Vector | None = None

    def __post_init__(self) -> None:
        require_kind(self.section, Section, "the section of a member", "one such as tube(0.04, 0.002)")
        check_isotropic(self.material, f"member of {self.section.name!r}")
        given = self.orientation
        if given is not None and (np.shape(given) != (3,) or not 0 < np.linalg.norm(given) < np.inf):
            raise InputError(f"member of {self.section.name!r}: orientation {given} is not a direction (x, y, z)")


@dataclass(frozen=True)
class Shell:
    """Thickness and material of a plate.

    thickness : [m], half of it on either side of the nodes
    gyration  : root mean square of the distance of the mass from the middle plane [m]; thickness/sqrt(12) when not given,
                0 leaves the rotary inertia of the thickness out

    Raises InputError for a thickness that is not positive and a negative gyration.

    >>> sheet = fp.Shell(2e-3, fp.material("aluminium"))
    """

    thickness: float
    material: Material
    gyration: float | None = None

    def __post_init__(self) -> None:
        check_isotropic(self.material, "shell")
        if not 0 < self.thickness < math.inf:
            raise InputError(f"shell of {self.material.name}: the thickness is {self.thickness} m; it must be positive")
        if self.gyration is None:
            object.__setattr__(self, "gyration", self.thickness / math.sqrt(12))
        if not 0 <= (self.gyration or 0.0) < math.inf:
            raise InputError(f"shell of {self.material.name}: gyration is {self.gyration} m; it must not be negative")


@dataclass(frozen=True, repr=False)
class Frame(Brief):
    """Nodes with six coordinates each, and straight beams and flat plates between them; frozen, SI units.

    points         : (N, 3) [m]
    elements       : (E, 2) nodes of each beam element, x' runs from the first to the second
    members        : what the beams are made of
    member_of      : (E,) index into members
    node_groups    : name -> (m,) nodes, where interfaces attach
    triangles      : (T, 3) nodes of the plate elements of three nodes, counter-clockwise about z'
    quadrilaterals : (Q, 4) of those of four
    shells         : what the plates are made of
    shell_of       : (T + Q,) index into shells, triangles first

    Raises InputError for arrays of other shapes and coordinates that are not finite.

    >>> frame = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")), elements=10)
    """

    points: Array
    elements: Array
    members: tuple[Member, ...]
    member_of: Array
    node_groups: Mapping[str, Array] = field(default_factory=dict)
    triangles: Array = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    quadrilaterals: Array = field(default_factory=lambda: np.zeros((0, 4), np.int64))
    shells: tuple[Shell, ...] = ()
    shell_of: Array = field(default_factory=lambda: np.zeros(0, np.int64))

    def __post_init__(self) -> None:
        _freeze(self, "points", np.array(self.points, float), (-1, 3))
        _freeze(self, "elements", np.array(self.elements, np.int64), (-1, 2))
        _freeze(self, "member_of", np.array(self.member_of, np.int64), (len(self.elements),))
        _freeze(self, "triangles", np.array(self.triangles, np.int64), (-1, 3))
        _freeze(self, "quadrilaterals", np.array(self.quadrilaterals, np.int64), (-1, 4))
        plates = len(self.triangles) + len(self.quadrilaterals)
        _freeze(self, "shell_of", np.array(self.shell_of, np.int64), (plates,))
        groups = {name: np.array(nodes, np.int64) for name, nodes in self.node_groups.items()}
        object.__setattr__(self, "node_groups", groups)
        wrong = np.flatnonzero(~np.isfinite(self.points).all(axis=1))
        if wrong.size:
            raise InputError(
                f"node {wrong[0]} has the coordinates {self.points[wrong[0]]}; they must be finite numbers"
            )

    def _rows(self) -> Rows:
        kinds = {"beams": self.elements, "triangles": self.triangles, "quadrilaterals": self.quadrilaterals}
        return [
            ("elements", listed(f"{len(nodes)} {kind}" for kind, nodes in kinds.items() if len(nodes))),
            ("nodes", str(len(self.points))),
            ("extent", extent_in_words(self.points)),
            ("members", listed(f"{of.section.name} of {of.material.name}" for of in self.members)),
            ("shells", listed(f"{of.thickness:.4g} m of {of.material.name}" for of in self.shells)),
            ("groups", listed(self.node_groups)),
        ]


def _freeze(frame: Frame, key: str, value: Array, shape: tuple[int, ...]) -> None:
    if value.ndim != len(shape) or any(size not in (-1, given) for size, given in zip(shape, value.shape, strict=True)):
        raise InputError(f"frame: {key} has the shape {value.shape}; it must be {str(shape).replace('-1', 'any')}")
    value.setflags(write=False)
    object.__setattr__(frame, key, value)


# ---- building -----------------------------------------------------------------------------------------------------


def polyline(corners: Sequence[Vector] | Array, member: Member, *, elements: int = 1) -> Frame:
    """Straight beams through corners (P, 3) [m], each of `elements` elements of equal length.

    Raises InputError for fewer than two corners, one that is not finite, or no elements.

    >>> frame = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")), elements=10)
    """
    require_kind(member, Member, "the member of a polyline", "Member(section, material)")
    at = np.asarray(corners, float)
    if at.ndim != 2 or at.shape[1] != 3 or len(at) < 2:
        raise InputError(f"a polyline needs two or more corners (x, y, z); it has the shape {at.shape}")
    if not np.isfinite(at).all():
        wrong = at[~np.isfinite(at).all(axis=1)][0]
        raise InputError(f"a polyline has the corner {wrong.tolist()}; it must be three finite numbers")
    check_count(elements * (len(at) - 1), "elements of a polyline", _MOST_ELEMENTS)
    if elements < 1:
        raise InputError(f"a polyline of {elements} elements a leg cannot be built; ask for one or more")
    part = np.arange(elements)[:, None] / elements
    points = np.vstack([*((1 - part) * a + part * b for a, b in pairwise(at)), at[-1:]])
    pairs = np.stack([np.arange(len(points) - 1), np.arange(1, len(points))], axis=1)
    if np.array_equal(at[0], at[-1]) and len(at) > 2:
        points, pairs = points[:-1], pairs % (len(points) - 1)
    return Frame(points, pairs, (member,), np.zeros(len(pairs), np.int64))


def panel(corners: Sequence[Vector] | Array, shell: Shell, *, elements: tuple[int, int]) -> Frame:
    """A flat plate between four corners (4, 3) [m] of n x m quadrilaterals: n along the first side, m along the second.

    `triangulated` makes triangles of them. Raises InputError for other than four finite corners, or no elements.

    >>> plate = fp.panel([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], fp.Shell(2e-3, fp.material("steel")), elements=(8, 8))
    """
    require_kind(shell, Shell, "the shell of a panel", "Shell(thickness, material)")
    require_kind(
        elements, Sequence | np.ndarray, "elements of a panel", "two numbers, along the first side and the second"
    )
    at = np.asarray(corners, float)
    if at.shape != (4, 3) or not np.isfinite(at).all():
        raise InputError(f"a panel needs four finite corners (x, y, z); it has {at.tolist()}")
    if len(elements) != 2 or min(elements) < 1:
        raise InputError(f"a panel of {elements} elements cannot be built; ask for one or more along both sides")
    check_count(math.prod(elements), "elements of a panel", _MOST_ELEMENTS)
    x, y = (np.linspace(0.0, 1.0, count + 1) for count in elements)
    weights = np.stack([np.outer(1 - x, 1 - y), np.outer(x, 1 - y), np.outer(x, y), np.outer(1 - x, y)], axis=-1)
    number = np.arange(weights[..., 0].size).reshape(len(x), len(y))
    sides = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    quadrilaterals = np.stack(sides, axis=-1).reshape(-1, 4)
    return Frame(
        points=(weights @ at).reshape(-1, 3),
        elements=np.zeros((0, 2), np.int64),
        members=(),
        member_of=np.zeros(0, np.int64),
        quadrilaterals=quadrilaterals,
        shells=(shell,),
        shell_of=np.zeros(len(quadrilaterals), np.int64),
    )


def triangulated(frame: Frame) -> Frame:
    """The frame with every quadrilateral cut into two triangles along its shorter diagonal.

    >>> frame = fp.triangulated(plate)
    """
    a, b, c, d = frame.points[frame.quadrilaterals].transpose(1, 0, 2)
    other = np.linalg.norm(b - d, axis=1) < (1 - _SAME_PLACE) * np.linalg.norm(a - c, axis=1)
    cuts = np.where(other[:, None, None], [[(0, 1, 3), (1, 2, 3)]], [[(0, 1, 2), (0, 2, 3)]])
    halves = np.take_along_axis(frame.quadrilaterals[:, None], cuts.reshape(len(cuts), 2, 3), axis=2)
    of_triangles, of_quadrilaterals = np.split(frame.shell_of, [len(frame.triangles)])
    return replace(
        frame,
        triangles=np.vstack([frame.triangles, halves.reshape(-1, 3)]),
        quadrilaterals=np.zeros((0, 4), np.int64),
        shell_of=np.concatenate([of_triangles, np.repeat(of_quadrilaterals, 2)]),
    )


def joined(*frames: Frame) -> Frame:
    """One frame of several: nodes at the same place become one, and beams and plates meet there rigidly.

    Raises InputError without a frame.

    >>> tower = fp.joined(legs, braces)
    """
    if not frames:
        raise InputError("joined() joins frames, and has none; give one or more, as in joined(legs, braces)")
    points = np.vstack([frame.points for frame in frames])
    first = np.cumsum([0, *(len(frame.points) for frame in frames)])
    kept, new = _merged(points)
    members = tuple(dict.fromkeys(member for frame in frames for member in frame.members))
    shells = tuple(dict.fromkeys(shell for frame in frames for shell in frame.shells))
    groups: dict[str, Array] = {}
    for frame, start in zip(frames, first[:-1], strict=True):
        for name, nodes in frame.node_groups.items():
            groups[name] = np.union1d(groups.get(name, np.zeros(0, np.int64)), new[nodes + start])
    starts = list(zip(frames, first[:-1], strict=True))
    of_shells = [np.split(_renumbered(f.shells, shells, f.shell_of), [len(f.triangles)]) for f in frames]
    return Frame(
        points=points[kept],
        elements=np.vstack([new[f.elements + start] for f, start in starts]),
        members=members,
        member_of=np.concatenate([_renumbered(f.members, members, f.member_of) for f in frames]),
        node_groups=groups,
        triangles=np.vstack([new[f.triangles + start] for f, start in starts]),
        quadrilaterals=np.vstack([new[f.quadrilaterals + start] for f, start in starts]),
        shells=shells,
        shell_of=np.concatenate([*(own[0] for own in of_shells), *(own[1] for own in of_shells)]),
    )


def _renumbered(own: Sequence[object], known: Sequence[object], index: Array) -> Array:
    return np.array([known.index(one) for one in own], np.int64)[index]


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
    """The frame with names for the nodes at these positions (3,) [m].

    Raises InputError where there is no node.

    >>> frame = fp.named(frame, root=(0, 0, 0), tip=(1, 0, 0))
    """
    groups = dict(frame.node_groups)
    tree = cKDTree(frame.points)
    for name, position in positions.items():
        if not np.abs(np.asarray(position, float)).max() < _FAR:
            raise InputError(f"node {name!r} cannot be at {tuple(position)} m; give a place of finite coordinates")
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
    """(m,) nodes of a group, or of a region such as "nearest 0,0,1", ascending; InputError lists the groups there are."""
    hint = "" if frame.node_groups else "; name nodes with named(frame, ...)"
    return nodes_of_region(frame.points, frame.node_groups, name, "the frame has no group of nodes", hint)


def ends(frame: Frame) -> Array:
    """(E, 2, 3) positions of the ends of every element [m]."""
    return frame.points[frame.elements]


def orientations(frame: Frame) -> Array:
    """(E, 3) orientation of every element; NaN where none is given."""
    of_members = [(np.nan,) * 3 if m.orientation is None else m.orientation for m in frame.members]
    return np.array(of_members, float).reshape(-1, 3)[frame.member_of]


def frame_hash(frame: Frame) -> str:
    """A short hash of nodes, elements and groups."""
    parts = [frame.points, frame.elements, frame.member_of]
    if frame.shell_of.size:
        parts += [frame.triangles, frame.quadrilaterals, frame.shell_of]
    for name in sorted(frame.node_groups):
        parts += [np.frombuffer(name.encode(), np.uint8), np.asarray(frame.node_groups[name], np.int64)]
    return content_hash(*parts)


# ---- checks -------------------------------------------------------------------------------------------------------


def check_frame(frame: Frame) -> None:
    """Raises InputError for a frame that no computation should start from.

    Guarded: no elements, numbers of nodes, members and shells that do not exist, nodes of no element, empty groups,
    elements that are repeated, nodes at the same place and parts that nothing connects. The elements guard their own
    shape and orientation.
    """
    _check_numbers(frame)
    _check_groups(frame)
    for nodes in (frame.elements, frame.triangles, frame.quadrilaterals):
        _check_repeated(nodes)
    _check_coincident(frame)
    _check_connected(frame)


def _pairs(frame: Frame) -> Array:
    """(L, 2) nodes that an element connects, each with the first of it."""
    of_plates = [
        np.stack([np.broadcast_to(n[:, :1], n[:, 1:].shape), n[:, 1:]], -1).reshape(-1, 2) for n in _plates(frame)
    ]
    return np.vstack([frame.elements, *of_plates])


def _plates(frame: Frame) -> tuple[Array, Array]:
    return frame.triangles, frame.quadrilaterals


def _check_numbers(frame: Frame) -> None:
    count = len(frame.points)
    used = np.concatenate([frame.elements.ravel(), *(nodes.ravel() for nodes in _plates(frame))])
    if not used.size:
        raise InputError("the frame has no elements; build one with polyline(...) or panel(...)")
    if used.min() < 0 or used.max() >= count:
        raise InputError(f"elements refer to nodes {used.min()} to {used.max()}, but there are {count} nodes")
    if not np.isin(frame.member_of, range(len(frame.members))).all():
        raise InputError(f"every element must have one of the {len(frame.members)} members of the frame")
    if not np.isin(frame.shell_of, range(len(frame.shells))).all():
        raise InputError(f"every plate must have one of the {len(frame.shells)} shells of the frame")
    unused = np.setdiff1d(np.arange(count), used)
    if unused.size:
        raise InputError(f"{unused.size} nodes belong to no element, the first being node {unused[0]}; remove them")


def _check_groups(frame: Frame) -> None:
    for name, nodes in frame.node_groups.items():
        if not len(nodes) or np.min(nodes) < 0 or np.max(nodes) >= len(frame.points):
            raise InputError(f"node group {name!r} is empty or names nodes that the frame does not have")


def _check_repeated(nodes: Array) -> None:
    _, index, counts = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        element = int(index[counts > 1].min())
        raise InputError(
            f"{np.sum(counts > 1)} elements are there more than once, the first being element {element} between nodes "
            f"{nodes[element].tolist()}: remove the copies"
        )


def _check_coincident(frame: Frame) -> None:
    """The nodes of one beam element at the same place are left to the element, which says more."""
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
    count, pairs = len(frame.points), _pairs(frame)
    graph = sp.coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    parts, labels = connected_components(graph, directed=False)
    if parts > 1:
        places = ", ".join(str(frame.points[np.argmax(labels == part)].tolist()) for part in range(min(parts, 5)))
        raise InputError(
            f"the frame has {parts} parts that nothing connects, with nodes at {places} m: a body is one piece; let "
            "members share nodes (joined(...) merges nodes at the same place), or make each part a body of its own"
        )


# ---- what lies on one another -------------------------------------------------------------------------------------------


def overlap_doubts(frame: Frame) -> list[str]:
    """Notes on members that lie on one another without having the same nodes: beams that leave a node the same way,
    plates on the same side of an edge."""
    return [
        f"{len(found)} pairs of {what} lie on one another, the first at {_at(found[0])}: each counts, with mass and "
        "stiffness; remove one where it is meant once"
        for what, found in (("beams", _doubled_beams(frame)), ("plates", _doubled_plates(frame)))
        if found
    ]


def joint_doubts(frame: Frame) -> list[str]:
    """Notes on nodes that lie on beams or plates without being theirs, where parts look joined and are not."""
    a, b, c, d = frame.quadrilaterals.T
    triangles = np.vstack([frame.triangles, np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    kinds = [nodes for nodes in (frame.elements, *_plates(frame)) if len(nodes)]
    on_edges = nodes_on_edges(frame.points, kinds)
    loose = np.union1d(on_edges, nodes_on_faces(frame.points, triangles, np.arange(len(frame.points))))
    return [
        f"at {len(loose)} nodes nothing joins what looks joined, the first at {_at(frame.points[first])}: they lie on beams "
        "or plates that have no node there; give both the same nodes, as by as many elements along a common edge"
        for first in loose[:1]
    ]


def thickness_doubts(frame: Frame) -> list[str]:
    """Notes on sheets too thick for plates and on sections deeper than the frame is long: most likely in millimetres."""
    across = _across(frame, frame.elements.ravel())
    deep = {f"section {of.section.name}": depth for of in frame.members if (depth := _depth(of.section)) > across}
    sheets = [_sheet(frame, k) for k in range(len(frame.shells))]
    thick = [(of, size) for of, size in zip(frame.shells, sheets, strict=True) if of.thickness > _THICK * size]
    return [
        *(
            f"{name} is {depth:.3g} m deep and the beams of the frame reach {across:.3g} m: are the sizes of the section in "
            "millimetres? They are in metres"
            for name, depth in deep.items()
        ),
        *(
            f"a sheet of {of.material.name} is {of.thickness:.3g} m thick and {size:.3g} m across, too thick for a plate: is "
            "its thickness in millimetres? It is in metres; mesh a thick part with solids"
            for of, size in thick
        ),
    ]


def _depth(section: Section) -> float:
    """The height [m] of a rectangle with the area and the larger second moment of a section."""
    return math.sqrt(12 * max(section.Iy, section.Iz) / section.A)


def _sheet(frame: Frame, shell: int) -> float:
    """The size [m] of the plates of a shell; inf where there are none."""
    three = len(frame.triangles)
    parts = (frame.triangles[frame.shell_of[:three] == shell], frame.quadrilaterals[frame.shell_of[three:] == shell])
    return _across(frame, np.concatenate([part.ravel() for part in parts]))


def _across(frame: Frame, nodes: Array) -> float:
    return float(np.linalg.norm(np.ptp(frame.points[nodes], axis=0))) if nodes.size else math.inf


def _doubled_beams(frame: Frame) -> list[Array]:
    """A place (3,) for each pair, in the middle of the shorter one; those with different offsets lie side by side."""
    ways = frame.points[frame.elements[:, 1]] - frame.points[frame.elements[:, 0]]
    lengths = np.linalg.norm(ways, axis=1)
    unit, offset = ways / lengths[:, None], [frame.members[k].section.offset for k in frame.member_of]
    leaving = [
        ((node,), (e, sign * unit[e]))
        for sign, ends in ((1.0, frame.elements[:, 0]), (-1.0, frame.elements[:, 1]))
        for e, node in enumerate(ends.tolist())
    ]
    pairs = {pair for pair, _ in _same_way(leaving) if offset[pair[0]] == offset[pair[1]]}
    return [frame.points[frame.elements[min(pair, key=lambda e: lengths[e])]].mean(axis=0) for pair in sorted(pairs)]


def _doubled_plates(frame: Frame) -> list[Array]:
    """A place (3,) for each pair, in the middle of a common edge."""
    places = {}
    plates = [*frame.triangles.tolist(), *frame.quadrilaterals.tolist()]
    leaving = [
        (
            (min(edge), max(edge)),
            (e, _inward(frame.points[edge[0]], frame.points[edge[1]], frame.points[nodes].mean(axis=0))),
        )
        for e, nodes in enumerate(plates)
        for edge in zip(nodes, (*nodes[1:], nodes[0]), strict=True)
    ]
    for pair, edge in _same_way(leaving):
        places[pair] = frame.points[list(edge)].mean(axis=0)
    return [places[pair] for pair in sorted(places)]


def _same_way(leaving: Iterable[tuple[Place, Seen]]) -> Iterator[tuple[tuple[int, int], Place]]:
    """Pairs of elements, and where they leave the same way."""
    found: dict[Place, list[Seen]] = {}
    for place, seen in leaving:
        found.setdefault(place, []).append(seen)
    for place, here in found.items():
        for (e, one), (f, other) in combinations(here, 2):
            if one @ other > _SAME_WAY:
                yield (min(e, f), max(e, f)), place


def _inward(a: Array, b: Array, centre: Array) -> Array:
    """(3,) from the edge between a and b to the centre, across the edge, of length one."""
    along = (b - a) / np.linalg.norm(b - a)
    across = (centre - a) - ((centre - a) @ along) * along
    return np.asarray(across / np.linalg.norm(across))


def _at(point: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"
