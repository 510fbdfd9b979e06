"""From recorded states to the labelled result that every analysis returns, with the efforts and powers of the drivers."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.integration import geometry
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.step_error import Beside, step_errors, worst
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.kernels.tables import Record
from ffr_dyn.results.file import save_result
from ffr_dyn.results.quantities import DEFAULT_OUTPUTS, measure, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import COORDINATES, frames
from ffr_dyn.scene.scene import GROUND, Scene, joint_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


def output_times(start: float, end: float, output_step: float) -> Array:
    """(T,) from start to end [s]. Raises InputError unless the span is a multiple of the output step."""
    rows = round((end - start) / output_step) if output_step > 0 and np.isfinite([start, end]).all() else 0
    if rows < 1 or abs(rows * output_step - (end - start)) > 1e-9 * (end - start):
        raise InputError(f"from {start} to {end} s is not a positive multiple of the output step {output_step} s")
    return start + output_step * np.arange(rows + 1)


def result_of(
    system: System,
    record: Record,
    attributes: dict[str, Any],
    path: str | Path | None = None,
    outputs: Sequence[str] = ("default",),
    near: Mapping[str, Array] | None = None,
) -> Result:
    """Quantities of recorded states, efforts of the drivers included; written to `path` when it is complete.

    outputs : names or patterns; beside them every result has the quantities of `accompanying` and the efforts
    near    : joint angles (T,), within half a turn, where more is known of their turns than rows tell (`turned_along`)
    """
    quantities, _ = measure(View(system, record), {}, selected(system, needed(system.scene, outputs)))
    for name, angles in (near or {}).items():
        if name in quantities:
            found = quantities[name].values
            turns = 2 * np.pi * np.round((angles - found) / (2 * np.pi))
            quantities[name] = replace(quantities[name], values=found + turns)
    plain = Result(record.time, quantities, geometry(system.scene), attributes)
    return with_quantities(only(plain, system.scene, outputs), efforts(system.scene, plain), path)


def some_of(system: System, record: Record, names: Sequence[str]) -> Result:
    """Quantities of the catalogue of recorded states and nothing beside: for differences, which take them again and again."""
    quantities, _ = measure(View(system, record), {}, selected(system, names))
    return Result(record.time, quantities, {}, {})


def turned_along(system: System, way: Record, rows: Sequence[int]) -> dict[str, Array]:
    """Joint angles (rows,) by name, which count their turns from state to state on a way, of which some are rows."""
    entries = selected(system, ("default",))
    named = {f"{joint.name}.angle" for joint in system.scene.joints}
    angles, _ = measure(View(system, way), {}, {name: entry for name, entry in entries.items() if name in named})
    return {name: quantity.values[list(rows)] for name, quantity in angles.items()}


def accompanying(scene: Scene) -> tuple[str, ...]:
    """Quantities that accompany efforts in every result: the power of every driver, the rates of joint coordinates."""
    rates = [f"{joint.name}.{coordinate}_rate" for joint in scene.joints for coordinate in COORDINATES[joint.kind]]
    return (*(f"{driver.name}.power" for driver in scene.drivers), *rates)


def needed(scene: Scene, outputs: Sequence[str]) -> tuple[str, ...]:
    """The quantities that must be computed for `outputs` and for the efforts, which come from default quantities."""
    joints = [driver for driver in scene.drivers if isinstance(driver, Driver)]
    driven = {joint_of(scene, driver).i for driver in joints}
    turned = (f"{marker}.orientation" for marker in sorted(driven) if not marker.startswith(f"{GROUND}."))
    asked = beyond([f"{driver.name}.effort" for driver in joints], outputs)
    return ("default", *accompanying(scene), *turned, *asked)


def beyond(kept: Sequence[str], outputs: Sequence[str]) -> tuple[str, ...]:
    """Of `outputs` those that are none of the names that a result has anyway; a pattern of efforts asks for nothing else, as
    those of couplings are default quantities."""
    return tuple(o for o in outputs if o not in kept and not (o.endswith(".effort") and fnmatch.filter(kept, o)))


def only(result: Result, scene: Scene, outputs: Sequence[str]) -> Result:
    """The result with no more than `outputs` and what accompanies them."""
    patterns = [*accompanying(scene), *(p for o in outputs for p in (DEFAULT_OUTPUTS if o == "default" else (o,)))]
    kept = {name: q for name, q in result.quantities.items() if any(fnmatch.fnmatchcase(name, p) for p in patterns)}
    return Result(result.time, kept, result.geometry, result.attributes)


def with_quantities(result: Result, more: dict[str, Quantity], path: str | Path | None = None) -> Result:
    """The result with more quantities, written to `path` if there is one."""
    whole = Result(result.time, {**result.quantities, **more}, result.geometry, result.attributes)
    if path is not None:
        save_result(whole, path)
    return whole


def with_errors(result: Result, other: Beside, order: float) -> Result:
    """The result with the errors of its outputs, by another with other steps and the order that is sure of them."""
    errors = step_errors(result, other, order)
    told = {name: [error.error, error.of_range] for name, error in errors.items()}
    return replace(result, attributes={**result.attributes, "errors": told, "accuracy": worst(errors)})


def efforts(scene: Scene, result: Result) -> dict[str, Quantity]:
    """ "driver.effort" [N m or N] of every driven joint coordinate: what acts along it on the second body.

    scene : as it was computed, a planar one with its in-plane modes
    """
    found: dict[str, Quantity] = {}
    for driver in scene.drivers:
        if isinstance(driver, Driver):
            joint = joint_of(scene, driver)
            axis = _axis_history(result, joint.i, frames(joint)[0][:, 2])
            angular = driver.coordinate == "angle"
            effort = (result[f"{driver.name}.{'moment' if angular else 'force'}"] * axis).sum(1)
            text = f"effort along {driver.joint}.{driver.coordinate}, on the second body"
            found[f"{driver.name}.effort"] = Quantity(effort, "N m" if angular else "N", (), text)
    return found


def efforts_told(scene: Scene, result: Result, more: Mapping[str, str]) -> dict[str, Any]:
    """The attributes of a result of which efforts have the errors of what they are: of the force or moment of their driver.

    more : other quantities, and those that they are
    """
    coordinates = {driver.name: driver.coordinate for driver in scene.drivers if isinstance(driver, Driver)}
    kinds = {"angle": "moment", "stroke": "force"}
    same = {**{f"{name}.effort": f"{name}.{kinds[coordinate]}" for name, coordinate in coordinates.items()}, **more}
    known = result.attributes.get("errors", {})
    told = {name: known[same.get(of, of)] for name, of in same.items() if same.get(of, of) in known}
    return {**result.attributes, "errors": {**known, **told}}


def _axis_history(result: Result, marker: str, axis: Array) -> Array:
    """(T, 3) global axis that stands on a marker, `axis` (3,) in body axes."""
    if marker.startswith(f"{GROUND}."):
        return np.broadcast_to(axis, (result.time.size, 3))
    return rotation_matrix(result[f"{marker}.orientation"]) @ axis
