"""The command `ffr-dyn sweep`."""

from __future__ import annotations

from pathlib import Path

import click

from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, check_ending

MOST_NOTES = 5  # that are printed; the table has those of every run
NOTES = """\b
A study file:
  scene = "crank.toml"
  samples = 200                               # of the distributions; sampling = "latin-hypercube" or "sobol"
  [parameters]                                # of the scene's [parameters], of its entries, or of the lines below
  load = [10, 50, 100]                        # several lists make a grid; points = "list" takes them side by side
  speed = {from = 50, to = 150, count = 11}
  diameter = {normal = [6e-3, 1e-4]}          # uniform, triangular, lognormal, any distribution of scipy.stats
  "bodies.slider.mass" = [0.3, 0.4]           # an entry by its path; "gravity.2" is the second number of a list
  [bodies.rod]                                # made anew by ffr-prep, once for every distinct line
  make = "reduce rod.geo --set diameter=${diameter} --material steel --interface a --interface b --modes 8"
  [outputs]
  force = "pin.force: largest"                # last first least greatest largest mean rms range error history
  first = "critical.1.speed: attribute"       # what else an analysis tells, here campbell
  share = "= force / load"                    # a formula of outputs and parameters

\b
Examples:
  ffr-dyn sweep study.toml -o out/study.nc --plots out/study
  ffr-dyn sweep study.toml -o out/study.nc --cluster tcp://host:8786
"""


@click.command(epilog=NOTES)
@click.argument("study", type=INPUT_FILE)
@click.option("-o", "--output", type=OUTPUT_FILE, help="Table to write (netCDF); default: <study>.nc.")
@click.option("--plots", type=click.Path(path_type=Path, file_okay=False), help="Folder for pictures of the outputs.")
@click.option("--cache", type=click.Path(path_type=Path, file_okay=False),
              help="Folder of the bodies that are made; default: <output>.bodies. Studies may share one.")  # fmt: skip
@click.option(
    "--workers", type=click.IntRange(0), help="Local processes; default one for every processor, 0: none, here."
)
@click.option("--cluster", metavar="ADDRESS", help="Scheduler of a Dask cluster that does the runs instead.")
def sweep(
    study: Path, output: Path | None, plots: Path | None, cache: Path | None, workers: int | None, cluster: str | None
) -> None:
    """Run a scene over many values of its parameters, and of the parameters that its bodies are made with.

    Every run is a row of the table: parameters, outputs, and why it failed, if it did. Rows are kept as runs end; the same
    command goes on with a study that was stopped or killed. The table opens in xarray, with the parameters as coordinates.
    """
    from ffr_dyn.cli.progress_bar import counted
    from ffr_dyn.studies.draw import plot_study
    from ffr_dyn.studies.plan import load_study
    from ffr_dyn.studies.sweep import sweep as run_all
    from ffr_dyn.studies.table import noted

    made, output = load_study(study), output or study.with_suffix(".nc")
    check_ending("-o", output, ".nc")
    with counted("bodies") as bodies, counted("runs") as runs:
        table = run_all(made, output, cache=cache, workers=workers, cluster=cluster, progress=runs, making=bodies)
    click.echo(repr(table))
    for number in table.failed[:3]:
        click.echo(f"failed       run {number}: {table.messages[number]}")
    for count, note in noted(table)[:MOST_NOTES]:
        click.echo(f"note         of {count} runs: {note}")
    click.echo(f"table        {output}")
    for picture in plot_study(table, plots) if plots is not None else ():
        click.echo(f"picture      {picture}")
