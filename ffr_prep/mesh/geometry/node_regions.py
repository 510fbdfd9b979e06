"""Which nodes a region means in a model that has nodes but no faces: frames, matrices from other programs.

Names, sums, ranges and patterns are of groups of nodes; of the queries of `ffr_prep.mesh.geometry.region_words` there are
"nearest x,y,z", "plane z=0" (also "normal=... at ...") and "cylinder r=... axis=... at ...", which mean the nodes that lie
there. Numbers without a unit are metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice
from ffr_prep.mesh.geometry.region_words import Names, Query, parsed

_ON = 1e-5  # how far nodes may lie off, of the size of the model


def nodes_of_region(points: Array, groups: Mapping[str, Array], region: str, unknown: str, hint: str = "") -> Array:
    """(m,) nodes of a region, ascending, among points (N, 3) [m].

    unknown : what is said of a name that there is not, such as "the frame has no group of nodes"
    Raises InputError for a region that means nothing.
    """
    if region in groups:
        return np.unique(groups[region])
    found = [
        _by_query(points, term) if isinstance(term, Query) else _by_name(groups, term, unknown, hint)
        for term in parsed(region)
    ]
    return np.unique(np.concatenate(found))


def _by_name(groups: Mapping[str, Array], term: Names, unknown: str, hint: str) -> Array:
    names = [name for name in groups if fnmatchcase(name, term.text)] if term.pattern else list(term.names)
    missing = [name for name in names if name not in groups] or ([] if names else [term.text])
    if missing:
        raise InputError(f"{unknown} {missing[0]!r}; {choice(missing[0], groups)}{hint}")
    return np.concatenate([groups[name] for name in names])


def _by_query(points: Array, query: Query) -> Array:
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if query.text.startswith("nearest"):
        return _nearest(points, query, size)
    off = _distances(points, query)
    if off is None or query.near is not None:
        raise InputError(
            f"{query.text!r}: this model has nodes and no faces; regions are groups of nodes, 'nearest x,y,z', 'plane z=0', "
            "or 'cylinder r=0.006 axis=z at 0,0,0'"
        )
    on = np.flatnonzero(off <= _ON * size)
    if not on.size:
        k = int(np.argmin(off))
        raise InputError(f"{query.text!r} finds no node; the nearest is at {points[k].tolist()} m, {off[k]:.3g} m away")
    return on


def _nearest(points: Array, query: Query, size: float) -> Array:
    distance = np.linalg.norm(points - np.array(query.near), axis=1)
    near = np.flatnonzero(distance <= distance.min() + _ON * size)
    if near.size > 1 or distance.min() > size:
        shown = ", ".join(str(tuple(points[k].tolist())) for k in near[:4])
        why = f"{near.size} nodes are equally near" if near.size > 1 else "it is far from all nodes"
        raise InputError(f"{query.text!r}: {why}: {shown} m; places are in metres")
    return near


def _distances(points: Array, query: Query) -> Array | None:
    """How far the nodes lie from a plane or a cylinder; None where it is not said which."""
    if query.kind == "plane" and query.through is not None:
        axis, place = query.through
        return np.abs(points[:, axis] - place)
    direction = query.normal if query.kind == "plane" else query.axis
    if query.kind not in ("plane", "cylinder") or direction is None or query.at is None:
        return None
    unit, arms = np.array(direction) / np.linalg.norm(direction), points - np.array(query.at)
    if query.kind == "plane":
        return np.abs(arms @ unit)
    return None if query.radius is None else np.abs(np.linalg.norm(np.cross(arms, unit), axis=1) - query.radius)
