"""A rigid body from the geometry of a part: mass properties by its density, without a reduction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ffr_prep.body import FlexibleBody, Surface, rigid_body, units_doubts
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.mesh.file_mesh import FileSolid
from ffr_prep.mesh.formats import format_of
from ffr_prep.mesh.geometry.face import METRES
from ffr_prep.mesh.geometry.face_files import skin_faces
from ffr_prep.mesh.geometry.faces import Faces
from ffr_prep.mesh.geometry.regions import found, names_of
from ffr_prep.mesh.geometry.skin import mesh_faces
from ffr_prep.mesh.gmsh_files import skin_from_gmsh
from ffr_prep.mesh.mesh import Mesh, cad_settings, check_mesh, check_request, read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.invariants import inertia_integrals
from ffr_prep.model.material import Material, density_doubts
from ffr_prep.solids.assembly import assemble


def rigid_part(
    path: str | Path,
    density: float,
    interfaces: Sequence[InterfaceRegion] = (),
    *,
    name: str | None = None,
    unit: str | None = None,
    numbers: Mapping[str, float] | None = None,
    solids: Sequence[str] = (),
) -> FlexibleBody:
    """The rigid body of a part, with its surface to draw; all its solids move as one.

        pin = fp.rigid_part("pin.step", 7850.0, [fp.InterfaceRegion("hole", "cylinder r=6mm at 0,0,0")])
        fp.save_body(pin, "pin.ffr")

    density    : [kg/m^3]; where solids overlap each of them counts, which is noted
    interfaces : points at which joints and forces attach: at the centroid of the faces of a region, the middle of a
                 set of nodes, or at its own point
    name       : of the body; that of the file without it
    other arguments as of `read_mesh`

    Mass, centre and inertia of CAD files are those of the CAD library, exact; of meshes those of their elements.

    Raises InputError for a density that is not positive, a file or a region that cannot be used.

    >>> crank = fp.rigid_part("crank.step", 7850.0, [fp.InterfaceRegion("pin", "cylinder r=6mm at 0,0,0")])
    """
    path, numbers = Path(path), dict(numbers or {})
    if not 0 < density < np.inf:
        raise InputError(f"the density is {density} kg/m^3; it must be positive")
    Material("of the part", 1.0, 0.0, density)  # refuses what no solid has
    check_request(path, unit, None, numbers, None)
    part = _geometry(path, unit, numbers, solids)
    faces, solid = part.faces, part.solid
    points = {interface.name: _place(part, interface) for interface in interfaces}
    if len(points) < len(interfaces):
        raise InputError("two interfaces have the same name: give each a name of its own")
    body = rigid_body(
        name or path.stem,
        mass=density * solid.volume,
        inertia=density * (solid.inertia + solid.inertia.T) / 2,
        centre_of_mass=solid.centre,
        points=points,
        surface=_surface(faces),
    )
    regions = [{"name": i.name, "region": i.region or i.name} for i in interfaces if i.point is None]
    source = {"file": path.name, "unit": faces.unit, "density": density}
    notes = [*faces.notes, *part.notes, *density_doubts(density), *units_doubts(body)]
    made = {"kind": "rigid", "source": source, "interfaces": regions, "notes": notes}
    return replace(body, provenance=made)


@dataclass(frozen=True)
class _Part:
    """Faces; volume, centre and inertia about it of all solids, in metres; notes on what counts twice; the middle of each set
    of nodes."""

    faces: Faces
    solid: FileSolid
    notes: Sequence[str] = ()
    node_groups: Mapping[str, Array] = field(default_factory=dict)


def _geometry(path: Path, unit: str | None, numbers: Mapping[str, float], solids: Sequence[str]) -> _Part:
    if format_of(path).geometry:
        settings = cad_settings(path, glue=False, solids=solids)
        with reading(path, "a geometry"):
            skin = skin_from_gmsh(path, unit=unit, numbers=numbers, overlaps=True, **settings)
        scale = METRES[skin.unit or "m"]
        if skin.solids:
            known = [
                FileSolid(s.name, s.label, s.volume * scale**3, s.centre * scale, s.inertia * scale**5)
                for s in skin.solids
            ]
            return _Part(skin_faces(skin), _together(known), _overlapping(skin.overlaps, skin.unit or "m"))
    cad_settings(path, glue=False, solids=solids)
    mesh = read_mesh(path, unit=unit, numbers=numbers)
    check_mesh(mesh)
    middles = {name: mesh.points[nodes].mean(axis=0) for name, nodes in mesh.node_groups.items()}
    return _Part(mesh_faces(mesh), _integrated(mesh), node_groups=middles)


def _overlapping(overlaps: Sequence[tuple[str, str, float]], unit: str) -> list[str]:
    return [
        f"solids {one!r} and {other!r} overlap: {volume:.4g} {unit}^3 count twice in mass and inertia, as in a press fit; "
        "where one of them should give way, cut it out of the other"
        for one, other, volume in overlaps
    ]


def _together(solids: Sequence[FileSolid]) -> FileSolid:
    """Several solids as one."""
    volume = sum(s.volume for s in solids)
    centre = sum((s.volume * s.centre for s in solids), np.zeros(3)) / volume
    inertia = np.zeros((3, 3))
    for s in solids:
        arm = s.centre - centre
        inertia += s.inertia + s.volume * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return FileSolid("", "", volume, centre, inertia)


def _integrated(mesh: Mesh) -> FileSolid:
    """Mass properties of the volume of the elements, curved ones included."""
    m = assemble(mesh, Material("of density one", 1.0, 0.0, 1.0)).m
    found = inertia_integrals(mesh.points, m, np.zeros((len(mesh.points), 3, 0)))
    second = found.rr_dm - np.outer(found.r_dm, found.r_dm) / found.mass
    return FileSolid("", "", found.mass, found.r_dm / found.mass, np.trace(second) * np.eye(3) - second)


def _place(part: _Part, interface: InterfaceRegion) -> Array:
    """The point of an interface: its own, the centroid of its faces, or the middle of its nodes."""
    faces, region = part.faces, interface.region or interface.name
    if interface.point is not None:
        return np.asarray(interface.point, float)
    if region in part.node_groups and not any(region in names_of(face) for face in faces.faces):
        return part.node_groups[region]
    try:
        chosen = found(faces, region)
    except InputError as error:
        raise InputError(f"interface {interface.name!r}: {error}") from None
    areas = np.array([faces.faces[k].area for k in chosen])
    return np.asarray(areas @ np.array([faces.faces[k].centre for k in chosen]) / areas.sum())


def _surface(faces: Faces) -> Surface:
    used, triangles = np.unique(np.concatenate(faces.triangles), return_inverse=True)
    return Surface(faces.points[used], triangles.reshape(-1, 3), np.zeros((used.size, 3, 0)))
