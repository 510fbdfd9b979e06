"""Interfaces: what the two kinds of tie mean, and every guard."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import KINDS, STEEL, box_mesh, moved, rigid_motions, rotation

from ffr_prep.common.errors import InputError
from ffr_prep.mesh.geometry.face import Face
from ffr_prep.mesh.mesh import Block, Mesh
from ffr_prep.mesh.shapes import face_mass
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple
from ffr_prep.solids.model import from_mesh

SIZE = (1.0, 0.3, 0.2)


def coupled(mesh, *interfaces):
    return couple(mesh, assemble(mesh, STEEL), interfaces)


def turned_box(kind="tet10", cells=(3, 2, 2)):
    return moved(box_mesh(kind, SIZE, cells), rotation(2), np.array([0.5, -2.0, 1.0]))


# ---- laws ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_motions_pass_through_both_kinds_of_interface(kind):
    mesh = turned_box(kind)
    model = coupled(mesh, InterfaceRegion("left"), InterfaceRegion("right", kind="mean", point=(0.1, 0.2, 0.3)))
    about_centre = rigid_motions(mesh.points - model.centre).reshape(-1, 6)
    np.testing.assert_allclose(model.B @ model.T, about_centre, rtol=0, atol=1e-13)
    assert np.abs(model.K @ model.T).max() < 1e-13 * np.abs(model.K.data).max()
    expected = []
    for position in model.positions:
        at = rigid_motions(position[None] - model.centre)[0]
        expected += [at, np.hstack([np.zeros((3, 3)), np.eye(3)])]
    np.testing.assert_allclose(model.C @ model.T, np.vstack(expected), rtol=0, atol=1e-12)


def test_a_rigid_interface_moves_its_region_as_one_piece():
    mesh = turned_box()
    model = coupled(mesh, InterfaceRegion("left"))
    z = np.random.default_rng(0).normal(size=model.B.shape[1])
    nodes = np.unique(mesh.face_groups["left"][0])
    t, turn = (model.C @ z).reshape(2, 3)
    u = (model.B @ z).reshape(-1, 3)
    np.testing.assert_allclose(u[nodes], t + np.cross(turn, mesh.points[nodes] - model.positions[0]), atol=1e-13)
    others = np.setdiff1d(np.arange(len(mesh.points)), nodes)
    np.testing.assert_array_equal(u[others].ravel(), z[: 3 * len(others)])


def test_a_mean_interface_is_the_closest_rigid_motion_over_the_area():
    mesh = turned_box("hex20")
    model = coupled(mesh, InterfaceRegion("right", kind="mean", point=(0.3, -1.0, 0.0)))
    u = np.random.default_rng(1).normal(size=mesh.points.shape)
    six = model.C @ u.ravel()
    (faces,) = mesh.face_groups["right"]
    motions = rigid_motions(mesh.points - model.positions[0])
    misfit = u - motions @ six
    weights = face_mass(mesh.points, faces)
    # Stationarity of the weighted square of the misfit: it does no work on any rigid motion.
    work = np.einsum("fab,fac,fbci->i", weights, misfit[faces], motions[faces])
    assert np.abs(work).max() < 1e-14
    assert np.einsum("fab,fac,fbc->", weights, misfit[faces], misfit[faces]) > 1e-3


def test_a_mean_interface_passes_forces_on_without_stiffening():
    """The nodal forces C^T f have the resultant and the moment of f about the point, and the stiffness is untouched."""
    mesh = turned_box()
    model = coupled(mesh, InterfaceRegion("right", kind="mean", point=(0.0, 0.1, 0.2)))
    force, moment = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.2, -0.7])
    nodal = (model.C.T @ np.concatenate([force, moment])).reshape(-1, 3)
    np.testing.assert_allclose(nodal.sum(axis=0), force, atol=1e-12)
    arms = mesh.points - model.positions[0]
    np.testing.assert_allclose(np.cross(arms, nodal).sum(axis=0), moment, atol=1e-12)
    assert abs(model.K - assemble(mesh, STEEL).K).max() == 0


def test_the_point_is_the_area_centroid_whatever_the_mesh():
    # Squeezing the nodes to one side moves their mean, not the centroid of the face.
    mesh = box_mesh(
        "hex8", SIZE, (2, 4, 4), mapped=lambda p: np.column_stack([p[:, 0], 0.3 * (p[:, 1] / 0.3) ** 2, p[:, 2]])
    )
    model = coupled(mesh, InterfaceRegion("left"), InterfaceRegion("far end", region="right", kind="mean"))
    np.testing.assert_allclose(model.positions, [[0, 0.15, 0.1], [1, 0.15, 0.1]], atol=1e-14)
    assert model.names == ("left", "far end")


def test_a_node_group_has_equal_weights():
    mesh = box_mesh("tet10", SIZE, (2, 1, 1))
    nodes = np.array([0, 3, 7, 20])
    mesh = replace(mesh, node_groups={"some": nodes})
    model = coupled(mesh, InterfaceRegion("some", kind="mean"))
    np.testing.assert_allclose(model.positions[0], mesh.points[nodes].mean(axis=0), atol=1e-15)
    u = np.random.default_rng(2).normal(size=mesh.points.shape)
    np.testing.assert_allclose((model.C @ u.ravel())[:3], u[nodes].mean(axis=0), atol=1e-14)


def test_without_interfaces_the_coordinates_are_the_nodes():
    mesh = box_mesh("tet4", SIZE, (1, 1, 1))
    model = coupled(mesh)
    assert abs(model.K - assemble(mesh, STEEL).K).max() == 0
    assert model.C.shape == (0, 24)
    assert model.positions.shape == (0, 3)


def test_a_rigid_interface_may_join_two_parts():
    one, two = box_mesh("hex8", (1, 1, 1), (1, 1, 1)), box_mesh("hex8", (1, 1, 1), (1, 1, 1), origin=(2, 0, 0))
    points = np.vstack([one.points, two.points])
    nodes = np.vstack([one.blocks[0].nodes, two.blocks[0].nodes + 8])
    faces = np.vstack([one.face_groups["right"][0], two.face_groups["left"][0] + 8])
    mesh = Mesh(points, (Block("hex8", nodes),), {}, {"joint": (faces,)}, {})
    model = coupled(mesh, InterfaceRegion("joint"))
    np.testing.assert_allclose(model.positions, [[1.5, 0.5, 0.5]], atol=1e-14)


# ---- guards -------------------------------------------------------------------------------------------------------


def with_nodes(*nodes):
    return replace(box_mesh("tet10", SIZE, (2, 2, 2)), node_groups={"few": np.array(nodes)})


@pytest.mark.parametrize("kind", ["rigid", "mean"])
def test_a_region_of_two_nodes_is_refused(kind):
    with pytest.raises(InputError, match=r"region 'few' has 2 nodes; .* at least three"):
        coupled(with_nodes(0, 1), InterfaceRegion("pin", region="few", kind=kind))


@pytest.mark.parametrize("kind", ["rigid", "mean"])
def test_a_region_of_collinear_nodes_is_refused_and_its_line_named(kind):
    mesh = with_nodes(0)
    on_edge = np.flatnonzero((mesh.points[:, 1] == 0) & (mesh.points[:, 2] == 0))
    mesh = replace(mesh, node_groups={"few": on_edge})
    with pytest.raises(InputError, match=r"one line through \(0.5, 0, 0\) m along \(-?1, 0, 0\).*undetermined"):
        coupled(mesh, InterfaceRegion("hinge", region="few", kind=kind))


def test_rigid_regions_must_not_share_nodes():
    mesh = box_mesh("hex8", SIZE, (2, 1, 1))
    with pytest.raises(InputError, match="'left' and 'top' share 2 nodes"):
        coupled(mesh, InterfaceRegion("left"), InterfaceRegion("top"))
    coupled(mesh, InterfaceRegion("left"), InterfaceRegion("top", kind="mean"))


def test_an_interface_needs_motion_of_its_own():
    mesh = box_mesh("hex8", SIZE, (2, 1, 1))
    with pytest.raises(InputError, match="'same' moves only with interfaces already given \\('left'\\)"):
        coupled(mesh, InterfaceRegion("left"), InterfaceRegion("same", region="left", kind="mean"))


def test_names_and_kinds_are_checked():
    mesh = box_mesh("hex8", SIZE, (2, 1, 1))
    with pytest.raises(InputError, match="'left' is given more than once"):
        coupled(mesh, InterfaceRegion("left"), InterfaceRegion("left", region="right"))
    with pytest.raises(InputError, match="'nowhere'"):
        coupled(mesh, InterfaceRegion("nowhere"))
    with pytest.raises(InputError, match="kind is 'glued'; it must be 'rigid' or 'mean'"):
        InterfaceRegion("left", kind="glued")
    with pytest.raises(InputError, match="three finite numbers"):
        InterfaceRegion("left", point=(0.0, np.nan, 0.0))


# ---- places of a geometry --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("exact", "facets", "own"), [(True, 1, False), (True, 2, True), (False, 2, False), (True, 2, False)]
)
def test_whole_faces_of_a_geometry_have_their_point_where_it_has_their_centroid(exact, facets, own):
    """Not so faces of which an interface has a part, those that only their mesh knows, and interfaces with points of their
    own."""
    mesh, there, point = box_mesh("hex8", SIZE, (3, 2, 2)), np.array([0.0, 0.151, 0.099]), (0.1, 0.0, 0.0)
    (left,) = mesh.face_groups["left"]
    drawn = (Face("surface_1", "plane", there, 0.06, exact=exact), (left,))
    groups = {**mesh.face_groups, "some": (left[: 2 * facets],)}
    mesh = replace(mesh, drawn=(drawn,), face_groups=groups)
    model = from_mesh(mesh, STEEL, [InterfaceRegion("some", point=point if own else None)])
    taken = (
        point if own else there if exact and facets == 2 else mesh.points[np.unique(left[: 2 * facets])].mean(axis=0)
    )
    np.testing.assert_allclose(model.coupled.positions[0], taken, atol=1e-12)
