"""Second-order bodies computed in their mean-axis form: the same motion for all reference conditions, states there and back,
results in the frames that bodies have of their own."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_turned_stiffening import CHORD, FIXED, MEAN

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.consistency.assemble import assemble, flattened
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.kernels.tables import Record
from ffr_dyn.results.quantities import catalogue
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.stress import tensors
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.mean_axis import in_mean_axis_frames
from ffr_dyn.variants.variant import vary
from ffr_prep.body import FlexibleBody, mean_axis_form, with_point
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

CONDITIONS = (FIXED, FixedTo("right"), CHORD, MEAN)


@cache
def rod(conditions, modes: int = 4) -> FlexibleBody:
    """A soft straight beam along x."""
    member = Member(rectangle(0.02, 0.03), Material("soft", 7e9, 0.3, 2700.0), (0, 1.0, 0))
    frame = named(polyline([(0, 0, 0), (1.2, 0, 0)], member, elements=8), left=(0, 0, 0), right=(1.2, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [fp.InterfaceRegion("left"), fp.InterfaceRegion("right")]),
        fp.Request(name="rod", reference=conditions, reduction=fp.CraigBampton(modes), stress=True),
    )


def pendulum(body: FlexibleBody, plane: str = "auto", **state) -> Scene:
    hinge = fd.Joint("hinge", "revolute" if plane == "auto" else "spherical", "ground.O", "rod.left")
    return Scene(
        (Body("rod", body, **state),),
        (hinge,),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 1.0 * (plane == "none")),
        plane=plane,
    )


def bent(conditions, seed: int = 0) -> Body:
    """The rod in a pose, moving and bent by some centimetres: the same for all conditions to second order only."""
    body, rng = rod(conditions), np.random.default_rng(seed)
    size = 0.02 / np.sqrt(body.omega2) * np.sqrt(body.omega2[0])
    return Body(
        "rod",
        body,
        position=rng.normal(size=3),
        rotation=rng.normal(size=3),
        velocity=rng.normal(size=3),
        omega_bar=rng.normal(size=3),
        q=size * rng.normal(size=body.n),
        q_dot=10 * size * rng.normal(size=body.n),
    )


def free(body: Body) -> Scene:
    return Scene((body,), plane="none")


# ---- the law --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("plane", ["auto", "none"])
def test_the_motion_does_not_depend_on_the_reference_conditions(plane):
    names = ("rod.right.position", "rod.right.orientation", "rod.left.velocity", "hinge.force", "energy.kinetic")
    runs = [
        fd.forward(
            pendulum(rod(c), plane),
            end=0.2,
            output_step=0.02,
            method=fd.ROS2(2e-4),
            outputs=("default", "*.orientation"),
        )
        for c in CONDITIONS
    ]
    for name in names:
        expected = runs[0][name]
        assert np.abs(expected).max() > 1e-3 or name == "rod.left.velocity"
        for run in runs[1:]:
            np.testing.assert_allclose(run[name], expected, rtol=0, atol=1e-10 * max(1.0, np.abs(expected).max()))


def test_bodies_move_as_rigid_ones_where_they_are_stiff():
    """A million times the stiffness: the origin of every frame is where that of a rigid body is."""
    for conditions in CONDITIONS:
        body = rod(conditions)
        hard = replace(body, omega2=1e6 * body.omega2, stiffening=body.stiffening)
        turned = [
            fd.forward(pendulum(model), end=0.2, output_step=0.1, method=fd.ROS2(1e-3))
            for model in (hard, fp.truncated(hard, 0))
        ]
        for name in ("rod.R", "rod.p", "rod.v"):
            np.testing.assert_allclose(turned[0][name], turned[1][name], atol=1e-7)


# ---- there and back -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("conditions", CONDITIONS, ids=str)
def test_a_state_comes_back_as_it_was_declared(conditions):
    body = bent(conditions)
    result = fd.assembly(free(body), outputs=("rod.*",))
    for name, value in (
        ("R", body.position),
        ("p", body.rotation),
        ("v", body.velocity),
        ("omega_bar", body.omega_bar),
        ("q", body.q),
        ("q_dot", body.q_dot),
    ):
        np.testing.assert_allclose(result[f"rod.{name}"][0], value, rtol=0, atol=1e-12 * np.abs(value).max())


@pytest.mark.parametrize("conditions", CONDITIONS, ids=str)
def test_a_scene_at_a_result_has_its_markers_where_it_had_them(conditions):
    scene = free(bent(conditions))
    run = fd.forward(scene, end=0.02, output_step=0.01, method=fd.ROS2(1e-4))
    again = fd.assembly(fd.scene_at(scene, run))
    for name in ("rod.right.position", "rod.right.velocity", "rod.R", "rod.q", "rod.q_dot"):
        expected = run[name][-1]
        np.testing.assert_allclose(again[name][0], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_a_frame_fixed_to_an_interface_is_its_marker():
    run = fd.forward(pendulum(rod(FIXED)), end=0.1, output_step=0.02, method=fd.ROS2(2e-4), outputs=("rod.*",))
    np.testing.assert_allclose(run["rod.R"], run["rod.left.position"], atol=1e-14)
    np.testing.assert_allclose(run["rod.v"], run["rod.left.velocity"], atol=1e-12)
    np.testing.assert_allclose(run["rod.p"], run["rod.left.orientation"], atol=1e-14)
    np.testing.assert_allclose(run["rod.a"], run["rod.left.acceleration"], atol=1e-9)
    assert np.abs(run["rod.left.displacement"]).max() < 1e-14


def test_a_chord_stays_between_its_ends():
    run = fd.forward(pendulum(rod(CHORD)), end=0.1, output_step=0.02, method=fd.ROS2(2e-4), outputs=("rod.*",))
    np.testing.assert_allclose(run["rod.left.displacement"], 0.0, atol=1e-12)
    across = np.abs(run["rod.right.displacement"][:, 1:]).max()
    assert across < 1e-3 * np.abs(run["rod.q"]).max()


@pytest.mark.parametrize("conditions", CONDITIONS, ids=str)
def test_rates_are_the_derivatives_of_positions(conditions):
    """Along a course that is made up, smooth in time: by differences of order six."""
    system = assemble(free(bent(conditions))).system
    time = 1e-3 * np.arange(-3.0, 4.0)
    view = View(system, made_up(system, time))
    names = [f"rod.{of}" for of in ("R", "p", "v", "omega_bar", "a", "alpha_bar", "q", "q_dot", "q_ddot")]
    names += [f"rod.right.{of}" for of in ("acceleration", "angular_velocity", "orientation", "displacement")]
    found = {name: catalogue(system)[name].compute(view, None)[0] for name in names}
    for value, rate in (("R", "v"), ("v", "a"), ("omega_bar", "alpha_bar"), ("q", "q_dot"), ("q_dot", "q_ddot")):
        expected = found[f"rod.{rate}"][3]
        np.testing.assert_allclose(slope(found[f"rod.{value}"]), expected, atol=1e-8 * max(1, np.abs(expected).max()))
    spin = angular(found["rod.p"], own=True)
    np.testing.assert_allclose(spin, found["rod.omega_bar"][3], atol=1e-8)
    np.testing.assert_allclose(
        angular(found["rod.right.orientation"], own=False), found["rod.right.angular_velocity"][3], atol=1e-8
    )


def slope(values: np.ndarray) -> np.ndarray:
    """The derivative in the middle of seven rows a millisecond apart."""
    return np.array([-1, 9, -45, 0, 45, -9, 1]) @ values / (60 * 1e-3)


def angular(p: np.ndarray, own: bool) -> np.ndarray:
    """Angular velocity from Euler parameters (7, 4), in own or in global axes."""
    rate, here = slope(rotation_matrix(p).reshape(7, 9)).reshape(3, 3), rotation_matrix(p[3])
    turning = here.T @ rate if own else rate @ here.T
    return np.array([turning[2, 1], turning[0, 2], turning[1, 0]])


def made_up(system, time: np.ndarray) -> Record:
    """Rows of a course of the recorded coordinates of one body that is smooth in time."""
    rng, n = np.random.default_rng(3), system.layout.n[0]
    a, b, c = rng.normal(size=(3, 3 + n)) * np.concatenate([np.ones(3), 0.02 * np.ones(n)])
    course = a + np.outer(time, b) + np.outer(time**2, c) / 2
    rates, growth = b + np.outer(time, c), np.broadcast_to(c, course.shape)
    u = np.array([0.3, -0.5, 0.8])
    angle = 0.7 + 2 * time + 3 * time**2
    u = u / np.linalg.norm(u)
    p = np.concatenate([np.cos(angle / 2)[:, None], np.sin(angle / 2)[:, None] * u], axis=1)
    omega, alpha = np.outer(2 + 6 * time, u), np.broadcast_to(6 * u, (time.size, 3))
    x = np.concatenate([course[:, :3], p, course[:, 3:]], axis=1)
    v = np.concatenate([rates[:, :3], omega, rates[:, 3:]], axis=1)
    vd = np.concatenate([growth[:, :3], alpha, growth[:, 3:]], axis=1)
    empty = np.zeros((time.size, 2, 3))
    return Record(time, x, v, vd, empty, empty, *(np.zeros((time.size, 0)) for _ in range(len(Record._fields) - 6)))


# ---- what else a scene has ------------------------------------------------------------------------------------------


def test_the_form_is_taken_once():
    scene = in_mean_axis_frames(pendulum(rod(FIXED)))
    assert in_mean_axis_frames(scene) is scene
    assert sorted(scene.bodies[0].model.omega2) == sorted(mean_axis_form(rod(FIXED)).body.omega2)
    twice = in_mean_axis_frames(Scene((Body("one", rod(FIXED)), Body("two", rod(FIXED)))))
    assert twice.bodies[0].model is twice.bodies[1].model


def test_linear_bodies_stay_as_they_are():
    for body in (Body("rod", rod(FIXED), stiffening=False), Body("rod", replace(rod(FIXED), stiffening=None))):
        scene = free(body)
        assert in_mean_axis_frames(scene) is scene


def test_fewer_modes_keep_their_own_frame():
    whole = in_mean_axis_frames(free(bent(FIXED)))
    small = vary(whole, modes=5).bodies[0]
    assert small.frame.C.shape == (rod(FIXED).n, 5)
    assert small.frame.marker.K.shape == (6, 5, 5)
    result = fd.assembly(free(small), outputs=("rod.q",))
    np.testing.assert_allclose(result["rod.q"][0], small.frame.C @ small.q)


def test_python_forces_see_bodies_in_their_own_frames():
    body = bent(CHORD)
    assembled = assemble(free(body))
    view = StateView(assembled.system.scene, assembled.system.layout, assembled.x, assembled.v)
    np.testing.assert_allclose(view.q("rod"), body.q, rtol=1e-12)
    np.testing.assert_allclose(view.q_dot("rod"), body.q_dot, rtol=1e-12)
    np.testing.assert_allclose(view.omega_bar("rod"), body.omega_bar, rtol=1e-12)
    np.testing.assert_allclose(rotation_matrix(view.rotation("rod")), rotation_matrix(body.rotation), atol=1e-14)


def test_a_force_on_elastic_coordinates_does_the_same_work():
    body = rod(FIXED)
    force = fd.ModalForce("push", "rod", np.eye(body.n)[1])
    run = fd.forward(
        replace(pendulum(body), forces=(force,)),
        end=0.05,
        output_step=1e-3,
        method=fd.ROS2(2e-4),
        outputs=("push.power", "rod.q_dot"),
    )
    np.testing.assert_allclose(run["push.power"], run["rod.q_dot"][:, 1], atol=1e-12)


def test_stress_is_that_of_the_same_deformation():
    for conditions in CONDITIONS:
        body, form = rod(conditions), mean_axis_form(rod(conditions))
        q = np.random.default_rng(2).normal(size=(1, body.n))
        expected = tensors(body.surface, q @ form.C.T)
        np.testing.assert_allclose(tensors(form.body.surface, q), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_results_hold_the_surface_of_the_own_frame():
    for run in (fd.assembly(pendulum(rod(FIXED))), fd.static(pendulum(rod(FIXED)))):
        assert run.geometry["rod"] is rod(FIXED).surface


def test_a_run_goes_on_from_a_file_bit_by_bit(tmp_path):
    scene, how = pendulum(rod(FIXED)), {"output_step": 0.02, "method": fd.ROS2(2e-4)}
    whole = fd.forward(scene, end=0.08, **how)
    fd.forward(scene, end=0.04, path=tmp_path / "run.nc", **how)
    rest = fd.forward(scene, end=0.08, resume=tmp_path / "run.nc", **how)
    for name in ("rod.R", "rod.p", "rod.q", "rod.right.displacement"):
        np.testing.assert_array_equal(rest[name], whole[name])


def test_planar_scenes_are_those_in_space():
    (flat, _), (whole, _) = (flattened(pendulum(rod(FIXED), plane), 0.0) for plane in ("auto", "none"))
    assert flat.plane == "z"
    assert flat.bodies[0].model.n < whole.bodies[0].model.n


def test_points_without_second_order_are_told():
    model = with_point(rod(FIXED), "middle", (0.6, 0.0, 0.0))
    model = replace(model, stiffening=np.concatenate([rod(FIXED).stiffening, np.zeros((6, model.n, model.n))]))
    load = fd.Load("pull", "rod.middle", force=(0, 1.0, 0))
    with pytest.raises(fp.InputError, match="second-order displacement of its point 'middle'"):
        assemble(replace(pendulum(model), loads=(load,)))
    assemble(pendulum(model))


def test_damping_ratios_are_of_the_mean_axis_modes_by_frequency():
    """Whatever the conditions are, and in whatever order the coordinates are computed."""
    tips = []
    for conditions in CONDITIONS:
        body = rod(conditions)
        damped = pendulum(body, damping=np.linspace(0.01, 0.3, body.n))
        (converted,) = in_mean_axis_frames(damped).bodies
        assert not np.all(np.diff(converted.model.omega2) > 0)
        order = np.argsort(converted.model.omega2)
        np.testing.assert_array_equal(converted.damping[order], damped.bodies[0].damping)
        tips.append(fd.forward(damped, end=0.05, output_step=0.05, method=fd.ROS3(1e-3))["rod.right.position"])
    for tip in tips[1:]:
        np.testing.assert_allclose(tip, tips[0], rtol=0, atol=1e-9)
