"""From a scene and its settings to the result: the analysis that a scene file asks for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.inverse import Dynamic, QuasiStatic, inverse
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.analyses.linearise import Linearisation, as_result, linearise
from ffr_dyn.analyses.mixed import mixed
from ffr_dyn.analyses.settings import (
    Assemble,
    Forward,
    Inverse,
    Kinematic,
    Linearise,
    Mixed,
    MomentSettings,
    Settings,
    Static,
)
from ffr_dyn.analyses.start import assembly
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.results.file import save_result
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import InputError


def run(
    scene: Scene,
    settings: Settings | MomentSettings,
    *,
    path: str | Path | None = None,
    resume: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Analyse a scene as its settings say; `path`, `resume` and `progress` are those of `forward`.

    Raises InputError for what the analysis cannot do, and when another than a forward run is to be resumed.
    """
    if resume is not None:
        require_resumable(settings)
    if isinstance(settings, Settings):
        return _over_time(scene, settings, path, resume, progress)
    if isinstance(settings.analysis, Assemble):
        return assembly(scene, time=settings.time, outputs=settings.outputs, path=path)
    if isinstance(settings.analysis, Static):
        return static(scene, time=settings.time, outputs=settings.outputs, path=path)
    result = as_result(scene, linearised(scene, settings.analysis, settings.time), settings.time)
    if path is not None:
        save_result(result, path)
    return result


def require_resumable(settings: Settings | MomentSettings) -> None:
    """InputError for what is not a forward run."""
    if not isinstance(settings.analysis, Forward):
        raise InputError(
            f"only a forward run can be resumed, not a {type(settings.analysis).__name__.lower()} analysis"
        )


def linearised(scene: Scene, analysis: Linearise, time: float) -> Linearisation:
    """The linearisation that the settings ask for, about the start or the equilibrium."""
    if analysis.at_equilibrium:
        scene = scene_at(scene, static(scene, time=time))
    return linearise(scene, time=time, inputs=analysis.inputs, outputs=analysis.quantities)


def _over_time(
    scene: Scene,
    settings: Settings,
    path: str | Path | None,
    resume: str | Path | None,
    progress: Callable[[float], None] | None,
) -> Result:
    analysis, method, stabilisation = settings.analysis, settings.method, settings.stabilisation
    common: dict[str, Any] = {
        "start": settings.start,
        "end": settings.end,
        "output_step": settings.output_step,
        "outputs": settings.outputs,
        "path": path,
        "progress": progress,
    }
    if isinstance(analysis, Kinematic):
        return kinematic(scene, **common)
    if isinstance(analysis, Inverse):
        elastic = QuasiStatic() if analysis.quasi_static else Dynamic(method, stabilisation)
        return inverse(scene, elastic=elastic, **common)
    if isinstance(analysis, Mixed):
        known, solution = analysis.known, analysis.solution
        return mixed(scene, unknown=analysis.unknown, known=known, solution=solution, method=method, **common)
    events = analysis.events
    return forward(scene, method=method, stabilisation=stabilisation, events=events, resume=resume, **common)
