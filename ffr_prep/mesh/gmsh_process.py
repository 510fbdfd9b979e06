"""Gmsh in a process of its own: open a geometry or mesh file, mesh it, write plain arrays.

Run as  python gmsh_process.py JOB.json RESULT.npz.  Gmsh is a large native library that may crash or exit; here that
ends only this process. It runs on one thread, so the same file gives the same mesh bit for bit.

Exit codes: 0 done, 2 the file cannot be read, 3 gmsh cannot be loaded, 4 meshing failed, 5 the size of the elements makes
more than could be used. Messages are on stderr.

Source: C. Geuzaine, J.-F. Remacle, Int. J. Numer. Meth. Engng 79 (2009) 1309-1331; gmsh reference manual.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

UNREADABLE, UNLOADABLE, UNMESHED, TOO_FINE = 2, 3, 4, 5

_HXT = 10
_ELEMENTS_PER_TURN = 12
_DIGITS = 12
_TETRAHEDRA_PER_CUBE = 8.5  # regular ones, of an edge like that of the cube
_MOST_ELEMENTS, _MOST_ALONG = 5e7, 2e4
_IGES = (".iges", ".igs")
_CAD = (".step", ".stp", ".brep", *_IGES)


def main() -> int:
    """Run the job described by the file named first and write the arrays to the file named second."""
    job = json.loads(Path(sys.argv[1]).read_text())
    try:
        import gmsh
    except (OSError, ImportError) as error:
        return _failed(error, UNLOADABLE)
    numbers = [word for name, value in job["numbers"].items() for word in ("-setnumber", name, repr(value))]
    gmsh.initialize(["gmsh", *numbers], readConfigFiles=False)
    try:
        _open(gmsh, job)
    except Exception as error:  # gmsh raises nothing more specific
        return _failed(error, UNREADABLE)
    try:
        if job["generate"] and (many := _too_many(gmsh, job)):
            return _failed(many, TOO_FINE)
        if job["generate"]:
            _generate(gmsh, job)
        arrays, names = {1: _lines, 2: _surfaces, 3: _result}[job["dimension"]](gmsh)
        if job["generate"]:
            arrays["points"] = _rounded(arrays["points"])
    except Exception as error:
        return _failed(error, UNMESHED)
    arrays["names"] = np.frombuffer(json.dumps(names).encode(), np.uint8)
    np.savez(sys.argv[2], allow_pickle=False, **arrays)
    gmsh.finalize()
    return 0


def _failed(error: BaseException | str, code: int) -> int:
    print(error, file=sys.stderr)
    return code


# ---- meshing ------------------------------------------------------------------------------------------------------


def _open(gmsh: Any, job: dict[str, Any]) -> None:
    for option in ("General.NumThreads", "Mesh.MaxNumThreads1D", "Mesh.MaxNumThreads2D", "Mesh.MaxNumThreads3D"):
        gmsh.option.setNumber(option, 1)
    gmsh.option.setNumber("Mesh.Algorithm3D", _HXT)
    gmsh.option.setNumber("Mesh.Optimize", 1)
    if job["path"].lower().endswith(_IGES):  # surfaces without solids, for which OpenCASCADE takes no target unit
        gmsh.option.setNumber("Geometry.OCCSewFaces", 1)
        gmsh.option.setNumber("Geometry.OCCMakeSolids", 1)
    else:
        gmsh.option.setString("Geometry.OCCTargetUnit", job["unit"])
    if job["path"].lower().endswith(_CAD):
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _ELEMENTS_PER_TURN)
    gmsh.open(job["path"])
    if not gmsh.model.getEntities():
        raise ValueError("nothing in it is a geometry or a mesh")


def _too_many(gmsh: Any, job: dict[str, Any]) -> str:
    """Why a size cannot be meant, if it makes so many elements that no mesh would come of it; empty if it can."""
    if job["size"] is None or not gmsh.model.getEntities(job["dimension"]):
        return ""
    low, high = np.split(np.array(gmsh.model.getBoundingBox(-1, -1)), 2)
    extent = max(high - low)
    solids = [tag for _, tag in gmsh.model.occ.getEntities(3)] if job["dimension"] == 3 else []
    filled = sum(gmsh.model.occ.getMass(3, tag) for tag in solids)  # of what OpenCASCADE does not know nothing
    elements = _TETRAHEDRA_PER_CUBE * filled / job["size"] ** 3
    if elements < _MOST_ELEMENTS and extent / job["size"] < _MOST_ALONG:
        return ""
    return (
        f"elements of size {job['size']:g} would be far too many for a geometry of extent {extent:.5g}; "
        "both are in the unit of the file"
    )


def _generate(gmsh: Any, job: dict[str, Any]) -> None:
    """Mesh the volumes, the surfaces or the curves; the options set here win over those of a script."""
    if job["size"] is not None:
        gmsh.option.setNumber("Mesh.MeshSizeMax", job["size"])
        if job["path"].lower().endswith(_CAD):  # without sizes at points, gmsh takes a tenth of the diagonal
            gmsh.model.mesh.setSize(gmsh.model.getEntities(0), job["size"])
    gmsh.option.setNumber("Mesh.ElementOrder", job["order"])
    if job["dimension"] == 1:
        if not gmsh.model.getEntities(1):
            raise ValueError("the geometry has no curves: draw the axes of the beams")
        gmsh.model.mesh.generate(1)
        return
    if job["dimension"] == 2:
        if not gmsh.model.getEntities(2):
            raise ValueError("the geometry has no surfaces: draw the plates as surfaces")
        gmsh.model.mesh.generate(2)
        return
    if not gmsh.model.getEntities(3):
        raise ValueError("the geometry has no volume, only surfaces or curves: make it a solid")
    if not gmsh.model.mesh.getElementTypes(3).size:
        gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(job["order"])
    if job["order"] == 2 and _smallest_jacobian(gmsh) <= 0:
        gmsh.model.mesh.optimize("HighOrder")


def _rounded(points: np.ndarray) -> np.ndarray:
    """Twelve digits: OpenCASCADE projects onto curved faces with rounding errors that differ from run to run."""
    size = np.ptp(points, axis=0).max()
    return np.round(points, _DIGITS - int(np.ceil(np.log10(size)))) + 0.0


def _smallest_jacobian(gmsh: Any) -> float:
    types = gmsh.model.mesh.getElementTypes(3)
    tags = [gmsh.model.mesh.getElementsByType(kind)[0] for kind in types]
    return min(gmsh.model.mesh.getElementQualities(of_kind, "minDetJac").min() for of_kind in tags)


# ---- result -------------------------------------------------------------------------------------------------------


def _result(gmsh: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The mesh as arrays, and the names and notes that belong to them as JSON values."""
    arrays, index_of = _points(gmsh)
    names: dict[str, Any] = {"kinds": [], "volumes": [], "faces": [], "nodes": [], "notes": []}
    _add_volumes(gmsh, index_of, arrays, names)
    _add_faces(gmsh, index_of, arrays, names)
    _add_nodes(gmsh, index_of, arrays, names)
    return arrays, names


def _points(gmsh: Any) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The nodes, and the place of each node by its tag."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    index_of = np.full(int(tags.max(initial=0)) + 1, -1, np.int64)
    index_of[tags] = np.arange(tags.size)
    return {"points": coordinates.reshape(-1, 3)}, index_of


def _lines(gmsh: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The line elements of each curve group, by their ends, and the nodes of the groups of points and curves."""
    arrays, index_of = _points(gmsh)
    names: dict[str, Any] = {"lines": [], "nodes": []}
    for g, (group, members) in enumerate(_groups(gmsh, 1).items()):
        found = [np.zeros((0, 2), np.int64)]
        for kind in (int(kind) for kind in gmsh.model.mesh.getElementTypes(1)):
            size = gmsh.model.mesh.getElementProperties(kind)[3]
            blocks = [gmsh.model.mesh.getElementsByType(kind, tag)[1] for tag in members]
            found.append(index_of[np.concatenate(blocks)].reshape(-1, size)[:, :2])
        names["lines"].append(group)
        arrays[f"line_{g}"] = np.concatenate(found)
    _add_nodes(gmsh, index_of, arrays, names)
    return arrays, names


def _surfaces(gmsh: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """As `_lines`, and the corners of the faces of each surface group with the nodes of these groups."""
    arrays, names = _lines(gmsh)
    _, index_of = _points(gmsh)
    names["faces"] = []
    _add_faces(gmsh, index_of, arrays, names)
    _add_nodes(gmsh, index_of, arrays, names, dimensions=(2,))
    return arrays, names


def _add_volumes(gmsh: Any, index_of: np.ndarray, arrays: dict[str, np.ndarray], names: dict[str, Any]) -> None:
    """Elements by kind, and the members of each volume group as (kind, numbers within the kind)."""
    groups = _groups(gmsh, 3)
    entities = sorted({tag for members in groups.values() for tag in members})
    if len(entities) < len(gmsh.model.getEntities(3)):
        names["notes"].append("volumes in no physical group are left out, as gmsh does")
    numbers: dict[tuple[int, int], np.ndarray] = {}
    for k, kind in enumerate(int(kind) for kind in gmsh.model.mesh.getElementTypes(3)):
        blocks = [gmsh.model.mesh.getElementsByType(kind, tag)[1] for tag in entities]
        name, _, _, size, local, _ = gmsh.model.mesh.getElementProperties(kind)
        ends = np.cumsum([0, *(block.size // size for block in blocks)])
        numbers |= {(k, tag): np.arange(*ends[i : i + 2]) for i, tag in enumerate(entities)}
        arrays[f"cells_{k}"] = index_of[np.concatenate(blocks)].reshape(-1, size)
        arrays[f"local_{k}"] = np.reshape(local, (size, 3))
        names["kinds"].append(name)
    for g, (group, members) in enumerate(groups.items()):
        names["volumes"].append(group)
        for k in range(len(names["kinds"])):
            arrays[f"volume_{g}_{k}"] = np.concatenate([numbers[k, tag] for tag in members])


def _add_faces(gmsh: Any, index_of: np.ndarray, arrays: dict[str, np.ndarray], names: dict[str, Any]) -> None:
    """The corners of the faces of each surface group, triangles and quadrilaterals apart."""
    types = [int(kind) for kind in gmsh.model.mesh.getElementTypes(2)]
    for g, (group, members) in enumerate(_groups(gmsh, 2).items()):
        names["faces"].append(group)
        for corners in (3, 4):
            found = [np.zeros((0, corners), np.int64)]
            for kind in types:
                _, _, _, size, _, primary = gmsh.model.mesh.getElementProperties(kind)
                if primary == corners:
                    blocks = [gmsh.model.mesh.getElementsByType(kind, tag)[1] for tag in members]
                    found.append(index_of[np.concatenate(blocks)].reshape(-1, size)[:, :corners])
            arrays[f"face_{g}_{corners}"] = np.concatenate(found)


def _add_nodes(
    gmsh: Any,
    index_of: np.ndarray,
    arrays: dict[str, np.ndarray],
    names: dict[str, Any],
    dimensions: tuple[int, ...] = (0, 1),
) -> None:
    """The nodes of the physical groups of points and curves, or of other dimensions."""
    for dimension, tag in [pair for d in dimensions for pair in gmsh.model.getPhysicalGroups(d)]:
        nodes, _ = gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)
        names["nodes"].append(_physical_name(gmsh, dimension, tag))
        arrays[f"node_{len(names['nodes']) - 1}"] = index_of[nodes]


def _groups(gmsh: Any, dimension: int) -> dict[str, list[int]]:
    """Name -> entities: the physical groups; where there are none, every entity by its name in the file and its tag."""
    groups: dict[str, list[int]] = {}
    for _, tag in gmsh.model.getPhysicalGroups(dimension):
        name = _physical_name(gmsh, dimension, tag)
        groups.setdefault(name, []).extend(int(e) for e in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag))
    if groups:
        return groups
    for _, tag in gmsh.model.getEntities(dimension):
        groups[f"{('point', 'curve', 'surface', 'volume')[dimension]}_{tag}"] = [tag]
        name = _given_name(gmsh.model.getEntityName(dimension, tag))
        if name:
            groups.setdefault(name, []).append(tag)
    return groups


def _physical_name(gmsh: Any, dimension: int, tag: int) -> str:
    """Without the blanks that some formats fill names with."""
    return gmsh.model.getPhysicalName(dimension, tag).strip() or f"physical_{tag}"


def _given_name(path: str) -> str:
    """The last part of a CAD label such as "Shapes/rod/bore", unless the exporting program made it up."""
    name = path.rpartition("/")[2].strip()
    return "" if re.match(r"Open CASCADE STEP translator|COMPOUND$|SOLID$", name) else name


if __name__ == "__main__":
    sys.exit(main())
