"""The commands `ffr-dyn run` and `forward`, and what all commands that analyse a scene have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, reserve
from ffr_prep.common.entries import assignments
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.analyses.registry import OfMoment, OverTime
    from ffr_dyn.analyses.settings import MomentSettings, Settings
    from ffr_dyn.integrators import Integrator, Within
    from ffr_dyn.results.result import Result
    from ffr_dyn.scene.scene import Scene

scene_argument = click.argument("scene", type=INPUT_FILE)
_RESULT = "Result file (netCDF); default: <scene>.nc, and <scene>.<analysis>.nc where the scene file asks for another."
output_option = click.option("-o", "--output", type=OUTPUT_FILE, help=_RESULT)
# Of analyses whose --output is a quantity.
file_option = click.option("-o", "--file", "output", type=OUTPUT_FILE, help=_RESULT)
parameter_option = click.option(
    "-p",
    "--parameter",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    help="A parameter of the scene file, or another entry by its path, such as bodies.rod.damping=0.02 or gravity.2=-1.62.",
)
keep_option = click.option(
    "--keep", multiple=True, metavar="NAME", help="Quantities to keep, instead of the scene's; * and ? match."
)
time_option = click.option("--time", type=float, help="[s], for what depends on time; default: the scene's, or 0.")
span_options = (
    click.option("--end", type=float, help="End of the run [s], instead of the scene's."),
    click.option("--output-step", type=float, help="A row of the result every ... [s], instead of the scene's."),
)
method_options = (
    click.option(
        "--step", type=float, help="Time step [s], instead of the scene's, or of one that keeps the accuracy."
    ),
    click.option("--accuracy", type=float, help="Find the step that keeps it, relative to ranges; default: 1e-3."),
    click.option("--tolerance", type=float, help="Relative tolerance of a method that chooses its steps."),
    click.option("--method", metavar="NAME", help="Integrator, instead of the scene's; `ffr-dyn methods` lists them."),
)
resume_option = click.option(
    "--resume", is_flag=True, help="Go on where the result file ends, as if the run had never stopped."
)
SPAN = ("end", "output_step")
INTEGRATION = (*SPAN, "step", "accuracy", "tolerance", "method")


def with_options(*options: Callable[..., Any]) -> Callable[..., Any]:
    """Several options as one decorator."""

    def decorate(function: Any) -> Any:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


RUN_EXAMPLE = """\b
Example:
  ffr-dyn run crank.toml -p crank.length=0.06 --method ros3 --step 1e-4 --keep 'rod.*' -o out/crank.nc
  ffr-dyn run crank.toml --end 2 -o out/crank.nc --resume
"""


@click.command(epilog=RUN_EXAMPLE)
@with_options(
    scene_argument, output_option, parameter_option, keep_option, *span_options, *method_options, resume_option
)
def run(
    scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...], resume: bool, **changes: Any
) -> None:
    """Analyse SCENE as its file says, forward dynamics if it does not, and write the result file.

    ros2 and ros3 (more accurate, twice the cost of a step) treat elastic modes and stiff forces implicitly: neither limits
    their step. rk4 is explicit, of fourth order: exact for soft bodies at small steps, unstable when step times the highest
    circular frequency exceeds about 2.8. ros3-adaptive and dopri5 (explicit) choose their steps by --tolerance.
    Drift off the constraints is held by projection and reported. A run that was killed keeps what its last flush wrote,
    a few seconds old; --resume goes on from there to the same bits. Without a result file it starts at the beginning.
    """
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    settings = replace(settings, outputs=keep or settings.outputs)
    perform(loaded, changed(settings, changes), output or scene.with_suffix(".nc"), resume)


def require_after(option: str, end: float | None, start: float) -> None:
    """InputError for an end that is no time after the start."""
    if end is not None and not start < end < math.inf:
        raise InputError(f"{option} {end:g}: give a time after the start, {start:g} s")


def over_time(
    settings: Settings | MomentSettings,
    analysis: OverTime,
    keep: tuple[str, ...],
    end: float | None = None,
    output_step: float | None = None,
) -> Settings:
    """The settings of a file with another analysis. InputError where neither the file nor the options have times."""
    from ffr_dyn.analyses.registry import word_of
    from ffr_dyn.analyses.settings import MomentSettings, Settings
    from ffr_dyn.integrators import Within

    if isinstance(settings, MomentSettings):
        if end is None or output_step is None:
            raise InputError(
                f"the scene file asks for a {word_of(type(settings.analysis))} analysis, which has no times: a "
                f"{word_of(type(analysis))} analysis needs an [analysis] with end and output_step, or --end and --output-step"
            )
        return Settings(
            start=settings.time, end=end, output_step=output_step, method=Within(), outputs=keep or settings.outputs,
            analysis=analysis,
        )  # fmt: skip
    return replace(settings, analysis=analysis, outputs=keep or settings.outputs)


def at_moment(
    settings: Settings | MomentSettings, analysis: OfMoment, time: float | None, keep: tuple[str, ...]
) -> MomentSettings:
    """The settings of a file with another analysis, at another time if one is given."""
    from ffr_dyn.analyses.settings import MomentSettings

    if time is not None and not math.isfinite(time):
        raise InputError(f"--time {time}: give a time in seconds")
    given = settings.time if isinstance(settings, MomentSettings) else 0.0
    return MomentSettings(time=given if time is None else time, outputs=keep or settings.outputs, analysis=analysis)


def changed(settings: Settings | MomentSettings, changes: Mapping[str, Any]) -> Settings | MomentSettings:
    """Another end, step or method than the file's. InputError for an analysis that has none."""
    from ffr_dyn.analyses.registry import word_of
    from ffr_dyn.analyses.settings import Settings

    given = {key: value for key, value in changes.items() if value is not None}
    integrates = isinstance(settings, Settings) and settings.analysis.integrates
    known = INTEGRATION if integrates else SPAN if isinstance(settings, Settings) else ()
    for key in given:
        if key not in known:
            word = key.replace("_", "-")
            raise InputError(f"--{word}: a {word_of(type(settings.analysis))} analysis has no {word}; leave it out")
    if not isinstance(settings, Settings):
        return settings
    method = _method(settings, given) if integrates else settings.method
    return replace(settings, **{key: given[key] for key in SPAN if key in given}, method=method)


def _method(settings: Settings, given: Mapping[str, Any]) -> Integrator | Within:
    """The method of the file, or the one that was asked for, with the step, accuracy or tolerance that was asked for."""
    from ffr_dyn.integrators import Within, method_named, stepped, tolerances

    own, named = settings.method, given.get("method")
    word = named or (own.method if isinstance(own, Within) else _word(own))
    kind = method_named(word)
    if kind.controlled:
        for key in ("step", "accuracy"):
            if key in given:
                raise InputError(f"--{key}: {kind.__name__} chooses its steps; give --tolerance")
        if "tolerance" in given:
            found: Integrator = kind(tolerances(given["tolerance"]))
            return found
        return own if named is None else kind()
    if "tolerance" in given:
        raise InputError(f"--tolerance: {kind.__name__} takes steps of one length; give --step or --accuracy")
    if {"step", "accuracy"} <= given.keys():
        raise InputError("--accuracy finds the step; leave out --step, or the accuracy")
    within = _within(own, word, given)
    if "step" in given:
        return stepped(within, given["step"])
    if "accuracy" in given or isinstance(own, Within) or own.controlled:
        return within
    return stepped(within, own.step)


def _word(method: Integrator) -> str:
    from ffr_dyn.integrators import methods

    return next(word for word, made in methods().items() if type(method) is made)


def _within(own: Integrator | Within, word: str, given: Mapping[str, Any]) -> Within:
    """The method of a word with the accuracy that was asked for, or the file's, and the file's settings of that method."""
    from ffr_dyn.analyses.settings import settings_of
    from ffr_dyn.integrators import Within, method_named

    accuracy = given.get("accuracy", own.accuracy if isinstance(own, Within) else Within().accuracy)
    if isinstance(own, Within):
        return Within(accuracy, word, own.settings if word == own.method else ())
    kind = method_named(word)
    settings = tuple((key, getattr(own, key)) for key in settings_of(kind)) if type(own) is kind else ()
    return Within(accuracy, word, settings)


def perform(scene: Scene, settings: Settings | MomentSettings, output: Path, resume: bool = False) -> None:
    """Analyse a scene and tell what came of it."""
    result = analysed(scene, settings, output, resume)
    for line in settings.analysis.report(result):
        click.echo(line)
    click.echo(f"result       {output}")


def analysed(
    scene: Scene, settings: Settings | MomentSettings, output: Path | None = None, resume: bool = False
) -> Result:
    """The result of a scene, with progress where that takes its time."""
    from ffr_dyn.analyses.run import require_resumable
    from ffr_dyn.analyses.run import run as analyse
    from ffr_dyn.analyses.settings import Settings
    from ffr_dyn.cli.progress_bar import counted, progress

    if resume:
        require_resumable(settings)
    reserve("-o", output, usual=".nc")
    if not isinstance(settings, Settings) and not settings.analysis.counts:
        return analyse(scene, settings, path=output)
    if not isinstance(settings, Settings):
        with counted(scene.name) as count:
            return analyse(scene, settings, path=output, progress=count)
    with progress(scene.name, settings.end, start=settings.start) as update:
        return analyse(scene, settings, path=output, resume=output if resume else None, progress=update)
