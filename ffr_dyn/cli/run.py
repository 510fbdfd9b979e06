"""The commands `ffr-dyn run` and `forward`, and what all commands that analyse a scene have in common."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.analyses.settings import MomentSettings, OverTime, Settings
    from ffr_dyn.integrators import Integrator
    from ffr_dyn.scene.scene import Scene

EVENTS_SHOWN = 20

scene_argument = click.argument("scene", type=click.Path(path_type=Path))
output_option = click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Result file (netCDF); default: <scene>.nc."
)
parameter_option = click.option(
    "-p", "--parameter", "parameters", multiple=True, metavar="NAME=VALUE", help="A parameter of the scene file."
)
keep_option = click.option(
    "--keep", multiple=True, metavar="NAME", help="Quantities to keep, instead of the scene's; * and ? match."
)
_INTEGRATION = (
    click.option("--end", type=float, help="End of the run [s], instead of the scene's."),
    click.option("--step", type=float, help="Time step [s], instead of the scene's."),
    click.option("--tolerance", type=float, help="Relative tolerance of a method that chooses its steps."),
    click.option("--method", metavar="NAME", help="Integrator, instead of the scene's: ros2, ros3-adaptive, rk4, ..."),
    click.option("--resume", is_flag=True, help="Go on where the result file ends, as if the run had never stopped."),
)


def _all_of(*options: Callable[..., Any]) -> Callable[..., Any]:
    def decorate(function: Any) -> Any:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


scene_options = _all_of(scene_argument, output_option, parameter_option, keep_option)
integration_options = _all_of(*_INTEGRATION)

RUN_EXAMPLE = """\b
Example:
  ffr-dyn run crank.toml -p crank.length=0.06 --method ros3 --step 1e-4 --keep 'rod.*' -o out/crank.nc
  ffr-dyn run crank.toml --end 2 -o out/crank.nc --resume
"""


@click.command(epilog=RUN_EXAMPLE)
@scene_options
@integration_options
def run(
    scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...], resume: bool, **changes: Any
) -> None:
    """Analyse SCENE as its file says, forward dynamics if it does not, and write the result file.

    ros2 and ros3 (more accurate, twice the cost of a step) treat the elastic modes implicitly: no elastic frequency limits
    their step. rk4 is explicit, of fourth order: exact for soft bodies at small steps, unstable when step times the highest
    circular frequency exceeds about 2.8. ros3-adaptive and dopri5 (explicit) choose their steps by --tolerance.
    Drift off the constraints is held by projection and reported. A run that was killed keeps what its last flush wrote,
    a few seconds old; --resume goes on from there to the same bits. Without a result file it starts at the beginning.
    """
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    settings = replace(settings, outputs=keep or settings.outputs)
    perform(loaded, _changed(settings, changes), output or scene.with_suffix(".nc"), resume)


@click.command()
@scene_options
@integration_options
def forward(
    scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...], resume: bool, **changes: Any
) -> None:
    """Forward dynamics of SCENE, whatever analysis its file asks for; see `ffr-dyn run --help`."""
    from ffr_dyn.analyses.settings import Forward
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    perform(loaded, _changed(over_time(settings, Forward(), keep), changes), output or scene.with_suffix(".nc"), resume)


def assignments(parameters: tuple[str, ...]) -> dict[str, str]:
    """{"crank.length": "0.15"} of ("crank.length=0.15",)."""
    for text in parameters:
        if "=" not in text:
            raise InputError(f"-p {text}: write it as NAME=VALUE")
    pairs = (text.partition("=") for text in parameters)
    return {name.strip(): value.strip() for name, _, value in pairs}


def require_file(option: str, path: Path | None, suffixes: tuple[str, ...] = ()) -> None:
    """Before the work, not after it: InputError for a file that could not be written, or not in a known format."""
    if path is None:
        return
    if path.is_dir():
        raise InputError(f"{option} {path} is a folder; name the file to write")
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(
            f"{option} {path}: it is written as {' or '.join(suffixes)}, not {path.suffix or 'without a suffix'}"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"{option} {path}: the folder {path.parent} cannot be written to; choose another place")


def require_after(option: str, end: float | None, start: float) -> None:
    """InputError for an end that is no time after the start."""
    if end is not None and not start < end < math.inf:
        raise InputError(f"{option} {end:g}: give a time after the start, {start:g} s")


def over_time(settings: Settings | MomentSettings, analysis: OverTime, keep: tuple[str, ...]) -> Settings:
    """The settings of a file with another analysis. InputError where the file's own has no times."""
    from ffr_dyn.analyses.settings import MomentSettings

    if isinstance(settings, MomentSettings):
        raise InputError(
            f"the scene file asks for a {type(settings.analysis).__name__.lower()} analysis, which has no times; "
            f"{type(analysis).__name__.lower()} analysis needs an [analysis] with end and output_step"
        )
    return replace(settings, analysis=analysis, outputs=keep or settings.outputs)


def _changed(settings: Settings | MomentSettings, changes: Mapping[str, Any]) -> Settings | MomentSettings:
    """Another end, step or method than the file's. InputError for an analysis that has none."""
    from ffr_dyn.analyses.settings import Kinematic, MomentSettings

    given = {key: value for key, value in changes.items() if value is not None}
    if isinstance(settings, MomentSettings) or isinstance(settings.analysis, Kinematic):
        known = () if isinstance(settings, MomentSettings) else ("end",)
        for key in given:
            if key not in known:
                raise InputError(f"--{key}: there is no {key} of a {type(settings.analysis).__name__.lower()} analysis")
        return replace(settings, **given)
    return replace(settings, end=given.get("end", settings.end), method=_method(settings, given))


def _method(settings: Settings, given: Mapping[str, Any]) -> Integrator:
    """The method of the file, or the one that was asked for, with the step or the tolerance that was asked for."""
    from ffr_dyn.integrators import CONTROLLED, METHODS, tolerances

    named = given.get("method")
    known = {**METHODS, **CONTROLLED}
    if named is not None and named not in known:
        raise InputError(f"--method {named}: there is no such method; there are {', '.join(known)}")
    kind: Any = type(settings.method) if named is None else known[named]
    if kind.controlled:
        if "step" in given:
            raise InputError(f"--step: {kind.__name__} chooses its steps; give --tolerance")
        if "tolerance" in given:
            return kind(tolerances(given["tolerance"]))
        return settings.method if named is None else kind()
    if "tolerance" in given:
        raise InputError(f"--tolerance: {kind.__name__} takes steps of one length; give --step")
    usual = settings.output_step / 10 if settings.method.controlled else settings.method.step
    step = given.get("step", usual)
    return replace(settings.method, step=step) if kind is type(settings.method) else kind(step)  # type: ignore[type-var]


def perform(scene: Scene, settings: Settings | MomentSettings, output: Path, resume: bool = False) -> None:
    """Analyse a scene, with progress where that takes its time, and tell what came of it."""
    from ffr_dyn.analyses.run import require_resumable
    from ffr_dyn.analyses.run import run as analyse
    from ffr_dyn.analyses.settings import Linearise, Settings
    from ffr_dyn.cli.progress_bar import progress

    if resume:
        require_resumable(settings)
    if isinstance(settings, Settings):
        with progress(scene.name, settings.end, start=settings.start) as update:
            result = analyse(scene, settings, path=output, resume=output if resume else None, progress=update)
        lines = summary(result.attributes)
    elif isinstance(settings.analysis, Linearise):
        lines = _linearised(scene, settings.analysis, settings.time, output)
    else:
        lines = summary(analyse(scene, settings, path=output).attributes)
    for line in lines:
        click.echo(line)
    click.echo(f"result       {output}")


def _linearised(scene: Scene, analysis: Any, time: float, output: Path) -> list[str]:
    """The modes, a line each, and notes."""
    from ffr_dyn.analyses.linearise import as_result, table_of_modes
    from ffr_dyn.analyses.run import linearised
    from ffr_dyn.results.file import save_result

    found = linearised(scene, analysis, time)
    save_result(as_result(scene, found, time), output)
    return [*table_of_modes(found), *(f"note         {note}" for note in found.notes)]


def summary(attributes: Mapping[str, Any]) -> list[str]:
    """What an analysis reports, a line each."""
    a = attributes
    lines = [
        f"scene        {a['title']}: {a['analysis']}, {a['degrees_of_freedom']} degrees of freedom",
        f"method       {a['method']}, {a.get('evaluations', 0)} evaluations of the equations of motion",
    ]
    if "largest_drift" in a:
        position, velocity = a["largest_drift"]
        lines.append(
            f"constraints  left by at most {position:.1e} (rate {velocity:.1e}); {a['projections']} projections"
        )
    if "stable" in a:
        lines.append(f"equilibrium  {'stable' if a['stable'] else 'unstable'}")
    passed = [f"event        {e['event']} at t = {e['time']:.9g} s" for e in a.get("events", [])]
    more = [f"event        ... and {len(passed) - EVENTS_SHOWN} more"] if len(passed) > EVENTS_SHOWN else []
    return lines + passed[:EVENTS_SHOWN] + more + [f"note         {note}" for note in a["notes"]]
