"""The faces of a part as a table, as data and as a numbered picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy import ndimage

from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import numbers
from ffr_prep.mesh.geometry.face import METRES, Face
from ffr_prep.mesh.geometry.faces import Faces, feature_centre, several_solids, solids_of, surface_in_words, tidy
from ffr_prep.mesh.geometry.regions import query_for
from ffr_prep.report.mode_pictures import Camera, camera_of, draw_triad, off_screen, save_figure, shot

_SMALLEST = 60  # pixels of a face that is numbered
_COLOURS = (
    "#8ecae6",
    "#ffb703",
    "#95d5b2",
    "#f4a6b8",
    "#cdb4db",
    "#ffd6a5",
    "#a8dadc",
    "#e9c46a",
    "#b5c99a",
    "#d8a48f",
)
_INK = "#222222"
_SOLID = {True: ("solid",), False: ()}


def face_lines(faces: Faces) -> Iterator[str]:
    """A line for each feature: its faces, what it is, where, and what to type for it."""
    unit = faces.unit
    extent = tidy(np.ptp(faces.points, axis=0) / METRES[unit], faces.size / METRES[unit])
    several = len(faces.features) < len(faces.faces)
    of = f", which are {len(faces.features)} surfaces" if several else ""
    yield f"faces       {len(faces.faces)}{of}; extent {numbers(extent)} {unit}"
    rows = [_row(faces, feature) for feature in faces.features]
    heads = ("faces", *_SOLID[several_solids(faces)], "what", f"centre [{unit}]", f"area [{unit}²]", "what to type")
    widths = [max(len(row[k]) for row in [heads, *rows]) for k in range(len(heads) - 1)]
    for row in [heads, *rows]:
        cells = "  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=False))
        yield f"{cells}  {row[-1]}".rstrip()
    for note in faces.notes:
        yield f"note        {note}"


def _row(faces: Faces, feature: Sequence[int]) -> tuple[str, ...]:
    first, scale = faces.faces[feature[0]], METRES[faces.unit]
    centre, area = feature_centre(faces, feature)
    about = [*(f"{name!r}" for name in dict.fromkeys([first.label, *first.groups]) if name), first.colour]
    what = ", ".join([surface_in_words(faces, feature[0]), *(word for word in about if word)])
    at = numbers(tidy(centre / scale, faces.size / scale))
    names = "+".join(faces.faces[k].name for k in feature)
    solids = [", ".join(solids_of(faces, feature))] if several_solids(faces) else []
    return names, *solids, what, at, f"{area / scale**2:.6g}", query_for(faces, feature)


def face_values(faces: Faces) -> dict[str, Any]:
    """All that is known of the faces, as JSON values; lengths in metres."""
    return {
        "unit": faces.unit,
        "faces": [{field.name: _plain(getattr(face, field.name)) for field in fields(Face)} for face in faces.faces],
        "features": [
            {"faces": [faces.faces[k].name for k in feature], "type": query_for(faces, feature)}
            for feature in faces.features
        ],
    }


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else list(value) if isinstance(value, tuple) else value


# ---- picture --------------------------------------------------------------------------------------------------------


def face_picture(faces: Faces, path: str | Path, title: str = "") -> Path:
    """Two views of a part, from opposite sides, with the numbers of its faces; returns the path of the PNG.

    Raises ComputationError where this machine cannot render.

    >>> fp.face_picture(fp.faces("plate.step"), "faces.png")
    """
    path, pv = Path(path), off_screen()
    figure = Figure(figsize=(16.0, 6.4), dpi=110)
    seen: set[int] = set()
    front = camera_of(faces.points, [])
    back = replace(front, right=-front.right, towards=-front.towards)
    for k, camera in enumerate((front, back)):
        seen |= _view(pv, faces, figure.add_axes((0.005 + 0.5 * k, 0.06, 0.49, 0.86)), camera)
        draw_triad(figure.add_axes((0.005 + 0.5 * k, 0.05, 0.06, 0.15)), camera)
    hidden = [face.name for k, face in enumerate(faces.faces) if k not in seen]
    figure.text(0.01, 0.965, title or f"{len(faces)} faces", fontsize=13, color=_INK, va="top")
    if hidden:
        more = f" and {len(hidden) - 12} more" if len(hidden) > 12 else ""
        figure.text(0.01, 0.015, f"not seen here: {', '.join(hidden[:12])}{more}", fontsize=10, color=_INK)
    save_figure(figure, path)
    return path


def _view(pv: Any, faces: Faces, axes: Any, camera: Camera) -> set[int]:
    """One view with numbers; the faces that are seen."""
    parts = [pv.PolyData(faces.points, np.hstack([np.full((len(t), 1), 3), t]).ravel()) for t in faces.triangles]
    looks = [{"color": face.colour or _COLOURS[k % len(_COLOURS)]} for k, face in enumerate(faces.faces)]
    borders = [part.extract_feature_edges(180.0, boundary_edges=True, manifold_edges=False) for part in parts]
    lines = [(line, {"color": _INK, "line_width": 2}) for line in borders if line.n_points]
    picture = shot(pv, camera, [*zip(parts, looks, strict=True), *lines])
    flat = [{"color": f"#{k + 1:06x}", "lighting": False} for k in range(len(parts))]
    ids = shot(pv, camera, list(zip(parts, flat, strict=True)), smooth=False)[..., :3].astype(int) @ [65536, 256, 1]
    alpha = picture[..., 3:] / 255.0
    axes.imshow(np.round(alpha * picture[..., :3] + (1 - alpha) * 255).astype(np.uint8), interpolation="lanczos")
    axes.set_axis_off()
    return set(_numbered(faces, axes, ids))


def _numbered(faces: Faces, axes: Any, ids: Array) -> Iterator[int]:
    """Write the number of each face that is seen where most of it is around."""
    for k, where in enumerate(ndimage.find_objects(ids, len(faces))):
        if where is None:
            continue
        inner = np.pad(ids[where] == k + 1, 1)
        if inner.sum() < _SMALLEST:
            continue
        depth = ndimage.distance_transform_edt(inner)
        row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
        at = column - 1 + where[1].start, row - 1 + where[0].start
        box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": _INK, "lw": 0.6, "alpha": 0.9}
        text = faces.faces[k].name.rpartition("_")[2]
        axes.text(*at, text, fontsize=10, ha="center", va="center", color=_INK, bbox=box)
        yield k
