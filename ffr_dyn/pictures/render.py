"""Pictures of a film, rendered off-screen by pyvista (VTK), one after the other."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.pictures.film import (
    BODY_COLOURS,
    TRACE_COLOURS,
    Camera,
    Colouring,
    Film,
    Link,
    Solid,
    body_points,
    is_coloured,
)
from ffr_prep.body import Surface
from ffr_prep.common.errors import ComputationError

if not os.environ.get("DISPLAY"):
    # Without a display VTK tries X first and complains; EGL needs none. VTK reads the variable when it is imported.
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

from ffr_prep.common.arrays import Array

# As Any: the annotations of pyvista refuse calls that its documentation shows.
pv: Any = importlib.import_module("pyvista")

_FEATURE_ANGLE = 30.0
_INK, _FORCE, _MOMENT = "#222222", "#D55E00", "#0072B2"
_MATTE: Any = {"ambient": 0.25, "diffuse": 0.8, "specular": 0.15, "specular_power": 20}
# Share of the picture's width and height that the bodies may fill, and where its middle lies; the bar needs the rest.
_FILL = (0.80, 0.82)
_SHIFT = (-0.04, -0.03)

Update = Callable[[int], None]


def pictures(
    shown: Film, camera: Camera, size: tuple[int, int], faint: frozenset[str] = frozenset()
) -> Iterator[Array]:
    """Yields for each time of the film a picture (height, width, 3) uint8; faint : names of bodies that are translucent.

    Raises ComputationError, naming the packages that are missing, when this machine cannot render.
    """
    plotter = _plotter(size)
    try:
        updates = _build(plotter, shown, faint)
        _aim(plotter, shown, camera, size)
        for frame in range(shown.times.size):
            for update in updates:
                update(frame)
            yield _grab(plotter, size)
    finally:
        plotter.close()


def window(shown: Film, camera: Camera, size: tuple[int, int], faint: frozenset[str]) -> None:
    """A window with the first picture of a film, which can be turned, until it is closed."""
    plotter = pv.Plotter(window_size=list(size))
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    for update in _build(plotter, shown, faint):
        update(0)
    _aim(plotter, shown, camera, size)
    plotter.show()


def _plotter(size: tuple[int, int]) -> Any:
    try:
        plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        plotter.set_background("white")
        plotter.enable_anti_aliasing("msaa", multi_samples=8)
        plotter.add_light(pv.Light(light_type="headlight", intensity=0.55))
        plotter.add_light(pv.Light(position=(-0.6, 0.9, 1.0), light_type="camera light", intensity=0.55))
        plotter.enable_parallel_projection()
        # Bringing the picture to the (invisible) window takes longer than drawing it; it is read from the back instead.
        plotter.render_window.SwapBuffersOff()
        drawn = _grab(plotter, size).any()
    except Exception as error:
        raise _cannot_render(error) from error
    if not drawn:
        raise _cannot_render("pictures stay black")
    return plotter


def _cannot_render(reason: object) -> ComputationError:
    return ComputationError(
        f"this machine cannot render off-screen ({reason}); install the packages libegl1 libgl1-mesa-dri libgl1, "
        "or write a page (.html), which needs none of them"
    )


def _grab(plotter: Any, size: tuple[int, int]) -> Array:
    width, height = size
    pixels = vtkUnsignedCharArray()
    plotter.render_window.Render()
    plotter.render_window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
    return np.ascontiguousarray(vtk_to_numpy(pixels).reshape(height, width, 3)[::-1])  # type: ignore[no-untyped-call]


def _aim(plotter: Any, shown: Film, camera: Camera, size: tuple[int, int]) -> None:
    """Parallel projection that just shows the box of the whole motion."""
    direction, right, up = camera.axes()
    corners = shown.corners - shown.centre
    reach = [np.abs(corners @ axis).max() / fill for axis, fill in zip((right, up), _FILL, strict=True)]
    half_height = max(reach[1], reach[0] * size[1] / size[0], 1e-9)
    focus = shown.centre - _SHIFT[0] * half_height * size[0] / size[1] * right - _SHIFT[1] * half_height * up
    distance = 2.0 * max(shown.size, half_height)
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + distance * direction
    plotter.camera.up = up
    plotter.camera.parallel_scale = half_height
    plotter.camera.clipping_range = (0.1 * distance, 3.0 * distance)


# ---- what is in the picture ---------------------------------------------------------------------------------------


def _build(plotter: Any, shown: Film, faint: frozenset[str]) -> list[Update]:
    updates: list[Update] = []
    plain = iter(BODY_COLOURS * (1 + len(shown.solids) + len(shown.links)))
    for solid in shown.solids:
        colour = next(plain)
        if solid.name in faint:
            updates.append(_ghost(plotter, solid))
            continue
        if shown.colouring is not None and is_coloured(shown, solid):
            updates.append(_coloured_solid(plotter, shown, solid, shown.colouring))
        else:
            updates.append(_plain_solid(plotter, shown, solid, colour))
        if solid.is_flexible and shown.scale > 0:
            updates.append(_ghost(plotter, solid))
    updates += [_tubes(plotter, link, next(plain), link.name in faint) for link in shown.links]
    for path, colour in zip(shown.traces.values(), TRACE_COLOURS * len(shown.traces), strict=False):
        plotter.add_mesh(pv.lines_from_points(path), color=colour, line_width=2.5, lighting=False)
    for arrows, colour, heads in ((shown.forces, _FORCE, 1), (shown.moments, _MOMENT, 2)):
        updates += [_arrow(plotter, arrows[:, k], colour, heads) for k in range(arrows.shape[1])]
    if shown.marks:
        _mark(plotter, shown)
    plotter.add_axes(line_width=2, color=_INK, viewport=(0.0, 0.0, 0.16, 0.2))
    updates.append(_caption(plotter, shown))
    return updates


@dataclass(frozen=True)
class _Mesh:
    """A VTK mesh whose k-th point is the point index[k] of the surface."""

    data: Any
    index: Array

    def move(self, points: Array) -> None:
        self.data.points[:] = points[self.index]
        self.data.GetPoints().Modified()


def _skin(surface: Surface) -> _Mesh:
    """The surface with normals for smooth shading; points on sharp edges are doubled, once for each side."""
    mesh = _indexed(surface).compute_normals(
        split_vertices=True, feature_angle=_FEATURE_ANGLE, cell_normals=False, consistent_normals=False
    )
    return _Mesh(mesh, np.array(mesh.point_data.pop("index")))


def _edges(surface: Surface) -> _Mesh:
    """The sharp edges of the surface."""
    mesh = _indexed(surface).extract_feature_edges(_FEATURE_ANGLE, non_manifold_edges=False, manifold_edges=False)
    return _Mesh(mesh, np.array(mesh.point_data.pop("index")))


def _indexed(surface: Surface) -> Any:
    mesh = pv.PolyData.from_regular_faces(np.array(surface.points), np.array(surface.triangles))
    mesh.point_data["index"] = np.arange(mesh.n_points)
    return mesh


def _plain_solid(plotter: Any, shown: Film, solid: Solid, colour: str) -> Update:
    skin, edges = _skin(solid.surface), _edges(solid.surface)
    actors = [plotter.add_mesh(skin.data, color=colour, **_MATTE), *_edge_actors(plotter, edges)]
    return lambda frame: _place(solid, frame, shown.scale, (skin, edges), actors)


def _coloured_solid(plotter: Any, shown: Film, solid: Solid, colours: Colouring) -> Update:
    skin, edges = _skin(solid.surface), _edges(solid.surface)
    factor, _ = colours.readable()
    skin.data.point_data["field"] = np.zeros(skin.data.n_points)
    actor = plotter.add_mesh(
        skin.data,
        scalars="field",
        clim=(colours.low * factor, colours.high * factor),
        cmap=colours.colour_map,
        scalar_bar_args=_bar(colours.title("\n") + "\n"),
        **_MATTE,
    )
    actors = [actor, *_edge_actors(plotter, edges)]

    def update(frame: int) -> None:
        _place(solid, frame, shown.scale, (skin, edges), actors)
        skin.data.point_data["field"][:] = colours.values(solid, frame)[skin.index] * factor
        skin.data.Modified()

    return update


def _bar(title: str) -> dict[str, Any]:
    place = {"position_x": 0.89, "position_y": 0.25, "width": 0.07, "height": 0.5, "vertical": True}
    return {
        "title": title,
        "color": _INK,
        "n_labels": 5,
        "fmt": "%.3g",
        "title_font_size": 16,
        "label_font_size": 15,
        **place,
    }


def _edge_actors(plotter: Any, edges: _Mesh) -> list[Any]:
    if edges.data.n_points == 0:
        return []
    return [plotter.add_mesh(edges.data, color=_INK, line_width=1.3, lighting=False)]


def _ghost(plotter: Any, solid: Solid) -> Update:
    actor = plotter.add_mesh(_skin(solid.surface).data, color="#808080", opacity=0.18, **_MATTE)
    # In planar bending its sides lie in those of the body: put it a little behind them, or the two would flicker.
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(4.0, 4.0)
    return lambda frame: _pose(actor, solid, frame)


def _place(solid: Solid, frame: int, scale: float, meshes: tuple[_Mesh, ...], actors: list[Any]) -> None:
    """Deforms the meshes in the body frame, and moves the actors with the frame."""
    if solid.is_flexible:
        points = body_points(solid, frame, scale)
        for mesh in meshes:
            mesh.move(points)
    for actor in actors:
        _pose(actor, solid, frame)


def _pose(actor: Any, solid: Solid, frame: int) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = solid.A[frame]
    matrix[:3, 3] = solid.R[frame]
    actor.user_matrix = matrix


def _tubes(plotter: Any, link: Link, colour: str, faint: bool) -> Update:
    cells = np.insert(link.pairs, 0, 2, axis=1).ravel()
    meshes = [pv.PolyData(np.array(link.points[0]))]
    look = {"opacity": 0.25} if faint else {"render_points_as_spheres": True}
    plotter.add_mesh(meshes[0], color=_INK, point_size=12, **look)
    if cells.size:
        meshes.append(pv.PolyData(np.array(link.points[0]), lines=cells))
        look = {"opacity": 0.25} if faint else {"render_lines_as_tubes": True}
        plotter.add_mesh(meshes[1], color=colour, line_width=9, **look)

    def update(frame: int) -> None:
        for mesh in meshes:
            mesh.points[:] = link.points[frame]
            mesh.GetPoints().Modified()

    return update


def _arrow(plotter: Any, ends: Array, colour: str, heads: int) -> Update:
    """An arrow between two points in each picture, ends (F, 2, 3) [m]; of a moment with two heads."""
    actor = plotter.add_mesh(_unit_arrow(heads), color=colour, **_MATTE)

    def update(frame: int) -> None:
        begin, end = ends[frame]
        length = float(np.linalg.norm(end - begin))
        actor.SetVisibility(length > 0.0)
        if length > 0.0:
            along = (end - begin) / length
            across = np.linalg.svd(along[None])[2][1]
            matrix = np.eye(4)
            matrix[:3, :3] = length * np.stack([along, across, np.cross(along, across)], axis=1)
            matrix[:3, 3] = begin
            actor.user_matrix = matrix

    return update


def _unit_arrow(heads: int) -> Any:
    """An arrow of length one along x."""
    found = pv.Arrow(shaft_radius=0.015, tip_radius=0.05, tip_length=0.16)
    for k in range(1, heads):
        found = found.merge(pv.Cone(center=(0.92 - 0.13 * k, 0, 0), height=0.16, radius=0.05, resolution=20))
    return found


def _mark(plotter: Any, shown: Film) -> None:
    points, words = np.array(list(shown.marks.values())), list(shown.marks)
    look = {"font_size": 17, "text_color": _INK, "shape_color": "white", "shape_opacity": 0.75, "point_color": _INK}
    plotter.add_point_labels(points, words, always_visible=True, point_size=11, render_points_as_spheres=True, **look)


def _caption(plotter: Any, shown: Film) -> Update:
    text: Any = plotter.add_text("t", position=(0.02, 0.93), viewport=True, font_size=11, color=_INK)

    def update(frame: int) -> None:
        text.input = shown.caption(frame)

    return update
