"""The sub-command `reduce-matrices` of ffr-prep: bodies from the stiffness and mass of another program."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli.options import TIME_LIMIT, tell_of_programs
from ffr_prep.cli.request import REQUEST, reduce_to_file, request_of
from ffr_prep.cli.settings import EntriesCommand
from ffr_prep.cli.terminal import show, terminal_steps
from ffr_prep.common.command import INPUT_FILE, reserve
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.formats import MATRIX_FORMATS
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS
from ffr_prep.reduction.registry import REDUCTIONS

if TYPE_CHECKING:
    from ffr_prep.matrices.model import MatrixModel

_SHOWN = 20
NOTES = """\b
Files: what other programs write, always of the free body without supports.
{matrix format}

\b
Groups: nodes get names in the files, or here.
  --group tip=17                 the node with number 17
  --group rim=100-120,207        several nodes
  --group root@0,0,0.1           the node at this point [m]

\b
Interfaces: as in `ffr-prep reduce`, on groups of nodes.
  --interface tip                one node with three rotations is an interface as it is; several follow rigidly (RBE2)
  --interface rim:mean           the mean motion of the nodes counts (RBE3)
  --interface pin=rim@0,0,0      the interface "pin" on group "rim", its node at this point [m]

Reference conditions and methods are those of `ffr-prep reduce`. The body is linear.
"""


@click.command("reduce-matrices", cls=EntriesCommand, registries=(REDUCTIONS, MATRIX_FORMATS), epilog=NOTES)
@click.argument("files", type=INPUT_FILE, nargs=-1, required=True)
@click.option(
    "--units", type=click.Choice(list(UNIT_SYSTEMS)), help="Of the numbers in FILES; default: as declared, or m-kg-s."
)
@click.option("--group", "groups", multiple=True, metavar="GROUP", help="See below; may be repeated.")
@click.option("--surface", type=INPUT_FILE, help="Mesh of the same solid, for drawing; in the length unit of FILES.")
@REQUEST
@TIME_LIMIT
def reduce_matrices_command(
    files: tuple[Path, ...], units: str | None, groups: tuple[str, ...], surface: Path | None, **options: Any
) -> None:
    """Reduce stiffness and mass matrices in FILES to a flexible body and write it to a file.

    The matrices come from any finite-element program; everything in the body is in SI units.
    """
    from ffr_prep.matrices.part import from_matrices
    from ffr_prep.matrices.readers import read_matrices

    interfaces, request = request_of(options)
    reserve("-o", options["output"], usual=".ffr")
    steps = terminal_steps()
    steps("read the matrices")
    model = _named(read_matrices(files, units=units), groups)
    model = model if surface is None else _drawn(model, surface)
    steps.end()
    show(_lines(model))
    reduce_to_file(
        lambda: from_matrices(model, interfaces, progress=steps), request, options["output"], steps, options["quality"]
    )


def _lines(model: MatrixModel) -> Iterator[str]:
    """Size, extent and groups of a model."""
    low, high = model.points.min(axis=0), model.points.max(axis=0)
    names = list(model.groups)
    yield f"matrices    {model.source['format']}, {len(model.points)} nodes, {len(model.nodes)} degrees of freedom"
    yield f"extent      ({', '.join(f'{x:.5g}' for x in high - low)}) m"
    yield f"groups      {', '.join(names[:_SHOWN]) or 'none named'}{', ...' if len(names) > _SHOWN else ''}"
    for note in model.notes:
        yield f"note        {note}"


def _named(model: MatrixModel, groups: Sequence[str]) -> MatrixModel:
    """The model with groups NAME=12,15-20 and NAME@x,y,z."""
    from ffr_prep.matrices.model import with_group, with_node

    for text in groups:
        if by_number := re.fullmatch(r"([^=@]+)=(\d+(?:-\d+)?(?:,\d+(?:-\d+)?)*)", text):
            model = with_group(model, by_number[1], _numbers(by_number[2]))
        elif by_place := re.fullmatch(r"([^=@]+)@([^,]+),([^,]+),([^,]+)", text):
            model = with_node(model, by_place[1], _place(text, by_place.groups()[1:]))
        else:
            raise InputError(f"--group {text}: write NAME=12,15-20 or NAME@x,y,z (see --help)")
    return model


def _numbers(text: str) -> list[int]:
    from ffr_prep.common.reading import check_count

    ends = [(int(first), int(last or first)) for first, _, last in (part.partition("-") for part in text.split(","))]
    if wrong := [f"{first}-{last}" for first, last in ends if last < first]:
        raise InputError(f"--group: the range {wrong[0]} runs backwards; write the smaller number first")
    check_count(sum(last - first + 1 for first, last in ends), "nodes in a group")
    if max(last for _, last in ends) >= 1 << 63:
        raise InputError(f"--group: {max(last for _, last in ends)} is no number of a node")
    return [number for first, last in ends for number in range(first, last + 1)]


def _place(text: str, words: Sequence[str]) -> list[float]:
    try:
        place = [float(word) for word in words]
    except ValueError:
        place = []
    if not place or not all(map(math.isfinite, place)):
        raise InputError(f"--group {text}: a point has three coordinates x,y,z in metres")
    return place


def _drawn(model: MatrixModel, surface: Path) -> MatrixModel:
    """The model with the boundary of a mesh to draw."""
    from ffr_prep.matrices.model import with_surface
    from ffr_prep.mesh.geometry.face import METRES
    from ffr_prep.mesh.mesh import read_mesh, surface_triangles

    length = model.source["units"].partition("-")[0]
    if length not in METRES:
        raise InputError(f"--surface {surface}: meshes in {length} cannot be read; they may be in {', '.join(METRES)}")
    tell_of_programs([surface])
    mesh = read_mesh(surface, unit=length)
    points, triangles = surface_triangles(mesh)
    return with_surface(model, mesh.points[points], triangles)
