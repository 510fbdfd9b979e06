"""The commands `ffr-dyn check`, `kinematic`, `static`, `inverse`, `mixed` and `linearise`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_dyn.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.analyses.efforts import Effort

_FORCES = """\b
Forces are written as
  name=joint.angle, name=joint.stroke    along a joint coordinate
  name=body.interface:x,y,z              at a marker, along a global direction
"""

scene_argument = click.argument("scene", type=click.Path(path_type=Path))
output_option = click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Result file (netCDF); default: <scene>.nc."
)
time_option = click.option("--time", type=float, default=0.0, show_default=True, help="[s], for what depends on time.")


@click.command()
@scene_argument
@time_option
def check(scene: Path, time: float) -> None:
    """What SCENE can do: degrees of freedom, free motions, redundant rows of joints, drivers that contradict."""
    from ffr_dyn.analyses.mobility import mobility
    from ffr_dyn.scene_file import load_scene

    for line in mobility(load_scene(scene)[0], time=time).lines():
        click.echo(line)


@click.command()
@scene_argument
@output_option
def kinematic(scene: Path, output: Path | None) -> None:
    """Positions, velocities and accelerations of SCENE, whose drivers prescribe all motion; bodies undeformed."""
    from ffr_dyn.analyses.kinematic import kinematic as analysis

    _over_time(scene, output, lambda loaded, settings, **options: analysis(loaded, **options))


@click.command()
@scene_argument
@output_option
@click.option("--quasi-static", is_flag=True, help="Elastic coordinates follow without vibration.")
def inverse(scene: Path, output: Path | None, quasi_static: bool) -> None:
    """Forces that drive SCENE along its prescribed motion, and all reactions."""
    from ffr_dyn.analyses.inverse import Dynamic, QuasiStatic
    from ffr_dyn.analyses.inverse import inverse as analysis

    def run(loaded: Any, settings: Any, **options: Any) -> Any:
        elastic = QuasiStatic() if quasi_static else Dynamic(settings.method, settings.stabilisation)
        return analysis(loaded, elastic=elastic, **options)

    _over_time(scene, output, run)


@click.command(epilog=_FORCES)
@scene_argument
@output_option
@click.option("--unknown", "forces", multiple=True, required=True, metavar="FORCE", help="Force to find; repeat.")
@click.option("--known", multiple=True, help="Driver that is a known motion, not a true driver; default: all.")
def mixed(scene: Path, output: Path | None, forces: tuple[str, ...], known: tuple[str, ...]) -> None:
    """Motion and unknown forces of SCENE, some motions of which are known.

    Forces away from the known motions are found by integration where that is stable, else as the bounded solution, which
    adds times before and after the run.
    """
    from ffr_dyn.analyses.mixed import mixed as analysis

    unknown = tuple(force_of(text) for text in forces)

    def run(loaded: Any, settings: Any, **options: Any) -> Any:
        return analysis(loaded, unknown=unknown, known=known or None, method=settings.method, **options)

    _over_time(scene, output, run)


@click.command()
@scene_argument
@output_option
@time_option
def static(scene: Path, output: Path | None, time: float) -> None:
    """Static equilibrium of SCENE, downhill from its start, with reactions and stability."""
    from ffr_dyn.analyses.static import static as analysis
    from ffr_dyn.cli import summary
    from ffr_dyn.scene_file import load_scene

    output = output or scene.with_suffix(".nc")
    result = analysis(load_scene(scene)[0], time=time, path=output)
    for line in summary(result.attributes):
        click.echo(line)
    click.echo(f"equilibrium  {'stable' if result.attributes['stable'] else 'unstable'}")
    click.echo(f"result       {output}")


@click.command(epilog=_FORCES)
@scene_argument
@output_option
@time_option
@click.option("--at-equilibrium", is_flag=True, help="About the static equilibrium instead of the start.")
@click.option(
    "--input", "forces", multiple=True, metavar="FORCE", help="Input: a force, or the name of a load; repeat."
)
@click.option(
    "--quantity", "quantities", multiple=True, help="Output: a component, such as rod.tip.position.y; repeat."
)
def linearise(
    scene: Path,
    output: Path | None,
    time: float,
    at_equilibrium: bool,
    forces: tuple[str, ...],
    quantities: tuple[str, ...],
) -> None:
    """Eigenvalues and state-space matrices of SCENE about its start or its equilibrium."""
    from ffr_dyn.analyses.linearise import as_result, table_of_modes
    from ffr_dyn.analyses.linearise import linearise as analysis
    from ffr_dyn.analyses.states import scene_at
    from ffr_dyn.analyses.static import static as equilibrium
    from ffr_dyn.result_file import save_result
    from ffr_dyn.scene_file import load_scene

    loaded = load_scene(scene)[0]
    if at_equilibrium:
        loaded = scene_at(loaded, equilibrium(loaded, time=time))
    inputs = tuple(force_of(text) if "=" in text else text for text in forces)
    found = analysis(loaded, time=time, inputs=inputs, outputs=quantities)
    for line in table_of_modes(found):
        click.echo(line)
    for note in found.notes:
        click.echo(f"note         {note}")
    output = output or scene.with_suffix(".nc")
    click.echo(f"result       {save_result(as_result(loaded, found, time), output)}")


COMMANDS = (check, kinematic, static, inverse, mixed, linearise)


def force_of(text: str) -> Effort:
    """A force as the command line writes it. Raises InputError that shows how."""
    from ffr_dyn.analyses.efforts import JointEffort, MarkerEffort

    name, equals, rest = text.partition("=")
    place, colon, along = rest.partition(":")
    if not (name and equals and place):
        raise InputError(f"{text!r} is not a force: write name=joint.angle or name=body.interface:x,y,z")
    if not colon:
        joint, _, coordinate = place.rpartition(".")
        return JointEffort(name, joint, coordinate)
    try:
        direction = tuple(float(number) for number in along.split(","))
    except ValueError:
        raise InputError(f"{text!r}: the direction {along!r} is not three numbers with commas between") from None
    return MarkerEffort(name, place, direction)


def _over_time(scene: Path, output: Path | None, analysis: Callable[..., Any]) -> None:
    """Run an analysis over the times of a scene file, with progress, and tell what came of it."""
    from ffr_dyn.cli import summary
    from ffr_dyn.progress import progress
    from ffr_dyn.scene_file import load_scene

    loaded, settings = load_scene(scene)
    output = output or scene.with_suffix(".nc")
    with progress(loaded.name, settings.end, start=settings.start) as update:
        result = analysis(
            loaded,
            settings,
            start=settings.start,
            end=settings.end,
            output_step=settings.output_step,
            path=output,
            progress=update,
        )
    for line in summary(result.attributes):
        click.echo(line)
    click.echo(f"result       {output}")
