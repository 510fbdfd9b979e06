"""The command `ffr-prep`. Heavy modules are imported inside the commands, so that help is immediate."""

from __future__ import annotations

import os
import re
import sys
import time
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli_conversion import convert
from ffr_prep.cli_interchange import export_body, import_body
from ffr_prep.cli_matrices import reduce_matrices_command
from ffr_prep.cli_reduction import NOTES as REDUCTION_NOTES
from ffr_prep.cli_reduction import band_of, draw_quality, reduction_of, reduction_options
from ffr_prep.cli_solver import solver_of, solver_options
from ffr_prep.cli_structure import reduce_structure
from ffr_prep.errors import ComputationError, InputError

if TYPE_CHECKING:
    from ffr_prep.interface import InterfaceRegion
    from ffr_prep.material import Material
    from ffr_prep.mesh import Mesh
    from ffr_prep.reference import ReferenceConditions

EXAMPLE = """\b
Example:
  ffr-prep reduce rod.geo --unit mm --material steel --interface big_eye --interface small_eye \\
           --reference simply-supported:big_eye,small_eye --modes 10 -o rod.ffr
  ffr-prep info rod.ffr
  ffr-prep modes rod.ffr -o out/modes
"""
REDUCE_NOTES = """\b
Interfaces: where the body meets joints and forces.
  --interface big_eye            the surface "big_eye" moves as one piece, like a bore on a stiff pin (rigid, RBE2)
  --interface face:mean          "face" stays soft and its mean motion counts, as where a load is spread (mean, RBE3)
  --interface pin=surface_7      the interface is called "pin", the surface "surface_7"
  --interface hook@0.1,0,0.02    its node is at this point [m] instead of the centroid of the surface
  `ffr-prep mesh MESH` lists the surfaces and node sets there are.

\b
Reference conditions: how the body frame is attached to the deforming body.
  fixed:NAME                     the frame moves with this interface: bodies clamped at one place, blades, robot links
  simply-supported:PIN,ROLLER    the frame follows the line between two interfaces: rods with a pin at each end
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
Materials: a name (steel, aluminium, titanium, ...), or E=7e10,nu=0.3,rho=5540 in SI units; for several volumes
  --material web=steel --material rim=E=7e10,nu=0.3,rho=2700, each with the name of a volume of the mesh.
"""
_FAR = 10.0
CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 120}


@click.group(epilog=EXAMPLE, context_settings=CONTEXT)
@click.version_option(package_name="ffr")
def cli() -> None:
    """From a mesh to a reduced flexible body for multibody dynamics in the floating frame of reference.

    `reduce` computes a body file from a mesh or a CAD geometry; `mesh` shows what is in a mesh; `info` and `modes` show
    what is in a body file, in numbers and in pictures.
    """


# ---- options that describe a mesh ---------------------------------------------------------------------------------

_PATH = click.Path(path_type=Path)
_UNIT = click.option(
    "--unit",
    type=click.Choice(["m", "cm", "mm", "in"]),
    help="Unit of the numbers in MESH; default: what a STEP file declares, mm for IGES, m for others.",
)
_SIZE = click.option("--size", type=float, help="Largest element edge, in that unit, when geometry is meshed.")
_SET = click.option(
    "--set", "numbers", multiple=True, metavar="NAME=VALUE", help="Change a parameter of a .geo script."
)
_ORDER = click.option(
    "--order", type=click.IntRange(1, 2), default=2, show_default=True, help="Of the elements, when geometry is meshed."
)


@cli.command()
@click.argument("mesh", type=_PATH)
@_UNIT
@_SIZE
@_SET
@_ORDER
def mesh(mesh: Path, unit: str | None, size: float | None, numbers: tuple[str, ...], order: int) -> None:
    """What MESH holds: elements, extent, and the names of surfaces, node sets and volumes; and whether it is sound."""
    from ffr_prep.mesh import check_mesh, read_mesh
    from ffr_prep.report import mesh_lines

    loaded = read_mesh(mesh, unit=unit, size=size, numbers=_numbers(numbers), order=order)
    _print(mesh_lines(loaded))
    check_mesh(loaded)


@cli.command(epilog=f"{REDUCE_NOTES}{REDUCTION_NOTES}\n{MATERIAL_NOTES}")
@click.argument("mesh", type=_PATH)
@click.option("-o", "--output", type=_PATH, required=True, help="Body file to write.")
@click.option("--name", help="Name of the body; default: the name of the file.")
@_UNIT
@_SIZE
@_SET
@_ORDER
@click.option("--material", "materials", multiple=True, required=True, metavar="MATERIAL", help="See below.")
@click.option("--interface", "interfaces", multiple=True, metavar="INTERFACE", help="See below; may be repeated.")
@click.option("--reference", default="mean-axis", show_default=True, metavar="CONDITIONS", help="See below.")
@reduction_options
@solver_options
@click.option(
    "--stiffening", is_flag=True, help="Also compute geometric stiffening: slender rods under load, fast blades."
)
@click.option(
    "--stress", is_flag=True, help="Also keep the stress at the surface, which ffr-dyn stress and animate show."
)
def reduce(
    mesh: Path,
    output: Path,
    name: str | None,
    unit: str | None,
    size: float | None,
    numbers: tuple[str, ...],
    order: int,
    materials: tuple[str, ...],
    interfaces: tuple[str, ...],
    reference: str,
    stiffening: bool,
    stress: bool,
    **options: Any,
) -> None:
    """Reduce MESH to a flexible body and write it to a file.

    MESH is a geometry that is meshed here (.geo, .step, .iges, .brep) or a mesh of solids (.msh, .inp, .bdf, .vtu,
    .med, ...). Everything in the body is in SI units.
    """
    from ffr_prep.body import save_body
    from ffr_prep.mesh import read_mesh
    from ffr_prep.reduce import reduce_mesh
    from ffr_prep.report import mesh_lines, short_lines

    material, regions = _material(materials), [_interface(text) for text in interfaces]
    conditions, reduction, band = _reference(reference), reduction_of(options), band_of(options)
    solver = solver_of(options)
    parameters = _numbers(numbers)
    _check_writable(output)
    steps = Steps(visible=sys.stderr.isatty())
    loaded = read_mesh(mesh, unit=unit, size=size, numbers=parameters, order=order, progress=steps)
    steps.end()
    _print(mesh_lines(loaded))
    _check_points(regions, loaded)
    body = reduce_mesh(
        loaded,
        name=name or output.stem,
        material=material,
        interfaces=regions,
        reference=conditions,
        reduction=reduction,
        stiffening=stiffening,
        stress=stress,
        quality=band,
        solver=solver,
        progress=steps,
        provenance={
            "source": {"file": mesh.name, "unit": unit, "size": size, "numbers": parameters, "order": order},
            "notes": list(loaded.notes),
        },
    )
    steps("write the body file")
    save_body(body, output)
    steps.end()
    _print(short_lines(body))
    draw_quality(body, options)
    click.echo(f"time        {steps.in_words()}")
    click.echo(f"memory      {peak_memory()}")
    click.echo(f"file        {output}, {output.stat().st_size / 1024:.0f} kB")


@cli.command()
@click.argument("body", type=_PATH)
def info(body: Path) -> None:
    """What BODY is: mass, inertia, interfaces, frequencies, what it can represent, and how it was made.

    The effective mass of a mode is the part of the mass that it sets in motion when the frame is shaken along an axis;
    modes with little of it matter little for inertia loads. With the mean-axis frame all of them are zero.
    """
    from ffr_prep.body import load_body
    from ffr_prep.report import body_lines

    _print(body_lines(load_body(body)))


@cli.command()
@click.argument("body", type=_PATH)
@click.option("-o", "--output", type=_PATH, required=True, help="Folder for the pictures.")
@click.option("--modes", "chosen", default="1-6", show_default=True, help="Numbers and ranges, such as 1-4,7; or all.")
@click.option(
    "--scale", default="auto", show_default=True, help="Factor on the mode shapes: a number [m sqrt(kg)], or auto."
)
def modes(body: Path, output: Path, chosen: str, scale: str) -> None:
    """Draw the mode shapes of BODY: a picture for each and a sheet with all of them.

    Shapes are coloured by displacement; the grey ghost is the undeformed body.
    """
    from ffr_prep.body import load_body
    from ffr_prep.plots import mode_pictures

    loaded = load_body(body)
    numbers = _mode_numbers(chosen, loaded.n)
    factor = "auto" if scale == "auto" else _number("--scale", scale)
    for path in mode_pictures(loaded, output, numbers, factor):
        click.echo(f"picture     {path}")


cli.add_command(convert)
cli.add_command(export_body)
cli.add_command(import_body)
cli.add_command(reduce_matrices_command)
cli.add_command(reduce_structure)


# ---- arguments ----------------------------------------------------------------------------------------------------


def _numbers(settings: Sequence[str]) -> dict[str, float]:
    pairs = [text.partition("=") for text in settings]
    return {name.strip(): _number(f"--set {name}", value) for name, _, value in pairs}


def _number(what: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{what}: {text!r} is not a number") from None


def _material(texts: Sequence[str]) -> Material | Mapping[str, Material]:
    """One material, or materials by group where a text is GROUP=MATERIAL."""
    from ffr_prep.material import parse_material

    groups = [re.fullmatch(r"(?!(?:E|nu|rho|name)=)([^=,]+)=(.+)", text) for text in texts]
    if len(texts) == 1 and groups[0] is None:
        return parse_material(texts[0])
    wrong = [text for text, group in zip(texts, groups, strict=True) if group is None]
    if wrong:
        raise InputError(f"--material {wrong[0]}: with several materials, each needs its volume: VOLUME={wrong[0]}")
    names = [group[1] for group in groups if group]
    if len(set(names)) < len(names):
        raise InputError(f"--material: a volume is given twice: {', '.join(names)}")
    return {group[1]: parse_material(group[2]) for group in groups if group}


def _interface(text: str) -> InterfaceRegion:
    """NAME[=REGION][:rigid|mean][@x,y,z]."""
    from ffr_prep.interface import InterfaceRegion

    parts = re.fullmatch(r"([^=:@]+)(?:=([^:@]+))?(?::(\w+))?(?:@([^@]+))?", text)
    if parts is None:
        raise InputError(f"--interface {text}: write NAME, NAME:mean, NAME=SURFACE or NAME@x,y,z (see --help)")
    name, region, kind, point = parts.groups()
    return InterfaceRegion(name, region, kind or "rigid", None if point is None else _point(text, point))


def _point(text: str, point: str) -> tuple[float, float, float]:
    values = [_number(f"--interface {text}", value) for value in point.split(",")]
    if len(values) != 3:
        raise InputError(f"--interface {text}: a point has three coordinates x,y,z in metres, not {len(values)}")
    return values[0], values[1], values[2]


def _reference(text: str) -> ReferenceConditions:
    from ffr_prep.reference import FixedTo, MeanAxis, SimplySupported

    kind, _, names = text.partition(":")
    interfaces = [name.strip() for name in names.split(",") if name.strip()]
    if text == "mean-axis":
        return MeanAxis()
    if kind == "fixed" and len(interfaces) == 1:
        return FixedTo(interfaces[0])
    if kind == "simply-supported" and len(interfaces) == 2:
        return SimplySupported(interfaces[0], interfaces[1])
    if text.endswith(".toml"):
        return _supports(Path(text))
    raise InputError(
        f"--reference {text}: write fixed:NAME, simply-supported:PIN,ROLLER, mean-axis or a FILE.toml (see --help)"
    )


def _supports(path: Path) -> ReferenceConditions:
    """Prevented motions from a file: tables [[support]] with interface, motion and direction."""
    from ffr_prep.reference import Support, Supports

    try:
        content = tomllib.loads(path.read_text())
        entries = content.pop("support")
        supports = tuple(Support(e.pop("interface"), e.pop("motion"), tuple(e.pop("direction"))) for e in entries)
    except FileNotFoundError:
        raise InputError(f"reference conditions {path} do not exist") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (tomllib.TOMLDecodeError, KeyError, TypeError, AttributeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not a list of supports ({error!r}); `ffr-prep reduce --help` shows one") from None
    unknown = [*content, *(key for entry in entries for key in entry)]
    if unknown:
        raise InputError(f"{path}: {unknown[0]!r} is not known; a support has interface, motion and direction")
    return Supports(supports)


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


def _check_points(interfaces: Sequence[InterfaceRegion], mesh: Mesh) -> None:
    """A point far away is most likely given in millimetres."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    reach = _FAR * max(high - low)
    for interface in interfaces:
        if interface.point is not None and any((interface.point < low - reach) | (interface.point > high + reach)):
            raise InputError(
                f"interface {interface.name!r}: its point {interface.point} is far from the body, which lies between "
                f"({', '.join(f'{x:.4g}' for x in low)}) and ({', '.join(f'{x:.4g}' for x in high)}) m; give it in metres"
            )


def _check_writable(output: Path) -> None:
    """Before the work, not after it."""
    if output.is_dir():
        raise InputError(f"--output {output} is a folder; name the body file to write, such as {output / 'rod.ffr'}")
    output.parent.mkdir(parents=True, exist_ok=True)
    if not os.access(output.parent, os.W_OK):
        raise InputError(f"--output {output}: the folder {output.parent} cannot be written to")


# ---- terminal -----------------------------------------------------------------------------------------------------


@dataclass
class Steps:
    """Notes when each step of the work begins; tells of it on a terminal."""

    visible: bool
    begun: list[tuple[str, float]] = field(default_factory=list)

    def __call__(self, step: str) -> None:
        """A step begins, and the one before ends."""
        self._tell_end()
        self.begun.append((step, time.perf_counter()))
        if self.visible:
            click.echo(f"{step} ... ", err=True, nl=False)

    def end(self) -> None:
        """The step ends and no other begins."""
        self._tell_end()
        self.begun.append(("", time.perf_counter()))

    def in_words(self) -> str:
        """The steps with the seconds each took."""
        spans = [(name, later - since) for (name, since), (_, later) in pairwise(self.begun)]
        return ", ".join(f"{name} {span:.1f} s" for name, span in spans if name)

    def _tell_end(self) -> None:
        if self.visible and self.begun and self.begun[-1][0]:
            click.echo(f"{time.perf_counter() - self.begun[-1][1]:.1f} s", err=True)


def peak_memory() -> str:
    """The most that this process ever had in memory, in words."""
    if sys.platform == "win32":
        return "not known on Windows"
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30:.2f} GiB at most"


def _print(lines: Iterable[str]) -> None:
    for line in lines:
        click.echo(line)


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point: exit code 2 for bad input, 1 for a failed computation, no traceback for either."""
    from ffr_prep.body import BodyError

    try:
        cli.main(arguments, standalone_mode=False)
    except (InputError, BodyError) as error:
        _leave(str(error), 2)
    except ComputationError as error:
        _leave(str(error), 1)
    except click.UsageError as error:
        _leave(f"{error.format_message()} (ffr-prep --help tells more)", 2)
    except OSError as error:
        _leave(f"{error.filename or 'file'}: {error.strerror or error}", 2)
    except MemoryError:
        _leave("not enough memory: make the mesh coarser", 1)
    except (click.Abort, KeyboardInterrupt):
        _leave("interrupted; nothing was written", 1)


def _leave(message: str, code: int) -> None:
    click.echo(f"ffr-prep: {message}", err=True)
    sys.exit(code)


if __name__ == "__main__":
    main()
