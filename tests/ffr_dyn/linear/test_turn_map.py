"""Periodic motions: linear oscillators in closed form, Mathieu's equation, long runs, and what has no period."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_analyses_kinematic import bar
from test_dyn_plane import slider_crank as flexible_crank

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.rotating.periodic import floquet_lines
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import evaluate
from ffr_dyn.functions.together import alone
from ffr_dyn.linear.turn_map import between, deviation, placed, turns
from ffr_prep.common.errors import InputError
from ffr_prep.model.material import Material
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

FORCED = 3.0  # rad/s


def oscillator(damping: float = 0.4, inertia: float = 1.0) -> fd.Scene:
    mass = fd.rigid_body("m", mass=2.0, inertia=(inertia,) * 3, points={"c": (0, 0, 0)})
    push = fd.Load("push", "m.c", force=(fd.harmonic(amplitude=1.5, frequency=FORCED / (2 * np.pi)), 0, 0))
    return fd.Scene(
        (fd.Body("m", mass),),
        (fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        forces=(fd.JointSpring("spring", "rail", stiffness=50.0, damping=damping, coordinate="stroke"),),
        loads=(push,),
        ground={"O": (0, 0, 0)},
    )


@pytest.mark.parametrize(("damping", "inertia"), [(0.4, 1.0), (0.0, 1.0), (0.4, 1e-9)])
def test_the_forced_oscillation_of_a_linear_oscillator(damping, inertia):
    """Also without damping, where no run settles, and of a body far smaller than its way."""
    period = 2 * np.pi / FORCED
    found = fd.periodic(oscillator(damping, inertia), period=period, method=fd.RK4(period / 1000))
    x = found["m.R.x"]
    H = 1.5 / (50.0 - 2 * FORCED**2 + 1j * damping * FORCED)
    wave = H * np.exp(1j * FORCED * found.time)
    # Of a sine or a cosine: the phase of the force is the library's.
    fit = np.linalg.lstsq(np.stack([wave.real, wave.imag], 1), x, rcond=None)
    assert np.hypot(*fit[0]) == pytest.approx(1.0, rel=1e-8)
    np.testing.assert_allclose(np.stack([wave.real, wave.imag], 1) @ fit[0], x, atol=1e-9)


def pulsed(width: float) -> tuple[fd.Scene, np.ndarray]:
    """An oscillator under a pulse in every second, and its velocity over the period by Fourier's series."""
    text, count = f"100 * exp(-(sin(pi * (t - 0.305)) / {width})**2)", 2**20
    push = fd.Load("push", "m.c", force=(fd.formula(text), 0, 0))
    pulse = 100 * np.exp(-((np.sin(np.pi * (np.arange(count) / count - 0.305)) / width) ** 2))
    omega = 2j * np.pi * np.arange(count // 2 + 1)
    velocity = np.fft.irfft(np.fft.rfft(pulse) * omega / (50.0 + 0.4 * omega + 2 * omega**2), count)
    return replace(oscillator(), loads=(push,)), velocity


@pytest.mark.parametrize("width", [pytest.param(1e-2, marks=pytest.mark.slow), 1e-5])
def test_pulses_between_the_steps_of_a_period_are_seen(width):
    """Of 3 us, in steps of 0.25 ms, there was no motion at all, and no word."""
    scene, velocity = pulsed(width)
    found = fd.periodic(scene, period=1.0)
    exact = np.interp(found.time, np.arange(velocity.size) / velocity.size, velocity, period=1.0)
    off, told = np.abs(found["m.v"][:, 0] - exact).max(), found.attributes["errors"]["m.v"][0]
    assert off <= 3 * told + 1e-7 * np.ptp(velocity)
    assert told < 1e-3 * np.ptp(velocity)


def test_a_jump_of_the_rate_of_a_driver_within_a_period_is_told():
    cam = fd.Driver("cam", "rail", fd.formula("0.1 * abs(sin(pi * (t - 0.3)))"), coordinate="stroke")
    scene = replace(oscillator(), loads=(), drivers=(cam,))
    notes = fd.periodic(scene, period=1.0, check=False).attributes["notes"]
    assert any("driver 'cam' changes its rate by 0.6283 m/s at once at t = 0.3 s" in note for note in notes)


@pytest.mark.parametrize(
    ("function", "period", "off"),
    [
        (fd.table([0.0, 0.5, 1.0], [0.0, 0.2, 1.0]), 2.0, "off"),
        (fd.formula("0.3 * sin(2 * pi * t)"), 1.5, "0.6 off"),
        (fd.formula("0.3 * sin(2 * pi * t)"), 2.0, ""),
        (fd.formula("0.3"), 2.0, ""),
    ],
)
def test_a_driven_motion_that_does_not_come_back_is_an_error_with_nothing_free_too(function, period, off):
    """Of a table that ends, the second period, in which all rests, was told as the motion."""
    held = fd.Driver("cam", "rail", function, coordinate="stroke")
    scene = replace(oscillator(), loads=(), drivers=(held,))
    if off:
        with pytest.raises(fd.ComputationError, match=f"driver 'cam' does not come back after {period:g} s: .* {off}"):
            fd.periodic(scene, period=period, check=False)
        return
    found = fd.periodic(scene, period=period, check=False)
    np.testing.assert_allclose(found["rail.stroke"], [evaluate(function, t)[0] for t in found.time], atol=1e-9)


def test_a_driven_angle_comes_back_by_whole_turns():
    turning = fd.Scene(
        (fd.Body("rod", bar("rod", 2.0)),),
        (fd.Joint("hinge", "revolute", "ground.O", "rod.a"),),
        drivers=(fd.Driver("motor", "hinge", fd.polynomial(0.1, 5.0)),),
        ground={"O": (0, 0, 0)},
    )
    assert fd.periodic(turning, check=False).attributes["period"] == pytest.approx(0.4 * np.pi)
    with pytest.raises(fd.ComputationError, match="driver 'motor' does not come back after 1 s"):
        fd.periodic(turning, period=1.0, check=False)


def test_multipliers_of_mathieus_equation():
    """A pendulum whose hinge shakes: theta'' + (g + a w^2 cos w t)/l theta = 0 about its rest, l = 2 L / 3."""
    w, amplitude = 8.0, 0.4
    shaking = fd.harmonic(amplitude=amplitude * w**2, frequency=w / (2 * np.pi))
    scene = fd.Scene(
        (fd.Body("rod", bar("rod", 2.0), rotation=(0, 0, -np.pi / 2)),),
        (fd.Joint("A", "revolute", "ground.O", "rod.a"),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
        base_acceleration=(0, shaking, 0),
    )
    period = 2 * np.pi / w
    found = fd.periodic(scene, period=period, method=fd.RK4(period / 2000), floquet=True)

    def rates(t, y):
        return [y[1], -(9.81 + evaluate(shaking, t)[0]) / (4 / 3) * y[0]]

    with alone():
        after = fd.periodic(scene, period=period, method=fd.RK4(period / 2000), floquet=True)
    assert after.attributes["multipliers"] == found.attributes["multipliers"]
    ends = [solve_ivp(rates, (0, period), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1] for y in np.eye(2)]
    expected = np.linalg.eigvals(np.array(ends).T)
    values = [complex(*pair) for pair in found.attributes["multipliers"]]
    np.testing.assert_allclose(sorted(np.abs(values)), sorted(np.abs(expected)), rtol=1e-6)
    assert np.prod(values) == pytest.approx(1.0, abs=1e-7)


def test_modes_about_a_periodic_motion_of_constant_coefficients():
    """Exponents are the eigenvalues, also where the vibration is faster than the period; motions have their names."""
    period = 2 * np.pi / FORCED
    found = fd.periodic(oscillator(), period=period, method=fd.RK4(period / 1000), floquet=True)
    expected = np.roots([2.0, 0.4, 50.0])
    values = np.array([complex(*pair) for pair in found.attributes["exponents"]])
    np.testing.assert_allclose(values[np.argsort(values.imag)], expected[np.argsort(expected.imag)], rtol=1e-8)
    assert found.attributes["leading"] == ["rail.stroke"] * 2


@pytest.mark.slow
def test_modes_about_the_turn_of_an_engine_are_those_of_its_rod():
    """A crank that turns slowly: the vibration of the rod, damped as it is."""
    scene = flexible_crank(loads=())
    found = fd.periodic(scene, floquet=True)
    a = found.attributes
    np.testing.assert_allclose(np.exp([complex(*pair) * a["period"] for pair in a["exponents"]]),
                               [complex(*pair) for pair in a["multipliers"]], rtol=1e-6)  # fmt: skip
    lasting = [name for name in a["leading"] if name != "gone after a period"]
    assert len(lasting) == np.sum(np.abs([complex(*pair) for pair in a["multipliers"]]) > 1e-4) >= 2
    assert all(name.startswith("rod: ") for name in lasting)


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "turns"), [(0.1, 20), (0.01, 60)])
def test_deflections_come_back_to_a_hundred_millionth_of_themselves(damping, turns):
    """Of a turn of a long run: also where vibrations last for many turns, and where they are small beside the scene."""
    scene = flexible_crank(loads=())
    bodies = tuple(replace(body, damping=damping) if body.model.n else body for body in scene.bodies)
    scene = replace(scene, bodies=bodies)
    found = fd.periodic(scene)
    period = found.attributes["period"]
    how = {"output_step": period / 100, "method": fd.ROS3(found.attributes["step"]), "check": False}
    run = fd.forward(scene, end=turns * period, stabilisation=fd.Projection(1e-14), **how)
    np.testing.assert_allclose(run["rod.q"][-101:], found["rod.q"], rtol=0, atol=1e-8 * np.abs(found["rod.q"]).max())


def test_a_driven_machine_ends_where_a_long_run_does():
    scene = flexible_crank(loads=())
    found = fd.periodic(scene, check=False)
    assert found.attributes["returns"] < 1e-10
    assert found.attributes["periods"] <= 4
    step, period = found.attributes["step"], found.attributes["period"]
    how = {"output_step": period / 100, "method": fd.ROS3(step), "stabilisation": fd.Projection(1e-14), "check": False}
    again = fd.forward(scene, end=period, begin="periodic", **how)
    np.testing.assert_allclose(again["rod.q"], found["rod.q"], atol=1e-8 * np.abs(found["rod.q"]).max())
    np.testing.assert_allclose(again["rod.q"][-1], again["rod.q"][0], atol=1e-7 * np.abs(found["rod.q"]).max())


@pytest.mark.parametrize("case", [lambda: flexible_crank(loads=()), lambda: four_bar(20.0), lambda: four_bar(60.0)])
def test_the_error_of_the_steps_is_told_of_every_output(case):
    """Beside steps eight times as short: neither less than the true one nor ten times as large."""
    scene = case()
    period = fd.periodic(scene, check=False).attributes["period"]
    found = fd.periodic(scene, method=fd.ROS3(period / 500))
    truth = fd.periodic(scene, method=fd.ROS3(period / 4000), check=False)
    ratios = []
    for name, (told, share) in found.attributes["errors"].items():
        true = np.abs(found[name] - truth[name]).max()
        if told > 0 and share * true / told > 1e-6:
            ratios.append(told / true)
    assert len(ratios) > 3
    assert 0.9 < min(ratios) < max(ratios) < 10
    worst = max(share for _, share in found.attributes["errors"].values())
    assert found.attributes["accuracy"].startswith(f"step: within {float(f'{100 * worst:.2g}'):g} % of the range of ")


@pytest.mark.slow
def test_the_error_of_multipliers_is_told():
    """Steps that are too long damp the vibration of the rod."""
    scene = flexible_crank(loads=())
    period = fd.periodic(scene, check=False).attributes["period"]
    truth, *runs = (
        fd.periodic(scene, method=fd.ROS3(period / n), floquet=True, check=n < 8000).attributes
        for n in (8000, 1000, 2000)
    )
    for run in runs:
        true = abs(complex(*truth["multipliers"][0]) - complex(*run["multipliers"][0]))
        assert 0.25 * true < run["multiplier_errors"][0] < 5 * true
    assert f", within {runs[-1]['multiplier_errors'][0]:.2g}   rod: " in floquet_lines(runs[-1])[0]


@pytest.mark.parametrize("size", [0.1, 0.7, 1.2])
def test_deviations_of_a_body_that_turns_far_are_found_again(size):
    """About a skew axis of space, off its centre of mass: the state meets the joint, and has the deviation that it is of."""
    body = fd.rigid_body("b", mass=1.0, inertia=(0.1, 0.2, 0.3), points={"hub": (0.1, 0.4, -0.2)})
    joint = fd.Joint("ball", "spherical", "ground.O", "b.hub")
    bodies = (fd.Body("b", body, position=(-0.1, -0.4, 0.2)),)
    assembled = assemble(fd.Scene(bodies, (joint,), ground={"O": (0, 0, 0)}))
    of = turns(assembled.system, 0.0, assembled.x, assembled.v, fd.ROS3(0.01), 1.0)
    wanted = size * of.scale * np.array([0.5, -0.3, 0.4, 0.2, 1.0, -0.5])
    x, v = placed(of, wanted)
    place = assembled.system.layout
    hub = x[place.R(0)] + rotation_matrix(x[place.p(0)]) @ [0.1, 0.4, -0.2]
    np.testing.assert_allclose(hub, 0, atol=1e-13)
    assert np.linalg.norm(between(place, of.near.x, x)[place.omega(0)]) > 0.5 * size
    np.testing.assert_allclose(deviation(of, x, v), wanted, atol=1e-13)


@pytest.mark.parametrize("steps", [37, 460, 1037])
def test_rows_reach_the_end_of_the_period(steps):
    """Whatever part of it a step is, and whether or not there are coarser ones."""
    period = 2 * np.pi / FORCED
    found = fd.periodic(oscillator(), period=period, method=fd.ROS3(period / steps))
    assert found.time[-1] == pytest.approx(period, rel=1e-12)
    assert found["m.R.x"][-1] == pytest.approx(found["m.R.x"][0], abs=1e-11)


@pytest.mark.slow
def test_a_period_that_is_none_is_an_error():
    with pytest.raises(fd.InputError, match="the period is not known"):
        fd.periodic(oscillator())
    with pytest.raises(fd.InputError, match="positive and finite"):
        fd.periodic(oscillator(), period=-1.0)
    with pytest.raises(fd.ComputationError, match=r"driver 'motor' does not come back after 0\.013 s"):
        fd.periodic(flexible_crank(), period=0.013)
    with pytest.raises(fd.ComputationError, match="does not repeat itself"):
        fd.periodic(flexible_crank())


def test_a_floquet_mode_moves_about_the_periodic_motion_without_its_decay():
    """Of a linear oscillator: its own vibration, of constant amplitude, on top of the forced one."""
    scene, period = oscillator(), 2 * np.pi / FORCED
    method = fd.RK4(period / 1000)
    turn = fd.periodic(scene, period=period, method=method, floquet=True)
    motion = fd.floquet_motion(scene, 0, period=period, method=method)
    growth, rate = turn.attributes["exponents"][0]
    assert (growth, abs(rate)) == pytest.approx((-0.1, np.sqrt(25 - 0.01)), rel=1e-6)
    assert motion.attributes["title"] == "0.79562 Hz, growth -0.1 1/s"
    forced = np.interp(
        motion.time, np.append(turn.time, turn.time[1:] + period), np.append(turn["m.R.x"], turn["m.R.x"][1:])
    )
    waves = np.stack([np.cos(abs(rate) * motion.time), np.sin(abs(rate) * motion.time)], 1)
    added = motion["m.R.x"] - forced
    fit = np.linalg.lstsq(waves, added, rcond=None)[0]
    np.testing.assert_allclose(waves @ fit, added, atol=1e-6 * np.hypot(*fit))
    with pytest.raises(InputError, match="are 1 to 1"):
        fd.floquet_motion(scene, 1, period=period, method=method)


def test_the_mode_that_grows_by_a_parametric_resonance_is_told():
    """Multipliers that are real and negative: half the frequency of the shaking, in the list of what is told."""
    w = 2 * np.sqrt(9.81 / (4 / 3))
    shaking = fd.harmonic(amplitude=0.2 * 9.81, frequency=w / (2 * np.pi))
    scene = fd.Scene(
        (fd.Body("rod", bar("rod", 2.0), rotation=(0, 0, -np.pi / 2)),), (fd.Joint("A", "revolute", "ground.O", "rod.a"),),
        ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0), base_acceleration=(0, shaking, 0),
    )  # fmt: skip
    found = fd.periodic(scene, period=2 * np.pi / w, floquet=True)
    exponents, lines = found.attributes["exponents"], floquet_lines(found.attributes)
    assert [rate for _, rate in exponents] == pytest.approx([w / 2, w / 2])
    assert exponents[0][0] > 0.1
    assert len(lines) == 2


@pytest.mark.parametrize("turned", [0.0, np.pi, -np.pi])
def test_a_spring_is_the_same_whichever_way_its_joint_is_drawn(turned):
    """Also where deviations from the periodic motion go around half a turn, from where angles are measured anew."""
    crank = fd.rigid_body("crank", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"o": (0, 0, 0), "h": (0.2, 0, 0)})
    spin, k = (0, 0, 20.0), 50.0
    bodies = (
        fd.Body("crank", crank, omega_bar=spin),
        fd.Body(
            "arm", bar("arm", 1.0), position=(0.2, 0, 0), rotation=(0, 0, turned), velocity=(0, 4.0, 0), omega_bar=spin
        ),
    )
    joints = (fd.Joint("axis", "revolute", "ground.O", "crank.o"), fd.Joint("lag", "revolute", "crank.h", "arm.a"))
    scene = fd.Scene(
        bodies, joints, (fd.Driver("motor", "axis", fd.polynomial(0.0, 20.0)),), ground={"O": (0, 0, 0)},
        forces=(fd.JointSpring("spring", "lag", stiffness=k, damping=0.5, free=turned),),
    )  # fmt: skip
    found = fd.periodic(scene, floquet=True)
    mass = bar("arm", 1.0).mass
    inward = np.cos(turned) * 0.2 * mass * 0.5 * 20.0**2
    exact = np.roots([mass / 3, 0.5, k + inward])
    values = np.array([complex(*one) for one in found.attributes["multipliers"]])
    np.testing.assert_allclose(np.sort(np.abs(values)), np.abs(np.exp(exact * found.attributes["period"])), rtol=1e-6)
    state = fd.linearise(scene)
    np.testing.assert_allclose(np.sort(state.eigenvalues.real), exact.real, rtol=1e-6)


def four_bar(speed: float) -> fd.Scene:
    """A crank and rocker with a soft coupler, 0.1, 0.4, 0.3 and 0.4 m long, with weight."""
    steel, start, a, b, c, g = Material("steel", 2.1e11, 0.3, 7850.0), 0.5, 0.1, 0.4, 0.3, 0.4
    frame = polyline([(0, 0, 0), (b, 0, 0)], Member(rectangle(0.02, 0.004), steel, (0, 1.0, 0)), elements=24)
    model = fp.from_frame(named(frame, a=(0, 0, 0), b=(b, 0, 0)), [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")])
    how = fp.Request(name="coupler", reference=fp.SimplySupported("a", "b"), reduction=fp.CraigBampton(6))
    coupler = fp.reduce(model, how)
    A, D = a * np.array([np.cos(start), np.sin(start), 0]), np.array([g, 0, 0])
    d = np.linalg.norm(D - A)
    lean = np.arctan2(-A[1], g - A[0]) + np.arccos((b**2 + d**2 - c**2) / (2 * b * d))
    B = A + b * np.array([np.cos(lean), np.sin(lean), 0])
    bodies = (
        fd.Body("crank", bar("crank", a), rotation=(0, 0, start)),
        fd.Body("coupler", coupler, position=A, rotation=(0, 0, lean), damping=0.02),
        fd.Body("rocker", bar("rocker", c), position=D, rotation=(0, 0, np.arctan2(B[1], B[0] - g))),
    )
    ends = (("ground.O", "crank.a"), ("crank.b", "coupler.a"), ("coupler.b", "rocker.b"), ("ground.D", "rocker.a"))
    joints = tuple(fd.Joint(f"at_{k}", "revolute", *both) for k, both in enumerate(ends))
    motor = fd.Driver("motor", "at_0", fd.polynomial(start, speed))
    return fd.Scene(bodies, joints, (motor,), ground={"O": (0, 0, 0), "D": (g, 0, 0)}, gravity=(0, -9.81, 0))


@pytest.mark.parametrize("speed", [20.0, 60.0])
def test_a_four_bar_whose_vibrations_coarse_steps_do_not_follow(speed):
    """A turn later it is where it was, and so are three turns of a run that begins there."""
    scene = four_bar(speed)
    found = fd.periodic(scene)
    period, size = found.attributes["period"], np.abs(found["coupler.q"]).max()
    np.testing.assert_allclose(found["coupler.q"][-1], found["coupler.q"][0], rtol=0, atol=1e-7 * size)
    how = {"output_step": period / 100, "method": fd.ROS3(found.attributes["step"]), "check": False}
    run = fd.forward(scene, end=3 * period, begin="periodic", stabilisation=fd.Projection(1e-14), **how)
    np.testing.assert_allclose(run["coupler.q"][-101:], found["coupler.q"], rtol=0, atol=1e-8 * size)


def test_a_vibration_that_excites_itself_is_sent_to_a_forward_run():
    """Van der Pol's oscillator, started on its cycle but for the period."""
    cart = fd.rigid_body("cart", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"a": (0, 0, 0)})
    pull = fd.Actuator(
        "pull",
        "rail",
        coordinate="stroke",
        function=lambda t, now: (1 - now.position("cart.a")[0] ** 2) * now.velocity("cart.a")[0],
    )
    scene = fd.Scene(
        bodies=[fd.Body("cart", cart, position=(2.0, 0, 0))],
        joints=[fd.Joint("rail", "translational", "ground.w", "cart.a", axis=(1, 0, 0))],
        ground={"w": (0, 0, 0)},
        forces=[fd.JointSpring("spring", "rail", stiffness=1.0, coordinate="stroke"), pull],
    )
    with pytest.raises(fd.ComputationError, match="excites itself makes its own period: run `forward` until"):
        fd.periodic(scene, period=6.6, method=fd.ROS3(0.066))


def braked(driven: bool) -> fd.Scene:
    """A disc with an unbalance in bearings that brake its whirl, by itself or on a motor that turns evenly."""
    disc = fd.rigid_body(
        "disc", mass=1.0, inertia=[1e-3] * 3, centre_of_mass=(0, 1e-3, 0), points={"l": (-0.1, 0, 0), "r": (0.1, 0, 0)}
    )  # fmt: skip
    shaft = fd.rigid_body("shaft", mass=1.0, inertia=[1e-3] * 3, points={"c": (0, 0, 0)})
    K, C = (1e5, 5e3, 5e3, 0, 0, 0), (20, 20, 20, 0, 0, 0)
    bearings = [fd.Bushing(f"at_{end}", f"ground.{end}", f"disc.{end}", K, C) for end in "lr"]
    coupling = fd.Bushing("coupling", "shaft.c", "disc.l", stiffness=(0, 0, 0, 50, 0, 0), damping=(0, 0, 0, 0.1, 0, 0))
    return fd.Scene(
        [fd.Body(name, body, omega_bar=(90.0, 0, 0)) for name, body in {"disc": disc, "shaft": shaft}.items()][: 1 + driven],
        [fd.Joint("motor", "revolute", "ground.l", "shaft.c", axis=(1, 0, 0))] if driven else [],
        drivers=[fd.Driver("turn", "motor", fd.polynomial(0, 90.0))] if driven else [],
        forces=[*bearings, coupling] if driven else bearings,
        ground={"l": (-0.1, 0, 0), "r": (0.1, 0, 0)},
    )  # fmt: skip


def test_a_rotor_whose_speed_nothing_keeps_is_told_to_be_driven():
    """It was told to begin nearer. Driven, it whirls as a Jeffcott rotor: m e W^2 / |k - m W^2 + i c W|."""
    with pytest.raises(
        fd.ComputationError, match="body 'disc' turns freely, and what brakes or drives it changes its speed"
    ):
        fd.periodic(braked(False), period=2 * np.pi / 90)
    turn = fd.periodic(braked(True), method=fd.ROS3(2 * np.pi / 90 / 400), check=False)
    whirl = np.linalg.norm(turn["disc.l.position"][:, 1:], axis=1)
    np.testing.assert_allclose(whirl, 1e-3 * 90**2 / abs(1e4 - 90**2 + 40j * 90), rtol=1e-4)


def test_a_round_rotor_whose_loads_are_rounding_is_accurate():
    """Nothing pushes it but what is left of its own mass and speed; the error of that was told as all of its range."""
    ends, spin = {"left": (-0.2, 0, 0), "right": (0.3, 0, 0)}, {"omega_bar": (100.0, 0, 0)}
    disc = fd.rigid_body("disc", mass=10.0, inertia=(0.9, 0.5, 0.5), points=ends)
    motor = fd.rigid_body("motor", mass=1.0, inertia=(1e-3,) * 3, points={"c": (0, 0, 0)})
    forces = [
        fd.Bushing(end, f"ground.{end}", f"disc.{end}", np.diag([1e6] * 3 + [0] * 3), np.diag([500.0] * 3 + [0] * 3))
        for end in ends
    ]
    forces.append(
        fd.Bushing("coupling", "motor.c", "disc.left", np.diag([0, 0, 0, 2e4, 0, 0]), np.diag([0, 0, 0, 1, 0, 0]))
    )
    scene = fd.Scene(
        (fd.Body("disc", disc, **spin), fd.Body("motor", motor, position=ends["left"], **spin)),
        (fd.Joint("shaft", "revolute", "ground.left", "motor.c", axis=(1, 0, 0)),),
        (fd.Driver("drive", "shaft", fd.polynomial(0.0, 100.0)),),
        forces=tuple(forces),
        ground=ends,
    )
    found = fd.periodic(scene, method=fd.ROS3(2 * np.pi / 100.0 / 2000))
    error, of_range = np.array(list(found.attributes["errors"].values())).T
    assert error.max() < 1e-6
    assert of_range.max() < 0.01
