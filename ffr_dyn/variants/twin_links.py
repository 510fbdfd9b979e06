"""Hinges of a plane on one line, and links between the same two lines, made equal where they are a hair off.

The left and the right arm of a loader turn about one line and carry its bucket on another. That fixes the distance of the
lines twice: arms of which one is a hair longer do not turn, as those are that two meshes make.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from itertools import combinations

import numpy as np
from scipy.spatial.distance import pdist, squareform

from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Scene, marker_number, markers
from ffr_dyn.variants.in_line import ROUNDING, TOLD, Place, places_of, with_places
from ffr_prep.common.arrays import Array

At = dict[
    tuple[str, int], Array
]  # by joint and number of the body, a vector (3,) across the normal, in the body's axes


def with_equal_twins(
    scene: Scene, hinges: list[Joint], normals: dict[int, Array], near: float
) -> tuple[Scene, list[str]]:
    """The scene with hinges about the normals of one plane where others have them, itself where none is off; and which were
    moved by so much that it is told.

    normals : by number of the body, (3,) in its axes;  near : [m] what is a hair
    """
    at = {
        (joint.name, b): place.point - normals[b] * (normals[b] @ place.point)
        for joint in hinges
        for b, place in places_of(scene, joint).items()
    }
    lines = _lines(at, near)
    if len(set(lines.values())) == len(lines):
        return scene, []
    moves = _moves(at, lines, own := _own(scene, hinges), near)
    return _moved(scene, hinges, moves) if own.issuperset(moves) else (scene, [])


def _moves(at: At, lines: dict[str, str], own: set[tuple[str, int]], near: float) -> At:
    """How hinges move onto their lines, and links then become equally long; none where a shaft has bearings out of line."""
    moves = At()
    for key, move in _onto_lines(at, lines):
        if float(np.linalg.norm(move)) > near:
            return At()
        moves[key] = move
    there = {key: place + moves.get(key, 0.0) for key, place in at.items()}
    for keys, move in _to_equal_length(there, lines, own, near):
        if moves.keys().isdisjoint(keys):
            moves |= dict.fromkeys(keys, move)
    return {
        key: move for key, move in moves.items() if np.abs(move).max() > ROUNDING * float(np.linalg.norm(there[key]))
    }


def _lines(at: At, near: float) -> dict[str, str]:
    """By name of the hinge, the first one of those on its line: hinges on one line of a body, and so on from body to body."""
    line = {name: name for name, _ in at}
    for keys in _by_body(at).values():
        close = np.argwhere(np.triu(squareform(pdist(np.array([at[key] for key in keys]))) <= near, 1))
        for one, other in close.tolist():
            old, new = line[keys[other][0]], line[keys[one][0]]
            line = {name: new if first == old else first for name, first in line.items()} if old != new else line
    return line


def _by_body(at: At) -> dict[int, list[tuple[str, int]]]:
    keys = defaultdict[int, list[tuple[str, int]]](list)
    for key in at:
        keys[key[1]].append(key)
    return keys


def _own(scene: Scene, hinges: list[Joint]) -> set[tuple[str, int]]:
    """Places of hinges that no other joint has."""
    table, used = markers(scene), Counter(end for joint in scene.joints for end in (joint.i, joint.j))
    ends = [(joint.name, end) for joint in hinges for end in (joint.i, joint.j)]
    return {(name, table[marker_number(scene, end)][0]) for name, end in ends if used[end] == 1}


def _onto_lines(at: At, lines: dict[str, str]) -> Iterator[tuple[tuple[str, int], Array]]:
    """The way of every hinge of a body to the first one that the body has on its line."""
    for keys in _by_body(at).values():
        first = dict[str, Array]()
        for key in keys:
            base = first.setdefault(lines[key[0]], at[key])
            if base is not at[key]:
                yield key, base - at[key]


def _to_equal_length(
    at: At, lines: dict[str, str], own: set[tuple[str, int]], near: float
) -> Iterator[tuple[list[tuple[str, int]], Array]]:
    """Of bodies between the same two lines, how hinges on one of them move where the body is as long as the first."""
    lengths = dict[tuple[str, str], float]()
    for keys in _by_body(at).values():
        on = defaultdict[str, list[tuple[str, int]]](list)
        for key in keys:
            on[lines[key[0]]].append(key)
        for one, other in combinations(sorted(on), 2):
            way = at[on[other][0]] - at[on[one][0]]
            length = float(np.linalg.norm(way))
            longer = lengths.setdefault((one, other), length) - length
            if 0.0 < abs(longer) <= near:
                moved, sign = (on[other], 1.0) if own.issuperset(on[other]) else (on[one], -1.0)
                yield moved, sign * longer / length * way


def _moved(scene: Scene, hinges: list[Joint], moves: At) -> tuple[Scene, list[str]]:
    notes = list[str]()
    for joint in hinges:
        places = places_of(scene, joint)
        by = {b: move for (name, b), move in moves.items() if name == joint.name}
        if by:
            moved = {b: Place(place.point + by.get(b, 0.0), place.frame) for b, place in places.items()}
            scene = with_places(scene, joint, moved)
            off = max(float(np.linalg.norm(move)) for move in by.values())
            notes += [
                f"joint {joint.name!r} is put where the others have it that turn about the same lines, which it was "
                f"{off:.2g} m off"
            ] * (off > TOLD)
    return scene, notes
