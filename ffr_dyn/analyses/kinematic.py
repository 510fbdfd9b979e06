"""Kinematics: every rigid motion prescribed by drivers; positions, velocities and accelerations follow from the constraints.

    Phi(q, t) = 0 (Newton-Raphson),   Phi_q q_dot = -Phi_t,   Phi_q q_ddot = gamma      (Haug 1989, ch. 4)

Bodies are taken as undeformed. Between two output times the motion is followed by a predictor and Newton's method, in as many
parts as that takes; where no part is small enough the mechanism locks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.outcome import needed, output_times, result_of, turned_along
from ffr_dyn.analyses.registry import OverTime
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.closing.limits import with_limits
from ffr_dyn.compile.divided_steps import breaks_of
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency import doubts
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.evaluation import (
    Evaluation,
    Evaluator,
    copied,
    evaluate,
    evaluated_mass_matrix,
    evaluator,
    joined,
    smallest_step,
    total_mass_matrix,
)
from ffr_dyn.consistency.following import sudden
from ffr_dyn.consistency.mobility import named_motion, require_driven, undeformed
from ffr_dyn.equations.constraint_rows import blocks_of, rows_at
from ffr_dyn.equations.layout import meets, moved, to_body_axes, to_global_axes
from ffr_dyn.kernels.tables import EVALUATIONS, Record
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

TOLERANCE = 1e-11  # of Phi [m, -]
ITERATIONS = 8  # of Newton's method in a part of a step
LARGEST_TURN = 0.2  # rad, of a body in a part of a step
SMALLEST_PART = 1e-8  # of an output step
NEAR = 1e-2  # conditioning, relative to the best met, below which a position is reported as nearly singular
SINGULAR = 1e-4  # the same, where Phi within the tolerance no longer determines the motion
AT_REST = 1e-5  # the same, absolute, of a position that drivers hold


@dataclass(frozen=True)
class _Pose:
    """A position on the path: state, conditioning (smallest singular value), orientation (sign of the determinant), and the
    motion (V,) that comes free where it is singular."""

    time: float
    x: Array
    v: Array
    conditioning: float
    sign: float
    motion: Array


@dataclass(frozen=True)
class Kinematic(OverTime):
    """With the reactions that the motion needs.

    >>> result = fd.run(scene, fd.Settings(start=0, end=1, output_step=0.01, method=fd.Within(), analysis=fd.Kinematic()))
    """

    def perform(self, scene: Scene, settings: Settings, **how: Any) -> Result:
        return kinematic(scene, **settings.span, **how)


def kinematic(
    scene: Scene,
    *,
    end: float,
    output_step: float,
    start: float = 0.0,
    outputs: Sequence[str] = ("default",),
    path: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Positions, velocities and accelerations of a fully driven scene every `output_step` [s], and the reactions they need.

    outputs : names or patterns of the quantities to keep beside the efforts, as in `forward`

    Raises InputError when a rigid motion is left free or prescribed twice, or what a driver asks for has no value or no
    bound, ComputationError when the mechanism locks: the message gives the time and the joint at its dead point. Positions
    that are nearly or exactly singular on the way, where the motion could branch, are told in the notes; rows there are
    limits from both sides, and reactions that grow without
    bound are nan.

    >>> result = fd.kinematic(scene, end=0.2, output_step=1e-3)
    """
    followed = along_the_path(scene, (start, end, output_step), outputs, progress)
    attributes = {
        **described(scene),
        "analysis": "kinematic",
        "method": "Newton-Raphson",
        "evaluations": followed.evaluations,
        "degrees_of_freedom": 0,
        "computed": followed.assembled.computed,
        "notes": followed.notes,
        "status": "complete",
    }
    return result_of(followed.assembled.system, followed.record, attributes, path, outputs, followed.angles)


@dataclass(frozen=True)
class Followed:
    """The rows of a fully driven scene of undeformed bodies, in which forces have counted the turns of their angles along the
    path; joint angles (T,) with these turns; of its notes those of drivers that do something at once."""

    assembled: Assembled
    record: Record
    angles: dict[str, Array]
    notes: list[str]
    sudden: list[str]
    evaluations: int


def along_the_path(
    scene: Scene,
    span: tuple[float, float, float],
    outputs: Sequence[str] = ("default",),
    progress: Callable[[float], None] | None = None,
) -> Followed:
    """The rows of a scene over a start, an end and an output step [s]; raises what `kinematic` does."""
    start, end, output_step = span
    rigid = undeformed(scene)
    require_driven(rigid, start, "a kinematic analysis")
    assembled = assemble(rigid, time=start)
    selected(assembled.system, needed(scene, outputs))
    breaks = breaks_of(assembled.system, start, end, output_step)
    at = evaluator(assembled.all_rows or assembled.system)
    pose = replace(
        _pose(at, start, assembled.x, assembled.v), v=to_body_axes(at.system.layout, assembled.x, assembled.v)
    )
    rows, followed = [0], [pose]
    for time in output_times(start, end, output_step)[1:]:
        followed += _follow(at, followed[-1], float(time), output_step)
        rows.append(len(followed) - 1)
        if progress is not None:
            progress(float(time))
    record, angles = _recorded(assembled, followed, rows)
    notes, at_once = [*assembled.notes, *_undeformed_notes(scene)], sudden(assembled.system, breaks, start, end)
    found = {doubts.SINGULAR: _singular_notes(at.system, followed), doubts.SUDDEN: at_once}
    notes += doubts.checked("kinematic", assembled, record, found)
    return Followed(assembled, record, angles, notes, at_once, int(at.work.info[EVALUATIONS]))


def _undeformed_notes(scene: Scene) -> list[str]:
    flexible = [body.name for body in scene.bodies if body.model.n]
    return [f"taken as undeformed: {', '.join(flexible)}"] if flexible else []


# ---- along the path ---------------------------------------------------------------------------------------------------


def _follow(at: Evaluator, pose: _Pose, end: float, output_step: float) -> list[_Pose]:
    """Poses from `pose` to the time `end`, in parts that are halved until Newton's method converges from the prediction."""
    scene, layout = at.system.scene, at.system.layout
    found, part = [pose], end - pose.time
    while found[-1].time < end:
        part = min(part, end - found[-1].time)
        after = _advanced(at, found[-1], end if found[-1].time + 1.01 * part >= end else found[-1].time + part)
        if after is None:
            part /= 2
            if part < SMALLEST_PART * output_step:
                # InputError where it is no dead point: a driver has no value there.
                rows_at(scene, layout, blocks_of(scene), found[-1].x, np.zeros(layout.v_size), end)
                raise _locked(at, found[-1])
        else:
            found.append(after)
            part *= 2
    return found[1:]


def _advanced(at: Evaluator, pose: _Pose, time: float) -> _Pose | None:
    """The pose at `time`, or None when the part is too long."""
    place = at.system.layout
    step = pose.v * (time - pose.time)
    if _turn(at, step) > LARGEST_TURN:
        return None
    x = moved(place, pose.x, step)
    for _ in range(ITERATIONS):
        now = evaluate(at, time, x, np.zeros(place.v_size))
        step = smallest_step(now.jacobian, evaluated_mass_matrix(at), -now.Phi)
        if _turn(at, step) > LARGEST_TURN:
            return None
        x = moved(place, x, step)
        if meets(at.system.scene, x, now.Phi, TOLERANCE):  # and by the last step to rounding
            return _pose(at, time, x, pose.v)
    return None


def _turn(at: Evaluator, step: Array) -> float:
    place = at.system.layout
    return max(float(np.linalg.norm(step[place.omega(b)])) for b in range(len(place.n)))


def _pose(at: Evaluator, time: float, x: Array, v: Array) -> _Pose:
    """The pose with its velocities (body axes), nearest to v, those before it: the rate of the rows at rest is Phi_t."""
    still = evaluate(at, time, x, np.zeros_like(v))
    values, sign, motion = _conditioning(at, still, x)
    v = v + smallest_step(still.jacobian, evaluated_mass_matrix(at), -still.nu - still.jacobian @ v, SINGULAR)
    return _Pose(time, x, v, values, sign, motion)


def _leading(system: System, pose: _Pose) -> str:
    """The joint coordinate that leads the motion which comes free."""
    return named_motion(system.scene, system.layout, pose.x, pose.motion)


def _conditioning(at: Evaluator, now: Evaluation, x: Array) -> tuple[float, float, Array]:
    """Smallest singular value of the mass-weighted rows of length one, sign of the determinant, motion that comes free."""
    scene, place = at.system.scene, at.system.layout
    lower = np.linalg.cholesky(total_mass_matrix(scene, place, x))
    weighted = np.linalg.solve(lower, now.jacobian.T).T
    weighted /= np.linalg.norm(weighted, axis=1)[:, None]
    _, values, basis = np.linalg.svd(weighted)
    square = weighted.shape[0] == weighted.shape[1]
    sign = float(np.linalg.slogdet(weighted)[0]) if square else 0.0
    return float(values[place.v_size - 1]), sign, np.linalg.solve(lower.T, basis[place.v_size - 1])


def _locked(at: Evaluator, pose: _Pose) -> ComputationError:
    drivers = ", ".join(repr(driver.name) for driver in at.system.scene.drivers)
    return ComputationError(
        f"at t = {pose.time:.6g} s the mechanism locks: {_leading(at.system, pose)} is at a dead point beyond which no "
        f"position meets the joints and drivers ({drivers}); keep the driven motion within reach, or drive another joint"
    )


def _recorded(assembled: Assembled, followed: list[_Pose], rows: list[int]) -> tuple[Record, dict[str, Array]]:
    """The rows, which are some of the poses, limits where they are singular, and joint angles. ComputationError where there
    are none.

    Angles count their turns from pose to pose, since rows may be many turns apart.
    """
    at, kept, found = evaluator(assembled.system), set(rows), list[Record]()
    for number, pose in enumerate(followed):
        now = evaluate(at, pose.time, pose.x, to_global_axes(assembled.system.layout, pose.x, pose.v))
        if number in kept and now.singular:
            raise _undetermined(at.system, pose)
        found.append(copied(at.record))
    angles = turned_along(assembled.system, joined(found), rows)
    chosen = joined([found[number] for number in rows])
    record = with_limits(assembled.system, assembled.all_rows, with_all_reactions(assembled, chosen))
    poses = [followed[number] for number in rows]
    best = max(pose.conditioning for pose in poses)
    for row, pose in enumerate(poses):
        lost = pose.conditioning < SINGULAR * best and not np.isfinite(record.vd[row]).all()
        if lost or (pose.conditioning < AT_REST and not record.v[row].any()):  # which is on no path
            raise _undetermined(at.system, pose)
    return record, angles


def _undetermined(system: System, pose: _Pose) -> ComputationError:
    return ComputationError(
        f"at t = {pose.time:.6g} s the position is singular: the drivers do not determine the motion of "
        f"{_leading(system, pose)}; choose output times that miss it, or drive another joint"
    )


def _singular_notes(system: System, poses: list[_Pose]) -> list[str]:
    """Positions that are nearly singular, and those that were crossed: the determinant changes its sign."""
    best = max(pose.conditioning for pose in poses)
    notes = []
    for k, pose in enumerate(poses):
        least = all(pose.conditioning <= other.conditioning for other in poses[max(k - 1, 0) : k + 2])
        if k and pose.sign * poses[k - 1].sign < 0:
            time = _crossing(poses[k - 1], pose)
            said = f"a singular position was crossed at about t = {time:.4g} s"
        elif least and pose.conditioning < NEAR * best:
            said = f"nearly singular at t = {pose.time:.6g} s"
        else:
            continue
        notes.append(f"{said}: {_leading(system, pose)} could branch there")
    return notes


def _crossing(before: _Pose, after: _Pose) -> float:
    """Where the signed conditioning is zero, by its line."""
    share = before.conditioning / (before.conditioning + after.conditioning)
    return before.time + share * (after.time - before.time)
