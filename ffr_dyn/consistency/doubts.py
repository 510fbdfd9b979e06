"""The table of doubts: for every analysis, what is checked and whether it makes a note of the result or an error.

`TABLE` says which, for each doubt and analysis; docs/analyses.md shows it. The rows of an analysis go through `look`, as many
at a time as it has, and `ended` tells what they have shown. Doubts that a scene raises before anything moves are notes of
assembly (`ffr_dyn.consistency.assemble`): redundant rows, modes that do not fit the joints, joints that slide along a body.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ffr_dyn.compile.force_tables import Callback
from ffr_dyn.compile.memory import check_repeats
from ffr_dyn.compile.scene_tables import System, of_time
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import evaluate, evaluator
from ffr_dyn.consistency.explicit_forces import candidates, fastest, told
from ffr_dyn.consistency.following import beyond_one, jump_of, row_named, torn_open, unfollowed
from ffr_dyn.consistency.unshown_loads import energies, left_out
from ffr_dyn.consistency.validity import extremes, meaningless, strained, unstiffened
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.told_rates import misled, wrong_rate
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.kernels.tables import MOMENT, OPENED, PHI, Record, Work
from ffr_dyn.results.power import driven, measured_values
from ffr_dyn.results.recorded_motion import View, dot
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import BetweenAxes
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene, joint_of
from ffr_prep.body import least_inertia, remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

NOTE, ERROR, NONE = "note", "error", "-"
INTEGRATED = (
    "forward",
    "mixed",
    "inverse",
    "economise",
)  # by `ffr_dyn.analyses.integration`, the second two where they are
ANALYSES = (*INTEGRATED, "stepper", "kinematic", "static", "linearise", "assemble")


def _verdicts(integrated: str, stepper: str, kinematic: str, static: str, moment: str) -> dict[str, str]:
    """Of every analysis; `moment` of those that look at one moving state."""
    return dict(zip(ANALYSES, [integrated] * 4 + [stepper, kinematic, static, moment, moment], strict=True))


TABLE: dict[str, dict[str, str]] = {
    "constraints open beyond the tolerance": _verdicts(NOTE, NOTE, NOTE, NOTE, NOTE),
    "mechanism come apart": _verdicts(ERROR, NOTE, ERROR, ERROR, ERROR),
    "driver not followed": _verdicts(ERROR, NOTE, ERROR, ERROR, ERROR),
    "driver faster than the step": _verdicts(NOTE, NOTE, NONE, NONE, NONE),
    "driven motion that jumps": _verdicts(NOTE, NONE, NOTE, NONE, NONE),
    "energy multiplied": _verdicts(ERROR, NONE, NONE, NONE, NONE),  # at once, by `ffr_dyn.analyses.energy`
    "energy come or gone": _verdicts(NOTE, NONE, NONE, NONE, NONE),
    "force too stiff for the step": _verdicts(NOTE, NOTE, NONE, NONE, NONE),
    "bushing turned by half a turn": _verdicts(NOTE, NOTE, NONE, NOTE, NOTE),
    "formula beyond half a turn": _verdicts(NOTE, NOTE, NOTE, NONE, NONE),
    "deformed beyond the theory": _verdicts(NOTE, NOTE, NONE, NOTE, NOTE),
    "deformed beyond any meaning": _verdicts(ERROR, NOTE, NONE, ERROR, ERROR),
    "spin without stiffening": _verdicts(NOTE, NOTE, NONE, NONE, NOTE),
    "deformation that the shapes leave out": _verdicts(NOTE, NOTE, NONE, NOTE, NONE),
    "singular position": _verdicts(NOTE, NOTE, NOTE, NONE, NONE),
    "mass matrix nearly singular": _verdicts(NOTE, NOTE, NONE, NOTE, NOTE),
    "kink of a force": _verdicts(NONE, NONE, NONE, NONE, NONE) | {"linearise": NOTE},
}
OPEN, APART, ASTRAY, QUICK, SUDDEN, _, BALANCE, STIFF, WOUND, WRAPPED, *_REST = TABLE
STRAINED, MEANINGLESS, SPUN, UNSHOWN, SINGULAR, MASS, KINK = _REST

MET = 1e-8  # m, -: of constraints that Newton's method closes
KEPT = 10.0  # times the tolerance of a projection
# Of the size of the scene up to a metre: how far constraints come open in the step before a row, which a projection at the
# beginning of the next one closes; and more than any drift that is of use.
DRIFTED, TORN = 1e-5, 1e-2
BESIDE = 0.1  # rad, by which a driven angle may differ
TURNED = 0.1  # rad, or of the scene's size: h^2 times a driver's second derivative that a step bears
PASSES = 8  # of half a turn in some rows, at which a formula is looked at
DEPENDENT = 1e-8  # smallest eigenvalue of a mass matrix with ones on its diagonal
FAR = 1e-2  # from zero, where a bound of it will do


@dataclass(frozen=True)
class Seen:
    """The observations of the rows of an analysis so far, in arrays that change.

    method    : of its steps; None where it has none
    tolerance : that constraints are to be met with [m, -];  apart : from where a mechanism has come apart
    arrays    : "bodies" (4, B) as `ffr_dyn.consistency.validity.extremes`; "unshown" (3, B) as
                `ffr_dyn.consistency.unshown_loads.energies`; "open" (3,) the largest constraint left open, its
                time, its number; "driven" (2, D) of each driver the largest difference from what it prescribes, and its
                largest second derivative; "told" (4, C) a derivative that a Python function of time tells and has not, of
                order 0 where there is none; "torn" (3, A) of each angle that a formula of a force reads the last, whether the
                formula has jumped as it passed half a turn, and when; "rates" (F,) [1/s] of the forces that the method takes
                explicitly; "wound" (F,) [rad] how far the axes of forces in six directions are turned against each other;
                "x" (X,) of the last row
    """

    assembled: Assembled
    method: Integrator | None
    tolerance: float
    apart: float
    arrays: dict[str, Array]

    @property
    def scene(self) -> Scene:
        return self.assembled.system.scene


def nothing_seen(
    assembled: Assembled, method: Integrator | None = None, tolerance: float = MET, apart: float = TORN
) -> Seen:
    """Before the first row."""
    scene = assembled.system.scene
    sizes = {
        "bodies": (4, len(scene.bodies)),
        "unshown": (3, len(scene.bodies)),
        "open": (3,),
        "driven": (2, len(scene.drivers)),
    }
    sizes |= {"told": (4, len(assembled.system.user.callbacks))}
    sizes |= {"torn": (3, len(_read_angles(assembled.system)))}
    sizes |= {"rates": (len(forces_of(scene)),), "wound": (len(forces_of(scene)),), "x": (assembled.x.size,)}
    return Seen(assembled, method, tolerance, apart, {name: np.zeros(size) for name, size in sizes.items()})


def held(scene: Scene, stabilisation: Stabilisation) -> tuple[float, float]:
    """(tolerance, apart) [m, -]: a projection holds the constraints; gains and drifting let them go as far as they do."""
    size = min(1.0, _size(scene))
    if isinstance(stabilisation, Projection):
        return max(KEPT * stabilisation.tolerance, DRIFTED * size), TORN * size
    return DRIFTED * size, np.inf


def _size(scene: Scene) -> float:
    return max(body.model.size for body in scene.bodies) or 1.0


def look(seen: Seen, view: View) -> None:
    """Take note of the rows that follow, whose violations are those of all rows, redundant ones included.

    Raises InputError for Python functions that remember.
    """
    system, rows, arrays = seen.assembled.system, view.record, seen.arrays
    check_repeats(system.user, rows.time, rows.x, rows.v)
    arrays["bodies"][:] = np.maximum(arrays["bodies"], extremes(system, rows))
    found = energies(view)
    arrays["unshown"][:] = np.where(found[0] > arrays["unshown"][0], found, arrays["unshown"])
    arrays["x"][:] = rows.x[-1]
    worst = int(np.argmax(rows.violation[:, 0]))
    if rows.violation[worst, 0] > max(seen.tolerance, arrays["open"][0]):
        arrays["open"][:] = _opened(seen.assembled, rows, worst)
    if seen.scene.drivers:
        arrays["driven"][:] = np.maximum(arrays["driven"], np.array([_driven(view, d) for d in seen.scene.drivers]).T)
    for number, callback in enumerate(system.user.callbacks):
        if not callback.with_state and (wrong := wrong_rate(partial(of_time, callback), rows.time)):
            arrays["told"][:, number] = wrong
    for number, (callback, joint) in enumerate(_read_angles(system)):
        arrays["torn"][:, number] = _torn(callback, joint, view, arrays["torn"][:, number])
    arrays["wound"][:] = np.maximum(arrays["wound"], [_wound(view, k, force) for k, force in _forces(seen)])
    if seen.method is not None and (explicit := candidates(system, seen.method)):
        arrays["rates"][:] = np.maximum(arrays["rates"], fastest(evaluator(system), rows, explicit))


def _forces(seen: Seen) -> Iterator[tuple[int, Force]]:
    return enumerate(forces_of(seen.scene))


def _wound(view: View, k: int, force: Force) -> float:
    """[rad] of a force in six directions, between its markers."""
    if not isinstance(force.place, BetweenAxes):
        return 0.0
    return float(np.linalg.norm(measured_values(view, k, slice(3, 6)), axis=1).max(initial=0.0))


def _read_angles(system: System) -> list[tuple[Callback, Joint]]:
    """Formulas of forces and the joints whose angles they read (`ffr_dyn.scene_file.state_formula.StateFormula`)."""
    joints = system.scene.joints
    return [(one, j) for one in system.user.callbacks for j in joints if j.name in getattr(one.function, "angles", ())]


def _torn(callback: Callback, joint: Joint, view: View, before: Array) -> tuple[float, float, float]:
    """What is kept of an angle that a formula reads, with the rows that follow; `before` of those up to now."""
    system, rows, angles = view.system, view.record, _angle(view, joint)
    last, jumped, time = before.tolist()
    passed = np.flatnonzero(np.abs(np.diff(angles, prepend=last)) > np.pi)
    for row in () if jumped else [*passed[:PASSES].tolist(), *[len(angles) - 1] * bool(passed.size)]:
        state = StateView(system.scene, system.layout, rows.x[row], rows.v[row])
        if callback.function.torn(joint.name, float(rows.time[row]), state):  # type: ignore[attr-defined]
            jumped, time = 1.0, float(rows.time[passed[0]])
    return float(angles[-1]), jumped, time


def _opened(assembled: Assembled, rows: Record, row: int) -> tuple[float, float, float]:
    """The largest |Phi| of a row of the record, its time, and which of all constraint rows it is."""
    at, time = evaluator(assembled.all_rows or assembled.system), float(rows.time[row])
    Phi = np.abs(evaluate(at, time, rows.x[row], rows.v[row]).Phi)
    return float(rows.violation[row, 0]), time, float(np.argmax(Phi))


def _driven(view: View, driver: Driver | PointDriver) -> tuple[float, float]:
    """How far an angle is from the one prescribed [rad], seen all around, and the largest second derivative of what is
    prescribed; points and strokes are where their rows are closed."""
    if not isinstance(driver, Driver) or driver.name not in [block.name for block in view.system.blocks]:
        return 0.0, 0.0
    prescribed = driven(view, driver)
    growth = float(np.abs(prescribed[:, 2]).max())
    if driver.coordinate != "angle":
        return 0.0, growth
    angle = _angle(view, joint_of(view.system.scene, driver))
    off = np.remainder(angle - prescribed[:, 0] + np.pi, 2 * np.pi) - np.pi
    return float(np.abs(off).max()), growth


def _angle(view: View, joint: Joint) -> Array:
    """(T,) [rad] within half a turn."""
    on_i, on_j = view.joint_frames(joint)
    return np.arctan2(dot(on_i[:, :, 1], on_j[:, :, 0]), dot(on_i[:, :, 0], on_j[:, :, 0]))


def between_rows(seen: Seen, system: System, work: Work, rows: Record | None = None) -> dict[str, list[str]]:
    """Doubts about rows that steps have left open and a projection has closed: the one that was open most.

    rows : whose speeds have not been looked at yet
    """
    method, opened, time = seen.method, float(work.drift[PHI]), float(work.drift[MOMENT])
    if method is None or method.controlled or seen.apart == np.inf:
        return {}
    step = method.step
    if lost := torn_open(system, work, step) if rows is None else unfollowed(system, work, step, rows):
        return {APART: [lost.text]}
    if not opened > seen.tolerance:
        return {}  # whichever row it is
    block, word = row_named(system, int(work.drift[OPENED]))
    tolerance = seen.tolerance * beyond_one(system.scene, word)
    if not opened > tolerance:
        return {}
    if word.function is not None and (jump := jump_of(block, word, time - method.step, time)):
        return {OPEN: [jump]}
    return {
        OPEN: [
            f"at t = {time:.6g} s the row '{word.text}' of {block.name!r} is open by {opened:.2g} at the end of a step, "
            f"before it is projected, and that is more than {tolerance:.1g}; use a smaller step"
        ]
    }


# ---- the end --------------------------------------------------------------------------------------------------------


def checked(
    analysis: str, assembled: Assembled, rows: Record, more: Mapping[str, Sequence[str]] | None = None
) -> list[str]:
    """The notes of an analysis that has all its rows at once and no steps. Raises ComputationError as `ended`."""
    seen = nothing_seen(assembled)
    look(seen, View(assembled.system, rows))
    return ended(analysis, seen, more)


def ended(analysis: str, seen: Seen, more: Mapping[str, Sequence[str]] | None = None) -> list[str]:
    """The notes of an analysis; `more` are doubts that were found elsewhere.

    Raises ComputationError for the first doubt that the table calls an error.
    """
    found = {**_found(seen), **(more or {})}
    for doubt in (doubt for doubt, verdicts in TABLE.items() if verdicts[analysis] == ERROR):
        for text in found.get(doubt, ()):
            raise ComputationError(text)
    noted = [doubt for doubt, verdicts in TABLE.items() if verdicts[analysis] == NOTE]
    return list(dict.fromkeys(text for doubt in noted for text in found.get(doubt, ())))


def _found(seen: Seen) -> dict[str, list[str]]:
    """All doubts, with their texts."""
    scene, (turned, spun, deflected, stretched) = seen.scene, seen.arrays["bodies"]
    lost, quick = meaningless(scene, seen.arrays["bodies"]), list(_quick(seen))
    return {
        **_constraints(seen, quick),
        ASTRAY: [
            *(
                misled(callback.what, *wrong)
                for callback, wrong in zip(seen.assembled.system.user.callbacks, seen.arrays["told"].T, strict=True)
                if wrong[-1]
            ),
            *(_astray(d, off) for d, off in zip(scene.drivers, seen.arrays["driven"][0], strict=True) if off > BESIDE),
        ],
        QUICK: quick,
        STIFF: [] if seen.method is None else told(seen.assembled.system, seen.method, seen.arrays["rates"]),
        WOUND: [text for k, force in _forces(seen) if (text := force.beyond(float(seen.arrays["wound"][k])))],
        WRAPPED: list(_wrapped(seen)),
        STRAINED: strained(scene, turned, deflected, stretched),
        MEANINGLESS: [lost] if lost else [],
        SPUN: unstiffened(scene, spun),
        UNSHOWN: list(left_out(scene, seen.arrays["unshown"])),
        MASS: list(_dependent(seen.assembled.system, seen.arrays["x"])),
    }


def _constraints(seen: Seen, quick: list[str]) -> dict[str, list[str]]:
    value, time, number = seen.arrays["open"]
    if not value > seen.tolerance:
        return {}  # whichever row it is
    blocks = (seen.assembled.all_rows or seen.assembled.system).blocks
    block, word = [(block, word) for block in blocks for word in block.words][int(number)]
    larger = beyond_one(seen.scene, word)
    if not value > seen.tolerance * larger:
        return {}
    change = "use a smaller step" if seen.apart < np.inf else "use projection, or a smaller step"
    where = f"at t = {time:.6g} s the row '{word.text}' of {block.name!r} is open by {value:.2g}"
    if value > seen.apart * larger:
        what = "the driver is not followed" if block.driver else "the mechanism has come apart"
        return {APART: [f"{where}: {what}; {quick[0] if quick else change}"]}
    return {OPEN: [f"{where}, the most of all, and more than {seen.tolerance * larger:.1g}; {change}"]}


def _wrapped(seen: Seen) -> Iterator[str]:
    read = _read_angles(seen.assembled.system)
    for (callback, joint), (_, jumped, time) in zip(read, seen.arrays["torn"].T, strict=True):
        if jumped:
            yield (
                f"{callback.what}: its formula reads {joint.name}.angle, which is known within half a turn, and jumps where "
                f"the joint passes half a turn, as at t = {time:.6g} s; use a servo or a joint spring, which count turns, or "
                "sin and cos of the angle"
            )


def _astray(driver: Driver | PointDriver, off: float) -> str:
    return (
        f"driver {driver.name!r} is not followed: its joint is {off:.3g} rad from the angle prescribed; start nearer to it, "
        "or use a smaller step"
    )


def _quick(seen: Seen) -> Iterator[str]:
    if seen.method is None or seen.method.controlled:
        return
    for driver, growth in zip(seen.scene.drivers, seen.arrays["driven"][1], strict=True):
        angular = isinstance(driver, Driver) and driver.coordinate == "angle"
        step, bears = seen.method.step, TURNED if angular else TURNED * _size(seen.scene)
        if step**2 * growth > bears:
            yield (
                f"driver {driver.name!r} is faster than the step: its motion changes by up to {step**2 * growth:.2g} "
                f"{'rad' if angular else 'm'} more in one step of {step:.3g} s than in the one before; use one below "
                f"{np.sqrt(bears / growth):.2g} s"
            )


def _dependent(system: System, x: Array) -> Iterator[str]:
    place = system.layout
    for b, body in enumerate(system.scene.bodies):
        least = _least(body, (*place.active(b), *range(6, 6 + place.n[b])), x[place.q(b)])
        if not least > DEPENDENT:
            yield (
                f"the mass matrix of body {body.name!r} is nearly singular (smallest eigenvalue {least:.1g} of a diagonal of "
                "ones): its accelerations have few digits; keep fewer modes"
            )


def _least(body: Body, moving: tuple[int, ...], q: Array) -> float:
    """The smallest eigenvalue of a mass matrix with ones on its diagonal, or a bound below it that is far from zero; that of
    a rigid body is always the same."""

    def made() -> float:
        if not q.size and (bound := least_inertia(body.model, moving)) > FAR:
            return bound
        at = list(moving)
        M = mass_matrix(kept_integrals(body), q)[at][:, at]
        scale = 1.0 / np.sqrt(M.diagonal())
        scaled = scale[:, None] * M * scale
        bound = 2.0 - float(np.abs(scaled).sum(axis=1).max())  # of Gershgorin's circles about one
        return bound if bound > FAR else float(np.linalg.eigvalsh(scaled)[0])

    return made() if q.size else remembered(body.model, ("least of mass", body.dropped, moving), made)
