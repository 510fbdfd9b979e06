"""The cheapest model of a scene: estimates against closed forms and full runs, the search, its report, bad input."""

from __future__ import annotations

import re
import tomllib
from contextlib import nullcontext
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from click.testing import CliRunner
from ffr_gallery.scene_set import (
    ALUMINIUM,
    GRAVITY,
    bar,
    beam,
    block,
    cantilever,
    case,
    chain,
    distance,
    four_bar,
    pendulum,
    placed,
    slider_crank,
    speeding_up,
    spin_up,
)

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.run import run
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.cli import cli
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.economy.adaptive import Adaptation, adaptive_forward
from ffr_dyn.economy.advice import advice, tells_apart
from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.contributions import of_motion, of_omitted, of_shapes, own
from ffr_dyn.economy.cost import of_run, per_evaluation
from ffr_dyn.economy.inertia_terms import TermEffect, _inertial, without_minor
from ffr_dyn.economy.model_choice import Part, applied, full, kind, orthonormal, rigid
from ffr_dyn.economy.outputs import Output, as_output, check_meaning, difference, largest, largest_stress, probe
from ffr_dyn.economy.picture import diagram
from ffr_dyn.economy.policy import Policy
from ffr_dyn.economy.report import as_html, as_markdown, as_text, write_report
from ffr_dyn.economy.residual_estimate import oscillators, samples
from ffr_dyn.economy.rigid_start import least, started
from ffr_dyn.economy.run import Span, make, states
from ffr_dyn.economy.search import economise
from ffr_dyn.economy.steps import _from_two_rows, _of_both, chosen_step, error_of
from ffr_dyn.economy.verification import _better, _known
from ffr_dyn.functions.formula import formula, parse
from ffr_dyn.functions.time_functions import TimeFunction
from ffr_dyn.functions.together import alone
from ffr_dyn.integrators import ROS2, ROS3
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import JointFriction, JointSpring, JointStop, Load, Servo
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement, StressMeasurement
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.state_formula import StateFormula
from ffr_dyn.scene_file.write import save_scene
from ffr_dyn.variants.mean_axis import in_new_frames, with_mean_axis_bodies
from ffr_dyn.variants.variant import STIFFENING, stiffening_by
from ffr_prep.body import mean_axis_form
from ffr_prep.cli import cli as ffr_prep_command
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.structures.sections import rectangle

SLOW = case("slider-crank-10")
TIP = ("rod.b.position.x", "rod.b.position.y")


# ---- oscillators ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("omega", [3.0, 400.0])
def test_an_oscillator_follows_a_force_that_is_linear_between_samples_exactly(omega):
    """Closed form of an undamped oscillator under f = a + b t from rest."""
    time, a, b = np.linspace(0, 2, 17), 2.0, -1.5
    q, rate = oscillators(time, (a + b * time)[:, None], np.array([omega**2]), np.array([0.0]))
    expected = (a * (1 - np.cos(omega * time)) + b * (time - np.sin(omega * time) / omega)) / omega**2
    np.testing.assert_allclose(q[:, 0], expected, atol=1e-10 / omega)
    speed = (a * omega * np.sin(omega * time) + b * (1 - np.cos(omega * time))) / omega**2
    np.testing.assert_allclose(rate[:, 0], speed, atol=1e-9)


def test_a_damped_oscillator_decays_from_where_it_starts():
    """q = exp(-d t / 2) (cos w t + d / 2 w sin w t) of q(0) = 1, at rest; unequal samples."""
    time, omega, d = np.array([0, 0.1, 0.3, 0.35, 1.0]), 7.0, 0.8
    q, _ = oscillators(time, np.zeros((5, 1)), np.array([omega**2]), np.array([d]), np.array([1.0]), np.array([0.0]))
    w = np.sqrt(omega**2 - d**2 / 4)
    np.testing.assert_allclose(
        q[:, 0], np.exp(-d * time / 2) * (np.cos(w * time) + d / (2 * w) * np.sin(w * time)), rtol=1e-10
    )


# ---- estimates ------------------------------------------------------------------------------------------------------


def looked_at(scene: Scene, outputs, end: float, step: float, *, divisions: int = 2):
    """Ledger, and choice of everything."""
    scene = with_mean_axis_bodies(scene)
    of = probe(assemble(scene), [Output(name, 1e-3) for name in outputs])
    return Ledger(scene, Span(0, end, step), of, lambda stage: None), full(scene, "ros3", divisions)


def test_a_complete_model_leaves_no_residual_and_a_rigid_one_leaves_it_in_the_modes():
    ledger, everything = looked_at(pendulum(7e9), TIP, 0.2, 0.01)
    whole, stiff = ledger.run(everything), ledger.run(rigid(everything))
    same = own(ledger, whole)
    size = np.abs(same.M @ np.ones(20)).max()
    assert np.abs(same.residual).max() < 1e-8 * size
    few, many = stiff.made.assembled, whole.made.assembled
    seen = samples(few, many, (np.zeros((14, 0)),), stiff.result.time, *states(stiff))
    assert np.abs(seen.residual[:, :6]).max() < 1e-8 * size
    assert np.abs(seen.residual[:, 6:]).max() > 0.01


@pytest.mark.parametrize(
    "reference", [SimplySupported("a", "b"), FixedTo("a"), MeanAxis()], ids=["simple", "fixed", "mean"]
)
def test_the_estimate_of_a_rigid_pendulum_is_right_whatever_its_frame(reference):
    """What rigid motion leaves out: estimated by driving the modes one-way, true by running them."""
    rod = beam("rod", 1.2, rectangle(0.2, 0.009), replace(ALUMINIUM, E=7e9, rho=5540.0), 4, reference)
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a")
    scene = Scene((Body("rod", rod),), (hinge,), ground={"O": rod.interface("a").position}, gravity=GRAVITY)
    ledger, everything = looked_at(scene, TIP, 0.6, 0.01)
    pilot, stiff = ledger.run(everything), ledger.run(rigid(everything))
    true = largest(difference(stiff.values, pilot.values))
    estimated = of_omitted(ledger, stiff, everything, 0.1 * true).effect.sum(axis=0)
    assert (estimated > 0.5 * true).all()
    assert (estimated < 2.5 * true).all()


@pytest.mark.slow
def test_modes_have_a_rank_and_principal_shapes_need_fewer():
    """A rod that speeds up: bending first; two shapes hold what takes more modes."""
    scene = slider_crank(150.0)
    ledger, everything = looked_at(scene, ("rod.stress",), 0.03, 0.001)
    pilot = ledger.run(everything)
    modes, shapes = (of(ledger, pilot, np.array([1e3]), own(ledger, pilot)) for of in (of_motion, of_shapes))
    lowest = int(np.argmin(scene.bodies[1].model.frequencies))
    leading = int(np.argmax(modes.effect[:, 0]))
    assert (modes.body[leading], modes.mode[leading]) == (1, lowest)
    rest = [np.sort(one.effect[:, 0])[::-1][2:].sum() for one in (modes, shapes)]
    assert rest[1] < 0.5 * rest[0]


def test_a_body_in_all_its_shapes_moves_as_before():
    scene = pendulum(7e9)
    ledger, everything = looked_at(scene, TIP, 0.2, 0.01)
    V = orthonormal(np.random.default_rng(1).normal(size=(14, 14)), scene.bodies[0].model.omega2)
    turned = replace(everything, parts=(Part(tuple(range(14)), (), tuple(tuple(c) for c in V.T.tolist())),))
    one, other = (ledger.run(choice) for choice in (everything, turned))
    assert largest(difference(one.values, other.values)).max() < 1e-9


def test_the_error_of_a_step_comes_with_its_sign():
    ledger, everything = looked_at(pendulum(7e9), TIP, 0.4, 0.02)
    coarse, fine, finest = (ledger.run(replace(rigid(everything), divisions=d)) for d in (2, 4, 32))
    true = difference(fine.values, finest.values)
    for estimated, wanted in zip(error_of(fine, coarse), true, strict=True):
        assert np.abs(estimated - wanted).max() < 0.3 * np.abs(wanted).max()


def test_no_order_is_taken_for_granted_where_steps_jump_over_an_impact():
    """An arm with a weight that falls on a stop: by third order a coarse step would be told a seventh of its error."""
    arm = Body("arm", bar("arm", 0.4, rectangle(0.02, 0.006), ALUMINIUM), damping=0.02)
    weight = Body("weight", block("weight", 0.05, 0.02), position=(0.4, 0, 0))
    joints = Joint("hinge", "revolute", "ground.O", "arm.a"), Joint("grip", "fixed", "arm.b", "weight.pin")
    forces = (
        JointFriction("rub", "hinge", coulomb=0.02, creep=0.05),
        JointStop("stop", "hinge", lower=-0.6, upper=2.0, stiffness=400.0, damping=1.5, entry=0.01),
        JointSpring("spring", "hinge", stiffness=0.3),
    )
    scene = Scene((arm, weight), joints, forces=forces, ground={"O": (0, 0, 0)}, gravity=GRAVITY)
    outputs = ("stop.torque", "arm.b.position")
    found = economise(scene, outputs, end=0.5, output_step=0.005, tolerance=5e-2, verify=False)
    true = forward(scene, end=0.5, output_step=0.005, method=ROS3(1e-4), check=False)
    small = run(found.scene, found.settings)
    off = [np.abs(small[name] - true[name]).max() for name in outputs]
    assert (off <= found.limits).all()


def test_the_least_run_takes_shorter_steps_until_it_comes_to_an_end():
    def fails_below_eight(choice):
        if choice.divisions < 8:
            raise ComputationError("too long a step")
        return choice

    everything = full(pendulum(7e9), "ros3", 1)
    assert least(fails_below_eight, everything, 1).divisions == 8
    with pytest.raises(ComputationError, match="no step down to"):
        least(lambda choice: fails_below_eight(replace(choice, divisions=1)), everything, 1)


def test_cost_grows_with_what_is_modelled():
    scene = slider_crank(50.0)
    everything = full(scene, "ros2", 1)
    flat = replace(everything, plane="z")
    plain = replace(everything, parts=tuple(replace(part, dropped=(STIFFENING,)) for part in everything.parts))
    assert (
        per_evaluation(rigid(flat))
        < per_evaluation(rigid(everything))
        < per_evaluation(plain)
        < per_evaluation(everything)
    )
    once, thrice, more = (of_run(replace(everything, divisions=d), 10) for d in (1, 3, 5))
    assert thrice - once == pytest.approx(more - thrice)  # in the number of steps; rows cost something too


def test_a_servo_at_its_limit_does_not_hide_what_bodies_do_to_it():
    """Its torque is the same in all states in which modes are largest, and another where it is not at its limit."""
    scene = replace(pendulum(7e9), gravity=(0, 0, 0))
    servo = Servo("servo", "hinge", target=0.6, kp=100.0, kd=10.0, limit=20.0)
    scene = replace(scene, forces=(servo,))
    ledger, everything = looked_at(scene, ("servo.torque",), 1.2, 0.02, divisions=4)
    pilot, stiff = ledger.run(everything), ledger.run(rigid(everything))
    true = largest(difference(stiff.values, pilot.values))
    assert of_omitted(ledger, stiff, everything, 0.02 * true).effect.sum(axis=0) > true
    quick = replace(servo, kp=1000.0, kd=100.0, limit=10.0)  # at its limit in all states that are looked at
    found = economise(replace(scene, forces=(quick,)), ["servo.torque=10%"], end=1.2, output_step=0.02, verify=False)
    assert any(part.modes for part in found.choice.parts)
    assert not found.unmoved


# ---- terms ----------------------------------------------------------------------------------------------------------


def seen_with(kept: tuple[str, ...], dropped: tuple[str, ...]):
    """A run without the terms of `dropped`, seen by the model without those of `kept`."""
    ledger, everything = looked_at(slider_crank(50.0), ("rod.stress",), 0.042, 0.0021)
    few, many = (
        replace(everything, parts=tuple(replace(part, dropped=terms) for part in everything.parts))
        for terms in (dropped, kept)
    )
    trial = ledger.run(few)
    same = tuple(np.eye(len(part.modes)) for part in everything.parts)
    return samples(trial.made.assembled, ledger.made(many).assembled, same, trial.result.time, *states(trial))


@pytest.mark.parametrize("term", ["I5", "I8", "I9"])
def test_the_force_of_an_inertia_term_is_the_residual_without_it(term):
    seen = seen_with((STIFFENING,), (STIFFENING, term))
    force = sum(force for _, name, _, force in _inertial(seen) if name == term)
    size = np.abs(seen.residual).max()
    assert size > 1e-6
    np.testing.assert_allclose(force, seen.residual, atol=1e-5 * size)


def test_the_forces_of_all_stiffening_loads_are_the_residual_without_stiffening():
    seen = seen_with((), (STIFFENING,))
    size = np.abs(seen.residual).max()
    assert size > 1e-6
    np.testing.assert_allclose(seen.stiffening.sum(axis=2), seen.residual, atol=2e-3 * size)


def test_terms_go_until_their_share_is_used_up_and_loads_one_by_one():
    everything = full(slider_crank(50.0), "ros3", 1)
    sizes = {("I5", None): 0.5, ("I8", None): 3.0, (STIFFENING, 0): 0.2, (STIFFENING, 8): 5.0, (STIFFENING, 12): 0.1}
    effects = tuple(TermEffect(1, term, load, np.array([size])) for (term, load), size in sizes.items())
    crank, rod, _ = without_minor(everything, effects, np.array([1.0])).parts
    assert (rod.dropped, rod.loads) == (("I5",), (8,))
    assert crank == everything.parts[0]
    assert without_minor(everything, effects, np.array([10.0])).parts[1].dropped == ("I5", "I8", STIFFENING)
    assert without_minor(rigid(everything), effects, np.array([10.0])) == rigid(everything)


def test_a_body_is_stiffened_by_the_loads_that_are_kept():
    body = slider_crank(50.0).bodies[1]
    fewer = stiffening_by(body, (8,)).model.stiffening
    np.testing.assert_array_equal(fewer[8], body.model.stiffening[8])
    assert np.count_nonzero(np.abs(fewer).max(axis=(1, 2))) == 1
    with pytest.raises(InputError, match="it has the loads 0 to 23"):
        stiffening_by(body, (24,))


# ---- steps ----------------------------------------------------------------------------------------------------------


def test_steps_over_two_rows_tell_the_error_of_one_row():
    ledger, everything = looked_at(pendulum(7e9), TIP, 0.4, 0.02)
    stiff = rigid(replace(everything, divisions=1))
    coarse, finest = ledger.run(stiff), ledger.run(replace(stiff, divisions=16))
    estimated, true = largest(_from_two_rows(ledger, coarse)), largest(difference(coarse.values, finest.values))
    assert (np.abs(estimated / true - 1) < 0.5).all()
    short, _ = looked_at(pendulum(7e9), TIP, 0.1, 0.02)
    assert short.over_two_rows(stiff) is None


def test_the_step_found_is_fine_enough_and_not_twice_too_fine():
    ledger, everything = looked_at(pendulum(7e9), TIP, 0.4, 0.02)
    stiff = rigid(replace(everything, divisions=1))
    limit = 1e-9 * np.ptp(ledger.run(stiff).values[0]) * np.ones(2)
    found = chosen_step(ledger, stiff, limit)
    truth = ledger.run(replace(stiff, method="rk4", divisions=64)).values
    assert (largest(difference(found.trial.values, truth)) <= limit).all()
    assert found.trial.choice.divisions > 1
    coarser = replace(found.trial.choice, divisions=found.trial.choice.divisions // 2)
    assert (largest(difference(ledger.run(coarser).values, truth)) > limit).any()


# ---- outputs --------------------------------------------------------------------------------------------------------


def test_outputs_are_written_with_their_own_tolerances():
    assert as_output("rod.tip", 1e-3) == Output("rod.tip", 1e-3)
    assert as_output("rod.stress = 2e6", 1e-3) == Output("rod.stress", 2e6, absolute=True)
    assert as_output("rod.stress=0.5%", 1e-3) == Output("rod.stress", 0.005)
    with pytest.raises(InputError, match="write NAME"):
        as_output("rod.stress=little", 1e-3)


def test_stress_is_the_largest_of_the_surface():
    scene = slider_crank(50.0)
    rod = scene.bodies[1].model
    q = np.zeros((2, rod.n))
    q[1, 0] = 1e-3
    stress = np.abs(rod.surface.stress[:, 0, 0] * 1e-3).max()
    np.testing.assert_allclose(largest_stress(scene, "rod", q), [0.0, stress], rtol=0.05)


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        ((), "name at least one output"),
        (("rod.tipp.position.x",), "did you mean"),
        (("rood.stress",), "there is no body 'rood'"),
        (("slider.stress",), "has no stress modes"),
        (("slider.pin.position.x", "slider.pin.position.x"), "more than once"),
        (("slider.pin.position.z",), "does not change over the run"),
        (("slider.pin.position.x=-1",), "it must be positive"),
        (("slider.pin.position.x=1e-10%",), "below the accuracy of any run"),
    ],
)
def test_outputs_that_say_nothing_are_refused(outputs, said):
    with pytest.raises(InputError, match=said):
        economise(SLOW.scene(), outputs, end=0.14, output_step=0.014)


def swung(*loads: Load, stiffening: bool = True) -> Scene:
    """A rod whose frame is at its hinge, with a weight at its end."""
    rod = Body("rod", cantilever("rod", 0.5, rectangle(0.02, 0.004), ALUMINIUM), damping=0.01, stiffening=stiffening)
    weight = Body("weight", block("weight", 0.1, 0.02), position=(0.5, 0, 0))
    hinge, clamp = Joint("hinge", "revolute", "ground.O", "rod.a"), Joint("clamp", "fixed", "rod.b", "weight.pin")
    tip = Measurement("tip", "ground.O", "rod.b", axes="rod")
    return Scene(
        (rod, weight), (hinge, clamp), loads=loads, ground={"O": (0, 0, 0)}, measurements=(tip,), gravity=GRAVITY
    )


def checked(scene: Scene, *outputs: str) -> None:
    made, moved = in_new_frames(scene)
    check_meaning(probe(assemble(made), [as_output(name, 1e-2) for name in outputs]), made, moved)


@pytest.mark.parametrize("output", ["displacement.y", "omega_bar.z", "R", "force_i.x", "tip.x"])
def test_outputs_seen_from_a_frame_that_the_model_does_not_have_are_refused(output):
    """A body with load matrices has that of its mean motion there, a linear one its own."""
    before = {"displacement.y": "rod.b", "force_i.x": "clamp", "tip.x": "measured"}.get(output, "rod")
    with pytest.raises(InputError, match="is seen from the frame of body 'rod'"):
        checked(swung(), f"{before}.{output}")
    checked(swung(stiffening=False), f"{before}.{output}")
    checked(swung(), "rod.b.position", "rod.stress", "clamp.force", "weight.R")


@pytest.mark.parametrize("stiffening", [True, False])
@pytest.mark.parametrize("output", ["rod.q", "rod.q_dot"])
def test_elastic_coordinates_are_no_outputs(output, stiffening):
    with pytest.raises(InputError, match="elastic coordinates are those of a model"):
        checked(swung(stiffening=stiffening), output)


@pytest.mark.parametrize(
    ("name", "stiffening", "refused"),
    [
        ("rod.q.1", False, True),
        ("rod.omega_bar.z", True, True),
        ("rod.omega_bar.z", False, False),
        ("weight.omega_bar.z", True, False),
        ("rod.b.velocity.y", True, False),
    ],
)
def test_forces_that_read_what_a_smaller_model_does_not_have_are_refused(name, stiffening, refused):
    read = parse("0 * " + name.replace(".q.1", ".q[1]"), {}, "")
    push = Load("push", "rod.b", function=StateFormula((read, read, read)))
    with pytest.raises(InputError, match=f"'push' depends on '{name}'") if refused else nullcontext():
        checked(swung(push, stiffening=stiffening), "rod.b.position")


def test_the_frames_that_are_new_are_told_and_rigid_bodies_lose_no_power():
    found = economise(swung(), ["rod.b.position.x", "rod.damping.power=1e3"], end=0.1, output_step=0.01, verify=False)
    assert any("the frame of 'rod' is that of its mean motion" in note for note in found.notes) is bool(
        found.choice.count
    )
    assert np.isfinite(found.error).all()


# ---- the search -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def slow():
    return economise(
        SLOW.scene(), SLOW.outputs, end=SLOW.end, output_step=SLOW.output_step, tolerance=1e-3, verify=True
    )


def test_a_slow_stiff_mechanism_is_rigid_throughout(slow):
    assert all(part.count == 0 for part in slow.choice.parts)
    assert slow.choice.plane == "z"
    assert (slow.verification.error < slow.limits).all()
    assert 0.3 < float(slow.error[0] / slow.verification.first[0]) < 5
    assert slow.cost < slow.before / 3
    assert [kind(slow.original, slow.choice, b, SLOW.output_step) for b in range(3)] == ["rigid"] * 3


def test_the_same_scene_gives_the_same_model(slow):
    again = economise(
        SLOW.scene(), SLOW.outputs, end=SLOW.end, output_step=SLOW.output_step, tolerance=1e-3, verify=True
    )
    assert again.choice == slow.choice
    np.testing.assert_array_equal(again.error, slow.error)
    assert as_text(again) == as_text(slow)


def test_an_output_that_no_model_changes_is_told():
    found = economise(SLOW.scene(), ("bearing.angle",), end=0.28, output_step=0.014, verify=False)
    assert found.unmoved == ("bearing.angle",)
    assert "no model changes it" in as_text(found)


@pytest.fixture(scope="module")
def fast():
    scene = slider_crank(150.0)
    return economise(scene, ("slider.pin.position.x", "rod.stress=40%"), end=0.063, output_step=0.0007, tolerance=1e-2)


def test_a_model_is_told_even_where_what_its_modes_do_cannot_be(monkeypatch):
    def failing(*_):
        raise ComputationError("at t = 0.3 s the position is singular")

    monkeypatch.setattr("ffr_dyn.economy.search.of_motion", failing)
    found = economise(swung(), ["rod.b.position.x"], end=0.1, output_step=0.01, tolerance=1e-9, verify=False)
    assert any(part.modes for part in found.choice.parts)
    told = "what each mode of the chosen model does is not told: at t = 0.3 s the position is singular"
    assert told in found.notes
    as_text(found)


@pytest.fixture(scope="module")
def fine():
    """The same where stress matters finely: steps shorter than an output row, and many modes."""
    return economise(slider_crank(150.0), ("rod.stress",), end=0.063, output_step=0.0007, tolerance=1e-3, verify=True)


def test_a_coarse_tolerance_is_met_by_two_stages_at_once(fast):
    """The model is run with two stages only, beside everything with four, whose difference is the error."""
    assert (fast.choice.method, fast.choice.divisions) == ("ros2", 1)
    assert [one.what for one in fast.tried if one.choice.parts == fast.choice.parts] == [
        f"{sum(part.count for part in fast.choice.parts)} elastic coordinates, two stages",
        "chosen",
        "verified",
    ]
    np.testing.assert_allclose(fast.error, fast.tried[-2].error)
    assert "One run beside the full model" in as_text(fast)
    assert (fast.error / fast.verification.first > 0.3).all()


def test_a_fine_tolerance_takes_shorter_steps_and_one_look_at_everything_with_them(fine):
    assert fine.choice.divisions > 1
    assert (fine.verification.error <= fine.limits).all()
    assert 0.3 < float((fine.error / fine.verification.first)[0]) < 5


def test_rigid_bodies_are_scouted_with_steps_over_two_rows_where_rows_are_even():
    for end, wide in ((0.28, True), (0.266, False)):
        ledger, _ = looked_at(SLOW.scene(), SLOW.outputs, end, 0.014)
        stiff = started(ledger, assemble(ledger.scene).system.scene)
        assert (len(ledger.wide), len(ledger.runs)) == ((1, 0) if wide else (0, 1))
        assert stiff.trial.result.time.size == (11 if wide else 20)
        assert stiff.everything.plane == "z"


@pytest.mark.parametrize("damping", [0.01, 0.0])
def test_the_error_of_a_reference_is_not_below_the_true_one(damping):
    """Where methods damp a vibration that they do not resolve, and where a step resolves all."""
    scene = replace(pendulum(7e10), bodies=tuple(replace(body, damping=damping) for body in pendulum(7e10).bodies))
    ledger, everything = looked_at(scene, ("hinge.force", "rod.b.position.y"), 0.16, 0.008)
    finest = ledger.run(replace(everything, method="rk4", divisions=512))
    for method, divisions in (("ros3", 4), ("ros3", 16), ("rk4", 128)):
        known = _known(ledger, replace(everything, method=method, divisions=divisions))
        true = largest(difference(known.trial.values, finest.values))
        assert (known.own > 0.5 * true).all(), (method, divisions, known.own / true)


def test_where_something_rings_two_stages_and_four_must_agree_better():
    """A difference that is taken for the error of two stages in a damped scene is taken for that of four in a ringing one."""
    for damping, method in ((0.01, "ros2"), (0.0, "ros3")):
        scene = slider_crank(50.0)
        scene = replace(scene, bodies=tuple(replace(body, damping=damping) for body in scene.bodies))
        ledger, everything = looked_at(scene, ("rod.stress",), 0.042, 0.0021, divisions=1)
        two, four = (ledger.run(replace(everything, method=name)) for name in ("ros2", "ros3"))
        limit = largest(difference(two.values, four.values)) / 0.8
        assert _of_both(two, four, limit).trial.choice.method == method
        assert _of_both(two, four, limit / 2) is None


def test_a_fast_slender_rod_keeps_bending_and_drops_stretching(fast):
    """Where stress matters coarsely: bending, and no stretching, which makes about a twentieth of it."""
    rod = fast.original.bodies[1].model
    V = fast.choice.parts[1].basis(rod.n)
    stretching = np.abs(rod.interface("b").phi_t[0]) > 1e-3 * np.abs(rod.interface("b").phi_t).max()
    assert V.shape[1] >= 1
    assert np.abs(V[~stretching]).max() > 0.9
    assert np.abs(V[stretching]).max() < 0.1
    assert fast.choice.parts[0].count == 0
    assert (fast.verification.error <= fast.limits).all()


def test_stiffening_is_kept_above_the_critical_spin():
    """The beam's first frequency is 3.8 rad/s; a third of the published run suffices to need it."""
    found = economise(spin_up(6.0), ("measured.tip.y",), end=12.0, output_step=0.1, tolerance=1e-2)
    blade = found.choice.parts[1]
    assert blade.count > 0
    assert blade.stiffened
    assert (found.verification.error <= found.limits).all()
    assert {one.body for one in found.stiffening} == {"blade"}


@pytest.mark.parametrize("verify", [True, False], ids=["verified", "estimated"])
def test_runs_at_the_same_time_find_the_same_model(verify):
    how = {"end": 0.4, "output_step": 0.02, "tolerance": 1e-3, "verify": verify}
    beside = economise(pendulum(7e9), TIP, **how)
    with alone():
        after = economise(pendulum(7e9), TIP, **how)
    assert as_text(beside) == as_text(after)
    assert beside.search_cost == after.search_cost
    assert [one.choice for one in beside.runs] == [one.choice for one in after.runs]
    np.testing.assert_array_equal(beside.error, after.error)


def test_a_model_is_refined_where_verification_finds_it_wrong():
    """Estimates that promise too much are found out: with all modes declared without effect the search would stay rigid."""
    blind = replace(Policy(), surely_rigid=1e9)
    found = economise(pendulum(7e9), TIP, end=0.4, output_step=0.02, tolerance=1e-3, verify=True, policy=blind)
    assert found.verification.attempts > 0
    assert (found.verification.first > found.limits).any()
    assert (found.verification.error <= found.limits).all()


def test_a_refined_model_takes_a_finer_step_too_where_what_is_left_out_does_not_explain_its_error():
    ledger, everything = looked_at(pendulum(7e9), TIP, 0.4, 0.02)
    final, coarse = ledger.run(rigid(everything)), ledger.run(everything)
    gap = largest(difference(final.values, coarse.values))
    limits = 0.8 * gap
    omitted = of_omitted(ledger, final, everything, limits)
    for unexplained, divisions in ((0.1, 2), (0.5, 4)):
        better = _better(ledger, limits, final, coarse, omitted, (1, gap + unexplained * limits))
        assert better.choice.divisions == divisions
        assert better.choice.parts[0].count > 0


def test_what_no_reference_tells_is_estimated_and_not_verified():
    """A verification that is allowed next to no time."""
    found = economise(
        pendulum(7e10),
        ("hinge.force",),
        end=0.4,
        output_step=0.008,
        tolerance=1e-2,
        verify=True,
        policy=replace(Policy(), asked_verification=1.0),
    )
    assert not found.verification.is_known
    text = as_text(found)
    assert "Estimated, not verified" in text or "NOT within" in text
    assert "Verified" not in text


def own_five_bar() -> Scene:
    """Two driven cranks and two thin undamped bars between them."""
    A, B, C, D, E = ((0.0, 0.0), (0.0, 0.12), (0.17, 0.39), (0.34, 0.11), (0.3, 0.0))
    ends = {"left": (A, B), "upper": (B, C), "far": (D, C), "right": (E, D)}
    bodies = tuple(
        replace(placed(name, bar(name, distance(*two), rectangle(0.02, 0.006), ALUMINIUM), *two), damping=0.0)
        for name, two in ends.items()
    )
    pins = {"A": ("ground.A", "left.a"), "B": ("left.b", "upper.a"), "C": ("upper.b", "far.b")}
    pins |= {"D": ("right.b", "far.a"), "E": ("ground.E", "right.a")}
    joints = tuple(Joint(name, "revolute", *two) for name, two in pins.items())
    motors = (Driver("motor", "A", speeding_up(12.0, 0.4)), Driver("second", "E", formula("0.3 * sin(9 * t) ** 2")))
    return Scene(bodies, joints, motors, ground={"A": (*A, 0), "E": (*E, 0)}, gravity=GRAVITY)


UNSEEN = {
    "forces of a pendulum that rings": (partial(pendulum, 7e10), 0.4, 0.008, ("hinge.force", "rod.b.position"), 1e-2),
    "reactions of a damped chain": (partial(chain, 3), 0.2, 0.005, ("joint0.force", "link2.b.position"), 1e-3),
    "driver effort": (partial(four_bar, 40.0), 0.1, 0.002, ("motor.moment", "coupler.stress"), 1e-3),
    "five-bar": (own_five_bar, 0.1, 0.004, ("motor.moment", "upper.b.position.x"), 1e-2),
    "stress of a piston rod": (partial(slider_crank, 100.0), 0.05, 0.001, ("rod.stress",), 1e-4),
}


@pytest.mark.parametrize("verify", [True, False], ids=["verified", "estimated"])
@pytest.mark.parametrize("name", UNSEEN)
def test_what_is_said_of_a_model_is_true(name, verify):
    """Against everything with four times the steps, or steps that resolve all vibrations, whichever is finer."""
    made, end, step, outputs, tolerance = UNSEEN[name]
    scene = with_mean_axis_bodies(made())
    found = economise(scene, outputs, end=end, output_step=step, tolerance=tolerance, verify=verify)
    ledger, span = Ledger(scene, Span(0.0, end, step), found.probe, lambda stage: None), found.choice.divisions
    everything = next(one.choice for one in found.tried if one.what == "full model")
    resolving = int(np.ceil(ledger.vibrations(everything).omega.max() * step / 0.3))
    steps = [("rk4", max(resolving, 4 * span))] if resolving < 1000 else [("ros3", max(4 * span, 256))]
    truth = ledger.run(replace(everything, method=steps[0][0], divisions=steps[0][1]))
    true = largest(difference(ledger.run(found.choice).values, truth.values))
    assert (true <= found.limits).all(), true / found.limits
    if verify:
        assert found.verification.is_known
        assert (true <= 1.05 * found.verification.error).all()
        assert "Verified" in as_text(found)


def test_stress_that_the_shapes_of_the_full_model_lack_is_told():
    """Of its own inertia: no reference tells that, since the full model lacks it too."""
    lacking = slider_crank(100.0)
    rod = next(body for body in lacking.bodies if body.name == "rod")
    for lacks, told in ((0.0, False), (5e3, True)):  # Pa s^2, under spin about z'
        kept = {"left_out": [0.0] * 8 + [lacks] + [0.0] * 3, "largest": [1e4] * 12}
        made = replace(rod, model=replace(rod.model, provenance={**rod.model.provenance, "steady_stress": kept}))
        bodies = tuple(made if one.name == "rod" else one for one in lacking.bodies)
        scene = replace(lacking, bodies=bodies, measurements=(StressMeasurement("notch", "rod", (0.1, 0, 0)),))
        found = economise(scene, ["rod.stress=1e4"], end=0.02, output_step=0.001, verify=False)
        assert any("leave out up to" in note for note in found.notes) is told
        assert ("leave out up to" in as_text(found)) is told
        assert found.choice.parts[1].count < rod.model.n  # what the chosen model lacks beside the full one is no note
        assert any("leave out stress of its own inertia" in note for note in found.notes) is told


# ---- report, advice, chart, command ---------------------------------------------------------------------------------


def assert_counted(text, models):
    """Modes in a report have the numbers of these bodies, as `ffr-prep info` counts them: from 1."""
    counted = re.findall(r"(\w+), mode (\d+) \((\S+) Hz\)", text)
    assert counted
    assert all(f"{models[body].frequencies[int(mode) - 1]:.4g}" == hertz for body, mode, hertz in counted)


def test_the_report_says_it_all(fast, tmp_path):
    text = as_text(fast)
    for part in (
        "CHOSEN MODEL",
        "OUTPUTS",
        "BODIES",
        "NEAREST TO MATTERING",
        "TERMS NEAREST",
        "MODELS TRIED",
        "MESH AND REDUCTION",
    ):
        assert part in text
    assert "slider.pin.position.x" in text
    assert "Verified" in text
    assert "those of the body in its mean axes (`ffr-prep convert --reference mean-axis`)" in text
    assert_counted(text, {b.name: mean_axis_form(b.model).body for b in slider_crank(150.0).bodies if b.model.n})
    own = as_text(replace(fast, new_frames=()))
    assert "as in `ffr-prep info`.\n" in own
    assert_counted(own, {b.name: b.model for b in fast.original.bodies})
    assert "| rod | flexible" in as_markdown(fast, "chart.png")
    page = as_html(fast, b"png")
    assert page.startswith("<!doctype html>")
    assert "http" not in page
    for suffix in (".txt", ".md", ".html"):
        assert write_report(fast, tmp_path / f"r{suffix}").stat().st_size > 1000
    with pytest.raises(InputError, match="written as"):
        write_report(fast, tmp_path / "r.pdf")


def test_omitted_modes_are_not_told_apart_where_each_would_do_more_than_all(fast):
    """As where joints hold bodies more than once: what is listed fits what is left out, or is not listed."""
    assert tells_apart(fast)
    assert "left out" in as_text(fast).partition("NEAREST TO MATTERING")[2].partition("TERMS NEAREST")[0]
    many = replace(fast, effects=replace(fast.effects, effect=1e4 * np.maximum(fast.effects.effect, fast.limits)))
    nearest = as_text(many).partition("NEAREST TO MATTERING")[2].partition("TERMS NEAREST")[0]
    assert "Omitted modes are not listed" in nearest
    assert "left out " not in nearest
    assert advice(many) == advice(replace(fast, effects=replace(fast.effects, effect=0.0 * fast.effects.effect)))


def test_advice_is_a_command_to_run(fast):
    lines = advice(made_by(fast, "reduce", "rod.msh"))
    assert lines[0].startswith("crank: rigid is enough")
    assert "ffr-prep reduce FILE --interface a --interface b --method craig-bampton --frequency" in lines[1]
    assert "--stress" in lines[1]


def test_advice_on_what_no_command_made_is_in_words(fast):
    """Of Python, of other programs, and with another frame since."""
    lines = advice(fast)
    assert "mass, inertia and interfaces do: reduce it again, where it was made, by guyan" in lines[0]
    assert re.search(
        r"reduce it again, where it was made, by craig-bampton with modes up to \d+ Hz.* and stress = true", lines[1]
    )


def test_advice_on_matrices_is_their_command(fast):
    line = advice(made_by(fast, "reduce-matrices", "rod.mtx", "--units", "mm-t-s", "--interface", "a=7"))[1]
    assert "ffr-prep reduce-matrices FILE --units mm-t-s --interface a=7 --method craig-bampton --frequency" in line
    assert "--stress" not in line


def made_by(found, *command):
    """What was found, of bodies that a command has made."""
    bodies = (
        replace(body, model=replace(body.model, provenance={"command": list(command)}))
        for body in found.original.bodies
    )
    return replace(found, original=replace(found.original, bodies=tuple(bodies)))


STRUCTURE = """
[nodes]
a = [0, 0, 0]
b = [0.2, 0, 0]
[members.bar]
section = {shape = "circle", d = 0.01}
material = "steel"
[[polylines]]
member = "bar"
elements = 4
corners = [[0, 0, 0], [0.2, 0, 0]]
[interfaces.a]
[interfaces.b]
"""


@pytest.mark.parametrize("number", [0, 1])
def test_advice_on_a_structure_changes_its_file(fast, number, tmp_path):
    """The body that is rigid, and the one that has modes and stress: the entries that are told work as they stand."""
    line = advice(made_by(fast, "reduce-structure", "rod.toml"))[number]
    entries = re.search(
        r"(reduction = .*) in its structure FILE, and (ffr-prep reduce-structure FILE -o .*\.ffr)", line
    )
    assert ("frequency" in entries[1], "stress = true" in entries[1]) == (number == 1, number == 1)
    (tmp_path / "bar.toml").write_text(re.sub(r", (\w+ = true)", r"\n\1", entries[1]) + STRUCTURE)
    words = [word.replace("FILE", str(tmp_path / "bar.toml")) for word in entries[2].split()[1:-1]]
    ffr_prep_command.main(args=[*words, str(tmp_path / "bar.ffr")], standalone_mode=False)
    assert (tmp_path / "bar.ffr").exists()


def test_advice_keeps_what_a_body_was_made_of(fast):
    own = ("--unit", "mm", "--interface", "big eye=bore", "--material", "steel")
    line = advice(made_by(fast, "reduce", "rod.geo", *own, "--size", "2", "--modes", "4"))[1]
    assert "reduce FILE --unit mm --interface 'big eye=bore' --material steel --method craig-bampton --freq" in line


def test_the_chart_is_a_diagram_of_all_runs_with_the_chosen_one(fast):
    """One star, on the chosen model; its points stand beside those of another diagram; the tolerance is drawn."""
    chart = diagram(fast)
    assert len(chart.points) == len(fast.runs)
    assert len({point.label for point in chart.points}) == len(chart.points)
    (star,) = [point for point in chart.points if point.label in chart.chosen]
    for k, output in enumerate(fast.probe.outputs):
        assert star.errors[output.name] == pytest.approx(fast.verification.error[k])
        assert star.errors[output.name] <= chart.limits[output.name]
    assert len(chart.with_points(chart.points[:1]).points) == len(chart.points) + 1


def test_nothing_cheaper_that_was_run_would_have_done(fine):
    costs = np.array([one.cost / fine.cost for one in fine.runs])
    errors = np.array([float((one.error / fine.limits).max()) for one in fine.runs])
    assert costs.size > 3
    assert not ((costs < 0.999) & (errors <= 1)).any()


def test_the_search_costs_a_few_runs_of_what_it_finds(slow, fast, fine):
    """Beyond one verification, by the cost model."""
    assert all(0 < found.search_cost < 3 * found.cost for found in (slow, fast))
    assert fine.search_cost < 4 * fine.cost


def test_a_body_that_does_nothing_to_the_outputs_itself_is_found_where_more_modes_do_not_help(fine):
    """The crank's bending changes how the rod is shaken, and nothing of the rod's stress by itself."""
    gaps = [float(one.error[0]) for one in fine.tried if one.what.endswith("elastic coordinates")]
    assert gaps[1] == pytest.approx(gaps[0], rel=0.1)
    assert gaps[2] < 0.1 * gaps[1]
    crank = fine.kept.body == 0
    assert crank.any()
    assert fine.kept.effect[crank].max() < 1e-6 * fine.limits[0]


@pytest.mark.slow
def test_the_command_writes_a_scene_that_runs(tmp_path):
    scene = slider_crank(50.0)
    settings = Settings(start=0.0, end=0.1, output_step=0.005, method=ROS2(0.0005), stabilisation=Projection())
    save_scene(scene, settings, tmp_path / "in.toml")
    arguments = ["economise", str(tmp_path / "in.toml"), "--output", "slider.pin.position.x", "--tolerance", "1e-4"]
    done = CliRunner().invoke(cli, [*arguments, "-o", str(tmp_path / "out.toml"), "--chart", str(tmp_path / "c.png")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out.html").exists()
    assert (tmp_path / "c.png").stat().st_size > 1000
    made, how = load_scene(tmp_path / "out.toml")
    assert sum(body.model.n for body in made.bodies) < 28
    result = integrate(made, end=how.end, output_step=how.output_step, method=how.method)
    reference = integrate(scene, end=0.1, output_step=0.005, method=ROS3(0.0005))
    off = np.abs(result["slider.pin.position.x"] - reference["slider.pin.position.x"]).max()
    assert off < 1e-4 * np.ptp(reference["slider.pin.position.x"])


@pytest.mark.slow
def test_the_command_keeps_parameters_and_events(tmp_path):
    """In the scene that it writes: a parameter may be changed there, and an event ends the run as before."""
    scene = slider_crank(50.0)
    settings = Settings(start=0.0, end=0.1, output_step=0.005, method=ROS2(0.0005), stabilisation=Projection())
    save_scene(scene, settings, tmp_path / "plain.toml")
    text = (tmp_path / "plain.toml").read_text()
    for plain, given in (
        ("gravity = [0.0, 0.0, 0.0]", 'gravity = [0, "-g", 0]'),
        ("O = [0.0, 0.0, 0.0]", 'O = ["0 * g", 0, 0]'),
        ("[ground]", "[parameters]\ng = 9.81\n\n[ground]"),
        ("events = {}", 'events = {far = {quantity = "slider.pin.position.x", value = 0.4, stop = true}}'),
    ):
        assert text.count(plain) == 1
        text = text.replace(plain, given)
    (tmp_path / "in.toml").write_text(text)
    arguments = ["economise", str(tmp_path / "in.toml"), "--output", "slider.pin.position.x", "-p", "g=5.0"]
    done = CliRunner().invoke(cli, [*arguments, "-o", str(tmp_path / "out.toml")])
    assert done.exit_code == 0, done.output
    for given, g in (({}, 5.0), ({"g": "3"}, 3.0)):
        made, how = load_scene(tmp_path / "out.toml", given)
        assert made.gravity[1] == -g
        assert how.analysis.events[0].stop
    assert '"0 * g"' in (tmp_path / "out.toml").read_text()
    assert how.end == 0.1


@pytest.mark.slow
def test_parameters_that_no_longer_act_as_they_did_are_left_out(tmp_path):
    """The damping of a body is that of the modes of its model now; what stands with its parameter goes with it."""
    scene = slider_crank(50.0)
    settings = Settings(start=0.0, end=0.1, output_step=0.005, method=ROS2(0.0005), stabilisation=Projection())
    save_scene(scene, settings, tmp_path / "in.toml")
    tree = tomllib.loads((tmp_path / "in.toml").read_text())
    text = (tmp_path / "in.toml").read_text()
    damping = f"damping = {tree['bodies']['rod']['damping']}"
    assert text.count(damping) == 2
    text = text.replace(damping, 'damping = "2 * half"').replace("gravity = [0.0, 0.0, 0.0]", 'gravity = [0, "-g", 0]')
    text = text.replace("O = [0.0, 0.0, 0.0]", 'O = ["0 * half", "0 * side", 0]')
    text = text.replace("[ground]", '[parameters]\ng = 9.81\nunit = 1.0\nhalf = "0.005 * unit"\nside = 1.0\n\n[ground]')
    (tmp_path / "in.toml").write_text(text)
    arguments = ["economise", str(tmp_path / "in.toml"), "--output", "rod.stress=1%", "-o", str(tmp_path / "out.toml")]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0, done.output
    assert "note     unit, half, side: not among the parameters" in done.output
    made = load_scene(tmp_path / "out.toml", {"g": "3"})[0]
    assert made.gravity.tolist() == [0.0, -3.0, 0.0]
    with pytest.raises(InputError, match="there is no parameter 'half'"):
        load_scene(tmp_path / "out.toml", {"half": "0.1"})


def test_the_command_answers_a_wrong_output(tmp_path):
    save_scene(
        slider_crank(50.0),
        Settings(start=0.0, end=0.1, output_step=0.005, method=ROS2(0.0005), stabilisation=Projection()),
        tmp_path / "in.toml",
    )
    with pytest.raises(InputError, match="none of the scene's quantities"):
        CliRunner().invoke(
            cli,
            ["economise", str(tmp_path / "in.toml"), "--output", "nothing.x"],
            catch_exceptions=False,
            standalone_mode=False,
        )


def test_a_model_of_another_scene_is_refused():
    with pytest.raises(InputError, match="the scene has 1"):
        applied(pendulum(7e9), full(slider_crank(10.0), "ros2", 1))


# ---- adaptive order -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def adaptive() -> tuple[Scene, Result]:
    """A crank that speeds up and slows down again within 0.3 s, damped."""
    scene = slider_crank(40.0)
    bodies = tuple(replace(body, damping=0.05) for body in scene.bodies)
    motor = Driver("motor", "bearing", _up_and_down(60.0, 0.3))
    scene = replace(scene, bodies=bodies, drivers=(motor,))
    outputs = ("slider.pin.position.x=5e-6",)
    return scene, adaptive_forward(
        scene, outputs, end=0.42, output_step=2e-3, divisions=4, adaptation=Adaptation(rows=15)
    )


def _up_and_down(speed: float, time: float) -> TimeFunction:
    u = f"min(t, {time})"
    return formula(f"{speed} * ({u} - sin(2 * pi * {u} / {time}) * {time} / (2 * pi)) / 2")


def test_a_body_becomes_flexible_and_rigid_again(adaptive):
    _, result = adaptive
    count = result["model.coordinates"].sum(axis=1)
    assert count[0] == 0
    assert count.max() > 0
    assert count[-1] == 0


def test_outputs_stay_within_the_tolerance_and_continuous(adaptive):
    scene, result = adaptive
    reference = integrate(scene, end=0.42, output_step=2e-3, method=ROS3(2.5e-4))
    off = result["slider.pin.position.x"] - reference["slider.pin.position.x"]
    assert np.abs(off).max() < 5e-6
    np.testing.assert_allclose(result.time, reference.time, atol=1e-12)


def test_the_ledger_holds_what_switches_did(adaptive):
    _, result = adaptive
    switched, count = result["energy.switched"], result["model.coordinates"].sum(axis=1)
    changed = np.diff(count) != 0
    jumps = np.abs(np.diff(switched))
    assert jumps[changed].max() > 0
    assert jumps[~changed].max() < 0.05 * jumps[changed].max()
    assert np.abs(switched).max() < 1e-3 * np.ptp(result["energy.kinetic"])


def test_a_model_is_compiled_once_however_often_the_run_switches(monkeypatch):
    """Pieces are more than models, and each model of them is made once."""
    made = []

    def counted(scene, choice, span):
        made.append(choice.parts)
        return make(scene, choice, span)

    monkeypatch.setattr("ffr_dyn.economy.adaptive.make", counted)
    scene = slider_crank(40.0)
    adaptive_forward(
        scene, ("slider.pin.position.x=5e-6",), end=0.2, output_step=2e-3, divisions=2, adaptation=Adaptation(rows=10)
    )
    assert len(made) == len(set(made)) < 10


def test_a_scene_that_is_assembled_already_runs_to_the_same_bits():
    scene = slider_crank(40.0)
    one, other = (
        integrate(scene, end=0.02, output_step=0.002, method=ROS3(0.002), assembled=given)
        for given in (None, assemble(scene))
    )
    np.testing.assert_array_equal(one["slider.pin.position"], other["slider.pin.position"])


@pytest.mark.parametrize("given", [{"enter": 0.1, "leave": 0.2}, {"enter": 2.0}, {"rows": 1}])
def test_an_adaptation_that_cannot_work_is_refused(given):
    with pytest.raises(InputError):
        Adaptation(**given)


@pytest.mark.parametrize("sudden", ["stop", "pulse"])
def test_what_happens_between_rows_sets_off_vibration_that_loads_at_rows_do_not_tell(sudden):
    """Rigid bodies were said to be within the tolerance without a run of flexible ones: off by 950 tolerances at the stop."""
    rod, hinge = bar("rod", 0.6, rectangle(0.03, 0.01)), Joint("hinge", "revolute", "ground.O", "rod.a")
    stop = JointStop("stop", "hinge", stiffness=4e4, entry=5e-3, lower=-0.1, damping=20.0)
    hit = Load("hit", "rod.b", force=(0, formula("2000 * exp(-((t - 0.1053) / 0.0008)**2)"), 0))
    acting = {"forces": (stop,)} if sudden == "stop" else {"loads": (hit,)}
    scene = Scene((Body("rod", rod, damping=0.02),), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0), **acting)
    found = economise(scene, ["rod.b.position.y"], end=0.2, output_step=0.01, tolerance=0.01, verify=False)
    assert found.choice.parts[0].modes
    assert any(one.what == "full model" for one in found.tried)
    fine = forward(scene, end=0.2, output_step=0.01, method=ROS3(2.5e-5), check=False)
    mine = forward(found.scene, end=0.2, output_step=0.01, method=found.choice.integrator(0.01), check=False)
    assert (np.abs(mine["rod.b.position"][:, 1] - fine["rod.b.position"][:, 1]) <= found.limits[0]).all()
