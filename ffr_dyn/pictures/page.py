"""A film as one self-contained page: the viewer of the folder `web`, and all numbers, deflated. It fetches nothing.

A surface is stored once, whichever bodies have it, with the shapes of its deformation and of its stress (`morphs`); of every
row of the result there are only poses and weights. The page's own policy forbids requests.
"""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np
from matplotlib import colormaps

from ffr_dyn.consistency.step_error import filled
from ffr_dyn.pictures.connections import ArrowShown, Connections, SpreadShown
from ffr_dyn.pictures.film import BODY_COLOURS, TRACE_COLOURS, Camera, Film, Link, Solid
from ffr_dyn.pictures.morphs import MOST_SHAPES, MOST_TENSORS, beside, is_closed, morph, quadratic, sharp_edges
from ffr_dyn.pictures.shades import Shade
from ffr_dyn.results.result import Result
from ffr_prep.body import Surface, some_points
from ffr_prep.common.arrays import Array
from ffr_prep.common.units import pretty, readable

MOST_TRIANGLES = 60_000
_MOST_HISTORIES = 200_000  # numbers of histories that can be plotted
_NOT_PLOTTED = (".R", ".p", ".q", ".q_dot", ".q_ddot", ".orientation", ".omega_bar", ".v")
_LARGEST, _GREY = 32767, "#999999"
_STOPS = 64  # of a colour map
_SIDES = 8  # of a rod
_THICK = 0.012  # of the size of the whole motion: the radius of a rod
_RIGID = 1e-6  # of a body's size, that markers of a rigid one move by rounding

_SCRIPTS = ("numbers", "shaders", "solids", "overlay", "plots", "controls")

Item = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Shown:
    """The contents of a page.

    film     : the bodies at the rows
    beside   : joints, forces, markers at the same rows
    shades   : what bodies may be coloured by; the first is that of the start
    result   : histories that can be plotted, of the same rows; None where there is one row
    plots    : names of the components that are plotted at the start
    faint    : names of the bodies that are translucent
    boxes    : what is switched on at the start: edges, ghost, names, frames, markers, forces
    arrows   : names of the loads whose arrows are, where not all forces are
    moments  : words in place of the time at each row
    """

    film: Film
    beside: Connections
    shades: Sequence[Shade]
    title: str = ""
    result: Result | None = None
    plots: Iterable[str] = ()
    faint: frozenset[str] = frozenset()
    boxes: tuple[str, ...] = ("edges",)
    moments: tuple[str, ...] = ()
    arrows: frozenset[str] = frozenset()


def page(shown: Shown, camera: Camera, seconds: float) -> str:
    """The HTML; seconds : playing time of the whole film [s]."""
    numbers = _Numbers()
    about = json.dumps(_about(shown, camera, seconds, numbers), separators=(",", ":"), ensure_ascii=False)
    web = files("ffr_dyn.pictures").joinpath("web")
    parts = {
        "TITLE": _escaped(shown.title or "Motion of a multibody system"),
        "STYLE": web.joinpath("page.css").read_text("utf-8"),
        "ABOUT": about.replace("<", "\\u003c"),
        "NUMBERS": base64.b64encode(zlib.compress(b"".join(numbers.parts), 9)).decode(),
        "SCRIPT": "\n".join(web.joinpath(f"{name}.js").read_text("utf-8") for name in _SCRIPTS),
    }
    text = web.joinpath("page.html").read_text("utf-8")
    for key, value in parts.items():
        text = text.replace(f"@{key}@", value)
    return text


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


class _Numbers:
    """Arrays one after the other, each at a multiple of four bytes, equal ones once."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self._known: dict[bytes, list[Any]] = {}
        self._size = 0

    def keep(self, values: Array, kind: str = "f4") -> list[Any]:
        """The reference [type, offset in bytes, length] under which the page finds the values; of a history "h2", which is
        rounded to whole numbers of the fourth."""
        if kind == "h2":
            scale = float(np.abs(values).max(initial=0.0)) / _LARGEST or 1.0
            return ["h2", *self.keep(np.round(values / scale), "i2")[1:], scale]
        content = np.ascontiguousarray(values, "<" + kind).tobytes()
        key = kind.encode() + content
        if key not in self._known:
            self._known[key] = [kind, self._size, int(np.size(values))]
            self.parts.append(content + bytes(-len(content) % 4))
            self._size += len(self.parts[-1])
        return self._known[key]


# ---- what the viewer reads -------------------------------------------------------------------------------------------


def _about(shown: Shown, camera: Camera, seconds: float, numbers: _Numbers) -> Item:
    film, extent = shown.film, shown.film.high - shown.film.low
    factor, unit = readable("s", float(np.abs(film.times).max()))
    far = ((film.low > 0) | (film.high < 0)).any()
    return {
        **_bodies(shown, numbers),
        "times": numbers.keep(film.times),
        "seconds": seconds,
        "clock": {"factor": factor, "unit": unit},
        "moments": list(shown.moments),
        "camera": {"direction": list(camera.direction), "up": list(camera.up)},
        "centre": film.centre.tolist(),
        "extent": extent.tolist(),
        "size": film.size or 1.0,
        "triad": {"at": (film.low if far else np.zeros(3)).tolist()},
        "scale": film.scale,
        "most": max(10.0, 10.0 * film.scale),
        "colour": 0,
        "colours": [_colour(shade, numbers) for shade in shown.shades],
        "boxes": list(shown.boxes),
        "traces": [
            {"name": name, "colour": colour, "shown": True, "points": numbers.keep(path)}
            for (name, path), colour in zip(film.traces.items(), TRACE_COLOURS * len(film.traces), strict=False)
        ],
        **_beside(shown, numbers),
        "series": _series(shown, numbers),
    }


def _colour(shade: Shade, numbers: _Numbers) -> Item:
    factor, unit = readable(shade.unit, max(abs(shade.low), abs(shade.high)))
    stops = colormaps[shade.colour_map](np.linspace(0.0, 1.0, _STOPS))[:, :3] if shade.colour_map else None
    return {
        "words": shade.words,
        "kind": shade.kind,
        "measure": shade.measure,
        "unit": unit,
        "factor": factor,
        "low": shade.low,
        "high": shade.high,
        "bodies": sorted(shade.bodies),
        "map": None if stops is None else numbers.keep(np.round(255 * stops), "u1"),
    }


def _beside(shown: Shown, numbers: _Numbers) -> Item:
    beside = shown.beside
    joints = [
        {
            "name": joint.name,
            "kind": joint.kind,
            "label": joint.label,
            "shown": True,
            "at": numbers.keep(joint.at, "h2"),
            "axis": None if joint.axis is None else numbers.keep(joint.axis, "h2"),
        }
        for joint in beside.joints
    ]
    arrows = [
        {
            "name": load.name,
            "unit": load.unit,
            "shown": "forces" in shown.boxes or load.name in shown.arrows,
            "largest": max(load.largest, beside.least(load, shown.film.size)),
            **(_spread(load, numbers) if isinstance(load, SpreadShown) else _at_point(load, numbers)),
        }
        for load in beside.loads
    ]
    seen = "markers" in shown.boxes
    markers = [{"name": name, "shown": seen, "at": numbers.keep(at, "h2")} for name, at in beside.markers.items()]
    return {"joints": joints, "arrows": arrows, "markers": markers}


def _at_point(arrow: ArrowShown, numbers: _Numbers) -> Item:
    return {"at": numbers.keep(arrow.at, "h2"), "vector": numbers.keep(arrow.vector, "h2")}


def _spread(load: SpreadShown, numbers: _Numbers) -> Item:
    """A load on a surface, whose places move with the frame of the body and with its deformation."""
    return {
        "turns": load.in_body_axes,
        "pose": numbers.keep(_poses(load.R, load.A)),
        "at": numbers.keep(load.at),
        "moved": numbers.keep(load.moved, "h2"),
        "vector": numbers.keep(load.vector),
        "inward": numbers.keep(load.inward),
        "factor": numbers.keep(load.factor, "h2"),
    }


def _series(shown: Shown, numbers: _Numbers) -> list[Item]:
    """The histories that can be plotted: all components of quantities, until there is no more room."""
    if shown.result is None:
        return []
    wanted, found, room = set(shown.result.components(shown.plots)), [], _MOST_HISTORIES
    for name, quantity in shown.result.quantities.items():
        own = list(shown.result.components([name]))
        room -= quantity.values.size
        if not wanted & set(own) and (name.endswith(_NOT_PLOTTED) or room < 0):
            continue
        values, unit = numbers.keep(filled(quantity.values), "h2"), pretty(quantity.unit) or "1"
        found += [
            {"name": one, "unit": unit, "values": values, "of": len(own), "column": k, "chosen": one in wanted}
            for k, one in enumerate(own)
        ]
    return found


# ---- bodies ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Piece:
    """A surface that moves as one: poses (T, 7) R and p, elastic coordinates (T, n), and the number of the piece whose frame
    deformation is seen from."""

    name: str
    surface: Surface
    pose: Array
    q: Array
    frame: int
    parted: bool
    colour: str


def _bodies(shown: Shown, numbers: _Numbers) -> Item:
    drawn = pieces(shown.film)
    groups: dict[Any, list[Piece]] = {}
    for piece in drawn:
        groups.setdefault(_same(piece.surface), []).append(piece)
    surfaces, bodies = list[Item](), dict[int, Item]()
    for number, group in enumerate(groups.values()):
        item, own = _surface(group, numbers)
        surfaces.append(item)
        bodies |= {id(piece): {**own[k], "surface": number} for k, piece in enumerate(group)}
    return {
        "surfaces": surfaces,
        "bodies": [
            {
                "name": piece.name,
                "colour": _GREY if piece.name in shown.faint else piece.colour,
                "faint": piece.name in shown.faint,
                "frame": piece.frame,
                "parted": piece.parted,
                "pose": numbers.keep(piece.pose),
                **bodies[id(piece)],
            }
            for piece in drawn
        ],
    }


def _same(surface: Surface) -> tuple[bytes, ...]:
    """Equal for surfaces with equal numbers."""
    return tuple(
        hashlib.sha256(np.asarray(of).tobytes()).digest() for of in (surface.points, surface.triangles, surface.Phi)
    )


def pieces(film: Film) -> list[Piece]:
    """All that moves: bodies, each part of bodies in parts, rods for bodies without a surface."""
    colours, found = iter(BODY_COLOURS * (1 + len(film.solids) + len(film.links))), list[Piece]()
    share = MOST_TRIANGLES / max(1, sum(len(solid.surface.triangles) for solid in film.solids))
    coarse = _coarsened(share)
    for solid in film.solids:
        found += _of_solid(solid, next(colours), len(found), coarse)
    return found + [_of_link(link, next(colours), len(found) + k, film.size) for k, link in enumerate(film.links)]


def _coarsened(share: float) -> Callable[[Surface], Surface]:
    """Surfaces with about that share of their triangles; equal ones are worked on once."""
    known: dict[Any, Surface] = {}

    def found(surface: Surface) -> Surface:
        key = _same(surface)
        if key not in known:
            known[key] = decimated(surface, share)[0]
        return known[key]

    return found if share < 1 else lambda surface: surface


def _of_solid(solid: Solid, colour: str, number: int, coarse: Callable[[Surface], Surface]) -> list[Piece]:
    """The body; of one in parts each part, whose deformation is seen from the frame of the first."""
    if solid.parts is None:
        return [Piece(solid.name, coarse(solid.surface), _poses(solid.R, solid.A), solid.q, number, False, colour)]
    found = []
    for k in range(solid.parts.R.shape[1]):
        chosen = np.flatnonzero(solid.parts.of == k)
        inside = np.isin(solid.surface.triangles, chosen).all(axis=1)
        triangles = np.searchsorted(chosen, solid.surface.triangles[inside])
        surface = some_points(solid.surface, chosen, triangles)
        pose = _poses(solid.parts.R[:, k], solid.parts.A[:, k])
        found.append(Piece(solid.name, surface, pose, solid.q, number, True, colour))
    return found


def _of_link(link: Link, colour: str, number: int, size: float) -> Piece:
    """A body without a surface as rods between its markers, each end carried by its marker."""
    places = np.einsum("fij,fmi->fmj", link.A, link.points - link.R[:, None])
    still = places[0]
    surface, owner = rods(still, link.pairs, _THICK * size or 1.0)
    Phi = np.zeros((len(surface.points), 3, 3 * len(still)))
    for c in range(3):
        Phi[np.arange(len(owner)), c, 3 * owner + c] = 1.0
    moved = (places - still).reshape(len(places), -1)
    if np.abs(moved).max(initial=0.0) < _RIGID * np.abs(still).max(initial=1e-300):
        Phi, moved = Phi[:, :, :0], moved[:, :0]
    pose = _poses(link.R, link.A)
    return Piece(link.name, Surface(surface.points, surface.triangles, Phi), pose, moved, number, False, colour)


def rods(points: Array, pairs: Array, radius: float) -> tuple[Surface, Array]:
    """Prisms between pairs (E, 2) of points (M, 3), and a knob at each point; and the point (P,) that carries each corner."""
    corners, triangles, owner = list[Array](), list[Array](), list[int]()
    lines = [(a, b, points[b] - points[a], radius) for a, b in pairs]
    lines += [(k, k, np.array([0.0, 0.0, 3.6 * radius]), 1.8 * radius) for k in range(len(points))]
    for a, b, along, thick in lines:
        if not along.any():
            continue
        shift = 0.5 * along if a == b else np.zeros(3)
        ring = thick * _ring(along)
        start, sides = len(owner), np.arange(_SIDES)
        corners += [points[a] - shift + ring, points[b] + shift + ring]
        owner += [int(a)] * _SIDES + [int(b)] * _SIDES
        after = (sides + 1) % _SIDES
        triangles += [start + np.stack(side, axis=1) for side in (
            (sides, after, _SIDES + after), (sides, _SIDES + after, _SIDES + sides),
            (0 * sides[2:], after[1:-1], sides[1:-1]), (_SIDES + 0 * sides[2:], _SIDES + sides[1:-1], _SIDES + after[1:-1]),
        )]  # fmt: skip
    found = Surface(np.concatenate(corners), np.concatenate(triangles), np.zeros((len(owner), 3, 0)))
    return found, np.array(owner)


def _ring(along: Array) -> Array:
    """(sides, 3) points around a direction, at a distance of one."""
    least = np.eye(3)[np.argmin(np.abs(along))]
    a = np.cross(along, least)
    a /= np.linalg.norm(a)
    b = np.cross(along / np.linalg.norm(along), a)
    turn = 2 * np.pi * np.arange(_SIDES)[:, None] / _SIDES
    return np.asarray(np.cos(turn) * a + np.sin(turn) * b)


def _poses(R: Array, A: Array) -> Array:
    """(T, 7): R, and Euler parameters that do not jump."""
    from scipy.spatial.transform import Rotation

    p = np.roll(Rotation.from_matrix(A).as_quat(), 1, axis=1)
    flips = np.where(np.einsum("ti,ti->t", p[1:], p[:-1]) < 0, -1.0, 1.0)
    return np.concatenate([R, p * np.cumprod([1.0, *flips])[:, None]], axis=1)


def _surface(group: Sequence[Piece], numbers: _Numbers) -> tuple[Item, list[Item]]:
    """A surface with the shapes of all bodies that have it, and of each body its weights."""
    surface, q = group[0].surface, np.concatenate([piece.q for piece in group])
    linear = morph(surface.Phi, q, MOST_SHAPES * 2 // 3)
    bent = morph(*quadratic(surface.second, surface.Phi, q), MOST_SHAPES // 3)
    deformed = beside(linear, bent)
    tensor = np.zeros((len(surface.points), 6, q.shape[1])) if surface.stress is None else surface.stress
    second, weights = quadratic(surface.second_stress, tensor, q)
    stress = morph(np.concatenate([tensor, second], axis=2), np.concatenate([q, weights], axis=1), MOST_TENSORS)
    item = {
        "points": numbers.keep(surface.points),
        "triangles": numbers.keep(surface.triangles, "u4"),
        "edges": numbers.keep(sharp_edges(surface.points, surface.triangles), "u4"),
        "closed": is_closed(surface.points, surface.triangles),
        "moduli": None if surface.moduli is None else numbers.keep(surface.moduli),
        "linear": len(linear.scales),
        "shapes": numbers.keep(np.moveaxis(deformed.shapes, 2, 1), "i2"),
        "scales": deformed.scales.tolist(),
        "tensors": numbers.keep(np.moveaxis(stress.shapes, 2, 1), "i2"),
        "tensorScales": stress.scales.tolist(),
    }
    split = [np.split(of.weights, len(group)) for of in (deformed, stress)]
    own = [{"weights": numbers.keep(w, "h2"), "tensors": numbers.keep(t, "h2")} for w, t in zip(*split, strict=True)]
    return item, own


def decimated(surface: Surface, share: float) -> tuple[Surface, Array]:
    """A coarser surface of about that share of the triangles; its points are points of the given one, with these numbers."""
    import pyvista as pv
    from scipy.spatial import cKDTree

    coarse = pv.PolyData.from_regular_faces(np.array(surface.points), np.array(surface.triangles)).decimate(1.0 - share)
    nearest = cKDTree(surface.points).query(coarse.points)[1]
    return some_points(surface, nearest, coarse.regular_faces), nearest
