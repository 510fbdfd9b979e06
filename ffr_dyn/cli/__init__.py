"""The command `ffr-dyn`. Heavy modules are imported inside the commands, so that help is immediate."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import click

from ffr_dyn.cli.analyses import check, commands, list_methods
from ffr_dyn.cli.chart import chart
from ffr_dyn.cli.economy import economise
from ffr_dyn.cli.export import export
from ffr_dyn.cli.parts import parts
from ffr_dyn.cli.realtime import realtime
from ffr_dyn.cli.run import run
from ffr_dyn.cli.show import show
from ffr_dyn.cli.stress import stress
from ffr_dyn.cli.sweep import sweep
from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, reserve, run_command
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import load_plugin
from ffr_prep.common.units import pretty

EXAMPLE = """\b
Example:
  ffr-prep reduce rod.geo --unit mm --material steel --interface big_eye --interface small_eye \\
           --reference simply-supported:big_eye,small_eye -o rod.ffr
  ffr-dyn show slider_crank.toml -o out/scene.html
  ffr-dyn run slider_crank.toml -o out/result.nc
  ffr-dyn plot out/result.nc rod.small_eye.position.x -o out/slider.png
  ffr-dyn animate out/result.nc -o out/motion.gif --scale auto
  ffr-dyn stress out/result.nc -o out/stress

\b
A small scene, swing.toml; `ffr-dyn schema` has every entry:
  gravity = [0, -9.81, 0]
  [analysis]
  end = 0.5                                # [s]
  output_step = 0.005
  [ground]
  wall = [0, 0, 0]
  [bodies.rod]
  file = "rod.ffr"
  [joints.hinge]
  kind = "revolute"
  i = "ground.wall"
  j = "rod.big_eye"
  axis = [0, 0, 1]
"""

PLOT_EXAMPLE = """\b
Example:
  ffr-dyn plot out/result.nc rod.tip.position hinge.force.y -o out/tip.png
  ffr-dyn plot out/result.nc rod.tip --path xy -o out/path.png
"""
FILM_EXAMPLE = """\b
Example:
  ffr-dyn animate out/result.nc -o out/motion.gif --scale 50
  ffr-dyn animate out/result.nc -o out/stress.html --colour von-mises --limit 60e6 --plot crank_pin.force
"""


REGISTERED = "ffr_dyn.commands"
CONTEXT: Any = {"help_option_names": ["-h", "--help"], "max_content_width": 110}


class Commands(click.Group):
    """The commands of this package, those of the analyses, and others from the entry points "ffr_dyn.commands"."""

    def list_commands(self, context: click.Context) -> list[str]:
        return sorted({*super().list_commands(context), *commands(), *entry_points(group=REGISTERED).names})

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        own = super().get_command(context, name) or commands().get(name)
        return own or next((point.load() for point in entry_points(group=REGISTERED, name=name)), None)


def _load_plugins(context: click.Context, option: click.Parameter, paths: tuple[Path, ...]) -> None:
    """Before the command is looked for, which may be one of theirs."""
    for path in paths:
        load_plugin(path)


@click.group(cls=Commands, epilog=EXAMPLE, invoke_without_command=True, context_settings=CONTEXT)
@click.version_option(package_name="ffr")
@click.option(
    "--plugin",
    type=INPUT_FILE,
    multiple=True,
    metavar="FILE.py",
    is_eager=True,
    expose_value=False,
    callback=_load_plugins,
    help="Run this Python first: it may register analyses, integrators, forces and joints; may be repeated.",
)
@click.pass_context
def cli(context: click.Context) -> None:
    """Flexible multibody dynamics in the floating frame of reference: from reduced bodies to a moving machine.

    A scene file (TOML) names the bodies (files from ffr-prep, or rigid ones), their joints, drivers and loads, and the
    analysis. `run` does it and writes one result file; `info`, `plot` and `animate` show what is in it.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@cli.command()
def schema() -> None:
    """The JSON schema of scene files, for editors and programs that write them."""
    import json

    from ffr_dyn.scene_file.schema import schema as made

    click.echo(json.dumps(made(), indent=2))


@cli.command()
@click.argument("result", type=INPUT_FILE)
def info(result: Path) -> None:
    """Describe RESULT: how it was made, notes, and every quantity with its unit."""
    from ffr_dyn.results.file import load_result

    loaded = load_result(result)
    units = {name: f" {pretty(quantity.unit)}".rstrip() for name, quantity in loaded.quantities.items()}
    for key, value in sorted(loaded.attributes.items()):
        for line in _errors(value, units) if key == "errors" else _attribute(key, value):
            click.echo(f"{key:20} {line}")
    span = f", from {loaded.time[0]:g} to {loaded.time[-1]:g} s" if loaded.time.size else ""
    click.echo(f"{'rows':20} {loaded.time.size}{span}\n")
    for name, quantity in loaded.quantities.items():
        axes = "".join(f".{{{','.join(axis.labels)}}}" for axis in quantity.axes)
        click.echo(f"{name + axes:45} [{quantity.unit}] {quantity.description}")


@cli.command(epilog=PLOT_EXAMPLE)
@click.argument("result", type=INPUT_FILE)
@click.argument("names", nargs=-1, required=True)
@click.option("-o", "--output", type=OUTPUT_FILE, required=True, help="Picture, .png or .svg.")
@click.option("--title", help="Title of the picture.")
@click.option("--path", "plane", metavar="PLANE", help="Draw the path of one marker, such as rod.tip, in xy, zx, ...")
def plot(result: Path, names: tuple[str, ...], output: Path, title: str | None, plane: str | None) -> None:
    """Draw the histories NAMES of RESULT, a panel per unit. `ffr-dyn info` lists the names.

    With --path xy the path of a marker in that plane instead, coloured by time.
    """
    from ffr_dyn.pictures import histories as plots
    from ffr_dyn.results.file import load_result

    reserve("-o", output)
    if plane is None:
        plots.plot(load_result(result), names, output, title=title)
    elif len(names) == 1:
        plots.plot_path(load_result(result), names[0].removesuffix(".position"), output, plane=plane, title=title)
    else:
        raise InputError(f"--path {plane}: give one marker, not {len(names)} names")
    click.echo(f"picture  {output}")


@cli.command(epilog=FILM_EXAMPLE)
@click.argument("result", type=INPUT_FILE)
@click.option("-o", "--output", type=OUTPUT_FILE, required=True, help=".gif, .mp4 or .html.")
@click.option("--scale", default="auto", help="Factor on the deformation: a number, or auto.", show_default=True)
@click.option("--duration", type=float, help="Length of the film [s]; default: chosen from the run.")
@click.option(
    "--colour", default="deformation", show_default=True, help="Of flexible bodies: deformation, body, von-mises, ..."
)
@click.option("--limit", type=float, help="End of the colour bar [m, Pa]; default: the largest value of the film.")
@click.option("--plot", "plots", multiple=True, metavar="NAME", help="Of .html: a history beside the motion; repeat.")
@click.option("--trace", "traces", multiple=True, metavar="MARKER", help="Draw the path of a marker; repeat.")
@click.option(
    "--arrow", "arrows", multiple=True, metavar="NAME",
    help="Draw the forces and moments of a joint, force or motor; '*' of all; repeat.",
)  # fmt: skip
def animate(
    result: Path,
    output: Path,
    scale: str,
    duration: float | None,
    colour: str,
    limit: float | None,
    plots: tuple[str, ...],
    traces: tuple[str, ...],
    arrows: tuple[str, ...],
) -> None:
    """A film of RESULT: deformed bodies, coloured by elastic displacement or stress, with the undeformed ghost.

    Colours by stress need bodies with stress modes (`ffr-prep reduce --stress`); `ffr-dyn stress --help` lists the
    quantities.

    .html is one page that works offline: the bodies can be turned with the mouse, joints and forces switched on,
    histories plotted beside the motion.
    """
    from ffr_dyn.pictures import animate as animation
    from ffr_dyn.results.file import load_result

    reserve("-o", output)
    factor: float | str = scale if scale == "auto" else _number(scale)
    loaded = load_result(result)
    how: dict[str, Any] = {"scale": factor, "duration": duration, "colour": colour, "limit": limit}
    animation.animate(loaded, output, plots=plots, traces=traces, arrows=arrows, **how)
    click.echo(f"film     {output}")


for command in (run, check, show, export, list_methods, stress, chart, economise, parts, realtime, sweep):
    cli.add_command(command)


def _errors(told: dict[str, list[float]], units: dict[str, str]) -> list[str]:
    """Of each output the largest error in its unit, and as a share of the output's range."""
    return [
        f"{name}: {error:.3g}{units.get(name, '')}, {share:.3g} of its range" for name, (error, share) in told.items()
    ]


def _attribute(key: str, value: Any) -> list[str]:
    """An attribute in lines: numbers with their units on one, texts and what is named a line each."""
    if key == "left_out_stress":
        return [f"{', '.join(value)}: per unit acceleration, which `ffr-dyn stress` makes an error of"]
    if key == "connections":
        return [f"{name} ({of['kind']}): {', '.join(of['at']) or 'everywhere'}" for name, of in value.items()]
    if key == "events":
        return _events(value)
    if key == "largest_drift":
        return [f"{value[0]:.3g} of positions, {value[1]:.3g} of rates"]
    if isinstance(value, dict):
        return [f"{name}: {', '.join(map(_short, of if isinstance(of, list) else [of]))}" for name, of in value.items()]
    if isinstance(value, list) and not (value and all(isinstance(one, float) for one in value)):
        return [str(line) for line in value]
    listed = value if isinstance(value, list) else [value]
    numbers = ", ".join(f"{one:.10g}" if isinstance(one, float) else str(one) for one in listed)
    return [f"{numbers}{' s' if key in ('start', 'end', 'output_step') else ''}"]


def _events(found: list[dict[str, Any]]) -> list[str]:
    from ffr_dyn.analyses.registry import moment_in_words

    return [f"{moment_in_words(of)}, {'rising' if of['rising'] else 'falling'}: {of['quantity']}" for of in found]


def _short(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--scale must be a number or auto, not {text!r}") from None


def main() -> None:
    """Entry point: exit code 2 for bad input, 1 for a failed computation or a signal, no traceback for either."""
    run_command(cli, "ffr-dyn")
