"""The sub-commands `export` and `import` of ffr-prep: bodies to and from the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ffr_prep.cli.request import OUTPUT
from ffr_prep.cli.settings import EntriesCommand, NotesCommand, written
from ffr_prep.cli.terminal import filed, show
from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, reserve
from ffr_prep.interchange import formats
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS

_EXPORT = """\b
Formats:
{exchange format}

\b
Example:
  ffr-prep export rod.ffr -o rod.fem
  ffr-prep export rod.ffr -o rod.SID_FEM
"""
_IMPORT = """\b
Formats:
{exchange format}

\b
Example:
  ffr-prep import rod.SID_FEM -o rod.ffr
"""


@click.command("export", cls=EntriesCommand, registries=(formats.EXCHANGE_FORMATS,), epilog=_EXPORT)
@click.argument("body", type=INPUT_FILE)
@click.option(
    "-o", "--output", type=OUTPUT_FILE, required=True, help="File to write; its suffix is that of a format below."
)
@click.option("--surface", is_flag=True, help="Also write the points of the surface as nodes.")
def export_body(body: Path, output: Path, surface: bool, **settings: Any) -> None:
    """Write BODY in the format of another program, by the suffix of the file.

    The formats hold nodes, mode shapes, mass and stiffness; they do not hold the triangles of the surface, nor how the
    body was made. Units are SI.
    """
    from ffr_prep.body import load_body

    reserve("-o", output)
    formats.check_settings(output, written(formats.EXCHANGE_FORMATS))
    for lost in formats.export_body(load_body(body), output, surface, settings):
        click.echo(f"note        {lost}")
    filed(output)


@click.command("import", cls=NotesCommand, registries=(formats.EXCHANGE_FORMATS,), epilog=_IMPORT)
@click.argument("file", type=INPUT_FILE)
@click.option(
    "--units",
    type=click.Choice([*UNIT_SYSTEMS]),
    default="m-kg-s",
    show_default=True,
    help="Of the numbers in FILE: length, mass, time.",
)
@click.option(
    "--held",
    is_flag=True,
    help="For a file whose modes take up more than its mass: raise it; the body is to be held fixed.",
)
@OUTPUT
def import_body(file: Path, units: str, held: bool, output: Path) -> None:
    """Read FILE, of another program, and write it as a body file.

    Every node becomes an interface. What could not be taken over is said; nothing is left out silently. Where the file has
    no inertia for a motion, that is said too, here and before a run.
    """
    from ffr_prep.body import save_body, units_doubts
    from ffr_prep.interchange.bare_inertia import held as held_fixed
    from ffr_prep.report.text import short_lines

    reserve("-o", output, usual=".ffr")
    body = formats.import_body(file, units=units)
    body = held_fixed(body) if held else body
    save_body(body, output)
    show(short_lines(body))
    for note in [*body.provenance["notes"], *units_doubts(body)]:
        click.echo(f"note        {note}")
    filed(output)
