"""The parts of a picture beside the bodies: joints with their axes, forces and moments, markers; as histories of a result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.results.result import Result
from ffr_prep.body import displacements, some_points
from ffr_prep.common.arrays import Array

_ROUNDING = 1e-9  # of the largest force or moment, up to which there is none
_NEGLIGIBLE = 1e-4  # moment over the largest force times the size of the picture
_POINT, _SURFACE = 0.25, 0.12  # lengths of the longest arrows, of the size of the picture
_VECTORS = (("force", "N"), ("moment", "N m"))


@dataclass(frozen=True, eq=False)
class JointShown:
    """A joint: places (T, 3) [m], unit axes (T, 3) in global axes or None, and a label such as "pin (revolute, motor)"."""

    name: str
    kind: str
    label: str
    at: Array
    axis: Array | None


@dataclass(frozen=True, eq=False)
class ArrowShown:
    """A force [N] or moment [N m] (T, 3), global axes, at places (T, 3) [m]; of: the joint, driver or force it comes from."""

    of: str
    name: str
    unit: str
    at: Array
    vector: Array

    def ends(self, row: int, length: float) -> tuple[Array, Array]:
        """Where the arrow begins and ends, each (1, 3) [m], if one of a unit is drawn with a length [m]."""
        return self.at[row][None], (self.at[row] + length * self.vector[row])[None]

    @property
    def largest(self) -> float:
        """The largest at any time [unit]."""
        return float(np.linalg.norm(self.vector, axis=1).max())


@dataclass(frozen=True, eq=False)
class SpreadShown:
    """A load on the surface of a body with its frame at R (T, 3) [m], A (T, 3, 3): arrows at few places, strongest first.

    at     : (N, 3) [m] the undeformed places, which have moved by (T, N, 3), both in body axes
    vector : (N, 3) [unit], in axes of the body or global ones, to be multiplied by the factor (T,)
    inward : (N,) 1 where an arrow ends at its place for a positive factor, -1 for a negative one, 0 where it begins there
    """

    of: str
    unit: str
    R: Array
    A: Array
    at: Array
    moved: Array
    vector: Array
    inward: Array
    factor: Array
    in_body_axes: bool

    @property
    def name(self) -> str:
        """By which the list of forces has it."""
        return self.of

    def ends(self, row: int, length: float) -> tuple[Array, Array]:
        """Where the arrows begin and end, each (N, 3) [m], if one of a unit is drawn with a length [m]."""
        A, factor = self.A[row], self.factor[row]
        vectors = length * factor * (self.vector @ A.T if self.in_body_axes else self.vector)
        begin = self.R[row] + (self.at + self.moved[row]) @ A.T - (self.inward * factor > 0)[:, None] * vectors
        return begin, begin + vectors

    @property
    def largest(self) -> float:
        """The largest of all arrows at any time [unit]."""
        return float(np.linalg.norm(self.vector, axis=1).max() * np.abs(self.factor).max())


@dataclass(frozen=True, eq=False)
class Connections:
    """Joints, forces and moments, loads on surfaces, and markers with their places (T, 3) [m] by name, those of the ground
    included."""

    joints: tuple[JointShown, ...]
    arrows: tuple[ArrowShown, ...]
    markers: Mapping[str, Array]
    spread: tuple[SpreadShown, ...] = ()

    @property
    def loads(self) -> tuple[ArrowShown | SpreadShown, ...]:
        """All that is drawn as arrows."""
        return (*self.arrows, *self.spread)

    def least(self, load: ArrowShown | SpreadShown, size: float) -> float:
        """What the measure of a moment at a point is at least [N m]: beside the forces of the picture less is nothing."""
        if isinstance(load, SpreadShown) or load.unit != "N m":
            return 0.0
        return _NEGLIGIBLE * size * max((other.largest for other in self.arrows if other.unit == "N"), default=0.0)

    def lengths(self, size: float) -> Iterator[tuple[ArrowShown | SpreadShown, float]]:
        """Every load, and with which length one of its unit is drawn [m] in a picture of this size [m].

        Forces at points have one measure, moments one; each load on a surface has its own.
        """
        longest = {
            unit: max((arrow.largest for arrow in self.arrows if arrow.unit == unit), default=0.0)
            for _, unit in _VECTORS
        }
        for arrow in self.arrows:
            yield arrow, _POINT * size / max(longest[arrow.unit], self.least(arrow, size))
        for load in self.spread:
            yield load, _SURFACE * size / (load.largest or 1.0)


def connections(result: Result) -> Connections:
    """Those of a result, as far as it tells: its attributes say what connects which markers."""
    told: Mapping[str, Any] = result.attributes.get("connections", {})
    markers = _places(result)
    shown = {name: of for name, of in told.items() if "axis" in of and of["kind"] != "driver"}
    joints = [_joint(result, name, of, markers) for name, of in shown.items() if of["at"][0] in markers]
    arrows = [arrow for name, of in told.items() for arrow in _arrows(result, name, of, markers)]
    largest = {
        unit: max((arrow.largest for arrow in arrows if arrow.unit == unit), default=0.0) for _, unit in _VECTORS
    }
    seen = (arrow for arrow in arrows if arrow.largest > _ROUNDING * largest[arrow.unit])
    spread = (_spread(result, name, of["spread"]) for name, of in told.items() if "spread" in of)
    return Connections(tuple(joints), tuple(seen), markers, tuple(load for load in spread if load is not None))


def _places(result: Result) -> dict[str, Array]:
    ending, ground = ".position", result.attributes.get("ground", {})
    names = [name.removesuffix(ending) for name in result.quantities if name.endswith(ending)]
    moving = {name: result[name + ending] for name in names if "." in name}
    still = {f"ground.{name}": np.tile(np.asarray(at, float), (result.time.size, 1)) for name, at in ground.items()}
    return moving | still


def _joint(result: Result, name: str, of: Mapping[str, Any], markers: Mapping[str, Array]) -> JointShown:
    driven = [f"driven by {driver}" for driver in of.get("drivers", ())]
    label, axis = f"{name} ({', '.join([of['kind'], *driven])})", of["axis"]
    turned = None if axis is None else _turned(result, of["at"][0].partition(".")[0], np.asarray(axis, float))
    return JointShown(name, of["kind"], label, markers[of["at"][0]], turned)


def _turned(result: Result, body: str, vector: Array) -> Array:
    """(T, 3) in global axes of a vector (3,) or its history (T, 3) in the axes of a body, of the ground by default."""
    history = np.broadcast_to(vector, (result.time.size, 3))
    return (
        np.asarray(np.einsum("tij,tj->ti", _axes(result, body), history))
        if f"{body}.p" in result.quantities
        else history
    )


def _axes(result: Result, body: str) -> Array:
    """(T, 3, 3) the axes of a body."""
    p = result[f"{body}.p"]
    return rotation_matrix(p / np.linalg.norm(p, axis=1, keepdims=True))


def _arrows(result: Result, name: str, of: Mapping[str, Any], markers: Mapping[str, Array]) -> list[ArrowShown]:
    """The loads on the last marker of a connection: those that a result recorded, else those that are said to be constant."""
    at, given = markers.get(of["at"][-1]) if of["at"] else None, of.get("constant", {})
    if at is None:
        return []
    found = []
    for what, unit in _VECTORS:
        recorded = result.quantities.get(f"{name}.{what}")
        vector = given.get(what) if recorded is None or recorded.values.shape != at.shape else recorded.values
        if vector is not None and {"axis", "axes"} & of.keys():
            body = of["at"][-1].partition(".")[0] if of.get("axes") == "body" else ""
            found.append(ArrowShown(name, f"{name}.{what}", unit, at, _turned(result, body, np.asarray(vector, float))))
    found += [arrow for one in of.get("efforts", ()) for arrow in _effort(result, name, one, markers)]
    if f"{name}.tension" in result.quantities and of["at"][0] in markers and len(of["at"]) == 2:
        found.append(_pull(name, result[f"{name}.tension"], markers[of["at"][0]], at))
    known = [(arrow, np.isfinite(arrow.vector).all(axis=-1)) for arrow in found]
    return [replace(arrow, vector=np.where(rows[..., None], arrow.vector, 0.0)) for arrow, rows in known if rows.any()]


def _effort(result: Result, name: str, of: Mapping[str, Any], markers: Mapping[str, Array]) -> Iterator[ArrowShown]:
    """A recorded number along a vector, or three in given axes, as it acts on the body of a marker."""
    quantity = f"{name}.{of['of']}"
    if of["at"] in markers and quantity in result.quantities:
        along = np.asarray(of["along"], float).reshape(-1, 3)
        vector = result[quantity].reshape(-1, len(along)) @ along
        yield ArrowShown(
            name, of.get("name", quantity), of["unit"], markers[of["at"]], _turned(result, of["body"], vector)
        )


def _spread(result: Result, name: str, of: Mapping[str, Any]) -> SpreadShown | None:
    """A load on a surface; None where the result kept too little of it."""
    body, recorded = of["body"], result.quantities.get(f"{name}.factor")
    if body not in result.geometry or not {f"{body}.R", f"{body}.p"} <= result.quantities.keys():
        return None
    if recorded is None and "factor" not in of:
        return None
    factor = np.broadcast_to(of["factor"] if recorded is None else recorded.values, result.time.shape)
    corners, surface = np.array(of["corners"]), result.geometry[body]
    places, index = np.unique(corners, return_inverse=True)
    own, index = some_points(surface, places, np.zeros((0, 3), int)), index.reshape(corners.shape)
    moved = np.zeros((result.time.size, *own.points.shape))
    if f"{body}.q" in result.quantities and np.shape(result[f"{body}.q"])[1] == own.Phi.shape[2]:
        moved = displacements(own, result[f"{body}.q"])
    vector, inward = (np.array(of[key], float) for key in ("vectors", "inward"))
    here = own.points[index].mean(axis=1), moved[:, index].mean(axis=2), vector, inward
    return SpreadShown(name, of["unit"], result[f"{body}.R"], _axes(result, body), *here, factor, of["axes"] == "body")


def _pull(name: str, tension: Array, i: Array, j: Array) -> ArrowShown:
    """A tension along the line of two points, as it pulls the second."""
    line = i - j
    length = np.maximum(np.linalg.norm(line, axis=1, keepdims=True), np.finfo(float).tiny)
    return ArrowShown(name, f"{name}.tension", "N", j, tension[:, None] * line / length)
