"""The entries of a structure file (`ffr_prep.pipelines.structure_file`) and what each may hold."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, create_model, field_validator, model_validator

from ffr_prep.common.strict import Strict
from ffr_prep.reduction.registry import REDUCTIONS, method_of

Vector = tuple[float, float, float]


class RectangleEntry(Strict):
    """Width b along z', height h along y' [m]."""

    shape: Literal["rectangle"]
    b: float
    h: float


class CircleEntry(Strict):
    """Diameter d [m]."""

    shape: Literal["circle"]
    d: float


class TubeEntry(Strict):
    """Outer diameter d and wall t [m]."""

    shape: Literal["tube"]
    d: float
    t: float


class IEntry(Strict):
    """Height h, width b, web and flange thickness [m]."""

    shape: Literal["i"]
    h: float
    b: float
    web: float
    flange: float


class GeneralEntry(Strict):
    """A section by its constants, as in `ffr_prep.structures.sections.general`."""

    shape: Literal["general"]
    A: float
    Iy: float
    Iz: float
    J: float
    ky: float | None = None
    kz: float | None = None


SectionEntry = Annotated[RectangleEntry | CircleEntry | TubeEntry | IEntry | GeneralEntry, Field(discriminator="shape")]


class MaterialEntry(Strict):
    """Young's modulus [Pa], Poisson's ratio, density [kg/m^3]."""

    E: float
    nu: float
    rho: float


class MemberEntry(Strict):
    """A beam; orientation lies in its x'y' plane, offset is (y, z) of the centroid [m]; shear = false: Euler-Bernoulli."""

    section: SectionEntry
    material: str
    orientation: Vector | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    shear: bool = True


class ShellEntry(Strict):
    """A plate of a thickness [m]; rotary_inertia = false leaves out that of the thickness."""

    thickness: float
    material: str
    rotary_inertia: bool = True


class GeometryEntry(Strict):
    """A file as in `ffr_prep.structures.frame_geometry.read_frame`; size and numbers change how a geometry is meshed."""

    file: Path
    unit: Literal["m", "cm", "mm", "in"] | None = None
    size: float | None = None
    numbers: dict[str, float] = {}


class PolylineEntry(Strict):
    """Beams from corner to corner [m], each of several elements."""

    member: str
    corners: list[Vector]
    elements: int = 1


class PanelEntry(Strict):
    """A plate between four corners [m] of n x m elements, or of twice as many triangles."""

    shell: str
    corners: list[Vector]
    elements: tuple[int, int]
    triangles: bool = False


class InterfaceEntry(Strict):
    """At the nodes of a group, by default the one of the same name; point [m]: where its node is."""

    region: str | None = None
    kind: Literal["rigid", "mean"] = "rigid"
    point: Vector | None = None


class SupportEntry(Strict):
    """One prevented motion of an interface."""

    interface: str
    motion: Literal["translation", "rotation"]
    direction: Vector


class FixedEntry(Strict):
    """The frame moves with an interface."""

    kind: Literal["fixed"]
    interface: str


class SimplySupportedEntry(Strict):
    """The x' axis of the elastic field passes through two interfaces."""

    kind: Literal["simply-supported"]
    pin: str
    roller: str


class MeanAxisEntry(Strict):
    """The frame follows the mean motion of the mass."""

    kind: Literal["mean-axis"]


class SupportsEntry(Strict):
    """Any choice of prevented motions."""

    kind: Literal["supports"]
    supports: list[SupportEntry]


ReferenceEntry = Annotated[
    FixedEntry | SimplySupportedEntry | MeanAxisEntry | SupportsEntry, Field(discriminator="kind")
]


class ReductionEntry(Strict):
    """A reduction, of a method in `ffr_prep.reduction.registry` or a file of one's own vectors, with a number of normal
    modes, 10 when nothing is said, or all up to a frequency [Hz], or as many as a relative accuracy of the receptances in
    a band [low, high, error] needs. `structure_schema` adds the settings of the methods.
    """

    method: str = next(iter(REDUCTIONS)).name
    modes: int | None = Field(default=None, ge=0)
    frequency: float | None = None
    accuracy: tuple[float, float, float] | None = None

    @field_validator("method")
    @classmethod
    def _registered(cls, method: str) -> str:
        method_of(method)
        return method

    @model_validator(mode="after")
    def _one(self) -> ReductionEntry:
        if sum(value is not None for value in (self.modes, self.frequency, self.accuracy)) > 1:
            raise ValueError("modes, frequency and accuracy all say how many modes to keep: give one of them")
        return self


class SolidEntry(Strict):
    """A solid that is tied to the frame: a mesh or geometry as in `ffr_prep.mesh.mesh.read_mesh`, of one material or of one
    for each volume, with interfaces of its own. glue: solids of a CAD file that touch share the faces between them.
    """

    file: Path
    material: str | dict[str, str]
    interfaces: dict[str, InterfaceEntry] = Field(min_length=1)
    unit: Literal["m", "cm", "mm", "in"] | None = None
    size: float | None = None
    numbers: dict[str, float] = {}
    order: Literal[1, 2] = 2
    glue: bool = False


class CutEntry(Strict):
    """A plane that cuts the body into parts, through a point [m]; the next part lies where the normal points."""

    point: Vector
    normal: Vector


class DampingEntry(Strict):
    """Damping of the body: Rayleigh's alpha [1/s] and beta [s], a loss factor, ratios by frequency [Hz] and by mode."""

    rayleigh: tuple[float, float] = (0.0, 0.0)
    loss_factor: float = 0.0
    bands: list[tuple[float, float]] = []
    ratios: list[float] = []


class StructureEntry(Strict):
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
    solids: dict[str, SolidEntry] = {}
    ties: list[tuple[str, str]] = []
    reference: ReferenceEntry = MeanAxisEntry(kind="mean-axis")
    reduction: list[ReductionEntry]
    linear: bool = False
    drawn_modes: int | None = None
    stress: bool = False
    quality: tuple[float, float] | None = None
    damping: DampingEntry = DampingEntry()
    parts: int | list[float | CutEntry] | None = None

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, value: Any) -> Any:
        if isinstance(value, dict) and "stiffening" in value:
            raise ValueError("stiffening: load matrices are computed by default; write linear = true to leave them out")
        return value

    @field_validator("reduction", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return [value] if isinstance(value, dict) else value

    @model_validator(mode="after")
    def _something(self) -> StructureEntry:
        if self.geometry is None and not self.polylines and not self.panels:
            raise ValueError("give a [geometry] file, [[polylines]] or [[panels]]")
        if bool(self.solids) != bool(self.ties):
            raise ValueError('solids and ties need each other: ties = [["frame.tip", "eye.bore"]] of a [solids.eye]')
        if "frame" in self.solids:
            raise ValueError("the part 'frame' is that of beams and plates: give the solid another name")
        return self


def structure_schema() -> type[StructureEntry]:
    """The schema of the whole file, with the settings of all registered reductions."""
    settings: dict[str, Any] = {
        s.name: (s.type, Field(default=s.default, ge=s.least, description=s.help)) for s in REDUCTIONS.settings()
    }
    entry = create_model("ReductionEntry", __base__=ReductionEntry, **settings)
    several = (list[entry], Field(default=[entry()], min_length=1))  # type: ignore[valid-type]
    return create_model("StructureEntry", __base__=StructureEntry, reduction=several)
