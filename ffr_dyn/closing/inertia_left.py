"""The inertia that bodies need: against every rigid motion that the scene leaves them.

Bodies from files of other programs may lack it (`ffr_prep.body.immovable`), or have it in one plane alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.scene import Body, Scene, body_normal
from ffr_prep.body import FlexibleBody, immovable, remembered
from ffr_prep.common.errors import InputError

_AXES = "xyz"
_TRACE = 1e-6  # of the moments of a body: what is added about an axis that has none


def require_inertia(scene: Scene, place: Layout) -> None:
    """InputError for a body without inertia against a motion that it has in a scene whose plane is decided."""
    for b, body in enumerate(scene.bodies):
        _require_plane(scene, body)
        if body.dropped:  # `ffr_dyn.consistency.dropped_terms` looks at these
            continue
        if motion := _immovable(body.model, tuple(place.active(b))):
            flexible = ", keep fewer modes, or, where it is held fixed, import it with --held" if body.model.n else ""
            raise InputError(
                f"body {body.name!r} cannot move: it has no inertia left for {motion}; give it mass and inertia about all "
                f"axes{flexible}"
            )


def with_traces(scene: Scene) -> Scene:
    """The scene with a trace of inertia of its rigid and its planar bodies about axes that have none.

    What is planar runs without it, and is looked at in space with it: no moment acts about such an axis. Where no body lacks
    any the scene is as it is.
    """
    bodies = tuple(_with_trace(body) for body in scene.bodies)
    same = all(traced is body for traced, body in zip(bodies, scene.bodies, strict=True))
    return scene if same else replace(scene, bodies=bodies)


def _with_trace(body: Body) -> Body:
    model = body.model
    if "plane" not in model.provenance and (model.n or not _immovable(model, tuple(range(6)))):
        return body
    traced = model.rr_dm + _TRACE * float(np.trace(model.rr_dm)) * np.eye(3)
    said = {key: value for key, value in model.provenance.items() if key != "plane"}
    return replace(body, model=replace(model, rr_dm=traced, provenance=said))


def _immovable(model: FlexibleBody, active: tuple[int, ...]) -> str:
    return remembered(model, ("immovable", active), lambda: immovable(model, active))


def _require_plane(scene: Scene, body: Body) -> None:
    """A planar model moves in its plane."""
    plane = body.model.provenance.get("plane")
    if plane not in tuple(_AXES):
        return
    normal = body_normal(body, _AXES.index(scene.plane)) if scene.plane in tuple(_AXES) else -1
    if normal != _AXES.index(plane):
        raise InputError(
            f"body {body.name!r} is a planar model, with inertia about its axis {plane} alone, but the scene is computed "
            f'{"in space" if scene.plane == "none" else f"in the plane {scene.plane}"}: declare plane = "{plane}", or take a '
            "model in space"
        )
