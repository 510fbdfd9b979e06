"""From a scene and its settings to the result: the analysis that a scene file asks for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ffr_dyn.analyses.registry import word_of
from ffr_dyn.analyses.settings import MomentSettings, Settings
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import InputError


def run(
    scene: Scene,
    settings: Settings | MomentSettings,
    *,
    path: str | Path | None = None,
    resume: str | Path | None = None,
    progress: Callable[..., None] | None = None,
) -> Result:
    """Analyse a scene as its settings say; `path`, `resume` and `progress` are those of `forward`, or of
    analyses that count what is done.

    Raises InputError for what the analysis cannot do, and when another than a forward run is to be resumed.

    >>> scene, settings = fd.load_scene("scene.toml")
    >>> result = fd.run(scene, settings)
    """
    how: dict[str, Any] = {"path": path}
    if isinstance(settings, Settings) or (settings.analysis.counts and progress is not None):
        how["progress"] = progress
    if resume is not None:
        require_resumable(settings)
        how["resume"] = resume
    return settings.analysis.perform(scene, settings, **how)


def require_resumable(settings: Settings | MomentSettings) -> None:
    """InputError for what cannot be resumed."""
    if not settings.analysis.resumable:
        raise InputError(f"only a forward run can be resumed, not a {word_of(type(settings.analysis))} analysis")
