"""The sub-command `reduce-structure` of ffr-prep: bodies from frames of beams and plates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli.options import TIME_LIMIT, tell_of_programs
from ffr_prep.cli.request import CUTS, OUTPUT, SOLVER, reduce_to_file, solver_of
from ffr_prep.cli.terminal import show, terminal_steps
from ffr_prep.common.command import INPUT_FILE, reserve
from ffr_prep.common.entries import assignments

if TYPE_CHECKING:
    from ffr_prep.structures.frame import Frame

NOTES = """\b
Example of a STRUCTURE:
  reference = {kind = "fixed", interface = "left_foot"}
  reduction = {method = "craig-bampton", modes = 10}
  [geometry]
  file = "portal.geo"               # curves are beams, surfaces are plates
  [members.columns]                 # a group of curves
  section = {shape = "i", h = 0.2, b = 0.1, web = 0.006, flange = 0.009}
  material = "steel"
  orientation = [1, 0, 0]           # in the plane of the web
  [shells.roof]                     # a group of surfaces
  thickness = 0.003
  material = "steel"
  [interfaces.left_foot]            # a group of points, curves or surfaces

\b
Without a file: [[polylines]] with member, corners and elements, [[panels]] with shell, four corners and elements = [n, m];
[nodes] gives names to places, such as tip = [1, 0, 0]. Sections: rectangle (b, h), circle (d), tube (d, t), i (h, b, web,
flange), general (A, Iy, Iz, J, ky, kz). References: fixed, simply-supported (pin, roller), mean-axis, supports.

\b
Damping: damping = {rayleigh = [2.0, 1e-6]}, in 1/s and s, or loss_factor = 0.01, ratios = [0.01] of the modes in their
order, bands = [[100, 0.005], [1000, 0.02]] up to 100 Hz, to 1000 Hz and beyond.

\b
Solids tied to the frame, and other reductions:
  ties = [["frame.tip", "eye.bore"]]
  reduction = [{method = "craig-bampton", modes = 10}, {method = "krylov", moments = 2, match = [0, 120]}]
  [solids.eye]                      # a mesh or geometry of solids
  file = "eye.step"
  material = "steel"
  interfaces = {bore = {}, pin = {kind = "mean"}}

\b
Examples:
  ffr-prep reduce-structure tower.toml -o tower.ffr
  ffr-prep reduce-structure tower.toml -p members.columns.section.h=0.25 -p reduction.modes=12 -o tower.ffr
"""


@click.command("reduce-structure", epilog=NOTES)
@click.argument("structure", type=INPUT_FILE)
@OUTPUT
@click.option(
    "-p",
    "--parameter",
    "entries",
    multiple=True,
    metavar="NAME=VALUE",
    help="Another value of an entry by its path, such as members.columns.section.h=0.25 or reduction.modes=12; repeat.",
)
@CUTS
@SOLVER
@TIME_LIMIT
def reduce_structure_command(structure: Path, output: Path, entries: tuple[str, ...], **options: Any) -> None:
    """Reduce the beams and plates that STRUCTURE describes, a TOML file, to a flexible body and write it to a file."""
    from ffr_prep.pipelines.structure_file import geometry_files, read_structure

    solver, given = solver_of(options), assignments(entries)
    reserve("-o", output, usual=".ffr")
    tell_of_programs(geometry_files(structure, given))
    steps = terminal_steps()
    loaded = read_structure(structure, steps, entries=given)
    steps.end()
    show(frame_lines(loaded.frame))
    show(f"note        {name}: {note}" for name, (mesh, *_) in loaded.solids.items() for note in mesh.notes)
    cuts = loaded.request.parts if options["parts"] is None else options["parts"]
    request = replace(loaded.request, parts=cuts, solver=solver, provenance={"source": {"file": structure.name}})
    reduce_to_file(lambda: loaded.model(steps), request, output, steps)


def frame_lines(frame: Frame) -> Iterator[str]:
    """Size, extent and groups of a frame, and what is too thick for its size."""
    from ffr_prep.structures.frame import thickness_doubts

    kinds = {"beams": frame.elements, "triangles": frame.triangles, "quadrilaterals": frame.quadrilaterals}
    elements = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in kinds.items() if len(nodes))
    yield f"frame       {elements}; {len(frame.points)} nodes, {6 * len(frame.points)} degrees of freedom"
    extent = frame.points.max(axis=0) - frame.points.min(axis=0)
    yield f"extent      ({', '.join(f'{x:.5g}' for x in extent)}) m"
    yield f"groups      {', '.join(frame.node_groups) or 'none named'}"
    yield from (f"note        {doubt}" for doubt in thickness_doubts(frame))
