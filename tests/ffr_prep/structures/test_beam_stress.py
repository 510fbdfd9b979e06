"""Section forces and stress of beams: equilibrium, closed forms, invariance, the body file."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import rotation
from test_structural import STEEL, regions, space_frame, straight

import ffr_prep as fp
from ffr_prep.body import SECTION_FORCES, BodyError, load_body, save_body, truncated
from ffr_prep.model.reference import FixedTo
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.beam_stress import section_forces_at
from ffr_prep.structures.sections import (
    box,
    circle,
    general,
    i_section,
    rectangle,
    shear_rigid,
    shifted,
    tube,
    with_mass_moments,
)

LENGTH = 1.2
LOAD = np.array([2e4, 300.0, -500.0, 60.0, -70.0, 90.0])


def reduced(frame, names=("root", "tip"), modes=0, reduction=CraigBampton):
    return fp.reduce(
        fp.from_frame(frame, regions(*names)),
        fp.Request(name="frame", reference=FixedTo(names[0]), reduction=reduction(modes), stress=True),
    )


def static(body, interface, load):
    """(n,) elastic coordinates under a force and moment (6,) at an interface, in body axes."""
    at = body.interface(interface)
    return np.vstack([at.phi_t, at.phi_r]).T @ load / body.omega2


def moment_at(x, load):
    """Internal moment at x of a cantilever along x under a load at its tip."""
    return load[3:] + np.cross([LENGTH - x, 0.0, 0.0], load[:3])


@pytest.mark.parametrize(
    "section", [circle(0.05), rectangle(0.02, 0.06), i_section(0.1, 0.06, 0.005, 0.008), box(0.06, 0.1, 0.004)]
)
@pytest.mark.parametrize("elements", [1, 3])
def test_section_forces_of_a_cantilever_balance_its_load(section, elements):
    body = reduced(straight(section, LENGTH, elements))
    beams = body.surface.beams
    found = beams.modes @ static(body, "tip", LOAD)
    for place, forces in zip(beams.positions.reshape(-1, 3), found.reshape(-1, 6), strict=True):
        np.testing.assert_allclose(forces[:3], LOAD[:3], rtol=1e-7)
        np.testing.assert_allclose(forces[3:], moment_at(place[0], LOAD), rtol=1e-7, atol=1e-5)
    np.testing.assert_allclose(beams.positions[0, 1], [LENGTH / elements / 2, 0, 0], atol=1e-15)
    assert len(SECTION_FORCES) == beams.modes.shape[2]


def test_nodes_of_a_space_frame_are_in_equilibrium():
    """At a node without load the section forces of all members that meet there cancel, offsets included."""
    frame = space_frame()
    body = reduced(frame, ("a", "b"))
    q = static(body, "b", LOAD)
    beams = body.surface.beams
    ends = (beams.modes @ q)[:, [0, 2]] * np.array([1.0, -1.0])[:, None]  # on the node, by the element
    force = np.einsum("eij,enj->eni", beams.axes, ends[..., :3])
    moment = np.einsum("eij,enj->eni", beams.axes, ends[..., 3:])
    arms = beams.positions[:, [0, 2]] - frame.points[frame.elements]
    moment = moment + np.cross(arms, force)
    held = {int(frame.node_groups[name][0]) for name in ("a", "b")}
    assert np.abs(arms).max() > 0.01
    for node in set(range(len(frame.points))) - held:
        here = frame.elements == node
        assert here.sum() >= 2
        np.testing.assert_allclose(force[here].sum(axis=0), 0.0, atol=1e-7 * np.abs(force).max())
        np.testing.assert_allclose(moment[here].sum(axis=0), 0.0, atol=1e-7 * np.abs(moment).max())
    loaded = frame.elements == frame.node_groups["b"][0]
    np.testing.assert_allclose(-force[loaded].sum(axis=0), LOAD[:3], rtol=1e-7, atol=1e-3)
    np.testing.assert_allclose(-moment[loaded].sum(axis=0), LOAD[3:], rtol=1e-7, atol=1e-3)


def in_body_axes(beams, q):
    """(E, 3, 2, 3) force and moment at the three places of each element."""
    return np.einsum("eij,esmj->esmi", beams.axes, (beams.modes @ q).reshape(-1, 3, 2, 3))


def test_a_turned_frame_has_turned_section_forces_and_stress():
    R = rotation(5)
    here, there = (reduced(space_frame(turned=T), ("a", "b")) for T in (np.eye(3), R))
    q = static(here, "b", LOAD)
    q_turned = static(there, "b", np.concatenate([R @ LOAD[:3], R @ LOAD[3:]]))
    forces, turned = in_body_axes(here.surface.beams, q), in_body_axes(there.surface.beams, q_turned)
    np.testing.assert_allclose(turned, forces @ R.T, atol=1e-7 * np.abs(forces).max())
    # a round member chooses its own y', so its outline is elsewhere
    same = np.isclose(there.surface.points, here.surface.points @ R.T, atol=1e-9).all(axis=1)
    assert same.sum() > 50
    one, other = full_tensor(here.surface.stress @ q)[same], full_tensor(there.surface.stress @ q_turned)[same]
    np.testing.assert_allclose(other, R @ one @ R.T, atol=1e-7 * np.abs(one).max())


def full_tensor(six):
    return six[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)


def test_stress_of_a_round_bar():
    """Tension, bending about both axes and torsion together: Timoshenko & Goodier (1970)."""
    d = 0.05
    body = reduced(straight(circle(d), LENGTH, 2))
    stress = body.surface.stress @ static(body, "tip", LOAD)
    second, area = np.pi * d**4 / 64, np.pi * d**2 / 4
    for (x, y, z), found in zip(body.surface.points, stress, strict=True):
        _, My, Mz = moment_at(x, LOAD)
        sigma = LOAD[0] / area + My * z / second - Mz * y / second
        along = 4 / (3 * area) * (LOAD[2] * y - LOAD[1] * z) / (d / 2) + LOAD[3] * d / (4 * second)  # round the outline
        expected = [sigma, 0, 0, -along * z / (d / 2), along * y / (d / 2), 0]
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7 * np.abs(stress).max())
    np.testing.assert_array_equal(body.surface.moduli, np.tile([STEEL.E, STEEL.nu], (len(stress), 1)))


def test_shear_of_a_rectangle_and_the_tension_of_its_offset():
    """Torque: 0.267 and 0.263 b h^2 of sides of 3 to 1, 0.753 of it at the short ones: Timoshenko & Goodier, art. 109."""
    section = shifted(rectangle(0.02, 0.06), 0.05, 0.0)
    body = reduced(straight(section, LENGTH, 1))
    y, z = body.surface.points[:, 1] - 0.05, body.surface.points[:, 2]
    shear = (body.surface.stress @ static(body, "tip", np.array([0, 0, 0, 50.0, 0, 0])))[:, 3:5]
    most = 50.0 / (0.267 * 0.02**2 * 0.06)
    long, short = np.abs(y) < 1e-9, np.abs(z) < 1e-9
    np.testing.assert_allclose(shear[long], np.outer(-np.sign(z[long]) * most, [1.0, 0.0]), atol=2e-3 * most)
    np.testing.assert_allclose(shear[short], np.outer(np.sign(y[short]) * 0.753 * most, [0.0, 1.0]), atol=2e-3 * most)
    np.testing.assert_allclose(shear[~(long | short)], 0.0, atol=1e-6 * most)
    shear = (body.surface.stress @ static(body, "tip", np.array([0, 300.0, -500.0, -500.0 * 0.05, 0, 0])))[:, 3:5]
    np.testing.assert_allclose(shear[long], np.tile([1.5 * 300 / section.A, 0], (long.sum(), 1)), atol=1.0)
    np.testing.assert_allclose(shear[short], np.tile([0, -1.5 * 500 / section.A], (short.sum(), 1)), atol=1.0)
    tension = body.surface.stress @ static(body, "tip", np.array([1e4, 0, 0, 0, 0, 0]))
    Mz = 1e4 * 0.05  # the force on the line of the nodes, about the centroid: -F * -offset
    np.testing.assert_allclose(tension[:, 0], 1e4 / section.A - Mz * y / section.Iz, rtol=1e-6)


def test_a_tube_under_torque_has_the_shear_of_its_outer_radius():
    body = reduced(straight(tube(0.06, 0.004), LENGTH, 1))
    stress = body.surface.stress @ static(body, "tip", np.array([0, 0, 0, 100.0, 0, 0]))
    J = np.pi * (0.06**4 - 0.052**4) / 32
    np.testing.assert_allclose(np.hypot(stress[:, 3], stress[:, 4]), 100.0 * 0.03 / J, rtol=1e-7)


def test_an_i_section_has_the_shear_of_its_strips():
    """Torque: M t / J in the middle of a strip; Qy: Q S / (I t) in the web, Qz: half of it in each flange, 3/2 at most."""
    h, b, web, flange = 0.1, 0.06, 0.005, 0.008
    section = i_section(h, b, web, flange)
    body = reduced(straight(section, LENGTH, 1))
    y, z = body.surface.points[:, 1:].T

    def von_mises(load, where):
        stress = body.surface.stress @ static(body, "tip", load)
        return np.sqrt(3 * (stress[where, 3] ** 2 + stress[where, 4] ** 2))

    in_web = (np.abs(y) < 1e-9) & np.isclose(np.abs(z), web / 2)
    on_flange = np.isclose(np.abs(y), h / 2) & (np.abs(z) < 1e-9)
    assert in_web.sum() == on_flange.sum() == 10
    torque = np.array([0, 0, 0, 20.0, 0, 0])
    np.testing.assert_allclose(von_mises(torque, in_web), np.sqrt(3) * 20.0 * web / section.J, rtol=1e-6)
    np.testing.assert_allclose(von_mises(torque, on_flange), np.sqrt(3) * 20.0 * flange / section.J, rtol=1e-3)
    inner = h - 2 * flange
    S = b * flange * (h - flange) / 2 + web * inner**2 / 8
    along_y = np.sqrt(3) * 300.0 * S / (section.Iz * web)
    np.testing.assert_allclose(von_mises(np.array([0, 300.0, 0, 0, 0, 0]), in_web), along_y, rtol=1e-6)
    along_z = np.sqrt(3) * 1.5 * 300.0 / (2 * b * flange)
    np.testing.assert_allclose(von_mises(np.array([0, 0, 300.0, 0, 0, 0]), on_flange), along_z, rtol=1e-6)


def test_a_box_has_the_shear_of_its_cell_and_of_its_webs():
    """Torque: Bredt's M / 2 A' t, outside more by what walls carry alone; Qy: Q S / (2 I t) in webs; corners have none."""
    b, h, t = 0.06, 0.1, 0.004
    section = box(b, h, t)
    body = reduced(straight(section, LENGTH, 1))
    y, z = body.surface.points[:, 1:].T

    def at(load, where):
        return (body.surface.stress @ static(body, "tip", load))[where][:, [0, 3, 4]]

    torque, across = np.array([0, 0, 0, 50.0, 0, 0]), np.array([0, 300.0, 0, 0, 0, 0])
    web, top = (np.abs(y) < 1e-9) & np.isclose(z, b / 2), (np.abs(z) < 1e-9) & np.isclose(y, h / 2)
    corner = np.isclose(np.abs(y), h / 2) & np.isclose(np.abs(z), b / 2)
    assert (web.sum(), top.sum(), corner.sum()) == (5, 5, 40)
    cell, around = (b - t) * (h - t), 2 * (b + h - 2 * t)
    outside = 50.0 * (2 * cell / around + t) / section.J
    assert outside == pytest.approx(50.0 / (2 * cell * t) * (1 + t * around / 2 / cell), rel=0.01)
    np.testing.assert_allclose(at(torque, web), np.tile([0, -outside, 0], (5, 1)), atol=1e-6 * outside)
    np.testing.assert_allclose(at(torque, top), np.tile([0, 0, outside], (5, 1)), atol=1e-6 * outside)
    S = b * t * (h - t) / 2 + t * (h / 2 - t) ** 2
    np.testing.assert_allclose(at(across, web)[:, 1], 300.0 * S / (section.Iz * 2 * t), rtol=1e-6)
    np.testing.assert_allclose(at(torque + across, corner)[:, 1:], 0.0, atol=1e-6 * outside)


BOX_SOLID = """
SetFactory("OpenCASCADE");
Point(1) = {0, -0.06, -0.04}; Point(5) = {0, -0.052, -0.032};
Point(2) = {0, 0.06, -0.04}; Point(6) = {0, 0.052, -0.032};
Point(3) = {0, 0.06, 0.04}; Point(7) = {0, 0.052, 0.032};
Point(4) = {0, -0.06, 0.04}; Point(8) = {0, -0.052, 0.032};
For k In {1:4}
  Line(k) = {k, k % 4 + 1}; Line(4 + k) = {4 + k, 4 + k % 4 + 1}; Line(8 + k) = {k, 4 + k};
EndFor
For k In {1:4}
  Curve Loop(k) = {k, 9 + k % 4, -(4 + k), -(8 + k)}; Plane Surface(k) = {k};
EndFor
Transfinite Curve{1:8} = 5; Transfinite Curve{9:12} = 2;
Transfinite Surface{1:4}; Recombine Surface{1:4};
Extrude {0.6, 0, 0} { Surface{1:4}; Layers{12}; Recombine; }
Physical Volume("beam") = {1:4};
Physical Surface("root") = {1:4};
Physical Surface("tip") = Surface In BoundingBox{0.599, -1, -1, 0.601, 1, 1};
"""


@pytest.mark.slow
def test_a_box_is_as_stiff_and_as_stressed_as_the_solid(tmp_path):
    """Every load at the tip; its rigid ends make the solid stiffer by 1 %, and by 5 % with its corners in torsion."""
    (tmp_path / "beam.geo").write_text(BOX_SOLID)
    solid = fp.reduce(
        fp.from_mesh(fp.read_mesh(tmp_path / "beam.geo"), STEEL, regions("root", "tip")),
        fp.Request(name="solid", reference=FixedTo("root"), reduction=CraigBampton(0), stress=True, linear=True),
    )
    beam = reduced(straight(box(0.08, 0.12, 0.008), 0.6, 2))
    assert solid.mass == pytest.approx(beam.mass, rel=1e-9)
    for k, load in enumerate(np.eye(6)):
        moves, stress = [], []
        for body in (solid, beam):
            tip, q = body.interface("tip"), static(body, "tip", load)
            moves.append((np.vstack([tip.phi_t, tip.phi_r]) @ q)[k])
            stress.append(middles_of_walls(body, q))
        assert moves[0] == pytest.approx(moves[1], rel=0.06 if k == 3 else 0.02)
        assert moves[0] < moves[1]
        largest = np.abs(beam.surface.stress @ static(beam, "tip", load)).max()
        np.testing.assert_allclose(stress[0], stress[1], atol=0.02 * largest)


def middles_of_walls(body, q):
    """(4, 6) the stress halfway along, in the middle of the outside of the walls."""
    wanted = np.array([(0.3, 0, 0.04), (0.3, 0, -0.04), (0.3, 0.06, 0), (0.3, -0.06, 0)])
    distance = np.linalg.norm(body.surface.points - wanted[:, None], axis=2)
    assert distance.min(axis=1).max() < 1e-9
    return (body.surface.stress @ q)[distance.argmin(axis=1)]


def test_shear_in_a_thick_tube_balances_its_force():
    """What the web of a cut at the diameter carries, in the mean over its two walls, is Q S / (I b)."""
    R, r = 0.03, 0.02
    section = tube(2 * R, R - r)
    [shear], [ring] = section.shear, section.outline
    at_side = shear[int(np.argmax([z for _, z in ring]))]
    S = 2 / 3 * (R**3 - r**3)
    assert at_side[0] == pytest.approx((S / (section.Iz * 2 * (R - r)), 0.0), abs=1e-9)


def test_a_section_of_another_outline_does_not_know_its_shear():
    assert replace(circle(0.05), outline=()).shear == ()


def test_a_section_by_its_constants_tells_that_its_shear_is_not_known():
    rail = general("rail", A=1e-3, Iy=1e-7, Iz=2e-7, J=5e-8)
    body = reduced(straight(rail, LENGTH, 1))
    assert any("section 'rail'" in w and "shear" in w for w in body.provenance["warnings"])
    assert not any("shear" in w for w in reduced(straight(circle(0.05), LENGTH, 1)).provenance["warnings"])
    unstressed = fp.reduce(
        fp.from_frame(straight(rail, LENGTH, 1), regions("root", "tip")),
        fp.Request(name="frame", reference=FixedTo("root"), reduction=CraigBampton(0)),
    )
    assert not any("shear" in w for w in unstressed.provenance["warnings"])


def test_a_load_along_the_beam_acts_through_the_nodes_as_stated():
    """First mode of a cantilever: the moment at a node is off by p l^2 / 12, in the middle of elements by p l^2 / 24.

    Exact mode: Young & Felgar (1949), w = cosh - cos - sigma (sinh - sin); its load per length is p = rho A omega^2 w.
    """
    k, section = 1.8751040687119611 / LENGTH, with_mass_moments(shear_rigid(rectangle(0.02, 0.03)), 1e-11, 1e-11)
    sigma = (np.cosh(k * LENGTH) + np.cos(k * LENGTH)) / (np.sinh(k * LENGTH) + np.sin(k * LENGTH))

    def mode(x, sign):
        return np.cosh(k * x) + sign * np.cos(k * x) - sigma * (np.sinh(k * x) + sign * np.sin(k * x))

    scale = STEEL.E * section.Iy * k**2 / np.sqrt(STEEL.rho * section.A * LENGTH)
    for elements in (8, 32):
        body = reduced(straight(section, LENGTH, elements), ("root",), modes=4, reduction=Eigenmodes)
        beams, l = body.surface.beams, LENGTH / elements  # noqa: E741
        x = beams.positions[elements // 2, :, 0]
        moment = np.linalg.norm(beams.modes[elements // 2, :, 4:, 0], axis=1) / scale
        off = (moment - mode(x, 1)) / ((k * l) ** 2 * mode(x, -1))
        assert off[0] == pytest.approx(-1 / 12, rel=1.5 / elements)
        assert off[1] == pytest.approx(1 / 24, rel=0.02)


def test_forces_between_the_ends_are_linear():
    modes = np.random.default_rng(0).normal(size=(2, 3, 6, 4))
    at = section_forces_at(modes, np.array([0.0, 0.25, 1.0]))
    np.testing.assert_allclose(at[:, 0], modes[:, 0])
    np.testing.assert_allclose(at[:, 1], 0.75 * modes[:, 0] + 0.25 * modes[:, 2])
    np.testing.assert_allclose(at[:, 2], modes[:, 2])


def test_the_body_file_keeps_the_section_forces(tmp_path):
    body = reduced(space_frame(), ("a", "b"), modes=2)
    again = load_body(save_body(body, tmp_path / "frame.ffr"))
    for key in ("positions", "axes", "modes"):
        assert getattr(again.surface.beams, key).tobytes() == getattr(body.surface.beams, key).tobytes()
    assert again.surface.stress.tobytes() == body.surface.stress.tobytes()
    assert "section forces" in again.provenance["stress"]
    np.testing.assert_array_equal(truncated(body, [1]).surface.beams.modes, body.surface.beams.modes[..., [1]])
    with pytest.raises(BodyError, match="the section forces have 1 modes, the surface"):
        replace(body.surface, beams=truncated(body, [1]).surface.beams)
