"""Reductions beyond Craig-Bampton: laws of every basis, what each is made for, unions, selection, guards."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from boxes import STEEL, box_mesh, moved, rotation, shaken
from test_structural import regions, space_frame, straight

import ffr_prep as fp
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports, functionals
from ffr_prep.reduction.basis import check_basis, factorised
from ffr_prep.reduction.methods.attachment import AttachmentModes
from ffr_prep.reduction.methods.characteristic import CharacteristicModes
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.reduction.methods.inertia_relief import InertiaRelief
from ffr_prep.reduction.methods.krylov import Krylov, dynamic_solver
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.methods.union import Union
from ffr_prep.reduction.methods.user_vectors import UserVectors
from ffr_prep.reduction.receptance import free_modes, receptance_error, receptances, reference_modes, static_flexibility
from ffr_prep.reduction.selection import Accuracy, Band, UpTo
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple
from ffr_prep.solids.stiffening import inertial_loads
from ffr_prep.solvers.factor import solve_refined, supported
from ffr_prep.structures.sections import general, with_mass_moments

SIZE = (1.0, 0.1, 0.1)
BOTH = (InterfaceRegion("left"), InterfaceRegion("right", kind="mean"))
REFERENCES = (FixedTo("left"), SimplySupported("left", "right"), MeanAxis())
OVERDETERMINED = Supports(
    tuple(Support(end, "translation", tuple(axis)) for end in ("left", "right") for axis in np.eye(3))
    + tuple(Support("left", "rotation", tuple(axis)) for axis in np.eye(3)[:2])
)


def bent(points: np.ndarray) -> np.ndarray:
    """(N, 3, 4) deflections of second and third degree, and a stretch."""
    x = points @ rotation(8)[:, 0]
    y = rotation(8)[:, 1]
    z = rotation(8)[:, 2]
    return np.stack(
        [x[:, None] ** 2 * y, x[:, None] * rotation(8)[:, 0], x[:, None] ** 2 * z, x[:, None] ** 3 * z], axis=-1
    )


REDUCTIONS = (
    Guyan(),
    Rubin(6),
    AttachmentModes(),
    InertiaRelief(),
    Krylov(2),
    Krylov(1, (0.0, 300.0)),
    UserVectors(bent),
    CharacteristicModes(4, 2),
    Union((CraigBampton(4), InertiaRelief(), UserVectors(bent))),
)


def coupled(mesh, interfaces=BOTH):
    matrices = assemble(mesh, STEEL)
    model = couple(mesh, matrices, interfaces)
    return replace(model, inertial_loads=model.B.T @ inertial_loads(mesh.points, matrices))


@pytest.fixture(scope="module")
def model():
    mesh = shaken(box_mesh("tet10", SIZE, (8, 2, 2)), 0.01)
    return coupled(moved(mesh, rotation(8), np.array([0.1, 0.2, -0.3])))


@pytest.fixture(scope="module")
def body(model):
    return factorised(model)


@pytest.fixture(scope="module")
def frame():
    return fp.from_frame(space_frame(), regions("a", "b")).coupled


def static(model, supports, loads):
    return solve_refined(supported(factorised(model), supports), loads, np.zeros((len(supports), loads.shape[1])))[0]


def distance(model, vectors, space):
    """(p,) how far the vectors are from the space and the rigid motions, relative to their elastic part, in the mass norm."""
    rigid = np.linalg.qr(model.T)[0]
    root = np.sqrt(model.M.diagonal())[:, None]
    elastic = vectors - rigid @ np.linalg.lstsq(root * rigid, root * vectors, rcond=None)[0]
    both = root * np.hstack([rigid, space])
    both = both / np.linalg.norm(both, axis=0)
    left = root * elastic - both @ np.linalg.lstsq(both, root * elastic, rcond=1e-13)[0]
    return np.linalg.norm(left, axis=0) / np.linalg.norm(root * elastic, axis=0)


# ---- laws of every basis ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reference", [*REFERENCES, OVERDETERMINED], ids=lambda r: type(r).__name__)
@pytest.mark.parametrize("reduction", REDUCTIONS, ids=lambda r: type(r).__name__)
def test_every_basis_is_orthonormal_diagonal_and_within_the_reference_conditions(model, body, reduction, reference):
    L = functionals(reference, model)
    basis = reduction.basis(model, body, L)
    assert basis.omega2.size
    check_basis(model, L, basis)
    np.testing.assert_allclose(basis.Z.T @ (model.M @ basis.Z), np.eye(basis.omega2.size), atol=1e-10)
    assert (np.diff(basis.omega2) >= 0).all()


@pytest.mark.parametrize("reduction", REDUCTIONS, ids=lambda r: type(r).__name__)
def test_determinate_conditions_span_the_same_total_motion(model, body, reduction):
    """A frame is bookkeeping: the elastic modes of the free reduced body do not depend on it."""
    found = [free_modes(model, reduction.basis(model, body, functionals(r, model))) for r in REFERENCES]
    for other in found[1:]:
        np.testing.assert_allclose(other.omega2, found[0].omega2, rtol=1e-6)
        np.testing.assert_allclose(static_flexibility(other), static_flexibility(found[0]), rtol=0, atol=1e-6 * 1e-3)


@pytest.mark.parametrize("reduction", REDUCTIONS[:6] + REDUCTIONS[7:8], ids=lambda r: type(r).__name__)
def test_frames_of_beams_are_reduced_as_well(frame, reduction):
    reference = FixedTo("a")
    L = functionals(reference, frame)
    basis = reduction.basis(frame, factorised(frame), L)
    assert basis.omega2.size
    check_basis(frame, L, basis)


@pytest.mark.parametrize("kind", ["hex27", "hex8"])
def test_modes_of_equal_frequency_are_turned_to_the_axes(kind):
    """A square bar: bending pairs, of which the first moves along y and the second along z."""
    model = coupled(box_mesh(kind, SIZE, (6, 1, 1), origin=(0.0, -0.05, -0.05)))
    basis = Eigenmodes(7).basis(model, factorised(model), functionals(FixedTo("left"), model))
    u = (model.B @ basis.Z).reshape(-1, 3, 7)
    share = np.einsum("pcj,pcj->cj", u, u) / np.einsum("pcj,pcj->j", u, u)
    pairs = np.flatnonzero(np.diff(basis.omega2) < 1e-8 * basis.omega2[1:])
    assert pairs.tolist()[:2] == [0, 2]
    for first in pairs:
        assert share[2, first] < 1e-3 * share[1, first]  # not zero: bending also spreads the section
        assert share[1, first + 1] < 1e-3 * share[2, first + 1]
    assert np.abs(basis.Z.T @ (model.M @ basis.Z) - np.eye(7)).max() < 1e-10


def test_the_same_input_gives_the_same_bits(model, body):
    L = functionals(MeanAxis(), model)
    one, two = (REDUCTIONS[-1].basis(model, body, L) for _ in range(2))
    assert one.Z.tobytes() == two.Z.tobytes()


# ---- what each is made for --------------------------------------------------------------------------------------------


def test_guyan_is_craig_bampton_without_modes(model, body):
    L = functionals(FixedTo("left"), model)
    np.testing.assert_array_equal(Guyan().basis(model, body, L).Z, CraigBampton(0).basis(model, body, L).Z)


@pytest.mark.parametrize(
    "reduction",
    [Rubin(4), AttachmentModes(), Krylov(1), Union((CraigBampton(0), InertiaRelief()))],
    ids=lambda r: type(r).__name__,
)
def test_static_flexibility_of_the_free_body_is_exact(model, body, reduction):
    """Under interface loads that inertia balances; Craig-Bampton needs the response to that inertia as well."""
    L = functionals(SimplySupported("left", "right"), model)
    found = static_flexibility(free_modes(model, reduction.basis(model, body, L)))
    loads = model.C.toarray().T
    exact = model.C @ static(model, (model.M @ model.T).T, loads)
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    np.testing.assert_allclose(found / scale, exact / scale, atol=1e-7)


def test_static_flexibility_under_interface_supports_is_exact_with_static_shapes(model, body):
    L = functionals(FixedTo("left"), model)
    basis = Guyan().basis(model, body, L)
    shapes = model.C[6:] @ basis.Z
    exact = model.C[6:] @ static(model, L, model.C[6:].toarray().T)
    np.testing.assert_allclose((shapes / basis.omega2) @ shapes.T, exact, rtol=0, atol=1e-8 * np.abs(exact).max())


def test_rubin_has_the_free_modes(model, body):
    """Its first modes are those of the free body, exactly."""
    L = functionals(MeanAxis(), model)
    exact = Eigenmodes(8).basis(model, body, L)
    np.testing.assert_allclose(Rubin(8).basis(model, body, L).omega2[:8], exact.omega2, rtol=1e-8)


def test_inertia_relief_carries_gravity_and_spin(model, body):
    """With the interfaces' static shapes, every static response to unit accelerations, whichever interface is held."""
    basis = Union((CraigBampton(0), InertiaRelief())).basis(model, body, functionals(MeanAxis(), model))
    for held in (model.C[:6].toarray(), model.C[6:].toarray()):
        response = static(model, held, model.inertial_loads)
        assert distance(model, response, basis.Z).max() < 1e-6


def test_inertial_loads_are_mass_times_acceleration(model, frame):
    """Translation and rotation of the nodes are rigid motions: the loads are those of M T."""
    for one in (model, frame):
        momenta = -(one.M @ one.T)
        np.testing.assert_allclose(one.inertial_loads[:, :3], momenta[:, :3], atol=1e-10 * np.abs(momenta).max())
        about_origin = momenta[:, 3:] + momenta[:, :3] @ np.cross(np.eye(3), one.centre).T
        np.testing.assert_allclose(one.inertial_loads[:, 3:6], about_origin, atol=1e-10 * np.abs(momenta).max())


@pytest.mark.parametrize("frequency", [200.0, 900.0])
def test_krylov_matches_receptances_where_it_was_asked_to(model, body, frequency):
    """At the expansion point the response to interface loads is that of the model, and nearby to high order."""
    basis = Krylov(1, (frequency,)).basis(model, body, functionals(FixedTo("left"), model))
    loads = model.C.toarray().T
    exact = dynamic_solver(model, frequency)(loads)
    assert distance(model, exact, basis.Z).max() < 1e-7
    near = dynamic_solver(model, 1.05 * frequency)(loads)
    one = distance(model, near, basis.Z).max()
    two = distance(model, near, Krylov(3, (frequency,)).basis(model, body, functionals(FixedTo("left"), model)).Z).max()
    assert 1e-6 < one < 1.0
    assert two < one / 10


def test_user_vectors_are_kept(model, body):
    basis = UserVectors(bent).basis(model, body, functionals(FixedTo("left"), model))
    assert basis.omega2.size == 4
    fields = (model.B @ np.hstack([basis.Z, model.T])).reshape(-1, 10)
    given = bent(model.points).reshape(-1, 4)
    left = given - fields @ np.linalg.lstsq(fields, given, rcond=None)[0]
    # the rigid interface bends the given fields where it ties the nodes, nowhere else
    free = np.linalg.norm((model.points - model.positions[0]), axis=1) > 0.13
    assert np.abs(left.reshape(-1, 3, 4)[free]).max() < 0.02 * np.abs(given).max()


def test_user_vectors_without_rigid_interfaces_are_exact():
    mesh = box_mesh("hex8", SIZE, (4, 1, 1))
    model = coupled(mesh, ())
    basis = UserVectors(lambda x: np.stack([x**2, x[:, [1, 0, 2]] * x], axis=-1)).basis(
        model, factorised(model), functionals(MeanAxis(), model)
    )
    given = np.stack([mesh.points**2, mesh.points[:, [1, 0, 2]] * mesh.points], axis=-1).reshape(-1, 2)
    assert distance(model, model.B.T @ given, basis.Z).max() < 1e-10


def test_interface_modes_are_those_of_the_condensed_body(model, body):
    """All of them give Craig-Bampton; few of them its lowest frequencies."""
    L = functionals(FixedTo("left"), model)
    whole, few = CraigBampton(4).basis(model, body, L), CharacteristicModes(4, 4).basis(model, body, L)
    every = CharacteristicModes(4, 6).basis(model, body, L)
    np.testing.assert_allclose(every.omega2, whole.omega2, rtol=1e-8)
    assert few.omega2.size == whole.omega2.size - 2
    np.testing.assert_allclose(few.omega2[0], whole.omega2[0], rtol=1e-4)
    assert (few.omega2 >= whole.omega2[:-2] * (1 - 1e-9)).all()


def test_unions_drop_and_count_what_they_have(model, body):
    L = functionals(FixedTo("left"), model)
    twice = Union((CraigBampton(4), Guyan(), CraigBampton(2))).basis(model, body, L)
    once = CraigBampton(4).basis(model, body, L)
    assert twice.dropped == 6 + 8
    np.testing.assert_allclose(twice.omega2, once.omega2, rtol=1e-8)


def test_a_straight_beam_has_no_shape_of_the_spin_about_itself_and_keeps_its_symmetry():
    """Loads that are rounding were shapes, and a round bar bent otherwise in one plane than in the other."""
    section = fp.tube(0.35, 0.01)
    bar = fp.from_frame(straight(section, 8.0, 24), regions("root", "tip")).coupled
    body, L = factorised(bar), functionals(FixedTo("root"), bar)
    omega2 = InertiaRelief().basis(bar, body, L).omega2
    pairs = [k for k in range(omega2.size - 1) if omega2[k + 1] < (1 + 1e-8) * omega2[k]]
    assert omega2.size == 9
    assert len(pairs) == 3


@pytest.mark.parametrize(
    ("modes", "error"), [(0, 0.10265779), (1, 4.4653833e-3), (2, 1.0297938e-3), (4, 1.8232966e-4), (8, 2.7367912e-5)]
)
def test_craig_bampton_converges_on_a_fine_bar(modes, error):
    """Clamped-free bar with its interface at the tip, exact components: relative error of the first frequency."""
    section = with_mass_moments(general("bar", A=1e-4, Iy=1e-3, Iz=1e-3, J=1e-3), 1e-12, 1e-12)  # axial modes first
    bar = fp.from_frame(straight(section, 1.0, 200), regions("root", "tip")).coupled
    body, L = factorised(bar), functionals(FixedTo("root"), bar)
    full = Eigenmodes(1).basis(bar, body, L).omega2[0]
    found = CraigBampton(modes).basis(bar, body, L).omega2[0]
    assert np.sqrt(found / full) - 1 == pytest.approx(error, rel=0.05)


# ---- selection --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", [CraigBampton, Eigenmodes, Rubin])
def test_modes_up_to_a_frequency(model, body, kind):
    L = functionals(MeanAxis(), model)
    supports = {CraigBampton: model.C.toarray(), Eigenmodes: L, Rubin: L}[kind]
    many = Eigenmodes(40).basis(model, body, supports).omega2
    for count in (0, 3, 30):
        limit = np.sqrt((many[count - 1] if count else 0) / 2 + many[count] / 2) / (2 * np.pi)
        found = kind(UpTo(float(limit))).basis(model, body, L)
        np.testing.assert_array_equal(found.omega2.size, kind(count).basis(model, body, L).omega2.size)


@pytest.mark.slow
def test_accuracy_adds_modes_until_the_receptances_are_right(model, body):
    band, tolerance = Band(10.0, 1500.0), 0.01
    L = functionals(FixedTo("left"), model)
    basis = CraigBampton(Accuracy(band, tolerance)).basis(model, body, L)
    count = basis.omega2.size - 6
    assert 0 < count < 40
    reference, _ = reference_modes(model, body, band)

    def error(modes):
        return receptance_error(
            free_modes(model, CraigBampton(modes).basis(model, body, L)), reference, band.frequencies()
        ).max()

    assert error(count) <= tolerance < error(count - 1)


@pytest.mark.slow
def test_accuracy_that_modes_alone_do_not_reach_is_refused(model, body):
    with pytest.raises(ComputationError, match=r"still more than 0.0001 off: allow a larger error"):
        Eigenmodes(Accuracy(Band(10.0, 500.0), 1e-4)).basis(model, body, functionals(FixedTo("left"), model))


# ---- receptances ------------------------------------------------------------------------------------------------------


def test_the_reference_is_the_full_model(model, body):
    """Against a complete eigendecomposition of the free model."""
    band = Band(10.0, 2000.0)
    reference, error = reference_modes(model, body, band)
    omega2, vectors = scipy.linalg.eigh(model.K.toarray(), model.M.toarray())
    complete = replace(reference, omega2=omega2[6:], shapes=model.C @ vectors[:, 6:])
    assert error < 1e-3
    assert receptance_error(reference, complete, band.frequencies()).max() < 1e-6


@pytest.mark.slow
def test_receptances_are_those_of_the_damped_equations(model):
    omega2, vectors = scipy.linalg.eigh(model.K.toarray(), model.M.toarray())
    modes = free_modes(
        model,
        replace(
            Eigenmodes(1).basis(model, factorised(model), functionals(MeanAxis(), model)),
            Z=vectors[:, 6:],
            omega2=omega2[6:],
        ),
    )
    dynamic = model.K.toarray() * (1 + 0.02j) - (2 * np.pi * 700.0) ** 2 * model.M.toarray()
    whole = model.C @ np.linalg.solve(dynamic, model.C.toarray().T)
    rigid = -(model.C @ vectors[:, :6]) @ (model.C @ vectors[:, :6]).T / (2 * np.pi * 700.0) ** 2
    np.testing.assert_allclose(
        receptances(modes, np.array([700.0]))[0], whole - rigid, rtol=0, atol=1e-6 * np.abs(whole).max()
    )


# ---- guards -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Band(5.0, 5.0), "must be 0 < low < high"),
        (lambda: Band(0.0, 5.0), "must be 0 < low < high"),
        (lambda: UpTo(0.0), "must be positive"),
        (lambda: Accuracy(Band(1.0, 2.0), 1.0), "between 0 and 1"),
        (lambda: Krylov(0), "at least one"),
        (lambda: Krylov(1, ()), "one or more frequencies"),
        (lambda: Krylov(1, (-1.0,)), "none negative"),
        (lambda: Union(()), "at least one reduction"),
    ],
)
def test_settings_that_cannot_be(make, says):
    with pytest.raises(InputError, match=says):
        make()


@pytest.mark.parametrize(
    ("reduction", "says"),
    [
        (Guyan(), "at least one interface"),
        (Rubin(2), "at least one interface"),
        (AttachmentModes(), "at least one interface"),
        (Krylov(1), "at least one interface"),
        (CharacteristicModes(2, 1), "at least one interface"),
        (Eigenmodes(Accuracy(Band(1.0, 100.0), 0.1)), "receptances need interfaces"),
        (UserVectors(np.zeros((2, 3, 1))), r"must be \(16, 3, p\)"),
        (UserVectors(np.full((16, 3, 1), np.nan)), "not finite"),
        (UserVectors(lambda x: np.ones((*x.shape, 1))), "do not deform the body"),
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_reductions_that_cannot_be_made(reduction, says):
    model = coupled(box_mesh("hex8", SIZE, (3, 1, 1)), ())
    with pytest.raises(InputError, match=says):
        reduction.basis(model, factorised(model), functionals(MeanAxis(), model))


def test_more_interface_modes_than_there_are(model, body):
    with pytest.raises(InputError, match="asked for 7 interface modes; the interfaces have 6"):
        CharacteristicModes(2, 7).basis(model, body, functionals(MeanAxis(), model))


def test_krylov_at_a_natural_frequency_is_refused():
    model = coupled(box_mesh("hex8", SIZE, (3, 1, 1)))
    body = factorised(model)
    natural = np.sqrt(Eigenmodes(1).basis(model, body, functionals(MeanAxis(), model)).omega2[0]) / (2 * np.pi)
    with pytest.raises(ComputationError, match="natural frequency"):
        Krylov(1, (float(natural),)).basis(model, body, functionals(MeanAxis(), model))


# ---- pairs of equal frequency -----------------------------------------------------------------------------------------


def reduced_bar(section: fp.Section, reduction: fp.Reduction) -> fp.FlexibleBody:
    line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(section, STEEL, (0, 1, 0)), elements=12)
    frame = fp.named(line, a=(0, 0, 0), b=(1, 0, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")])
    return fp.reduce(model, fp.Request(name="bar", reference=FixedTo("a"), reduction=reduction))


def of_pairs(body: fp.FlexibleBody) -> list[str]:
    return [warning for warning in body.provenance["warnings"] if "pair" in warning]


@pytest.mark.parametrize(
    ("reduction", "says"),
    [
        (CraigBampton(3), ["normal modes, 3, cuts a pair .* ask for 4, or for 2"]),
        (CraigBampton(4), []),
        (CraigBampton(0), []),
        (Eigenmodes(1), ["normal modes, 1, cuts a pair .* ask for 2$"]),
        (Rubin(5), ["normal modes, 5, cuts a pair"]),
        (Union((CraigBampton(3), InertiaRelief())), ["normal modes, 3, cuts a pair"]),
        (CharacteristicModes(2, 3), ["interface modes, 3, cuts a pair .* ask for 4, or for 2"]),
        (CharacteristicModes(2, 4), []),
    ],
)
def test_numbers_of_modes_that_cut_a_pair_are_told(reduction, says):
    warnings = of_pairs(reduced_bar(fp.circle(0.02), reduction))
    assert len(warnings) == len(says)
    for warning, words in zip(warnings, says, strict=True):
        assert re.search(words, warning)
    assert of_pairs(reduced_bar(fp.rectangle(0.02, 0.03), reduction)) == []


def test_an_accuracy_keeps_pairs():
    for tolerance in np.geomspace(0.3, 0.01, 4):
        body = reduced_bar(fp.rectangle(0.02, 0.02), CraigBampton(Accuracy(Band(1.0, 300.0), tolerance)))
        bending = body.frequencies[:4].reshape(2, 2)
        np.testing.assert_allclose(bending[:, 0], bending[:, 1], rtol=1e-9)
