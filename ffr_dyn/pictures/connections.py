"""The parts of a picture beside the bodies: joints with their axes, forces and moments, markers; as histories of a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array

_ROUNDING = 1e-9  # of the largest force or moment, up to which there is none
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
    """A force [N] or moment [N m] (T, 3), global axes, at places (T, 3) [m]."""

    name: str
    unit: str
    at: Array
    vector: Array


@dataclass(frozen=True, eq=False)
class Connections:
    """Joints, forces and moments, and markers with their places (T, 3) [m] by name, those of the ground included."""

    joints: tuple[JointShown, ...]
    arrows: tuple[ArrowShown, ...]
    markers: Mapping[str, Array]


def connections(result: Result) -> Connections:
    """Those of a result, as far as it tells: its attributes say what connects which markers."""
    told: Mapping[str, Any] = result.attributes.get("connections", {})
    markers = _places(result)
    shown = {name: of for name, of in told.items() if "axis" in of and of["kind"] != "driver"}
    joints = [_joint(result, name, of, markers) for name, of in shown.items() if of["at"][0] in markers]
    arrows = [arrow for name, of in told.items() for arrow in _arrows(result, name, of, markers)]
    largest = {unit: max((_size(arrow) for arrow in arrows if arrow.unit == unit), default=0.0) for _, unit in _VECTORS}
    seen = (arrow for arrow in arrows if _size(arrow) > _ROUNDING * largest[arrow.unit])
    return Connections(tuple(joints), tuple(seen), markers)


def _size(arrow: ArrowShown) -> float:
    return float(np.abs(arrow.vector).max(initial=0.0))


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
    if f"{body}.p" not in result.quantities:
        return history
    p = result[f"{body}.p"]
    A = rotation_matrix(p / np.linalg.norm(p, axis=1, keepdims=True))
    return np.asarray(np.einsum("tij,tj->ti", A, history))


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
            found.append(ArrowShown(f"{name}.{what}", unit, at, _turned(result, body, np.asarray(vector, float))))
    if f"{name}.tension" in result.quantities and of["at"][0] in markers and len(of["at"]) == 2:
        found.append(_pull(f"{name}.tension", result[f"{name}.tension"], markers[of["at"][0]], at))
    return [arrow for arrow in found if np.isfinite(arrow.vector).all()]


def _pull(name: str, tension: Array, i: Array, j: Array) -> ArrowShown:
    """A tension along the line of two points, as it pulls the second."""
    line = i - j
    length = np.maximum(np.linalg.norm(line, axis=1, keepdims=True), np.finfo(float).tiny)
    return ArrowShown(name, "N", j, tension[:, None] * line / length)
