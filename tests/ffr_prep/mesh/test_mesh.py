"""Meshes: element tables, groups, boundary, reading of formats, gmsh in its process, checks."""

import textwrap
from dataclasses import replace

import gmsh
import meshio
import numpy as np
import pytest
from boxes import KINDS, PLAIN, STEEL, box_mesh, moved, rotation
from places import MESHES

from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.mesh import gmsh_files as gmsh_source
from ffr_prep.mesh.cells import FACE_TRIANGLES, node_order
from ffr_prep.mesh.cells import KINDS as TABLE
from ffr_prep.mesh.mesh import (
    Block,
    Mesh,
    boundary_faces,
    check_mesh,
    face_group,
    mesh_hash,
    misfit_doubts,
    read_mesh,
    region_nodes,
    surface_triangles,
)
from ffr_prep.mesh.shapes import jacobian_determinants
from ffr_prep.mesh.time_limit import mesher_time_limit
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.model import mesh_warnings

SIZE = np.array([2.0, 0.3, 0.2])
CELLS = (3, 2, 2)
MESHIO = {"tet4": "tetra", "tet10": "tetra10", "hex8": "hexahedron", "hex20": "hexahedron20", "hex27": "hexahedron27"}
MESHIO |= {"wedge6": "wedge", "wedge18": "wedge18", "pyramid5": "pyramid"}
MESHIO_FACE = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"}


def volume(mesh):
    """Sum of the consistent mass at unit density [m^3]."""
    return assemble(mesh, replace(STEEL, rho=1.0)).m.sum()


def enclosed(points, triangles):
    """Volume inside closed triangles, by the divergence theorem."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def assert_nodes_in_order(mesh):
    """Further nodes are the means of their corners, as they are in straight elements."""
    for block in mesh.blocks:
        of = mesh.points[block.nodes]
        for k, corners in enumerate(TABLE[block.kind].means):
            mean = of[:, list(corners)].mean(axis=1)
            np.testing.assert_allclose(of[:, TABLE[block.kind].corners + k], mean, atol=1e-6 * SIZE.max())


def assert_is_the_box(mesh, kind, left, right):
    """The box of SIZE and CELLS with its two end faces as groups of these names."""
    assert [block.kind for block in mesh.blocks] == [kind]
    check_mesh(mesh)
    assert_nodes_in_order(mesh)
    assert volume(mesh) == pytest.approx(SIZE.prod(), rel=1e-6)
    for name, x in ((left, 0.0), (right, SIZE[0])):
        (faces,) = face_group(mesh, name)
        assert len(faces) == (8 if kind.startswith("tet") else 4)
        np.testing.assert_allclose(mesh.points[faces][..., 0], x, atol=1e-6)
        corners = mesh.points[faces][:, :3]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.sign(normals[:, 0]) == (1 if x else -1)).all()


# ---- element tables -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_faces_point_outward_and_close_the_element(kind):
    table = TABLE[kind]
    triangles = np.concatenate([face[FACE_TRIANGLES[face.size]] for of in table.faces for face in of])
    volume = {4: 1 / 6, 5: 1 / 3, 6: 1 / 2, 8: 1.0}[table.corners]
    assert enclosed(table.nodes, triangles) == pytest.approx(volume, rel=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_node_order_undoes_a_permutation(kind):
    shuffled = np.random.default_rng(0).permutation(TABLE[kind].size)
    np.testing.assert_array_equal(shuffled[node_order(kind, TABLE[kind].nodes[shuffled])], np.arange(TABLE[kind].size))


@pytest.mark.parametrize("kind", KINDS)
def test_jacobian_of_a_parallelepiped_is_its_volume_ratio(kind):
    A = np.array([[2.0, 0.3, 0.1], [0.0, 1.5, -0.2], [0.1, 0.0, 0.7]])
    determinants = jacobian_determinants(kind, (TABLE[kind].nodes @ A.T)[None])
    np.testing.assert_allclose(determinants, np.linalg.det(A), rtol=1e-6 if kind.startswith("pyramid") else 1e-12)


# ---- boundary and groups ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_boundary_is_closed_outward_and_complete(kind):
    mesh = moved(box_mesh(kind, tuple(SIZE), CELLS), rotation(1), np.array([3.0, -1.0, 2.0]))
    faces = [face for of in boundary_faces(mesh) for face in of.tolist()]
    sides = {frozenset(face) for parts in mesh.face_groups.values() for of in parts for face in of.tolist()}
    assert {frozenset(face) for face in faces} == sides
    points, triangles = surface_triangles(mesh)
    np.testing.assert_array_equal(points, np.unique(np.concatenate(faces)))
    assert enclosed(mesh.points[points], triangles) == pytest.approx(SIZE.prod(), rel=1e-12)


def test_region_nodes_are_ascending_and_of_either_kind_of_group():
    mesh = replace(box_mesh("hex20", (1, 1, 1), (2, 1, 1)), node_groups={"pins": np.array([7, 3, 7])})
    np.testing.assert_array_equal(region_nodes(mesh, "pins"), [3, 7])
    nodes = region_nodes(mesh, "left")
    np.testing.assert_array_equal(nodes, np.flatnonzero(mesh.points[:, 0] == 0))


def test_missing_groups_are_named_with_those_there_are():
    mesh = replace(box_mesh("hex8", (1, 1, 1), (1, 1, 1)), node_groups={"pins": np.array([1])})
    with pytest.raises(InputError, match=r"no face group 'botom'; did you mean 'bottom'\? There are: 'bottom', 'top'"):
        face_group(mesh, "botom")
    with pytest.raises(InputError, match=r"no group of faces or nodes 'pin'; did you mean 'pins'"):
        region_nodes(mesh, "pin")
    with pytest.raises(InputError, match="there are: none"):
        face_group(replace(mesh, face_groups={}), "left")


def test_hash_tells_meshes_apart_and_nothing_else():
    mesh = box_mesh("tet4", (1, 1, 1), (1, 1, 1))
    backwards = replace(mesh, face_groups=dict(reversed(mesh.face_groups.items())))
    assert mesh_hash(mesh) == mesh_hash(backwards)
    others = [
        replace(mesh, points=mesh.points + 1e-15),
        replace(mesh, face_groups={}),
        replace(mesh, node_groups={"n": np.array([0])}),
        replace(mesh, volume_groups={}),
    ]
    assert len({mesh_hash(one) for one in [mesh, *others]}) == 5


# ---- checks -------------------------------------------------------------------------------------------------------


def joined(a, b):
    """Both meshes of one kind in one, without groups."""
    nodes = np.concatenate([a.blocks[0].nodes, b.blocks[0].nodes + len(a.points)])
    return Mesh(np.concatenate([a.points, b.points]), (Block(a.blocks[0].kind, nodes),), {}, {}, {})


def merged(mesh):
    """Coincident nodes made one."""
    points, index = np.unique(np.round(mesh.points, 9), axis=0, return_inverse=True)
    return replace(mesh, points=points, blocks=tuple(Block(b.kind, index.ravel()[b.nodes]) for b in mesh.blocks))


def with_nodes(mesh, nodes):
    return replace(mesh, blocks=(Block(mesh.blocks[0].kind, nodes),))


@pytest.mark.parametrize("kind", KINDS)
def test_sound_meshes_pass(kind):
    check_mesh(box_mesh(kind, tuple(SIZE), CELLS))


def test_no_elements():
    mesh = with_nodes(box_mesh("tet4", (1, 1, 1), (1, 1, 1)), np.zeros((0, 4), int))
    with pytest.raises(InputError, match="no volume elements"):
        check_mesh(mesh)


def test_shape_of_a_block():
    mesh = box_mesh("tet4", (1, 1, 1), (1, 1, 1))
    with pytest.raises(InputError, match=r"kind 'tet10' has nodes of shape \(6, 4\)"):
        check_mesh(replace(mesh, blocks=(Block("tet10", mesh.blocks[0].nodes),)))


def test_coordinates_that_are_not_numbers():
    mesh = box_mesh("tet4", (1, 1, 1), (1, 1, 1))
    points = mesh.points.copy()
    points[3, 1] = np.nan
    with pytest.raises(InputError, match="node 3 has the coordinates"):
        check_mesh(replace(mesh, points=points))


def test_nodes_out_of_range():
    mesh = box_mesh("tet4", (1, 1, 1), (1, 1, 1))
    with pytest.raises(InputError, match="nodes 0 to 7, but there are 7 nodes"):
        check_mesh(replace(mesh, points=mesh.points[:-1]))


def test_unused_nodes():
    mesh = box_mesh("tet4", (1, 1, 1), (1, 1, 1))
    with pytest.raises(InputError, match="1 nodes belong to no element, the first being node 8"):
        check_mesh(replace(mesh, points=np.vstack([mesh.points, [[5.0, 5.0, 5.0]]])))


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"volume_groups": {"web": np.zeros(0, int)}}, "volume group 'web'"),
        ({"face_groups": {"bore": ()}}, "face group 'bore'"),
        ({"node_groups": {"pin": np.zeros(0, int)}}, "node group 'pin'"),
    ],
)
def test_empty_groups(groups, message):
    with pytest.raises(InputError, match=f"{message} of the mesh is empty"):
        check_mesh(replace(box_mesh("tet4", (1, 1, 1), (1, 1, 1)), **groups))


def test_coincident_nodes():
    mesh = box_mesh("hex8", (1, 1, 1), (1, 1, 1))
    with pytest.raises(InputError, match=r"4 pairs of nodes coincide, the first being nodes 4 and 8 at \(1, 0, 0\) m"):
        check_mesh(joined(mesh, moved(mesh, np.eye(3), np.array([1.0, 0, 0]))))


def test_repeated_elements():
    mesh = box_mesh("hex8", (2, 1, 1), (2, 1, 1))
    nodes = np.vstack([mesh.blocks[0].nodes, mesh.blocks[0].nodes[1:]])
    with pytest.raises(InputError, match=r"1 elements are there more than once, the first being element 1 \(hex8\) at"):
        check_mesh(with_nodes(mesh, nodes))


@pytest.mark.parametrize("kind", KINDS)
def test_one_inverted_element(kind):
    mesh = box_mesh(kind, tuple(SIZE), CELLS)
    nodes = mesh.blocks[0].nodes.copy()
    mirrored = TABLE[kind].nodes[:, [1, 0, 2]]
    nodes[4] = nodes[4][node_order(kind, mirrored)]
    message = rf"element 4 \({kind}\) at \(.*\) m is turned inside out.*0 of the {len(nodes) - 1} others: mesh finer"
    straight = r".*smooth the mesh, make its elements straight" if TABLE[kind].means else r".*smooth the mesh, or put"
    message += straight
    with pytest.raises(InputError, match=message):
        check_mesh(with_nodes(mesh, nodes))


def test_mirrored_mesh():
    mesh = box_mesh("tet10", tuple(SIZE), CELLS)
    with pytest.raises(InputError, match="no element is right, so the mesh is mirrored"):
        check_mesh(replace(mesh, points=mesh.points * [-1.0, 1.0, 1.0]))


def test_flat_element():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    mesh = Mesh(points, (Block("tet4", np.array([[0, 1, 2, 3]])),), {}, {}, {})
    with pytest.raises(InputError, match="flat or collapsed"):
        check_mesh(mesh)


def test_wedges_written_as_hexahedra_are_told():
    mesh = box_mesh("hex8", tuple(SIZE), CELLS)
    nodes = mesh.blocks[0].nodes.copy()
    nodes[0, [2, 6]] = nodes[0, [3, 7]]
    with pytest.raises(
        InputError, match=r"1 elements name a node twice, the first being element 0 .* collapsed hexahedra"
    ):
        check_mesh(replace(mesh, blocks=(Block("hex8", nodes),)))


def test_element_folded_by_a_midside_node_only():
    """Corners in order, but one mid-edge node far beyond the quarter points folds the element."""
    mesh = box_mesh("tet10", (1, 1, 1), (1, 1, 1))
    points = mesh.points.copy()
    a, b, middle = mesh.blocks[0].nodes[0, [0, 1, 4]]
    points[middle] = 0.05 * points[a] + 0.95 * points[b]
    with pytest.raises(InputError, match="inside out, at least in part"):
        check_mesh(replace(mesh, points=points))


def test_loose_parts_are_counted_sized_and_located():
    mesh = box_mesh("hex8", (1, 1, 1), (2, 1, 1))
    far = moved(box_mesh("hex8", (1, 1, 1), (3, 1, 1)), np.eye(3), np.array([9.0, 0, 0]))
    with pytest.raises(InputError, match=r"2 unconnected parts: 3 elements with \(9\.\d+, 0\.5, 0\.5\) m, 2 elements"):
        check_mesh(joined(mesh, far))


def test_parts_that_share_an_edge_only():
    mesh = box_mesh("hex8", (1, 1, 1), (1, 1, 1))
    beside = moved(mesh, np.eye(3), np.array([1.0, 1.0, 0]))
    with pytest.raises(InputError, match="2 parts that touch at nodes or edges only"):
        check_mesh(merged(joined(mesh, beside)))


@pytest.mark.parametrize("kind", ["hex8", "tet4", "tet10"])
def test_elements_on_the_same_side_of_a_face_overlap(kind):
    """What is meshed twice, with another node inside: mass beyond the volume, though the parts hang together by a face."""
    mesh = box_mesh(kind, (1, 1, 1), (2, 1, 1))
    first = mesh.blocks[0].nodes[0]
    own = TABLE[kind].faces[0][0]  # what the second one shares with it; its other nodes are its own
    others = np.setdiff1d(np.arange(first.size), own)
    centre = mesh.points[first[own]].mean(axis=0)
    points = np.vstack([mesh.points, centre + 0.7 * (mesh.points[first[others]] - centre)])
    again = first.copy()
    again[others] = len(mesh.points) + np.arange(others.size)
    nodes = np.vstack([mesh.blocks[0].nodes, again])
    for here in (nodes, nodes[::-1]):
        with pytest.raises(InputError, match="2 elements overlap"):
            check_mesh(replace(mesh, points=points, blocks=(Block(kind, here),), volume_groups={}, face_groups={}))


def of_first_order(mesh, beyond):
    """The mesh with hexahedra of first order beyond a place along x."""
    nodes = mesh.blocks[0].nodes
    far = mesh.points[nodes].mean(axis=1)[:, 0] > beyond
    parts = nodes[~far], nodes[far][:, :8]
    used, new = np.unique(np.concatenate([part.ravel() for part in parts]), return_inverse=True)
    whole, corners = np.split(new.ravel(), [parts[0].size])
    blocks = Block("hex20", whole.reshape(-1, 20)), Block("hex8", corners.reshape(-1, 8))
    return Mesh(mesh.points[used], blocks, {}, {}, {})


def test_elements_that_do_not_fit_are_told():
    """Four edges of the face between elements of two orders; a quadrilateral of one that is two triangles of others."""
    first = misfit_doubts(of_first_order(box_mesh("hex20", (1, 1, 1), (2, 1, 1)), 0.5))
    assert "4 edges have a node in the middle for some" in first[0]
    assert len(first) == 1
    one, other = box_mesh("hex8", (1, 1, 1), (1, 1, 1)), box_mesh("tet4", (1, 1, 1), (1, 1, 1))
    points = np.concatenate([one.points, other.points + np.array([1.0, 0, 0])])
    beside = Block("tet4", other.blocks[0].nodes + len(one.points))
    second = misfit_doubts(merged(Mesh(points, (*one.blocks, beside), {}, {}, {})))
    assert (
        "1 faces are quadrilaterals of some elements and triangles of others, the first at (1, 0.5, 0.5) m" in second[0]
    )
    assert not misfit_doubts(box_mesh("hex20", (1, 1, 1), (2, 1, 1)))
    told = mesh_warnings(of_first_order(box_mesh("hex20", (1, 1, 1), (2, 1, 1)), 0.5))
    assert told == first


@pytest.mark.parametrize(("kind", "apart"), [("hex8", 0.0), ("tet10", 0.0), ("hex8", 1e-6)])
def test_parts_that_share_only_some_of_their_nodes_are_told(kind, apart):
    """Three boxes in an L; the fourth, which fills it, has other elements along one side, or is a little apart there."""
    low, left = box_mesh(kind, (2, 0.5, 0.5), (4, 1, 1)), box_mesh(kind, (1, 0.5, 0.5), (2, 1, 1))
    right = box_mesh(kind, (1, 0.5, 0.5), (2 if apart else 3, 1, 1))
    at_right = right.points + np.array([1.0, 0.5, 0])
    at_right[:, 1] += apart * (right.points[:, 0] > 0) * (right.points[:, 1] == 0)
    whole = low
    for points, block in ((left.points + np.array([0, 0.5, 0]), left.blocks[0]), (at_right, right.blocks[0])):
        beside = Block(kind, block.nodes + len(whole.points))
        whole = merged(Mesh(np.concatenate([whole.points, points]), (*whole.blocks, beside), {}, {}, {}))
    check_mesh(whole)
    (told,) = misfit_doubts(whole)
    assert "nodes the mesh is open and too soft, the first at" in told
    assert "they lie on edges of elements that do not have them" in told


# ---- formats ------------------------------------------------------------------------------------------------------


def write_by_meshio(path, kind, mesh, file_format, **data):
    ends = [mesh.face_groups[name][0] for name in ("left", "right")]
    cells = [(MESHIO[kind], mesh.blocks[0].nodes), *((MESHIO_FACE[end.shape[1]], end) for end in ends)]
    given = {key: value(cells) if callable(value) else value for key, value in data.items()}
    meshio.Mesh(mesh.points, cells, **given).write(path, file_format=file_format)


def tags(cells):
    return [np.full(len(nodes), k + 1) for k, (_, nodes) in enumerate(cells)]


@pytest.mark.parametrize("kind", MESHIO)
def test_vtu_with_integer_tags(kind, tmp_path):
    write_by_meshio(
        tmp_path / "box.vtu", kind, box_mesh(kind, tuple(SIZE), CELLS), "vtu", cell_data=lambda c: {"tag": tags(c)}
    )
    mesh = read_mesh(tmp_path / "box.vtu")
    assert_is_the_box(mesh, kind, "tag_2", "tag_3")
    np.testing.assert_array_equal(mesh.volume_groups["tag_1"], np.arange(len(mesh.blocks[0].nodes)))


@pytest.mark.parametrize("kind", [*PLAIN, "wedge6", "pyramid5"])
def test_msh_2_with_physical_names(kind, tmp_path):
    write_by_meshio(
        tmp_path / "box.msh",
        kind,
        box_mesh(kind, tuple(SIZE), CELLS),
        "gmsh22",
        cell_data=lambda c: {"gmsh:physical": tags(c), "gmsh:geometrical": tags(c)},
        field_data={"box": np.array([1, 3]), "left": np.array([2, 2]), "right": np.array([3, 2])},
    )
    assert_is_the_box(read_mesh(tmp_path / "box.msh"), kind, "left", "right")


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8", "hex20"])
def test_nastran_with_property_numbers(kind, tmp_path):
    write_by_meshio(
        tmp_path / "box.bdf", kind, box_mesh(kind, tuple(SIZE), CELLS), "nastran",
        cell_data=lambda c: {"nastran:ref": tags(c)},
    )  # fmt: skip
    mesh = read_mesh(tmp_path / "box.bdf")
    assert_is_the_box(mesh, kind, "property_2", "property_3")
    assert set(mesh.volume_groups) == {"property_1"}


def test_nastran_coordinate_systems_are_refused(tmp_path):
    deck = "BEGIN BULK\n" + "".join(
        f"GRID,{k + 1},{3 if k == 2 else 0},{x}.,{y}.,{z}.\n"
        for k, (x, y, z) in enumerate([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    )
    (tmp_path / "a.bdf").write_text(deck + "CTETRA,1,1,1,2,3,4\nENDDATA\n")
    with pytest.raises(InputError, match="coordinate system 3"):
        read_mesh(tmp_path / "a.bdf")


@pytest.fixture(scope="module")
def written_by_gmsh(tmp_path_factory):
    """The box as written by gmsh, an implementation of node orders and formats of its own: folder of <kind>.<format>."""
    folder = tmp_path_factory.mktemp("gmsh")
    parameters = dict(zip(("x", "y", "z", "nx", "ny", "nz"), (*SIZE, *CELLS), strict=True))
    words = [word for name, value in parameters.items() for word in ("-setnumber", name, str(value))]
    for kind in PLAIN:
        gmsh.initialize(["gmsh", *words, "-setnumber", "tetrahedra", str(int(kind.startswith("tet")))])
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(kind == "hex20"))
        gmsh.open(str(MESHES / "box.geo"))
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(1 if kind in ("tet4", "hex8") else 2)
        for suffix in ("msh", "inp", "bdf", "unv", "med", "mesh"):
            if kind != "hex27" or suffix == "msh":
                gmsh.write(str(folder / f"{kind}.{suffix}"))
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(str(folder / f"{kind}_binary.msh"))
        gmsh.finalize()
    return folder


@pytest.mark.parametrize(
    "name",
    [
        *(f"{kind}.msh" for kind in PLAIN),
        *(f"{kind}.inp" for kind in PLAIN if kind != "hex27"),
        *("tet10_binary.msh", "hex20_binary.msh", "tet10.unv", "hex20.unv", "tet10.med", "hex20.med"),
    ],
)
def test_named_surfaces_in_formats_written_by_gmsh(written_by_gmsh, name):
    mesh = read_mesh(written_by_gmsh / name)
    assert_is_the_box(mesh, name.partition("_")[0].partition(".")[0], "left", "right")
    np.testing.assert_array_equal(mesh.volume_groups["box"], np.arange(len(mesh.blocks[0].nodes)))


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8", "hex20"])
def test_bare_bulk_data_written_by_gmsh(written_by_gmsh, kind):
    assert_is_the_box(read_mesh(written_by_gmsh / f"{kind}.bdf"), kind, "property_1", "property_6")


@pytest.mark.parametrize("kind", ["tet4", "tet10", "hex8"])
def test_medit_written_by_gmsh(written_by_gmsh, kind):
    assert_is_the_box(read_mesh(written_by_gmsh / f"{kind}.mesh"), kind, "ref_1", "ref_6")


# One row of a keyword that mmg writes, counts beside keywords, a version that is no number of meshio's table.
OF_MMG = "MeshVersionFormatted 3\nDimension 3\n# made by mmg\nRequiredTriangles\n1\n1\n"


@pytest.mark.parametrize("kind", ["tet10", "hex27"])
def test_further_nodes_of_medit_are_taken_by_where_they_lie(kind, tmp_path):
    """The format leaves their order open (L. Marechal, libMeshb)."""
    box, ours = box_mesh(kind, tuple(SIZE), CELLS), TABLE[kind]
    shuffled = [*range(ours.corners), *np.random.default_rng(3).permutation(range(ours.corners, ours.size))]
    rows = [f"{len(box.points)}", *(f"{x!r} {y!r} {z!r} 0" for x, y, z in box.points.tolist())]
    cells = [" ".join(map(str, [*(of[shuffled] + 1), 5])) for of in box.blocks[0].nodes]
    keyword = "TetrahedraP2" if kind == "tet10" else "HexahedraQ2"
    text = [OF_MMG + "Vertices " + "\n".join(rows), f"{keyword} {len(cells)}", *cells, "End", ""]
    (tmp_path / "box.mesh").write_text("\n".join(text))
    mesh = read_mesh(tmp_path / "box.mesh")
    np.testing.assert_array_equal(mesh.blocks[0].nodes, box.blocks[0].nodes)
    np.testing.assert_array_equal(mesh.points, box.points)
    np.testing.assert_array_equal(mesh.volume_groups["ref_5"], np.arange(len(cells)))


def test_an_ending_that_nothing_reads_is_named(tmp_path):
    (tmp_path / "box.key").write_text("*KEYWORD\n")
    with pytest.raises(InputError, match=r"has an ending that no reader knows: save the mesh as \.msh"):
        read_mesh(tmp_path / "box.key")


def test_a_dat_file_of_ansys_is_no_mesh_without_solids(tmp_path):
    (tmp_path / "ds.dat").write_text("/batch\n/prep7\nnblock,3\n(1i9,3e20.9e3)\n        1     0.000000000E+000\n-1\n")
    with pytest.raises(InputError, match=r"ds\.dat: it has no GRID: is it Nastran bulk data\?"):
        read_mesh(tmp_path / "ds.dat")


UNITS = """    -1
   164
         5mm (milli-newton)               2
  {}  1.00000000000000000D+03  1.00000000000000000D+00
  2.73149999999999977D+02
    -1
"""


@pytest.mark.parametrize(
    ("factor", "unit"), [("1.00000000000000000D+03", "mm"), ("3.93700787401574797D+01", "in"), ("1.0D+00", "m")]
)
def test_the_unit_that_a_universal_file_declares(written_by_gmsh, tmp_path, factor, unit):
    """I-deas Test Data Journal, dataset 164: lengths are divided by the first factor to be metres."""
    plain = written_by_gmsh / "tet10.unv"
    (tmp_path / "box.unv").write_text(UNITS.format(factor) + plain.read_text())
    mesh = read_mesh(tmp_path / "box.unv")
    np.testing.assert_array_equal(mesh.points, read_mesh(plain, unit=unit).points)
    assert mesh.unit == unit
    told = [note for note in read_mesh(tmp_path / "box.unv", unit="cm").notes if "which was given" in note]
    assert len(told) == (unit != "m")  # some programs write metres whatever they have


def test_units_are_converted_once(written_by_gmsh):
    metres = read_mesh(written_by_gmsh / "tet4.msh")
    for unit, factor in {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}.items():
        np.testing.assert_array_equal(read_mesh(written_by_gmsh / "tet4.msh", unit=unit).points, factor * metres.points)


@pytest.mark.parametrize("first", ["tetra", "tetra10"])
def test_elements_of_both_orders_in_one_volume_are_refused(tmp_path, first):
    """Gmsh gives the nodes of all as those of the first: the corners alone, or zeros for those that there are not."""
    box = box_mesh("tet10", tuple(SIZE), CELLS)
    half = len(box.blocks[0].nodes) // 2
    cells = {"tetra": box.blocks[0].nodes[:half, :4], "tetra10": box.blocks[0].nodes[half:]}
    mixed = [(first, cells.pop(first)), *cells.items()]
    tagged = [np.ones(len(nodes), int) for _, nodes in mixed]
    given = {"gmsh:physical": tagged, "gmsh:geometrical": tagged}
    meshio.Mesh(box.points, mixed, cell_data=given).write(tmp_path / "box.msh", file_format="gmsh22")
    with pytest.raises(
        InputError, match=r"box\.msh: a volume has elements of first and of second order beside each other"
    ):
        read_mesh(tmp_path / "box.msh")


def test_plane_meshes_are_refused(tmp_path):
    meshio.Mesh(np.eye(3)[:, :2], [("triangle", [[0, 1, 2]])]).write(tmp_path / "p.xdmf")
    with pytest.raises(InputError, match="no points with x, y and z"):
        read_mesh(tmp_path / "p.xdmf")


def test_surfaces_alone_are_refused(tmp_path):
    meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])]).write(tmp_path / "s.vtu")
    with pytest.raises(InputError, match=r"no volume elements; bodies are made of solids.*ffr-prep reduce-structure"):
        read_mesh(tmp_path / "s.vtu")


SAVED_WITHOUT_SURFACES = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
3 1 "part"
$EndPhysicalNames
$Entities
0 0 1 1
1 0 0 0 1 1 1 0 0
1 0 0 0 1 1 1 1 1 0
$EndEntities
$Nodes
1 4 1 4
3 1 0 4
1
2
3
4
0 0 0
1 0 0
0 1 0
0 0 1
$EndNodes
$Elements
1 1 1 1
3 1 4 1
1 1 2 3 4
$EndElements
"""


def test_groups_without_elements_of_their_own_are_not_told_of(tmp_path):
    """gmsh saves the surfaces of a mesh with named volumes alone as surfaces without elements, which nobody has named."""
    (tmp_path / "part.msh").write_text(SAVED_WITHOUT_SURFACES)
    mesh = read_mesh(tmp_path / "part.msh")
    assert list(mesh.volume_groups) == ["part"]
    assert mesh.notes == ()
    assert mesh.face_groups == {}


def test_what_is_left_out_is_noted(tmp_path):
    box = box_mesh("hex8", (1, 1, 1), (1, 1, 1))
    points = np.vstack([box.points, [[5, 5, 5], [6, 5, 5], [5, 6, 5]]])
    loose = np.array([[8, 9, 10]])
    cells = [("hexahedron", box.blocks[0].nodes), ("triangle", loose), ("line", [[0, 8]])]
    data = {"tag": [np.array([1]), np.array([2]), np.array([3])]}
    meshio.Mesh(points, cells, cell_data=data).write(tmp_path / "n.vtu")
    mesh = read_mesh(tmp_path / "n.vtu")
    check_mesh(mesh)
    assert len(mesh.points) == 8
    assert mesh.notes == (
        "1 line elements are ignored; only solids are reduced",
        "3 nodes that belong to no volume element are left out",
        "group 'tag_2' is left out: nothing of it belongs to a volume element",
    )


def test_millimetres_read_as_metres_are_suspected(tmp_path):
    box = box_mesh("hex8", (150, 20, 10), (1, 1, 1))
    meshio.Mesh(box.points, [("hexahedron", box.blocks[0].nodes)]).write(tmp_path / "b.vtu")
    assert "150 m long" in read_mesh(tmp_path / "b.vtu").notes[0]
    assert read_mesh(tmp_path / "b.vtu", unit="mm").notes == ()


@pytest.mark.parametrize("name", ["a.vtu", "a.bdf", "a.inp", "a.msh", "a.step", "a.geo", "a.med", "a.xyz"])
def test_damaged_files_are_refused_in_one_line(name, tmp_path):
    (tmp_path / name).write_text("*NODE\n1, 2, three\nVolume(1) = {nonsense;\n")
    with pytest.raises(InputError, match=name) as caught:
        read_mesh(tmp_path / name)
    assert "\n" not in str(caught.value)


# ---- Abaqus -------------------------------------------------------------------------------------------------------

DECK = """\
*Heading
 a cube of two parts
*Node, nset=ALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
** a comment between data lines
7, 1., 1., 1.
8, 0., 1., 1.
*NODE
9, 0., 0., 2.
10, 1., 0., 2.
11, 1., 1., 2.
12, 0., 1., 2.
*Element, type=C3D8R, elset=Lower
10, 1, 2, 3, 4, 5, 6,
7, 8
*Element, type=C3D8I, elset=Upper
20, 5, 6, 7, 8, 9, 10, 11, 12
*Elset, elset=Both
Lower, Upper
*Elset, elset=Twenty, generate
20, 20, 1
*Nset, nset=Base, generate
1, 4
*Nset, nset=Ends
Base, 9, 10
*Nset, nset=Ends
11, 12
*Surface, type=ELEMENT, name=Top
Upper, S2
*Surface, name=Side
10, S3
Twenty, S3
*Surface, name=Free
Both,
*Mass, elset=Both
"""


@pytest.fixture
def deck(tmp_path):
    def written(text=DECK):
        (tmp_path / "cube.inp").write_text(text)
        return tmp_path / "cube.inp"

    return written


def test_abaqus_sets_and_surfaces(deck):
    mesh = read_mesh(deck())
    check_mesh(mesh)
    assert volume(mesh) == pytest.approx(2.0)
    assert {name: of.tolist() for name, of in mesh.volume_groups.items()} == {
        "Lower": [0],
        "Upper": [1],
        "Both": [0, 1],
        "Twenty": [1],
    }
    assert {name: of.tolist() for name, of in mesh.node_groups.items()} == {
        "ALL": list(range(8)),
        "Base": [0, 1, 2, 3],
        "Ends": [0, 1, 2, 3, 8, 9, 10, 11],
    }
    np.testing.assert_array_equal(region_nodes(mesh, "Top"), [8, 9, 10, 11])
    np.testing.assert_array_equal(region_nodes(mesh, "Side"), [0, 1, 4, 5, 8, 9])
    assert mesh.notes == ("surface 'Free' is left out: it is not a list of elements and faces S1 to S6",)


FACE_PLANES_HEX = {1: (2, 0), 2: (2, 1), 3: (1, 0), 4: (0, 1), 5: (1, 1), 6: (0, 0)}


@pytest.mark.parametrize("side", FACE_PLANES_HEX)
def test_abaqus_face_numbers_of_a_hexahedron(deck, side):
    """Abaqus, Three-dimensional solid element library: faces 1-2-3-4, 5-8-7-6, 1-5-6-2, 2-6-7-3, 3-7-8-4, 4-8-5-1."""
    axis, value = FACE_PLANES_HEX[side]
    mesh = read_mesh(deck(DECK.replace("Upper, S2", f"Lower, S{side}")))
    np.testing.assert_array_equal(mesh.points[region_nodes(mesh, "Top")][:, axis], value)


@pytest.mark.parametrize(("side", "without"), [(1, 4), (2, 3), (3, 1), (4, 2)])
def test_abaqus_face_numbers_of_a_tetrahedron(deck, side, without):
    """Abaqus, Three-dimensional solid element library: faces 1-2-3, 1-4-2, 2-4-3, 3-4-1."""
    mesh = read_mesh(
        deck(f"*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n5,1,2,3,4\n*SURFACE,NAME=f\n5,S{side}\n")
    )
    np.testing.assert_array_equal(region_nodes(mesh, "f"), [k for k in range(4) if k != without - 1])


def test_abaqus_includes(deck, tmp_path):
    nodes, _, rest = DECK.partition("*NODE\n9")
    (tmp_path / "nodes.inc").write_text(nodes)
    assert mesh_hash(read_mesh(deck("*INCLUDE, INPUT=nodes.inc\n*NODE\n9" + rest))) == mesh_hash(read_mesh(deck()))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("7, 8\n*Element, type=C3D8I", "7, 99\n*Element, type=C3D8I", "refers to node 99"),
        ("Lower, Upper", "Lower, Middle", "refers to the set 'Middle'"),
        ("Lower, Upper", "Lower, Both", "refers to the set 'Both'"),
        ("Upper, S2", "77, S2", "side S2 of element 77"),
        ("9, 0., 0., 2.", "8, 0., 0., 2.", "node 8 is defined twice"),
        ("20, 5, 6, 7, 8,", "10, 5, 6, 7, 8,", "element 10 is defined twice"),
        ("C3D8I", "C3D15V", "volume elements of kind 'C3D15V'"),
        ("*Mass, elset=Both", "*Instance, name=a, part=p\n*End Instance\n*Instance, name=b, part=p", "assembly"),
        ("*Mass, elset=Both", "*Instance, name=a, part=p\n1., 0., 0.\n0, 0, 1, 0, 0, 1, 90.", "two points are one"),
        ("*Mass, elset=Both", "*Include, input=nowhere.inp", "nowhere.inp does not exist"),
        ("6, 1., 0., 1.", "6, 1., zero, 1.", "cannot read .*cube.inp as an Abaqus input file"),
    ],
)
def test_abaqus_files_that_cannot_be_used(deck, old, new, message):
    assert old in DECK
    with pytest.raises(InputError, match=message):
        read_mesh(deck(DECK.replace(old, new)))


def test_abaqus_elements_that_are_no_solids_are_noted(deck):
    mesh = read_mesh(deck(DECK + "*Element, type=AC1D2\n90, 1, 2\n"))
    assert "1 elements of type AC1D2 are ignored; only solids are reduced" in mesh.notes


@pytest.mark.parametrize(
    ("card", "start", "remedy"),
    [
        ("*Element, type=B31\n90, 1, 2\n", "1 B31 left out: beams", "structure file"),
        ("*Element, type=DASHPOTA\n90, 1, 2\n91, 2, 3\n", "2 DASHPOTA left out: springs and dashpots", "[springs]"),
        ("*Element, type=SpringA\n90, 1, 2\n", "1 SPRINGA left out: springs and dashpots", "scene"),
        ("*Element, type=MASS\n90, 1\n*Element, type=ROTARYI\n91, 1\n", "1 MASS, 1 ROTARYI left out: masses", "scene"),
        ("*Element, type=AC3D4\n90, 1, 2, 3, 4\n", "1 AC3D4 left out: acoustic elements", "fluid"),
        ("*Coupling, ref node=1\n*Kinematic\n", "1 *COUPLING left out: rigid", "interface"),
        ("*MPC\nBEAM, 1, 2\n*Equation\n2\n1, 1, 1., 2, 1, -1.\n", "1 *MPC, 1 *EQUATION left out: rigid", "interface"),
        ("*Tie, name=t\na, b\n", "1 *TIE left out: connections", "share nodes"),
        ("*Boundary\n1, 1, 3\n", "1 *BOUNDARY left out: supports", "--reference"),
        ("*Cload\n1, 1, 3.\n", "1 *CLOAD left out: loads", "scene"),
        ("*Shell Section, elset=Both\n1.\n", "1 *SHELL SECTION left out: shells", "as faces"),
        ("*Material, name=m\n*Damping, alpha=2.\n", "1 *DAMPING left out: damping", "--rayleigh"),
        ("*Model Change, remove\nBoth\n", "1 *MODEL CHANGE left out: elements that a step takes out", "delete"),
        ("*Initial conditions, type=stress\n", "1 *INITIAL CONDITIONS left out: initial", "without stress"),
        ("*User Element, nodes=2\n", "1 *USER ELEMENT left out: matrices", "reduce-matrices"),
    ],
)
def test_abaqus_cards_that_would_change_the_body_are_told(deck, card, start, remedy):
    (note,) = set(read_mesh(deck(DECK + card)).notes) - set(read_mesh(deck(DECK)).notes)
    assert note.startswith(start)
    assert remedy in note


def test_abaqus_reference_points_of_an_assembly_are_no_nodes_of_its_part(deck):
    """Programs with a window number them from one again, and so the springs there."""
    part, sets = DECK.split("*Nset", 1)
    inside = f"*Part, name=cube\n{part}*Nset{sets}*End Part\n"
    assembly = (
        "*Assembly, name=a\n*Instance, name=cube-1, part=cube\n*End Instance\n*Node\n1, 5., 5., 5.\n2, 5., 5., 6.\n"
        "*Nset, nset=Points\n1, 2\n*Surface, type=NODE, name=Point\nPoints, 1.\n*Elset, elset=Springs\n10\n"
        "*Nset, nset=Four, instance=cube-1\n1, 2, 3, 4\n*End Assembly\n"
    )
    plain, mesh = read_mesh(deck()), read_mesh(deck(inside + assembly))
    np.testing.assert_array_equal(mesh.points, plain.points)
    assert mesh.node_groups.keys() - plain.node_groups.keys() == {"Four"}
    assert mesh.volume_groups.keys() == plain.volume_groups.keys()
    assert mesh.notes[1].startswith("2 nodes of the assembly left out: reference points are those of interfaces")


def test_the_place_of_the_one_instance_is_that_of_the_mesh(deck):
    """Abaqus Keywords Reference Guide, *INSTANCE: shifted first, then turned about a line through two points [deg]."""
    placed = "*Instance, name=cube-1, part=cube\n0.5, , 2.\n0.5, 0., 0., 0.5, 0., 4., 90.\n*End Instance\n"
    plain, mesh = read_mesh(deck()), read_mesh(deck(DECK + placed))
    x, y, z = plain.points.T
    np.testing.assert_allclose(mesh.points, np.stack([0.5 - y, x, z + 2], axis=1), atol=1e-15)
    assert mesh.node_groups.keys() == plain.node_groups.keys()


def test_abaqus_keywords_behind_blanks_and_parameters_of_the_next_line(deck):
    """Abaqus Keywords Reference Guide: the first character of a keyword line that is not blank is the star."""
    mesh = read_mesh(deck(DECK.replace("*Element", "  *Element") + "*Nset, nset=Some,\n  generate\n1, 3\n"))
    assert mesh.volume_groups.keys() == read_mesh(deck()).volume_groups.keys()
    np.testing.assert_array_equal(mesh.node_groups["Some"], range(3))


def test_a_set_with_a_point_in_its_name_is_no_number_of_an_instance(deck):
    """It was element 10 of an instance "near": the other end of the cubes."""
    sets = "*Elset, elset=near.10\n20\n*Surface, name=There\nnear.10, S2\n"
    mesh = read_mesh(deck(DECK + sets))
    np.testing.assert_array_equal(mesh.points[region_nodes(mesh, "There")][:, 2], 2.0)


def test_abaqus_order_of_hexahedra_with_27_nodes(deck):
    """Abaqus, Three-dimensional solid element library: node 21 in the middle, 22 to 27 on the faces S1 to S6."""
    box, faces = box_mesh("hex27", tuple(SIZE), (1, 1, 1)), (1, 2, 3, 4, 5, 6)
    corners, middle = box.points[box.blocks[0].nodes[0][:8]], box.blocks[0].nodes[0][20:]
    sides = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    places = [corners.mean(axis=0), *(corners[list(sides[k - 1])].mean(axis=0) for k in faces)]
    order = [int(np.linalg.norm(box.points[middle] - at, axis=1).argmin()) for at in places]
    element = [1, *(box.blocks[0].nodes[0][:20] + 1), *(middle[order] + 1)]
    nodes = [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(box.points.tolist(), 1)]
    text = "\n".join(["*NODE", *nodes, "*ELEMENT, TYPE=C3D27", ", ".join(map(str, element)), ""])
    mesh = read_mesh(deck(text))
    check_mesh(mesh)
    assert_nodes_in_order(mesh)


def test_abaqus_node_sets_of_element_sets(deck):
    mesh = read_mesh(deck(DECK + "*Nset, nset=Below, elset=Lower\n*Nset, nset=Below\n9\n"))
    np.testing.assert_array_equal(mesh.node_groups["Below"], range(9))


def test_abaqus_surfaces_of_everything_are_left_out(deck):
    assert any(note.startswith("surface 'All'") for note in read_mesh(deck(DECK + "*Surface, name=All\n, S1\n")).notes)


@pytest.mark.parametrize(
    "card", ["*Ngen\n1, 3, 1\n", "*Elcopy, old set=a\n", "*Nfill\na, b, 2, 1\n", "*System\n1, 0, 0\n"]
)
def test_abaqus_cards_that_make_nodes_are_refused(deck, card):
    with pytest.raises(
        InputError, match="makes nodes or elements, which is not done here: write the mesh with every node"
    ):
        read_mesh(deck(DECK + card))


def test_abaqus_nodes_in_cylindrical_coordinates_are_refused(deck):
    with pytest.raises(InputError, match="cylindrical or spherical coordinates"):
        read_mesh(deck(DECK.replace("*Node", "*Node, system=C", 1)))


def test_abaqus_nodes_and_elements_in_files_of_their_own(deck, tmp_path):
    path = deck(DECK)
    first, _, others = path.read_text().partition("*NODE\n")
    rows, mark, others = others.partition("*Element")
    (tmp_path / "nodes.txt").write_text("** of another program\n" + rows)
    split = tmp_path / "split.inp"
    split.write_text(f"{first}*Node, input=nodes.txt\n{mark}{others}")
    np.testing.assert_array_equal(read_mesh(split).points, read_mesh(path).points)


# ---- geometry through gmsh ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("order", "tetrahedra", "kind"), [(1, 1, "tet4"), (2, 1, "tet10"), (1, 0, "hex8"), (2, 0, "hex27")]
)
def test_parameters_and_order_of_a_script(order, tetrahedra, kind):
    numbers = dict(zip(("x", "y", "z", "nx", "ny", "nz"), (*SIZE, *CELLS), strict=True)) | {"tetrahedra": tetrahedra}
    assert_is_the_box(read_mesh(MESHES / "box.geo", numbers=numbers, order=order), kind, "left", "right")


@pytest.mark.parametrize(
    ("script", "unit", "expected", "groups"),
    [
        ("pendulum.geo", "m", 1.2 * 0.009 * 0.2, {"hinge", "tip"}),
        ("slidercrank_rod.geo", "m", 0.3 * np.pi * 0.003**2, {"crankpin", "slider"}),
    ],
)
def test_example_meshes(script, unit, expected, groups):
    mesh = read_mesh(MESHES / script, unit=unit)
    check_mesh(mesh)
    assert set(mesh.face_groups) == groups
    assert volume(mesh) == pytest.approx(expected, rel=1e-3)


@pytest.fixture(scope="module")
def connecting_rod():
    return read_mesh(MESHES / "connecting_rod.geo", unit="mm")


def test_connecting_rod(connecting_rod):
    """The bores have their diameters and places; the area of a cylinder is 2 pi r h."""
    check_mesh(connecting_rod)
    assert 1e4 < 3 * len(connecting_rod.points) < 2.5e4
    for name, x, diameter in (("big_eye", 0.0, 0.048), ("small_eye", 0.150, 0.022)):
        nodes = connecting_rod.points[region_nodes(connecting_rod, name)]
        radius = np.hypot(nodes[:, 0] - x, nodes[:, 1])
        np.testing.assert_allclose(radius, diameter / 2, rtol=1e-6)
        assert np.ptp(nodes[:, 2]) == pytest.approx(0.022)


@pytest.mark.slow
def test_second_order_follows_the_bores(connecting_rod):
    """The volume converges faster than that of straight elements, which fill the bores and cut the outside."""
    fine = volume(read_mesh(MESHES / "connecting_rod.geo", unit="mm", size=4))
    straight = volume(read_mesh(MESHES / "connecting_rod.geo", unit="mm", order=1))
    assert abs(volume(connecting_rod) / fine - 1) < 1e-4
    assert abs(volume(connecting_rod) - fine) < 0.3 * abs(straight - fine)


def test_the_same_geometry_gives_the_same_mesh_bit_for_bit(connecting_rod):
    assert mesh_hash(read_mesh(MESHES / "connecting_rod.geo", unit="mm")) == mesh_hash(connecting_rod)


def test_element_size(connecting_rod):
    finer = read_mesh(MESHES / "connecting_rod.geo", unit="mm", size=5)
    assert len(finer.points) > 1.5 * len(connecting_rod.points)


@pytest.fixture(scope="module")
def cad(tmp_path_factory):
    """A box of 10 x 20 x 30 in the file's unit: STEP and IGES declare one, BREP does not."""
    folder = tmp_path_factory.mktemp("cad")
    gmsh.initialize(["gmsh"])
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    gmsh.model.occ.addBox(0, 0, 0, 10, 20, 30)
    gmsh.model.occ.synchronize()
    for suffix in ("step", "brep", "igs"):
        gmsh.write(str(folder / f"box.{suffix}"))
    gmsh.finalize()
    step = (folder / "box.step").read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in step
    (folder / "metres.step").write_text(step.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    (folder / "centimetres.stp").write_text(step.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    return folder


@pytest.mark.parametrize(
    ("name", "unit", "metre"),
    [
        ("box.step", None, 1e-3),
        ("metres.step", None, 1.0),
        ("centimetres.stp", None, 1e-2),
        ("box.step", "mm", 1e-3),
        ("box.brep", "in", 0.0254),
        ("box.igs", None, 1e-3),
    ],
)
def test_units_of_cad_files(cad, name, unit, metre):
    """A declared unit counts; the element size is in the unit of the file."""
    mesh = read_mesh(cad / name, unit=unit, size=30.0, order=1)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), np.array([10, 20, 30]) * metre, rtol=1e-9)
    assert len(mesh.points) < 100


def test_iges_has_its_unit(cad):
    with pytest.raises(InputError, match="converted to millimetres; leave out the unit 'm'"):
        read_mesh(cad / "box.igs", unit="m")


def test_another_unit_than_the_file_declares_is_refused(cad):
    with pytest.raises(InputError, match="declares that its numbers are mm, and the unit 'm' is given: leave it out"):
        read_mesh(cad / "box.step", unit="m", size=30.0)


INCHES = """
#9 = ( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#12, #14, #15)) REPRESENTATION_CONTEXT('','') );
#10 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );
#11 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4), #10);
#12 = ( CONVERSION_BASED_UNIT('INCH', #11)
  LENGTH_UNIT() NAMED_UNIT(#13) );
"""


def test_inches_are_defined_by_millimetres_in_step_files(tmp_path):
    (tmp_path / "i.step").write_text(INCHES)
    assert gmsh_source.declared_unit(tmp_path / "i.step") == "in"
    (tmp_path / "i.step").write_text(INCHES.replace("(#12,", "(#10,"))
    assert gmsh_source.declared_unit(tmp_path / "i.step") == "mm"


def test_entities_of_cad_files_have_names(cad):
    mesh = read_mesh(cad / "box.step", size=30.0)
    assert [f"surface_{k}" for k in range(1, 7)] == list(mesh.face_groups)
    assert list(mesh.volume_groups) == ["volume_1"]
    areas = sorted(np.ptp(mesh.points[region_nodes(mesh, f"surface_{k}")], axis=0).max() for k in range(1, 7))
    np.testing.assert_allclose(areas, [0.02, 0.02, 0.03, 0.03, 0.03, 0.03], rtol=1e-9)


def test_volumes_outside_the_physical_groups_are_left_out(tmp_path):
    script = """
        SetFactory("OpenCASCADE");
        Box(1) = {0, 0, 0, 1, 1, 1};
        Box(2) = {5, 0, 0, 1, 1, 1};
        Physical Volume("kept") = {2};
        Physical Point("corner") = {9};
    """
    (tmp_path / "two.geo").write_text(textwrap.dedent(script))
    mesh = read_mesh(tmp_path / "two.geo", order=1)
    check_mesh(mesh)
    assert mesh.points[:, 0].min() == 5.0
    assert len(mesh.node_groups["corner"]) == 1
    assert "volumes in no physical group are left out, as gmsh does" in mesh.notes


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"numbers": {"lenght": 3.0}}, r"no parameter 'lenght'; there are: 'x', 'y'"),
        ({"unit": "furlong"}, "unit 'furlong' is not known"),
        ({"size": -1.0}, "element size -1.0"),
        ({"order": 3}, "element order 3"),
    ],
)
def test_arguments_that_cannot_be_used(arguments, message):
    with pytest.raises(InputError, match=message):
        read_mesh(MESHES / "box.geo", **arguments)


def test_parameters_of_an_included_script(tmp_path):
    (tmp_path / "outer.geo").write_text(f'Include "{MESHES / "box.geo"}";\n')
    mesh = read_mesh(tmp_path / "outer.geo", numbers={"x": 3.0, "nx": 1}, order=1)
    assert mesh.points[:, 0].max() == 3.0


@pytest.mark.parametrize("line", ["x = 2;", "x = DefineNumber[2];"])
def test_a_number_that_a_script_sets_itself_is_no_parameter(tmp_path, line):
    """Gmsh takes the script's, and the mesh would be of another size than is asked for."""
    script = (MESHES / "box.geo").read_text().replace("x = 1, y", "y")
    (tmp_path / "own.geo").write_text(line + script)
    assert read_mesh(tmp_path / "own.geo", order=1).points[:, 0].max() == 2.0
    with pytest.raises(
        InputError, match=r"own.geo sets x itself, whatever is given for it: x = .*DefineConstant\[ x = "
    ):
        read_mesh(tmp_path / "own.geo", numbers={"x": 3.0}, order=1)
    (tmp_path / "own.geo").write_text(f"If (!Exists(x))\n{line}\nEndIf\n{script}")
    assert read_mesh(tmp_path / "own.geo", numbers={"x": 3.0}, order=1).points[:, 0].max() == 3.0


def test_arguments_that_would_be_ignored(written_by_gmsh):
    with pytest.raises(InputError, match="meshed already"):
        read_mesh(written_by_gmsh / "tet4.msh", size=0.1)
    for order in (1, 2):
        with pytest.raises(InputError, match=f"meshed already, .* elements of order {order} where the file is made"):
            read_mesh(written_by_gmsh / "tet4.msh", order=order)
    with pytest.raises(InputError, match=r"only \.geo scripts have"):
        read_mesh(written_by_gmsh / "tet4.msh", numbers={"x": 1.0})


def test_missing_file():
    with pytest.raises(InputError, match=r"nowhere\.msh does not exist"):
        read_mesh("nowhere.msh")


def test_syntax_errors_are_quoted_from_gmsh(tmp_path):
    (tmp_path / "bad.geo").write_text('SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 1, 1};\n')
    with pytest.raises(InputError, match=r"line 2.*[Bb]ox"):
        read_mesh(tmp_path / "bad.geo")


def test_last_line_that_gmsh_would_ignore(tmp_path):
    (tmp_path / "a.geo").write_text('SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 1, 1, 1};')
    with pytest.raises(InputError, match=r"last line of .*does not end with a line break"):
        read_mesh(tmp_path / "a.geo")


def test_surface_geometry_is_refused(tmp_path):
    (tmp_path / "flat.geo").write_text('SetFactory("OpenCASCADE");\nRectangle(1) = {0, 0, 0, 1, 1};\n')
    with pytest.raises(ComputationError, match="no volume"):
        read_mesh(tmp_path / "flat.geo")


@pytest.mark.parametrize(
    ("worker", "message"),
    [
        ("import os; os.kill(os.getpid(), 11)", "gmsh ended with code -11"),
        ("import sys; print('Error   : tetrahedra everywhere', file=sys.stderr); sys.exit(4)", "tetrahedra everywhere"),
        ("import sys; print('libGLU.so.1: cannot open', file=sys.stderr); sys.exit(3)", "libGLU.so.1.*libglu1-mesa"),
    ],
)
def test_a_gmsh_that_crashes_fails_or_cannot_be_loaded(worker, message, tmp_path, monkeypatch):
    (tmp_path / "worker.py").write_text(worker)
    monkeypatch.setattr(gmsh_source.gmsh_process, "__file__", str(tmp_path / "worker.py"))
    with pytest.raises(ComputationError, match=message):
        read_mesh(MESHES / "box.geo")


def test_a_gmsh_that_crashes_once_is_run_again(tmp_path, monkeypatch):
    process = gmsh_source.gmsh_process.__file__
    crashes = f"""
import os, pathlib, runpy
try:
    pathlib.Path({str(tmp_path / "ran")!r}).touch(exist_ok=False)
except FileExistsError:
    runpy.run_path({process!r}, run_name="__main__")
else:
    os.kill(os.getpid(), 6)
"""
    (tmp_path / "worker.py").write_text(crashes)
    monkeypatch.setattr(gmsh_source.gmsh_process, "__file__", str(tmp_path / "worker.py"))
    assert len(read_mesh(MESHES / "box.geo").points) > 0


def test_a_gmsh_that_does_not_end_is_stopped(tmp_path, monkeypatch):
    (tmp_path / "worker.py").write_text("import time; time.sleep(60)")
    monkeypatch.setattr(gmsh_source.gmsh_process, "__file__", str(tmp_path / "worker.py"))
    with mesher_time_limit(0.5), pytest.raises(ComputationError, match=r"within 0\.5 s"):
        read_mesh(MESHES / "box.geo")


# ---- meshes are data, scripts are programs --------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".msh", ".unv", ".med", ".step", ".Step", ".iges", ".brep"])
def test_a_script_under_the_name_of_data_is_not_run(suffix, tmp_path):
    trace, path = tmp_path / "trace", tmp_path / f"mesh{suffix}"
    path.write_text(f'SystemCall "touch {trace}";\nSetFactory("OpenCASCADE");\nBox(1) = {{0, 0, 0, 1, 1, 1}};\n')
    with pytest.raises(InputError, match="not what its ending says"):
        read_mesh(path)
    assert not trace.exists()


def test_options_beside_a_mesh_are_not_run(tmp_path):
    path, trace = tmp_path / "box.msh", tmp_path / "trace"
    meshio.write(path, meshio.Mesh(*corner_tetrahedron()), file_format="gmsh")
    (tmp_path / "box.msh.opt").write_text(f'SystemCall "touch {trace}";\n')
    assert len(read_mesh(path).points) == 4
    assert not trace.exists()


def corner_tetrahedron():
    return np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), [("tetra", np.arange(4)[None])]


@pytest.mark.slow
def test_what_a_script_starts_ends_with_its_time(tmp_path):
    path = tmp_path / "endless.geo"
    path.write_text('SystemCall "sleep 60";\nSetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 1, 1, 1};\n')
    with mesher_time_limit(3.0), pytest.raises(ComputationError, match="mesher-timeout"):
        read_mesh(path)


@pytest.mark.parametrize(("unit", "scale"), [(None, 1e-3), ("m", 1e-3), ("mm", 1e-3), ("cm", 1e-3)])
def test_a_script_that_merges_a_step_file_scales_it_once(unit, scale, tmp_path):
    """The STEP file declares millimetres, whatever the unit of the script's own numbers."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        gmsh.model.occ.addBox(0, 0, 0, 20, 3, 2)
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "box.step"))
    finally:
        gmsh.finalize()
    script = tmp_path / "box.geo"
    script.write_text('SetFactory("OpenCASCADE");\nMerge "box.step";\nPhysical Volume("body") = {1};\n')
    mesh = read_mesh(script, unit=unit, order=1)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), scale * np.array([20, 3, 2]), rtol=1e-9)


def test_a_script_with_an_iges_file_needs_millimetres(tmp_path):
    (tmp_path / "part.geo").write_text('Merge "part.igs";\n')
    with pytest.raises(InputError, match="give the unit mm"):
        read_mesh(tmp_path / "part.geo")


@pytest.mark.parametrize("size", [1e-5, 1e-9])
def test_a_size_in_another_unit_is_told_at_once(size, tmp_path):
    with mesher_time_limit(60.0), pytest.raises(InputError, match="in the unit of the file"):
        read_mesh(MESHES / "connecting_rod.geo", unit="mm", size=size)


# ---- formats whose readers find no end ------------------------------------------------------------------------------


@pytest.mark.parametrize(("ending", "kind"), [("ele", "tetgen"), ("dat", "tecplot")])
def test_files_cut_off_of_which_meshio_reads_for_ever_are_refused(tmp_path, monkeypatch, ending, kind):
    mesh = box_mesh("tet4", (1, 1, 1), (2, 1, 1))
    path = tmp_path / f"box.{ending}"
    meshio.Mesh(mesh.points, [("tetra", mesh.blocks[0].nodes)]).write(path, file_format=kind)
    assert read_mesh(path).blocks[0].kind == "tet4"
    text = path.read_text()
    path.write_text(text[: len(text) // 2 if ending == "dat" else 20])
    monkeypatch.setattr("ffr_prep.mesh.meshio_files._PATIENCE", 0.5)
    with pytest.raises(InputError, match=r"cannot be read as a mesh .* is it complete"):
        read_mesh(path)
