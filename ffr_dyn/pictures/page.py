"""An interactive animation in one self-contained page: plotly.js and all numbers are inside, so it works offline."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import plotly.io
from matplotlib import colormaps
from matplotlib.colors import to_hex

from ffr_dyn.pictures.film import (
    BODY_COLOURS,
    TRACE_COLOURS,
    Camera,
    Colouring,
    Film,
    Link,
    Solid,
    drawn_points,
    is_coloured,
)
from ffr_prep.body import Surface, some_points
from ffr_prep.common.arrays import Array

# Larger surfaces are simplified until all pictures together need no more numbers than this: some eight megabytes.
_MOST_NUMBERS = 1_400_000
_TITLE = "Motion of a multibody system"
_INK = "#222222"
# The default epsilons are for sides of about one: facets of some millimetres would have no normal.
_MATTE: Any = {
    "ambient": 0.55,
    "diffuse": 0.6,
    "specular": 0.15,
    "roughness": 0.7,
    "facenormalsepsilon": 1e-30,
    "vertexnormalsepsilon": 1e-30,
}
_SINK = 0.002  # of the body's size
_STOPS = 33  # of a colour map
_FIELD_OF_VIEW = np.tan(np.pi / 8)

Item = dict[str, Any]


def page(shown: Film, camera: Camera, seconds: float) -> str:
    """The HTML text of a page with play, pause and a slider over the pictures of the film.

    seconds : playing time of one picture [s]
    """
    shown = _simplified(shown)
    light = _light(shown, camera)
    moving = [_moving(shown, frame, light) for frame in range(shown.times.size)]
    still = [*_paths(shown), _triad(shown)]
    figure = {
        "data": [*moving[0], *still],
        "layout": _layout(shown, camera, seconds),
        "frames": [
            {"name": str(k), "data": items, "traces": list(range(len(items)))}
            for k, items in enumerate([_changes(item) for item in items] for items in moving)
        ],
    }
    content = plotly.io.to_html(
        figure,
        config={"displaylogo": False, "responsive": True},
        include_plotlyjs=True,
        include_mathjax=False,
        full_html=False,
        auto_play=False,
        default_height="100vh",
        validate=False,
        div_id="motion",
    )
    style = "html, body { margin: 0; height: 100%; background: white }"
    head = f'<meta charset="utf-8"><title>{_TITLE}</title><style>{style}</style>'
    return f'<!DOCTYPE html>\n<html lang="en">\n<head>{head}</head>\n<body>{content}</body>\n</html>\n'


# ---- bodies -------------------------------------------------------------------------------------------------------


def _moving(shown: Film, frame: int, light: Item) -> list[Item]:
    plain = iter(BODY_COLOURS * (1 + len(shown.solids) + len(shown.links)))
    items = []
    for solid in shown.solids:
        colour = next(plain)
        items.append(_body(shown, solid, frame, colour, light))
        if solid.is_flexible and shown.scale > 0:
            items.append(_ghost(solid, frame))
    return items + [_rods(link, frame, next(plain)) for link in shown.links]


def _body(shown: Film, solid: Solid, frame: int, colour: str, light: Item) -> Item:
    item = {**_mesh(solid, drawn_points(solid, frame, shown.scale)), "name": solid.name, **light}
    if shown.colouring is None or not is_coloured(shown, solid):
        return {**item, "color": colour, "showlegend": True}
    factor, _ = shown.colouring.readable()
    intensity = _numbers(shown.colouring.values(solid, frame) * factor)
    return {**item, "intensity": intensity, "coloraxis": "coloraxis", "showlegend": True}


def _ghost(solid: Solid, frame: int) -> Item:
    # In planar bending its sides lie in those of the body: let them sink a little, or the two would flicker.
    item = _mesh(solid, solid.R[frame] + sunk(solid.surface, _SINK * solid.size) @ solid.A[frame].T)
    return {**item, "name": f"{solid.name}, undeformed", "color": "#808080", "opacity": 0.18, "hoverinfo": "skip"}


def _mesh(solid: Solid, points: Array) -> Item:
    corners = {key: _numbers(column, "i4") for key, column in zip("ijk", solid.surface.triangles.T, strict=True)}
    return {"type": "mesh3d", **_coordinates(points), **corners, "flatshading": True}


def _rods(link: Link, frame: int, colour: str) -> Item:
    points = link.points[frame]
    gap = np.full((len(link.pairs), 1, 3), np.nan)
    lines = np.concatenate([points[link.pairs], gap], axis=1).reshape(-1, 3) if len(link.pairs) else points
    look = {"mode": "lines+markers", "line": {"width": 10, "color": colour}, "marker": {"size": 4, "color": _INK}}
    return {"type": "scatter3d", **_coordinates(lines), **look, "name": link.name, "showlegend": True}


def _changes(item: Item) -> Item:
    """What a picture changes of an item: the rest is in the first one and need not be repeated."""
    return {key: item[key] for key in ("type", "x", "y", "z", "intensity") if key in item}


# ---- what does not move -------------------------------------------------------------------------------------------


def _paths(shown: Film) -> Iterator[Item]:
    for (name, path), colour in zip(shown.traces.items(), TRACE_COLOURS * len(shown.traces), strict=False):
        look = {"mode": "lines", "line": {"width": 4, "color": colour}, "hoverinfo": "skip"}
        yield {"type": "scatter3d", **_coordinates(path), **look, "name": f"path of {name}", "showlegend": True}


def _triad(shown: Film) -> Item:
    """The axes of the ground, at its origin, or beside the bodies when the origin is far from them."""
    far = ((shown.low > 0) | (shown.high < 0)).any()
    origin, length = (shown.low if far else np.zeros(3)), 0.12 * shown.size
    tips = origin + length * np.eye(3)
    points = np.stack([np.tile(origin, (3, 1)), tips, np.full((3, 3), np.nan)], axis=1).reshape(-1, 3)
    colours = [colour for colour in ("#D62728", "#2CA02C", "#1F77B4") for _ in range(3)]
    text = [letter for axis in "xyz" for letter in ("", axis, "")]
    look = {"mode": "lines+text", "line": {"width": 5, "color": colours}, "text": text, "textfont": {"size": 15}}
    return {"type": "scatter3d", **_coordinates(points), **look, "hoverinfo": "skip", "showlegend": False}


def _layout(shown: Film, camera: Camera, seconds: float) -> Item:
    return {
        "scene": _scene(shown, camera),
        **({"coloraxis": _colour_axis(shown.colouring)} if shown.colouring else {}),
        "font": {"family": "sans-serif", "size": 14, "color": _INK},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "legend": {"x": 0.01, "y": 0.90, "bgcolor": "rgba(255,255,255,0.6)"},
        "annotations": [_note(shown.scale_note())],
        "updatemenus": [_buttons(seconds)],
        "sliders": [_slider(shown)],
    }


def _colour_axis(colours: Colouring) -> Item:
    factor, _ = colours.readable()
    bar = {"title": {"text": colours.title("<br>")}, "len": 0.6, "thickness": 18}
    stops = np.linspace(0.0, 1.0, _STOPS)
    shades = [
        [at, to_hex(shade)] for at, shade in zip(stops.tolist(), colormaps[colours.colour_map](stops), strict=True)
    ]
    return {"cmin": colours.low * factor, "cmax": colours.high * factor, "colorscale": shades, "colorbar": bar}


def _scene(shown: Film, camera: Camera) -> Item:
    pad = 0.03 * (shown.size or 1.0)
    low, high = shown.low - pad, shown.high + pad
    ratio = (high - low) / (high - low).max()
    grid = {"gridcolor": "#E4E4E4", "showbackground": False, "zeroline": False, "showspikes": False}
    axes = {
        f"{letter}axis": {"range": [a, b], "nticks": 2 + round(5 * side), "title": {"text": f"{letter} [m]"}, **grid}
        for letter, a, b, side in zip("xyz", low.tolist(), high.tolist(), ratio, strict=True)
    }
    return {"aspectmode": "manual", "aspectratio": _vector(ratio), "camera": _eye(camera, ratio), **axes}


def _light(shown: Film, camera: Camera) -> Item:
    """A lamp behind the eye, above and to the left."""
    direction, right, up = camera.axes()
    lamp = shown.centre + 1000.0 * (shown.size or 1.0) * (direction + 0.7 * up - 0.5 * right)
    return {"lighting": _MATTE, "lightposition": _vector(lamp)}


def _eye(camera: Camera, ratio: Array) -> Item:
    """The eye so far away, in units of the longest side, that the box of these sides fills a wide window."""
    direction, right, up = camera.axes()
    half = 0.5 * ratio
    reach = max(half @ np.abs(right) / 1.5, half @ np.abs(up) / 0.85)
    distance = reach / _FIELD_OF_VIEW + half @ np.abs(direction)
    return {"eye": _vector(distance * direction), "up": _vector(up), "center": _vector(np.zeros(3))}


def _note(text: str) -> Item:
    place = {"x": 0.01, "y": 0.98, "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "top"}
    return {"text": text, "showarrow": False, "font": {"size": 17}, **place}


def _buttons(seconds: float) -> Item:
    pace = {"frame": {"duration": round(1000 * seconds), "redraw": True}, "fromcurrent": True, **_AT_ONCE}
    buttons = [
        {"label": "▶ play", "method": "animate", "args": [None, pace]},
        {"label": "❚❚ pause", "method": "animate", "args": [[None], _JUMP]},
    ]
    place = {"x": 0.01, "y": 0.02, "xanchor": "left", "yanchor": "bottom", "direction": "right"}
    return {"type": "buttons", "buttons": buttons, "showactive": False, **place}


def _slider(shown: Film) -> Item:
    steps = [{"label": shown.clock(k), "method": "animate", "args": [[str(k)], _JUMP]} for k in range(shown.times.size)]
    place = {"x": 0.22, "y": 0.10, "len": 0.74, "pad": {"t": 0, "b": 0}, "ticklen": 0, "minorticklen": 0}
    return {
        "steps": steps,
        "currentvalue": {"prefix": "t = ", "font": {"size": 17, "color": _INK}},
        "font": {"color": "rgba(0,0,0,0)"},
        **place,
    }


_AT_ONCE: Any = {"transition": {"duration": 0}}
_JUMP: Any = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, **_AT_ONCE}


def sunk(surface: Surface, depth: float) -> Array:
    """(P, 3) undeformed points, moved inwards by `depth` [m] along the mean normal of the triangles around each."""
    a, b, c = (surface.points[corner] for corner in surface.triangles.T)
    normals = np.zeros_like(surface.points)
    for corner in surface.triangles.T:
        np.add.at(normals, corner, np.cross(b - a, c - a))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return surface.points - depth * normals / np.where(length > 0, length, 1.0)


# ---- numbers ------------------------------------------------------------------------------------------------------


def _coordinates(points: Array) -> Item:
    return {key: _numbers(column) for key, column in zip("xyz", points.T, strict=True)}


def _numbers(values: Array, kind: str = "f4") -> Item:
    """A typed array as plotly.js reads it: little-endian bytes in base 64."""
    return {"dtype": kind, "bdata": base64.b64encode(np.ascontiguousarray(values, "<" + kind).tobytes()).decode()}


def _vector(values: Array) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))


def _simplified(shown: Film) -> Film:
    # Three coordinates of each point, seven numbers with a ghost and a colour.
    per_frame = sum(len(solid.surface.points) * (7 if solid.is_flexible else 3) for solid in shown.solids)
    if per_frame * shown.times.size <= _MOST_NUMBERS:
        return shown
    share = _MOST_NUMBERS / (per_frame * shown.times.size)
    return replace(shown, solids=tuple(_decimated(solid, share) for solid in shown.solids))


def _decimated(solid: Solid, share: float) -> Solid:
    surface, nearest = decimated(solid.surface, share)
    parts = solid.parts and replace(solid.parts, of=solid.parts.of[nearest])
    return replace(solid, surface=surface, parts=parts)


def decimated(surface: Surface, share: float) -> tuple[Surface, Array]:
    """A coarser surface of about that share of the triangles; its points are points of the given one, with these numbers."""
    import pyvista as pv
    from scipy.spatial import cKDTree

    coarse = pv.PolyData.from_regular_faces(np.array(surface.points), np.array(surface.triangles)).decimate(1.0 - share)
    nearest = cKDTree(surface.points).query(coarse.points)[1]
    return some_points(surface, nearest, coarse.regular_faces), nearest
