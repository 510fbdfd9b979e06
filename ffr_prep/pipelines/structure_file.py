"""Structural models as text: a TOML file becomes a frame of beams and plates with all that its reduction needs.

    name = "portal"
    reference = {kind = "fixed", interface = "left_foot"}
    reduction = {method = "craig-bampton", modes = 10}

    [geometry]                        # and/or [[polylines]] and [[panels]]
    file = "portal.geo"
    [members.brace]                   # what the group "brace" of curves is made of
    section = {shape = "tube", d = 0.05, t = 0.004}
    material = "steel"
    [interfaces.left_foot]            # at a group of nodes of the same name

Paths are relative to the file; SI units but for the numbers of the geometry, whose unit it names. The whole schema is
`ffr_prep.pipelines.structure_schema`. Solids may be tied to the frame:

    ties = [["frame.tip", "eye.bore"]]
    [solids.eye]
    file = "eye.step"
    material = "steel"
    interfaces = {bore = {}, pin = {kind = "mean"}}
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ffr_prep.body import Damping
from ffr_prep.common.entries import with_entries
from ffr_prep.common.errors import InputError
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.common.reading import read_toml, reading
from ffr_prep.common.strict import complaint, entry_keys
from ffr_prep.mesh.mesh import Mesh, read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.cuts import CutPlane, Cuts
from ffr_prep.model.material import Material, material
from ffr_prep.model.model import Model
from ffr_prep.model.reference import FixedTo, MeanAxis, ReferenceConditions, SimplySupported, Support, Supports
from ffr_prep.pipelines.reduce import Request
from ffr_prep.pipelines.structure_schema import (
    CutEntry,
    DampingEntry,
    InterfaceEntry,
    MemberEntry,
    PanelEntry,
    ReductionEntry,
    ReferenceEntry,
    SolidEntry,
    StructureEntry,
    SupportsEntry,
    structure_schema,
)
from ffr_prep.pipelines.tied import tied
from ffr_prep.reduction.registry import reduction_of
from ffr_prep.reduction.selection import Band
from ffr_prep.solids.assembly import Materials
from ffr_prep.solids.model import from_mesh
from ffr_prep.structures.frame import Frame, Member, Shell, joined, named, panel, polyline, triangulated
from ffr_prep.structures.frame_geometry import read_frame
from ffr_prep.structures.model import from_frame
from ffr_prep.structures.sections import Section, box, circle, general, i_section, rectangle, shear_rigid, shifted, tube


@dataclass(frozen=True)
class Structure:
    """The contents of a structure file: a frame with its interfaces, solids tied to it, and how they are reduced together.

    solids : by name, the mesh, its material or one for each volume, and its interfaces
    ties   : pairs of interfaces "part.interface" that are joined; the frame is the part "frame"

    >>> structure = fp.read_structure("tower.toml")
    """

    frame: Frame
    interfaces: tuple[InterfaceRegion, ...]
    solids: Mapping[str, tuple[Mesh, Materials, tuple[InterfaceRegion, ...]]]
    ties: tuple[tuple[str, str], ...]
    request: Request

    def model(self, progress: Stages = no_stages) -> Model:
        """The frame with the solids that are tied to it; errors as of `from_frame`, `from_mesh` and `tied`."""
        frame = from_frame(self.frame, self.interfaces, progress=progress)
        if not self.solids:
            return frame
        solids = {name: from_mesh(*parts, progress=progress) for name, parts in self.solids.items()}
        return tied({"frame": frame, **solids}, self.ties)


def read_structure(path: str | Path, progress: Stages = no_stages, *, entries: Mapping[str, str] = {}) -> Structure:
    """Read a structure file, and the geometry it names.

    entries : values, as text, in place of those in the file, by the path of their keys: {"members.bar.section.d": "0.02"}

    Raises InputError for a file that cannot be read, unknown or missing entries, and whatever the frame's parts refuse;
    ComputationError when meshing fails.

    >>> structure = fp.read_structure("tower.toml")
    """
    path = Path(path)
    entry = _read(path, entries)
    try:
        with reading(path, "a structure file"):
            return _structure(path, entry, progress)
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from None


def _given(entry: ReductionEntry) -> dict[str, Any]:
    """What a reduction is given, without the defaults of settings that its method may not have."""
    return {name: getattr(entry, name) for name in ("method", *entry.model_fields_set)}


def _structure(path: Path, entry: StructureEntry, progress: Stages) -> Structure:
    members, shells = _members(entry), _shells(entry)
    frame = named(_frame(entry, path.parent, members, shells, progress), **entry.nodes)
    return Structure(
        frame=frame,
        interfaces=_regions(entry.interfaces),
        solids={name: _solid(entry, of, path.parent, progress) for name, of in entry.solids.items()},
        ties=tuple(entry.ties),
        request=Request(
            name=entry.name or path.stem,
            reference=_reference(entry.reference),
            reduction=reduction_of([_given(of) for of in entry.reduction], path.parent),
            linear=entry.linear,
            drawn_modes=entry.drawn_modes,
            stress=entry.stress,
            quality=None if entry.quality is None else Band(*entry.quality),
            parts=_cuts(entry.parts),
            damping=_damping(entry.damping),
        ),
    )


def _damping(entry: DampingEntry) -> Damping:
    alpha, beta = entry.rayleigh
    return Damping(alpha, beta, entry.loss_factor, entry.bands, entry.ratios)


def geometry_files(path: Path, entries: Mapping[str, str] = {}) -> list[Path]:
    """The meshes and geometries that a structure file names. Raises InputError for a file that cannot be read."""
    entry = _read(path, entries)
    named = [entry.geometry, *entry.solids.values()]
    return [path.parent / of.file for of in named if of is not None]


def _read(path: Path, entries: Mapping[str, str]) -> StructureEntry:
    tree = read_toml(path, "a structure file")
    try:
        tree = with_entries(tree, entries)
        return structure_schema().model_validate(tree)
    except ValidationError as error:
        raise InputError(f"{path}: {'; '.join(_explained(wrong, tree) for wrong in error.errors())}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _explained(wrong: Mapping[str, Any], tree: Mapping[str, Any]) -> str:
    """Where, what, and the value."""
    where = ".".join(entry_keys(wrong, tree)) or "the file"
    plain = not isinstance(wrong["input"], dict) and wrong["type"] != "missing"
    value = f" (it is {wrong['input']!r})" if plain else ""
    plain_number = "; write it without a unit" if wrong["type"] == "float_parsing" else ""
    return f"{where}: {complaint(wrong)}{value}{plain_number}"


# ---- parts --------------------------------------------------------------------------------------------------------


def _frame(
    entry: StructureEntry,
    folder: Path,
    members: Mapping[str, Member],
    shells: Mapping[str, Shell],
    progress: Stages,
) -> Frame:
    made = [polyline(p.corners, _of(members, "member", p.member), elements=p.elements) for p in entry.polylines]
    made += [_panel(p, shells) for p in entry.panels]
    if entry.geometry is not None:
        drawn_members = _without(members, [p.member for p in entry.polylines])
        drawn_shells = _without(shells, [p.shell for p in entry.panels])
        source = entry.geometry
        made.append(
            read_frame(
                folder / source.file,
                drawn_members,
                shells=drawn_shells,
                unit=source.unit,
                size=source.size,
                numbers=source.numbers,
                progress=progress,
            )
        )
    return joined(*made) if len(made) > 1 else made[0]


def _regions(entries: Mapping[str, InterfaceEntry]) -> tuple[InterfaceRegion, ...]:
    return tuple(InterfaceRegion(name, **vars(of)) for name, of in entries.items())


def _solid(
    entry: StructureEntry, of: SolidEntry, folder: Path, progress: Stages
) -> tuple[Mesh, Materials, tuple[InterfaceRegion, ...]]:
    how: dict[str, Any] = {key: getattr(of, key) for key in ("unit", "size", "numbers", "order", "glue")}
    mesh = read_mesh(folder / of.file, **how, progress=progress)
    if isinstance(of.material, str):
        return mesh, _material(entry, of.material), _regions(of.interfaces)
    return mesh, {volume: _material(entry, name) for volume, name in of.material.items()}, _regions(of.interfaces)


def _panel(entry: PanelEntry, shells: Mapping[str, Shell]) -> Frame:
    made = panel(entry.corners, _of(shells, "shell", entry.shell), elements=entry.elements)
    return triangulated(made) if entry.triangles else made


def _without(parts: Mapping[str, Any], used: list[str]) -> dict[str, Any]:
    """Those that only the geometry can use."""
    return {name: part for name, part in parts.items() if name not in used}


def _of(parts: Mapping[str, Any], what: str, name: str) -> Any:
    if name not in parts:
        raise InputError(f"there is no {what} {name!r}; there are: {', '.join(map(repr, parts)) or 'none'}")
    return parts[name]


def _members(entry: StructureEntry) -> dict[str, Member]:
    return {
        name: Member(_section(of), _material(entry, of.material), of.orientation) for name, of in entry.members.items()
    }


def _shells(entry: StructureEntry) -> dict[str, Shell]:
    return {
        name: Shell(of.thickness, _material(entry, of.material), None if of.rotary_inertia else 0.0)
        for name, of in entry.shells.items()
    }


def _material(entry: StructureEntry, name: str) -> Material:
    if name in entry.materials:
        return Material(name, **vars(entry.materials[name]))
    return material(name)


def _section(entry: MemberEntry) -> Section:
    constants = {key: value for key, value in vars(entry.section).items() if key != "shape" and value is not None}
    make: dict[str, Callable[..., Section]] = {
        "rectangle": rectangle,
        "circle": circle,
        "tube": tube,
        "box": box,
        "i": i_section,
        "general": lambda **given: general("general", **given),
    }
    section = make[entry.section.shape](**constants)
    section = section if entry.shear else shear_rigid(section)
    return shifted(section, *entry.offset) if any(entry.offset) else section


def _cuts(given: int | list[float | CutEntry] | None) -> Cuts | None:
    if given is None or isinstance(given, int):
        return given
    return [CutPlane(one.point, one.normal) if isinstance(one, CutEntry) else one for one in given]


def _reference(entry: ReferenceEntry) -> ReferenceConditions:
    if isinstance(entry, SupportsEntry):
        return Supports(tuple(Support(**vars(support)) for support in entry.supports))
    make = {"fixed": FixedTo, "simply-supported": SimplySupported, "mean-axis": MeanAxis}
    return make[entry.kind](**{key: value for key, value in vars(entry).items() if key != "kind"})
