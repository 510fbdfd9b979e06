"""The command `ffr-dyn economise`."""

from __future__ import annotations

from pathlib import Path

import click

from ffr_dyn.cli.run import over_time, parameter_option, require_after, scene_argument
from ffr_prep.common.command import OUTPUT_FILE, reserve
from ffr_prep.common.entries import assignments

EXAMPLE = """\b
Example:
  ffr-dyn economise machine.toml --tolerance 1e-3 --output tool.tip.position.x --output rod.stress=0.5% \\
          -o out/economised.toml --report out/economised.html
  ffr-dyn run out/economised.toml
"""


@click.command(epilog=EXAMPLE)
@scene_argument
@parameter_option
@click.option(
    "--output",
    "outputs",
    multiple=True,
    required=True,
    metavar="NAME[=TOLERANCE]",
    help="What matters: a component (rod.tip.position.y), a quantity, or BODY.stress; =0.1% of its range, =1e6 absolute.",
)
@click.option("--tolerance", type=float, default=1e-3, show_default=True, help="Share of the range of other outputs.")
@click.option("--end", type=float, help="End of the run [s], instead of the scene's.")
@click.option(
    "--verify/--no-verify", default=None, help="Run the full model with a finer step to check; default: if short."
)
@click.option("-o", "target", type=OUTPUT_FILE, help="Scene file to write; default: <scene>.economised.toml.")
@click.option("--report", type=OUTPUT_FILE, help="Report: .html (with chart), .md or .txt; default: .html.")
@click.option("--chart", type=OUTPUT_FILE, help="Picture of error over cost, .png or .svg.")
def economise(
    scene: Path,
    parameters: tuple[str, ...],
    outputs: tuple[str, ...],
    tolerance: float,
    end: float | None,
    verify: bool | None,
    target: Path | None,
    report: Path | None,
    chart: Path | None,
) -> None:
    """The cheapest model of SCENE that keeps the named outputs within their tolerances, as a scene file and a report.

    SCENE is the full model, with all that could matter: flexible bodies with many modes, geometric stiffening, all terms.
    What is not needed goes: bodies become rigid, modes, inertia terms and stiffening are left out, the computation is done in
    the plane, the step is as long as it may be. Every error is estimated and, where that is quick, verified.
    """
    from ffr_dyn.analyses.forward import Forward
    from ffr_dyn.economy.picture import draw
    from ffr_dyn.economy.report import as_text, write_report
    from ffr_dyn.economy.search import economise as search
    from ffr_dyn.scene_file.read import load_scene
    from ffr_dyn.scene_file.write import lost_parameters, save_changed

    loaded, given = load_scene(scene, assignments(parameters))
    analysis = given.analysis if isinstance(given.analysis, Forward) else Forward()
    settings = over_time(given, analysis, ())
    target = target or scene.with_suffix(".economised.toml")
    require_after("--end", end, settings.start)
    reserve("-o", target, usual=".toml")
    report = report or target.with_suffix(".html")
    reserve("--report", report, (".html", ".md", ".txt"))
    reserve("--chart", chart, (".png", ".svg"))
    found = search(
        loaded,
        outputs,
        start=settings.start,
        end=settings.end if end is None else end,
        output_step=settings.output_step,
        tolerance=tolerance,
        verify=verify,
        stabilisation=settings.stabilisation,
        events=analysis.events,
        begin=analysis.begin,
        tell=lambda stage: click.echo(f"... {stage}", err=True),
    )
    fixed = lost_parameters(scene, save_changed(found.scene, found.settings, target, scene, assignments(parameters)))
    write_report(found, report)
    if chart is not None:
        draw(found, chart)
    click.echo(as_text(found))
    if fixed:
        click.echo(
            f"note     {', '.join(fixed)}: not among the parameters of the scene, as what they change is another now"
        )
    click.echo(f"scene    {target}\nreport   {report}")
