"""Inverse dynamics: every rigid motion prescribed by drivers, the drivers' forces and all reactions wanted.

The elastic coordinates are dynamic - their vibration is integrated, as in a forward run - or quasi-static: at every output
time they take the values at which they would stay, q_dot = q_ddot = 0, under the inertia of the prescribed motion
(`ffr_dyn.analyses.inversion.quasi_static`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.inversion.quasi_static import inverse_quasi_static
from ffr_dyn.analyses.outcome import efforts, efforts_told, needed, only, with_quantities
from ffr_dyn.analyses.registry import OverTime, option
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.analyses.trials.begin import Beginning
from ffr_dyn.consistency.assemble import flattened
from ffr_dyn.consistency.mobility import require_driven, undeformed
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import InputError


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
        return inverse_quasi_static(scene, (start, end, output_step), outputs, path, progress)
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
