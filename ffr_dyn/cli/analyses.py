"""The commands `ffr-dyn check`, `assemble`, `kinematic`, `static`, `inverse`, `mixed` and `linearise`."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ffr_dyn.cli.run import (
    assignments,
    output_option,
    over_time,
    parameter_option,
    perform,
    scene_argument,
    scene_options,
)
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.analyses.efforts import Effort
    from ffr_dyn.analyses.settings import MomentSettings, OfMoment, Settings

_FORCES = """\b
Forces are written as
  name=joint.angle, name=joint.stroke    along a joint coordinate
  name=body.interface:x,y,z              at a marker, along a global direction

"""
_MIXED = "\b\nExample:\n  ffr-dyn mixed arm.toml --unknown torque=hinge.angle --known path -o out/arm.nc\n"
_LINEARISE = (
    "\b\nExample:\n"
    "  ffr-dyn linearise crane.toml --at-equilibrium --input push=trolley.hook:1,0,0 --quantity load.pin.position.x\n"
)

time_option = click.option("--time", type=float, help="[s], for what depends on time; default: the scene's, or 0.")


@click.command()
@scene_argument
@parameter_option
@time_option
def check(scene: Path, parameters: tuple[str, ...], time: float | None) -> None:
    """What SCENE can do: degrees of freedom, free motions, redundant rows of joints, drivers that contradict."""
    from ffr_dyn.analyses.settings import Static
    from ffr_dyn.consistency.mobility import mobility
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    for line in mobility(loaded, time=_at_moment(settings, Static(), time, ()).time).lines():
        click.echo(line)


@click.command()
@scene_options
@time_option
def assemble(
    scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...], time: float | None
) -> None:
    """Positions and velocities of SCENE that meet its joints and drivers, and what was changed of each body for it."""
    from ffr_dyn.analyses.settings import Assemble
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    perform(loaded, _at_moment(settings, Assemble(), time, keep), output or scene.with_suffix(".nc"))


@click.command()
@scene_options
def kinematic(scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...]) -> None:
    """Positions, velocities and accelerations of SCENE, whose drivers prescribe all motion; bodies undeformed."""
    from ffr_dyn.analyses.settings import Kinematic
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    perform(loaded, over_time(settings, Kinematic(), keep), output or scene.with_suffix(".nc"))


@click.command()
@scene_options
@click.option(
    "--quasi-static/--dynamic", default=None, help="Elastic coordinates follow without vibration; default: dynamic."
)
def inverse(
    scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...], quasi_static: bool | None
) -> None:
    """Forces that drive SCENE along its prescribed motion, and all reactions."""
    from ffr_dyn.analyses.settings import Inverse
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    given = settings.analysis if isinstance(settings.analysis, Inverse) else Inverse()
    analysis = given if quasi_static is None else Inverse(quasi_static)
    perform(loaded, over_time(settings, analysis, keep), output or scene.with_suffix(".nc"))


@click.command(epilog=_FORCES + _MIXED)
@scene_options
@click.option(
    "--unknown", "forces", multiple=True, metavar="FORCE", help="Force to find, instead of the scene's; repeat."
)
@click.option("--known", multiple=True, help="Driver that is a known motion, not a true driver; default: all.")
def mixed(
    scene: Path,
    output: Path | None,
    parameters: tuple[str, ...],
    keep: tuple[str, ...],
    forces: tuple[str, ...],
    known: tuple[str, ...],
) -> None:
    """Motion and unknown forces of SCENE, some motions of which are known.

    Forces away from the known motions are found by integration where that is stable, else as the bounded solution, which
    adds times before and after the run.
    """
    from ffr_dyn.analyses.settings import Mixed
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    analysis = settings.analysis if isinstance(settings.analysis, Mixed) else Mixed(())
    if forces:
        analysis = replace(analysis, unknown=tuple(force_of(text) for text in forces))
    if not analysis.unknown:
        raise InputError(
            'mixed dynamics needs forces to find: --unknown, or kind = "mixed" with [analysis.unknown.NAME]'
        )
    analysis = replace(analysis, known=known or analysis.known)
    perform(loaded, over_time(settings, analysis, keep), output or scene.with_suffix(".nc"))


@click.command()
@scene_options
@time_option
def static(
    scene: Path, output: Path | None, parameters: tuple[str, ...], keep: tuple[str, ...], time: float | None
) -> None:
    """Static equilibrium of SCENE, downhill from its start, with reactions and stability."""
    from ffr_dyn.analyses.settings import Static
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    perform(loaded, _at_moment(settings, Static(), time, keep), output or scene.with_suffix(".nc"))


@click.command(epilog=_FORCES + _LINEARISE)
@scene_argument
@output_option
@parameter_option
@time_option
@click.option("--at-equilibrium/--at-start", default=None, help="About the static equilibrium, or (default) the start.")
@click.option(
    "--input", "forces", multiple=True, metavar="FORCE", help="Input: a force, or the name of a load; repeat."
)
@click.option(
    "--quantity", "quantities", multiple=True, help="Output: a component, such as rod.tip.position.y; repeat."
)
def linearise(
    scene: Path,
    output: Path | None,
    parameters: tuple[str, ...],
    time: float | None,
    at_equilibrium: bool | None,
    forces: tuple[str, ...],
    quantities: tuple[str, ...],
) -> None:
    """Eigenvalues and state-space matrices of SCENE about its start or its equilibrium."""
    from ffr_dyn.analyses.settings import Linearise
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    given = settings.analysis if isinstance(settings.analysis, Linearise) else Linearise()
    analysis = Linearise(
        tuple(force_of(text) if "=" in text else text for text in forces) or given.inputs,
        quantities or given.quantities,
        given.at_equilibrium if at_equilibrium is None else at_equilibrium,
    )
    perform(loaded, _at_moment(settings, analysis, time, ()), output or scene.with_suffix(".nc"))


COMMANDS = (check, assemble, kinematic, static, inverse, mixed, linearise)


def _at_moment(
    settings: Settings | MomentSettings, analysis: OfMoment, time: float | None, keep: tuple[str, ...]
) -> MomentSettings:
    """The settings of a file with another analysis, at another time if one is given."""
    from ffr_dyn.analyses.settings import MomentSettings

    if time is not None and not math.isfinite(time):
        raise InputError(f"--time {time}: give a time in seconds")
    given = settings.time if isinstance(settings, MomentSettings) else 0.0
    return MomentSettings(time=given if time is None else time, outputs=keep or settings.outputs, analysis=analysis)


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
