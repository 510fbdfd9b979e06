"""The command `ffr-dyn stress`."""

from __future__ import annotations

from pathlib import Path

import click

from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import check_folder

_NOTES = """\b
Quantities:
  von-mises, tresca                                      magnitudes of the stress
  signed-max-principal, max-principal, min-principal     tension is positive
  xx, yy, zz, xy, xz, yz                                 components in the axes of the body
  strain-max-principal, strain-xx, ...                   the same of the strain, but for the sizes

\b
Example:
  ffr-dyn stress out/result.nc --body rod --point 0.12,0.008,0 --from 0.03 -o out/stress
"""


@click.command(epilog=_NOTES)
@click.argument("result", type=INPUT_FILE)
@click.option("-o", "--output", type=OUTPUT_FILE, required=True, help="Folder for tables and pictures.")
@click.option("--body", help="Look at this body only.")
@click.option("--point", "points", multiple=True, metavar="X,Y,Z", help="History at this place [m] in the body frame.")
@click.option("--quantity", default="von-mises", show_default=True, help="See below.")
@click.option("--count", default=5, show_default=True, help="Hot spots to look for.")
@click.option("--from", "since", type=float, help="Leave out what was before this time [s].")
def stress(
    result: Path,
    output: Path,
    body: str | None,
    points: tuple[str, ...],
    quantity: str,
    count: int,
    since: float | None,
) -> None:
    """Where and when the bodies of RESULT are stressed most, with tables, histories and a coloured picture.

    Bodies need stress modes (`ffr-prep reduce --stress`). Places are in the frame of the undeformed body; a history is
    taken at the nearest point of the surface. Of beams, the largest section forces are listed too.
    """
    from ffr_dyn.pictures.stress_report import report_lines, stress_report
    from ffr_dyn.results.file import load_result

    check_folder("-o", output)
    places = [_place(text) for text in points]
    loaded = load_result(result)
    report = stress_report(loaded, output, body=body, quantity=quantity, points=places, count=count, since=since)
    for line in report_lines(report):
        click.echo(line)


def _place(text: str) -> tuple[float, ...]:
    try:
        place = tuple(float(part) for part in text.split(","))
    except ValueError:
        place = ()
    if len(place) != 3:
        raise InputError(f"--point {text}: write three numbers x,y,z in metres")
    return place
