"""The formats that meshes are read from, one entry each, and what their readers deliver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import Registry, Setting, Target
from ffr_prep.mesh.cells import KINDS

Array = np.ndarray

_ANY = "*"


@dataclass(frozen=True)
class MeshFormat:
    """A format of mesh or geometry files.

    read       : function, or "package.module:function", of the path that returns a `FileMesh`; for geometry it is called
                 with the further arguments unit, size, numbers and order of `ffr_prep.mesh.mesh.read_mesh`
    suffixes   : in lower case, with the dot
    geometry   : whether the file is meshed on reading
    parameters : whether it has numbers that may be changed by name
    """

    name: str
    help: str
    read: Target
    suffixes: tuple[str, ...]
    geometry: bool = False
    parameters: bool = False
    settings: tuple[Setting, ...] = ()


_GMSH = "ffr_prep.mesh.gmsh_files:from_gmsh"
MESH_FORMATS: Registry[MeshFormat] = Registry(
    "mesh format",
    (
        MeshFormat(
            "meshio", "Nastran, VTK and whatever else meshio reads", "ffr_prep.mesh.meshio_files:from_meshio", (_ANY,)
        ),
        MeshFormat("Abaqus", "input files, as CalculiX has them too", "ffr_prep.mesh.abaqus:from_abaqus", (".inp",)),
        MeshFormat(
            "gmsh",
            "meshes of gmsh, Salome and I-deas",
            "ffr_prep.mesh.gmsh_files:mesh_from_gmsh",
            (".msh", ".med", ".unv"),
        ),
        MeshFormat("CAD", "solids that gmsh meshes", _GMSH, (".step", ".stp", ".iges", ".igs", ".brep"), geometry=True),
        MeshFormat(
            "gmsh script", "solids that gmsh meshes, with parameters", _GMSH, (".geo",), geometry=True, parameters=True
        ),
    ),
)


def format_of(path: Path) -> MeshFormat:
    """The format of a file by its suffix: the last that takes it; meshio takes any."""
    suffix = path.suffix.lower()
    return [entry for entry in MESH_FORMATS if {suffix, _ANY} & set(entry.suffixes)][-1]


@dataclass(frozen=True)
class FileMesh:
    """A mesh as it is in a file, numbers in the unit of the file.

    points  : (N, 3)
    blocks  : volume elements by kind, (kind, nodes (E, k)), in the node order of `ffr_prep.mesh.cells`
    volumes : name -> element numbers, counted through the blocks
    faces   : name -> corners (F, 3) or (F, 4) of faces; the volume elements know the rest of their faces
    nodes   : name -> node indices
    notes   : what was left out or changed, in words
    unit    : of the numbers, where the file declares one
    """

    points: Array
    blocks: tuple[tuple[str, Array], ...]
    volumes: Mapping[str, Array]
    faces: Mapping[str, tuple[Array, ...]]
    nodes: Mapping[str, Array]
    notes: tuple[str, ...] = ()
    unit: str | None = None


def supported_kind(kind: str, name: str) -> str:
    """The kind, if it is one of ours; InputError for others, called `name` in the file."""
    if kind not in KINDS:
        raise InputError(
            f"the mesh has volume elements of kind {name!r}; only {', '.join(KINDS)} can be used: mesh again with "
            "tetrahedra or hexahedra of first or second order"
        )
    return kind
