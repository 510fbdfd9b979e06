"""The outputs that matter: named scalar or vector histories with a tolerance, and how far two runs are apart in them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.functions.formula import names_in
from ffr_dyn.results.quantities import catalogue, like
from ffr_dyn.results.result import Result
from ffr_dyn.results.stress import tensors
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.parts import wholes
from ffr_dyn.scene.scene import Scene
from ffr_dyn.scene.sensors import Measurement
from ffr_dyn.scene.stress_sensors import von_mises
from ffr_dyn.scene.surfaces import surface_of
from ffr_dyn.scene_file.schema import formula_of
from ffr_dyn.scene_file.state_formula import StateFormula
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

STRESS = "stress"
COORDINATES = ("q", "q_dot", "q_ddot")
FRAME = ("R", "p", "v", "omega_bar", "a", "alpha_bar")


@dataclass(frozen=True)
class Output:
    """A history that matters.

    name      : of a component such as "rod.tip.position.y", of a quantity with all its components, or "<body>.stress", the
                largest von Mises stress on the surface of a body
    tolerance : largest error at any output time, a share [1] of the range of the output over the run
    absolute  : the tolerance is in the unit of the output instead

    Raises InputError for a tolerance that is not positive.

    >>> found = fd.economise(scene, [fd.Output("rod.tip.position", 1e-3)], end=0.5, output_step=1e-3)
    """

    name: str
    tolerance: float
    absolute: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < np.inf:
            raise InputError(f"output {self.name!r}: the tolerance is {self.tolerance}; it must be positive")


def as_output(given: Output | str, tolerance: float) -> Output:
    """ "rod.tip.position.y", "rod.stress=1e6" (absolute) or "rod.stress=0.1%" (of the range) as an Output."""
    if isinstance(given, Output):
        return given
    name, equals, text = given.partition("=")
    if not equals:
        return Output(name.strip(), tolerance)
    share = text.strip().endswith("%")
    try:
        value = float(text.strip().rstrip("%"))
    except ValueError:
        raise InputError(f"output {given!r}: write NAME, NAME=TOLERANCE or NAME=PERCENT%") from None
    return Output(name.strip(), value / 100 if share else value, absolute=not share)


@dataclass(frozen=True)
class Probe:
    """How outputs are read from runs of the same scene with different models.

    outputs    : what is asked for
    quantities : per output, the quantity of a result that holds it
    columns    : per output, the component, or () for all
    units      : per output
    """

    outputs: tuple[Output, ...]
    quantities: tuple[str, ...]
    columns: tuple[tuple[int, ...], ...]
    units: tuple[str, ...]


def probe(assembled: Assembled, outputs: Sequence[Output], policy: Policy = DEFAULT) -> Probe:
    """Find the outputs among the quantities of a scene. Raises InputError for names that do not exist or repeat, and for
    tolerances that no run meets."""
    if not outputs:
        raise InputError("name at least one output, such as rod.tip.position.y: without it no model can be judged")
    names = [output.name for output in outputs]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"the output {name!r} is asked for more than once")
    for output in outputs:
        if not output.absolute and output.tolerance < policy.finest_tolerance:
            raise InputError(
                f"output {output.name!r}: a relative tolerance of {output.tolerance:g} is below the accuracy of any run "
                f"({policy.finest_tolerance:g}: rounding, and the projection on the constraints); ask for a larger one"
            )
    everything, scene = catalogue(assembled.system), assembled.system.scene
    found = [_found(everything, scene, output.name) for output in outputs]
    return Probe(tuple(outputs), tuple(f[0] for f in found), tuple(f[1] for f in found), tuple(f[2] for f in found))


def _found(everything: Mapping[str, Any], scene: Scene, name: str) -> tuple[str, tuple[int, ...], str]:
    if name in everything:
        return name, (), everything[name].unit
    head, _, label = name.rpartition(".")
    if label == STRESS:
        _check_stress(scene, head)
        return f"{head}.q", (), "Pa"
    labels: list[tuple[str, ...]] = [axis.labels for axis in everything[head].axes[:1]] if head in everything else []
    if labels and label in labels[0]:
        return head, (labels[0].index(label),), everything[head].unit
    hint = like(name, [*everything, *(f"{body.name}.{STRESS}" for body in scene.bodies)], 0.5)
    raise InputError(f"output {name!r} is none of the scene's quantities or their components; {hint}")


def check_meaning(of: Probe, scene: Scene, moved: Collection[str]) -> None:
    """InputError for outputs and forces that would mean something else in a smaller model: those of elastic coordinates, and
    of the frames of bodies in `moved`, by name, whose model has another frame than the scene."""
    seen_from, parts = _frames(scene), {name: [part.name for part in of] for name, of in wholes(scene.bodies).items()}
    for output, quantity in zip(of.outputs, of.quantities, strict=True):
        owner, label = quantity.partition(".")[0], quantity.rpartition(".")[2]
        if label in COORDINATES and output.name.rpartition(".")[2] != STRESS:
            raise InputError(
                f"output {output.name!r}: elastic coordinates are those of a model, and a smaller one has others; ask for "
                f"what they do, such as the position of a marker of {owner!r}"
            )
        body = seen_from.get(quantity, owner if label in (*FRAME, "displacement") else "")
        if body in moved or any(part in moved for part in parts.get(body, ())):
            raise InputError(
                f"output {output.name!r} is seen from the frame of body {body!r}, and a smaller model has the frame of its "
                "mean motion: ask for positions, or for a measurement between markers in the axes of another body; or bring "
                "the body into that frame (ffr-prep convert --reference mean-axis)"
            )
    for force in forces_of(scene):
        _check_force(force.name, formula_of(force), moved)


def _frames(scene: Scene) -> dict[str, str]:
    """The bodies in whose axes quantities are that do not have their names."""
    found = {f"measured.{of.name}": of.axes for of in scene.measurements if isinstance(of, Measurement)}
    for joint in scene.joints:
        found |= {f"{joint.name}.{what}_i": joint.i.partition(".")[0] for what in ("force", "moment")}
    return found


def _check_force(name: str, formula: Any, moved: Collection[str]) -> None:
    """InputError for a formula that reads elastic coordinates, or the rotation of a frame that the model does not have."""
    if not isinstance(formula, StateFormula):
        return
    for read in (read for expression in formula.expressions for read in names_in(expression)):
        owner, _, what = read.rpartition(".")[0].rpartition(".")
        if what in COORDINATES or (what in FRAME and owner in moved):
            raise InputError(
                f"force {name!r} depends on {read!r}, which is another number in a smaller model; let it depend on markers "
                "and joints"
            )


def _check_stress(scene: Scene, name: str) -> None:
    bodies = {body.name: body.model for body in scene.bodies}
    if name not in bodies:
        raise InputError(f"output '{name}.{STRESS}': there is no body {name!r}; there are: {', '.join(bodies)}")
    surface = bodies[name].surface
    if surface is None or surface.stress is None or bodies[name].n == 0:
        raise InputError(
            f"output '{name}.{STRESS}': body {name!r} has no stress modes; reduce it with them (ffr-prep reduce --stress)"
        )


def needed(of: Probe, system: System) -> tuple[str, ...]:
    """The quantities that a run of this model has to keep: what a rigid body does not have is zero."""
    known = catalogue(system)
    return tuple(dict.fromkeys([*(name for name in of.quantities if name in known), "constraint.position"]))


def histories(of: Probe, scene: Scene, result: Result) -> tuple[Array, ...]:
    """(T, k) of each output in a run of this model."""
    return tuple(_history(of, k, scene, result) for k in range(len(of.outputs)))


def _history(of: Probe, k: int, scene: Scene, result: Result) -> Array:
    name, quantity = of.outputs[k].name, of.quantities[k]
    if quantity not in result.quantities:
        return np.zeros((result.time.size, 1))
    if name.rpartition(".")[2] == STRESS and quantity.endswith(".q"):
        return largest_stress(scene, quantity.removesuffix(".q"), result[quantity])[:, None]
    values = result[quantity].reshape(result.time.size, -1)
    return values[:, list(of.columns[k])] if of.columns[k] else values


def largest_stress(scene: Scene, name: str, q: Array) -> Array:
    """(T,) largest von Mises stress over the surface of a body [Pa] for its elastic coordinates (T, n)."""
    surface = next(surface_of(body) for body in scene.bodies if body.name == name)
    if surface is None:
        return np.zeros(len(q))
    chunk = max(1, 2_000_000 // (6 * max(1, len(surface.points))))
    parts = [von_mises(tensors(surface, q[k : k + chunk])).max(axis=0) for k in range(0, len(q), chunk)]
    return np.concatenate(parts)


def ranges(values: Sequence[Array]) -> Array:
    """(outputs,) largest range of a component over the run."""
    return np.array([float(np.ptp(one, axis=0).max(initial=0.0)) for one in values])


def limits(of: Probe, scales: Array, policy: Policy = DEFAULT) -> Array:
    """(outputs,) tolerances in the units of the outputs. Raises InputError where a share of nothing is asked for."""
    for output, scale, unit in zip(of.outputs, scales, of.units, strict=True):
        if not output.absolute and scale <= (policy.still_stress if unit == "Pa" else policy.still):
            raise InputError(
                f"output {output.name!r} does not change over the run (its range is {scale:.2g} {unit}): a share of that "
                f"says nothing; give an absolute tolerance, {output.name}=VALUE, or another output"
            )
    tolerances = np.array([output.tolerance for output in of.outputs])
    return np.where([output.absolute for output in of.outputs], tolerances, tolerances * scales)


def largest(differences: Sequence[Array]) -> Array:
    """(outputs,) largest size of a component of each difference."""
    return np.array([float(np.abs(one).max(initial=0.0)) for one in differences])


def difference(one: Sequence[Array], other: Sequence[Array]) -> tuple[Array, ...]:
    """Histories of one less those of the other."""
    return tuple(a - b for a, b in zip(one, other, strict=True))


def total(*parts: Sequence[Array]) -> tuple[Array, ...]:
    """The sum of histories."""
    return tuple(np.sum(same, axis=0) for same in zip(*parts, strict=True))
