"""Mobility and kinematics: closed forms of the four-bar and the slider-crank, and mechanisms that cannot be driven so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud
from test_dyn_forces import PAIRS, SPREAD, loaded

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.mobility import mobility, undeformed
from ffr_dyn.functions.time_functions import polynomial, table
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces import Load, ModalForce
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError

G = (0.0, -9.81, 0.0)


def bar(name: str, length: float, mass: float = 1.0):
    ends = {"a": np.zeros(3), "b": np.array([length, 0, 0])}
    J = mass * length**2 / 12
    return rigid_body(name, mass=mass, inertia=(0.01 * J, J, J), centre_of_mass=(length / 2, 0, 0), points=ends)


def slider_crank(r: float, length: float, *drivers, offset: float = 0.3) -> Scene:
    """In the plane, without redundant rows; the crank starts at the angle `offset`."""
    slider = rigid_body("slider", mass=0.5, inertia=(1e-3, 1e-3, 1e-3), points={"c": (0, 0, 0)})
    pin = r * np.array([np.cos(offset), np.sin(offset), 0])
    lean = -np.arcsin(pin[1] / length)
    end = pin + length * np.array([np.cos(lean), np.sin(lean), 0])
    return Scene(
        (
            Body("crank", bar("crank", r), rotation=(0, 0, offset)),
            Body("rod", bar("rod", length), position=pin, rotation=(0, 0, lean)),
            Body("slider", slider, position=end),
        ),
        (
            Joint("main", "revolute", "ground.O", "crank.a"),
            Joint("pin", "spherical", "crank.b", "rod.a"),
            Joint("wrist", "universal", "slider.c", "rod.b", axis=(0, 0, 1), axis_j=(0, 1, 0)),
            Joint("guide", "translational", "ground.O", "slider.c", axis=(1, 0, 0)),
        ),
        drivers,
        ground={"O": (0, 0, 0)},
        gravity=G,
    )


MOTOR = Driver("motor", "main", polynomial(0.3, 4.0, 1.5))


def test_slider_crank_in_closed_form():
    r, length = 0.2, 0.7
    result = kinematic(slider_crank(r, length, MOTOR), end=2.0, output_step=0.05)
    t = result.time
    angle, rate = 0.3 + 4 * t + 1.5 * t**2, 4 + 3 * t
    root = np.sqrt(length**2 - (r * np.sin(angle)) ** 2)
    x = r * np.cos(angle) + root
    slope = -r * np.sin(angle) - r**2 * np.sin(angle) * np.cos(angle) / root
    np.testing.assert_allclose(result["slider.c.position"][:, 0], x, atol=1e-10)
    np.testing.assert_allclose(result["slider.c.velocity"][:, 0], slope * rate, atol=1e-9)
    np.testing.assert_allclose(result["main.angle"], angle, atol=1e-9)
    assert result["constraint.position"].max() < 1e-10


@pytest.mark.slow
def test_efforts_do_the_work_that_becomes_energy():
    result = kinematic(slider_crank(0.2, 0.7, MOTOR), end=1.0, output_step=0.001)
    work = np.concatenate([[0], np.cumsum(0.5e-3 * (result["motor.power"][1:] + result["motor.power"][:-1]))])
    energy = result["energy.total"] - result["energy.total"][0]
    assert np.abs(energy).max() > 1
    np.testing.assert_allclose(work, energy, atol=2e-5 * np.abs(energy).max())


def test_kinematics_agree_with_a_driven_forward_run():
    scene = slider_crank(0.2, 0.7, MOTOR)
    one = kinematic(scene, end=0.5, output_step=0.1)
    other = integrate(scene, end=0.5, output_step=0.1, method=RK4(1e-3))
    for name in ("rod.R", "rod.v", "motor.force", "wrist.force", "guide.moment"):
        np.testing.assert_allclose(one[name], other[name], atol=1e-6, rtol=1e-6)


def test_mobility_in_words():
    free = mobility(slider_crank(0.2, 0.7))
    assert free.degrees_of_freedom == 1
    assert [m.name for m in free.free] == ["main.angle"]
    assert free.free[0].bodies == ("crank", "rod", "slider")
    assert any("main.angle" in line for line in free.lines())
    driven = mobility(slider_crank(0.2, 0.7, MOTOR))
    assert (driven.degrees_of_freedom, driven.free, driven.overdriven) == (0, (), ())


def hinged_slider_crank() -> Scene:
    """With a flexible rod between revolute joints, which three rows bend that rigid bodies would have twice."""
    line = fp.polyline(
        [(0, 0, 0), (0.7, 0, 0)], fp.Member(fp.rectangle(0.02, 0.01), fp.material("steel"), (0, 1, 0)), elements=4
    )
    ends = [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")]
    request = fp.Request(name="rod", reference=fp.SimplySupported("a", "b"), reduction=fp.CraigBampton(2), linear=True)
    rod = fp.reduce(fp.from_frame(fp.named(line, a=(0, 0, 0), b=(0.7, 0, 0)), ends), request)
    scene = replace(slider_crank(0.2, 0.7), gravity=(0, 0, 0))
    hinges = (Joint("pin", "revolute", "crank.b", "rod.a"), Joint("wrist", "revolute", "slider.c", "rod.b"))
    drawn = scene.bodies[1]
    bodies = (scene.bodies[0], Body("rod", rod, position=drawn.position, rotation=drawn.rotation), scene.bodies[2])
    return replace(scene, bodies=bodies, joints=(scene.joints[0], *hinges, scene.joints[3]))


@pytest.mark.parametrize("off", [0.0, 1e-9])
def test_bodies_close_by_rigid_motion_as_far_as_that_goes(off):
    """A rod that is drawn 6 mm beside its plane is shifted there. A pin that is a nanometre off, as by the rounding of a
    mesh, cannot be closed by rigid motion alone: then the bodies deform by as little, and not by the millimetres."""
    scene = hinged_slider_crank()
    crank, rod, slider = scene.bodies
    points = {"a": (0, 0, 0), "b": (0.2, 0, off)}
    arm = rigid_body("crank", mass=1.0, inertia=(1e-3, 1e-3, 1e-3), centre_of_mass=(0.1, 0, 0), points=points)
    scene = replace(
        scene,
        bodies=(
            Body("crank", arm, rotation=crank.rotation),
            replace(rod, position=np.add(rod.position, (0, 0, 0.006))),
            slider,
        ),
        plane="none",
    )
    found = assemble(scene)
    place = found.system.layout
    assert abs(found.x[place.R(1)][2]) < 1e-8
    assert np.abs(found.x[place.q(1)]).max() < 1e-8


def test_a_flexible_rod_takes_nothing_from_the_freedom_of_the_crank():
    """Its hinges bend it in three ways across the plane; the crank turns all the same, and nothing holds it at rest."""
    scene = hinged_slider_crank()
    rod = scene.bodies[1].model
    free, driven = mobility(scene), mobility(replace(scene, drivers=(MOTOR,)))
    assert (free.rigid, free.degrees_of_freedom, free.elastic) == (1, rod.n - 2, rod.n)
    assert free.lines()[0].startswith("1 rigid degree of freedom; ")
    assert free.lines()[0].endswith("which joints and drivers deform in 3 ways")
    assert (driven.rigid, driven.degrees_of_freedom) == (0, rod.n - 3)
    with pytest.raises(InputError, match=r"nothing holds the motion .* \(1 rigid degree of freedom"):
        static(scene)


def test_forces_that_read_elastic_coordinates_read_zeros_of_undeformed_bodies():
    """In the plane and in space: a rod that a driver turns carries a force of 2 N + 3 N/(m sqrt(kg)) q[1] across its tip."""
    scene = hinged_slider_crank()
    rod = scene.bodies[1]
    read = Load("read", "rod.b", function=lambda t, state: [0, 2 + 3 * state.q("rod")[0], state.q_dot("rod")[0]])
    plain = Load("plain", "rod.b", force=(0, 2.0, 0))
    for plane in ("auto", "none"):
        efforts = [
            kinematic(replace(scene, drivers=(MOTOR,), loads=(load,), plane=plane), end=0.2, output_step=0.1)
            for load in (read, plain)
        ]
        np.testing.assert_allclose(efforts[0]["motor.effort"], efforts[1]["motor.effort"], rtol=1e-13)
        assert efforts[0]["rod.q"].shape == (3, rod.model.n)
        assert not efforts[0]["rod.q"].any()


def test_mobility_of_a_free_flexible_body():
    free = mobility(Scene((Body("b", cloud(3)),)))
    assert (free.degrees_of_freedom, free.elastic, len(free.free)) == (9, 3, 6)
    assert {m.name for m in free.free} >= {"b turn x", "b shift z"}


MODAL = ModalForce("s", "one", [1.0, 2.0, 3.0, 4.0])


@pytest.mark.parametrize("force", [*PAIRS.values(), *SPREAD.values(), MODAL], ids=[*PAIRS, *SPREAD, "modal"])
def test_forces_of_all_kinds_leave_the_freedom_of_undeformed_bodies_as_it_is(force):
    """A ball and a bore: three and two. Forces on elastic coordinates do nothing to bodies that have none."""
    rigid = undeformed(loaded(force))
    assert assemble(rigid, time=0.0).degrees_of_freedom == 5


def test_flexible_bodies_are_undeformed():
    body = cloud(4)
    scene = Scene(
        (Body("b", body),),
        (Joint("A", "revolute", "ground.O", "b.a"),),
        (Driver("d", "A", polynomial(0, 1.0)),),
        ground={"O": (0, 0, 0)},
    )
    result = kinematic(scene, end=1.0, output_step=0.5)
    assert "taken as undeformed: b" in result.attributes["notes"]
    lever = result["b.b.position"] - result["b.a.position"]
    rest = body.interface("b").position - body.interface("a").position
    np.testing.assert_allclose(np.linalg.norm(lever, axis=1), np.linalg.norm(rest), rtol=1e-12)


# ---- what cannot be ---------------------------------------------------------------------------------------------------


def test_a_mechanism_driven_twice_is_refused():
    """Consistent at the start, but each driver fixes all motion alone."""
    scene = slider_crank(0.2, 0.7, MOTOR, Driver("second", "guide", polynomial(0.0), coordinate="stroke"))
    with pytest.raises(InputError, match=r"over-driven.*motor.*second"):
        kinematic(scene, end=1.0, output_step=0.1)


def test_a_free_motion_is_named():
    with pytest.raises(InputError, match=r"needs every rigid motion.*main\.angle"):
        kinematic(slider_crank(0.2, 0.7), end=1.0, output_step=0.1)


def test_a_driver_that_the_loop_cannot_follow_at_the_start():
    scene = slider_crank(0.2, 0.7, Driver("push", "guide", polynomial(2.0), coordinate="stroke"))
    with pytest.raises(InputError, match="cannot be assembled"):
        kinematic(scene, end=1.0, output_step=0.1)


def test_lock_up_at_the_dead_point():
    """The slider is pushed towards and beyond its outer dead point r + l = 0.9 at t = 0.0143 s/0.1 m/s."""
    start = 0.2 * np.cos(0.3) + np.sqrt(0.49 - (0.2 * np.sin(0.3)) ** 2)
    scene = slider_crank(0.2, 0.7, Driver("push", "guide", polynomial(start, 0.1), coordinate="stroke"))
    with pytest.raises(ComputationError, match=r"at t = (0\.1\d*) s the mechanism locks: (main|pin|wrist)") as caught:
        kinematic(scene, end=1.0, output_step=0.05)
    assert f"{(0.9 - start) / 0.1:.3f}" in str(caught.value)


def test_a_singular_position_on_the_way_is_told():
    """Slider-crank with r = l: at 90 degrees the slider stands over the bearing, and the rod could stay there."""
    scene = slider_crank(0.5, 0.5, Driver("motor", "main", polynomial(1.0, 1.0)), offset=1.0)
    result = kinematic(scene, end=1.0, output_step=0.1)
    assert any("singular" in note and "0.57" in note for note in result.attributes["notes"])
    np.testing.assert_allclose(result["slider.c.position"][:, 0], np.cos(1 + result.time), atol=1e-9)


def test_driven_point():
    """Two links whose end is led along a circle: two prescribed components fix both angles."""
    links = (
        Body("one", bar("one", 1.0), rotation=(0, 0, 0.5)),
        Body("two", bar("two", 0.8), position=(np.cos(0.5), np.sin(0.5), 0), rotation=(0, 0, -0.6)),
    )
    joints = (Joint("A", "revolute", "ground.O", "one.a"), Joint("B", "revolute", "one.b", "two.a"))
    path = PointDriver(
        "path",
        "ground.O",
        "two.b",
        x=lambda t: (1.2 + 0.2 * np.cos(t), -0.2 * np.sin(t), -0.2 * np.cos(t)),
        y=polynomial(0.1),
    )
    scene = Scene(links, joints, (path,), ground={"O": (0, 0, 0)}, gravity=G)
    result = kinematic(scene, end=3.0, output_step=0.25)
    np.testing.assert_allclose(result["two.b.position"][:, 0], 1.2 + 0.2 * np.cos(result.time), atol=1e-10)
    gap = replace(scene, drivers=(replace(path, y=None),))
    with pytest.raises(InputError, match="needs every rigid motion"):
        kinematic(gap, end=3.0, output_step=0.25)


def test_a_driver_that_starts_at_rest_does_turn_a_scene_that_lies_in_two_planes():
    """A rod along x lies in the x-y and in the x-z plane; its driver asks for a motion later only."""
    start = table(np.linspace(0, 1, 21), np.linspace(0, 1, 21) ** 4)
    rod = Scene(
        (Body("rod", bar("rod", 1.0)),),
        (Joint("A", "revolute", "ground.O", "rod.a"),),
        (Driver("motor", "A", start),),
        ground={"O": (0, 0, 0)},
    )
    for result in (
        kinematic(rod, end=1.0, output_step=0.5),
        integrate(rod, end=1.0, output_step=0.5, method=RK4(1e-2)),
    ):
        np.testing.assert_allclose(result["A.angle"], [0, 0.5**4, 1], atol=1e-6)


def test_rows_in_a_singular_position_are_limits_on_the_branch_of_the_motion():
    """Slider-crank with r = l exactly at 90 degrees: the rows do not determine the slider's velocity there."""
    speed = np.pi / 2 - 1.0
    scene = slider_crank(0.5, 0.5, Driver("motor", "main", polynomial(1.0, speed)), offset=1.0)
    result = kinematic(scene, end=2.0, output_step=0.25, outputs=("*",))
    turned = 1.0 + speed * result.time
    np.testing.assert_allclose(result["slider.R"][:, 0], np.cos(turned), atol=1e-10)
    np.testing.assert_allclose(result["slider.v"][:, 0], -speed * np.sin(turned), atol=1e-9)
    np.testing.assert_allclose(result["slider.a"][:, 0], -(speed**2) * np.cos(turned), atol=1e-9)
    effort = result["motor.effort"]  # odd about the middle, by symmetry
    np.testing.assert_allclose(effort + effort[::-1], 0.0, atol=1e-9)
