"""Linearised equations: closed forms, assembled eigenfrequencies, steady rotation, and agreement with a forward run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ffr_gallery.bodies import beam
from scipy.linalg import eigh
from test_analyses_kinematic import slider_crank
from test_analyses_static import flexible, hanging
from test_quasi_static import rotor

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.efforts import JointEffort, MarkerEffort, recorded, with_effort
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.linearise import Linearise, as_result, linearise
from ffr_dyn.analyses.rotating.response import response
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluate, evaluated_mass_matrix, evaluator, total_mass_matrix
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Bushing, JointSpring, Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError


def test_pendulum_up_and_down():
    rate = np.sqrt(9.81 / (4 / 3))
    down = linearise(hanging(-np.pi / 2))
    np.testing.assert_allclose(down.eigenvalues, [-1j * rate, 1j * rate], atol=1e-8)
    up = linearise(hanging(np.pi / 2))
    assert up.stability_margin == pytest.approx(rate, rel=1e-8)
    assert up.leading == ("A.angle", "A.angle")
    assert up.error < 1e-6


def test_oscillator_with_damper_and_its_state_space():
    """m = 2, k = 50, c = 4: eigenvalues -1 +- i sqrt(24); force on the mass gives x(s) = 1 / (2 s^2 + 4 s + 50)."""
    body = rigid_body("m", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = Scene(
        (Body("m", body, position=(1, 0, 0)),),
        (Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        springs=(SpringDamper("spring", "ground.O", "m.c", 50.0, 4.0, 1.0),),
        ground={"O": (0, 0, 0)},
    )
    found = linearise(
        scene, inputs=(JointEffort("push", "rail", "stroke"),), outputs=("m.R.x", "m.v.x", "spring.tension")
    )
    np.testing.assert_allclose(
        sorted(found.eigenvalues, key=lambda z: z.imag), [-1 - 1j * 24**0.5, -1 + 1j * 24**0.5], atol=1e-7
    )
    np.testing.assert_allclose(found.damping_ratios, 0.2, atol=1e-8)
    s = 2.0 + 3.0j
    transfer = found.C @ np.linalg.solve(s * np.eye(2) - found.A, found.B) + found.D
    expected = np.array([1, s, 50 + 4 * s]) / (2 * s**2 + 4 * s + 50)
    np.testing.assert_allclose(transfer[:, 0], expected, rtol=1e-7)


def test_free_vibration_has_the_assembled_eigenfrequencies():
    """Without gravity, K is diag(omega^2) on all elastic coordinates: compared on the free motions of the joints."""
    scene = replace(flexible(), springs=(), gravity=(0, 0, 0))
    scene = replace(scene, bodies=tuple(replace(body, damping=0.0) for body in scene.bodies))
    assembled = assemble(scene)
    place = assembled.system.layout
    K = np.zeros((place.v_size, place.v_size))
    for b, body in enumerate(scene.bodies):
        K[place.q_dot(b), place.q_dot(b)] = np.diag(body.model.omega2)
    M = total_mass_matrix(scene, place, assembled.x)
    jacobian = evaluate(evaluator(assembled.system), 0.0, assembled.x, assembled.v).jacobian
    null = np.linalg.svd(jacobian)[2][np.linalg.matrix_rank(jacobian) :].T
    expected = np.sqrt(np.abs(eigh(null.T @ K @ null, null.T @ M @ null, eigvals_only=True))) / 2 / np.pi
    found = np.sort(linearise(scene).frequencies)[::2]
    moving = expected > 1e-3
    assert moving.sum() == 9
    np.testing.assert_allclose(found[-9:], expected[moving], rtol=1e-7)
    assert found[:-9].max() < 1e-2


def test_a_damped_flexible_mechanism_decays():
    scene = flexible()
    found = linearise(scene_at(scene, static(scene)))
    assert found.stability_margin < 0
    doubts = [
        note for note in found.notes if "ratios in per cent" not in note
    ]  # of its damping, a half of the critical
    assert all("moving frame" in note for note in doubts)  # it is an equilibrium, of a body that bends by a seventh


def test_a_closed_loop_swings_as_its_energy_says():
    """A slider-crank hangs with its slide vertical: frequency from the curvature of the energy and the effective inertia."""
    base = slider_crank(0.2, 0.7)
    scene = replace(base, gravity=(9.81, 0, 0))
    found = linearise(scene_at(scene, static(scene)))
    near = lambda a: static(replace(scene, drivers=(Driver("motor", "main", polynomial(a)),)))  # noqa: E731
    h = 1e-3
    curvature = (near(h)["energy.total"][0] - 2 * near(0.0)["energy.total"][0] + near(-h)["energy.total"][0]) / h**2
    # at the dead point the slider is at rest, the rod turns by -r/l
    inertia = 0.2**2 / 3 + (0.2**2 * (1 / 2) ** 2 + (0.2 / 0.7) ** 2 * 0.7**2 / 12)
    np.testing.assert_allclose(np.abs(found.eigenvalues), np.sqrt(curvature / inertia), rtol=1e-5)


def test_steady_rotation_softens_the_vibration():
    """A bead on a spring in the groove of a turntable: sqrt(k/m - Omega^2), and no note, since the rotation is steady."""
    table = rigid_body("table", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0), "s": (0, -1, 0)})
    bead = rigid_body("bead", mass=0.5, inertia=(1e-3, 1e-3, 1e-3), points={"c": (0, 0, 0)})
    spin = 7.0
    turning = Scene(
        (Body("table", table, omega_bar=(0, 0, spin)), Body("bead", bead, omega_bar=(0, 0, spin))),
        (
            Joint("axle", "revolute", "ground.O", "table.c"),
            Joint("groove", "translational", "table.c", "bead.c", axis=(0, 1, 0)),
        ),
        (Driver("motor", "axle", polynomial(0.0, spin)),),
        springs=(SpringDamper("spring", "table.s", "bead.c", 200.0, 0.0, 1.0),),
        ground={"O": (0, 0, 0)},
    )
    found = linearise(turning)
    np.testing.assert_allclose(np.abs(found.eigenvalues), np.sqrt(200 / 0.5 - spin**2), rtol=1e-7)
    assert found.notes == ()


def test_a_small_forward_run_is_what_the_matrices_say():
    """Response of the flexible scene to a small moment on its hinge: from A, B and C by the matrix exponential."""
    from scipy.linalg import expm

    scene = flexible()
    start = scene_at(scene, static(scene))
    hinge = JointEffort("motor", "A")
    outputs = ("two.a.position.x", "A.force.y")
    found = linearise(start, inputs=(hinge,), outputs=outputs)
    size, end = 1e-3, 0.2
    whole = np.block([[found.A, found.B * size], [np.zeros((1, found.A.shape[0] + 1))]])
    final = (expm(whole * end) @ np.eye(whole.shape[0])[-1])[:-1]
    expected = found.C @ final + found.D[:, 0] * size
    times = np.linspace(0, end, 11)
    pushed = with_effort(start, hinge, times, np.full(11, size))
    run, rest = (integrate(s, end=end, output_step=end, method=RK4(5e-4)) for s in (pushed, start))
    np.testing.assert_allclose([run[n][-1] - rest[n][-1] for n in outputs], expected, rtol=2e-4)


def test_a_load_as_input_is_its_own_force():
    scene = hanging(-np.pi / 2, Load("wind", "rod.b", (3.0, 0, 0)))
    one = linearise(scene, inputs=("wind",)).B
    other = linearise(scene, inputs=(MarkerEffort("wind2", "rod.b", (1, 0, 0)),)).B
    np.testing.assert_allclose(one, 3 * other, rtol=1e-9)


def test_the_result_can_be_kept(tmp_path):
    found = linearise(hanging(-np.pi / 2), inputs=(JointEffort("motor", "A"),), outputs=("rod.b.position.x",))
    kept = load_result(save_result(as_result(hanging(-np.pi / 2), found), tmp_path / "l.nc"))
    np.testing.assert_array_equal(kept["A"][0], found.A)
    np.testing.assert_array_equal(kept["D"][0], found.D)
    assert len(Linearise().report(kept)) == 1


def test_any_quantity_may_be_an_output():
    """Accelerations, powers and measurements, which no result keeps unless told: about the hanging pendulum at an angle y,
    the tip accelerates by -(g/(4/3)) 2 y along x, and a force of 3 N along x has the power 3 (2 y_dot)."""
    scene = hanging(-np.pi / 2, Load("wind", "rod.b", (3.0, 0, 0)))
    scene = replace(scene, loads=(), measurements=(Measurement("far", "ground.O", "rod.b", "acceleration"),))
    found = linearise(scene, outputs=("rod.b.acceleration.x", "rod.b.position.x", "measured.far.x"))
    np.testing.assert_allclose(found.C[0], [-9.81 / (4 / 3) * found.C[1, 0], 0.0], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.C[2], found.C[0], atol=1e-12)
    blown = replace(hanging(0.0), gravity=(0, 0, 0), loads=(Load("wind", "rod.b", (0, 3.0, 0)),))
    power = linearise(blown, outputs=("wind.power", "rod.b.velocity.y"))
    np.testing.assert_allclose(power.C[0], 3 * power.C[1], rtol=1e-6, atol=1e-6)
    assert abs(power.C[0, 1]) > 1


def test_a_quantity_is_its_components():
    whole = linearise(hanging(0.0), outputs=("rod.b.position", "A.angle"))
    each = ("rod.b.position.x", "rod.b.position.y", "rod.b.position.z", "A.angle")
    assert whole.outputs == each
    np.testing.assert_array_equal(whole.C, linearise(hanging(0.0), outputs=each).C)


def test_a_state_in_motion_is_noted():
    assert "no equilibrium" in linearise(hanging(0.3)).notes[-1]


def test_bad_input():
    with pytest.raises(InputError, match="nothing is free"):
        linearise(slider_crank(0.2, 0.7, Driver("m", "main", polynomial(0.3))))
    with pytest.raises(InputError, match="no such load"):
        linearise(hanging(0.0), inputs=("wind",))
    with pytest.raises(InputError, match="adds up over time"):
        linearise(hanging(0.0, Load("wind", "rod.b", (3.0, 0, 0))), outputs=("wind.work",))
    with pytest.raises(InputError, match=r"rod\.b\.position"):
        linearise(hanging(0.0), outputs=("rod.b.positio.x",))
    with pytest.raises(InputError, match="no coordinate 'stroke'"):
        linearise(hanging(0.0), inputs=(JointEffort("f", "A", "stroke"),))
    with pytest.raises(InputError, match="three numbers"):
        MarkerEffort("f", "rod.b", (0, 0, 0))
    with pytest.raises(InputError, match="more than 5"):
        recorded(np.arange(3.0), np.arange(3.0))
    with pytest.raises(InputError, match="10 values has 9 rates"):
        recorded(np.arange(10.0), np.arange(10.0), rates=np.arange(9.0))


def test_the_mass_matrix_that_the_kernels_keep_is_the_readable_one():
    assembled = assemble(flexible())
    at = evaluator(assembled.system)
    evaluate(at, 0.0, assembled.x, assembled.v)
    readable = total_mass_matrix(flexible(), assembled.system.layout, assembled.x)
    np.testing.assert_allclose(evaluated_mass_matrix(at), readable, atol=1e-13)


def test_an_input_has_no_stiffness_of_its_own():
    """A force of one newton across a beam does nothing along it, and A is that without any input."""
    scene = rotor(0.0, stiffening=True)
    plain, fed = (linearise(scene, inputs=inputs) for inputs in ((), (MarkerEffort("push", "rod.b", (0, 1.0, 0)),)))
    np.testing.assert_array_equal(fed.A, plain.A)


@pytest.mark.parametrize("angle", [0.0, 3.0, np.pi - 1e-7, np.pi])
def test_an_angle_of_half_a_turn_is_an_output_like_others(angle):
    """Of a pendulum of 2 kg, 0.5 m below its hinge, whose joint is drawn at an angle."""
    bar = rigid_body("bar", mass=2.0, inertia=(0.1,) * 3, points={"h": (0, 0, 0)}, centre_of_mass=(0, -0.5, 0))
    c, s = np.cos(angle), np.sin(angle)
    hinge = Joint("hinge", "revolute", "ground.o", "bar.h", axis=np.eye(3), axis_j=[[c, -s, 0], [s, c, 0], [0, 0, 1]])
    scene = Scene([Body("bar", bar)], [hinge], ground={"o": (0, 0, 0)}, gravity=(0, -9.81, 0))
    f = np.array([0.1, 1.0])
    found = response(scene, input="hinge.moment", outputs=["hinge.angle"], frequencies=f)
    expected = 1 / (9.81 - 0.6 * (2 * np.pi * f) ** 2)
    np.testing.assert_allclose(found["transfer"][:, 0, 0], expected, rtol=1e-7)


def test_a_spring_that_is_not_stretched_but_by_rounding_is_an_equilibrium():
    bar = rigid_body("bar", mass=2.0, inertia=(0.1,) * 3, points={"h": (0, 0, 0)})
    hinge = Joint("hinge", "revolute", "ground.o", "bar.h")
    spring = JointSpring("spring", "hinge", stiffness=5e4, free=0.3)
    scene = Scene([Body("bar", bar, rotation=(0, 0, 0.3))], [hinge], forces=[spring], ground={"o": (0, 0, 0)})
    assert not linearise(scene).notes
    away = replace(scene, forces=[replace(spring, free=0.3 + 1e-6)])
    assert "no equilibrium" in linearise(away).notes[0]


@pytest.mark.parametrize(("stiffness", "damping"), [(1e6, 1e2), (1e15, 0.0), (1e6, 1e9)])
def test_a_slow_pendulum_beside_what_is_fast(stiffness, damping):
    """A load of a crane on 30 m, 0.57 rad/s, beside a small part on a mount. Before, it was told to be free beside a mount of
    1e7 rad/s, or a damper that brakes in 1e-8 s."""
    load = rigid_body("load", mass=1000.0, inertia=(1e3,) * 3, points={"top": (0, 30, 0)})
    part = rigid_body("part", mass=0.1, inertia=(0.1,) * 3, points={"c": (0, 0, 0)})
    scene = Scene(
        [Body("load", load, position=(0, -30, 0)), Body("part", part)],
        [Joint("hook", "universal", "ground.O", "load.top", axis=(1, 0, 0), axis_j=(0, 0, 1))],
        forces=[Bushing("mount", "ground.O", "part.c", [stiffness] * 6, [damping] * 6)],
        ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0),
    )  # fmt: skip
    found = linearise(scene)
    assert found.free == 0
    rate = np.sqrt(1000 * 9.81 * 30 / (1e3 + 1000 * 30**2))
    slow = found.eigenvalues[np.abs(np.abs(found.eigenvalues) / rate - 1) < 1e-5]
    assert len(slow) == 4
    assert np.abs(slow.real).max() < 1e-5


@pytest.mark.parametrize("ratio", [1.0, 2.5, 20.0])
def test_an_overdamped_mode_has_one_name_for_both_of_its_decays(ratio):
    """Of a free beam: w (ratio -+ root(ratio^2 - 1)) of each bending. Before, they were counted as modes of their own."""
    found = linearise(Scene([Body("rod", beam("rod", 1.0, 2.0, 50.0, 3), damping=ratio)]))
    undamped = linearise(Scene([Body("rod", beam("rod", 1.0, 2.0, 50.0, 3))]))
    w = np.abs(undamped.eigenvalues[undamped.free :])[::2]
    for name, rate in zip(("first", "second", "third"), w, strict=True):
        own = [k for k, leading in enumerate(found.leading) if leading == f"rod: {name} bending, y"]
        expected = -rate * (ratio + np.sqrt(ratio**2 - 1) * np.array([-1, 1]))
        np.testing.assert_allclose(found.eigenvalues[own], expected, rtol=1e-5)


def test_a_shaft_that_turns_freely_is_named_by_its_joint():
    """The strain of its turning is rounding, whatever share of the rounding of its energy that is."""
    at = {"l": (0, 0, 0), "r": (0.5, 0, 0)}
    line = fp.polyline([at["l"], at["r"]], fp.Member(fp.circle(0.02), fp.material("steel")), elements=6)
    model = fp.from_frame(fp.named(line, **at), [fp.InterfaceRegion(k) for k in at])
    shaft = fp.reduce(model, fp.Request(name="shaft", reference=fp.MeanAxis(), reduction=fp.CraigBampton(4)))
    disc = fd.rigid_body("disc", mass=20.0, inertia=(0.5, 0.3, 0.3), points={"c": (0, 0, 0)})
    joints = [
        fd.Joint("fit", "fixed", "shaft.r", "disc.c"),
        fd.Joint("a", "revolute", "ground.l", "shaft.l", axis=(1, 0, 0)),
        fd.Joint("b", "cylindrical", "ground.r", "disc.c", axis=(1, 0, 0)),
    ]
    found = fd.linearise(
        fd.Scene([fd.Body("shaft", shaft), fd.Body("disc", disc, position=at["r"])], joints, ground=at)
    )
    assert found.free == 2
    assert found.leading[0] in ("a.angle", "b.angle")
