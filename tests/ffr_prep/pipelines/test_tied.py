"""Solids, beams and plates joined to one body: exact inertia, agreement with bodies of one kind, every guard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from boxes import box_mesh, moved, rotation

import ffr_prep as fp
from ffr_prep.body import load_body, save_body
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.pipelines.tied import elimination, tied
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.frame import Member, Shell, named, panel, polyline
from ffr_prep.structures.sections import rectangle

L, B, H = 1.0, 0.04, 0.03  # a bar along x, width along y, height along z
STEEL = Material("steel", 2.1e11, 0.0, 7850.0)  # no lateral contraction, so that clamping a face does not stiffen
END = {"reference": FixedTo("root"), "reduction": CraigBampton(6)}


def solid_half(x: float, length: float, cells: int, *, left: str, right: str, R=None, kind: str = "rigid"):
    """A box from x to x + length with interfaces of these names at its ends."""
    mesh = box_mesh("hex20", (length, B, H), (cells, 1, 1), (x, -B / 2, -H / 2))
    mesh = mesh if R is None else moved(mesh, R, np.zeros(3))
    ends = [InterfaceRegion(left, "left"), InterfaceRegion(right, "right", kind)]
    return fp.from_mesh(mesh, STEEL, ends)


def beam_half(x: float, length: float, elements: int, *, left: str, right: str, R=None):
    R = np.eye(3) if R is None else R
    a, b = tuple(R @ (x, 0, 0)), tuple(R @ (x + length, 0, 0))
    member = Member(rectangle(B, H), STEEL, tuple(R @ (0, 0, 1.0)))
    frame = named(polyline([a, b], member, elements=elements), **{left: a, right: b})
    return fp.from_frame(frame, [InterfaceRegion(left), InterfaceRegion(right)])


def half_and_half(R=None, kind: str = "rigid"):
    solid = solid_half(0, L / 2, 10, left="root", right="joint", R=R, kind=kind)
    beam = beam_half(L / 2, L / 2, 12, left="joint", right="tip", R=R)
    return tied({"solid": solid, "beam": beam}, [("solid.joint", "beam.joint")])


@pytest.mark.parametrize("seed", [None, 3])
@pytest.mark.parametrize("kind", ["rigid", "mean"])
def test_rigid_inertia_of_half_a_solid_and_half_a_beam_is_that_of_the_bar(seed, kind):
    R = np.eye(3) if seed is None else rotation(seed)
    body = fp.reduce(half_and_half(R, kind), fp.Request(name="bar", **END))
    mass = STEEL.rho * L * B * H
    centre = R @ (L / 2, 0, 0)
    second = R @ np.diag([L**2, B**2, H**2]) @ R.T / 12 + np.outer(centre, centre)
    np.testing.assert_allclose(body.mass, mass, rtol=1e-12)
    np.testing.assert_allclose(body.r_dm, mass * centre, atol=1e-12 * mass)
    np.testing.assert_allclose(body.rr_dm, mass * second, atol=1e-12 * mass)
    assert [i.name for i in body.interfaces] == ["root", "tip"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rigid", "mean"])
def test_half_and_half_vibrates_as_one_bar(kind):
    """Bending both ways: between all beam and all solid, which agree to 2e-3 at this slenderness."""
    half = fp.reduce(half_and_half(kind=kind), fp.Request(name="bar", **END)).frequencies
    beam = fp.reduce(beam_half(0, L, 24, left="root", right="tip"), fp.Request(name="bar", **END)).frequencies
    solid = fp.reduce(solid_half(0, L, 20, left="root", right="tip"), fp.Request(name="bar", **END)).frequencies
    np.testing.assert_allclose(beam[:4], solid[:4], rtol=2e-3)
    np.testing.assert_allclose(half[:4], solid[:4], rtol=2e-3)


@pytest.mark.slow
def test_a_beam_cut_in_two_is_the_beam():
    """Every invariant, the stiffening and the motion of the interfaces, to rounding."""
    first = beam_half(0, 0.4, 4, left="root", right="joint")
    second = beam_half(0.4, 0.6, 6, left="joint", right="tip")
    model = tied({"first": first, "second": second}, [("first.joint", "second.joint")])
    whole = beam_half(0, 1.0, 10, left="root", right="tip")
    one, two = (fp.reduce(m, fp.Request(name="b", stress=True, **END)) for m in (whole, model))
    np.testing.assert_allclose(two.omega2, one.omega2, rtol=1e-8)
    np.testing.assert_allclose(np.abs(two.P_dm), np.abs(one.P_dm), atol=1e-7)
    sign = np.sign(np.einsum("kj,kj->j", one.interface("tip").phi_t, two.interface("tip").phi_t))
    sign[one.interface("tip").phi_r[0] * two.interface("tip").phi_r[0] < -1e-3] = -1  # torsion
    sign[one.interface("tip").phi_r[0] * two.interface("tip").phi_r[0] > 1e-3] = 1
    np.testing.assert_allclose(two.PP_dm * np.outer(sign, sign), one.PP_dm, atol=1e-7)
    size = np.maximum(np.abs(one.stiffening).max(axis=(1, 2), keepdims=True), 1e-6)
    np.testing.assert_allclose(two.stiffening * np.outer(sign, sign) / size, one.stiffening / size, atol=1e-6)
    assert two.surface.beams.modes.shape[0] == 10


def test_a_solid_cut_in_two_keeps_its_rigid_motions():
    model = half_and_half(rotation(1))
    T, K, M = model.coupled.T, model.coupled.K, model.coupled.M
    assert np.abs(K @ T).max() < 1e-9 * abs(K).max()
    assert np.linalg.matrix_rank(T) == 6
    inertia = T.T @ (M @ T)
    np.testing.assert_allclose(np.diag(inertia)[:3], STEEL.rho * L * B * H, rtol=1e-12)
    free = fp.reduce(model, fp.Request(name="b", reference=MeanAxis(), reduction=Eigenmodes(6)))
    assert free.frequencies[0] > 100


def test_a_tie_between_points_that_differ_is_a_rigid_arm():
    """Two beams one above the other, tied by an arm: the tip of the second moves as the arm turns."""
    first = beam_half(0, 0.5, 4, left="root", right="end")
    frame = named(
        polyline([(0.5, 0, 0.2), (0.8, 0, 0.2)], Member(rectangle(B, H), STEEL, (0, 0, 1.0))), a=(0.5, 0, 0.2)
    )
    second = fp.from_frame(named(frame, tip=(0.8, 0, 0.2)), [InterfaceRegion("a"), InterfaceRegion("tip")])
    parts = {"first": first, "second": second}
    X, _ = elimination(parts, [("first.end", "second.a")])
    model = tied(parts, [("first.end", "second.a")])
    z = X @ np.random.default_rng(0).normal(size=(X.shape[1], 1))
    end, a = (parts[p].coupled.C for p in parts)
    end, a = (end @ z[: end.shape[1]])[6:, 0], (a @ z[-a.shape[1] :])[:6, 0]
    np.testing.assert_allclose(a[3:], end[3:], atol=1e-14)
    np.testing.assert_allclose(a[:3], end[:3] + np.cross(end[3:], (0, 0, 0.2)), atol=1e-14)
    assert model.coupled.names == ("root", "tip")
    (told,) = model.record["warnings"]
    assert told.startswith("'first.end' and 'second.a' are tied over 0.2 m, by a rigid arm without mass")
    assert not half_and_half().record["warnings"]
    np.testing.assert_allclose(
        np.abs(model.coupled.K @ model.coupled.T).max(), 0, atol=1e-9 * abs(model.coupled.K).max()
    )


@pytest.mark.slow
def test_a_plate_on_a_solid_and_a_beam_on_the_plate(tmp_path):
    """Three kinds in one body, with a drawing surface, stress and a file."""
    shell = panel(
        [(L / 2, -B / 2, 0), (L, -B / 2, 0), (L, B / 2, 0), (L / 2, B / 2, 0)], Shell(H, STEEL), elements=(6, 2)
    )
    x = shell.points[:, 0]
    shell = replace(shell, node_groups={"a": np.flatnonzero(x < 0.5 + 1e-9), "b": np.flatnonzero(x > 1 - 1e-9)})
    parts = {
        "solid": solid_half(0, L / 2, 6, left="root", right="joint"),
        "plate": fp.from_frame(shell, [InterfaceRegion("a"), InterfaceRegion("b")]),
        "beam": beam_half(L, L / 2, 4, left="a", right="tip"),
    }
    model = tied(parts, [("solid.joint", "plate.a"), ("plate.b", "beam.a")])
    body = fp.reduce(model, fp.Request(name="rod", stress=True, **END))
    assert body.mass == pytest.approx(STEEL.rho * 1.5 * L * B * H, rel=1e-12)
    beam = fp.reduce(beam_half(0, 1.5 * L, 24, left="root", right="tip"), fp.Request(name="rod", **END))
    np.testing.assert_allclose(body.frequencies[0], beam.frequencies[0], rtol=0.01)
    assert body.surface.stress.shape[0] == len(body.surface.points)
    corners = body.surface.points[body.surface.triangles]
    volume = np.einsum("tk,tk->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(1.5 * L * B * H, rel=1e-9)
    tension = body.stiffening[12 + 6]  # a pull at the tip
    weak = np.abs(scipy.linalg.eigvalsh(tension, np.diag(body.omega2))).max()
    I = B * H**3 / 12  # noqa: E741
    assert 1 / weak == pytest.approx(np.pi**2 * STEEL.E * I / 4 / (1.5 * L) ** 2, rel=0.02)
    again = load_body(save_body(body, tmp_path / "rod.ffr"))
    assert set(again.provenance["parts"]) == {"solid", "plate", "beam"}
    assert again.provenance["ties"][0] == ["solid.joint", "plate.a"]


def test_one_model_alone_is_the_body_of_its_kind():
    mesh = box_mesh("hex20", (0.3, B, H), (3, 1, 1))
    model, request = (
        fp.from_mesh(mesh, STEEL, [InterfaceRegion("root", "left")]),
        fp.Request(name="b", **END),
    )
    whole = fp.reduce(model, request)
    part = fp.reduce(tied({"one": model}, []), request)
    for key in ("omega2", "rr_dm", "PP_dm", "rP_dm", "stiffening"):
        np.testing.assert_array_equal(getattr(part, key), getattr(whole, key))
    np.testing.assert_array_equal(part.surface.Phi, whole.surface.Phi)
    assert part.provenance["parts"]["one"]["mesh"] == whole.provenance["mesh"]


def test_warnings_of_the_parts_are_kept():
    mesh = box_mesh("tet4", (0.3, B, H), (3, 1, 1))
    solid = fp.from_mesh(mesh, STEEL, [InterfaceRegion("root", "left"), InterfaceRegion("end", "right")])
    model = tied({"block": solid, "beam": beam_half(0.3, 0.3, 2, left="a", right="b")}, [("block.end", "beam.a")])
    assert model.record["warnings"][0].startswith("block: 18 first-order tetrahedra")


# ---- guards -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ties", "says"),
    [
        ([("one.b", "two.x")], "no interface 'x'; the interfaces are: 'c', 'd'"),
        ([("one.b", "three.c")], "tie of 'three.c': write PART.INTERFACE; the parts are 'one', 'two'"),
        ([("b", "two.c")], "tie of 'b': write PART.INTERFACE"),
        ([("one.b", "two.c"), ("one.b", "two.d")], "'one.b' is in 2 ties"),
        ([], "nothing joins 'one' to 'two'"),
    ],
)
def test_ties_that_cannot_be_used(ties, says):
    parts = {"one": beam_half(0, 1, 2, left="a", right="b"), "two": beam_half(1, 1, 2, left="c", right="d")}
    with pytest.raises(InputError, match=says):
        tied(parts, ties)


def test_two_mean_interfaces_cannot_be_tied():
    parts = {
        "one": solid_half(0, 0.2, 2, left="a", right="b", kind="mean"),
        "two": solid_half(0.2, 0.2, 2, left="c", right="d", kind="mean"),
    }
    with pytest.raises(InputError, match=r"'one\.b' and 'two.d' are both mean"):
        tied(parts, [("one.b", "two.d")])


def test_interface_names_are_of_one_part():
    parts = {"one": beam_half(0, 1, 2, left="a", right="b"), "two": beam_half(1, 1, 2, left="c", right="a")}
    with pytest.raises(InputError, match="interface name 'a' is in more than one part"):
        tied(parts, [("one.b", "two.c")])


def test_an_interface_cannot_be_tied_to_one_that_it_moves():
    """A mean interface over a face that has nodes of the rigid one."""
    mesh = box_mesh("hex8", (0.3, B, H), (3, 1, 1))
    part = fp.from_mesh(mesh, STEEL, [InterfaceRegion("end", "right"), InterfaceRegion("top", kind="mean")])
    with pytest.raises(InputError, match=r"'one\.end' and 'one\.top' move one another"):
        tied({"one": part}, [("one.end", "one.top")])


def test_reduced_frames_and_models_are_the_same_body():
    frame = named(polyline([(0, 0, 0), (1, 0, 0)], Member(rectangle(B, H), STEEL, (0, 0, 1.0))), root=(0, 0, 0))
    ends = [InterfaceRegion("root")]
    one = fp.reduce(fp.from_frame(frame, ends), fp.Request(name="b", **END))
    two = fp.reduce(fp.from_frame(frame, ends), fp.Request(name="b", **END))
    np.testing.assert_allclose(two.omega2, one.omega2, rtol=1e-12)
