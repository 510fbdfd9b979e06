"""Parsing of the arguments of ffr-prep: numbers, materials, interfaces, reference conditions, files to write.

Heavy modules are imported where they are needed, so that help is immediate. Every function raises InputError, naming the
option and what it may be.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.common.errors import InputError
from ffr_prep.common.units import split_quantity, to_si
from ffr_prep.mesh.time_limit import USUAL, mesher_time_limit

if TYPE_CHECKING:
    from ffr_prep.mesh.mesh import Mesh
    from ffr_prep.model.coupled import InterfaceRegion
    from ffr_prep.model.material import Solid
    from ffr_prep.model.reference import ReferenceConditions

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

_FAR = 10.0


def bundle(*options: Decorator) -> Decorator:
    """Several options as one, in this order in the help."""

    def added(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return added


TIME_LIMIT = click.option(
    "--mesher-timeout",
    type=float,
    default=USUAL,
    show_default=True,
    expose_value=False,
    callback=lambda context, _, seconds: context.with_resource(mesher_time_limit(seconds)),
    help="Longest time that meshing a geometry may take [s].",
)

SET = click.option(
    "--set",
    "numbers",
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a parameter of a .geo script: a number in its unit, or a length such as 5cm; repeat.",
)


def tell_of_programs(paths: Iterable[Path]) -> None:
    """Scripts of gmsh are programs; that one is run is said."""
    for path in paths:
        if path.suffix.lower() == ".geo":
            click.echo(f"program     {path}, which gmsh runs: open only what you trust")


def gone(option: str, remedy: str) -> Decorator:
    """A flag of earlier versions that is refused; the remedy says what to write now."""

    def refused(context: click.Context, parameter: click.Parameter, given: bool) -> None:
        if given:
            raise InputError(f"{option} is no option any more: {remedy}")

    return click.option(option, is_flag=True, hidden=True, expose_value=False, callback=refused)


def numbers_of(settings: Sequence[str], unit: str | None) -> dict[str, float]:
    """Parameters of a script by name, from NAME=VALUE: numbers in its unit (m if none is given), or lengths with their own.

    >>> numbers_of(["L=5 cm", "n=3"], "mm")
    {'L': 50.0, 'n': 3.0}
    """
    for text in settings:
        if "=" not in text:
            raise InputError(f"--set {text}: write it as NAME=VALUE")
    pairs = [text.partition("=") for text in settings]
    return {name.strip(): _in_unit(name.strip(), value, unit or "m") for name, _, value in pairs}


def _in_unit(name: str, value: str, unit: str) -> float:
    given = split_quantity(value)
    if given is None:
        return number_of(f"--set {name} (in the unit of the script)", value)
    try:
        return float(f"{to_si(*given, 'm') / to_si(1.0, unit):.15g}")  # 300, and not 299.99999999999994
    except InputError as error:
        raise InputError(
            f"--set {name}={value}: {error}; only lengths may have a unit, other numbers are as the script takes them"
        ) from None


def number_of(what: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{what}: {text!r} is not a number") from None


def own_or_given(path: Path, mesh: Mesh, unit: str | None, given: Solid | Mapping[str, Solid] | None) -> Any:
    """The material that was given, or else those of the mesh file; which are used is said where the file has any."""
    from ffr_prep.model.material import Material
    from ffr_prep.pipelines.file_materials import file_materials, names_of_materials

    if given is not None:
        if names := names_of_materials(path):
            click.echo(f"note        --material is taken; not used: {', '.join(names)} of {path.name}")
        return given
    found = file_materials(path, mesh, unit=unit)
    for group, one in found.items():
        constants = f", E = {one.E:.6g} Pa, nu = {one.nu:g}" if isinstance(one, Material) else ""
        click.echo(f"material    {group}: {one.name} of {path.name}{constants}, rho = {one.rho:.6g} kg/m^3")
    return found


OF_VOLUME = r"(?!(?:E[123]?|nu(?:12|13|23)?|G(?:12|13|23)|rho|name)=)([^=,]+)=(.+)"  # VOLUME=MATERIAL


def material_of(texts: Sequence[str]) -> Solid | Mapping[str, Solid]:
    """One material, or materials by group where a text is GROUP=MATERIAL."""
    from ffr_prep.model.material import parse_material

    if not texts:
        raise InputError(
            "what is the part made of? Give --material steel, or another of the library, or E=2.1e11,nu=0.3,rho=7850; of "
            "several volumes --material VOLUME=steel for each"
        )
    groups = [re.fullmatch(OF_VOLUME, text) for text in texts]
    if len(texts) == 1 and groups[0] is None:
        return parse_material(texts[0])
    wrong = [text for text, group in zip(texts, groups, strict=True) if group is None]
    if wrong:
        raise InputError(f"--material {wrong[0]}: with several materials, each needs its volume: VOLUME={wrong[0]}")
    names = [group[1] for group in groups if group]
    if len(set(names)) < len(names):
        raise InputError(f"--material: a volume is given twice: {', '.join(names)}")
    return {group[1]: parse_material(group[2]) for group in groups if group}


def interface_of(text: str) -> InterfaceRegion:
    """NAME[=REGION][:rigid|mean][@x,y,z], the kind and the point at any place behind the name."""
    from ffr_prep.mesh.geometry.region_words import is_query
    from ffr_prep.model.coupled import InterfaceRegion

    ordered = re.sub(r"(@[-+.\w]+(?:,[-+.\w]+)*)([=:].+)$", r"\2\1", text)
    ordered = re.sub(r"^([^=:@]+):(\w+)=([^@]+)", r"\1=\3:\2", ordered)
    parts = re.fullmatch(r"([^=:@]+)(?:=(.+?))?(?::(\w+))?(?:@([^@]+))?", ordered)
    if parts is None:
        raise InputError(f"--interface {text}: write NAME, NAME:mean, NAME=SURFACE or NAME@x,y,z (see --help)")
    if is_query(text):
        raise InputError(f'--interface {text}: give it a name as well, such as --interface "bore={text}"')
    name, region, kind, point = parts.groups()
    return InterfaceRegion(name, region, kind or "rigid", None if point is None else _point(text, point))


def regions_of(texts: Sequence[str]) -> dict[str, str]:
    """Regions of the surface by name, each NAME=REGION; InputError for a text without a name and for a name given twice."""
    pairs = [re.fullmatch(r"([^=\s]+)=(.+)", text) for text in texts]
    for text, pair in zip(texts, pairs, strict=True):
        if pair is None:
            raise InputError(f'--region {text}: give it a name, such as --region "top={text}"')
    named = {pair[1]: pair[2] for pair in pairs if pair}
    if len(named) < len(texts):
        raise InputError(f"--region: a name is given twice: {', '.join(texts)}")
    return named


def _point(text: str, point: str) -> tuple[float, float, float]:
    values = [number_of(f"--interface {text}", value) for value in point.split(",")]
    if len(values) != 3:
        raise InputError(f"--interface {text}: a point has three coordinates x,y,z in metres, not {len(values)}")
    return values[0], values[1], values[2]


def reference_of(text: str) -> ReferenceConditions:
    from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported

    kind, _, names = text.partition(":")
    between = ";" if ";" in names else ","
    interfaces = [names.strip()] if kind == "fixed" else [name.strip() for name in names.split(between) if name.strip()]
    if text == "mean-axis":
        return MeanAxis()
    if kind == "fixed" and interfaces[0]:
        return FixedTo(interfaces[0])
    if kind == "simply-supported" and len(interfaces) == 2:
        return SimplySupported(interfaces[0], interfaces[1])
    if text.endswith(".toml"):
        return _supports(Path(text))
    raise InputError(
        f"--reference {text}: write fixed:NAME, simply-supported:PIN,ROLLER, mean-axis or a FILE.toml (see --help)"
    )


def reference_lines(
    asked: ReferenceConditions, meant: ReferenceConditions, interfaces: Sequence[InterfaceRegion]
) -> list[str]:
    """Which interfaces, of those asked for or made, stand for the regions that the reference conditions have named."""
    from ffr_prep.model.reference import named_interfaces

    pairs = dict(zip(named_interfaces(asked), named_interfaces(meant), strict=True))
    own = {interface.name for interface in interfaces}
    return [
        f"reference   {region}: {'there lies' if name in own else 'a mean interface is made there,'} {name!r}"
        for region, name in pairs.items()
        if region != name
    ]


def _supports(path: Path) -> ReferenceConditions:
    """Prevented motions from a file: tables [[support]] with interface, motion and direction."""
    from ffr_prep.common.reading import read_toml
    from ffr_prep.model.reference import Support, Supports

    try:
        content = read_toml(path, "reference conditions")
        entries = content.pop("support")
        supports = tuple(Support(e.pop("interface"), e.pop("motion"), tuple(e.pop("direction"))) for e in entries)
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise InputError(f"{path} is not a list of supports ({error!r}); `ffr-prep reduce --help` shows one") from None
    unknown = [*content, *(key for entry in entries for key in entry)]
    if unknown:
        raise InputError(f"{path}: {unknown[0]!r} is not known; a support has interface, motion and direction")
    return Supports(supports)


def check_points(interfaces: Sequence[InterfaceRegion], mesh: Mesh) -> None:
    """A point far away is most likely given in millimetres."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    reach = _FAR * max(high - low)
    for interface in interfaces:
        if interface.point is not None and any((interface.point < low - reach) | (interface.point > high + reach)):
            raise InputError(
                f"interface {interface.name!r}: its point {interface.point} is far from the body, which lies between "
                f"({', '.join(f'{x:.4g}' for x in low)}) and ({', '.join(f'{x:.4g}' for x in high)}) m; give it in metres"
            )
