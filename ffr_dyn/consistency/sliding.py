"""Joints that slide along a body that bends: their line is the straight axis of one interface, not the bent body."""

from __future__ import annotations

import numpy as np

from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.scene import Body, Scene, marker_number, markers
from ffr_prep.common.arrays import Array

ALONG = ("translational", "cylindrical", "point-on-line", "screw")
OF_I = "point-on-line"  # its line is that of i alone: j is a point, whatever way its body lies
NEAR, FAR = 0.1, 0.3  # of the size of a body: how near to the line it lies, how far along it from the interface


def sliding_notes(scene: Scene) -> list[str]:
    """Notes on sliding joints whose line runs along a flexible body."""
    notes = []
    for joint in scene.joints:
        lines = list(zip((joint.i, joint.j), frames(joint), strict=True)) if joint.kind in ALONG else []
        for marker, frame in lines[:1] if joint.kind == OF_I else lines:
            b, _, point = markers(scene)[marker_number(scene, marker)]
            if b < len(scene.bodies) and _runs_along(scene.bodies[b], point, frame[:, 2]):
                notes.append(_told(joint, scene.bodies[b], point))
    return notes


def _runs_along(body: Body, point: str, axis: Array) -> bool:
    """Whether points of a flexible body lie along a line from an interface, `axis` (3,) in body axes."""
    model = body.model
    if not model.n or not model.size:
        return False
    known = [i.position for i in model.interfaces] + ([] if model.surface is None else list(model.surface.points))
    away = np.array(known) - model.interface(point).position
    along = away @ axis
    beside = np.linalg.norm(away - along[:, None] * axis, axis=1)
    return bool(((np.abs(along) > FAR * model.size) & (beside < NEAR * model.size)).any())


def _told(joint: Joint, body: Body, point: str) -> str:
    return (
        f"joint {joint.name!r} slides along body {body.name!r} by the straight axis of its interface {point!r}: how the body "
        "bends under the slider is not in it; set the stroke in parts with interfaces there, or keep it short beside the body"
    )
