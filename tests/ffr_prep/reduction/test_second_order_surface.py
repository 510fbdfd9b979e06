"""Second-order displacement of surfaces: reciprocity with the load matrices, other frames, added points, files."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import permutations

import numpy as np
import pytest
from boxes import STEEL, box_mesh, moved, rotation
from test_turned_stiffening import BODIES, FIXED, MEAN, REFERENCES, plate

import ffr_prep as fp
from ffr_prep.body import BodyError, Surface, displacements, load_body, save_body, second_order, truncated, values
from ffr_prep.body import with_point as pointed
from ffr_prep.body.planar import combined
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, functionals
from ffr_prep.pipelines.reduce import stiffening_matrices
from ffr_prep.pipelines.tied import tied
from ffr_prep.reduction import second_order as of_surfaces
from ffr_prep.reduction.basis import factorised
from ffr_prep.reduction.conversion import with_reference
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.second_order import _prescribed
from ffr_prep.solvers.factor import solve_refined, supported
from ffr_prep.structures.frame import Member, Shell, joined, named, panel, polyline, triangulated
from ffr_prep.structures.sections import rectangle, shifted

R, AT = rotation(5), np.array([0.2, -0.1, 0.4])
KINDS = (("rigid", "rigid"), ("mean", "rigid"), ("mean", "mean"))


@pytest.fixture
def exact(monkeypatch):
    """Fields are kept as they are found."""
    monkeypatch.setattr(second_order, "TOLERANCE", 1e-13)


@pytest.fixture(scope="module")
def made():
    """The body of a kind under some conditions, with its field as it is found, made when it is first asked for."""

    @cache
    def of(kind, reference):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(second_order, "TOLERANCE", 1e-13)
            return {**BODIES, "plates": plate}[kind](reference)

    return of


def at(*points):
    return [tuple(R @ np.array(point) + AT) for point in points]


def regions(kinds):
    return [InterfaceRegion("left", kind=kinds[0]), InterfaceRegion("right", kind=kinds[1])]


def solid(kinds):
    return fp.from_mesh(moved(box_mesh("hex20", (1.0, 0.12, 0.16), (4, 1, 1)), R, AT), STEEL, regions(kinds))


def beam(kinds):
    """Offset sections; the end nodes of a mean interface are on a tooth."""
    member = Member(shifted(rectangle(0.05, 0.065), 0.02, 0.01), STEEL, tuple(R[:, 1]))
    ends = at((0, 0, 0), (1, 0, 0))
    frame = joined(polyline(ends, member, elements=6), polyline([ends[1], *at((1, 0.1, 0.05))], member, elements=1))
    frame = named(frame, left=ends[0])
    tooth = np.flatnonzero(((frame.points - AT) @ R)[:, 0] > 0.99)
    frame = replace(frame, node_groups={**frame.node_groups, "right": tooth})
    return fp.from_frame(frame, [InterfaceRegion("left"), InterfaceRegion("right", kind=kinds[1])])


def strip(kinds, cut=lambda frame: frame):
    frame = panel(at((0, 0, 0), (1, 0, 0), (1, 0.4, 0), (0, 0.4, 0)), Shell(0.02, STEEL), elements=(5, 2))
    x = ((frame.points - AT) @ R)[:, 0]
    groups = {"left": np.flatnonzero(x < 1e-9), "right": np.flatnonzero(x > 1 - 1e-9)}
    return fp.from_frame(cut(replace(frame, node_groups=groups)), regions(kinds))


def pair(kinds):
    """A solid bar and an offset beam beside it, tied by an arm."""
    bar = moved(box_mesh("hex20", (0.6, 0.12, 0.16), (3, 1, 1)), R, AT)
    ends = at((0.7, 0.05, 0.1), (1.2, 0.05, 0.1))
    line = polyline(ends, Member(shifted(rectangle(0.05, 0.065), 0.02, 0.01), STEEL, tuple(R[:, 1])), elements=4)
    parts = {
        "bar": fp.from_mesh(
            bar, STEEL, [InterfaceRegion("left", kind=kinds[0]), InterfaceRegion("face", "right", kinds[1])]
        ),
        "beam": fp.from_frame(
            named(line, start=ends[0], right=ends[1]), [InterfaceRegion("start"), InterfaceRegion("right")]
        ),
    }
    return tied(parts, [("bar.face", "beam.start")])


MODELS = {
    "solid": solid,
    "beams": beam,
    "quadrilaterals": strip,
    "triangles": lambda kinds: strip(kinds, triangulated),
    "tied": pair,
}


def sizes(body):
    """(n, n) what makes pairs of modes comparable: equal strain energy."""
    return 1 / np.sqrt(np.outer(body.omega2, body.omega2))


def all_pairs(field):
    return np.tensordot(field.shapes, field.weights, 1)


# ---- reciprocity ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reference", REFERENCES, ids=lambda of: type(of).__name__)
@pytest.mark.parametrize("kinds", KINDS, ids="-".join)
@pytest.mark.parametrize("kind", MODELS)
def test_interfaces_move_as_the_load_matrices_say(kind, kinds, reference):
    """At every interface u_2 = -1/2 q K_L q: the displacement that forces make against the work of unit loads."""
    model = MODELS[kind](kinds)
    L, body = functionals(reference, model.coupled), factorised(model.coupled)
    basis, held = CraigBampton(4).basis(model.coupled, body, L), supported(body, L)
    K = stiffening_matrices(model, fp.Request(name="b", reference=reference, reduction=CraigBampton(4)), held, basis)
    second = model.second(basis.Z)
    prescribed, n = _prescribed(model, held, reference, second), basis.omega2.size
    for i in range(n):
        u = solve_refined(held, -second.forces(range(i, i + 1)), prescribed[:, i, i:])[0]
        moved = model.coupled.C @ u - second.known[12:, i, i:]
        np.testing.assert_allclose(moved, -K[12:, i, i:], rtol=0, atol=1e-10 * np.abs(K[12:]).max())


@pytest.mark.slow
def test_the_drawn_face_of_a_rigid_interface_moves_as_one_piece(made):
    """By u_2 and the rotation vector theta_2 of the interface, and phi x (phi x r) / 2."""
    body = made("solid, rigid", MEAN)
    for k, interface in enumerate(body.interfaces):
        near = np.flatnonzero(np.abs((body.surface.points - interface.position) @ rotation(5)[:, 0]) < 1e-9)
        assert near.size >= 8
        r, K = body.surface.points[near] - interface.position, body.stiffening[12 + 6 * k : 18 + 6 * k]
        q = np.random.default_rng(k).normal(size=body.n) / np.sqrt(body.omega2)
        shift, turn = -np.einsum("cij,i,j->c", K, q, q).reshape(2, 3) / 2
        phi = interface.phi_r @ q
        expected = shift + np.cross(turn, r) + np.cross(phi, np.cross(phi, r)) / 2
        found = values(body.surface.second, q)[near]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(found).max())


# ---- other frames ---------------------------------------------------------------------------------------------------

# Inside beam elements shear and twist are those of shapes that know no turn; nodes are exact. Plates keep bending moments.
ACCURACY = {
    "solid, mean": 1e-9,
    "solid, rigid": 1e-9,
    "beams": 2e-3,
    "beams, mean": 6e-3,
    "solid and beam": 2e-4,
    "solid and beam, mean": 2e-4,
    "plates": 0.04,
}


@pytest.mark.parametrize(("old", "new"), list(permutations(REFERENCES, 2)), ids=lambda of: type(of).__name__)
@pytest.mark.parametrize("kind", ACCURACY)
def test_the_converted_surface_is_that_of_a_direct_reduction(made, exact, kind, old, new):
    converted, direct = with_reference(made(kind, old), new), made(kind, new)
    signs = np.sign(np.einsum("pci,pci->i", converted.surface.Phi, direct.surface.Phi))
    found = all_pairs(converted.surface.second) * np.outer(signs, signs) * sizes(direct)
    expected = all_pairs(direct.surface.second) * sizes(direct)
    np.testing.assert_allclose(found, expected, rtol=0, atol=ACCURACY[kind] * np.abs(expected).max())


def portal(reference):
    """A closed frame in space, which its displacement cannot free of second-order section forces."""
    corners = [(0, 0, 0), (0, 1, 0.2), (1, 1, 0), (1, 0, 0), (0, 0, 0)]
    frame = polyline(corners, Member(rectangle(0.05, 0.065), STEEL, (0, 0, 1.0)), elements=4)
    model = fp.from_frame(named(frame, left=corners[0], right=corners[2]), regions(KINDS[0]))
    return fp.reduce(model, fp.Request(name="b", reference=reference, reduction=CraigBampton(4), stress=True))


def stressed_solid(reference):
    return fp.reduce(solid(KINDS[2]), fp.Request(name="b", reference=reference, reduction=CraigBampton(4), stress=True))


@pytest.mark.slow
@pytest.mark.parametrize("make", [portal, stressed_solid])
def test_no_frame_changes_the_stress(make, exact):
    """Strains of second order are those of Green, or of axes that turn with the sections."""
    bodies = {reference: make(reference) for reference in REFERENCES}
    for old, new in permutations(REFERENCES, 2):
        converted, direct = with_reference(bodies[old], new), bodies[new]
        signs = np.sign(np.einsum("pci,pci->i", converted.surface.Phi, direct.surface.Phi))
        fields = [(converted.surface.second_stress, direct.surface.second_stress)]
        if direct.surface.beams:
            fields.append((converted.surface.beams.second, direct.surface.beams.second))
        for found, expected in fields:
            wanted = all_pairs(expected) * sizes(direct)
            turned = all_pairs(found) * np.outer(signs, signs) * sizes(direct)
            np.testing.assert_allclose(turned, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())


def test_a_cantilever_frees_itself_of_second_order_section_forces():
    """But for the shear of sections that are bent and twisted, kappa x M."""
    line = polyline([(0, 0, 0), (1, 0, 0)], Member(rectangle(0.05, 0.065), STEEL, (0, 1.0, 0)), elements=8)
    model = fp.from_frame(named(line, left=(0, 0, 0), right=(1, 0, 0)), regions(KINDS[0]))
    body = fp.reduce(model, fp.Request(name="b", reference=FIXED, reduction=CraigBampton(4), stress=True))
    q = np.random.default_rng(3).normal(size=body.n)
    section, M = rectangle(0.05, 0.065), (body.surface.beams.modes @ q)[:, 1, 3:]
    kappa = M / [STEEL.E / (2 + 2 * STEEL.nu) * section.J, STEEL.E * section.Iy, STEEL.E * section.Iz]
    expected = np.zeros((8, 3, 6))
    expected[..., 1:3] = (np.cross(kappa, M)[:, [2, 1]] * [-1, 1])[:, None]
    assert np.abs(expected).max() > 0
    found = values(body.surface.beams.second, q)  # of few fields, as bodies keep them
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


# ---- ties -------------------------------------------------------------------------------------------------------------


def chain(ties):
    ends = [((0, 0, 0), (0.4, 0, 0)), ((0.45, 0.05, 0), (0.8, 0.05, 0.02)), ((0.85, 0, 0.05), (1.2, 0.1, 0.05))]
    parts = {}
    for k, (a, b) in enumerate(ends):
        line = named(polyline([a, b], Member(rectangle(0.03, 0.04), STEEL, (0, 1.0, 0)), elements=3), a=a, b=b)
        parts[f"p{k}"] = fp.from_frame(line, [InterfaceRegion("a"), InterfaceRegion("b")])
    return fp.reduce(tied(parts, ties), fp.Request(name="b", reference=FixedTo("a"), reduction=CraigBampton(4)))


@pytest.mark.slow
def test_parts_stay_together_whichever_follows_the_other(exact):
    """Distances across a tie keep to third order; and no order of ties changes anything."""
    orders = (
        [("p0.b", "p1.a"), ("p1.b", "p2.a")],
        [("p1.b", "p2.a"), ("p1.a", "p0.b")],
        [("p2.a", "p1.b"), ("p0.b", "p1.a")],
    )
    body, *others = map(chain, orders)
    for other in others:
        expected = all_pairs(body.surface.second)
        np.testing.assert_allclose(all_pairs(other.surface.second), expected, atol=1e-9 * np.abs(expected).max())
    points = body.surface.points
    ends = [np.flatnonzero(np.linalg.norm(points - end, axis=1) < 0.026) for end in ((0.4, 0, 0), (0.45, 0.05, 0))]
    q = np.linspace(1, 2, body.n) / np.sqrt(body.omega2)

    def stretch(factor):
        one, other = ((points + displacements(body.surface, factor * q))[end] for end in ends)
        across = np.linalg.norm(points[ends[0]][:, None] - points[ends[1]], axis=-1)
        return np.abs(np.linalg.norm(one[:, None] - other, axis=-1) - across).max()

    assert all(end.size >= 4 for end in ends)
    assert stretch(0.8) / stretch(0.4) == pytest.approx(8, rel=0.1)


# ---- added points -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [kind for kind in ACCURACY if kind != "beams, mean"])
def test_an_added_point_moves_alike_in_every_frame(made, exact, kind):
    """Converted with its load matrices, or added to the converted body."""
    body = made(kind, FIXED)
    place = body.surface.points[len(body.surface.points) // 3]
    one = with_reference(pointed(body, "p", place), MEAN).stiffening[-6:]
    other = pointed(with_reference(body, MEAN), "p", place).stiffening[-6:]
    largest = np.abs(other).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(one / largest, other / largest, rtol=0, atol=1e-9)


def test_an_added_point_turns_with_a_rigid_face(made):
    """On the face of a rigid interface all neighbours in the face, and behind it, turn with it to first order; the rotation
    vector to second order is that of the interface but for what strains behind it do."""
    body = made("solid, rigid", MEAN)
    interface, K = body.interfaces[1], body.stiffening[18:24]
    near = np.argmin(np.linalg.norm(body.surface.points - interface.position, axis=1))
    r = body.surface.points[near] - interface.position
    point = pointed(body, "p", body.surface.points[near])
    phi = interface.phi_r
    G = np.einsum("ai,bj->abij", phi, phi)
    G = (G + G.transpose(1, 0, 2, 3)) / 2 - np.einsum("ki,kj->ij", phi, phi) * np.eye(3)[..., None, None]
    turned = np.einsum("abij,b->aij", (G + G.transpose(0, 1, 3, 2)) / 2, r)
    moved = K[:3] + np.cross(K[3:], r[:, None, None], axis=0) - turned
    np.testing.assert_allclose(point.stiffening[-6:-3], moved, rtol=0, atol=1e-9 * np.abs(moved).max())


def test_a_point_without_second_order_is_refused(made):
    body = made("solid, mean", MEAN)
    old = replace(body, surface=replace(body.surface, second=None))
    with pytest.raises(BodyError, match="no second-order displacement of its surface, which the point 'p' needs"):
        pointed(old, "p", old.centre_of_mass)
    assert pointed(replace(old, stiffening=None), "p", old.centre_of_mass).interfaces[-1].name == "p"


# ---- what is kept -----------------------------------------------------------------------------------------------------


def test_few_shapes_tell_all_pairs(made):
    """Within the tolerance of the largest displacement, for every state of one energy."""
    full = made("beams", FIXED)
    field = full.surface.second
    i, j = np.triu_indices(full.n)
    kept = second_order.compressed(all_pairs(field)[..., i, j], full.omega2)
    assert kept.weights.shape[0] < field.weights.shape[0]
    states = np.random.default_rng(0).normal(size=(50, full.n))
    q = states / np.linalg.norm(states, axis=1, keepdims=True) / np.sqrt(full.omega2)
    largest = np.linalg.norm((all_pairs(field) * sizes(full)).reshape(-1, 3 * full.n**2), axis=1)
    off = np.linalg.norm(values(kept, q) - values(field, q), axis=-1).max()
    assert off < 2 * second_order.TOLERANCE * largest.max()


def test_files_and_other_coordinates_keep_the_second_order(made, tmp_path):
    body = stressed_solid(MEAN)
    again = load_body(save_body(body, tmp_path / "b.ffr"))
    for name in ("second", "second_stress"):
        for key in ("shapes", "weights"):
            np.testing.assert_array_equal(
                getattr(getattr(again.surface, name), key), getattr(getattr(body.surface, name), key)
            )
    ring = portal(MEAN)
    back = load_body(save_body(ring, tmp_path / "r.ffr"))
    np.testing.assert_array_equal(back.surface.beams.second.weights, ring.surface.beams.second.weights)
    p = np.array([1.0, -2.0, 0.5])
    few, q = truncated(body, [0, 2, 5]), np.zeros(body.n)
    q[[0, 2, 5]] = p
    np.testing.assert_allclose(displacements(few.surface, p), displacements(body.surface, q), rtol=1e-12)
    V, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(body.n, 3)))
    other = combined(body, V, np.ones(3))
    np.testing.assert_allclose(displacements(other.surface, p), displacements(body.surface, V @ p), rtol=1e-9)


def test_only_the_lowest_modes_foreshorten_where_asked(exact):
    request = fp.Request(name="b", reference=FIXED, reduction=CraigBampton(4))
    whole, some = (fp.reduce(beam(KINDS[0]), replace(request, drawn_modes=count)) for count in (None, 3))
    expected = np.array(all_pairs(whole.surface.second))
    expected[..., 3:, :] = expected[..., :, 3:] = 0.0
    found = all_pairs(some.surface.second)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_array_equal(some.stiffening, whole.stiffening)


def test_linear_bodies_have_none():
    body = fp.reduce(beam(KINDS[0]), fp.Request(name="b", reference=FIXED, reduction=CraigBampton(2), linear=True))
    assert body.surface.second is None
    assert body.surface.second_stress is None
    with pytest.raises(fp.InputError, match="drawn_modes is 0"):
        fp.Request(name="b", reference=FIXED, reduction=CraigBampton(2), drawn_modes=0)


def test_second_orders_too_large_are_refused(monkeypatch):
    """Before anything is computed for them; what is remedied goes through."""
    request = fp.Request(name="b", reference=FIXED, reduction=CraigBampton(4))
    model = beam(KINDS[0])
    monkeypatch.setattr(of_surfaces, "MOST", 3e5)
    with pytest.raises(fp.InputError, match=r"surface needs 55 static problems .* of 10 modes: .*drawn_modes"):
        fp.reduce(model, request)
    assert fp.reduce(model, replace(request, drawn_modes=2)).stiffening is not None
    monkeypatch.setattr(of_surfaces, "MOST", 5e3)
    with pytest.raises(fp.InputError, match=r"load matrices of 6 modes and 2 interfaces .* leave them out \(linear\)"):
        fp.reduce(model, replace(request, reduction=fp.Guyan()))
    assert fp.reduce(model, replace(request, linear=True)).stiffening is None


def test_hundreds_of_modes_are_refused_by_default():
    points = np.zeros((2000, 3))
    shown = Surface(points, np.zeros((0, 3), int), np.zeros((2000, 3, 0)))
    of_surfaces.check_size(100, 2, shown, None)
    with pytest.raises(fp.InputError, match=r"needs 45150 static problems and 73.9 GB"):
        of_surfaces.check_size(300, 2, shown, None)
    of_surfaces.check_size(300, 2, shown, 60)
    of_surfaces.check_size(300, 2, None, None)


def test_modes_that_are_too_many_are_refused_before_they_are_looked_for(monkeypatch):
    """By number they are known; up to a frequency they are not, and are refused after the search."""
    line = polyline([(0, 0, 0), (1, 0, 0)], Member(rectangle(0.05, 0.065), STEEL, (0, 1.0, 0)), elements=8)
    model, said = fp.from_frame(named(line, a=(0, 0, 0)), [fp.InterfaceRegion("a")]), list[str]()
    monkeypatch.setattr(of_surfaces, "MOST", 1e5)

    def refused(reduction: fp.Reduction) -> list[str]:
        said.clear()
        request = fp.Request(name="bar", reference=fp.FixedTo("a"), reduction=reduction)
        with pytest.raises(fp.InputError, match=r"surface needs \d+ static problems"):
            fp.reduce(model, request, progress=said.append)
        return said

    assert refused(fp.Eigenmodes(12)) == []
    assert refused(fp.CraigBampton(np.int64(12))) == []
    assert "reduce" in refused(fp.Eigenmodes(fp.UpTo(5000.0)))
    fp.reduce(model, fp.Request(name="bar", reference=fp.FixedTo("a"), reduction=fp.Eigenmodes(12), linear=True))
