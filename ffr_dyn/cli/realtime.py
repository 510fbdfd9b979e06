"""The command `ffr-dyn realtime`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from ffr_dyn.cli.run import parameter_option, scene_argument
from ffr_prep.common.command import OUTPUT_FILE, reserve
from ffr_prep.common.entries import assignments
from ffr_prep.common.errors import InputError

EXAMPLE = """\b
Example:
  ffr-dyn realtime slider_crank.toml --step 1e-3 --duration 60 --plot out/steps.png
"""


@click.command(epilog=EXAMPLE)
@scene_argument
@parameter_option
@click.option("--step", type=float, help="Time step [s]; default: the scene's.")
@click.option("--duration", type=float, default=60.0, show_default=True, help="Simulated time [s] to step through.")
@click.option("--deadline", type=float, help="Longest time [s] that a step may take; default: the step.")
@click.option("--method", help="Integrator, instead of the scene's: ros2, rk4, ...")
@click.option("--output", "outputs", multiple=True, metavar="NAME", help="Quantity to read at each step; repeat.")
@click.option("--paced", is_flag=True, help="Start each step when the clock says so, instead of one after the other.")
@click.option("--plot", type=OUTPUT_FILE, help="Picture of the times, .png or .svg.")
@click.option("--json", "as_data", is_flag=True, help="Print numbers for programs instead.")
def realtime(
    scene: Path,
    parameters: tuple[str, ...],
    step: float | None,
    duration: float,
    deadline: float | None,
    method: str | None,
    outputs: tuple[str, ...],
    paced: bool,
    plot: Path | None,
    as_data: bool,
) -> None:
    """How long the steps of SCENE take, each with its inputs and outputs, and whether real time holds.

    Soft real time holds when 99.9 % of the steps are done before the deadline, hard real time when all are that were
    measured. That is a measurement, not a proof: what else runs on the machine counts. Every step has a bounded cost, so
    a processor of its own and a real-time kernel bring the worst step near the mean.

    --paced takes as long as the simulated time, and finds the caches as another program leaves them.
    """
    from ffr_dyn.analyses.settings import Settings
    from ffr_dyn.cli.progress_bar import progress
    from ffr_dyn.integrators import METHODS, ROS2, Within, stepped
    from ffr_dyn.integrators.stabilisation import Projection
    from ffr_dyn.realtime.deadline import as_json, lines, measure_steps, plot_times
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    given: Any = ROS2(1e-3)
    if isinstance(settings, Settings):
        own = settings.method
        given = stepped(own, settings.output_step / 10) if isinstance(own, Within) else given if own.controlled else own
    if method is not None and method not in METHODS:
        raise InputError(f"--method {method}: there is no such method with fixed steps; there are {', '.join(METHODS)}")
    kind: Any = type(given) if method is None else METHODS[method]
    reserve("--plot", plot, (".png", ".svg", ".pdf"))
    with progress(loaded.name, duration) as update:
        timing = measure_steps(
            loaded,
            kind(given.step if step is None else step),
            duration=duration,
            deadline=deadline,
            outputs=outputs or ("*.position",),
            stabilisation=settings.stabilisation if isinstance(settings, Settings) else Projection(),
            paced=paced,
            progress=update,
        )
    if plot is not None:
        plot_times(timing, plot)
    if as_data:
        click.echo(json.dumps(as_json(timing), indent=2))
        return
    for line in lines(timing) + ([] if plot is None else [f"picture      {plot}"]):
        click.echo(line)
