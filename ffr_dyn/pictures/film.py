"""The arrays of an animation: poses and elastic coordinates of the bodies at the times of the pictures.

A point with the undeformed position u_0 in the body frame is drawn at R + A(p) (u_0 + u(scale q)), with the displacement
u(q) = Phi q + u_2(q), u_2 where the body has a second order: a beam that bends keeps its length. The scale exaggerates the
deformation only. Flexible bodies may be coloured by a field on their surface: the elastic displacement or a measure of stress
or strain. Everything here comes from the result alone and is independent of how it is rendered.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from textwrap import wrap
from typing import Any

import numpy as np

from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.results.result import Result
from ffr_dyn.results.stress import values_at
from ffr_dyn.results.wholes import parts_of, with_wholes
from ffr_dyn.scene.stress_sensors import MEASURES, Measure
from ffr_prep.body import Surface
from ffr_prep.body import displacements as surface_displacements
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import readable

# Muted Okabe-Ito colours for bodies, so that the deformation stays the loudest; full ones for paths.
BODY_COLOURS = ("#8FB4D0", "#E0B48A", "#93C4B0", "#D9B3C8", "#C9BE86", "#A9CFE6", "#B0B0B0")
TRACE_COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")
# What flexible bodies may be coloured by; "body" leaves every body plain, in a colour of its own.
COLOURS = ("deformation", "body", *MEASURES)
# For sizes, for stress and for values with a sign, by their names in matplotlib.
_SEQUENTIAL, _STRESS, _DIVERGING = "viridis", "turbo", "coolwarm"

# The share of its own size by which the automatic scale deflects the most flexible body.
_AUTOMATIC_SHARE = 0.05
_PLANAR_TOLERANCE = 1e-6
_TITLE_WIDTH = 13
# From where a plane is seen, by its normal, and the level part of what a corner is seen along, by the axis that is up.
_FRONTS = {"z": np.array([0.0, 0.0, 1.0]), "y": np.array([0.0, -1.0, 0.0]), "x": np.array([1.0, 0.0, 0.0])}
_CORNERS = (np.array([0.0, -1.0, 0.75]), np.array([0.75, 0.0, 1.0]), np.array([0.75, -1.0, 0.0]))
_BATCH = 400_000  # points times moments
_ARM, _DOT = (
    0.3,
    1e-3,
)  # of the largest radius of gyration: of the cross of a body; of it, what extends no farther is a dot


@dataclass(frozen=True, eq=False)
class Parts:
    """Where the parts of a body are: of (P,) which part has each point of its surface; R (F, K, 3) [m], A (F, K, 3, 3)."""

    of: Array
    R: Array
    A: Array


@dataclass(frozen=True, eq=False)
class Solid:
    """A body with a surface. R (F, 3) [m], A (F, 3, 3), q (F, n) [m sqrt(kg)] at the F times; n = 0 if it is rigid.

    parts : of a body in parts, whose R and A are those of the first of them
    """

    name: str
    surface: Surface
    R: Array
    A: Array
    q: Array
    parts: Parts | None = None

    @property
    def is_flexible(self) -> bool:
        """Whether the body has elastic coordinates."""
        return bool(self.q.shape[1] > 0)

    @property
    def size(self) -> float:
        """Diagonal of the undeformed body's box [m]."""
        return float(np.linalg.norm(np.ptp(self.surface.points, axis=0)))


@dataclass(frozen=True, eq=False)
class Link:
    """A body without a surface: the points (F, M, 3) [m] of its markers, and the pairs (E, 2) of them to be joined; its pose
    R (F, 3) [m], A (F, 3, 3)."""

    name: str
    points: Array
    pairs: Array
    R: Array
    A: Array


@dataclass(frozen=True, eq=False)
class Colouring:
    """A field on the surfaces of some bodies, shown as colours.

    words, unit : of the field, in SI symbols
    low, high   : the range of the colour bar, in that unit
    colour_map  : by its name in matplotlib
    bodies      : the names of the bodies that have the field
    values      : (solid, frame) -> (P,) the field at the surface points of a solid, in that unit
    """

    words: str
    unit: str
    low: float
    high: float
    colour_map: str
    bodies: frozenset[str]
    values: Callable[[Solid, int], Array]

    def readable(self) -> tuple[float, str]:
        """Factor and unit in which the range is read easily."""
        return readable(self.unit, max(abs(self.low), abs(self.high)))

    def title(self, line_break: str) -> str:
        """The title of the colour bar in short lines: "elastic", "displacement", "[mm]"."""
        _, unit = self.readable()
        return line_break.join([*wrap(self.words, _TITLE_WIDTH), *([f"[{unit}]"] if unit else [])])


@dataclass(frozen=True, eq=False)
class Film:
    """Bodies at the times (F,) [s] of the pictures.

    scale      : factor of the drawn deformation
    deflection : largest elastic displacement |u(q)| over bodies and times, not scaled [m]
    traces     : by marker, its path over all rows of the result (T, 3) [m]
    colouring  : what the colours of flexible bodies show; None leaves them plain
    marks      : words at points (3,) [m] that do not move
    forces, moments : arrows in each picture, from and to (F, N, 2, 3) [m]
    heading    : words in the corner of the picture, instead of time and scale
    low, high  : (3,) corners of a box that holds the whole motion [m]
    gravity    : (3,) [m/s^2] of the scene, zero where it is not known
    plane      : normal of the plane of the scene, "x", "y", "z" or "none"; nothing where only the motion tells
    """

    times: Array
    solids: tuple[Solid, ...]
    links: tuple[Link, ...]
    traces: dict[str, Array]
    scale: float
    deflection: float
    low: Array
    high: Array
    colouring: Colouring | None = None
    marks: dict[str, Array] = field(default_factory=dict)
    heading: str = ""
    forces: Array = field(default_factory=lambda: np.zeros((0, 0, 2, 3)))
    moments: Array = field(default_factory=lambda: np.zeros((0, 0, 2, 3)))
    gravity: Array = field(default_factory=lambda: np.zeros(3))
    plane: str = ""

    @property
    def size(self) -> float:
        """Diagonal of the box of the whole motion [m]."""
        return float(np.linalg.norm(self.high - self.low))

    @property
    def centre(self) -> Array:
        """(3,) middle of the box of the whole motion [m]."""
        found: Array = 0.5 * (self.low + self.high)
        return found

    @property
    def corners(self) -> Array:
        """(8, 3) corners of the box of the whole motion [m]."""
        return _corners(self.low, self.high)

    def clock(self, frame: int) -> str:
        """The time of a picture as it is written in it, with a fitting unit and number of digits: "25.0 ms"."""
        factor, unit = readable("s", float(np.abs(self.times).max()))
        span = factor * float(np.ptp(self.times)) or 1.0
        return f"{self.times[frame] * factor:.{max(0, 2 - math.floor(math.log10(span)))}f} {unit}"

    def caption(self, frame: int) -> str:
        """The text in the corner of a picture."""
        return self.heading or f"t = {self.clock(frame)}     {self.scale_note()}"

    def scale_note(self) -> str:
        """The scale as it is written in the picture, "deformation × 20"; nothing when it is one or all is rigid."""
        return f"deformation × {self.scale:g}" if self.deflection > 0 and self.scale != 1.0 else ""


@dataclass(frozen=True)
class Camera:
    """A view: the direction (3,) from the scene towards the eye, and the direction (3,) that is up in the picture."""

    direction: tuple[float, float, float]
    up: tuple[float, float, float]

    def axes(self) -> tuple[Array, Array, Array]:
        """Unit vectors (3,): towards the eye, to the right, up. InputError if direction and up are parallel or zero."""
        direction, right = np.asarray(self.direction, float), np.cross(self.up, self.direction)
        if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(direction) * np.linalg.norm(self.up):
            raise InputError(f"camera: up {self.up} must not be parallel to the direction {self.direction}, nor zero")
        direction, right = direction / np.linalg.norm(direction), right / np.linalg.norm(right)
        return direction, right, np.cross(direction, right)


def film(
    result: Result,
    frames: int,
    *,
    scale: float | str = 1.0,
    traces: Iterable[str] = (),
    colour: str = "deformation",
    limit: float | None = None,
) -> Film:
    """The bodies of a result at ``frames`` equally spaced times; between rows, poses and coordinates are interpolated.

    scale  : factor of the drawn deformation, not negative; "auto": a round one for deflections of about 5 % of a body
    traces : markers ("rod.small_eye") whose paths are drawn
    colour : one of COLOURS: what flexible bodies are coloured by
    limit  : end of the colour bar [m, Pa or 1]; the largest value over bodies and pictures when not given

    Raises InputError for no rows, no body, an unknown marker, a scale, colour or limit that cannot be used, infinite
    values, and a colour by stress when no body has stress modes.
    """
    _require_motion(result)
    return film_at(
        result,
        np.linspace(result.time[0], result.time[-1], frames),
        scale=scale,
        traces=traces,
        colour=colour,
        limit=limit,
    )


def film_at(
    result: Result,
    times: Array,
    *,
    scale: float | str = 1.0,
    traces: Iterable[str] = (),
    colour: str = "deformation",
    limit: float | None = None,
) -> Film:
    """As `film`, at the given times (F,) [s]."""
    _require_motion(result)
    if not (scale == "auto" or (isinstance(scale, int | float) and 0 <= scale < math.inf)):
        raise InputError(f"scale is {scale!r}; it must be a number that is not negative, or 'auto'")
    if limit is not None and not 0 < limit < math.inf:
        raise InputError(f"the end of the colour bar is {limit}; it must be a positive number")
    in_parts, apart = parts_of(result), result
    result = with_wholes(result)
    solids = tuple(
        _with_parts(_solid(result, name, times), apart, times, in_parts.get(name, []))
        for name in result.geometry
        if f"{name}.R" in result.quantities
    )
    drawn = {*result.geometry, *(part for parts in in_parts.values() for part in parts)}
    links = tuple(_link(result, name, times) for name in _bodies(result) if name not in drawn)
    if not solids and not links:
        raise InputError(
            "nothing to animate: the result has no body (quantities <body>.R and <body>.p); run the scene with "
            "outputs = [\"default\"], or --keep 'BODY.R' --keep 'BODY.p' beside others"
        )
    deflections = [_largest_displacement(solid) for solid in solids]
    factor = _automatic_scale(solids, deflections) if scale == "auto" else float(scale)
    paths = {name: result[f"{name}.position"] for name in traces}
    low, high = _box(solids, links, paths, [factor * deflection for deflection in deflections])
    deflection = max(deflections, default=0.0)
    shades = colouring(solids, len(times), colour, deflection, limit)
    weight = np.asarray(result.attributes.get("gravity", np.zeros(3)), float)
    return Film(times, solids, links, paths, factor, deflection, low, high, shades, gravity=weight)


def _require_motion(result: Result) -> None:
    """InputError for a result that has no rows, or is of an analysis without motions of bodies."""
    if result.quantities and not any("." in name for name in result.quantities):
        raise InputError(
            f"nothing to animate: the result of {result.attributes.get('analysis', 'this')!r} has no motion of bodies; plot "
            f"its quantities, or export them as .csv or .mat: {', '.join(result.quantities)}"
        )
    if result.time.size == 0:
        raise InputError(
            "nothing to animate: the result has no rows; its run was stopped before the first: run the scene again"
        )


# ---- colours ------------------------------------------------------------------------------------------------------


def colouring(
    solids: Iterable[Solid], frames: int, colour: str, deflection: float, limit: float | None
) -> Colouring | None:
    """The field that the name of a colour means for these bodies; None where there is nothing to show.

    Raises InputError for an unknown name, and for stress when no body has stress modes.
    """
    if colour not in COLOURS:
        raise InputError(f"colour is {colour!r}; it must be one of: {', '.join(COLOURS)}")
    flexible = [solid for solid in solids if solid.is_flexible]
    if colour == "body" or not flexible:
        return None
    if colour == "deformation":
        names = frozenset(solid.name for solid in flexible)
        high = limit or deflection
        return Colouring("elastic displacement", "m", 0.0, high, _SEQUENTIAL, names, displacements) if high else None
    return _stress_colouring(flexible, frames, MEASURES[colour], limit)


def _stress_colouring(flexible: list[Solid], frames: int, of: Measure, limit: float | None) -> Colouring | None:
    stressed = [solid for solid in flexible if solid.surface.stress is not None]
    if not stressed:
        raise InputError(
            f"no body can be coloured by {of.words}: none has stress modes; reduce one with them "
            "(ffr-prep reduce --stress) and run again"
        )

    def values(solid: Solid, frame: int) -> Array:
        return values_at(solid.surface, solid.q[frame : frame + 1], of)[:, 0]

    largest = max(largest_value(solid, of, slice(0, frames)) for solid in stressed)
    high = limit or largest
    return measure_colours(of, high, frozenset(solid.name for solid in stressed), values) if high else None


def measure_colours(
    of: Measure, high: float, bodies: frozenset[str], values: Callable[[Solid, int], Array]
) -> Colouring:
    """A measure as colours from none to `high`, or for one with a sign from -high (blue) to high (red)."""
    low, shades = (-high, _DIVERGING) if of.signed else (0.0, _STRESS)
    return Colouring(of.words, of.unit, low, high, shades, bodies, values)


def is_coloured(shown: Film, solid: Solid) -> bool:
    """Whether the body is coloured by a field."""
    return shown.colouring is not None and solid.name in shown.colouring.bodies


# ---- points -------------------------------------------------------------------------------------------------------


def body_points(solid: Solid, frame: int, scale: float) -> Array:
    """(P, 3) deformed points in the body frame, u_0 + u(scale q) [m]; of parts, which turn, u_0 + scale u(q)."""
    if solid.parts is not None:
        return solid.surface.points + scale * displaced(solid, frame)
    return solid.surface.points + surface_displacements(solid.surface, scale * solid.q[frame])


def displaced(solid: Solid, frame: int) -> Array:
    """(P, 3) elastic displacements u(q) in the body frame [m]; those of parts are seen from the frame of the first."""
    points, elastic = solid.surface.points, surface_displacements(solid.surface, solid.q[frame])
    if solid.parts is None:
        return elastic
    R, A = solid.parts.R[frame, solid.parts.of], solid.parts.A[frame, solid.parts.of]
    there = R + np.einsum("pij,pj->pi", A, points + elastic)
    return np.asarray((there - solid.R[frame]) @ solid.A[frame] - points)


def drawn_points(solid: Solid, frame: int, scale: float) -> Array:
    """(P, 3) points in the global frame, R + A (u_0 + u(scale q)) [m]."""
    found: Array = solid.R[frame] + body_points(solid, frame, scale) @ solid.A[frame].T
    return found


def displacements(solid: Solid, frame: int) -> Array:
    """(P,) sizes of the elastic displacements u(q), not scaled [m]."""
    found: Array = np.linalg.norm(displaced(solid, frame), axis=1)
    return found


def _largest_displacement(solid: Solid) -> float:
    """Over points and times [m]."""
    if solid.parts is not None:
        return float(max(displacements(solid, k).max() for k in range(len(solid.q))))
    found = (surface_displacements(solid.surface, q) for q in _in_batches(solid, solid.q))
    return max(float(np.sqrt((u * u).sum(axis=-1).max(initial=0.0))) for u in found)


def largest_value(solid: Solid, of: Measure, frames: Any = slice(None)) -> float:
    """The largest size of a measure of stress or strain over points and some times [Pa or 1]."""
    batches = _in_batches(solid, solid.q[frames])
    return max(float(np.abs(values_at(solid.surface, q, of)).max(initial=0.0)) for q in batches)


def _in_batches(solid: Solid, q: Array) -> list[Array]:
    """The coordinates in pieces, for each of which the tensors of all points are some tens of megabytes."""
    return np.array_split(q, max(1, len(q) * len(solid.surface.points) // _BATCH))


def camera_for(shown: Film) -> Camera:
    """Planar motion is seen nearly from its front, slightly from above and the right; spatial motion from a corner.

    Up is against gravity; without gravity in the picture y is up in the plane xy (x to the right), and z elsewhere.
    """
    for axis, front in _FRONTS.items():
        if shown.plane == axis or (not shown.plane and _is_planar(shown, "xyz".index(axis))):
            up = _upwards(shown.gravity * (np.eye(3)["xyz".index(axis)] == 0), "y" if axis == "z" else "z")
            return _camera(front + 0.20 * np.cross(up, front) + 0.28 * up, up)
    up = _upwards(shown.gravity, "z")
    return _camera(_CORNERS[int(np.argmax(np.abs(up)))] + 0.6 * up, up)


def _upwards(gravity: Array, default: str) -> Array:
    """(3,) the axis against gravity (3,)."""
    along = int(np.argmax(np.abs(gravity)))
    found: Array = -np.sign(gravity[along]) * np.eye(3)[along] if gravity.any() else np.eye(3)["xyz".index(default)]
    return found


def _camera(direction: Array, up: Array) -> Camera:
    return Camera((direction[0], direction[1], direction[2]), (up[0], up[1], up[2]))


# ---- from the result to the times of the pictures -----------------------------------------------------------------


def _bodies(result: Result) -> list[str]:
    names = [name.removesuffix(".R") for name in result.quantities if name.endswith(".R")]
    return [name for name in names if f"{name}.p" in result.quantities]


def _solid(result: Result, name: str, times: Array) -> Solid:
    surface = result.geometry[name]
    n = surface.Phi.shape[2]
    q = result[f"{name}.q"] if n else np.zeros((result.time.size, 0))
    if q.shape[1] != n:
        raise InputError(f"body {name!r} has {q.shape[1]} elastic coordinates, but its surface has {n} mode shapes")
    R = _at(times, result.time, result[f"{name}.R"], name)
    return Solid(name, surface, R, _rotations(times, result, name), _at(times, result.time, q, name))


def _with_parts(solid: Solid, result: Result, times: Array, names: list[str]) -> Solid:
    """The solid with the poses of its parts, if it has any."""
    if not names:
        return solid
    counts = [len(result.geometry[name].points) for name in names]
    R = np.stack([_at(times, result.time, result[f"{name}.R"], name) for name in names], axis=1)
    A = np.stack([_rotations(times, result, name) for name in names], axis=1)
    return replace(solid, parts=Parts(np.repeat(np.arange(len(names)), counts), R, A))


def _rotations(times: Array, result: Result, name: str) -> Array:
    p = result[f"{name}.p"]
    # p and -p are the same rotation: stay on one sheet, or the interpolation would pass through a wrong one.
    flips = np.where(np.einsum("ti,ti->t", p[1:], p[:-1]) < 0, -1.0, 1.0)
    p = _at(times, result.time, p * np.cumprod([1.0, *flips])[:, None], name)
    return rotation_matrix(p / np.linalg.norm(p, axis=1, keepdims=True))


def _at(times: Array, rows: Array, values: Array, name: str) -> Array:
    if not np.isfinite(values).all():
        raise InputError(f"body {name!r} has poses or elastic coordinates that are not finite; it cannot be drawn")
    columns = values.reshape(len(values), -1).T
    return np.array([np.interp(times, rows, column) for column in columns]).T.reshape(len(times), *values.shape[1:])


def _link(result: Result, name: str, times: Array) -> Link:
    ending = ".position"
    markers = [key for key in result.quantities if key.startswith(f"{name}.") and key.endswith(ending)]
    histories = [result[key] for key in markers]
    if len(markers) < 2:
        histories.insert(0, result[f"{name}.R"])
    points = np.stack([_at(times, result.time, history, name) for history in histories], axis=1)
    R, A = _at(times, result.time, result[f"{name}.R"], name), _rotations(times, result, name)
    arm = _ARM * result.attributes.get("length", 0.0)
    if np.ptp(points, axis=1).max(initial=0.0) < _DOT * arm:  # which shows neither place nor rotation
        cross = np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
        points = points[:, :1] + arm * np.einsum("fij,kj->fki", A, cross)
    return Link(name, points, _spanning_tree(points[0]), R, A)


def _spanning_tree(points: Array) -> Array:
    """(M - 1, 2) the pairs that join all points with the least length (Prim 1957)."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    joined, left, pairs = [0], set(range(1, len(points))), []
    while left:
        _, a, b = min((distance[a, b], a, b) for a in joined for b in left)
        pairs.append((a, b))
        joined.append(b)
        left.remove(b)
    return np.array(pairs, dtype=int).reshape(-1, 2)


# ---- scale, extent, plane -----------------------------------------------------------------------------------------


def _automatic_scale(solids: Iterable[Solid], deflections: list[float]) -> float:
    """The number 1, 2 or 5 times a power of ten nearest to the wanted factor, but never a reduction."""
    shares = [deflection / solid.size for solid, deflection in zip(solids, deflections, strict=True) if solid.size > 0]
    if max(shares, default=0.0) == 0.0:
        return 1.0
    wanted = _AUTOMATIC_SHARE / max(shares)
    decade = 10.0 ** math.floor(math.log10(wanted))
    nearest = min((1, 2, 5, 10), key=lambda digit: abs(math.log(digit * decade / wanted)))
    return max(1.0, nearest * decade)


def _box(
    solids: Iterable[Solid], links: Iterable[Link], paths: dict[str, Array], margins: list[float]
) -> tuple[Array, Array]:
    clouds = [link.points.reshape(-1, 3) for link in links] + list(paths.values())
    for solid, margin in zip(solids, margins, strict=True):
        low, high = solid.surface.points.min(axis=0) - margin, solid.surface.points.max(axis=0) + margin
        corners = _corners(low, high)
        clouds.append((solid.R[:, None] + np.einsum("fij,cj->fci", solid.A, corners)).reshape(-1, 3))
    points = np.concatenate(clouds)
    return points.min(axis=0), points.max(axis=0)


def _corners(low: Array, high: Array) -> Array:
    return np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(8, 3)


def _is_planar(shown: Film, axis: int) -> bool:
    """Whether all bodies move in planes normal to that axis of the global frame."""
    heights = [solid.R[:, axis] for solid in shown.solids] + [link.points[..., axis] for link in shown.links]
    turns = [np.einsum("fj,j->f", solid.A[:, axis], solid.A[0, axis]) for solid in shown.solids]
    flat = all(np.ptp(height, axis=0).max() <= _PLANAR_TOLERANCE * shown.size for height in heights)
    return flat and all((turn > 1.0 - _PLANAR_TOLERANCE).all() for turn in turns)
