"""The options of ffr-prep that ask for a body, each declared once, and the way from a model to the body's file.

Heavy modules are imported where they are needed, so that help is immediate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli.options import bundle, interface_of, reference_of
from ffr_prep.cli.reduction import band_of, damping_of, damping_options, draw_quality, reduction_of, reduction_options
from ffr_prep.cli.terminal import Steps, filed, show
from ffr_prep.common.command import OUTPUT_FILE
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_prep.body import FlexibleBody
    from ffr_prep.model.coupled import InterfaceRegion
    from ffr_prep.model.model import Model
    from ffr_prep.pipelines.reduce import Request
    from ffr_prep.solvers.factor import Solver

OUTPUT = click.option("-o", "--output", type=OUTPUT_FILE, required=True, help="Body file to write.")
SOLVER = bundle(
    click.option(
        "--solver",
        type=click.Choice(["cholesky", "superlu", "pardiso", "slepc"]),
        default="cholesky",
        show_default=True,
        help="What factorises and finds modes; slepc shares millions of unknowns among machines.",
    ),
    click.option("--ranks", type=int, default=1, show_default=True, help="MPI processes of the solver slepc."),
    click.option(
        "--verify-modes",
        is_flag=True,
        help="Also find the residual of every normal mode and count, by a second factorisation, that none is missing.",
    ),
)
WORDS = "ffr_prep.words"  # of the command that runs, in its context
PARTS = (
    "Also cut the body into N parts along its long axis, or at distances X1,X2,... [m] from its end: for large "
    "deflections; a scene then moves the parts."
)


def _parts(_: click.Context, option: click.Parameter, text: str | None) -> int | list[float] | None:
    try:
        return None if text is None else int(text) if text.isdigit() else [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError(f"--parts {text}: write a number of parts, or distances [m] such as 0.1,0.25") from None


CUTS = click.option("--parts", callback=_parts, metavar="N or X1,X2,...", help=PARTS)
REQUEST = bundle(
    OUTPUT,
    click.option("--name", help="Name of the body; default: the name of the file."),
    click.option("--interface", "interfaces", multiple=True, metavar="INTERFACE", help="See below; may be repeated."),
    click.option("--reference", default="mean-axis", show_default=True, metavar="CONDITIONS", help="See below."),
    reduction_options,
    damping_options,
    CUTS,
    SOLVER,
)


def retold() -> list[str]:
    """The words of the command that runs, but for the file that it writes and for parts, which may be other ones then."""
    context = click.get_current_context(silent=True)
    words, kept = iter([] if context is None else context.meta.get(WORDS, [])), []
    for word in words:
        if word in ("-o", "--output", "--parts"):
            next(words, None)
        elif not word.startswith(("-o", "--output=", "--parts=")):
            kept.append(word)
    return kept


def solver_of(options: Mapping[str, Any]) -> Solver:
    """The solver of the options SOLVER; InputError for ranks that cannot be."""
    from ffr_prep.solvers.factor import Solver

    return Solver(options["solver"], options["ranks"], options["verify_modes"])


def request_of(options: Mapping[str, Any]) -> tuple[Sequence[InterfaceRegion], Request]:
    """The interfaces and the request of the options REQUEST, and of --linear, --drawn-modes and --stress where a command has
    them; InputError for options that cannot be used.
    """
    from ffr_prep.pipelines.reduce import Request

    return [interface_of(text) for text in options["interfaces"]], Request(
        name=options["name"] or options["output"].stem,
        reference=reference_of(options["reference"]),
        reduction=reduction_of(options),
        quality=band_of(options),
        parts=options["parts"],
        damping=damping_of(options),
        solver=solver_of(options),
        linear=options.get("linear", False),
        drawn_modes=options.get("drawn_modes"),
        stress=options.get("stress", False),
    )


def reduce_to_file(
    model: Callable[[], Model],
    request: Request,
    output: Path,
    steps: Steps,
    pictures: Path | None = None,
    regions: Callable[[FlexibleBody], Mapping[str, list[int]]] | None = None,
) -> None:
    """Make the model, reduce it, write the body file, and say what is in it and what it took.

    pictures : folder for those of the quality report
    regions  : triangles of the surface by name, for pressures
    """
    from ffr_prep.body import save_body
    from ffr_prep.pipelines.reduce import reduce
    from ffr_prep.report.text import short_lines

    request = replace(request, provenance={**request.provenance, "command": retold()})
    body = reduce(model(), request, progress=steps, advance=steps.advance)
    if regions is not None:
        body = replace(body, provenance={**body.provenance, "regions": regions(body)})
    steps("write the body file")
    save_body(body, output)
    steps.end()
    show(short_lines(body))
    draw_quality(body, pictures)
    show(steps.lines())
    filed(output)
