"""The command `ffr-prep`. Heavy modules are imported inside the commands, so that help is immediate."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli.conversion import convert
from ffr_prep.cli.geometry import GLUE, MOST, REGIONS, SOLIDS, UNIT, faces_command, rigid_command
from ffr_prep.cli.interchange import export_body, import_body
from ffr_prep.cli.matrices import reduce_matrices_command
from ffr_prep.cli.options import (
    SET,
    TIME_LIMIT,
    bundle,
    check_points,
    gone,
    material_of,
    number_of,
    numbers_of,
    reference_lines,
    regions_of,
    tell_of_programs,
)
from ffr_prep.cli.reduction import NOTES as REDUCTION_NOTES
from ffr_prep.cli.request import REQUEST, WORDS, reduce_to_file, request_of
from ffr_prep.cli.settings import EntriesCommand, NotesCommand
from ffr_prep.cli.structure import reduce_structure_command
from ffr_prep.cli.terminal import filed, show, terminal_steps
from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, reserve, run_command
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import check_folder
from ffr_prep.common.registry import load_plugin
from ffr_prep.mesh.formats import MESH_FORMATS
from ffr_prep.reduction.registry import REDUCTIONS

if TYPE_CHECKING:
    from ffr_prep.report.integrals import Source

EXAMPLE = """\b
Example:
  ffr-prep reduce rod.geo --unit mm --material steel --interface big_eye --interface small_eye \\
           --reference simply-supported:big_eye,small_eye --modes 10 -o rod.ffr
  ffr-prep info rod.ffr
  ffr-prep modes rod.ffr -o out/modes
  ffr-dyn --help                           # what moves the body
"""
REDUCE_NOTES = """\b
Interfaces: where the body meets joints and forces.
  --interface big_eye            the surface "big_eye" moves as one piece, like a bore on a stiff pin (rigid, RBE2)
  --interface face:mean          "face" stays soft and its mean motion counts, as where a load is spread (mean, RBE3)
  --interface pin=surface_7      the interface is called "pin", the surface "surface_7"
  --interface hook@0.1,0,0.02    its node is at this point [m] instead of the centroid of the surface
  --interface "pin=cylinder r=6mm at 0,0,0"    the surface is found by what it is, as told under Regions
  `ffr-prep faces MESH` lists the surfaces with what to type for each; `ffr-prep mesh MESH` node sets as well.

\b
Reference conditions: how the body frame is attached to the deforming body.
  fixed:NAME                     the frame moves with this interface: bodies clamped at one place, blades, robot links
  simply-supported:PIN,ROLLER    the frame follows the line between two interfaces: rods with a pin at each end
  "fixed:plane z=0"              a region, as told below: the interface that lies there, or one more that is made
                                 there ("support", mean); two of them: "simply-supported:plane x=0; plane x=50"
  mean-axis                      the frame follows the mean motion of the mass: free bodies, spacecraft, anything
  FILE.toml                      your own choice, a table for each prevented motion:
                                   [[support]]
                                   interface = "big_eye"
                                   motion = "translation"      # or "rotation"
                                   direction = [1.0, 0.0, 0.0]
With craig-bampton, choices that only remove the six rigid motions give the same answer up to second order in the
strain. With eigenmodes the choice matters: take the one that looks like the joints.

"""
MATERIAL_NOTES = """\b
Materials: a name (steel, aluminium, titanium, ...), or E=70GPa,nu=0.3,rho=2700, SI units where none is written; for several
  volumes --material web=steel --material rim=E=7e10,nu=0.3,rho=2700, each with the name of a volume of the mesh.
Orthotropic ones by E1,E2,E3,nu12,nu13,nu23,G12,G13,G23,rho in the axes of the mesh, or by a file ply.toml with the same
  keys, or `elasticity` (6 x 6, components xx, yy, zz, xy, xz, yz) and `rho`, and `axes` where the material is turned.
"""
CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 120}


class Remembering(click.Group):
    """Commands whose words are kept with what they make (`ffr_prep.cli.request.retold`)."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """As always."""
        ctx.meta[WORDS] = list(args)
        return super().resolve_command(ctx, args)


@click.group(cls=Remembering, epilog=EXAMPLE, invoke_without_command=True, context_settings=CONTEXT)
@click.version_option(package_name="ffr")
@click.option(
    "--plugin",
    "plugins",
    type=INPUT_FILE,
    multiple=True,
    metavar="FILE.py",
    help="Run this Python first: it may register reductions and file formats; may be repeated.",
)
@click.pass_context
def cli(context: click.Context, plugins: tuple[Path, ...]) -> None:
    """From a mesh to a reduced flexible body for multibody dynamics in the floating frame of reference.

    `faces` shows what surfaces a part has and what to type for each; `reduce` computes a body file from a mesh or a CAD
    geometry, `rigid` one of a body that does not deform; `mesh` shows what is in a mesh; `info` and `modes` show what is in a
    body file, in numbers and in pictures.
    """
    for plugin in plugins:
        load_plugin(plugin)
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


# ---- options that describe a mesh ---------------------------------------------------------------------------------

_MESH = bundle(
    click.argument("mesh", type=INPUT_FILE),
    UNIT,
    click.option("--size", type=float, help="Largest element edge, in that unit, when geometry is meshed."),
    SET,
    click.option(
        "--order",
        type=click.IntRange(1, 2),
        help="Of the elements, when geometry is meshed; default: 2.",
    ),
    GLUE,
    SOLIDS,
    MOST,
    TIME_LIMIT,
)


def _mesh_settings(options: Mapping[str, Any]) -> dict[str, Any]:
    given = ("unit", "size", "order", "glue", "solids", "most_elements")
    return {key: options[key] for key in given} | {"numbers": numbers_of(options["numbers"], options["unit"])}


@cli.command(cls=NotesCommand, registries=(MESH_FORMATS,), epilog="\b\nFormats:\n{mesh format}")
@_MESH
def mesh(mesh: Path, **options: Any) -> None:
    """Elements, extent, names of surfaces, node sets and volumes of MESH; and whether it is sound."""
    from ffr_prep.mesh.mesh import check_mesh, read_mesh
    from ffr_prep.report.text import mesh_lines

    tell_of_programs([mesh])
    loaded = read_mesh(mesh, **_mesh_settings(options))
    show(mesh_lines(loaded))
    check_mesh(loaded)


@cli.command(
    cls=EntriesCommand, registries=(REDUCTIONS,), epilog=f"{REDUCE_NOTES}{REGIONS}\n{REDUCTION_NOTES}\n{MATERIAL_NOTES}"
)
@_MESH
@click.option(
    "--material",
    "materials",
    multiple=True,
    metavar="MATERIAL",
    help="See below; default: that of a .inp or .bdf file.",
)
@REQUEST
@click.option("--linear", is_flag=True, help="Leave out the load matrices: linear elasticity, for what barely bends.")
@click.option(
    "--drawn-modes",
    type=click.IntRange(min=1),
    help="Lowest modes that foreshorten what is drawn; default: all. m of them cost m (m + 1) / 2 static problems.",
)
@gone("--stiffening", "load matrices are computed by default; --linear leaves them out")
@click.option(
    "--stress", is_flag=True, help="Also keep the stress at the surface, which ffr-dyn stress and animate show."
)
@click.option(
    "--region",
    "regions",
    multiple=True,
    metavar="NAME=REGION",
    help='Keep which triangles of the surface a region has, for a pressure with triangles = "NAME"; repeat.',
)
def reduce(mesh: Path, materials: tuple[str, ...], regions: tuple[str, ...], **options: Any) -> None:
    """Reduce MESH to a flexible body and write it to a file.

    MESH is a geometry that is meshed here (.geo, .step, .iges, .brep) or a mesh of solids (.msh, .inp, .bdf, .vtu,
    .med, ...). Everything in the body is in SI units.
    """
    from ffr_prep.cli.options import own_or_given
    from ffr_prep.mesh.geometry.skin import with_regions
    from ffr_prep.mesh.mesh import element_order, read_mesh
    from ffr_prep.pipelines.file_materials import CARRIERS
    from ffr_prep.report.text import mesh_lines
    from ffr_prep.solids.model import from_mesh
    from ffr_prep.solids.reference_regions import at_regions
    from ffr_prep.solids.surface_regions import region_triangles

    (interfaces, request), settings = request_of(options), _mesh_settings(options)
    named = regions_of(regions)
    given = material_of(materials) if materials or mesh.suffix.lower() not in CARRIERS else None
    reserve("-o", options["output"], usual=".ffr")
    tell_of_programs([mesh])
    steps = terminal_steps()
    loaded = read_mesh(mesh, **settings, progress=steps)
    steps.end()
    show(mesh_lines(loaded))
    check_points(interfaces, loaded)
    with_regions(loaded, list(named.values()))  # refused before anything is computed
    every, reference = at_regions(loaded, interfaces, request.reference)
    show(reference_lines(request.reference, reference, interfaces))
    material = own_or_given(mesh, loaded, settings["unit"], given)
    source = {"file": mesh.name, **{key: settings[key] for key in ("unit", "size", "numbers")}}
    source |= {"order": element_order(mesh, settings["order"])}
    source |= {key: value for key, value in (("glue", settings["glue"]), ("solids", list(settings["solids"]))) if value}
    request = replace(request, reference=reference, provenance={"source": source, "notes": list(loaded.notes)})
    reduce_to_file(
        lambda: from_mesh(loaded, material, every, progress=steps),
        request,
        options["output"],
        steps,
        options["quality"],
        (lambda body: {name: region_triangles(loaded, body, at).tolist() for name, at in named.items()})
        if named
        else None,
    )


@cli.command()
@click.argument("body", type=INPUT_FILE)
@click.option(
    "--terms",
    multiple=True,
    metavar="NAME",
    help="Print this inertia integral in full: I1 ... I9, S_bar, S_bar_xy, N_bar_xy, S_bar_ff, or all; repeat.",
)
@click.option("-o", "--output", type=OUTPUT_FILE, help="Write the integrals, or those of --terms, to this .npz file.")
def info(body: Path, terms: tuple[str, ...], output: Path | None) -> None:
    """Describe BODY: mass, inertia, interfaces, frequencies, inertia integrals, what it can represent, how it was made.

    The effective mass of a mode is the part of the mass that it sets in motion when the frame is shaken along an axis;
    modes with little of it matter little for inertia loads. With the mean-axis frame all of them are zero.

    Of a structure file (.toml) the integrals are in nodal coordinates, before reduction: six of each node, in turn.
    """
    from ffr_prep.report.integrals import chosen, save_terms, term_lines

    chosen(terms)
    if output is not None:
        reserve("-o", output, usual=".npz")
    source, lines = _described(body)
    show(term_lines(source, terms) if terms else lines)
    if output is not None:
        filed(save_terms(source, terms or ("all",), output))


def _described(path: Path) -> tuple[Source, Iterable[str]]:
    """A body or the nodal integrals of a structure, and its description."""
    if path.suffix != ".toml":
        from ffr_prep.body import load_body
        from ffr_prep.report.text import body_lines

        body = load_body(path)
        return body, body_lines(body)
    from ffr_prep.cli.structure import frame_lines
    from ffr_prep.pipelines.structure_file import read_structure
    from ffr_prep.report.integrals import integral_lines
    from ffr_prep.structures.nodal_integrals import nodal_integrals

    frame = read_structure(path).frame
    found = nodal_integrals(frame)
    return found, (*frame_lines(frame), *integral_lines(found))


@cli.command()
@click.argument("body", type=INPUT_FILE)
@click.option("-o", "--output", type=OUTPUT_FILE, required=True, help="Folder for the pictures.")
@click.option("--modes", "chosen", default="1-6", show_default=True, help="Numbers and ranges, such as 1-4,7; or all.")
@click.option(
    "--scale", default="auto", show_default=True, help="Factor on the mode shapes: a number [m sqrt(kg)], or auto."
)
def modes(body: Path, output: Path, chosen: str, scale: str) -> None:
    """Draw the mode shapes of BODY: a picture for each and a sheet with all of them.

    Shapes are coloured by displacement; the grey ghost is the undeformed body.
    """
    from ffr_prep.body import load_body
    from ffr_prep.report.mode_pictures import mode_pictures

    check_folder("-o", output)
    loaded = load_body(body)
    numbers = _mode_numbers(chosen, loaded.n)
    factor = "auto" if scale == "auto" else number_of("--scale", scale)
    for path in mode_pictures(loaded, output, numbers, factor):
        click.echo(f"picture     {path}")


cli.add_command(convert)
cli.add_command(export_body)
cli.add_command(faces_command)
cli.add_command(import_body)
cli.add_command(reduce_matrices_command)
cli.add_command(reduce_structure_command)
cli.add_command(rigid_command)


# ---- arguments ----------------------------------------------------------------------------------------------------


def _mode_numbers(text: str, count: int) -> list[int]:
    """Mode numbers from 1 of "1-4,7" or "all"; ranges may end beyond the last mode."""
    if not re.fullmatch(r"all|\d+(-\d+)?(,\d+(-\d+)?)*", text):
        raise InputError(f"--modes {text}: write numbers and ranges such as 1-4,7, or all")
    if text == "all":
        return list(range(1, count + 1))
    ends = [(int(first), int(last or first)) for first, _, last in (part.partition("-") for part in text.split(","))]
    numbers = [k for first, last in ends for k in range(first, min(last, max(count, first)) + 1)]
    if not numbers or min(numbers) < 1 or max(numbers) > count:
        raise InputError(f"--modes {text}: the body has {count} modes, numbered from 1")
    return list(dict.fromkeys(numbers))


# ---- the door -----------------------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point: exit code 2 for bad input, 1 for a failed computation or a signal, no traceback for either."""
    run_command(cli, "ffr-prep", arguments)
