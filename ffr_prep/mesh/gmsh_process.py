"""Gmsh in a process of its own: open a geometry or mesh file, mesh it, write plain arrays.

Run as  python gmsh_process.py JOB.json RESULT.npz.  Gmsh is a large native library that may crash or exit; here that
ends only this process. It runs on one thread, so the same file gives the same mesh bit for bit.

A job has: path, wanted ("lines", "surfaces", "solids", or "skin": the faces of solids with what they are), generate, unit,
size, numbers, order, most (elements), glue, solids (names of those to keep; all where there are none), overlaps (whether
the volumes that solids share are told).

Exit codes: 0 done, 2 the file cannot be read, 3 gmsh cannot be loaded, 4 meshing failed, 5 the job asks for what cannot be
meant, such as more elements than could be used. Messages are on stderr.

Source: C. Geuzaine, J.-F. Remacle, Int. J. Numer. Meth. Engng 79 (2009) 1309-1331; gmsh reference manual.
"""

from __future__ import annotations

import fnmatch
import json
import re
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

UNREADABLE, UNLOADABLE, UNMESHED, REFUSED = 2, 3, 4, 5

_HXT, _DELAUNAY = 10, 1
_FLAT = 1e-9
_TOUCHING = 1e-6  # of a solid's volume: what solids that touch share by rounding
_ELEMENTS_PER_TURN = 12
_FEW_FACES = 100
_LEAST = 1e-4  # of the extent: the finest elements along curves; at the tip of a cone their size would be none
_DIGITS = 12
_TETRAHEDRA_PER_CUBE = 8.5  # regular ones, of an edge like that of the cube
_MOST_ALONG = 2e4
_IGES = (".iges", ".igs")
_CAD = (".step", ".stp", ".brep", *_IGES)


NO_GROUP = "volumes in no physical group are left out, as gmsh does"


class RefusedError(Exception):
    """A request that cannot be meant; the message says why, and what to ask for."""


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
        _choose(gmsh, job)
        if job["generate"]:
            _generate(gmsh, job)
        arrays, names = _RESULTS[job["wanted"]](gmsh)
        if job["overlaps"]:
            names["overlaps"] = _overlaps(gmsh)
        if job["generate"]:
            arrays["points"] = _rounded(arrays["points"])
    except RefusedError as error:
        return _failed(error, REFUSED)
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
    if job["wanted"] == "skin":  # what is drawn is fine along its curves alone
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)  # names and colours
    gmsh.open(job["path"])
    if job["path"].lower().endswith(_CAD):
        low, high = np.split(np.array(gmsh.model.getBoundingBox(-1, -1)), 2)
        gmsh.option.setNumber("Mesh.MeshSizeMin", _LEAST * max(high - low))
    if job["wanted"] == "skin" and 0 < len(gmsh.model.getEntities(2)) <= _FEW_FACES:
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 2 * _ELEMENTS_PER_TURN)
    if not gmsh.model.getEntities():
        raise ValueError("nothing in it is a geometry or a mesh")


def _choose(gmsh: Any, job: dict[str, Any]) -> None:
    """Keep the solids that are asked for, and let those that touch share their faces, where that is asked for."""
    if job["solids"]:
        _keep(gmsh, job["solids"])
    solids = gmsh.model.occ.getEntities(3)
    if job["glue"] and len(solids) > 1:
        looks = [(gmsh.model.getEntityName(*solid), gmsh.model.getColor(*solid)) for solid in solids]
        _, pieces = gmsh.model.occ.fragment(solids[:1], solids[1:])
        gmsh.model.occ.synchronize()
        for (name, colour), of in zip(looks, pieces, strict=False):
            for piece in [piece for piece in of if piece[0] == 3]:
                gmsh.model.setEntityName(*piece, name)
                gmsh.model.setColor([piece], *colour)


def _keep(gmsh: Any, wanted: list[str]) -> None:
    """Remove all solids but those of these names, which may be patterns."""
    given, own = _given_names(gmsh, 3), _solid_names(gmsh)
    names = {tag: [f"volume_{tag}", given[tag], own[tag]] for tag in given}
    known = ", ".join(map(repr, own.values()))
    kept = {tag for tag, of in names.items() if any(fnmatch.fnmatchcase(one, word) for one in of for word in wanted)}
    for word in wanted:
        if not any(fnmatch.fnmatchcase(one, word) for of in names.values() for one in of):
            raise RefusedError(f"there is no solid {word!r}; there are: {known or 'none'}")
    others = [(3, tag) for tag in names if tag not in kept]
    if others:
        gmsh.model.occ.remove(others, recursive=True)
        gmsh.model.occ.synchronize()


def _check_size(gmsh: Any, job: dict[str, Any]) -> None:
    """Refuse a size that makes so many elements that no mesh would come of it."""
    size, most = job["size"], job["most"]
    if size is None or not gmsh.model.getEntities(2):
        return
    low, high = np.split(np.array(gmsh.model.getBoundingBox(-1, -1)), 2)
    extent, along = max(high - low), max(high - low) / size
    elements = _estimate(gmsh, job) / size ** (3 if job["wanted"] == "solids" else 2)
    if elements < most and along < _MOST_ALONG:
        return
    enough = size * max((elements / most) ** (1 / 3 if job["wanted"] == "solids" else 1 / 2), along / _MOST_ALONG)
    raise RefusedError(
        f"elements of size {size:g} would be far too many for a geometry of extent {extent:.5g}, some {elements:.1g}; both "
        f"are in the unit of the file{_metres(1e3 * size / extent)}. A size of {_up(enough)} makes {most:.3g} at most, which "
        "may be set (--most-elements)"
    )


def _metres(share: float) -> str:
    """A question where a thousand times the size would be a usual share of the extent."""
    return " (is the size in metres, and the file in millimetres?)" if 0.002 < share < 1 else ""


def _estimate(gmsh: Any, job: dict[str, Any]) -> float:
    """The number of elements of size one: what OpenCASCADE knows of volumes, or areas; else nothing."""
    if job["wanted"] == "solids":
        return float(
            _TETRAHEDRA_PER_CUBE * sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.occ.getEntities(3))
        )
    return float(2.3 * sum(gmsh.model.occ.getMass(2, tag) for _, tag in gmsh.model.occ.getEntities(2)))


def _up(size: float) -> float:
    """The next number of two digits."""
    step = 10.0 ** (np.floor(np.log10(size)) - 1)
    return float(f"{np.ceil(1.02 * size / step) * step:.3g}")


def _check_curves(gmsh: Any, job: dict[str, Any]) -> None:
    """Refuse what the curvature of many fine faces makes too many of: each has so many triangles to the turn."""
    triangles = 0.0
    for kind, tag in gmsh.model.occ.getEntities(2):
        radius = gmsh.model.getEntityProperties(kind, tag)[1][-1:]
        if gmsh.model.getType(kind, tag) in ("Cylinder", "Sphere", "Torus") and radius.size and radius[0] > 0:
            triangles += 2.3 * gmsh.model.occ.getMass(kind, tag) / (2 * np.pi * radius[0] / _ELEMENTS_PER_TURN) ** 2
    if triangles > job["most"]:
        raise RefusedError(
            f"its fine curves alone would make some {triangles:.1g} elements: simplify the geometry, or allow more than "
            f"{job['most']:.3g} (--most-elements)"
        )


def _generate(gmsh: Any, job: dict[str, Any]) -> None:
    """Mesh the volumes, the surfaces or the curves; the options set here win over those of a script."""
    dimension, lack = _NEEDS[job["wanted"]]
    if not gmsh.model.getEntities(dimension):
        raise ValueError(lack)
    _check_size(gmsh, job)
    if job["path"].lower().endswith(_CAD) and job["wanted"] != "lines":
        _check_curves(gmsh, job)
    if job["size"] is not None:
        gmsh.option.setNumber("Mesh.MeshSizeMax", job["size"])
        if job["path"].lower().endswith(_CAD):  # without sizes at points, gmsh takes a tenth of the diagonal
            gmsh.model.mesh.setSize(gmsh.model.getEntities(0), job["size"])
    gmsh.option.setNumber("Mesh.ElementOrder", job["order"])
    if job["wanted"] != "solids":
        gmsh.model.mesh.generate(min(dimension, 2))
        return
    if not gmsh.model.mesh.getElementTypes(3).size:
        gmsh.model.mesh.generate(3)
        if _has_flat_elements(gmsh):  # of which no optimisation makes anything
            gmsh.model.mesh.clear()
            gmsh.option.setNumber("Mesh.Algorithm3D", _DELAUNAY)
            gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(job["order"])
    if job["order"] == 2 and _smallest_jacobian(gmsh) <= 0:
        gmsh.model.mesh.optimize("HighOrder")


def _has_flat_elements(gmsh: Any) -> bool:
    """Whether there are tetrahedra whose corners span no volume, measured by the others."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 3))
    points[tags] = places.reshape(-1, 3)
    volumes = [np.ones(1)]
    for kind in gmsh.model.mesh.getElementTypes(3):
        _, _, _, size, _, primary = gmsh.model.mesh.getElementProperties(kind)
        if primary == 4:
            corners = points[gmsh.model.mesh.getElementsByType(kind)[1].reshape(-1, size)[:, :4]]
            volumes.append(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])))
    sizes = np.concatenate(volumes[1:] or volumes)
    return bool(sizes.min() <= _FLAT * np.median(sizes))


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
    _add_geometry(gmsh, index_of, arrays, names)
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


def _check_orders(gmsh: Any) -> None:
    """Refuse volumes of elements of both orders: gmsh lists those alone that are as the first of their shape, and gives the
    nodes of all as if they were, or crashes."""
    counted = sum(
        gmsh.option.getNumber(f"Mesh.Nb{shape}") for shape in ("Tetrahedra", "Hexahedra", "Prisms", "Pyramids")
    )
    listed = sum(len(of) for volume in gmsh.model.getEntities(3) for of in gmsh.model.mesh.getElements(*volume)[1])
    if listed < counted:
        raise RefusedError(
            "a volume has elements of first and of second order beside each other, which gmsh does not tell apart: save the "
            "mesh with elements of one order"
        )


def _add_volumes(gmsh: Any, index_of: np.ndarray, arrays: dict[str, np.ndarray], names: dict[str, Any]) -> None:
    """Elements by kind, and the members of each volume group as (kind, numbers within the kind)."""
    _check_orders(gmsh)
    groups = _groups(gmsh, 3)
    entities = sorted({tag for members in groups.values() for tag in members})
    if len(entities) < len(gmsh.model.getEntities(3)):
        names["notes"].append(NO_GROUP)
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


def _skin(gmsh: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The faces of the solids as triangles, what they are, and the mass properties of the solids at density one."""
    arrays, index_of = _points(gmsh)
    names: dict[str, Any] = {}
    _add_geometry(gmsh, index_of, arrays, names)
    known, given, meant = {tag for _, tag in gmsh.model.occ.getEntities(3)}, _given_names(gmsh, 3), _meant(gmsh)
    names["solids"] = [
        {
            "name": f"volume_{tag}",
            "label": given[tag],
            "volume": gmsh.model.occ.getMass(3, tag),
            "centre": list(gmsh.model.occ.getCenterOfMass(3, tag)),
            "inertia": list(gmsh.model.occ.getMatrixOfInertia(3, tag)),
        }
        for _, tag in gmsh.model.getEntities(3)
        if tag in known & meant
    ]
    names["left_out"] = len(known - meant)
    return arrays, names


def _meant(gmsh: Any) -> set[int]:
    """The solids in physical groups, or all where there are none."""
    return {tag for members in _groups(gmsh, 3).values() for tag in members}


def _overlaps(gmsh: Any) -> list[tuple[str, str, float]]:
    """Pairs of solids that share a volume, and that volume."""
    names, known = _solid_names(gmsh), [tag for _, tag in gmsh.model.occ.getEntities(3)]
    tags = [tag for tag in known if tag in _meant(gmsh)]
    boxes = {tag: np.array(gmsh.model.occ.getBoundingBox(3, tag)).reshape(2, 3) for tag in tags}
    found = []
    for k, one in enumerate(tags):
        for other in tags[k + 1 :]:
            low, high = np.maximum(boxes[one][0], boxes[other][0]), np.minimum(boxes[one][1], boxes[other][1])
            if (low < high).all() and (volume := _shared(gmsh, one, other)) > 0:
                found.append((names[one], names[other], volume))
    return found


def _shared(gmsh: Any, one: int, other: int) -> float:
    """The volume that two solids share; 0 of those that only touch."""
    try:
        both, _ = gmsh.model.occ.intersect([(3, one)], [(3, other)], removeObject=False, removeTool=False)
    except Exception:  # gmsh raises nothing more specific, where nothing is shared
        return 0.0
    volume = sum(gmsh.model.occ.getMass(*piece) for piece in both if piece[0] == 3)
    gmsh.model.occ.remove(both, recursive=True)
    least = min(gmsh.model.occ.getMass(3, tag) for tag in (one, other))
    return float(volume) if volume > _TOUCHING * least else 0.0


def _add_geometry(gmsh: Any, index_of: np.ndarray, arrays: dict[str, np.ndarray], names: dict[str, Any]) -> None:
    """The faces of the solids that are drawn and not only meshed: their kind, numbers, names, colour and corners."""
    names["geometry"], solid_names, meant = [], _solid_names(gmsh), _meant(gmsh)
    known = {tag for _, tag in gmsh.model.occ.getEntities(2)}
    drawn = [tag for _, tag in gmsh.model.getEntities(2) if gmsh.model.getType(2, tag) != "Discrete surface"]
    types = [
        (int(kind), gmsh.model.mesh.getElementProperties(int(kind))) for kind in gmsh.model.mesh.getElementTypes(2)
    ]
    for tag in drawn:
        solids = [int(solid) for solid in gmsh.model.getAdjacencies(2, tag)[0] if solid in meant]
        if not solids:
            continue
        groups = [_physical_name(gmsh, 2, int(group)) for group in gmsh.model.getPhysicalGroupsForEntity(2, tag)]
        red, green, blue, alpha = gmsh.model.getColor(2, tag)
        face = len(names["geometry"])
        names["geometry"].append(
            {
                "name": f"surface_{tag}",
                "kind": gmsh.model.getType(2, tag).lower(),
                "numbers": [float(x) for x in gmsh.model.getEntityProperties(2, tag)[1]],
                "exact": [gmsh.model.occ.getMass(2, tag), *gmsh.model.occ.getCenterOfMass(2, tag)]
                if tag in known
                else [],
                "label": _given_name(gmsh.model.getEntityName(2, tag)),
                "colour": f"#{red:02x}{green:02x}{blue:02x}" if alpha else "",
                "groups": groups,
                "solids": [solid_names[s] for s in solids],
            }
        )
        for corners in (3, 4):
            found = [np.zeros((0, corners), np.int64)]
            for kind, (_, _, _, size, _, primary) in types:
                if primary == corners:
                    nodes = gmsh.model.mesh.getElementsByType(kind, tag)[1]
                    found.append(index_of[nodes].reshape(-1, size)[:, :corners])
            arrays[f"geometry_{face}_{corners}"] = np.concatenate(found)


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
    one_by_one = _solid_names(gmsh) if dimension == 3 else {}
    for tag, name in _given_names(gmsh, dimension).items():
        groups[f"{('point', 'curve', 'surface', 'volume')[dimension]}_{tag}"] = [tag]
        if name:
            groups.setdefault(name, []).append(tag)
            groups[one_by_one.get(tag, name)] = groups.get(one_by_one.get(tag, name), [tag])
    return groups


def _given_names(gmsh: Any, dimension: int) -> dict[int, str]:
    """The name that the file has for each entity, or "", by its tag."""
    return {
        int(tag): _given_name(gmsh.model.getEntityName(dimension, tag)) for _, tag in gmsh.model.getEntities(dimension)
    }


def _solid_names(gmsh: Any) -> dict[int, str]:
    """A name for each solid that no other has: the file's, numbered where several share it ("pin#2"), or its tag."""
    given = _given_names(gmsh, 3)
    shared = {name for name in given.values() if list(given.values()).count(name) > 1}
    found, seen = {}, dict.fromkeys(shared, 0)
    for tag, name in given.items():
        if name in seen:
            seen[name] += 1
        found[tag] = f"{name}#{seen[name]}" if name in shared and name else name or f"volume_{tag}"
    return found


def _physical_name(gmsh: Any, dimension: int, tag: int) -> str:
    """Without the blanks that some formats fill names with."""
    return gmsh.model.getPhysicalName(dimension, tag).strip() or f"physical_{tag}"


def _given_name(path: str) -> str:
    """The last part of a CAD label such as "Shapes/rod/bore", unless the exporting program made it up."""
    name = path.rpartition("/")[2].strip()
    with suppress(UnicodeError):  # programs built on OpenCASCADE write the bytes of UTF-8 as letters
        name = name.encode("latin-1").decode("utf-8")
    return "" if re.match(r"Open CASCADE STEP translator|COMPOUND$|SOLID$", name) else name


_RESULTS = {"lines": _lines, "surfaces": _surfaces, "solids": _result, "skin": _skin}
_NEEDS = {
    "lines": (1, "the geometry has no curves: draw the axes of the beams"),
    "surfaces": (2, "the geometry has no surfaces: draw the plates as surfaces"),
    "solids": (3, "the geometry has no volume, only surfaces or curves: make it a solid"),
    "skin": (3, "the geometry has no volume, only surfaces or curves: make it a solid"),
}

if __name__ == "__main__":
    sys.exit(main())
