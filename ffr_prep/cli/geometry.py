"""The commands that look at a part before it is meshed: `faces`, `rigid`."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from ffr_prep.cli.options import OF_VOLUME, SET, TIME_LIMIT, bundle, interface_of, numbers_of, tell_of_programs
from ffr_prep.cli.terminal import filed, show
from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, reserve
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.formats import MOST_ELEMENTS

REGIONS = """\b
Regions: wherever a surface is named, it may be found by what it is instead.
  surface_5, bore                    the name of a face, of a group, of a node set, or the label that the file has
  surface_1+surface_2, surface_1..4  several, a range;   bore*, pin_?   all whose names fit
  cylinder r=6mm at 0,0,0            the cylinder of this radius whose axis passes there, in however many faces;
                                     also d=12mm, axis=z, and bore for hollow ones, cone, sphere, torus
  plane z=0                          the plane there; also x=, y=, normal=-z, at 0,0,5
  nearest 10,0,5                     the surface nearest to a point, in however many faces
  cylinder r=6mm near 10,0,5         of those that fit the nearest;   all cylinder r=6mm   all of them
  cylinder r=6mm solid=pin#2         of a solid of an assembly
  Numbers without a unit are in that of the file. `ffr-prep faces PART` tells what to type for each face.
"""
UNIT = click.option(
    "--unit",
    type=click.Choice(["m", "cm", "mm", "in"]),
    help="Unit of the numbers in the file; default: what a STEP or .unv file declares, mm for IGES, m for others.",
)
SOLIDS = click.option(
    "--solid", "solids", multiple=True, metavar="NAME", help="Of a CAD file with several solids keep this one; repeat."
)
GLUE = click.option("--glue", is_flag=True, help="Solids of a CAD file that touch share the faces between them.")
MOST = click.option(
    "--most-elements",
    type=float,
    default=MOST_ELEMENTS,
    show_default=True,
    help="A geometry whose size asks for more is refused before it is meshed.",
)
_PART = bundle(
    click.argument("part", type=INPUT_FILE),
    UNIT,
    SET,
    SOLIDS,
    TIME_LIMIT,
)


def _settings(options: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "unit": options["unit"],
        "solids": options["solids"],
        "numbers": numbers_of(options["numbers"], options["unit"]),
    }


@click.command("faces", epilog=REGIONS)
@_PART
@GLUE
@click.option("--find", "regions", multiple=True, metavar="REGION", help="Tell which faces this region means; repeat.")
@click.option("--json", "as_json", is_flag=True, help="Print all that is known as JSON, lengths in metres.")
@click.option("--picture", type=OUTPUT_FILE, metavar="FILE.png", help="Draw two views with the numbers of the faces.")
@click.option("--page", type=OUTPUT_FILE, metavar="FILE.html", help="A page in which a click tells what to type.")
def faces_command(
    part: Path, regions: tuple[str, ...], as_json: bool, picture: Path | None, page: Path | None, **options: Any
) -> None:
    """List the faces of PART: kind, radius, axis, place, area, name and colour, and what to type for each.

    PART is a CAD file (.step, .iges, .brep), a script of gmsh (.geo), or a mesh, on whose skin planes, cylinders and spheres
    are recognised. A bore that is several faces is one line.
    """
    from ffr_prep.mesh.geometry.face_files import faces, found_faces
    from ffr_prep.report.faces import face_lines, face_picture, face_values

    reserve("--picture", picture, (".png",))
    reserve("--page", page, (".html",))
    tell_of_programs([] if as_json else [part])
    known = faces(part, glue=options["glue"], **_settings(options))
    if as_json:
        click.echo(json.dumps(face_values(known), indent=1))
    elif not regions:
        show(face_lines(known))
    for region in regions:
        click.echo(f"{region}: {', '.join(found_faces(known, region))}")
    if picture is not None:
        filed(face_picture(known, picture, part.name))
    if page is not None:
        from ffr_prep.report.face_page import face_page

        filed(face_page(known, page, part.name))


@click.command("rigid", epilog=REGIONS)
@_PART
@click.option("--density", type=float, help="Of all that is in the file [kg/m^3].")
@click.option(
    "--material", "materials", multiple=True, metavar="MATERIAL",
    help="Instead: a material, such as steel, whose density counts.",
)  # fmt: skip
@click.option(
    "--interface", "interfaces", multiple=True, metavar="INTERFACE",
    help="A point for joints and forces: NAME=REGION, at the centre of these faces, or NAME@x,y,z [m]; repeat.",
)  # fmt: skip
@click.option("--name", help="Name of the body; default: the name of the file.")
@click.option("-o", "--output", type=OUTPUT_FILE, required=True, help="Body file to write.")
def rigid_command(part: Path, interfaces: tuple[str, ...], output: Path, **options: Any) -> None:
    """A rigid body from PART: mass, centre and inertia by its density, with its shape, for `file` of a body in a scene.

    Nothing is meshed or reduced but what is drawn; of CAD files the mass properties are exact. All solids move as one.
    """
    from ffr_prep.body import save_body
    from ffr_prep.pipelines.rigid import rigid_part
    from ffr_prep.report.text import short_lines

    density = _density(options["density"], options["materials"])
    points = [interface_of(text) for text in interfaces]
    reserve("-o", output, usual=".ffr")
    tell_of_programs([part])
    body = rigid_part(part, density, points, name=options["name"] or output.stem, **_settings(options))
    save_body(body, output)
    show(short_lines(body))
    show(f"note        {note}" for note in body.provenance["notes"])
    filed(output)


def _density(density: float | None, materials: tuple[str, ...]) -> float:
    if (density is None) == (not materials):
        raise InputError("give the density, such as --density 7850, or a --material, such as steel")
    if density is not None:
        return density
    if len(materials) > 1 or re.match(OF_VOLUME, materials[0]):
        raise InputError(
            f"--material {materials[-1]}: a rigid body has one density: make one of each volume (of CAD files by "
            "--solid NAME) and join them by a fixed joint, or reduce the part, whose volumes may have materials of their own"
        )
    from ffr_prep.model.material import parse_material

    return parse_material(materials[0]).rho
