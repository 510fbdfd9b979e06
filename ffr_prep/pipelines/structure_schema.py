"""The entries of a structure file (`ffr_prep.pipelines.structure_file`) and what each may hold."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model, field_validator, model_validator

from ffr_prep.common.strict import Strict
from ffr_prep.common.units import si_number, split_quantity
from ffr_prep.reduction.registry import REDUCTIONS, method_of


def _in(unit: str) -> BeforeValidator:
    """Takes a text with a unit of this dimension, "12 mm", for a number in SI units."""

    def si(value: Any) -> Any:
        return si_number(value, unit) if isinstance(value, str) and split_quantity(value) else value

    return BeforeValidator(si)


_WRITTEN = WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]})
Metres = Annotated[float, _in("m"), _WRITTEN]
Area = Annotated[float, _in("m^2"), _WRITTEN]
SecondMoment = Annotated[float, _in("m^4"), _WRITTEN]
Pascals = Annotated[float, _in("Pa"), _WRITTEN]
Density = Annotated[float, _in("kg/m^3"), _WRITTEN]
Hertz = Annotated[float, _in("Hz"), _WRITTEN]
Seconds = Annotated[float, _in("s"), _WRITTEN]
Point = tuple[Metres, Metres, Metres]
Vector = tuple[float, float, float]


def _named_material(value: Any) -> Any:
    """Refuses its constants where the name of a material belongs."""
    if not isinstance(value, str):
        raise ValueError(
            'names a material: one of the library, such as "steel", or of a table [materials.NAME] with E, nu and rho'
        )
    return value


MaterialName = Annotated[str, BeforeValidator(_named_material)]


class RectangleEntry(Strict):
    """A solid rectangle.

    b : width along z' [m];  h : height along y' [m]
    """

    shape: Literal["rectangle"]
    b: Metres
    h: Metres


class CircleEntry(Strict):
    """A solid circle.

    d : diameter [m]
    """

    shape: Literal["circle"]
    d: Metres


class TubeEntry(Strict):
    """A round tube.

    d : outer diameter [m];  t : thickness of the wall [m]
    """

    shape: Literal["tube"]
    d: Metres
    t: Metres


class BoxEntry(Strict):
    """A rectangular hollow section.

    b : width along z' [m];  h : height along y' [m];  t : thickness of the walls [m]
    """

    shape: Literal["box"]
    b: Metres
    h: Metres
    t: Metres


class IEntry(Strict):
    """An I with equal flanges, its web along y'.

    h : height over all [m];  b : width of the flanges [m]
    web, flange : thickness [m]
    """

    shape: Literal["i"]
    h: Metres
    b: Metres
    web: Metres
    flange: Metres


class GeneralEntry(Strict):
    """A section by its constants, as in `ffr_prep.structures.sections.general`.

    A : area [m^2];  J : torsional constant [m^4]
    Iy, Iz : second moments of area about y' and z' [m^4]
    ky, kz : shear coefficients for forces along y' and z' [1]; without them the section is rigid in shear
    """

    shape: Literal["general"]
    A: Area
    Iy: SecondMoment
    Iz: SecondMoment
    J: SecondMoment
    ky: float | None = None
    kz: float | None = None


SectionEntry = Annotated[
    RectangleEntry | CircleEntry | TubeEntry | BoxEntry | IEntry | GeneralEntry, Field(discriminator="shape")
]


class MaterialEntry(Strict):
    """An isotropic material, to be named by members, shells and solids beside those of the library.

    E : Young's modulus [Pa];  nu : Poisson's ratio [1];  rho : density [kg/m^3]
    """

    E: Pascals
    nu: float
    rho: Density


class MemberEntry(Strict):
    """Section, material and orientation of beams.

    section : shape and size
    material : a name of [materials] or of the library
    orientation : a vector in the plane of x' (along the beam) and y' (its height) [1]; round sections need none
    offset : (y', z') of the centroid from the nodes [m]
    shear : whether shear deforms the beam (Timoshenko); false: Euler-Bernoulli
    """

    section: SectionEntry
    material: MaterialName
    orientation: Vector | None = None
    offset: tuple[Metres, Metres] = (0.0, 0.0)
    shear: bool = True


class ShellEntry(Strict):
    """Thickness and material of plates.

    thickness : of the plate [m]
    material : a name of [materials] or of the library
    rotary_inertia : false leaves out that of the thickness
    """

    thickness: Metres
    material: MaterialName
    rotary_inertia: bool = True


class GeometryEntry(Strict):
    """Curves and surfaces of a file, as in `ffr_prep.structures.frame_geometry.read_frame`; groups name members and shells.

    file : a geometry or a mesh, relative to this file
    unit : of its lengths; without it that of the file, or metres
    size : of elements, in the unit of the geometry
    numbers : values of the constants that a .geo declares by DefineConstant
    """

    file: Path
    unit: Literal["m", "cm", "mm", "in"] | None = None
    size: float | None = None
    numbers: dict[str, float] = {}


class PolylineEntry(Strict):
    """Beams from corner to corner.

    member : a name of [members]
    corners : two points or more [m]
    elements : from corner to corner
    """

    member: str
    corners: list[Point]
    elements: int = 1


class PanelEntry(Strict):
    """A plate between four corners.

    shell : a name of [shells]
    corners : four points in turn [m]
    elements : along the first and the second side
    triangles : twice as many triangles in place of quadrilaterals
    """

    shell: str
    corners: list[Point]
    elements: tuple[int, int]
    triangles: bool = False


class InterfaceEntry(Strict):
    """Where joints and forces take hold.

    region : a group of nodes or faces, or a search for them; without it the group of the interface's name
    kind : rigid, or the mean motion of the region
    point : where its node is [m]; without it the centre of the region
    """

    region: str | None = None
    kind: Literal["rigid", "mean"] = "rigid"
    point: Point | None = None


class SupportEntry(Strict):
    """One prevented motion of an interface.

    interface : its name
    motion : translation or rotation
    direction : along or about which [1]
    """

    interface: str
    motion: Literal["translation", "rotation"]
    direction: Vector


class FixedEntry(Strict):
    """The frame moves with an interface.

    interface : its name
    """

    kind: Literal["fixed"]
    interface: str


class SimplySupportedEntry(Strict):
    """The x' axis of the elastic field passes through two interfaces.

    pin : where the frame's origin stays;  roller : which stays on the axis
    """

    kind: Literal["simply-supported"]
    pin: str
    roller: str


class MeanAxisEntry(Strict):
    """The frame follows the mean motion of the mass."""

    kind: Literal["mean-axis"]


class SupportsEntry(Strict):
    """Any choice of prevented motions.

    supports : as many as hold the body, six in space
    """

    kind: Literal["supports"]
    supports: list[SupportEntry]


ReferenceEntry = Annotated[
    FixedEntry | SimplySupportedEntry | MeanAxisEntry | SupportsEntry, Field(discriminator="kind")
]


class ReductionEntry(Strict):
    """A reduction: how many modes is said by one of `modes`, `frequency` and `accuracy`; 10 modes when nothing is said.

    method : a word of `ffr-prep reduce --help`, or the name of a file of one's own vectors
    modes : normal modes that are kept [1]
    frequency : all up to this [Hz]
    accuracy : as many as a relative error of the receptances in a band needs: low [Hz], high [Hz], error [1]
    """

    method: str = next(iter(REDUCTIONS)).name
    modes: int | None = Field(default=None, ge=0)
    frequency: Hertz | None = None
    accuracy: tuple[Hertz, Hertz, float] | None = None

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
    """A solid that is tied to the frame.

    file : a mesh or a geometry as in `ffr_prep.mesh.mesh.read_mesh`, relative to this file
    material : one, or one for each volume, by the names of volumes
    interfaces : its own, by name
    unit : of the lengths in the file; without it that of the file, or metres
    size : of elements, in the unit of the geometry
    numbers : values of the constants that a .geo declares by DefineConstant
    order : of the elements, when geometry is meshed; 2 when not given
    glue : solids of a CAD file that touch share the faces between them
    """

    file: Path
    material: MaterialName | dict[str, MaterialName]
    interfaces: dict[str, InterfaceEntry] = Field(min_length=1)
    unit: Literal["m", "cm", "mm", "in"] | None = None
    size: float | None = None
    numbers: dict[str, float] = {}
    order: Literal[1, 2] | None = None
    glue: bool = False


class CutEntry(Strict):
    """A plane that cuts the body into parts.

    point : in the plane [m]
    normal : points to the next part [1]
    """

    point: Point
    normal: Vector


class DampingEntry(Strict):
    """Damping of the body; all that is given adds up.

    rayleigh : alpha [1/s] and beta [s] of alpha M + beta K
    loss_factor : viscous damping that loses as much at the frequency of each mode [1]
    bands : up to which frequency [Hz] which ratio [1] holds
    ratios : of the modes by rising frequency, the last of all others [1]
    """

    rayleigh: tuple[Hertz, Seconds] = (0.0, 0.0)
    loss_factor: float = 0.0
    bands: list[tuple[Hertz, float]] = []
    ratios: list[float] = []


class StructureEntry(Strict):
    """The whole file.

    name : of the body; without it that of the file
    geometry : a file of curves and surfaces
    polylines : beams from corner to corner
    panels : plates between four corners
    materials : by name, beside those of the library
    members : by name, what beams are made of
    shells : by name, what plates are made of
    nodes : names of places [m], which interfaces may name
    interfaces : by name, where joints and forces take hold
    solids : by name, tied to the frame
    ties : pairs of interfaces "part.interface" that are joined; the frame is the part "frame"
    reference : the reference conditions
    reduction : one table, or several, whose vectors are taken together
    linear : leaves out the load matrices, so that the body does not stiffen with its loads
    drawn_modes : how many of the lowest foreshorten pictures; without it all
    stress : keeps what stress is computed of
    quality : compares with the full model between these frequencies [Hz]
    damping : of the body
    parts : a number of parts along its long axis, or where it is cut: places along the axis [m] or planes
    """

    name: str | None = None
    geometry: GeometryEntry | None = None
    polylines: list[PolylineEntry] = []
    panels: list[PanelEntry] = []
    materials: dict[str, MaterialEntry] = {}
    members: dict[str, MemberEntry] = {}
    shells: dict[str, ShellEntry] = {}
    nodes: dict[str, Point] = {}
    interfaces: dict[str, InterfaceEntry] = {}
    solids: dict[str, SolidEntry] = {}
    ties: list[tuple[str, str]] = []
    reference: ReferenceEntry = MeanAxisEntry(kind="mean-axis")
    reduction: list[ReductionEntry]
    linear: bool = False
    drawn_modes: int | None = None
    stress: bool = False
    quality: tuple[Hertz, Hertz] | None = None
    damping: DampingEntry = DampingEntry()
    parts: int | list[Metres | CutEntry] | None = None

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
    """The schema of the whole file, with the settings of all registered reductions as keys of theirs."""
    settings: dict[str, Any] = {
        s.name: (s.type, Field(default=s.default, ge=s.least, description=s.help)) for s in REDUCTIONS.settings()
    }
    entry = create_model("ReductionEntry", __base__=ReductionEntry, __doc__=ReductionEntry.__doc__, **settings)
    several = (list[entry], Field(default=[entry()], min_length=1))  # type: ignore[valid-type]
    return create_model("StructureEntry", __base__=StructureEntry, __doc__=StructureEntry.__doc__, reduction=several)
