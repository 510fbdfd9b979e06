"""A scene seen before it runs: bodies, joints with their axes, forces, markers, the ground; as assembled and as declared."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluator, record_states
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.pictures.connections import ArrowShown, Connections, JointShown, SpreadShown, connections
from ffr_dyn.pictures.film import Camera, Film, camera_for, film_at
from ffr_dyn.pictures.shades import shades
from ffr_dyn.pictures.viewer import Viewer
from ffr_dyn.results.quantities import measure
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Quantity, Result, mode_axis
from ffr_dyn.scene.described import described
from ffr_dyn.scene.joints import COINCIDENCE, Joint, words
from ffr_dyn.scene.scene import Body, Scene, marker_names, markers, require_scene
from ffr_dyn.scene.surfaces import surface_of
from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import replacing

DECLARED = " as declared"  # follows the name of a body that is drawn where the scene puts it
_MOVED = 1e-3  # of the size of the scene, by which assembly moves a marker, from where both are drawn
_APART = 1e-6  # of that size, from where two points that a joint ties are told to be apart
_SIZE = (1200, 800)


@dataclass(frozen=True, eq=False)
class SceneView:
    """A scene as it is drawn.

    shown   : the result of one row that is drawn, the declared bodies beside the assembled ones where they differ
    beside  : joints, forces, markers
    apart   : by words, the ends (2, 3) [m] of lines between points that a joint ties and that are apart as declared
    trouble : why the scene cannot be assembled, or nothing
    plane   : the normal of the plane that it is computed in, or "none"
    """

    shown: Result
    beside: Connections
    apart: dict[str, Array]
    trouble: str = ""
    plane: str = "none"

    @property
    def faint(self) -> frozenset[str]:
        """Names of the bodies that are drawn as declared beside the assembled ones."""
        return (
            frozenset()
            if self.trouble
            else frozenset(b for b in self.shown.geometry if b.endswith(DECLARED))
            | {name.removesuffix(".R") for name in self.shown.quantities if name.endswith(f"{DECLARED}.R")}
        )


def show(
    scene: Scene | FlexibleBody, path: str | Path | None = None, *, time: float = 0.0, camera: Camera | None = None
) -> Viewer:
    """A scene, or a body alone, as it is before it runs.

    Bodies, joints with their axes, drivers, forces, markers by name and the points of the ground are drawn.


    path   : .html, a page that can be turned with the mouse; .png, a picture
    time   : [s], at which the drivers are looked at
    camera : by default chosen from the scene

    The scene is drawn as assembled, with translucent bodies where it declares them if assembly moves them visibly. A scene
    that cannot be assembled is drawn as it is declared, with red lines between points that a joint ties and that are apart;
    the title says why. Raises InputError for another kind of file, ComputationError when this machine cannot render.

    Example: ``fd.show(scene)`` in a notebook, ``fd.show(scene, "scene.html")`` elsewhere.

    >>> fd.show(scene, "scene.html")
    """
    if isinstance(scene, FlexibleBody):
        scene = Scene((Body("body", scene),), name=scene.name or "body", plane="none")
    require_scene(scene)
    return drawn(scene_view(scene, time), path, camera)


def drawn(seen: SceneView, path: str | Path | None = None, camera: Camera | None = None) -> Viewer:
    """The picture that `show` makes of a scene view."""
    target = None if path is None else Path(path)
    kind = target.suffix.lower() if target else ".html"
    if kind not in (".html", ".png"):
        raise InputError(f"{target}: scenes are drawn as .html or .png, not {kind or 'without a suffix'}")
    film, title = _film(seen), str(seen.shown.attributes["title"])
    view = camera or camera_for(film)
    if target and kind == ".png":
        _write_picture(seen, film, view, target)
        return Viewer(lambda: _page(seen, film, view), title)
    text = _page(seen, film, view)
    viewer = Viewer(lambda: text, title)
    if target:
        viewer.save(target)
    return viewer


def open_window(seen: SceneView) -> None:
    """Open a window with a scene, which can be turned with the mouse, until it is closed.

    Raises ComputationError where there is no display.
    """
    if os.name == "posix" and not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        raise ComputationError(
            "there is no display for a window; write a page (-o scene.html) or a picture (-o scene.png)"
        )
    from ffr_dyn.pictures.render import window  # here, because pyvista is slow to load

    film = _marked(seen, _film(seen))
    window(film, camera_for(film), _SIZE, faint=seen.faint)


def scene_view(scene: Scene, time: float = 0.0) -> SceneView:
    """The scene as declared and, where that is possible, as assembled."""
    declared = _declared(scene)
    try:
        assembled = assemble(scene, time=time)
        at = evaluator(assembled.system)
        record = record_states(at, np.array([time]), assembled.x[None], assembled.v[None])
    except (InputError, ComputationError) as error:
        return SceneView(declared, _all_connections(scene, declared), _apart(scene, declared), str(error))
    quantities, _ = measure(View(assembled.system, record), {})
    surfaces = {body.name: surface_of(body) for body in assembled.system.scene.bodies}
    geometry = {name: surface for name, surface in surfaces.items() if surface is not None}
    shown = Result(np.array([time]), quantities, geometry, described(scene))
    beside, plane = _all_connections(scene, shown), assembled.system.scene.plane
    if _far(declared, shown) < _MOVED:
        return SceneView(shown, beside, {}, plane=plane)
    return SceneView(_with_declared(shown, declared), beside, _apart(scene, declared), plane=plane)


# ---- as declared -----------------------------------------------------------------------------------------------------


def _declared(scene: Scene) -> Result:
    """The scene where it puts its bodies: a result of one row."""
    quantities: dict[str, Quantity] = {}
    for body in scene.bodies:
        quantities[f"{body.name}.R"] = Quantity(body.position[None], "m", (XYZ,))
        quantities[f"{body.name}.p"] = Quantity(body.rotation[None], "1", (EULER_PARAMETERS,))
        if body.model.n:
            axes = (mode_axis(body.name, body.model.n),)
            quantities[f"{body.name}.q"] = Quantity(body.q[None], "m sqrt(kg)", axes)
    for name, (b, _, point) in zip(marker_names(scene), markers(scene), strict=True):
        if b < len(scene.bodies):
            body = scene.bodies[b]
            interface = body.model.interface(point)
            place = body.position + rotation_matrix(body.rotation) @ (interface.position + interface.phi_t @ body.q)
            quantities[f"{name}.position"] = Quantity(place[None], "m", (XYZ,))
    surfaces = {body.name: surface_of(body) for body in scene.bodies}
    geometry = {name: surface for name, surface in surfaces.items() if surface is not None}
    return Result(np.zeros(1), quantities, geometry, described(scene))


def _far(declared: Result, shown: Result) -> float:
    """How far assembly moved a marker, over the size of the scene."""
    names = [name for name in declared.quantities if name.endswith(".position") and name in shown.quantities]
    if not names:
        return 0.0
    places, moved = (np.concatenate([result[name] for name in names]) for result in (declared, shown))
    size = float(np.linalg.norm(np.ptp(moved, axis=0))) or 1.0
    return float(np.linalg.norm(moved - places, axis=1).max()) / size


def _with_declared(shown: Result, declared: Result) -> Result:
    """Both in one result, the declared bodies by names of their own."""
    bodies = {name.removesuffix(".R") for name in declared.quantities if name.endswith(".R")}
    quantities = dict(shown.quantities)
    for name, of in declared.quantities.items():
        body, _, what = name.partition(".")
        if body in bodies:
            axes = tuple(
                replace(axis, name=f"{body}{DECLARED}.mode") if "mode" in axis.name else axis for axis in of.axes
            )
            quantities[f"{body}{DECLARED}.{what}"] = replace(of, axes=axes)
    geometry = {f"{name}{DECLARED}": surface for name, surface in declared.geometry.items()}
    parts = {
        f"{whole}{DECLARED}": [f"{p}{DECLARED}" for p in of] for whole, of in shown.attributes.get("parts", {}).items()
    }
    told = {**shown.attributes, "parts": {**shown.attributes.get("parts", {}), **parts}}
    return replace(shown, quantities=quantities, geometry={**shown.geometry, **geometry}, attributes=told)


# ---- what is drawn beside --------------------------------------------------------------------------------------------


def _all_connections(scene: Scene, result: Result) -> Connections:
    """Those of the result but for reactions, and a mark at every force that has no arrow."""
    told = result.attributes.get("connections", {})
    found = connections(result)
    found = replace(found, arrows=tuple(arrow for arrow in found.arrows if "axis" not in told[arrow.of]))
    arrows = {arrow.of for arrow in found.loads}
    marks = [
        JointShown(name, "force", f"{name} ({of['kind']})", found.markers[of["at"][0]], None)
        for name, of in told.items()
        if "axis" not in of and name not in arrows and of["at"] and of["at"][0] in found.markers
    ]
    return replace(found, joints=(*found.joints, *marks))


def _apart(scene: Scene, declared: Result) -> dict[str, Array]:
    """Lines between points that joints tie and that are apart, by words."""
    places = connections(declared).markers
    size = float(np.linalg.norm(np.ptp(np.concatenate(list(places.values())), axis=0))) or 1.0
    found = {}
    for joint in scene.joints:
        ends = np.concatenate([places[joint.i], places[joint.j]])
        gap = float(np.linalg.norm(ends[1] - ends[0]))
        if gap > _APART * size and _ties_points(joint):
            found[f"{joint.name}: {gap:.3g} m apart"] = ends
    return found


def _ties_points(joint: Joint) -> bool:
    """Whether a joint keeps both its points at one place."""
    return sum(word.kind == COINCIDENCE for word in words(joint)) == 3


def _lines(scene_result: Result, places: Any) -> Iterator[tuple[str, Array]]:
    """Of forces between two points, and of joints that keep their distance, the line."""
    for name, of in scene_result.attributes.get("connections", {}).items():
        between = "axis" not in of or of["kind"] == "distance"
        if between and len(of["at"]) == 2 and all(end in places for end in of["at"]):
            yield f"{name} ({of['kind']})", np.concatenate([places[end] for end in of["at"]])


# ---- drawn -----------------------------------------------------------------------------------------------------------


def _film(seen: SceneView) -> Film:
    film = film_at(seen.shown, seen.shown.time, colour="body")
    lines = {**seen.apart, **dict(_lines(seen.shown, seen.beside.markers))}
    points = np.concatenate([film.corners, *seen.beside.markers.values()])
    film = replace(film, traces=lines, low=points.min(axis=0), high=points.max(axis=0), plane=seen.plane)
    ends = [of for _, arrows in _ends(seen, film.size) for of in arrows]
    points = np.concatenate([points, *ends])
    return replace(film, low=points.min(axis=0), high=points.max(axis=0))


def _ends(seen: SceneView, size: float) -> Iterator[tuple[ArrowShown | SpreadShown, Array]]:
    """Every load, and where its arrows begin and end (N, 2, 3) [m], strongest first."""
    for load, length in seen.beside.lengths(size):
        yield load, np.stack(load.ends(0, length), axis=1)


def _page(seen: SceneView, film: Film, camera: Camera) -> str:
    from ffr_dyn.pictures.page import Shown, page  # here, because matplotlib is slow to load

    title = str(seen.shown.attributes["title"]) + (f": {seen.trouble}" if seen.trouble else "")
    beside = seen.beside
    content = Shown(
        film,
        beside,
        shades(film, "body"),
        title,
        faint=seen.faint,
        boxes=("edges", "names", "frames", "markers", "forces"),
    )
    return page(content, camera, 1.0)


def _marked(seen: SceneView, film: Film) -> Film:
    """With names of joints and markers at their places, and axes of joints as lines."""
    named = [(joint.label, joint.at[0]) for joint in seen.beside.joints]
    loads = list(_ends(seen, film.size))
    named += [(f"{load.name} {load.largest:.4g} {load.unit}", arrows[0].mean(axis=0)) for load, arrows in loads]
    marks = dict(_merged([*named, *((marker, at[0]) for marker, at in seen.beside.markers.items())], film.size))
    reach = 0.06 * film.size
    axes = {
        joint.label: joint.at[0] + reach * np.array([[-1.0], [1.0]]) * joint.axis[0]
        for joint in seen.beside.joints
        if joint.axis is not None
    }
    heading = seen.trouble[:110] or str(seen.shown.attributes["title"])
    none = np.zeros((0, 2, 3))
    moments, forces = (
        np.concatenate([none, *(arrows for load, arrows in loads if (load.unit == "N m") is turns)])
        for turns in (True, False)
    )
    paths = {**film.traces, **axes}
    return replace(film, marks=marks, traces=paths, heading=heading, forces=forces[None], moments=moments[None])


def _merged(places: Iterable[tuple[str, Array]], size: float) -> Iterator[tuple[str, Array]]:
    """One text for what is at one place, a line each."""
    left = list(places)
    while left:
        _, at = left[0]
        here = [name for name, other in left if np.linalg.norm(other - at) <= 1e-3 * size]
        left = [(name, other) for name, other in left if name not in here]
        yield "\n".join(here), at


def _write_picture(seen: SceneView, film: Film, camera: Camera, path: Path) -> None:
    from ffr_dyn.pictures.render import pictures  # here, because pyvista is slow to load

    (picture,) = pictures(_marked(seen, film), camera, _SIZE, faint=seen.faint)
    with replacing(path) as part:
        Image.fromarray(picture).save(part, "PNG")
