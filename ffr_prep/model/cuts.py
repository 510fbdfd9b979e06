"""Where a slender body is cut into parts, and which of its elements, nodes and interfaces each part has.

A body is cut between elements: an element belongs to the part in which its centre lies, and neighbouring parts share the
nodes at their cut. A node that parts share moves as one piece with the others of its cut (a rigid interface, RBE2) and is on
no interface of the user's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ffr_prep.body import cut_names
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.in_words import vector_in_words
from ffr_prep.model.coupled import InterfaceRegion

Vector = tuple[float, float, float]

_ALONG = np.cos(np.radians(5.0))  # a long axis this near to an axis of the body is that axis
_TIE = 1e-6  # of the length: an element whose centre lies on a cut is before it
_STRAY = 0.1  # of the elements of a part: a smaller piece that hangs on the neighbour belongs to the neighbour


@dataclass(frozen=True)
class CutPlane:
    """A plane through a point [m]; the next part lies on the side to which the normal points.

    Raises InputError for three numbers that are none, and a normal without a direction.

    >>> plane = fp.CutPlane((0.5, 0, 0), (1, 0, 0))
    """

    point: Vector
    normal: Vector

    def __post_init__(self) -> None:
        for key in ("point", "normal"):
            value = np.asarray(getattr(self, key), float)
            if value.shape != (3,) or not np.isfinite(value).all() or (key == "normal" and not value.any()):
                raise InputError(f"cut plane: {key} is {getattr(self, key)!r}; give three numbers (x, y, z)")


Cuts = int | Sequence[float | CutPlane]


@dataclass(frozen=True)
class Division:
    """Elements and nodes by part.

    part   : (E,) number of the part of each element, from 0
    nodes  : of each part, ascending
    shared : at each cut, the nodes that the parts before and after it share, ascending
    cuts   : where each cut is, in words
    """

    part: Array
    nodes: tuple[Array, ...]
    shared: tuple[Array, ...]
    cuts: tuple[str, ...]


# ---- planes -------------------------------------------------------------------------------------------------------


def planes_of(cuts: Cuts, points: Array) -> list[CutPlane]:
    """The planes that cut the body with these nodes (N, 3) [m].

    cuts : the number of parts of equal length along the long axis; or stations, distances [m] along it from the end where its
           coordinate is least, and planes, in the order of the parts

    Raises InputError for what gives less than two parts, and for stations beyond the body.
    """
    axis = long_axis(points)
    along = points @ axis
    start, length = float(along.min()), float(np.ptp(along))
    given = _stations(cuts, length)
    middle = points.mean(axis=0)

    def plane(station: float) -> CutPlane:
        at = middle + (start + station + _TIE * length - middle @ axis) * axis
        return CutPlane(tuple(at.tolist()), tuple(axis.tolist()))

    return [one if isinstance(one, CutPlane) else plane(one) for one in given]


def _stations(cuts: Cuts, length: float) -> Sequence[float | CutPlane]:
    if isinstance(cuts, (int, np.integer)) and not isinstance(cuts, bool):
        if cuts < 2:
            raise InputError(f"parts = {cuts}: a body is cut into two or more parts")
        return [length * k / cuts for k in range(1, cuts)]
    if isinstance(cuts, (str, bool)) or not isinstance(cuts, Sequence) or not len(cuts):
        raise InputError(
            f"parts = {cuts!r}: give a number of parts, or stations [m] along the body, such as [0.1, 0.25]"
        )
    numbers = [0.0, *(float(one) for one in cuts if not isinstance(one, CutPlane)), length]
    if any(not one < other for one, other in pairwise(numbers)):
        raise InputError(
            f"parts = {list(cuts)}: stations are distances from the end of the body along its long axis; they must rise "
            f"from 0 to its length, {length:.6g} m"
        )
    return cuts


def long_axis(points: Array) -> Array:
    """(3,) unit vector of the principal axis along which the points (N, 3) reach farthest, its largest component positive."""
    offsets = points - points.mean(axis=0)
    axes = np.linalg.eigh(offsets.T @ offsets)[1][
        :, ::-1
    ]  # not simply the first: a fine mesh at one end turns it there
    axis = axes[:, np.argmax(np.ptp(points @ axes, axis=0))]
    largest = int(np.argmax(np.abs(axis)))
    axis = np.eye(3)[largest] if abs(axis[largest]) > _ALONG else axis * np.sign(axis[largest])
    return np.asarray(axis)


# ---- division -----------------------------------------------------------------------------------------------------


def divided(
    cuts: Cuts, points: Array, blocks: Sequence[Array], bonds: Array, interfaces: Sequence[InterfaceRegion]
) -> Division:
    """The elements with nodes `blocks` (E, k), one block after the other, divided into parts.

    bonds : (P, 2) pairs of elements that hold together

    Raises InputError for planes that leave a part without elements or in several pieces, for parts that do not follow one
    another, and for interfaces called like those of a cut.
    """
    count = sum(map(len, blocks))
    if isinstance(cuts, int) and cuts > count:
        raise InputError(f"parts = {cuts}: the model has {count} elements, and each part one at least; ask for fewer")
    planes = planes_of(cuts, points)
    centres = np.concatenate([points[nodes].mean(axis=1) for nodes in blocks])
    beyond = [(centres - plane.point) @ np.asarray(plane.normal) > 0 for plane in planes]
    part = _with_strays_moved(np.sum(beyond, axis=0), len(planes) + 1, bonds)
    of_parts = [
        [nodes[own] for nodes, own in zip(blocks, _by_block(part == k, blocks), strict=True)] for k in _each(planes)
    ]
    nodes = tuple(np.unique(np.concatenate([one.ravel() for one in own])) for own in of_parts)
    words = tuple(f"through {vector_in_words(np.asarray(plane.point))} m" for plane in planes)
    division = Division(part, nodes, tuple(np.intersect1d(a, b) for a, b in pairwise(nodes)), words)
    _check(division)
    names = {name for k in range(1, len(nodes)) for name in cut_names(k)}
    for interface in interfaces:
        if interface.name in names:
            raise InputError(f"interface {interface.name!r}: a body in parts calls one at a cut so; give another name")
    return division


def _each(planes: Sequence[CutPlane]) -> range:
    return range(len(planes) + 1)


def _by_block(chosen: Array, blocks: Sequence[Array]) -> list[Array]:
    return np.split(chosen, np.cumsum([len(nodes) for nodes in blocks])[:-1])


def _with_strays_moved(part: Array, count: int, bonds: Array) -> Array:
    """Small pieces of a part that only its neighbour holds, given to the neighbour: a cut follows element sides."""
    for _ in range(count):
        pieces = _pieces(part, bonds)
        sizes = np.bincount(pieces)
        of_piece = np.zeros(sizes.size, int)
        of_piece[pieces] = part
        largest = np.zeros(count, int)
        np.maximum.at(largest, of_piece, sizes)
        strays = np.flatnonzero(sizes < _STRAY * largest[of_piece])
        if not strays.size:
            break
        part = part.copy()
        for stray in strays:
            inside = (pieces == stray)[bonds]
            outer = bonds[:, ::-1][inside & ~inside[:, ::-1]]
            part[pieces == stray] = np.bincount(part[outer]).argmax()
    pieces = _pieces(part, bonds)
    for k in range(count):
        found = np.unique(pieces[part == k]).size
        if found != 1:
            state = f"falls into {found} pieces" if found else "has no elements"
            raise InputError(
                f"part {k + 1} of {count} {state}: cut elsewhere, by stations or planes (fp.CutPlane; in a structure file "
                "point and normal), or into fewer parts"
            )
    return part


def _pieces(part: Array, bonds: Array) -> Array:
    """(E,) number of the piece of each element, pieces being held together within a part."""
    within = bonds[part[bonds[:, 0]] == part[bonds[:, 1]]]
    graph = sp.coo_array((np.ones(len(within), np.int8), (within[:, 0], within[:, 1])), shape=(part.size, part.size))
    return np.asarray(connected_components(graph.tocsr(), directed=False)[1])


def _check(division: Division) -> None:
    for k, l in combinations(range(len(division.nodes)), 2):  # noqa: E741
        if l > k + 1 and np.intersect1d(division.nodes[k], division.nodes[l]).size:
            raise InputError(f"parts {k + 1} and {l + 1} touch each other: cut into fewer parts, or with other planes")


# ---- interfaces ---------------------------------------------------------------------------------------------------


def interfaces_of_parts(
    division: Division, interfaces: Sequence[InterfaceRegion], nodes_of: Callable[[InterfaceRegion], Array]
) -> list[tuple[InterfaceRegion, ...]]:
    """The interfaces of each part: those of the whole that lie in it, then those at its cuts, each at a group of its name.

    Raises InputError for an interface that reaches into two parts.
    """
    count = len(division.nodes)
    found: list[list[InterfaceRegion]] = [[] for _ in range(count)]
    for interface in interfaces:
        found[_owner(division, interface, nodes_of(interface))].append(interface)
    for k in range(count):
        found[k] += [InterfaceRegion(name) for name in groups_at_cuts(division, k)]
    return [tuple(of_part) for of_part in found]


def groups_at_cuts(division: Division, k: int) -> Mapping[str, Array]:
    """The nodes of part k, from 0, at its cuts, by the name of the interface there."""
    before = {cut_names(k)[1]: division.shared[k - 1]} if k else {}
    after = {cut_names(k + 1)[0]: division.shared[k]} if k < len(division.shared) else {}
    return {**before, **after}


def _owner(division: Division, interface: InterfaceRegion, nodes: Array) -> int:
    for k, own in enumerate(division.nodes):
        touched = [c for c, shared in enumerate(division.shared) if np.isin(nodes, shared).any()]
        if np.isin(nodes, own).all() and not touched:
            return k
    c = touched[0] if touched else next(c for c, own in enumerate(division.nodes) if np.isin(nodes, own).any())
    raise InputError(
        f"interface {interface.name!r} lies in parts {c + 1} and {c + 2}: move the cut between them, "
        f"{division.cuts[c]}, off its region"
    )
