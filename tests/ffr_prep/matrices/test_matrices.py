"""Bodies from outside matrices: laws of the nodal inertia, agreement with the project's own bodies, every guard."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from boxes import STEEL, box_mesh, rotation
from matrix_models import bar, lumped, of_frame, of_solid, rod, space_frame

import ffr_prep as fp
from ffr_prep.body import FlexibleBody, axial, load_body, save_body
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.progress import no_stages
from ffr_prep.matrices.interfaces import couple_matrices, tie_matrices
from ffr_prep.matrices.model import (
    MatrixModel,
    group_nodes,
    in_si,
    with_group,
    with_node,
    with_surface,
    without_empty_rows,
)
from ffr_prep.matrices.nodal_inertia import DofMap, nodal_integrals, rigid_motions, scalar_integrals, scalar_mass
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS, UnitSystem
from ffr_prep.mesh.mesh import Block, Mesh, surface_triangles
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, UserConditions
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.sections import rectangle

ENDS = (InterfaceRegion("root"), InterfaceRegion("tip"))
SIDES = (InterfaceRegion("left"), InterfaceRegion("right", kind="mean"))
EXACT = ("mass", "r_dm", "rr_dm", "P_dm", "I4", "omega2")


def reduced(model, interfaces=(), reference=None, reduction=None, progress=no_stages, **settings) -> FlexibleBody:
    return fp.reduce(
        fp.from_matrices(model, interfaces, progress=progress),
        fp.Request(name="body", reference=reference or MeanAxis(), reduction=reduction or Eigenmodes(3), **settings),
        progress=progress,
    )


def orthonormal(M: sp.csr_array, n: int) -> np.ndarray:
    """(D, n) random mass-orthonormal modes."""
    raw = np.random.default_rng(1).normal(size=(M.shape[0], n))
    return scipy.linalg.solve_triangular(np.linalg.cholesky(raw.T @ (M @ raw)), raw.T, lower=True).T


def assert_close(one, two, tolerance):
    scale = max(np.abs(one).max(initial=0.0), np.abs(two).max(initial=0.0), 1e-300)
    np.testing.assert_allclose(one, two, rtol=0, atol=tolerance * scale)


@pytest.fixture(scope="module")
def frame_model():
    return of_frame(space_frame())


@pytest.fixture(scope="module")
def solid_model():
    return bar()


# ---- laws of the inertia ------------------------------------------------------------------------------------------


def test_both_routes_agree_for_a_scalar_mass(solid_model):
    Phi = orthonormal(solid_model.M, 5)
    dofs = solid_model.dofs
    m = scalar_mass(solid_model.M, dofs)
    exact = scalar_integrals(solid_model.points, dofs, m, Phi)
    general, defect = nodal_integrals(solid_model.points, dofs, solid_model.M, Phi)
    for name, value in vars(exact).items():
        assert_close(getattr(general, name), value, 1e-12)
    assert defect.max() < 1e-12


def test_a_scalar_mass_is_recognised(solid_model, frame_model):
    assert scalar_mass(frame_model.M, frame_model.dofs) is None
    assert scalar_mass(lumped(frame_model), frame_model.dofs) is not None
    rotary = lumped(frame_model) + sp.diags_array(np.where(frame_model.components < 3, 0.0, 1e-3))
    assert scalar_mass(sp.csr_array(rotary), frame_model.dofs) is None
    uneven = solid_model.M + sp.diags_array(np.where(solid_model.components == 0, 1e-3, 0.0))
    assert scalar_mass(sp.csr_array(uneven), solid_model.dofs) is None


@pytest.mark.parametrize("make", [lambda: of_frame(space_frame()), bar], ids=["frame", "solid"])
def test_the_kinetic_energy_is_that_of_the_nodes(make):
    """Undeformed, moving and turning and deforming at once; rotary inertia included."""
    model = make()
    rng = np.random.default_rng(2)
    Phi = orthonormal(model.M, 4)
    T = rigid_motions(model.points, model.dofs)
    for _ in range(3):
        v, omega, rate = rng.normal(size=3), rng.normal(size=3), rng.normal(size=4)
        nodal = T @ np.concatenate([v, omega]) + Phi @ rate
        integrals, _ = nodal_integrals(model.points, model.dofs, model.M, Phi)
        J = np.trace(integrals.rr_dm) * np.eye(3) - integrals.rr_dm
        energy = integrals.mass * v @ v / 2 + v @ np.cross(omega, integrals.r_dm) + omega @ J @ omega / 2
        energy += v @ integrals.P_dm @ rate + omega @ axial(integrals.rP_dm) @ rate + rate @ rate / 2
        assert energy == pytest.approx(nodal @ (model.M @ nodal) / 2, rel=1e-12)


def test_the_kinetic_energy_of_the_deformed_solid_is_that_of_its_nodes(solid_model):
    rng = np.random.default_rng(3)
    Phi, dofs = orthonormal(solid_model.M, 4), solid_model.dofs
    integrals, _ = nodal_integrals(solid_model.points, dofs, solid_model.M, Phi)
    omega, q = rng.normal(size=3), rng.normal(size=4)
    at = solid_model.points + dofs.on_nodes(Phi)[:, :3] @ q
    nodal = np.cross(omega, at).ravel()
    W = integrals.rr_dm + integrals.rP_dm @ q + (integrals.rP_dm @ q).T
    W = W + np.einsum("klij,i,j->kl", integrals.PP_dm, q, q)
    J = np.trace(W) * np.eye(3) - W
    assert omega @ J @ omega == pytest.approx(nodal @ (solid_model.M @ nodal), rel=1e-12)


def test_the_integrals_of_a_frame_have_the_symmetries_of_integrals(frame_model):
    Phi = orthonormal(frame_model.M, 4)
    integrals, _ = nodal_integrals(frame_model.points, frame_model.dofs, frame_model.M, Phi)
    assert_close(integrals.PP_dm, integrals.PP_dm.transpose(1, 0, 3, 2), 1e-14)
    assert_close(np.einsum("kkij->ij", integrals.PP_dm), np.eye(4), 1e-12)


def test_point_masses_with_rotary_inertia():
    """J = sum of J_n + m_n (|x|^2 I - x x^T): the rotary inertia of the nodes counts."""
    rng = np.random.default_rng(4)
    points, masses = rng.normal(size=(5, 3)), rng.uniform(1, 2, 5)
    rotary = [a @ a.T for a in rng.normal(size=(5, 3, 3))]
    dofs = DofMap(np.repeat(np.arange(5), 6), np.tile(np.arange(6), 5), 5)
    blocks = [scipy.linalg.block_diag(m * np.eye(3), J) for m, J in zip(masses, rotary, strict=True)]
    M = sp.csr_array(sp.block_diag([sp.coo_array(block) for block in blocks]))
    integrals, _ = nodal_integrals(points, dofs, M, np.zeros((30, 0)))
    parts = zip(masses, points, rotary, strict=True)
    J = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) + of_node for m, x, of_node in parts)
    assert_close(np.trace(integrals.rr_dm) * np.eye(3) - integrals.rr_dm, J, 1e-14)
    assert_close(integrals.r_dm, masses @ points, 1e-14)


# ---- the project's own bodies, from matrices ----------------------------------------------------------------------


@pytest.mark.parametrize("reference", [FixedTo("a"), SimplySupported("a", "b"), MeanAxis()])
def test_a_frame_from_its_matrices(frame_model, reference):
    interfaces, settings = (
        [InterfaceRegion("a"), InterfaceRegion("b")],
        {"reference": reference, "reduction": CraigBampton(4)},
    )
    own = fp.reduce(fp.from_frame(space_frame(), interfaces), fp.Request(name="body", **settings))
    body = reduced(frame_model, interfaces, **settings)
    scale = {"P_dm": np.sqrt(own.mass), "I4": np.sqrt(np.trace(own.rr_dm))}
    for name in EXACT:
        value = getattr(own, name)
        allowed = 1e-10 * scale.get(name, np.abs(value).max())
        np.testing.assert_allclose(getattr(body, name), value, rtol=0, atol=allowed, err_msg=name)
    for one, two in zip(own.interfaces, body.interfaces, strict=True):
        assert one.kind == two.kind == "node"
    for part in ("phi_t", "phi_r"):
        assert_close(*(np.stack([getattr(i, part) for i in b.interfaces]) for b in (own, body)), 1e-10)


def test_what_a_frame_mass_does_not_say_is_small_for_slender_beams():
    """First three bending pairs of a rod 1 m long, 5 mm thick, 32 elements: rP_dm to 1e-6 and PP_dm to 6e-3 of 1.

    In the planes of the axes; in planes between them the same error is spread over more entries.
    """
    frame = rod(rectangle(0.005, 0.005), 1.0, 32)
    settings = {"reference": FixedTo("root"), "reduction": Eigenmodes(6)}
    own, body = (
        fp.reduce(fp.from_frame(frame, ENDS[:1]), fp.Request(name="body", **settings)),
        reduced(of_frame(frame), ENDS[:1], **settings),
    )
    assert np.abs(own.rP_dm - body.rP_dm).max() < 1e-6
    assert np.abs(own.PP_dm - body.PP_dm).max() < 6e-3
    assert body.provenance["warnings"] == []


def test_the_error_of_the_frame_falls_with_the_elements():
    errors = []
    for elements in (8, 16, 32):
        frame = rod(rectangle(0.005, 0.005), 1.0, elements)
        settings = {"reference": FixedTo("root"), "reduction": Eigenmodes(4)}
        own, body = (
            fp.reduce(fp.from_frame(frame, ENDS[:1]), fp.Request(name="body", **settings)),
            reduced(of_frame(frame), ENDS[:1], **settings),
        )
        errors.append(np.abs(own.PP_dm - body.PP_dm).max())
    assert errors[1] < errors[0] / 2.5
    assert errors[2] < errors[1] / 2.5


def test_doubtful_coordinates_are_named(frame_model):
    """Torsion of the members and waves as short as the two or three elements of a member."""
    body = reduced(frame_model, [InterfaceRegion("a")], FixedTo("a"), Eigenmodes(12))
    (warning,) = body.provenance["warnings"]
    assert "the mass matrix does not say" in warning
    assert "12 (" in warning


@pytest.mark.parametrize("reference", [FixedTo("left"), MeanAxis()])
def test_a_solid_from_its_matrices(reference):
    mesh = box_mesh("hex20", (1.0, 0.1, 0.06), (4, 1, 1))
    model = of_solid(mesh)
    by_nodes = replace(mesh, face_groups={}, node_groups=dict(model.groups))
    settings = {"reference": reference, "reduction": CraigBampton(4)}
    own = fp.reduce(fp.from_mesh(by_nodes, STEEL, SIDES), fp.Request(name="body", **settings))
    points, triangles = surface_triangles(mesh)
    body = reduced(with_surface(model, mesh.points[points], triangles), SIDES, **settings)
    for name in (*EXACT, "rP_dm", "PP_dm"):
        scale = np.sqrt(own.mass) if name in ("P_dm", "I4") else np.abs(getattr(own, name)).max()
        np.testing.assert_allclose(getattr(body, name), getattr(own, name), rtol=0, atol=1e-8 * scale, err_msg=name)
    for one, two in zip(own.interfaces, body.interfaces, strict=True):
        assert one.kind == two.kind
        assert_close(one.position, two.position, 1e-12)
    for part in ("phi_t", "phi_r"):
        assert_close(*(np.stack([getattr(i, part) for i in b.interfaces]) for b in (own, body)), 1e-8)
    assert_close(own.surface.Phi, body.surface.Phi, 1e-8)
    np.testing.assert_array_equal(own.surface.triangles, body.surface.triangles)


def test_a_turned_frame_is_the_same_body_turned():
    R = rotation(7)
    settings = {"interfaces": [InterfaceRegion("a")], "reference": FixedTo("a"), "reduction": Eigenmodes(3)}
    one, two = (reduced(of_frame(space_frame(turned)), **settings) for turned in (None, R))
    assert_close(one.omega2, two.omega2, 1e-9)
    assert_close(R @ one.rr_dm @ R.T, two.rr_dm, 1e-12)
    S = np.einsum("ka,lb,abii->kli", R, R, one.PP_dm)
    assert_close(S, np.einsum("klii->kli", two.PP_dm), 1e-7)


def test_masses_on_one_line_have_no_inertia_about_it():
    frame = of_frame(rod(rectangle(0.02, 0.05), 1.0, 4))
    with pytest.raises(
        InputError, match=r"no inertia against rotation about the axis .* along \(1, 0, 0\): give it rotary"
    ):
        reduced(replace(frame, M=lumped(frame)), ENDS[:1], FixedTo("root"), Eigenmodes(2))


def test_lumped_masses_without_rotary_inertia(frame_model):
    """Frequencies are those of the statically condensed model, where M is definite."""
    model = replace(frame_model, M=lumped(frame_model))
    body = reduced(model, [InterfaceRegion("a"), InterfaceRegion("b")], FixedTo("a"), Eigenmodes(12))
    free = np.flatnonzero(model.nodes != group_nodes(model, "a")[0])
    moving = free[model.components[free] < 3]
    turning = free[model.components[free] >= 3]
    K, mass = model.K.toarray(), model.M.diagonal()[moving]
    K_mt = K[np.ix_(moving, turning)]
    condensed = K[np.ix_(moving, moving)] - K_mt @ np.linalg.solve(K[np.ix_(turning, turning)], K_mt.T)
    omega2 = scipy.linalg.eigh(condensed, np.diag(mass), eigvals_only=True)
    assert_close(body.omega2 / omega2[:12], np.ones(12), 1e-8)
    assert body.provenance["matrices"]["mass"] == "one scalar mass for x, y and z"


@pytest.mark.parametrize("reduction", [CraigBampton(4), Eigenmodes(4)])
def test_a_solid_with_a_lumped_mass(reduction):
    model = bar("hex8", (6, 2, 2))
    masses = np.asarray(model.M.sum(axis=1)).ravel()
    body = reduced(replace(model, M=sp.csr_array(sp.diags_array(masses))), SIDES, MeanAxis(), reduction)
    assert body.mass == pytest.approx(7850 * 0.006, rel=1e-12)
    assert_close(body.I6, np.eye(body.n), 1e-10)


def test_rotations_may_be_missing_where_nodes_have_none():
    """Solids in a table of six rows to a node, as some programs write them: empty rows are left out."""
    model = bar("hex8", (3, 1, 1))
    count = len(model.points)
    places = 6 * model.nodes + model.components
    spread = sp.csr_array((np.ones(places.size), (places, np.arange(places.size))), shape=(6 * count, places.size))
    six = MatrixModel(
        points=np.vstack([model.points, [[0.0, 0.0, 0.0]]]),
        K=sp.csr_array(spread @ model.K @ spread.T),
        M=sp.csr_array(spread @ model.M @ spread.T),
        nodes=np.repeat(np.arange(count), 6),
        components=np.tile(np.arange(6), count),
        groups={**model.groups, "alone": [count]},
    )
    one, two = (reduced(m, SIDES, FixedTo("left"), CraigBampton(2)) for m in (model, six))
    np.testing.assert_array_equal(one.omega2, two.omega2)
    assert f"{3 * count} rows without stiffness and mass are left out" in two.provenance["notes"]
    assert "1 nodes without rows are left out" in two.provenance["notes"]
    assert set(without_empty_rows(six).groups) == set(model.groups)


def test_interface_points_and_user_conditions(frame_model):
    """An interface away from its node moves with it as a rigid arm; user conditions act on translations."""
    arm = InterfaceRegion("a", point=(0.1, 0.3, -0.2))
    body = reduced(frame_model, [arm, InterfaceRegion("b")], FixedTo("b"), CraigBampton(2))
    plain = reduced(frame_model, [InterfaceRegion("a"), InterfaceRegion("b")], FixedTo("b"), CraigBampton(2))
    assert_close(body.omega2, plain.omega2, 1e-9)
    lever = np.cross(plain.interface("a").phi_r, [0.0, 0.3, -0.2], axis=0)
    assert_close(body.interface("a").phi_t, plain.interface("a").phi_t + lever, 1e-8)
    rows = np.zeros((9, len(frame_model.points), 3))
    for k in range(9):
        rows[k, 4 * (k // 3), k % 3] = 1.0
    body = reduced(frame_model, reference=UserConditions(rows))
    assert body.frequencies[0] > 1.0


@pytest.mark.parametrize("kind", ["rigid", "mean"])
def test_rigid_motions_pass_through_ties_and_interfaces(solid_model, kind):
    regions = [InterfaceRegion("left"), InterfaceRegion("right", kind=kind, point=(1.2, 0.0, 0.1))]
    ties = tie_matrices(solid_model, regions)
    coupled = couple_matrices(solid_model, regions, ties)
    about = rigid_motions(solid_model.points - coupled.centre, solid_model.dofs)
    assert_close(ties @ coupled.T, about, 1e-12)
    at = coupled.positions[1] - coupled.centre
    expected = np.vstack([np.hstack([np.eye(3), np.cross(at, np.eye(3))]), np.hstack([np.zeros((3, 3)), np.eye(3)])])
    assert_close((coupled.C @ coupled.T)[6:], expected, 1e-12)


def test_rigid_interface_of_a_frame_turns_its_nodes(frame_model):
    model = with_group(frame_model, "three", [1, 2, 3])
    ties = tie_matrices(model, [InterfaceRegion("three")])
    coupled = couple_matrices(model, [InterfaceRegion("three")], ties)
    assert coupled.kinds == ("rigid",)
    assert ties.shape[1] == 6 * 9 - 12
    assert_close(ties @ coupled.T, rigid_motions(model.points - coupled.centre, model.dofs), 1e-12)
    assert np.isnan(coupled.places[-6:]).all()


# ---- units, names, files ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mm-t-s", "mm-kg-ms", "in-lbf-s", "cm-g-s"])
def test_units_are_converted_once(frame_model, name):
    """A model written in other units is the same body; a force unit is mass length / time^2."""
    units = UNIT_SYSTEMS[name]
    back = UnitSystem(1 / units.length, 1 / units.mass, 1 / units.time)
    one, two = reduced(frame_model), reduced(in_si(in_si(frame_model, back), units))
    assert_close(one.omega2, two.omega2, 1e-9)
    assert_close(one.rr_dm, two.rr_dm, 1e-12)


def test_newton_and_millimetre_need_the_tonne():
    """In mm-t-s a stiffness of 1 N/mm is 1000 N/m, a bending stiffness N mm is 1e-3 N m, a rotary t mm^2 1e-3 kg m^2."""
    six = sp.csr_array(np.eye(6))
    model = in_si(MatrixModel(np.ones((1, 3)), six, six, np.zeros(6), np.arange(6)), UNIT_SYSTEMS["mm-t-s"])
    np.testing.assert_allclose(model.K.diagonal(), [1e3] * 3 + [1e-3] * 3, rtol=1e-14)
    np.testing.assert_allclose(model.M.diagonal(), [1e3] * 3 + [1e-3] * 3, rtol=1e-14)
    np.testing.assert_allclose(model.points, 1e-3)
    inch = UNIT_SYSTEMS["in-lbf-s"]
    assert inch.mass * inch.length / inch.time**2 == pytest.approx(4.4482216152605)


def test_the_body_says_where_it_comes_from_and_survives_its_file(frame_model, tmp_path):
    body = reduced(frame_model, provenance={"made": "here"})
    assert body.provenance["matrices"]["format"] == "frame"
    assert body.provenance["matrices"]["mass"] == "general, by rigid motions of the nodes"
    assert body.provenance["made"] == "here"
    assert any("the body is linear" in note for note in body.provenance["notes"])
    json.dumps(dict(body.provenance))
    assert body.surface is None
    assert body.stiffening is None
    loaded = load_body(save_body(body, tmp_path / "body.ffr"))
    np.testing.assert_array_equal(loaded.PP_dm, body.PP_dm)


def test_progress_is_told(solid_model):
    told = []
    reduced(solid_model, progress=told.append)
    assert told[0] == "check the matrices"
    assert told[-1] == "integrate the inertia"


def test_few_digits_are_warned_of(solid_model):
    K = solid_model.K.copy()
    K.data = np.array([float(f"{value:.8e}") for value in K.data])
    body = reduced(replace(solid_model, K=K))
    assert any("written with few digits" in warning for warning in body.provenance["warnings"])


# ---- guards of the model ------------------------------------------------------------------------------------------


def small(**changes) -> MatrixModel:
    """Two nodes with three rows each."""
    fields = {
        "points": np.eye(2, 3),
        "K": np.eye(6),
        "M": np.eye(6),
        "nodes": np.repeat([0, 1], 3),
        "components": np.tile(np.arange(3), 2),
    }
    return MatrixModel(**{**fields, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"K": np.eye(6) * (1 + 0.02j)}, "K is complex; give its real part"),
        ({"points": np.zeros((2, 2))}, r"nodes have the shape \(2, 2\)"),
        ({"K": np.eye(5)}, "K is 5 x 5, but the table of nodal coordinates has 6 rows"),
        ({"M": np.eye(7)}, "M is 7 x 7"),
        ({"K": np.diag([1, 1, np.nan, 1, 1, 1])}, "K holds values that are not finite"),
        ({"points": np.array([[0, 0, 0], [np.inf, 0, 0]])}, "node 2 has coordinates that are not finite"),
        ({"labels": [1, 2, 3]}, "there are 2 nodes, but 3 labels"),
        ({"components": np.arange(3)}, "6 rows have a node, but 3 have a component"),
        ({"nodes": [0, 0, 0, 2, 2, 2]}, "row 4 belongs to node index 2; there are 2 nodes"),
        ({"components": [0, 1, 2, 0, 1, 6]}, "row 6 is coordinate 7 of its node"),
        ({"components": [0, 1, 2, 0, 1, 1]}, r"rows 5 and 6 are both translation along y of node 2"),
        ({"groups": {"far": [2]}}, "'far' names node index 2"),
        ({"triangles": [[0, 1, 2]]}, "'surface' names node index 2"),
    ],
)
def test_models_that_do_not_fit(changes, message):
    with pytest.raises(InputError, match=message):
        small(**changes)


def test_names_for_nodes(solid_model):
    assert group_nodes(with_group(solid_model, "two", [2, 5]), "two").tolist() == [1, 4]
    at = tuple(solid_model.points[3])
    assert group_nodes(with_node(solid_model, "one", at), "one").tolist() == [3]
    with pytest.raises(InputError, match=r"there is no node 9999; the \d+ nodes are 1, 2, 3, 4, 5, \.\.\."):
        with_group(solid_model, "two", [9999])
    with pytest.raises(InputError, match=r"no node at \(5.0, 0.0, 0.0\) m; the nearest is node"):
        with_node(solid_model, "one", (5.0, 0.0, 0.0))
    with pytest.raises(InputError, match="did you mean 'left'"):
        group_nodes(solid_model, "lleft")


def test_a_surface_that_is_not_of_the_model(solid_model):
    with pytest.raises(InputError, match="the surface does not fit the nodes"):
        with_surface(solid_model, solid_model.points * 1000, np.array([[0, 1, 2]]))
    empty = small(triangles=[[0, 1, 1]], K=np.diag([1.0, 1, 1, 0, 0, 0]), M=np.diag([1.0, 1, 1, 0, 0, 0]))
    with pytest.raises(InputError, match=r"the surface has node 2 .* which has no row"):
        without_empty_rows(empty)


# ---- guards of the matrices ---------------------------------------------------------------------------------------


def added(A: sp.csr_array, *entries: tuple[int, int, float]) -> sp.csr_array:
    rows, columns, values = zip(*entries, strict=True)
    return sp.csr_array(A + sp.coo_array((values, (rows, columns)), shape=A.shape))


def rejected(model: MatrixModel, message: str, interfaces=(), error=InputError, **settings) -> None:
    with pytest.raises(error, match=message):
        reduced(model, interfaces, **settings)


@pytest.mark.parametrize("name", ["K", "M"])
def test_matrices_must_be_symmetric(solid_model, name):
    A = getattr(solid_model, name)
    wrong = added(A, (0, 3, 0.01 * A.diagonal()[0]))
    rejected(
        replace(solid_model, **{name: wrong}),
        f"{name} is not symmetric: its entries for .* along x of node 1 ",
    )


def test_a_planar_model_is_not_a_body(solid_model):
    rows = np.flatnonzero((solid_model.nodes != 7) | (solid_model.components != 2))
    planar = MatrixModel(
        solid_model.points,
        solid_model.K[rows][:, rows],
        solid_model.M[rows][:, rows],
        solid_model.nodes[rows],
        solid_model.components[rows],
    )
    rejected(
        planar,
        r"node 8 .* has no row for translation along z \(1 such nodes\): it is supported",
    )


def test_masses_must_be_positive(solid_model):
    M = solid_model.M
    rejected(
        replace(solid_model, M=added(M, (4, 4, -2 * M.diagonal()[4]))), "M has the negative mass .* along y of node 2"
    )
    large = 3 * M.diagonal()[[0, 3]].max()
    rejected(
        replace(solid_model, M=added(M, (0, 3, large), (3, 0, large))), "some motions have a negative kinetic energy"
    )
    rejected(replace(solid_model, M=sp.csr_array(M.shape)), "the mass of the model is 0 kg")


def test_a_massless_row_must_not_be_coupled(frame_model):
    M = lumped(frame_model)
    coupled = added(M, (0, 3, 0.1), (3, 0, 0.1))
    rejected(replace(frame_model, M=coupled), "rotation about x of node 1 .* has no mass of its own, but is coupled")


def test_the_mass_must_be_one(frame_model):
    M = frame_model.M
    rejected(
        replace(frame_model, M=added(M, (0, 0, 5.0))), r"the mass differs by direction: \(27.67, 22.67, 22.67\) kg"
    )
    moment = 0.01
    twisted = added(lumped(frame_model), (0, 3, moment), (3, 0, moment), (3, 3, 1.0))
    rejected(replace(frame_model, M=twisted), "the first moment of the mass is not one vector")


def test_a_supported_model_is_refused(solid_model):
    grounded = added(solid_model.K, (1, 1, 1e6))
    rejected(replace(solid_model, K=grounded), "K resists the rigid .* the model is supported, so give the free body")
    shuffled = replace(solid_model, points=np.roll(solid_model.points, 1, axis=0))
    rejected(shuffled, "K resists the rigid rotation")


def test_a_model_in_two_parts_is_refused(solid_model):
    K, count = solid_model.K, len(solid_model.points)
    two = MatrixModel(
        np.vstack([solid_model.points, np.add(solid_model.points[:4], (0, 0, 5))]),
        sp.block_diag([K, sp.csr_array((12, 12))]),
        sp.block_diag([solid_model.M, sp.eye_array(12)]),
        np.concatenate([solid_model.nodes, np.repeat(count + np.arange(4), 3)]),
        np.concatenate([solid_model.components, np.tile(np.arange(3), 4)]),
    )
    rejected(
        two, f"falls into 5 parts that nothing connects; the smallest holds translation along x of node {count + 1} "
    )


def hinged() -> MatrixModel:
    """Two cubes that share an edge along z."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    one = np.vstack([corner, np.add(corner, (0, 0, 1))])
    two = np.add(one, (1, 1, 0))[[1, 2, 3, 5, 6, 7]]
    nodes = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [2, 8, 9, 10, 6, 11, 12, 13]])
    mesh = Mesh(np.vstack([one, two]), (Block("hex8", nodes),), {}, {}, {})
    return of_solid(mesh)


def test_a_mechanism_is_named():
    """The hinge turns without energy: one motion beside the six, largest at the far corners."""
    with pytest.raises(
        InputError, match="K has 1 motions without energy beside the six rigid ones; the first moves"
    ) as e:
        reduced(hinged())
    label = int(str(e.value).split(" of node ")[1].split()[0])
    assert np.linalg.norm(hinged().points[label - 1][:2] - [1, 1]) > 0.9


def test_a_rotation_without_stiffness_is_named(frame_model):
    """A node that floats with its inertia: the translations are held, a rotation is not."""
    row = 6 * 4 + 5
    K = frame_model.K.tolil()
    K[row, :] = 0
    K[:, row] = 0
    K = sp.csr_array(K)
    rejected(replace(frame_model, K=K), "K resists the rigid rotation|nothing connects")


def test_an_indefinite_stiffness_is_refused(solid_model):
    """A spring of negative stiffness between two nodes, along their line: no force under rigid motion."""
    i, j = (3 * int(group_nodes(solid_model, name)[0]) for name in ("left", "right"))
    k = solid_model.K.diagonal()[[i, j]].min() / 2
    K = added(solid_model.K, (i, i, -k), (j, j, -k), (i, j, k), (j, i, k))
    rejected(replace(solid_model, K=K), "K is not positive: some motions have a negative energy")


def test_a_failed_factorisation_without_a_mechanism_stays_what_it_is(solid_model, monkeypatch):
    def fails(*_):
        raise ComputationError("the factorisation failed")

    monkeypatch.setattr("ffr_prep.pipelines.reduce.factorised", fails)
    rejected(solid_model, "the factorisation failed", error=ComputationError)


def test_a_loose_coordinate_is_named_when_the_factorisation_fails(frame_model):
    from ffr_prep.matrices.checks import check_mechanisms

    ties = tie_matrices(frame_model, [])
    coupled = couple_matrices(frame_model, [], ties)
    K = coupled.K - sp.diags_array(np.where(np.arange(54) == 9, coupled.K.diagonal(), 0.0))
    with pytest.raises(InputError, match=r"K gives rotation about x of node 2 .* no stiffness"):
        check_mechanisms(frame_model, replace(coupled, K=sp.csr_array(K)), ties)


def test_more_modes_than_masses(frame_model):
    model = replace(frame_model, M=lumped(frame_model))
    rejected(model, "of the 30 shapes move no mass", reduction=Eigenmodes(30))


def test_a_failed_eigenproblem_is_told(solid_model):
    class Fails:
        def basis(self, model, body, L):
            raise np.linalg.LinAlgError("not definite")

    rejected(solid_model, "the eigenproblem of K and M failed", error=ComputationError, reduction=Fails())


# ---- guards of the interfaces -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interfaces", "message"),
    [
        ([InterfaceRegion("left"), InterfaceRegion("left")], "interface name 'left' is given more than once"),
        ([InterfaceRegion("middle")], "there is no group of nodes 'middle'"),
        ([InterfaceRegion("left"), InterfaceRegion("front")], "rigid interfaces 'left' and 'front' share"),
        ([InterfaceRegion("one")], "the 1 nodes of group 'one' do not determine its six coordinates"),
        ([InterfaceRegion("line")], "the 2 nodes of group 'line' do not determine"),
        ([InterfaceRegion("line", kind="mean")], "three or more nodes that are not on one line"),
        (
            [InterfaceRegion("left"), InterfaceRegion("other", "left", "mean")],
            "'other' moves only with interfaces already",
        ),
    ],
)
def test_interfaces_that_cannot_be(solid_model, interfaces, message):
    model = with_group(with_group(solid_model, "one", [1]), "line", [1, 2])
    rejected(model, message, interfaces)


def test_a_line_of_nodes_with_rotations_is_a_rigid_interface():
    model = with_group(of_frame(rod(rectangle(0.02, 0.05), 1.0, 4)), "half", [1, 2, 3])
    body = reduced(model, [InterfaceRegion("half")], FixedTo("half"), Eigenmodes(2))
    stub = reduced(of_frame(rod(rectangle(0.02, 0.05), 0.5, 2)), ENDS[:1], FixedTo("root"), Eigenmodes(2))
    assert_close(body.omega2, stub.omega2, 1e-8)
