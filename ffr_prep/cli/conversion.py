"""The sub-command `convert` of ffr-prep: other reference conditions for a body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from ffr_prep.cli.options import gone, reference_of
from ffr_prep.cli.request import OUTPUT
from ffr_prep.cli.terminal import filed, show
from ffr_prep.common.command import INPUT_FILE, reserve

_EXAMPLE = """\b
Example:
  ffr-prep convert rod.ffr --reference simply-supported:big_eye,small_eye -o rod_pinned.ffr
  ffr-prep convert rod.ffr --reference "fixed:nearest 0,0,0" -o rod_held.ffr
"""


@click.command("convert", epilog=_EXAMPLE)
@click.argument("body", type=INPUT_FILE)
@OUTPUT
@click.option(
    "--reference",
    required=True,
    metavar="CONDITIONS",
    help="As in reduce, on the interfaces of BODY, by name or place.",
)
@gone("--without-stiffening", "it is --linear now")
@click.option("--linear", is_flag=True, help="Leave out the load matrices, where they cannot come along.")
def convert(body: Path, output: Path, reference: str, linear: bool) -> None:
    """Attach the frame of BODY in another way, without its mesh: to an interface, between two, or to the mean axis.

    The motions that the body can make stay the same. What it has lost before is said, and not brought back.
    """
    from ffr_prep.body import load_body, save_body
    from ffr_prep.reduction.conversion import with_reference
    from ffr_prep.report.text import short_lines

    conditions = reference_of(reference)
    reserve("-o", output, usual=".ffr")
    loaded = load_body(body)
    converted = with_reference(replace(loaded, stiffening=None) if linear else loaded, conditions)
    save_body(converted, output)
    show(short_lines(converted))
    filed(output)
