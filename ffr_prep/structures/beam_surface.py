"""The surface that is drawn for a frame of beams: the outlines of the sections, swept along their elements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.structures.beams import Beams, field, picked, undeformed
from ffr_prep.structures.frame import Frame
from ffr_prep.structures.sections import outline_shear

_STATIONS = 5

Moved = Callable[[Array, Array, Array], Array]


def swept_surface(frame: Frame, elements: Beams, moved: Moved) -> Surface:
    """The boundary of all elements with fields of displacement at its points.

    moved : of some elements, xi (Q,) and across (E, Q, 2), the fields (E, Q, 3, n) there, in body axes
    """
    points, triangles, shapes, count = [], [], [], 0
    for own, outline, _ in prisms(frame):
        xi, across = stations(outline, len(own))
        first = count + len(xi) * np.arange(len(own))
        points.append(undeformed(picked(elements, own), xi, across).reshape(-1, 3))
        triangles.append((first[:, None, None] + _prism(len(outline))).reshape(-1, 3))
        at_points = moved(own, xi, across)
        shapes.append(at_points.reshape(len(points[-1]), 3, at_points.shape[-1]))
        count += len(points[-1])
    return Surface(np.vstack(points), np.vstack(triangles), np.vstack(shapes))


def moved_linearly(elements: Beams, nodal: Array) -> Moved:
    """Translation of the axis and rotation of the section, of the coordinates nodal (E, 12, n) in body axes."""
    return lambda own, xi, across: field(picked(elements, own), xi, across) @ nodal[own][:, None]


def prisms(frame: Frame) -> list[tuple[Array, Array, Array]]:
    """The elements of each member with each polygon (P, 2) of its section and the shear (P, 3, 2) at its corners."""
    of_members = [np.flatnonzero(frame.member_of == k) for k in range(len(frame.members))]
    return [
        (own, np.array(polygon), np.array(shear))
        for own, member in zip(of_members, frame.members, strict=True)
        for polygon, shear in zip(member.section.outline, outline_shear(member.section), strict=True)
        if own.size
    ]


def stations(outline: Array, elements: int) -> tuple[Array, Array]:
    """xi (Q,) and the corners (E, Q, 2) of the outline (P, 2) at each of the stations, Q = stations P."""
    xi = np.repeat(np.linspace(0.0, 1.0, _STATIONS), len(outline))
    return xi, np.broadcast_to(np.tile(outline, (_STATIONS, 1)), (elements, len(xi), 2))


def _prism(corners: int) -> Array:
    """(T, 3) triangles of the prism over an outline, seen from outside counter-clockwise, with both ends closed."""
    here = np.arange(corners)
    following = np.roll(here, -1)
    sides = []
    for station in range(_STATIONS - 1):
        a, b = station * corners, (station + 1) * corners
        sides += [
            np.stack([a + here, a + following, b + following], 1),
            np.stack([a + here, b + following, b + here], 1),
        ]
    lid = np.stack([np.zeros(corners - 2, np.int64), np.arange(1, corners - 1), np.arange(2, corners)], 1)
    return np.vstack([*sides, lid[:, ::-1], lid + (_STATIONS - 1) * corners])
