"""Forced vibrations with all that is nonlinear: Duffing's oscillator against harmonic balance and its backbone, small ones
against the linear response, a base that moves, and the command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.special import ellipk
from test_analyses_cli import SCENE

import ffr_dyn as fd
from ffr_dyn.cli import cli

M, K, CUBIC, DAMPING, FORCE = 1.0, 40.0, 800.0, 0.3, 1.0
REACH = 0.5  # m, of the curve of the spring


def duffing(damping: float = DAMPING) -> fd.Scene:
    """M x'' + DAMPING x' + K x + CUBIC x^3 on a rail."""
    at = np.linspace(-REACH, REACH, 801)
    mass = fd.rigid_body("m", mass=M, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    spring = fd.JointSpring(
        "spring", "rail", stiffness=fd.Curve(at, K * at + CUBIC * at**3), damping=damping, coordinate="stroke"
    )
    return fd.Scene(
        (fd.Body("m", mass),),
        (fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        forces=(spring,),
        ground={"O": (0, 0, 0)},
    )


def balanced(omega: float, first: complex, harmonics: int = 11) -> tuple[float, np.ndarray]:
    """The frequency [rad/s] near omega, and complex amplitudes (harmonics + 1,) of x = Re sum c_k exp(i k omega t) under
    FORCE sin(omega t), of which the first has the phase of `first`: along the branch, phases are there once."""
    phases = 2 * np.pi * np.arange(128) / 128
    orders = np.arange(harmonics + 1)
    waves = np.exp(1j * np.outer(orders, phases))

    def complex_of(a: np.ndarray) -> np.ndarray:
        return np.append(a[0], a[1:-1:2] + 1j * a[2:-1:2])

    def left(a: np.ndarray) -> np.ndarray:
        c, k = complex_of(a), 1j * a[-1] * orders
        x, inertia = (c @ waves).real, ((M * k**2 + DAMPING * k) * c @ waves).real
        off = (waves.conj() @ (inertia + K * x + CUBIC * x**3 - FORCE * np.sin(phases))) / 64
        turned = (c[1] / first).imag
        return np.concatenate([off[:1].real, np.stack([off[1:].real, off[1:].imag], 1).ravel(), [turned]])

    guess = np.zeros(2 * harmonics + 2)
    guess[1:3], guess[-1] = (first.real, first.imag), omega
    found = root(left, guess, tol=1e-12).x
    return float(found[-1]), complex_of(found)


@pytest.fixture(scope="module")
def swept() -> fd.Result:
    return fd.forced(duffing(), input="rail.force", amplitude=FORCE, outputs=["m.c.position.x"], band_of=(1.05, 1.75))


@pytest.mark.slow
def test_duffings_oscillator_is_that_of_harmonic_balance(swept):
    """Stable and unstable, the first and the third harmonic; the branch turns back twice."""
    f = swept["frequency"]
    first = -1j * swept["harmonics"][:, 0, 0] * np.exp(1j * np.radians(swept["phase"][:, 0]))
    for k in range(0, f.size, 6):
        omega, c = balanced(2 * np.pi * f[k], first[k])
        assert f[k] == pytest.approx(omega / (2 * np.pi), rel=1e-4)
        assert abs(first[k]) == pytest.approx(abs(c[1]), rel=1e-4)
        assert swept["harmonics"][k, 0, 2] == pytest.approx(abs(c[3]), rel=1e-3, abs=1e-7)
    assert len(swept.attributes["jumps"]) == 2
    turning = np.flatnonzero(np.diff(swept["stable"]))
    assert turning.size == 2
    assert swept["stable"][0]
    assert swept["stable"][-1]
    jumps = swept.attributes["jumps"]
    np.testing.assert_allclose(f[turning], jumps, rtol=5e-3)


@pytest.mark.slow
def test_the_backbone_is_that_of_the_free_oscillator(swept):
    """Where the first harmonic lags by a quarter the amplitude is that of a free vibration, by an elliptic integral."""
    phase = swept["phase"][:, 0]
    k = int(np.flatnonzero(np.diff(np.sign(phase + 90)))[0])
    share = (-90 - phase[k]) / (phase[k + 1] - phase[k])
    f, a = (np.interp(share, [0, 1], of[k : k + 2]) for of in (swept["frequency"], swept["amplitude"][:, 0]))
    stretch = CUBIC * a**2
    exact = np.sqrt((K + stretch) / M) / (4 * ellipk(stretch / (2 * (K + stretch))))
    assert f == pytest.approx(exact, rel=1e-3)


@pytest.mark.slow
def test_upwards_and_downwards_jump_where_one_harmonic_says(swept):
    """(K - M w^2 + 3/4 CUBIC a^2)^2 + (DAMPING w)^2 = (F / a)^2 has its vertical tangents there, within a per cent."""

    def left(a: float, w: float) -> float:
        return float((K - M * w**2 + 0.75 * CUBIC * a**2) ** 2 + (DAMPING * w) ** 2 - (FORCE / a) ** 2)

    def roots(f: float) -> int:
        a = np.linspace(1e-3, REACH, 4000)
        return int((np.diff(np.sign([left(one, 2 * np.pi * f) for one in a])) != 0).sum())

    inside = [brentq(lambda f: roots(f) - 2.0, *ends, xtol=1e-4) for ends in ((1.05, 1.3), (1.3, 1.75))]
    np.testing.assert_allclose(sorted(swept.attributes["jumps"]), inside, rtol=1e-2)


@pytest.mark.parametrize("given", ["base.x", "base.x.displacement", "rail.force", "push"])
def test_small_vibrations_are_those_of_the_linear_response(given):
    push = fd.Load("push", "m.c", force=(1e-9 if given != "push" else 1.0, 0, 0))
    scene = replace(duffing(2.0), loads=(push,) if given == "push" else ())
    names = ["m.c.position.x", "m.c.acceleration.x"]
    if given == "push":  # a share of a load that holds the mass off its middle
        scene = fd.scene_at(scene, fd.static(scene))
    found = fd.forced(scene, input=given, amplitude=1e-5, outputs=names, band_of=(0.9, 1.0))
    wanted = fd.response(scene, input=given, outputs=names, frequencies=found["frequency"].tolist())
    H = found["harmonics"][:, :, 0] / 1e-5 * np.exp(1j * np.radians(found["phase"]))
    np.testing.assert_allclose(H, wanted["transfer"] @ [1, 1j], rtol=2e-4)
    sines = found["harmonics"][:, :, 0]  # wherever between the rows their peaks are
    np.testing.assert_allclose(found["amplitude"], sines, rtol=5e-5)


@pytest.mark.slow
def test_a_small_body_on_a_long_way_is_a_linear_oscillator():
    """F / |k - m w^2 + i c w| of a kilogram as small as a pea that moves by 75 mm: what it may move is not its size."""
    scene = duffing(2.0)
    mass = fd.rigid_body("m", mass=M, inertia=(1e-5, 1e-5, 1e-5), points={"c": (0, 0, 0)})
    spring = fd.JointSpring("spring", "rail", stiffness=400.0, damping=2.0, coordinate="stroke")
    scene = replace(scene, bodies=(fd.Body("m", mass),), forces=(spring,))
    found = fd.forced(scene, input="rail.force", amplitude=3.0, outputs=["rail.stroke"], band_of=(2.5, 4))
    w = 2 * np.pi * found["frequency"]
    np.testing.assert_allclose(found["amplitude"][:, 0], 3 / np.abs(400 - w**2 + 2j * w), rtol=2e-3)
    assert found["amplitude"].max() > 0.074


@pytest.mark.slow
def moved_by_itself(force: object) -> fd.Scene:
    push = fd.Actuator("push", "rail", force, coordinate="stroke")
    return replace(duffing(), forces=(*duffing().forces, push))


@pytest.mark.parametrize("force", [fd.harmonic(amplitude=3.0, frequency=1.0), lambda t: np.sin(2 * np.pi * t)])
def test_what_changes_by_itself_is_refused(force):
    """What came back at the first frequency of the band was in all rows, as ten times the amplitude."""
    with pytest.raises(fd.InputError, match="force 'push' changes with time by itself"):
        fd.forced(
            moved_by_itself(force), input="rail.force", amplitude=0.1, outputs=["m.R.x"], band_of=(1.0, 1.2), steps=80
        )


def test_what_changes_later_than_two_periods_is_not():
    scene = moved_by_itself(fd.formula("0.1 * step(t - 50)"))
    found = fd.forced(scene, input="rail.force", amplitude=0.1, outputs=["m.R.x"], band_of=(1.0, 1.01), steps=80)
    assert found["amplitude"].max() > 0


def test_a_pendulum_swings_by_more_than_a_radian():
    """(I + m l^2) x'' + c x' + m g l sin x = T sin(w t): each motion, stable or not, repeats itself by SciPy's solver."""
    bob = fd.rigid_body("bob", mass=1.0, inertia=(1e-3, 1e-3, 1e-3), points={"hub": (0, 0.3, 0)})
    scene = fd.Scene(
        (fd.Body("bob", bob, position=(0, -0.3, 0)),),
        (fd.Joint("pin", "revolute", "ground.O", "bob.hub"),),
        forces=(fd.JointSpring("drag", "pin", damping=0.03),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    found = fd.forced(scene, input="pin.moment", amplitude=0.2, outputs=["pin.angle"], band_of=(0.7, 1.0))
    assert found["amplitude"].max() > 1.2
    assert len(found.attributes["jumps"]) == 2
    for k in range(0, found["frequency"].size, 12):
        w = 2 * np.pi * found["frequency"][k]

        def rates(t, y, w=w):
            return [y[1], (0.2 * np.sin(w * t) - 0.03 * y[1] - 0.3 * 9.81 * np.sin(y[0])) / 0.091]

        def period(y, w=w, rates=rates):
            return solve_ivp(rates, (0, 2 * np.pi / w), y, method="DOP853", rtol=1e-10, atol=1e-11, max_step=0.02).y

        first = found["harmonics"][k, 0, 0] * np.exp(1j * np.radians(found["phase"][k, 0]))
        start = root(lambda y, period=period: period(y)[:, -1] - y, [first.imag, w * first.real], tol=1e-10)
        assert np.abs(start.fun).max() < 1e-5  # where the branch turns back SciPy finds it no nearer
        assert found["amplitude"][k, 0] == pytest.approx(np.ptp(period(start.x)[0]) / 2, rel=1e-3)


@pytest.mark.slow
def test_a_driver_shakes():
    """A pendulum on a slide: small angles against the linear response, downwards."""
    slide = fd.rigid_body("slide", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    rod = fd.rigid_body(
        "rod",
        mass=1.0,
        inertia=(0.01, 1 / 3, 1 / 3),
        centre_of_mass=(0, -1, 0),
        points={"a": (0, 0, 0), "b": (0, -2, 0)},
    )
    scene = fd.Scene(
        (fd.Body("slide", slide), fd.Body("rod", rod)),
        (
            fd.Joint("rail", "translational", "ground.O", "slide.c", axis=(1, 0, 0)),
            fd.Joint("pin", "revolute", "slide.c", "rod.a"),
        ),
        (fd.Driver("shaker", "rail", 0.0, coordinate="stroke"),),
        forces=(fd.JointSpring("drag", "pin", damping=0.8),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    how = {"input": "shaker.stroke", "outputs": ["pin.angle"]}
    found = fd.forced(scene, amplitude=1e-4, band_of=(0.6, 0.4), **how)
    assert found["frequency"][0] == pytest.approx(0.6)
    assert found["frequency"][-1] == pytest.approx(0.4)
    wanted = fd.response(scene, frequencies=found["frequency"].tolist(), **how)
    np.testing.assert_allclose(found["harmonics"][:, 0, 0], 1e-4 * wanted["gain"][:, 0], rtol=2e-4)


@pytest.mark.slow
def test_the_command_draws_and_a_file_holds_it(tmp_path):
    spring = '[forces.s]\nkind = "joint-spring"\njoint = "hinge"\nstiffness = 30\ndamping = 2\n'
    file, picture = tmp_path / "rod.toml", tmp_path / "out" / "forced.png"
    file.write_text(SCENE.replace("gravity = [0, -9.81, 0]", "") + spring)
    words = [
        "--input",
        "hinge.moment",
        "--amplitude",
        "2",
        "--output",
        "hinge.angle",
        "--band",
        "0.5..0.7",
        "--steps",
        "80",
        "--down",
    ]
    done = CliRunner().invoke(cli, ["forced", str(file), *words, "--picture", str(picture)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "output       hinge.angle: at most " in done.output
    assert picture.exists()
    found = fd.load_result(tmp_path / "rod.forced.nc")
    assert found["frequency"][0] == pytest.approx(0.7)
    text = file.read_text().replace('[analysis]\nend = 0.5\noutput_step = 0.05\nstep = 0.005\nmethod = "rk4"\n', "")
    keys = 'kind = "forced"\ninput = "hinge.moment"\namplitude = 2.0\nquantities = ["hinge.angle"]\nband = "0.5..0.7"\n'
    file.write_text(f"{text}[analysis]\n{keys}")
    scene, settings = fd.load_scene(file)
    fd.save_scene(scene, settings, tmp_path / "again.toml")
    assert fd.load_scene(tmp_path / "again.toml")[1] == settings
