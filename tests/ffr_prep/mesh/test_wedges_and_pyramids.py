"""Wedges and pyramids: their functions, beside tetrahedra and hexahedra, and as gmsh and other programs write them."""

from __future__ import annotations

from pathlib import Path

import gmsh
import meshio
import numpy as np
import pytest
from boxes import STEEL, box_mesh

import ffr_prep as fp
from ffr_prep.mesh.cells import KINDS as TABLE
from ffr_prep.mesh.mesh import Block, Mesh, check_mesh, read_mesh
from ffr_prep.mesh.shapes import local_order, quadrature, shape_functions
from ffr_prep.solids.assembly import MASS_ORDER, assemble

OWN = ("wedge6", "wedge15", "wedge18", "pyramid5", "pyramid13")
INSIDE = np.array([[0.2, 0.3, 0.25], [0.3, 0.15, 0.3], [0.1, 0.3, 0.2]])  # columns
SIZE = np.array([0.6, 0.4, 0.2])


def functions(kind: str, X: np.ndarray) -> np.ndarray:
    """(k, p) values at X (3, p), in the order of the table."""
    element = shape_functions(kind)
    values = [np.broadcast_to(element.lbasis(X, i)[0], X.shape[1]) for i in range(TABLE[kind].size)]
    return np.array(values)[local_order(kind)]


@pytest.mark.parametrize("kind", OWN)
def test_functions_are_one_at_their_node_and_add_up_to_one(kind):
    np.testing.assert_allclose(functions(kind, TABLE[kind].nodes.T), np.eye(TABLE[kind].size), atol=1e-14)
    np.testing.assert_allclose(functions(kind, INSIDE).sum(axis=0), 1, atol=1e-14)
    np.testing.assert_allclose(TABLE[kind].nodes.T @ functions(kind, INSIDE), INSIDE, atol=1e-14)


@pytest.mark.parametrize("kind", ["wedge15", "wedge18", "pyramid13"])
def test_functions_of_second_order_hold_quadratic_fields(kind):
    nodes = TABLE[kind].nodes.T
    for a, b in ((0, 0), (0, 1), (1, 2), (2, 2)):
        np.testing.assert_allclose((nodes[a] * nodes[b]) @ functions(kind, INSIDE), INSIDE[a] * INSIDE[b], atol=1e-14)


@pytest.mark.parametrize("kind", OWN)
def test_gradients_are_the_differences_of_the_functions(kind):
    element, h = shape_functions(kind), 1e-6
    for i in range(TABLE[kind].size):
        for axis, step in enumerate(h * np.eye(3)[:, :, None]):
            difference = (element.lbasis(INSIDE + step, i)[0] - element.lbasis(INSIDE - step, i)[0]) / (2 * h)
            np.testing.assert_allclose(element.lbasis(INSIDE, i)[1][axis], difference, atol=1e-9)


def test_the_rules_integrate_polynomials():
    """Of x y z over the wedge, 1/24 1/2; of z^4 over the pyramid, the integral of z^4 (1 - z)^2."""
    X, weights = quadrature("wedge15", MASS_ORDER["wedge15"])
    assert weights @ (X[0] * X[1] * X[2]) == pytest.approx(1 / 48, rel=1e-13)
    X, weights = quadrature("pyramid13", MASS_ORDER["pyramid13"])
    assert weights @ X[2] ** 4 == pytest.approx(1 / 105, rel=1e-13)


# ---- beside one another -------------------------------------------------------------------------------------------


def mixed(order: int) -> Mesh:
    """Three cubes side by side: a hexahedron, six pyramids, two wedges."""
    kinds = {1: ("hex8", "pyramid5", "wedge6"), 2: ("hex20", "pyramid13", "wedge15")}[order]
    parts = [box_mesh(kind, (1, 1, 1), (1, 1, 1), origin=(float(k), 0, 0)) for k, kind in enumerate(kinds)]
    points, blocks = np.zeros((0, 3)), []
    for part in parts:
        blocks.append(Block(part.blocks[0].kind, part.blocks[0].nodes + len(points)))
        points = np.vstack([points, part.points])
    unique, index = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    return Mesh(unique, tuple(Block(b.kind, index.ravel()[b.nodes]) for b in blocks), {}, {}, {})


@pytest.mark.parametrize("order", [1, 2])
def test_elements_of_several_kinds_fit_together(order):
    """The patch test: under the displacements of a constant strain on its surface the inside takes them, too."""
    mesh = mixed(order)
    check_mesh(mesh)
    warped = mesh.points + 0.1 * np.sin(3 * mesh.points[:, [1, 2, 0]]) * (order == 1)
    mesh = Mesh(warped, mesh.blocks, {}, {}, {})
    K = assemble(mesh, STEEL).K.toarray()
    strain = np.array([[1.0, 0.3, -0.2], [0.3, -0.5, 0.4], [-0.2, 0.4, 0.7]])
    u = (mesh.points @ strain).ravel()
    inside = np.array([np.abs(p - 0.5).max() < 0.4 for p in mixed(order).points - [[1, 0, 0]]]).repeat(3)
    assert inside.any()
    found = np.linalg.solve(K[np.ix_(inside, inside)], -K[np.ix_(inside, ~inside)] @ u[~inside])
    np.testing.assert_allclose(found, u[inside], atol=1e-12)


@pytest.mark.parametrize("kind", ["wedge15", "wedge18", "pyramid13"])
def test_a_cantilever_of_second_order_elements_bends_like_one_of_hexahedra(kind):
    def lowest(of: str) -> float:
        mesh = box_mesh(of, (1.0, 0.1, 0.1), (6, 1, 1))
        model = fp.from_mesh(mesh, STEEL, [fp.InterfaceRegion("left")])
        return fp.reduce(
            model, fp.Request(name="rod", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(2))
        ).frequencies[0]

    assert lowest(kind) == pytest.approx(lowest("hex20"), rel=1e-2)


# ---- files --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def prisms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box of wedges along z, written by gmsh: folder of wedge6.*, wedge15.* and wedge18.msh."""
    folder = tmp_path_factory.mktemp("prisms")
    for kind in ("wedge6", "wedge15", "wedge18"):
        gmsh.initialize(["gmsh"], readConfigFiles=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(kind == "wedge15"))
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
        sheet = gmsh.model.occ.addRectangle(0, 0, 0, SIZE[0], SIZE[1])
        made = gmsh.model.occ.extrude([(2, sheet)], 0, 0, SIZE[2], numElements=[2], recombine=True)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [made[1][1]], name="box")
        gmsh.model.addPhysicalGroup(2, [made[0][1]], name="top")
        gmsh.model.addPhysicalGroup(2, [made[2][1]], name="side")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(1 if kind == "wedge6" else 2)
        for suffix in ("msh", "inp", "bdf", "unv", "med") if kind != "wedge18" else ("msh",):
            gmsh.write(str(folder / f"{kind}.{suffix}"))
        gmsh.finalize()
    return folder


def assert_is_the_prism(mesh: Mesh, kind: str) -> None:
    assert [block.kind for block in mesh.blocks] == [kind]
    check_mesh(mesh)
    m = assemble(mesh, STEEL).m
    assert m.sum() == pytest.approx(STEEL.rho * SIZE.prod(), rel=1e-9)
    second = STEEL.rho * SIZE.prod() * (np.diag(SIZE**2 / 12) + np.outer(SIZE, SIZE) / 4)
    np.testing.assert_allclose(mesh.points.T @ (m @ mesh.points), second, rtol=1e-9)


@pytest.mark.parametrize(
    "name", ["wedge18.msh", *(f"wedge{n}.{end}" for n in (6, 15) for end in ("msh", "inp", "bdf", "unv", "med"))]
)
def test_wedges_of_files_that_gmsh_wrote(prisms, name):
    mesh = read_mesh(prisms / name)
    assert_is_the_prism(mesh, name.partition(".")[0])
    if name.endswith((".msh", ".inp", ".med")):
        top, side = (np.unique(np.concatenate([f.ravel() for f in mesh.face_groups[g]])) for g in ("top", "side"))
        np.testing.assert_allclose(mesh.points[top][:, 2], SIZE[2])
        assert len(np.unique(mesh.points[side][:, 2])) == (3 if name.startswith("wedge6") else 5)


def test_wedges_of_vtk_are_read_either_way_up(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], float)
    for name, nodes in (("up", [0, 1, 2, 3, 4, 5]), ("down", [3, 4, 5, 0, 1, 2])):
        meshio.Mesh(points, [("wedge", [nodes])]).write(tmp_path / f"{name}.vtu")
    up, down = (read_mesh(tmp_path / f"{name}.vtu") for name in ("up", "down"))
    np.testing.assert_array_equal(up.blocks[0].nodes, down.blocks[0].nodes)
    check_mesh(up)


def grids(points: np.ndarray) -> str:
    return "".join(f"GRID,{k + 1},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(points.tolist()))


@pytest.mark.parametrize(
    ("card", "kind", "order"),
    [  # MSC Nastran Quick Reference Guide: edges below, between, above
        ("CPENTA", "wedge15", [*range(9), *range(12, 15), *range(9, 12)]),
        ("CPYRAM", "pyramid13", range(13)),
        ("CPENTA", "wedge6", range(6)),
        ("CPYRAM", "pyramid5", range(5)),
    ],
)
def test_bulk_data_of_wedges_and_pyramids(tmp_path, card, kind, order):
    points = TABLE[kind].nodes[list(order)]
    words = [card, "1", "7", *(str(k + 1) for k in range(len(points)))]
    lines = [",".join(words[:9]), *(",".join(["", *words[k : k + 8]]) for k in range(9, len(words), 8))]
    (tmp_path / "a.bdf").write_text("BEGIN BULK\n" + grids(points) + "\n".join(lines) + "\nENDDATA\n")
    mesh = read_mesh(tmp_path / "a.bdf")
    assert mesh.blocks[0].kind == kind
    np.testing.assert_allclose(mesh.points[mesh.blocks[0].nodes[0]], TABLE[kind].nodes, atol=1e-15)


@pytest.mark.parametrize(("kind", "side", "corners"), [  # Abaqus Analysis User's Guide, three-dimensional solid elements
    ("C3D6", "S2", (3, 5, 4)), ("C3D15", "S3", (0, 3, 4, 1)), ("C3D6", "S5", (2, 5, 3, 0)),
    ("C3D5", "S1", (0, 1, 2, 3)), ("C3D13", "S4", (2, 4, 3)),
])  # fmt: skip
def test_sides_of_wedges_and_pyramids_in_abaqus_files(tmp_path, kind, side, corners):
    ours = {"C3D6": "wedge6", "C3D15": "wedge15", "C3D5": "pyramid5", "C3D13": "pyramid13"}[kind]
    points = TABLE[ours].nodes
    nodes = "".join(f"{k + 1}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(points.tolist()))
    numbers = ", ".join(str(k + 1) for k in range(len(points)))
    surface = f"*SURFACE, NAME=side\n1, {side}\n"
    (tmp_path / "a.inp").write_text(f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=all\n1, {numbers}\n{surface}")
    mesh = read_mesh(tmp_path / "a.inp", unit="m")
    (faces,) = mesh.face_groups["side"]
    assert set(faces[0].tolist()) & set(range(TABLE[ours].corners)) == set(corners)


def test_wedges_of_a_result_file_of_calculix(tmp_path):
    """Its edges stand as in he20: below, between, above (CalculiX GraphiX user's manual, Result Format)."""
    points = TABLE["wedge15"].nodes[[*range(9), *range(12, 15), *range(9, 12)]]
    nodes = "".join(f" -1{k + 1:10d}" + "".join(f"{x:12.5E}" for x in p) + "\n" for k, p in enumerate(points))
    first, second = ("".join(f"{k + 1:10d}" for k in range(*of)) for of in ((0, 10), (10, 15)))
    (tmp_path / "a.frd").write_text(
        f"    1C\n    2C{15:30d}{'1':>38s}\n{nodes} -3\n    3C{1:30d}{'1':>38s}\n"
        f" -1{1:10d}{5:5d}{0:5d}{1:5d}\n -2{first}\n -2{second}\n -3\n 9999\n"
    )
    mesh = read_mesh(tmp_path / "a.frd")
    assert mesh.blocks[0].kind == "wedge15"
    np.testing.assert_allclose(mesh.points[mesh.blocks[0].nodes[0]], TABLE["wedge15"].nodes, atol=1e-6)
