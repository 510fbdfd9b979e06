"""Many forward runs at once: scenes over the processors of this machine, each as if it were alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import check_method, check_output_step
from ffr_dyn.analyses.trials.begin import Beginning
from ffr_dyn.functions.together import Say, together
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.result import Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import ComputationError, InputError

Outcome = Result | InputError | ComputationError


def forward_many(
    scenes: Sequence[Scene],
    *,
    end: float,
    output_step: float,
    method: Integrator | Within | None = None,
    start: float = 0.0,
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    outputs: Sequence[str] = ("default",),
    events: Sequence[Event] = (),
    check: bool | None = False,
    begin: Beginning = "as-given",
    paths: Sequence[str | Path] | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Outcome]:
    """`forward` of every scene, over threads: the compiled loops of several scenes run at the same time.

    paths    : a result file for each scene
    threads  : at most; by default as many as this process has processors
    progress : called with (runs done, runs) as runs end
    check    : as of `forward`, but not by default

    The other settings are those of `forward`, for all scenes. Scenes need have nothing in common; bodies that are the same
    object are prepared once. Every result is that of `forward` alone, to the bit, with any number of threads.

    Returns, in the order of the scenes, a result each, or the InputError or ComputationError that its run has raised: a scene
    that fails leaves the others alone. Raises InputError for settings that no scene could use. After Ctrl-C the runs that
    have begun end within a second, and their files are readable.

    >>> results = fd.forward_many([crank(speed) for speed in speeds], end=0.1, output_step=1e-3, method=fd.ROS2(1e-4))
    >>> forces = [r["pin.force"] for r in results if isinstance(r, fd.Result)]
    """
    scenes = several("scenes", scenes, (Scene,))
    check_output_step(output_step)
    check_method(method)
    if threads is not None and (type(threads) is not int or threads < 1):
        raise InputError(f"there cannot be {threads} threads; give how many runs may go on at the same time, 1 or more")
    if paths is not None and len(set(map(str, paths))) != len(scenes):
        raise InputError(
            f"{len(scenes)} scenes need as many paths, each another; there are {len(set(map(str, paths)))}"
        )
    common: dict[str, Any] = {"end": end, "output_step": output_step, "method": method, "start": start, "check": check}
    common |= {"stabilisation": stabilisation, "outputs": outputs, "events": events, "begin": begin}
    runs = [
        partial(_run, scene, common if paths is None else common | {"path": paths[k]}) for k, scene in enumerate(scenes)
    ]
    found: dict[int, Outcome] = {}
    for number, outcome in together(runs, threads):
        if not isinstance(outcome, Outcome):
            raise outcome
        found[number] = outcome
        if progress is not None:
            progress(len(found), len(scenes))
    return [found[k] for k in range(len(scenes))]


def _run(scene: Scene, how: dict[str, Any], say: Say) -> Result:
    return forward(scene, progress=say, **how)
