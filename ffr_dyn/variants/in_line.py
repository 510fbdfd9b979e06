"""Joints between the same two rigid bodies brought onto one line, or to one distance, that they are a hair off.

A rigid shaft in two bearings turns if both are on one line, and is locked if they are a hair off it: as places are that a
mesh leaves, or that are given with six digits. The first joint of two bodies stays; what the others fix again is put where
that one has it, on either body, where only a hair is missing. What is farther off stays, and does not close.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.functions.rotation import cross
from ffr_dyn.scene.joints import F, H, Joint, frames
from ffr_dyn.scene.scene import Scene, altered, marker_number, markers
from ffr_prep.body import FlexibleBody, remembered
from ffr_prep.common.arrays import Array

HAIR = 1e-5  # of the farthest places of two joints, or rad
ROUNDING = 1e-14  # the same, that is left
TOLD = 1e-6  # m, from where it is told that a joint was moved
HINGES, RAIL, BALL = ("revolute", "cylindrical"), "translational", "spherical"
NOT_ALONG = ("revolute", BALL)  # kinds that let no body move along the axis


@dataclass(frozen=True)
class Place:
    """A joint on one of its bodies, in the axes of that: the point (3,) [m], the frame (3, 3)."""

    point: Array
    frame: Array


Places = dict[int, Place]  # by number of the body


def in_line(scene: Scene) -> tuple[Scene, list[str]]:
    """The scene with joints that were a hair off, itself where none is; and which were moved by so much that it is told."""
    notes = list[str]()
    for base, others in _on_same_bodies(scene):
        for joint in others:
            moved, off = _put(scene, base, joint)
            scene = scene if moved is None else moved
            if moved is not None and off > TOLD:
                notes.append(
                    f"joint {joint.name!r} is put where joint {base.name!r} of the same rigid bodies lets it be, which it "
                    f"was {off:.2g} m off"
                )
    return scene, notes


def _on_same_bodies(scene: Scene) -> Iterator[tuple[Joint, list[Joint]]]:
    """The first rail or hinge of every two rigid bodies, and the other joints of these that may fix the same again."""
    found = [joint for joint in scene.joints if joint.kind in (*HINGES, RAIL, BALL)]
    if len(found) < 2:
        return
    table = markers(scene)
    rigid = [not body.model.n for body in scene.bodies] + [True]
    pairs = [tuple(sorted(table[marker_number(scene, end)][0] for end in (joint.i, joint.j))) for joint in found]
    for pair in dict.fromkeys(pairs):
        joints = [joint for joint, of in zip(found, pairs, strict=True) if of == pair]
        base = min(joints, key=lambda joint: (RAIL, *HINGES, BALL).index(joint.kind))
        if len(joints) > 1 and base.kind != BALL and all(rigid[b] for b in pair):
            yield base, [joint for joint in joints if joint is not base]


def _put(scene: Scene, base: Joint, joint: Joint) -> tuple[Scene | None, float]:
    """The scene with a joint where the base lets it be, and how far it was off [m]; None where that is none, or no hair."""
    first, now = places_of(scene, base), places_of(scene, joint)
    points = _points(base, joint, first, now)
    axes = {b: now[b].frame[:, H] for b in first}
    if joint.kind != BALL:
        axes = {b: _along(first[b].frame[:, H], axis) for b, axis in axes.items()}
    length = max(float(np.linalg.norm(now[b].point - first[b].point)) for b in first)
    shift = max(float(np.linalg.norm(points[b] - now[b].point)) for b in first)
    turn = max(float(np.linalg.norm(axes[b] - now[b].frame[:, H])) for b in first)
    off = max(shift, length * turn)
    if not ROUNDING * length < off <= HAIR * length:
        return None, off
    frames_of = {b: now[b].frame if joint.kind == BALL else _frame(now[b].frame, axes[b]) for b in first}
    wanted = {b: Place(points[b], frames_of[b]) for b in first}
    return with_places(scene, joint, wanted), off


def places_of(scene: Scene, joint: Joint) -> Places:
    """Of the joint as the scene has it, by number of the body, that of the ground the last."""
    table, found = markers(scene), Places()
    for end, frame in zip((joint.i, joint.j), frames(joint), strict=True):
        b, _, point = table[marker_number(scene, end)]
        at = scene.ground[point] if b == len(scene.bodies) else scene.bodies[b].model.interface(point).position
        found[b] = Place(np.asarray(at), frame)
    return found


def _points(base: Joint, joint: Joint, first: Places, now: Places) -> dict[int, Array]:
    """(3,) where the point of the joint is to be on either body."""
    a, b = first
    seen = {k: first[k].frame.T @ (now[k].point - first[k].point) for k in (a, b)}  # along f, g, h of the base
    if base.kind == RAIL:
        seen[b][:H] = seen[a][:H]
    else:
        seen[a][:H] = seen[b][:H] = 0.0
    if base.kind in NOT_ALONG and joint.kind in NOT_ALONG:
        seen[b][H] = seen[a][H]
    return {k: first[k].point + first[k].frame @ seen[k] for k in (a, b)}


def _along(base: Array, axis: Array) -> Array:
    """(3,) the axis of the base, the way that an axis goes."""
    return np.copysign(1.0, base @ axis) * base


def _frame(frame: Array, h: Array) -> Array:
    """(3, 3) the frame with an axis that is a hair off its own."""
    f = frame[:, F] - h * (h @ frame[:, F])
    f /= np.linalg.norm(f)
    return np.column_stack([f, cross(h, f), h])


def with_places(scene: Scene, joint: Joint, wanted: Places) -> Scene:
    """The scene with a joint at other places of its bodies, itself where it has them."""
    now, table = places_of(scene, joint), markers(scene)
    ends = [table[marker_number(scene, end)] for end in (joint.i, joint.j)]
    bodies, ground, changes = list(scene.bodies), dict(scene.ground), dict[str, Any]()
    for b, _, point in ends:
        if np.array_equal(now[b].point, wanted[b].point):
            continue
        if b == len(bodies):
            ground[point] = wanted[b].point
            changes["ground"] = ground
        else:
            bodies[b] = altered(bodies[b], model=_moved(bodies[b].model, point, wanted[b].point))
            changes["bodies"] = tuple(bodies)
    if any(not np.array_equal(now[b].frame, wanted[b].frame) for b, _, _ in ends):
        i, j = (wanted[b].frame for b, _, _ in ends)
        turned = replace(joint, axis=i, axis_j=j)
        changes["joints"] = tuple(turned if other.name == joint.name else other for other in scene.joints)
    return altered(scene, **changes) if changes else scene


def _moved(model: FlexibleBody, name: str, point: Array) -> FlexibleBody:
    """A body with one of its places elsewhere, a hair from where it was."""

    def make() -> FlexibleBody:
        moved = (replace(i, position=point) if i.name == name else i for i in model.interfaces)
        return replace(model, interfaces=tuple(moved))

    return remembered(model, ("moved", name, *point.tolist()), make)
