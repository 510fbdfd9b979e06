"""What is said of meshes, of the files that they come from, of geometries and of regions of them."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from prep_remedy import box, edited, rewritten, with_files, words
from said import Case

import ffr_prep as fp
from ffr_prep.mesh import gmsh_files, gmsh_process
from ffr_prep.mesh.geometry.skin import with_regions
from ffr_prep.mesh.gmsh_files import _check_geometry, mesh_from_gmsh
from ffr_prep.mesh.mesh import check_mesh, face_group, read_mesh
from ffr_prep.mesh.time_limit import mesher_time_limit
from ffr_prep.pipelines.file_materials import file_materials
from ffr_prep.structures.frame import Frame

p = partial
PLAIN = box()
HEX = PLAIN.blocks[0].nodes


def changed(**how: object) -> Case:
    return Case(p(check_mesh, replace(PLAIN, **how)), p(check_mesh, PLAIN))


def moved(node: int, at: object) -> np.ndarray:
    points = PLAIN.points.copy()
    points[node] = at
    return points


def blocks(nodes: np.ndarray, kind: str = "hex8") -> tuple[fp.Block, ...]:
    return (fp.Block(kind, nodes),)


TWO = np.vstack([PLAIN.points, PLAIN.points + 3])
SEAM = np.vstack([PLAIN.points, PLAIN.points[4:8]])
OPENED = HEX.copy()
OPENED[1] = np.where((HEX[1] >= 4) & (HEX[1] < 8), HEX[1] + 8, HEX[1])
HINGED = np.vstack([PLAIN.points, PLAIN.points + np.array((1.0, 0.2, 0.1))])
AT_CORNER = np.where(HEX + 12 == 12, 11, HEX + 12)
CENTRE = PLAIN.points[HEX[0]].mean(axis=0)
FOLDED = np.vstack([PLAIN.points, CENTRE + 0.3 * (PLAIN.points[HEX[0][4:]] - CENTRE)])
TWICE = np.concatenate([HEX[0][:4], len(PLAIN.points) + np.arange(4)])
MESHES = [
    changed(points=FOLDED, blocks=blocks(np.vstack([HEX, TWICE]))),
    changed(blocks=()),
    changed(blocks=blocks(HEX, "hex9")),
    changed(points=moved(0, np.nan)),
    changed(blocks=blocks(HEX + 3)),
    changed(points=TWO),
    changed(volume_groups={"a": np.zeros(0, int)}),
    changed(blocks=blocks(HEX[[0, 0, 1]])),
    changed(blocks=blocks(np.vstack([HEX[0][[0, 1, 3, 3, 4, 5, 7, 7]], HEX[1]]))),
    changed(points=moved(0, PLAIN.points[11])),
    changed(points=PLAIN.points * [1, 1, -1]),
    changed(points=SEAM, blocks=blocks(OPENED)),
    changed(points=TWO, blocks=blocks(np.vstack([HEX, HEX + 12]))),
    changed(points=np.delete(HINGED, 12, axis=0), blocks=blocks(np.vstack([HEX, AT_CORNER - (AT_CORNER > 12)]))),
]  # fmt: skip


def mesh(**how: object) -> object:
    return with_files(lambda: check_mesh(read_mesh("block.inp", **how)), {})


def shown(line: str, right: str = "mesh block.inp") -> Case:
    return words(line, right)


def of(name: str, *changes: tuple[str, str]) -> Case:
    return edited(read_mesh, name, *changes)


def materials(path: Path) -> object:
    return file_materials(path, read_mesh(path))


def limited(seconds: float) -> None:
    with mesher_time_limit(seconds):
        pass


REQUESTS = [
    Case(p(mesh, unit="yd"), p(mesh, unit="mm")),
    Case(p(mesh, size=3.0), mesh),
    Case(p(mesh, size=-3.0), mesh),
    Case(p(mesh, order=3), mesh),
    Case(p(mesh, order=2), mesh),
    Case(p(mesh, numbers={"w": 1.0}), mesh),
    Case(p(mesh, glue=True), mesh),
    Case(p(mesh, most_elements=0.0), mesh),
    Case(p(limited, -1.0), p(limited, 600.0)),
]
FRD_HEAD = f"    2C{4:30}{1:38}"
DECKS = [
    of("block.inp", ("*NODE", "*NGEN\n1, 3, 1\n*NODE")),
    of("block.inp", ("*NODE", "*NODE, SYSTEM=C")),
    of("block.inp", ("1, 0.0", "1, zero")),
    of("block.inp", ("1, 0.0", "2, 0.0")),
    of("block.inp", ("C3D8, ELSET=ALL\n1, 1,", "C3D8, ELSET=ALL\n1, 99,")),
    of("block.inp", ("C3D8, ELSET=ALL\n1, 1,", "C3D8, ELSET=ALL\n2, 1,")),
    of("block.inp", ("*NODE", "*INCLUDE, INPUT=block.inp\n*NODE")),
    of("block.inp", ("*NODE", "*INSTANCE, NAME=a, PART=p\n*INSTANCE, NAME=b, PART=p\n*NODE")),
    of("block.inp", ("*NODE", "*INSTANCE, NAME=a, PART=p\n1., 0., 0.\n0, 0, 0, 0, 0, 0, 90.\n*NODE")),
    of("block.inp", ("TYPE=C3D8", "TYPE=C3D15V")),
    of("block.inp", ("TYPE=C3D8", "TYPE=B31")),
    rewritten(
        read_mesh,
        "fields.bdf",
        (("BEGIN BULK\n", "BEGIN BULK\n,7\n"),),
        (),
    ),
    of("fields.bdf", ("GRID,4,", "GRID,x,")),
    rewritten(read_mesh, "fields.bdf", (("", "/batch\n"),), ()),
    of("fields.bdf", ("GRID,4,", "=,4,")),
    of("fields.bdf", ("1.+0\n", "1.+0,,,,9\n")),
    of("fields.bdf", ("BEGIN BULK\n", "BEGIN BULK\nGRID,90,,0.,0.,5.,,,,+A\n+B,7\n")),
    of("fields.bdf", ("1.+0", "one")),
    of("fields.bdf", ("GRID,4,", "GRID,2,")),
    of("fields.bdf", ("BEGIN BULK", "BEGIN BULK\nINCLUDE 'fields.bdf'")),
    of("fields.bdf", ("       4\nSET1", "\nSET1")),
    of("fields.bdf", ("       4\nSET1", "       9\nSET1")),
    of("fields.bdf", ("GRID,4,,", "GRID,4,7,")),
    of("fields.bdf", (",1.,0.,0.\n", ",0.,0.,2.\n")),
    of("mesh.frd", (" -1         1 0.00000E+00", " -1         1 zero        ")),
    of("mesh.frd", (" -2         1", " -2         9")),
    of("mesh.frd", (FRD_HEAD, FRD_HEAD[:-1] + "2")),
    of("mesh.frd", (" -1         1    3", " -1         1    2")),
    of("mesh.cdb", ("NBLOCK", "NODES")),
    of("mesh.cdb", ("ET,1,185", "KEYOPT,1,2")),
    of("mesh.cdb", ("(19i9)", "(free)")),
    of("mesh.cdb", ("       9        9        9        9", "       9        9        9        5")),
    of("mesh.cdb", ("       9        9        9        9", "       9        9        9        0")),
    of("mesh.cdb", ("       9        9        9        9", "      77       77       77       77")),
    of("mesh.vtu", ("VTKFile", "VTK")),
    of("mesh.mesh", ("MeshVersionFormatted", "Formatted")),
    of("mesh.mesh", ("Dimension 3", "Dimension 2"), ("Vertices", "Vertex")),
    of("mesh.mesh", ("Dimension 3", "Dimension three")),
    of("mesh.mesh", ("Dimension 3", "Dimension 3000000000000000")),
    of("mesh.mesh", ("\nVertices\n", "\nVertices\n1")),
    of("mesh.mesh", ("\nTetrahedra\n6\n1", "\nTetrahedra\n6\n99")),
]  # fmt: skip
NINE = (
    "*ELASTIC\n2.1e11, 0.3",
    "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1.2e10, 8e8, 5e8, .4, .3, .3, 7e8, 7e8\n8e7",
)
TURNED = "*INSTANCE, NAME=a, PART=p\n0., 0., 0.\n0, 0, 0, 0, 0, 1, 90.\n"
MATERIALS = [
    edited(materials, "block.inp", ("MATERIAL=STEEL", "MATERIAL=BRASS")),
    edited(materials, "block.inp", ("2.1e11", "2.1e5")),
    edited(materials, "block.inp", ("*DENSITY\n7850.\n", "")),
    edited(materials, "block.inp", ("SECTION, ELSET", "SECTION, ORIENTATION=o, ELSET"), NINE),
    edited(materials, "block.inp", ("*NODE", f"{TURNED}*NODE"), NINE),
    edited(materials, "block.inp", ("*ELASTIC", "*ELASTIC, TYPE=LAMINA")),
    edited(materials, "block.inp", ("2.1e11", "stiff")),
    edited(materials, "block.inp", ("*DENSITY\n7850.\n", "*DENSITY\n7850.\n*DENSITY\n7800.\n")),
    edited(materials, "block.inp", ("7850.", "7850\0")),
    Case(
        lambda: with_files(lambda: file_materials("mesh.vtu", read_mesh("mesh.vtu")), {}),
        lambda: with_files(lambda: materials(Path("block.inp")), {}),
    ),
]

# ---- geometries ------------------------------------------------------------------------------------------------------

MESHED = "mesh part.geo --size 1 --order 1"


def crowded() -> object:
    """A mesh where no folder has room for temporary files."""
    with patch("tempfile.TemporaryDirectory", side_effect=OSError(28, "No space left on device")):
        read_mesh("part.geo", size=1.0)


GEOMETRIES = [
    Case(
        lambda: with_files(lambda: crowded(), {}),
        lambda: with_files(lambda: read_mesh("part.geo", size=1.0, order=1), {}),
    ),
    shown(f"{MESHED} --glue", MESHED),
    shown("mesh table.csv"),
    words("mesh other.step", MESHED, other_step="no STEP\n"),
    words(f"{MESHED} --set width=3", f"{MESHED} --set w=0.3"),
    words("mesh bad.geo", MESHED, bad_geo="Box(1) = {0, 0, 0, 1, 1, 1};"),
    words("mesh bad.geo", MESHED, bad_geo="Box(1) = {0, 0;\n"),
    words("mesh bad.geo", MESHED, bad_geo='Merge "other.iges";\n'),
]

# ---- regions ---------------------------------------------------------------------------------------------------------


def found(query: str, right: str = "plane x=1") -> Case:
    return words(f"faces block.inp --find '{query}'", f"faces block.inp --find '{right}'")


REGIONS = [
    found("plane x=1+"),
    found("surface_4..1", "patch_1..4"),
    found("nearest 1,0", "nearest 1,0.1,0.05"),
    found("plane x=1 hot"),
    found("plane x=1 x=1"),
    found("plane normal=0,0,0", "plane normal=1,0,0 x=1"),
    found("cylinder r=1kg at 0,0,0"),
    found("patsh*", "patch*"),
    found("patsh_1", "patch_1"),
    found("plane x=2"),
    found("plane x=1e12"),
    found("nearest 0,0,0", "patch_1"),
    found("plane", "all plane"),
    found("nearest 900,0,0", "nearest 1,0.1,0.05"),
]

# ---- regions of nodes ------------------------------------------------------------------------------------------------


def frame() -> Frame:
    from matrix_models import rod

    return rod(fp.rectangle(0.02, 0.05), 1.0, 2)


def at_nodes(query: str) -> object:
    return fp.from_frame(frame(), [fp.InterfaceRegion("a", query)])


NODES = [
    Case(p(at_nodes, query), p(at_nodes, "nearest 1,0,0"))
    for query in ("tpi", "sphere r=1", "plane x=0.3", "nearest 9,0,0", "nearest 0.25,0,0")
]

# ---- failures of meshers and readers ---------------------------------------------------------------------------------

STEP = Path(__file__).resolve().parents[3] / "meshes" / "link.step"
IGES = f"{'a part':72}S      1\n"


def mesher(code: int = 0, error: Exception | None = None) -> object:
    """What is said of a process of gmsh that ends so."""
    done = subprocess.CompletedProcess([], code, "", "killed")
    with patch.object(gmsh_files, "finished", side_effect=error, return_value=done):
        return with_files(lambda: mesh_from_gmsh(Path("mesh.msh")), {})


def cad(name: str, text: str, unit: str | None) -> object:
    return with_files(lambda: _check_geometry(Path(name), unit, {}), {name: (("", text),)})


def meshed(name: str) -> object:
    return with_files(lambda: mesh_from_gmsh(Path(name)), {})


SOUND = p(meshed, "mesh.msh")
SOLIDS = replace(
    PLAIN,
    points=TWO,
    blocks=blocks(np.vstack([HEX, HEX + 12])),
    volume_groups={"one": np.arange(2), "two": np.arange(2, 4)},
    drawn=((None, ()),),
)


def su2(dimension: int = 3, last: int = 3) -> object:
    """A tetrahedron in a file of another program that meshio reads."""
    corners = "\n".join(" ".join(place[:dimension]) for place in ("000", "100", "010", "001"))
    text = f"NDIME= {dimension}\nNELEM= 1\n10 0 1 2 {last}\nNPOIN= 4\n{corners}\nNMARK= 0\n"
    return with_files(lambda: read_mesh("a.su2"), {"a.su2": (("", text),)})


def stepped(query: str) -> object:
    """The region of a block with a step."""
    whole = box("hex8", (2, 2, 1))
    nodes = np.delete(whole.blocks[0].nodes, -1, axis=0)
    used, numbers = np.unique(nodes, return_inverse=True)
    return with_regions(fp.Mesh(whole.points[used], blocks(numbers.reshape(nodes.shape)), {}, {}, {}), [query])


FAILURES = [
    Case(p(mesher, gmsh_process.UNLOADABLE), SOUND),
    Case(p(mesher, -9), SOUND),
    Case(p(mesher, error=subprocess.TimeoutExpired("gmsh", 600)), SOUND),
    Case(p(meshed, "table.csv"), SOUND),
    Case(p(cad, "a.igs", IGES, "m"), p(cad, "a.igs", IGES, None)),
    Case(p(_check_geometry, STEP, "m", {}), p(_check_geometry, STEP, None, {})),
    Case(p(check_mesh, SOLIDS), p(check_mesh, PLAIN)),
    of("block.inp", ("1, 0.0", "1, 1e40")),
    Case(p(su2, 2), su2),
    Case(p(su2, last=9), su2),
    Case(p(stepped, "plane normal=0,1,0"), p(stepped, "all plane normal=0,1,0")),
    Case(p(face_group, PLAIN, "lid"), p(face_group, PLAIN, "top")),
]
CASES = FAILURES + MESHES + REQUESTS + DECKS + MATERIALS + GEOMETRIES + REGIONS + NODES
