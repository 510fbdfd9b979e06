"""The sub-commands `export` and `import` of ffr-prep: bodies to and from the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from ffr_prep.cli.options import PATH
from ffr_prep.cli.request import OUTPUT
from ffr_prep.cli.terminal import filed, show
from ffr_prep.common.errors import InputError

_SUFFIXES = {".sid_fem": "SID", ".sid": "SID", ".fem": "MBDyn"}


_EXPORT = """\b
Example:
  ffr-prep export rod.ffr --kind full -o rod.fem
  ffr-prep export rod.ffr -o rod.SID_FEM
"""
_IMPORT = """\b
Example:
  ffr-prep import rod.SID_FEM -o rod.ffr
"""


@click.command("export", epilog=_EXPORT)
@click.argument("body", type=PATH)
@click.option("-o", "--output", type=PATH, required=True, help="File to write: .SID_FEM, or .fem for MBDyn.")
@click.option("--surface", is_flag=True, help="Also write the points of the surface as nodes.")
@click.option(
    "--layout",
    type=click.Choice(["mode-major", "axis-major"]),
    default="mode-major",
    show_default=True,
    help="Of the matrices Gr and Ge in a SID file; programs differ.",
)
@click.option(
    "--kind",
    type=click.Choice(["legacy", "full"]),
    default="legacy",
    show_default=True,
    help="Of a .fem file: lumped masses, or the inertia integrals, which a recent MBDyn reads.",
)
def export_body(
    body: Path,
    output: Path,
    surface: bool,
    layout: Literal["mode-major", "axis-major"],
    kind: Literal["legacy", "full"],
) -> None:
    """Write BODY in the format of another program, by the suffix of the file.

    The formats hold nodes, mode shapes, mass and stiffness; they do not hold the triangles of the surface, nor how the
    body was made. Units are SI.
    """
    from ffr_prep.body import load_body
    from ffr_prep.interchange.mbdyn import write_fem
    from ffr_prep.interchange.sid import write_sid

    target = _format("--output", output)
    loaded = load_body(body)
    if target == "SID":
        write_sid(loaded, output, layout=layout, surface=surface)
    else:
        write_fem(loaded, output, kind=kind, surface=surface)
    if loaded.stiffening is not None and target != "SID" and kind == "legacy":
        click.echo("note        the geometric stiffness of the body was left out")
    filed(output)


@click.command("import", epilog=_IMPORT)
@click.argument("file", type=PATH)
@OUTPUT
def import_body(file: Path, output: Path) -> None:
    """Read FILE (.SID_FEM, or .fem of MBDyn; SI units) and write it as a body file.

    Every node becomes an interface. What could not be taken over is said; nothing is left out silently.
    """
    from ffr_prep.body import save_body
    from ffr_prep.interchange.mbdyn import read_fem
    from ffr_prep.interchange.sid import read_sid
    from ffr_prep.report.text import short_lines

    body = read_sid(file) if _format("FILE", file) == "SID" else read_fem(file)
    save_body(body, output)
    show(short_lines(body))
    for note in body.provenance["notes"]:
        click.echo(f"note        {note}")
    filed(output)


def _format(what: str, path: Path) -> str:
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{what} {path}: the format {path.suffix!r} is not known; write .SID_FEM, or .fem for MBDyn")
    return _SUFFIXES[path.suffix.lower()]
