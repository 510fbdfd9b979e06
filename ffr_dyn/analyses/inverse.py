"""Inverse dynamics: every rigid motion prescribed by drivers, the drivers' forces and all reactions wanted.

The elastic coordinates are dynamic - their vibration is integrated, as in a forward run - or quasi-static: at every output
time they take the values at which they would stay, q_dot = q_ddot = 0, under the inertia of the prescribed motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.kinematic import Followed, along_the_path
from ffr_dyn.analyses.outcome import efforts, efforts_told, needed, only, result_of, with_quantities
from ffr_dyn.analyses.registry import OverTime, option
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.analyses.trials.begin import Beginning
from ffr_dyn.consistency.assemble import Assembled, assemble, flattened
from ffr_dyn.consistency.doubts import SUDDEN, checked
from ffr_dyn.consistency.evaluation import Evaluator, copied, evaluate, evaluator, joined, locked
from ffr_dyn.consistency.mobility import require_driven, undeformed
from ffr_dyn.equations.layout import moved, to_global_axes, velocity_sizes
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.kernels.tables import AT, EVALUATIONS, HERE
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS = 30
TOLERANCE = 1e-12  # of a change of q, relative to its size or to one that strains the body by STRAINED
STRAINED, BENT = 1e-6, 1e-2  # q over size and root of mass of a body: the least by which changes and differences go
ROUNDING = 1e-10  # relative as well, of a change that another one follows: what is left is rounding
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class Dynamic:
    """Elastic coordinates are integrated; `method`, `stabilisation` and `begin` are those of `forward`.

    >>> result = fd.inverse(scene, end=0.2, output_step=1e-3, elastic=fd.Dynamic(fd.ROS2(1e-4)))
    """

    method: Integrator | Within | None = None
    stabilisation: Stabilisation = Projection()  # noqa: RUF009 - frozen
    begin: Beginning = "as-given"


@dataclass(frozen=True)
class QuasiStatic:
    """Elastic coordinates follow the motion without vibration.

    >>> result = fd.inverse(scene, end=0.2, output_step=1e-3, elastic=fd.QuasiStatic())
    """


@dataclass(frozen=True)
class Inverse(OverTime):
    """Method, step, stabilisation and how it begins are of dynamic elastic coordinates.

    begin : "quasi-static": with the deflections that the motion asks for, which do not ring; "steady" or "periodic": in that
        motion; "as-given": with those of the scene

    >>> analysis = fd.Inverse("quasi-static")
    >>> result = fd.run(scene, fd.Settings(start=0, end=1, output_step=0.01, method=fd.Within(), analysis=analysis))
    """

    integrates: ClassVar[bool] = True
    stabilised: ClassVar[bool] = True
    elastic: Literal["dynamic", "quasi-static"] = field(
        default="dynamic",
        metadata=option("--quasi-static/--dynamic", "Bodies deform without vibration. | Bodies vibrate (default)."),
    )
    begin: Beginning = "as-given"

    def perform(self, scene: Scene, settings: Settings, **how: Any) -> Result:
        quasi_static = self.elastic == "quasi-static"
        elastic = QuasiStatic() if quasi_static else Dynamic(settings.method, settings.stabilisation, self.begin)
        return inverse(scene, elastic=elastic, **settings.span, **how)


def inverse(
    scene: Scene,
    *,
    end: float,
    output_step: float,
    start: float = 0.0,
    elastic: Dynamic | QuasiStatic = Dynamic(),
    outputs: Sequence[str] = ("default",),
    path: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """The forces that drive a scene along its prescribed motion, and all reactions, every `output_step` [s].

    "driver.effort" [N m or N] is the moment or force along the driven coordinate that acts on the joint's second body, its
    opposite on the first; "driver.power" = effort x rate. A driven point has "driver.force" instead.

    outputs : names or patterns of the quantities to keep beside the efforts, as in `forward`

    Raises InputError when a rigid motion is left free or prescribed twice; ComputationError when the run fails.

    >>> result = fd.inverse(scene, end=0.2, output_step=1e-3)
    >>> result["motor.effort"]
    """
    require_driven(undeformed(scene), start, "inverse dynamics")
    if isinstance(elastic, QuasiStatic):
        return _quasi_static(scene, (start, end, output_step), outputs, path, progress)
    if not isinstance(elastic, Dynamic):
        raise InputError(f"elastic is {elastic!r}; give Dynamic() or QuasiStatic()")
    result = forward(
        scene, end=end, output_step=output_step, method=elastic.method, start=start,
        stabilisation=elastic.stabilisation, begin=elastic.begin, outputs=needed(scene, outputs), path=path,
        progress=progress,
    )  # fmt: skip
    told = efforts_told(scene, result, {})
    named = replace(result, attributes={**told, "analysis": "inverse dynamics"})
    return with_quantities(only(named, scene, outputs), efforts(flattened(scene, start)[0], named), path)


# ---- quasi-static deformation ---------------------------------------------------------------------------------------


def _quasi_static(
    scene: Scene,
    span: tuple[float, float, float],
    outputs: Sequence[str],
    path: str | Path | None,
    progress: Callable[[float], None] | None,
) -> Result:
    """At every output time: the undeformed motion, then the deformation at which the elastic accelerations vanish."""
    assembled = assemble(scene, time=span[0])
    selected(assembled.system, needed(scene, outputs))
    rigid = along_the_path(scene, span)
    at, places = evaluator(assembled.system), _coordinates(assembled)
    q, rows = np.zeros(places[1].size), []
    tangent = None
    for row, time in enumerate(rigid.record.time):
        x = _undeformed_state(assembled, rigid, row)
        at.work.loads.reference[:] = rigid.record.forces[row]  # with the turns of the path
        _require_regular(at, float(time), x)
        q, tangent = _deformed(at, places, float(time), x, q, tangent)
        _pose(at, places, float(time), x, q)
        rows.append(copied(at.record))
        if progress is not None:
            progress(float(time))
    record = with_all_reactions(assembled, joined(rows))
    attributes = {
        **described(scene),
        "analysis": "inverse dynamics, quasi-static deformation",
        "method": "Newton-Raphson",
        "evaluations": int(at.work.info[EVALUATIONS]),
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "computed": assembled.computed,
        "notes": [*assembled.notes, *checked("inverse", assembled, record, {SUDDEN: rigid.sudden})],
        "status": "complete",
    }
    return result_of(assembled.system, record, attributes, path, outputs, rigid.angles)


def _coordinates(assembled: Assembled) -> tuple[Array, Array]:
    """Numbers of the rigid and of the elastic velocities. InputError where rigid motion alone does not fit the rows."""
    place = assembled.system.layout
    rigid = np.concatenate([np.arange(place.iv[b], place.iv[b] + 6) for b in range(len(place.n))])
    elastic = np.setdiff1d(np.arange(place.v_size), rigid)
    rows = assembled.system.model.rows.kind.size + locked(place).size
    if rows != rigid.size:
        raise InputError(
            f"{rows - rigid.size} rows of the joints are redundant for rigid bodies and are met by deformation only; use "
            "elastic=Dynamic(), or joints that constrain less (spherical or universal in place of a revolute)"
        )
    return rigid, elastic


def _undeformed_state(assembled: Assembled, rigid: Followed, row: int) -> Array:
    place, x = assembled.system.layout, np.zeros(assembled.system.layout.x_size)
    of, there = rigid.assembled.system.layout, rigid.record.x[row]
    for b in range(len(place.n)):
        x[place.R(b)], x[place.p(b)] = there[of.R(b)], there[of.p(b)]
    return x


def _require_regular(at: Evaluator, time: float, x: Array) -> None:
    """ComputationError in a singular position."""
    if evaluate(at, time, x, np.zeros(at.system.layout.v_size)).singular or at.work.independence[HERE] < AT:
        raise ComputationError(
            f"at t = {time:.6g} s the position is singular: joints and drivers determine neither the motion nor the "
            "deformation there; choose output times that miss it, or use elastic=Dynamic()"
        )


def _pose(at: Evaluator, places: tuple[Array, Array], time: float, x: Array, q: Array) -> Array:
    """Elastic accelerations (E,) with the deformation q at rest in the prescribed motion, which x is near to."""
    place, (rigid, elastic) = at.system.layout, places
    x, still = x.copy(), np.zeros(place.v_size)
    x[np.concatenate([np.arange(s.start, s.stop) for s in map(place.q, range(len(place.n)))]).astype(int)] = q
    for _ in range(ITERATIONS):
        now = evaluate(at, time, x, still)
        step = still.copy()
        step[rigid] = np.linalg.solve(now.jacobian[:, rigid], -now.Phi)
        x = moved(place, x, step)
        if np.abs(step).max() < 1e-13:
            break
    v = still.copy()
    v[rigid] = np.linalg.solve(now.jacobian[:, rigid], -now.nu)
    found: Array = evaluate(at, time, x, to_global_axes(place, x, v)).acceleration[elastic]
    return found


def _deformed(
    at: Evaluator, places: tuple[Array, Array], time: float, x: Array, q: Array, tangent: Array | None
) -> tuple[Array, Array]:
    """Deformation with vanishing elastic accelerations, and the tangent that found it, to be tried again at the next time."""
    if q.size == 0:
        return q, np.zeros((0, 0))
    before, sizes = np.inf, velocity_sizes(at.system.scene, at.system.layout)[places[1]]
    for _ in range(ITERATIONS):
        residual = _pose(at, places, time, x, q)
        if tangent is None:
            tangent = _tangent(at, places, time, x, q, sizes)
        step = np.linalg.solve(tangent, residual)
        q = q - step
        size = float(np.abs(step / sizes).max())
        scale = max(float(np.abs(q / sizes).max()), STRAINED)
        if size < TOLERANCE * scale or before < ROUNDING * scale:
            return q, tangent
        if size > 0.1 * before:
            tangent = None
        before = size
    raise ComputationError(
        f"at t = {time:.6g} s no quasi-static deformation was found: the load is near to buckling a body, or the elastic "
        "forces are not finite; use elastic=Dynamic()"
    )


def _tangent(at: Evaluator, places: tuple[Array, Array], time: float, x: Array, q: Array, sizes: Array) -> Array:
    """(E, E) central differences of the elastic accelerations, by shares of the sizes (E,) of bodies."""
    steps = DIFFERENCE * max(float(np.abs(q / sizes).max()), BENT) * sizes
    sides = [[_pose(at, places, time, x, q + sign * one) for sign in (1, -1)] for one in np.diag(steps)]
    return np.array([(plus - minus) / (2 * h) for h, (plus, minus) in zip(steps, sides, strict=True)]).T
