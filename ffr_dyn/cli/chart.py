"""The command `ffr-dyn chart`."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_dyn.cli.run import parameter_option, require_after, scene_argument
from ffr_prep.common.command import OUTPUT_FILE, FiniteRange, reserve
from ffr_prep.common.entries import assignments
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.chart.diagram import Diagram
    from ffr_dyn.chart.variants import Model
    from ffr_dyn.scene.scene import Scene

SUFFIXES = (".csv", ".png", ".svg", ".html")
_NOTES = """\b
Examples:
  ffr-dyn chart crank.toml -m deflection:rod -m reaction:crankpin --modes 2,4,8,all --drop I5,I9 -o out/chart
  ffr-dyn chart crank.toml --method ros3=1e-3,5e-4,1e-4 --method rk4 --cluster tcp://host:8786

\b
Measures:
  position:rod.tip                 where a marker is
  deflection:rod                   elastic displacement all over a body, root mean square
  deflection:rod.tip               of an interface from the body's frame
  deflection:rod.mid/left,right    of a point from the chord between two interfaces
  reaction:hinge, moment:hinge     what a joint carries
  stress:rod@0.3,0,0.01            von Mises stress at a place of the body (ffr-prep reduce --stress)
  energy, constraint               total energy; violation of the constraints
  rod.tip.velocity.x               any quantity of the scene (ffr-dyn info RESULT lists them)

\b
Terms that --drop leaves out:
  I3, I4        coupling of the modes with translation and rotation of the body; only both together
  I5            coupling of the modes among themselves by rotation: Coriolis forces
  I8, I9        change of inertia and centrifugal force, linear and quadratic in the deformation
  stiffening    displacements of second order: geometric stiffening and foreshortening
"""


@click.command(epilog=_NOTES)
@scene_argument
@click.option("-o", "--output", type=OUTPUT_FILE, help="Name of the files without suffix; default: <scene>.chart")
@click.option("-m", "--measure", "measures", multiple=True, metavar="WHAT", help="What is compared; see below.")
@click.option("--method", "methods", multiple=True, metavar="NAME[=NUMBER,...]",
              help="A method, with its steps [s] or tolerances, or those that are chosen for it. Default: all.")  # fmt: skip
@click.option("--modes", metavar="N,...|all", help="Elastic modes to keep of every flexible body: 2,4,8,all.")
@click.option("--drop", "drops", multiple=True, metavar="TERM,...", help="Also run without these inertia terms.")
@click.option("--body", "bodies", multiple=True, metavar="BODY=FILE,...",
              help="Body files, from finer meshes say, that are tried for a body beside its own.")  # fmt: skip
@click.option("--against", type=click.Choice(["cpu", "wall", "evaluations"]), default="cpu", show_default=True,
              help="Cost on the axis of the picture; the page and the table have all.")  # fmt: skip
@click.option("--end", type=float, help="End of the run [s], instead of the scene's.")
@click.option(
    "--repeats", default=5, show_default=True, type=click.IntRange(1), help="How often a run is timed, at least."
)
@click.option("--limit", default=60.0, show_default=True, type=FiniteRange(0.0, min_open=True),
              help="Wall time [s] that one run may take.")  # fmt: skip
@click.option("--wanted", default=1e-6, show_default=True, type=FiniteRange(0.0, 1.0, min_open=True),
              help="Relative error of the reference at which its refinement ends: a tenth of what you look for.")  # fmt: skip
@click.option("--workers", type=click.IntRange(0), help="Local processes; default half the processors, 0: none, here.")
@click.option("--cluster", metavar="ADDRESS", help="Scheduler of a Dask cluster that runs the variants instead.")
@parameter_option
def chart(
    scene: Path,
    output: Path | None,
    measures: tuple[str, ...],
    methods: tuple[str, ...],
    modes: str | None,
    drops: tuple[str, ...],
    bodies: tuple[str, ...],
    against: str,
    end: float | None,
    repeats: int,
    limit: float,
    wanted: float,
    workers: int | None,
    cluster: str | None,
    parameters: tuple[str, ...],
) -> None:
    """Speed against accuracy of SCENE: a work-precision diagram over methods, steps and models.

    Runs every method with falling steps on every model (modes kept x terms dropped x body files) and measures its errors
    against a reference that is computed first: a method of high order refined until nothing changes, and another one that
    verifies it; how far both are apart is drawn as a band. Writes <output>.png, .svg, .html (interactive, works offline) and
    .csv. A variant that fails is listed with its reason. Variants that no other beats, the Pareto front, are ringed.

    Measures, methods, modes and terms may stand in the scene file, in [chart]; options go before them.

    Times are those of the integrator alone on one thread, medians of several runs with bars for the spread. On a busy
    machine trust CPU time.
    """
    from ffr_dyn.analyses.forward import Forward
    from ffr_dyn.analyses.settings import Settings
    from ffr_dyn.chart.diagram import measures_of, work_precision
    from ffr_dyn.chart.runner import Span, pool
    from ffr_dyn.cli.progress_bar import counted
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    if not isinstance(settings, Settings) or not isinstance(settings.analysis, Forward):
        raise InputError("a chart compares runs of forward dynamics; the scene file asks for another analysis")
    require_after("--end", end, settings.start)
    output = output or scene.with_suffix(".chart")
    for suffix in SUFFIXES:
        reserve("-o", output.with_name(output.name + suffix))
    span = Span(settings.end if end is None else end, settings.output_step, settings.start, settings.analysis.begin)
    asked = settings.chart
    compared = _methods(methods) if methods else {name: numbers or None for name, numbers in asked.methods} or None
    numbers = asked.modes if modes is None else _numbers(modes)
    left_out = tuple(tuple(text.split(",")) for text in drops) or asked.drops
    models = _models(loaded, numbers, left_out, bodies)
    chosen = measures_of(loaded, measures or asked.measures, span.start)
    with pool(workers, cluster) as where, counted(loaded.name) as update:
        found = work_precision(
            loaded, span, where, measures=chosen, methods=compared, models=models, stabilisation=settings.stabilisation,
            events=settings.analysis.events, repeats=repeats, limit=limit, wanted=wanted,
            tell=lambda line: click.echo(f"reference    {line}"), progress=update,
        )  # fmt: skip
    for line in _report(found, against):
        click.echo(line)
    for path in _write(found, output, against):
        click.echo(f"written      {path}")


def _methods(given: Sequence[str]) -> Mapping[str, Sequence[float] | None]:
    """Numbers by method, None where they are to be chosen."""
    from ffr_dyn.chart.variants import maker

    found: dict[str, Sequence[float] | None] = {}
    for text in given:
        name, _, numbers = text.partition("=")
        maker(name)
        _check_once("--method", name, found)
        found[name] = _listed(numbers, float, f"--method {text}", "NAME=NUMBER,...") if numbers else None
        if any(not number > 0 for number in found[name] or ()):
            raise InputError(f"--method {text}: steps and tolerances must be positive")
    return found


def _check_once(option: str, name: str, found: Container[str]) -> None:
    if name in found:
        raise InputError(
            f"{option} {name} is given twice, and one would be lost; write all in one, as {option} {name}=ONE,OTHER"
        )


def _told_apart(files: Sequence[str]) -> dict[str, str]:
    """The label of each file: its name, with the folder where others have the same name."""
    stems = [Path(file).stem for file in dict.fromkeys(files)]
    return {
        file: stem if stems.count(stem) == 1 else file for file, stem in zip(dict.fromkeys(files), stems, strict=True)
    }


def _listed(text: str, of: Callable[[str], Any], what: str, form: str) -> list[Any]:
    try:
        return [of(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{what}: write it as {form}") from None


def _numbers(modes: str) -> list[int | None]:
    return _listed(modes, lambda part: None if part == "all" else int(part), f"--modes {modes}", "2,4,8,all")


def _models(
    scene: Scene, numbers: Sequence[int | None], drops: Sequence[Sequence[str]], bodies: Sequence[str]
) -> tuple[Model, ...]:
    from ffr_dyn.chart.variants import models_of
    from ffr_prep.body import load_body

    own, files = {body.name: body.model for body in scene.bodies}, dict[str, list[str]]()
    for text in bodies:
        name, _, given = text.partition("=")
        if name not in own or not given:
            raise InputError(f"--body {text}: write BODY=FILE,... with one of the bodies {', '.join(own)}")
        _check_once("--body", name, files)
        files[name] = given.split(",")
    meshes = {
        name: [
            (f"{name} of the scene", own[name]),
            *((f"{name} of {label}", load_body(file)) for file, label in _told_apart(given).items()),
        ]
        for name, given in files.items()
    }
    return models_of(scene, numbers, [(), *drops], meshes)


def _report(found: Diagram, against: str) -> list[str]:
    """The Pareto front of every measure, and what failed."""
    from ffr_dyn.chart.orders import orders

    lines = []
    for measure in found.measures:
        lines.append(f"\n{measure.words}: the front, cheapest first")
        for point in found.front(measure.name, against):
            error = point.errors[measure.name]
            relative = (
                f"  {error / found.scale(measure.name):8.1e} relative" if found.reference.scales[measure.name] else ""
            )
            cost = (
                f"{point.evaluations:9d} evaluations" if against == "evaluations" else f"{point.cost(against):10.3e} s"
            )
            lines.append(f"  {cost}  error {error:8.1e} {measure.unit}{relative}  {point.label}")
        lines += _order_lines(orders(found, measure.name))
    lines += [f"failed       {lost.label}: {lost.reason}" for lost in found.lost]
    return [*lines, ""]


def _order_lines(found: Mapping[tuple[str, str], float]) -> list[str]:
    """The orders of all methods, a line for every model."""
    from ffr_dyn.chart.orders import order_words

    models = dict.fromkeys(model for _, model in found)
    words = {
        of: ", ".join(f"{method} {order_words(found[method, of])}" for method, model in found if model == of)
        for of in models
    }
    return [f"  order at the finest steps, {of}: {said}" for of, said in words.items()]


def _write(found: Diagram, output: Path, against: str) -> list[Path]:
    """Page, table and pictures; the table also where there is nothing to draw."""
    from ffr_dyn.chart.draw import draw_chart
    from ffr_dyn.chart.page import write_page
    from ffr_dyn.chart.table import write_table

    def named(suffix: str) -> Path:
        return output.with_name(output.name + suffix)

    table, *pictures, page = map(named, SUFFIXES)
    written = write_table(found, table)
    return [*(draw_chart(found, picture, against=against) for picture in pictures), write_page(found, page), written]
