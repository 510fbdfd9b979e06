"""The formats that meshes are read from, one entry each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ffr_prep.common.registry import Registry, Target

MOST_ELEMENTS = 2e6  # of second order some eight million unknowns, which take more memory than a large machine has

_ANY = "*"


@dataclass(frozen=True)
class MeshFormat:
    """A format of mesh or geometry files.

    read       : function, or "package.module:function", of the path that returns a `ffr_prep.mesh.file_mesh.FileMesh`; for
                 geometry it is called with the further arguments unit, size, numbers and order of
                 `ffr_prep.mesh.mesh.read_mesh`, and with glue, solids and most_elements where they are not the usual ones
    suffixes   : in lower case, with the dot
    geometry   : whether the file is meshed on reading
    parameters : whether it has numbers that may be changed by name

    >>> fp.register_mesh_format(fp.MeshFormat("own", "Own meshes.", "own:read", (".own",)))
    """

    name: str
    help: str
    read: Target
    suffixes: tuple[str, ...]
    geometry: bool = False
    parameters: bool = False


_GMSH = "ffr_prep.mesh.gmsh_files:from_gmsh"
MESH_FORMATS: Registry[MeshFormat] = Registry(
    "mesh format",
    (
        MeshFormat(
            "meshio",
            "VTK (.vtu), Medit (.mesh), and whatever else meshio reads",
            "ffr_prep.mesh.meshio_files:from_meshio",
            (_ANY,),
        ),
        MeshFormat(
            "Abaqus",
            ".inp: input files, of CalculiX as well",
            "ffr_prep.mesh.abaqus:from_abaqus",
            (".inp",),
        ),
        MeshFormat(
            "Nastran",
            ".bdf, .nas, .fem, .dat: bulk data in small, large or free fields",
            "ffr_prep.mesh.nastran:from_nastran",
            (".bdf", ".nas", ".fem", ".dat"),
        ),
        MeshFormat(
            "Ansys", ".cdb: archives of Mechanical APDL, in blocks", "ffr_prep.mesh.ansys:from_ansys", (".cdb",)
        ),
        MeshFormat(
            "CalculiX results",
            ".frd: the mesh of a file of results",
            "ffr_prep.mesh.frd:from_frd",
            (".frd",),
        ),
        MeshFormat(
            "gmsh",
            ".msh, .med, .unv: meshes of gmsh, Salome, I-deas",
            "ffr_prep.mesh.gmsh_files:mesh_from_gmsh",
            (".msh", ".med", ".unv"),
        ),
        MeshFormat(
            "CAD",
            ".step, .stp, .iges, .igs, .brep: solids, which gmsh meshes",
            _GMSH,
            (".step", ".stp", ".iges", ".igs", ".brep"),
            geometry=True,
        ),
        MeshFormat(
            "gmsh script",
            ".geo: solids with parameters, which gmsh meshes",
            _GMSH,
            (".geo",),
            geometry=True,
            parameters=True,
        ),
    ),
)


def register_mesh_format(entry: MeshFormat) -> None:
    """Offer a format to `read_mesh`, command line and structure files. Raises InputError for a name that is taken.

    >>> fp.register_mesh_format(fp.MeshFormat("own", "Own meshes.", "own:read", (".own",)))
    """
    MESH_FORMATS.register(entry)


def format_of(path: Path) -> MeshFormat:
    """The format of a file by its suffix: the last that takes it; meshio takes any."""
    suffix = path.suffix.lower()
    return [entry for entry in MESH_FORMATS if {suffix, _ANY} & set(entry.suffixes)][-1]
