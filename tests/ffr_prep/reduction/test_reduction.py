"""Reductions: laws of every basis, invariance under the reference conditions, closed forms, convergence, guards."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg
from boxes import STEEL, box_mesh, moved, rotation, shaken

import ffr_prep as fp
import ffr_prep.reduction.modes as modes_module
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports, functionals
from ffr_prep.reduction.basis import Basis, check_basis, factorised
from ffr_prep.reduction.methods.characteristic import CharacteristicModes
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.selection import Accuracy, Band
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple
from ffr_prep.solvers.factor import factorise, solve_refined, supported

SIZE = (1.0, 0.1, 0.1)
BOTH = (InterfaceRegion("left"), InterfaceRegion("right", kind="mean"))
REFERENCES = (FixedTo("left"), SimplySupported("left", "right"), MeanAxis())
AXES = np.eye(3)
MOTIONS = ("translation", "rotation")


def coupled(mesh, interfaces=BOTH, material=STEEL):
    return couple(mesh, assemble(mesh, material), interfaces)


def reduced(mesh, reference, reduction, interfaces=BOTH, material=STEEL):
    return fp.reduce(
        fp.from_mesh(mesh, material, interfaces), fp.Request(name="b", reference=reference, reduction=reduction)
    )


@pytest.fixture(scope="module")
def beam():
    return moved(shaken(box_mesh("tet10", SIZE, (8, 2, 2)), 0.01), rotation(8), np.array([0.1, 0.2, -0.3]))


@pytest.fixture(scope="module")
def model(beam):
    return coupled(beam)


# ---- the constrained static problem -------------------------------------------------------------------------------


def test_static_solutions_satisfy_the_optimality_conditions(model):
    rng = np.random.default_rng(0)
    C = np.vstack([model.C.toarray(), rng.normal(size=(2, model.K.shape[0])) / 40])
    f, c = rng.normal(size=(model.K.shape[0], 3)), rng.normal(size=(len(C), 3))
    u, mu = solve_refined(supported(factorised(model), C), f, c)
    np.testing.assert_allclose(C @ u, c, atol=1e-9 * np.abs(u).max())
    residual = model.K @ u + C.T @ mu - f
    assert np.abs(residual).max() < 1e-12 * np.abs(abs(model.K) @ np.abs(u)).max()


def test_static_solution_equals_the_clamped_one(model):
    """Six coordinates of a rigid interface set to zero are the same as leaving them out of the matrix."""
    held = model.K.shape[0] - 6
    f = np.random.default_rng(1).normal(size=(model.K.shape[0], 1))
    problem = supported(factorised(model), model.C[:6].toarray())
    u, mu = solve_refined(problem, f, np.zeros((6, 1)))
    clamped = scipy.linalg.solve(model.K[:held][:, :held].toarray(), f[:held], assume_a="pos")
    np.testing.assert_allclose(u[:held], clamped, atol=1e-9 * np.abs(clamped).max())
    reaction = f[held:] - (model.K[held:][:, :held] @ clamped)
    np.testing.assert_allclose(mu, reaction, rtol=1e-8)


def test_singular_matrices_and_dependent_supports_are_refused(model):
    with pytest.raises(ComputationError, match="not positive definite"):
        factorise(sp.csr_array(np.diag([1.0, 0.0, 2.0])), np.zeros((3, 3)))
    with pytest.raises(ComputationError, match="is singular"):
        factorise(sp.csr_array(np.array([[1.0, 1.0], [1.0, 1.0 + 1e-15]])), np.eye(3)[:2])
    body = factorised(model)
    C = model.C.toarray()
    with pytest.raises(ComputationError, match="depend on one another"):
        supported(body, np.vstack([C, C[:1]]))
    with pytest.raises(ComputationError, match="rigid motion free"):
        supported(body, C[:3])


def test_a_solution_out_of_equilibrium_is_refused(model):
    """A factorisation that does not belong to the stiffness leaves a residual."""
    problem = supported(factorised(model), model.C.toarray())
    other = sp.csr_array(model.K + sp.diags_array(np.linspace(0, 1, model.K.shape[0]) * model.K.diagonal()))
    wrong = replace(problem, body=replace(problem.body, K=other))
    with pytest.raises(ComputationError, match="misses equilibrium by"):
        solve_refined(wrong, np.zeros((model.K.shape[0], 12)), np.eye(12))


def test_a_body_with_a_hinge_inside_is_refused():
    """Two cubes that share one edge turn about it freely: connected, but not a structure."""
    mesh = box_mesh("hex8", (2.0, 1.0, 2.0), (2, 1, 2))
    diagonal = replace(mesh, blocks=(replace(mesh.blocks[0], nodes=mesh.blocks[0].nodes[[0, 3]]),))
    used, nodes = np.unique(diagonal.blocks[0].nodes, return_inverse=True)
    block = replace(diagonal.blocks[0], nodes=nodes.reshape(-1, 8))
    hinged = replace(diagonal, points=mesh.points[used], blocks=(block,), face_groups={})
    model = coupled(hinged, ())
    with pytest.raises(
        ComputationError, match=r"(not positive definite|is singular).* joined by a single node or edge"
    ):
        factorised(model)


# ---- laws of every basis ------------------------------------------------------------------------------------------

OVERDETERMINED = Supports(
    (
        *(Support(end, "translation", tuple(axis)) for end in ("left", "right") for axis in AXES),
        *(Support("left", "rotation", tuple(axis)) for axis in AXES[:2]),
    )
)


@pytest.mark.parametrize("reference", [*REFERENCES, OVERDETERMINED], ids=lambda r: type(r).__name__)
@pytest.mark.parametrize("reduction", [CraigBampton(5), Eigenmodes(5)], ids=lambda r: type(r).__name__)
def test_bases_are_orthonormal_diagonal_and_within_the_reference_conditions(model, reference, reduction):
    L = functionals(reference, model)
    basis = reduction.basis(model, factorised(model), L)
    Z, omega2 = basis.Z, basis.omega2
    np.testing.assert_allclose(Z.T @ (model.M @ Z), np.eye(len(omega2)), atol=1e-11)
    stiffness = Z.T @ (model.K @ Z)
    np.testing.assert_allclose(stiffness, np.diag(omega2), rtol=0, atol=1e-8 * omega2[-1])
    np.testing.assert_allclose(np.diag(stiffness), omega2, rtol=1e-6)
    assert np.abs(L @ Z).max() < 1e-9 * np.abs(Z).max()
    assert (np.diff(omega2) >= 0).all()
    assert len(omega2) == (5 if isinstance(reduction, Eigenmodes) else 5 + 12 - len(L))


def test_signs_make_the_largest_component_positive(model):
    Z = Eigenmodes(6).basis(model, factorised(model), functionals(FixedTo("left"), model)).Z
    size = np.abs(Z)
    for mode, magnitude in zip(Z.T, size.T, strict=True):
        assert mode[np.argmax(magnitude >= (1 - 1e-6) * magnitude.max())] > 0


def test_the_same_input_gives_the_same_bits(beam):
    one, two = (reduced(beam, SimplySupported("left", "right"), CraigBampton(8)) for _ in range(2))
    assert one.omega2.tobytes() == two.omega2.tobytes()
    assert one.surface.Phi.tobytes() == two.surface.Phi.tobytes()
    assert one.PP_dm.tobytes() == two.PP_dm.tobytes()


@pytest.mark.parametrize("reference", REFERENCES, ids=lambda r: type(r).__name__)
def test_lanczos_and_dense_eigenvalues_agree(model, reference, monkeypatch):
    L = functionals(reference, model)
    lanczos = Eigenmodes(20).basis(model, factorised(model), L)
    monkeypatch.setattr(modes_module, "_DENSE", model.K.shape[0])
    dense = Eigenmodes(20).basis(model, factorised(model), L)
    assert model.K.shape[0] > 600
    np.testing.assert_allclose(lanczos.omega2, dense.omega2, rtol=1e-7)
    angles = scipy.linalg.subspace_angles(lanczos.Z[:, :18], dense.Z[:, :18])
    assert angles.max() < 1e-4


def test_craig_bampton_with_all_modes_is_the_whole_model():
    mesh = box_mesh("hex8", (1.0, 0.4, 0.4), (2, 2, 2))
    model = coupled(mesh)
    L = functionals(FixedTo("left"), model)
    size = model.K.shape[0]
    complete = CraigBampton(size - 12).basis(model, factorised(model), L)
    assert complete.omega2.size == size - 6
    direct = scipy.linalg.eigvalsh(
        model.K[: size - 6][:, : size - 6].toarray(), model.M[: size - 6][:, : size - 6].toarray()
    )
    np.testing.assert_allclose(complete.omega2, direct, rtol=1e-8)


# ---- the reference conditions are bookkeeping ---------------------------------------------------------------------


def free_free_frequencies(body):
    """(6 + n,) [Hz] of the free reduced body, small motions about rest."""
    c = body.r_dm
    tilde = np.cross(np.eye(3), c)
    M = np.block(
        [[body.mass * np.eye(3), -tilde, body.I3], [tilde, body.I7, body.I4], [body.I3.T, body.I4.T, np.eye(body.n)]]
    )
    K = scipy.linalg.block_diag(np.zeros((6, 6)), np.diag(body.omega2))
    scale = 1 / np.sqrt(np.diag(M))
    omega2 = scipy.linalg.eigvalsh(scale[:, None] * K * scale, scale[:, None] * M * scale)
    return np.sqrt(np.abs(omega2)) / (2 * np.pi)


def test_determinate_conditions_span_the_same_total_motion(model):
    rigid = np.linalg.qr(model.T)[0]
    spaces = []
    for reference in REFERENCES:
        Z = CraigBampton(6).basis(model, factorised(model), functionals(reference, model)).Z
        assert Z.shape[1] == 12
        spaces.append(np.hstack([rigid, Z / np.linalg.norm(Z, axis=0)]))
    for other in spaces[1:]:
        assert scipy.linalg.subspace_angles(spaces[0], other).max() < 1e-8


@pytest.mark.slow
def test_free_free_frequencies_do_not_depend_on_the_reference_conditions(beam):
    bodies = [reduced(beam, reference, CraigBampton(6)) for reference in REFERENCES]
    frequencies = [free_free_frequencies(body) for body in bodies]
    for found in frequencies:
        assert found[:6].max() < 1e-4 * found[6]
        np.testing.assert_allclose(found[6:], frequencies[0][6:], rtol=1e-9)
    np.testing.assert_allclose(bodies[2].frequencies, frequencies[2][6:], rtol=1e-9)


def test_more_than_six_conditions_stiffen(beam):
    both_ends = Supports(
        tuple(Support(end, motion, tuple(axis)) for end in ("left", "right") for motion in MOTIONS for axis in AXES)
    )
    one_end, both = reduced(beam, FixedTo("left"), CraigBampton(6)), reduced(beam, both_ends, CraigBampton(6))
    assert (one_end.n, both.n) == (12, 6)
    assert both.frequencies[0] > 5 * one_end.frequencies[0]


# ---- closed forms -------------------------------------------------------------------------------------------------

# Timoshenko cantilever, length 1 m, square section h, E = 2.1e11 Pa, nu = 0.3, rho = 7850 kg/m^3, k_s = 5/6 [Hz]
# (roots of the exact characteristic equation).
TIMOSHENKO = {0.1: (82.8943626933, 496.814531609), 0.02: (16.7050018666, 104.489578399, 291.68197486)}


@pytest.mark.parametrize(("h", "cells"), [(0.1, (10, 2, 2)), (0.02, (40, 1, 1))])
@pytest.mark.parametrize("kind", ["tet10", "hex20", "hex27"])
def test_cantilever_frequencies(kind, h, cells):
    body = reduced(
        box_mesh(kind, (1.0, h, h), cells), FixedTo("left"), Eigenmodes(8), [InterfaceRegion("left", kind="mean")]
    )
    lateral = np.sum(body.I3[1:] ** 2, axis=0) > 1e-3 * body.mass
    bending = body.frequencies[lateral][::2][: len(TIMOSHENKO[h])]
    np.testing.assert_allclose(bending, TIMOSHENKO[h], rtol=6e-3)


def test_cantilever_participation():
    """Euler-Bernoulli, mass-normalised: integral of phi = 2 sigma / lambda = 0.7829917560, of x phi = 2 / lambda^2."""
    body = reduced(
        box_mesh("hex20", (1.0, 0.02, 0.02), (30, 1, 1)), FixedTo("left"), Eigenmodes(2), [InterfaceRegion("left")]
    )
    root = np.sqrt(body.mass)
    assert np.linalg.norm(body.I3[1:, 0]) == pytest.approx(0.7829917560396257 * root, rel=2e-3)
    assert np.linalg.norm(body.rP_dm[0, 1:, 0]) == pytest.approx(0.5688257437099107 * root, rel=2e-3)


def test_first_order_tetrahedra_lock_and_say_so():
    mesh = box_mesh("tet4", (1.0, 0.02, 0.02), (40, 1, 1))
    body = reduced(mesh, FixedTo("left"), Eigenmodes(1), [InterfaceRegion("left")])
    assert body.frequencies[0] > 1.5 * TIMOSHENKO[0.02][0]
    assert "locking" in body.provenance["warnings"][0]


# ---- convergence --------------------------------------------------------------------------------------------------
# Relative error of the first frequency of a clamped-free component with its interface at the tip, by the number of
# fixed-interface modes: exact eigenfunctions of the bar and of the Euler-Bernoulli beam, 30 digits. A material without
# Poisson contraction makes the solid move as these do.

ROD = Material(name="rod", E=2.1e11, nu=0.0, rho=7850.0)
ENDS = (InterfaceRegion("left"), InterfaceRegion("right"))


@pytest.mark.parametrize(("modes", "error"), [(0, 0.10265779), (6, 4.4653833e-3), (10, 1.0297938e-3)])
def test_craig_bampton_converges_on_a_bar(modes, error):
    """Of the lowest 6 and 10 fixed-interface modes one and two are axial; the others do not couple with them."""
    mesh = box_mesh("hex27", (1.0, 0.2, 0.2), (16, 1, 1))
    body = reduced(mesh, FixedTo("left"), CraigBampton(modes), ENDS, ROD)
    axial = body.frequencies[np.argmax(body.I3[0] ** 2)]
    assert axial / (np.sqrt(ROD.E / ROD.rho) / 4) - 1 == pytest.approx(error, rel=2e-3)


@pytest.mark.parametrize(
    ("modes", "error"), [(0, 4.7543236e-3), (1, 3.4702439e-4), (2, 5.8375818e-5), (4, 5.4086114e-6)]
)
def test_craig_bampton_converges_on_a_beam(modes, error):
    """Each mode of the beam comes twice in the square solid."""
    mesh = box_mesh("hex20", (1.0, 0.01, 0.01), (30, 1, 1))
    full = reduced(mesh, FixedTo("left"), Eigenmodes(2), ENDS, ROD)
    body = reduced(mesh, FixedTo("left"), CraigBampton(2 * modes), ENDS, ROD)
    assert body.frequencies[0] / full.frequencies[0] - 1 == pytest.approx(error, rel=0.03)


def test_static_response_at_the_interfaces_is_exact_without_any_mode():
    """Constraint modes carry the deflection under a force at the tip in full, as the whole model has it."""
    mesh = box_mesh("tet10", SIZE, (8, 2, 2))
    model = coupled(mesh)
    force = np.zeros((12, 1))
    force[6 + 2] = 1.0
    problem = supported(factorised(model), functionals(FixedTo("left"), model))
    u, _ = solve_refined(problem, model.C.T @ force, np.zeros((6, 1)))
    body = reduced(mesh, FixedTo("left"), CraigBampton(0))
    tip = body.interface("right")
    deflection = tip.phi_t @ (tip.phi_t[2] / body.omega2)
    np.testing.assert_allclose(deflection, (model.C @ u)[6:9, 0], rtol=0, atol=1e-9 * deflection[2])


# ---- the body -----------------------------------------------------------------------------------------------------


def test_no_interface_and_a_mean_axis_give_free_free_modes(beam):
    body = reduced(beam, MeanAxis(), Eigenmodes(4), ())
    assert body.interfaces == ()
    assert np.abs(body.I3).max() < 1e-9 * np.sqrt(body.mass)
    assert np.abs(body.I4).max() < 1e-9 * np.sqrt(body.mass)
    # Free-free beam of Euler and Bernoulli: (4.730041 / 1.875104)^2 times the cantilever; shear lowers it.
    assert 0.9 < body.frequencies[0] / (TIMOSHENKO[0.1][0] * (4.730041 / 1.875104) ** 2) < 1.0


def test_no_modes_at_all_give_a_rigid_body(beam):
    body = reduced(beam, FixedTo("left"), Eigenmodes(0))
    assert body.n == 0
    assert body.mass == pytest.approx(78.5, rel=1e-12)
    assert body.interface("right").phi_t.shape == (3, 0)


def test_interface_shapes_and_surface_are_those_of_the_field(beam):
    body = reduced(beam, FixedTo("left"), CraigBampton(3))
    assert np.abs(body.interface("left").phi_t).max() < 1e-9
    assert np.abs(body.interface("left").phi_r).max() < 1e-8
    right = beam.face_groups["right"][0]
    model = coupled(beam)
    basis = CraigBampton(3).basis(model, factorised(model), functionals(FixedTo("left"), model))
    Phi = (model.B @ basis.Z).reshape(-1, 3, body.n)
    np.testing.assert_array_equal(Phi[np.isin(beam.points, body.surface.points).all(axis=1)].shape[1:], (3, body.n))
    by_position = {tuple(point): k for k, point in enumerate(beam.points)}
    rows = [by_position[tuple(point)] for point in body.surface.points]
    np.testing.assert_allclose(body.surface.Phi, Phi[rows], rtol=0, atol=1e-12)
    assert len(np.intersect1d(rows, right)) > 4
    assert body.interface("right").kind == "mean"


def test_stages_and_settings_are_recorded(beam):
    stages, told = [], []
    body = fp.reduce(
        fp.from_mesh(beam, STEEL, BOTH, progress=stages.append),
        fp.Request(
            name="rod", reference=SimplySupported("left", "right"), reduction=CraigBampton(2), provenance={"order": 7}
        ),
        progress=stages.append,
        advance=lambda share, words: told.append((stages[-1], words)),
    )
    assert {stage for stage, _ in told} <= {
        "factorise the stiffness",
        "reduce",
        "compute the second order of the surface",
    }
    assert any(words.endswith("fronts") for _, words in told)
    assert stages == sorted(set(stages), key=stages.index)
    assert len(stages) >= 4
    record = body.provenance
    assert record["order"] == 7
    assert record["reference"] == {"type": "SimplySupported", "pin": "left", "roller": "right"}
    assert record["reduction"] == {"type": "CraigBampton", "modes": 2}
    assert record["material"] == {"type": "Material", "name": "steel", "E": 2.1e11, "nu": 0.3, "rho": 7850.0}
    assert record["mesh"]["nodes"] == len(beam.points)
    assert record["mesh"]["elements"] == {"tet10": 192}
    assert record["warnings"] == []


def test_effective_masses_of_all_modes_add_up_to_the_mass():
    """All modes of a body fixed to a rigid interface together carry all the mass that is not in that interface."""
    mesh = box_mesh("hex8", (1.0, 0.2, 0.2), (3, 1, 1))
    model = coupled(mesh, ENDS[:1])
    body = reduced(mesh, FixedTo("left"), Eigenmodes(model.K.shape[0] - 6), ENDS[:1])
    held = model.K.shape[0] - 6
    unit = model.T[:held, 0]
    M = model.M.toarray()
    coupling = M[:held, :held] @ unit + M[:held, held:] @ model.T[held:, 0]
    expected = coupling @ np.linalg.solve(M[:held, :held], coupling)
    assert np.sum(body.I3[0] ** 2) == pytest.approx(expected, rel=1e-9)
    assert 0.8 * body.mass < expected < body.mass


# ---- guards -------------------------------------------------------------------------------------------------------


def test_more_modes_than_degrees_of_freedom_are_refused():
    mesh = box_mesh("tet4", SIZE, (2, 1, 1))
    with pytest.raises(InputError, match=r"asked for 500 normal modes of a model with 24 free degrees of freedom"):
        reduced(mesh, FixedTo("left"), Eigenmodes(500), [InterfaceRegion("left")])
    with pytest.raises(InputError, match="asked for -1 normal modes"):
        reduced(mesh, FixedTo("left"), Eigenmodes(-1), [InterfaceRegion("left")])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: CraigBampton("a"), r"modes is 'a'; give a whole number, or UpTo\(...\) or Accuracy\(...\)"),
        (lambda: Eigenmodes(2.5), "modes is 2.5; give a whole number"),
        (lambda: Rubin(None), "modes is None; give a whole number"),
        (lambda: CharacteristicModes(3, Accuracy(Band(1, 2), 0.1)), r"interface_modes is .*; .* or UpTo\(...\)$"),
    ],
)
def test_modes_that_are_no_number_are_refused_at_once(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_craig_bampton_needs_an_interface(beam):
    with pytest.raises(InputError, match="at least one interface"):
        reduced(beam, MeanAxis(), CraigBampton(3), ())


def damaged(basis, **changes):
    return replace(basis, **{key: change(getattr(basis, key).copy()) for key, change in changes.items()})


def test_a_basis_that_is_not_what_it_claims_is_refused(model):
    L = functionals(FixedTo("left"), model)
    basis = Eigenmodes(3).basis(model, factorised(model), L)
    check_basis(model, L, basis)
    with pytest.raises(ComputationError, match=r"Z\^T M Z - I reaches"):
        check_basis(model, L, damaged(basis, Z=lambda Z: 1.01 * Z))
    with pytest.raises(ComputationError, match=r"Z\^T K Z - diag\(omega2\) reaches"):
        check_basis(model, L, damaged(basis, omega2=lambda omega2: 1.01 * omega2))
    with pytest.raises(ComputationError, match="L Z reaches"):
        check_basis(model, functionals(FixedTo("right"), model), basis)
    rigid = model.T[:, :1] / np.sqrt(model.T[:, 0] @ (model.M @ model.T[:, 0]))
    with pytest.raises(ComputationError, match="a rigid motion is left"):
        check_basis(model, np.zeros((0, len(rigid))), Basis(rigid, np.zeros(1)))
    with pytest.raises(ComputationError, match="is a rigid motion"):
        check_basis(model, np.zeros((0, len(rigid))), Basis(rigid, np.array([1e-3])))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"material": "steel"}, r"write material\('steel'\)"),
        ({"interfaces": ("left",)}, r"write InterfaceRegion\('left'\)"),
        ({"reference": "mean-axis"}, "reference is 'mean-axis'; give one such as FixedTo"),
        ({"reduction": CraigBampton}, "reduction is .*; give one such as CraigBampton"),
        ({"reduction": (CraigBampton(2), CraigBampton(3))}, r"give one such as .*, or Union\(\(CraigBampton\(10\), "),
    ],
)
def test_texts_and_classes_in_place_of_objects_are_refused(change, words):
    given = {"reference": MeanAxis(), "reduction": CraigBampton(1)}
    with pytest.raises(InputError, match=words):
        reduced(box_mesh("hex8", (1.0, 1.0, 1.0), (1, 1, 1)), **given | change)
