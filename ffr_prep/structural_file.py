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

Paths are relative to the file; SI units but for the numbers of the geometry, whose unit it names. The whole schema is in the
models below.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from ffr_prep.errors import InputError
from ffr_prep.frame import Frame, Member, Shell, joined, named, panel, polyline, triangulated
from ffr_prep.frame_source import read_frame
from ffr_prep.interface import InterfaceRegion
from ffr_prep.material import Material, material
from ffr_prep.reduction import CraigBampton, Eigenmodes, Guyan, Reduction, Rubin, Union
from ffr_prep.reference import FixedTo, MeanAxis, ReferenceConditions, SimplySupported, Support, Supports
from ffr_prep.section import Section, circle, general, i_section, rectangle, shear_rigid, shifted, tube
from ffr_prep.selection import Accuracy, Band, Selection, UpTo
from ffr_prep.static_shapes import AttachmentModes, InertiaRelief

Vector = tuple[float, float, float]
Progress = Callable[[str], None]


class _Strict(BaseModel):
    """Unknown keys are mistakes; numbers must be finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class RectangleEntry(_Strict):
    """Width b along z', height h along y' [m]."""

    shape: Literal["rectangle"]
    b: float
    h: float


class CircleEntry(_Strict):
    """Diameter d [m]."""

    shape: Literal["circle"]
    d: float


class TubeEntry(_Strict):
    """Outer diameter d and wall t [m]."""

    shape: Literal["tube"]
    d: float
    t: float


class IEntry(_Strict):
    """Height h, width b, web and flange thickness [m]."""

    shape: Literal["i"]
    h: float
    b: float
    web: float
    flange: float


class GeneralEntry(_Strict):
    """A section by its constants, as in `ffr_prep.section.general`."""

    shape: Literal["general"]
    A: float
    Iy: float
    Iz: float
    J: float
    ky: float | None = None
    kz: float | None = None


SectionEntry = Annotated[RectangleEntry | CircleEntry | TubeEntry | IEntry | GeneralEntry, Field(discriminator="shape")]


class MaterialEntry(_Strict):
    """Young's modulus [Pa], Poisson's ratio, density [kg/m^3]."""

    E: float
    nu: float
    rho: float


class MemberEntry(_Strict):
    """A beam; orientation lies in its x'y' plane, offset is (y, z) of the centroid [m]; shear = false: Euler-Bernoulli."""

    section: SectionEntry
    material: str
    orientation: Vector | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    shear: bool = True


class ShellEntry(_Strict):
    """A plate of a thickness [m]; rotary_inertia = false leaves out that of the thickness."""

    thickness: float
    material: str
    rotary_inertia: bool = True


class GeometryEntry(_Strict):
    """A file as in `ffr_prep.frame_source.read_frame`; size and numbers change how a geometry is meshed."""

    file: Path
    unit: Literal["m", "cm", "mm", "in"] | None = None
    size: float | None = None
    numbers: dict[str, float] = {}


class PolylineEntry(_Strict):
    """Beams from corner to corner [m], each of several elements."""

    member: str
    corners: list[Vector]
    elements: int = 1


class PanelEntry(_Strict):
    """A plate between four corners [m] of n x m elements, or of twice as many triangles."""

    shell: str
    corners: list[Vector]
    elements: tuple[int, int]
    triangles: bool = False


class InterfaceEntry(_Strict):
    """At the nodes of a group, by default the one of the same name; point [m]: where its node is."""

    region: str | None = None
    kind: Literal["rigid", "mean"] = "rigid"
    point: Vector | None = None


class SupportEntry(_Strict):
    """One prevented motion of an interface."""

    interface: str
    motion: Literal["translation", "rotation"]
    direction: Vector


class FixedEntry(_Strict):
    """The frame moves with an interface."""

    kind: Literal["fixed"]
    interface: str


class SimplySupportedEntry(_Strict):
    """The x' axis of the elastic field passes through two interfaces."""

    kind: Literal["simply-supported"]
    pin: str
    roller: str


class MeanAxisEntry(_Strict):
    """The frame follows the mean motion of the mass."""

    kind: Literal["mean-axis"]


class SupportsEntry(_Strict):
    """Any choice of prevented motions."""

    kind: Literal["supports"]
    supports: list[SupportEntry]


ReferenceEntry = Annotated[
    FixedEntry | SimplySupportedEntry | MeanAxisEntry | SupportsEntry, Field(discriminator="kind")
]


class ReductionEntry(_Strict):
    """A reduction (see `ffr_prep.reduction`) with a number of normal modes, 10 when nothing is said, or all up to a
    frequency [Hz], or as many as a relative accuracy of the receptances in a band [low, high, error] needs.
    """

    method: Literal["craig-bampton", "eigenmodes", "rubin", "guyan", "attachment", "inertia-relief"] = "craig-bampton"
    modes: int | None = Field(default=None, ge=0)
    frequency: float | None = None
    accuracy: tuple[float, float, float] | None = None

    @model_validator(mode="after")
    def _one(self) -> ReductionEntry:
        if sum(value is not None for value in (self.modes, self.frequency, self.accuracy)) > 1:
            raise ValueError("modes, frequency and accuracy all say how many modes to keep: give one of them")
        return self


class StructureEntry(_Strict):
    """The whole file."""

    name: str | None = None
    geometry: GeometryEntry | None = None
    polylines: list[PolylineEntry] = []
    panels: list[PanelEntry] = []
    materials: dict[str, MaterialEntry] = {}
    members: dict[str, MemberEntry] = {}
    shells: dict[str, ShellEntry] = {}
    nodes: dict[str, Vector] = {}
    interfaces: dict[str, InterfaceEntry] = {}
    reference: ReferenceEntry = MeanAxisEntry(kind="mean-axis")
    reduction: list[ReductionEntry] = Field(default=[ReductionEntry()], min_length=1)
    stiffening: bool = False
    stress: bool = False
    quality: tuple[float, float] | None = None

    @field_validator("reduction", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return [value] if isinstance(value, dict) else value

    @model_validator(mode="after")
    def _something(self) -> StructureEntry:
        if self.geometry is None and not self.polylines and not self.panels:
            raise ValueError("give a [geometry] file, [[polylines]] or [[panels]]")
        return self


@dataclass(frozen=True)
class Structure:
    """What a structure file holds: the arguments of `ffr_prep.structural.reduce_frame`."""

    name: str
    frame: Frame
    interfaces: tuple[InterfaceRegion, ...]
    reference: ReferenceConditions
    reduction: Reduction
    stiffening: bool
    stress: bool
    quality: Band | None


def load_structure(path: str | Path, progress: Progress | None = None) -> Structure:
    """Read a structure file, and the geometry it names.

    Raises InputError for a file that cannot be read, unknown or missing entries, and whatever the frame's parts refuse;
    ComputationError when meshing fails.
    """
    path = Path(path)
    entry = _read(path)
    try:
        members, shells = _members(entry), _shells(entry)
        frame = named(_frame(entry, path.parent, members, shells, progress), **entry.nodes)
        return Structure(
            name=entry.name or path.stem,
            frame=frame,
            interfaces=tuple(InterfaceRegion(name, **vars(of)) for name, of in entry.interfaces.items()),
            reference=_reference(entry.reference),
            reduction=_reduction(entry.reduction),
            stiffening=entry.stiffening,
            stress=entry.stress,
            quality=None if entry.quality is None else Band(*entry.quality),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read(path: Path) -> StructureEntry:
    try:
        return StructureEntry.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise InputError(f"structure file {path} does not exist") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not TOML: {error}") from None
    except ValidationError as error:
        raise InputError(f"{path}: {'; '.join(map(_explained, error.errors()))}") from None


def _explained(wrong: Mapping[str, Any]) -> str:
    """Where, what, and the value."""
    where = ".".join(str(part) for part in wrong["loc"]) or "the file"
    if wrong["type"] == "extra_forbidden":
        return f"{where}: is not a known entry here"
    value = "" if isinstance(wrong["input"], dict) else f" (it is {wrong['input']!r})"
    return f"{where}: {wrong['msg'].removeprefix('Value error, ')}{value}"


# ---- parts --------------------------------------------------------------------------------------------------------


def _frame(
    entry: StructureEntry,
    folder: Path,
    members: Mapping[str, Member],
    shells: Mapping[str, Shell],
    progress: Progress | None,
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
        "i": i_section,
        "general": lambda **given: general("general", **given),
    }
    section = make[entry.section.shape](**constants)
    section = section if entry.shear else shear_rigid(section)
    return shifted(section, *entry.offset) if any(entry.offset) else section


def _reference(entry: ReferenceEntry) -> ReferenceConditions:
    if isinstance(entry, FixedEntry):
        return FixedTo(entry.interface)
    if isinstance(entry, SimplySupportedEntry):
        return SimplySupported(entry.pin, entry.roller)
    if isinstance(entry, SupportsEntry):
        return Supports(tuple(Support(**vars(support)) for support in entry.supports))
    return MeanAxis()


def _reduction(entries: Sequence[ReductionEntry]) -> Reduction:
    """One, or the space of several."""
    parts = tuple(_part(entry) for entry in entries)
    return parts[0] if len(parts) == 1 else Union(parts)


def _part(entry: ReductionEntry) -> Reduction:
    selection = _selection(entry)
    made: dict[str, Reduction] = {
        "craig-bampton": CraigBampton(selection),
        "eigenmodes": Eigenmodes(selection),
        "rubin": Rubin(selection),
        "guyan": Guyan(),
        "attachment": AttachmentModes(),
        "inertia-relief": InertiaRelief(),
    }
    return made[entry.method]


def _selection(entry: ReductionEntry) -> Selection:
    if entry.accuracy is not None:
        low, high, tolerance = entry.accuracy
        return Accuracy(Band(low, high), tolerance)
    if entry.frequency is not None:
        return UpTo(entry.frequency)
    return 10 if entry.modes is None else entry.modes
