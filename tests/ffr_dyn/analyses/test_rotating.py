"""Campbell diagrams, frequency responses, modes with names, and their commands."""

from __future__ import annotations

import re
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.linalg import eigh
from test_analyses_cli import DRIVER, SCENE
from test_dyn_plane import rod
from test_quasi_static import rotor

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.linearise import as_result
from ffr_dyn.cli import cli


def jeffcott(internal: float = 0.0, external: float = 0.0, speed: float = 1.0) -> fd.Scene:
    """A disc of 2 kg on a shaft of 800 N/m that turns with it, damped inside, and outside by the air."""
    disc = fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), points={"c": (0, 0, 0)})
    hub = fd.rigid_body("hub", mass=1e-3, inertia=(1e-4, 1e-4, 1e-4), points={"c": (0, 0, 0)})
    K, C = np.diag([800.0, 800, 8e4, 5e3, 5e3, 5e3]), np.diag([internal, internal, 0, 0, 0, 0])
    still = np.diag([external, external, 0, 0, 0, 0])
    return fd.Scene(
        (fd.Body("hub", hub), fd.Body("disc", disc, omega_bar=(0, 0, speed))),
        (fd.Joint("bearing", "revolute", "ground.O", "hub.c"),),
        (fd.Driver("motor", "bearing", fd.polynomial(0.0, speed)),),
        forces=(
            fd.Bushing("shaft", "hub.c", "disc.c", K, C),
            fd.Bushing("air", "ground.O", "disc.c", np.zeros((6, 6)), still),
        ),
        ground={"O": (0, 0, 0)},
    )


def test_critical_speeds_and_whirls_of_a_jeffcott_rotor(tmp_path):
    """Forward and backward at sqrt(k/m) from the ground, at every speed; its critical speed is that."""
    found = fd.campbell(jeffcott(), speeds=(0.0, 15.0, 40.0), modes=2)
    own = np.sqrt(800 / 2)
    seen = np.sort(found["seen"][1:], axis=1) * 2 * np.pi
    np.testing.assert_allclose(seen, np.tile([-own, own], (2, 1)), rtol=1e-9)
    critical = [one["speed"] for one in found.attributes["critical"]]
    np.testing.assert_allclose(critical, own, rtol=1e-7)
    assert {one["axes"] for one in found.attributes["critical"]} == {"ground"}
    assert found.attributes["limits"] == []
    assert fd.draw_campbell(found, tmp_path / "campbell.svg").stat().st_size > 1000


@pytest.mark.slow
def test_the_picture_of_a_campbell_diagram_tells_what_is_what(tmp_path):
    """Names of vibrations at the ends of their lines, orders, critical speeds and limits with their numbers."""
    done = []
    found = fd.campbell(
        jeffcott(0.4, 0.2), speeds=(5.0, 26.0, 47.0), modes=3, orders=(1, 2, 7.5), progress=lambda *a: done.append(a)
    )
    assert done == [(k, 6) for k in range(1, 7)]
    assert found.attributes["orders"] == [1.0, 2.0, 7.5]
    with mpl.rc_context({"svg.fonttype": "none"}):
        text = fd.draw_campbell(found, tmp_path / "campbell.svg").read_text()
    said = re.findall(r"<text[^>]*>([^<]*)</text>", text)
    for name in found.attributes["names"]:
        assert name in said
    critical = [f"{one['speed']:.4g}" for one in found.attributes["critical"]]
    assert {"1x", "2x", "7.5x", "unstable from 30", *critical} <= {one.strip() for one in said}
    assert len(critical) >= 4


@pytest.mark.slow
def test_damping_inside_is_unstable_above_a_limit():
    """speed < sqrt(k/m) (1 + c_external / c_internal)."""
    found = fd.campbell(jeffcott(0.4, 0.2), speeds=(5.0, 26.0, 47.0), modes=2)
    (limit,) = found.attributes["limits"]
    assert limit["speed"] == pytest.approx(np.sqrt(800 / 2) * 1.5, rel=1e-8)
    unstable = fd.steady(jeffcott(0.4, 0.2), speeds=(20.0, 40.0))
    assert not unstable.attributes["stable"]
    assert "unstable" in unstable.attributes["notes"][-1]
    (note,) = [
        one for one in fd.campbell(jeffcott(0.4, 0.2), speeds=(31.0, 40.0)).attributes["notes"] if "unstable" in one
    ]
    assert "at 31 rad/s the steady motion is unstable" in note
    assert "forward grows by" in note


@pytest.mark.slow
def test_what_only_decays_is_no_slow_vibration():
    """Tilting that is damped away has no frequency but that of the turning: it hides neither critical speeds nor limits."""
    scene = jeffcott(0.4, 0.2)
    shaft, air = scene.forces
    scene = replace(scene, forces=(replace(shaft, damping=np.diag([0.4, 0.4, 0, 900, 900, 900])), air))
    found = fd.campbell(scene, speeds=(5.0, 26.0, 47.0), modes=2)
    assert all(name.startswith("disc shift") for name in found.attributes["names"])
    assert {name.split(", ")[1] for name in found.attributes["names"]} == {"forward", "backward"}
    for of in (found, fd.campbell(scene, speeds=(5.0, 26.0, 47.0), modes=1)):
        (limit,) = of.attributes["limits"]
        assert limit["speed"] == pytest.approx(30.0, rel=1e-8)


def test_modes_have_names_and_free_spins_are_no_vibrations():
    speed = 100.0
    scene = fd.Scene(
        (fd.Body("rod", rod("rod", 0.8, stiffening=True), omega_bar=(0, 0, speed)),),
        (fd.Joint("hinge", "revolute", "ground.O", "rod.a"),),
        ground={"O": (0, 0, 0)},
    )
    found = fd.linearise(fd.scene_at(scene, fd.steady(scene)))
    assert (found.free, found.error) == (2, 0.0)
    assert found.leading[0] == "hinge.angle"
    assert {"rod: first bending, y", "rod: first bending, z"} <= set(found.leading)
    lines = fd.Linearise().report(as_result(scene, found))
    assert "free" in lines[0]
    assert not any("whirl" in line for line in lines)
    assert fd.linearise(rotor(speed, stiffening=True)).driven == ("motor",)


def test_a_mode_moves_through_a_period():
    found = fd.linearise(rotor(0.0, stiffening=True))
    motion = fd.mode_motion(found, 0)
    assert motion.time[-1] == pytest.approx(2 * np.pi / abs(found.eigenvalues[0].imag))
    np.testing.assert_allclose(motion["rod.q"][0], motion["rod.q"][-1], atol=1e-12)
    assert np.ptp(motion["rod.b.position"], axis=0).max() > 1e-3


def test_the_response_of_a_clamped_beam_and_its_parts():
    """The parts of all modes add up, at rest to the flexibility; noise by the closed form of one mode."""
    beam = fd.Body("rod", rod("rod", 0.8), damping=0.02)
    scene = fd.Scene((beam,), (fd.Joint("clamp", "fixed", "ground.O", "rod.a"),), ground={"O": (0, 0, 0)})
    found = fd.response(
        scene,
        input="rod.b.force.y",
        outputs=["rod.b.position.y", "rod.b.acceleration"],
        psd=((1.0, 0.5), (4000.0, 0.5)),
    )
    H = found["transfer"] @ [1, 1j]
    parts = (found["parts"] @ [1, 1j]).sum(axis=2)
    np.testing.assert_allclose(parts[:, 0], H[:, 0], atol=1e-5 * np.abs(H[:, 0]).max())
    load = fd.Load("push", "rod.b", force=(0, 1e-3, 0))
    bent = fd.static(replace(scene, loads=(load,)))["rod.b.position"][0, 1] / 1e-3
    assert found["gain"][0, 0] == pytest.approx(bent, rel=1e-2)
    linear = fd.linearise(scene)
    peak = 2 * np.pi * found["frequency"][np.argmax(found["gain"][:, 0])]
    first = np.argmin(np.abs(linear.eigenvalues - 1j * peak))
    omega, zeta = np.abs(linear.eigenvalues[first]), linear.damping_ratios[first]
    share = np.abs(H[:, 0]).max() * 2 * zeta * omega**2
    rms = np.sqrt(0.5 / 4 * share**2 / (2 * zeta * omega**3) * 2 / 2)
    assert found.attributes["rms"]["rod.b.position.y"] == pytest.approx(rms, rel=0.02)
    assert found.attributes["outputs"][1:] == [f"rod.b.acceleration.{c}" for c in "xyz"]


@pytest.mark.slow
def test_a_response_is_that_of_the_full_model_as_the_report_promises():
    """Of a clamped beam: relative, as in the report, to the sum of all modal parts without regard to their phase."""
    band, beta = fp.Band(20.0, 2000.0), 1e-6
    frame = fp.polyline([(0, 0, 0), (0.8, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")), elements=24)
    model = fp.from_frame(
        fp.named(frame, root=(0, 0, 0), tip=(0.8, 0, 0)), [fp.InterfaceRegion(name) for name in ("root", "tip")]
    )
    request = fp.Request(
        name="beam", reference=fp.FixedTo("root"), reduction=fp.Rubin(fp.Accuracy(band, 1e-4)), quality=band
    )
    body = fp.damped(fp.reduce(model, request), beta=beta)
    scene = fd.Scene(
        (fd.Body("beam", body),), (fd.Joint("clamp", "fixed", "ground.O", "beam.root"),), ground={"O": (0, 0, 0)}
    )
    f = np.geomspace(band.low, band.high, 30)
    found = fd.response(scene, input="beam.tip.force.y", outputs=["beam.tip.position.y"], frequencies=f)
    K, M, C = (matrix.toarray() for matrix in (model.coupled.K, model.coupled.M, model.coupled.C))
    held = np.linalg.qr(C[:6].T, mode="complete")[0][:, 6:]  # motions that the clamp leaves
    K, M, tip = held.T @ K @ held, held.T @ M @ held, C[7] @ held
    omega2, V = eigh(K, M)
    w = 2 * np.pi * f[:, None]
    single = (tip @ V) ** 2 / ((1 + 1j * w * beta) * omega2 - w**2)
    off = np.abs(found["transfer"][:, 0] @ [1, 1j] - single.sum(axis=1)) / np.abs(single).sum(axis=1)
    assert off.max() < 1e-4


def test_what_stands_on_a_shaking_base_is_moved_with_it():
    """At a low frequency the transmissibility is one; at the resonance of a sprung mass sqrt(1 + 4 z^2) / 2 z."""
    mass = fd.rigid_body("m", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    spring = fd.JointSpring("spring", "rail", stiffness=50.0, damping=2.0, coordinate="stroke")
    scene = fd.Scene(
        (fd.Body("m", mass),),
        (fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        forces=(spring,),
        ground={"O": (0, 0, 0)},
    )
    omega, zeta = 5.0, 2.0 / (2 * 2.0 * 5.0)
    found = fd.response(scene, input="base.x", outputs=["m.c.acceleration.x"], frequencies=[1e-4, omega / (2 * np.pi)])
    np.testing.assert_allclose(found["gain"][:, 0], [1.0, np.sqrt(1 + 4 * zeta**2) / (2 * zeta)], rtol=1e-6)


def sprung(damping: float = 2.0) -> fd.Scene:
    """A mass of 2 kg on a rail, held by 50 N/m."""
    mass = fd.rigid_body("m", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    return fd.Scene(
        (fd.Body("m", mass),),
        (fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        forces=(fd.JointSpring("spring", "rail", stiffness=50.0, damping=damping, coordinate="stroke"),),
        ground={"O": (0, 0, 0)},
    )


def test_displacement_velocity_and_acceleration_of_the_base_are_transmitted_alike():
    """T = (k + i w c) / (k + i w c - m w^2), of each to the same of the mass, and with i w to the next."""
    f = np.array([0.1, 0.7, 0.9, 5.0])
    s = 2j * np.pi * f
    T = (50 + 2 * s) / (50 + 2 * s + 2 * s**2)
    names = [f"m.c.{what}.x" for what in ("position", "velocity", "acceleration")]
    for order, given in enumerate(("base.x.displacement", "base.x.velocity")):
        found = fd.response(sprung(), input=given, outputs=names, frequencies=f)
        expected = np.stack([T * s ** (k - order) for k in range(3)], axis=1)
        np.testing.assert_allclose(found["transfer"] @ [1, 1j], expected, rtol=1e-7)
        assert found.attributes["input"] == given
    found = fd.response(sprung(), input="base.x", outputs=names[2:], frequencies=f)
    np.testing.assert_allclose(found["transfer"][:, 0] @ [1, 1j], T, rtol=1e-7)
    with pytest.raises(fd.InputError, match=r"at 0 Hz a velocity has no displacement"):
        fd.response(sprung(), input="base.x.velocity", outputs=names, frequencies=[0.0, 1.0])


def test_white_acceleration_of_the_base_by_miles():
    """Mean square of the absolute acceleration: pi f_n S (1 + 4 z^2) / 4 z over all frequencies."""
    zeta, natural, S = 2.0 / (2 * 2.0 * 5.0), 5.0 / (2 * np.pi), 0.3
    found = fd.response(sprung(), input="base.x", outputs=["m.c.acceleration.x"], psd=((1e-3, S), (4e3, S)))
    missing = S * (2 * zeta * natural) ** 2 / 4e3  # beyond, where |T| = 2 z f_n / f
    whole = np.pi * natural * S * (1 + 4 * zeta**2) / (4 * zeta)
    assert found.attributes["rms"]["m.c.acceleration.x"] == pytest.approx(np.sqrt(whole - missing), rel=2e-3)


def test_rates_of_a_driver_are_inputs():
    """Of its motion, its rate and its second derivative: each i w of the next."""
    mass = fd.rigid_body("m", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        (fd.Body("table", mass), fd.Body("m", mass)),
        (
            fd.Joint("rail", "translational", "ground.O", "table.c", axis=(1, 0, 0)),
            fd.Joint("slide", "translational", "table.c", "m.c", axis=(1, 0, 0)),
        ),
        (fd.Driver("shaker", "rail", 0.0, coordinate="stroke"),),
        forces=(fd.JointSpring("spring", "slide", stiffness=50.0, damping=2.0, coordinate="stroke"),),
        ground={"O": (0, 0, 0)},
    )
    f = np.array([0.1, 0.9, 5.0])
    s = 2j * np.pi * f
    T = (50 + 2 * s) / (50 + 2 * s + 2 * s**2)
    for order, given in enumerate(("shaker.stroke", "shaker.stroke_rate", "shaker.stroke_acceleration")):
        found = fd.response(scene, input=given, outputs=["m.c.acceleration.x"], frequencies=f)
        np.testing.assert_allclose(found["transfer"][:, 0] @ [1, 1j], T * s ** (2 - order), rtol=1e-7)


def test_what_a_driver_moves_follows_it():
    """A disc on a spring and a damper on a shaft that a motor turns: (k + i w c) / (k + i w c - J w^2), at the shaft one."""
    disc = fd.rigid_body("disc", mass=1.0, inertia=(0.1, 0.1, 0.2), points={"c": (0, 0, 0)})
    spring = fd.JointSpring("spring", "coupling", stiffness=80.0, damping=0.5)
    scene = fd.Scene(
        (fd.Body("shaft", disc), fd.Body("disc", disc)),
        (
            fd.Joint("bearing", "revolute", "ground.O", "shaft.c"),
            fd.Joint("coupling", "revolute", "shaft.c", "disc.c"),
        ),
        (fd.Driver("motor", "bearing", 0.0),),
        forces=(spring,),
        ground={"O": (0, 0, 0)},
    )
    f = np.array([0.0, 1.0, 3.2, 20.0])
    names = ["disc.omega_bar.z", "coupling.angle", "bearing.angle"]
    found = fd.response(scene, input="motor.angle", outputs=names, frequencies=f)
    w = 2 * np.pi * f
    follows = (80 + 0.5j * w) / (80 + 0.5j * w - 0.2 * w**2)
    expected = np.stack([1j * w * follows, follows - 1, np.ones(f.size)], axis=1)
    np.testing.assert_allclose(found["transfer"] @ [1, 1j], expected, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found["parts"][:, 1, 0] @ [1, 1j], follows, rtol=1e-7)
    assert found.attributes["input"] == "motor.angle"
    assert found.attributes["modes"] == ["coupling.angle"]
    alone = replace(scene, bodies=scene.bodies[:1], joints=scene.joints[:1], forces=())
    np.testing.assert_allclose(
        fd.response(alone, input="motor.angle", outputs=["shaft.omega_bar.z"], frequencies=f)["gain"][:, 0], w
    )


def test_the_rms_of_noise_is_that_of_a_long_run_within_its_confidence_interval():
    """The mean square of a Gaussian record of T has the variance 1/T times the integral of the squared density."""
    level, T, low, high = 3.0, 1000.0, 0.2, 3.0
    mass = fd.rigid_body("m", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        (fd.Body("m", mass),),
        (fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        forces=(fd.JointSpring("spring", "rail", stiffness=50.0, damping=2.0, coordinate="stroke"),),
        ground={"O": (0, 0, 0)},
    )
    found = fd.response(scene, input="rail.force", outputs=["rail.stroke"], psd=((low, level), (high, level)))
    rms, density = found.attributes["rms"]["rail.stroke"], found["density"][:, 0]
    variance = np.trapezoid(density**2, found["frequency"]) / T
    half = 1.96 * np.sqrt(variance) / (2 * rms**2)
    f, random = np.arange(low, high, 1 / T), np.random.default_rng(5)
    a, b = random.normal(scale=np.sqrt(level / T), size=(2, f.size))
    t, period = np.arange(0.0, T + 20.1, 0.02), round(T / 0.02)  # the frequencies are multiples of 1 / T
    amplitudes = np.zeros(period // 2 + 1, complex)
    amplitudes[np.rint(f * T).astype(int)] = period / 2 * (a - 1j * b)
    noise = np.resize(np.fft.irfft(amplitudes, period), t.size)  # which repeats itself
    push = fd.Load("push", "m.c", force=(fd.recorded(t, noise), 0, 0))
    run = fd.forward(replace(scene, loads=(push,)), end=T + 20, output_step=0.02, method=fd.RK4(0.01), check=False)
    assert half < 0.06
    assert abs(np.sqrt(np.mean(run["rail.stroke"][run.time > 20.0] ** 2)) / rms - 1) < half


def test_a_moment_takes_the_place_of_a_driver_and_holds_what_it_held():
    """A hinged rod under its weight that a motor holds at 0.3 rad: J theta'' = m g l/2 sin theta theta + moment."""
    scene = fd.Scene(
        (fd.Body("rod", fd.rigid_body("rod", mass=1.0, inertia=(0.01, 1 / 3, 1 / 3), centre_of_mass=(1, 0, 0),
                                      points={"a": (0, 0, 0), "b": (2, 0, 0)})),),
        (fd.Joint("hinge", "revolute", "ground.O", "rod.a"),),
        (fd.Driver("motor", "hinge", 0.3),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )  # fmt: skip
    w = 7.0
    found = fd.response(scene, input="motor.moment", outputs=["hinge.angle"], frequencies=[w / (2 * np.pi)])
    assert found["gain"][0, 0] == pytest.approx(1 / (4 / 3 * w**2 + 9.81 * np.sin(0.3)), rel=1e-6)


def test_a_state_space_is_that_of_scipy():
    found = fd.linearise(
        rotor(0.0, stiffening=False, drivers=()), inputs=(fd.JointEffort("m", "hinge"),), outputs=("hinge.angle",)
    )
    space = found.to_statespace()
    np.testing.assert_array_equal(space.A, found.A)
    assert space.D.shape == (1, 1)


# ---- from the command line ----------------------------------------------------------------------------------------------

COMMANDS = [
    (["steady", "--speed", "0..10:3"], "speeds       0, 5, 10 rad/s"),
    (["response", "--input", "hinge.moment", "--output", "rod.tip.acceleration", "--bode", "PICTURE"], "gain "),
    (["periodic"], "period       3.14159265 s"),
]


@pytest.mark.parametrize(("words", "said"), COMMANDS, ids=[words[0] for words, _ in COMMANDS])
def test_commands(tmp_path, words, said):
    free = words[0] == "response"
    file, picture = tmp_path / "rod.toml", tmp_path / "picture.png"
    file.write_text(SCENE.replace("gravity = [0, -9.81, 0]", "") + ("" if free else DRIVER))
    given = [str(picture) if word == "PICTURE" else word for word in words]
    done = CliRunner().invoke(cli, [given[0], str(file), *given[1:]], catch_exceptions=False)
    assert said in done.output
    assert done.exit_code == 0
    assert (tmp_path / f"rod.{words[0]}.nc").exists()
    assert picture.exists() == ("PICTURE" in words)


def test_a_mode_is_drawn_and_all_are_in_the_file(tmp_path):
    file, film = tmp_path / "rod.toml", tmp_path / "mode.html"
    file.write_text(SCENE)
    words = ["linearise", str(file), "--at-equilibrium", "--film", str(film), "--mode"]
    done = CliRunner().invoke(cli, [*words, "1"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert film.stat().st_size > 1000
    kept = fd.load_result(tmp_path / "rod.linearise.nc")
    assert kept.quantities["modes"].axes[0].labels[:4] == ("rod x", "rod y", "rod z", "rod turn x")
    np.testing.assert_allclose(np.abs(kept["modes"][0] @ [1, 1j]).max(axis=0), 1.0)
    with pytest.raises(fd.InputError, match=r"mode 9: the modes that are told are 1 to 1"):
        CliRunner().invoke(cli, [*words, "9"], catch_exceptions=False, standalone_mode=False)


KINDS = {
    "steady": 'speeds = ["0..10:3"]',
    "campbell": 'speeds = ["0..10:3"]\nturn = "motor"\norders = ["1", "2"]',
    "response": 'input = "motor.moment"\nquantities = ["rod.tip.position"]\nabout = "steady"\nband = "1..3"',
    "periodic": "period = 3.0\nfloquet = true",
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_scene_file_holds_them_there_and_back(tmp_path, kind):
    file = tmp_path / "rod.toml"
    text = SCENE.replace('[analysis]\nend = 0.5\noutput_step = 0.05\nstep = 0.005\nmethod = "rk4"\n', "")
    file.write_text(f'{text}{DRIVER}[analysis]\nkind = "{kind}"\n{KINDS[kind]}\n')
    scene, settings = fd.load_scene(file)
    fd.save_scene(scene, settings, tmp_path / "again.toml")
    assert fd.load_scene(tmp_path / "again.toml")[1] == settings


def test_the_rms_is_that_of_the_whole_noise_whatever_frequencies_are_told():
    """Of two masses, by Lyapunov's equation for white noise; of a narrow peak in a wide band, by its area."""
    m, k, c = 2.0, 200.0, 3.0
    scene = sprung_mass(m, k, c)
    S, outputs = 0.02, ["m.R.x"]
    white = ((0.0, S), (5e3, S))
    for frequencies in ((), (1.0, 2.0)):
        found = fd.response(scene, input="rail.force", outputs=outputs, psd=white, frequencies=frequencies)
        assert found.attributes["rms"]["m.R.x"] == pytest.approx(np.sqrt(S / (4 * c * k)), rel=1e-5)
    f, wide = 7.0, 1e-3
    peak = ((0.1, 0.0), (f - wide, 0.0), (f, S), (f + wide, 0.0), (500.0, 0.0))
    w = 2 * np.pi * f
    expected = np.sqrt(S * wide) / abs(k - m * w**2 + 1j * c * w)
    found = fd.response(scene, input="rail.force", outputs=outputs, psd=peak)
    assert found.attributes["rms"]["m.R.x"] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    "psd",
    [
        [(10, 1.0)],
        [(10, 1), (10, 2)],
        [(-20, 1), (20, 1)],
        [(10, -1), (20, 1)],
        [(10, float("nan")), (20, 1)],
        [(0, 1)],
    ],
)
def test_what_is_no_one_sided_density_is_refused(psd):
    with pytest.raises(fp.InputError, match="two-sided density twice as much"):
        fd.response(sprung_mass(2.0, 200.0, 3.0), input="rail.force", outputs=["m.R.x"], psd=psd)


@pytest.mark.parametrize(
    "how", [{"frequencies": [-1.0, 1.0]}, {"frequencies": [float("nan")]}, {"band_of": (0, 10)}, {"band_of": (10, 1)}]
)
def test_frequencies_that_are_none_are_refused(how):
    with pytest.raises(fp.InputError, match="frequenc"):
        fd.response(sprung_mass(2.0, 200.0, 3.0), input="rail.force", outputs=["m.R.x"], **how)


def test_parts_of_what_only_decays_belong_to_the_sum():
    found = fd.response(sprung_mass(2.0, 200.0, 100.0), input="rail.force", outputs=["m.R.x"], band_of=(0.1, 10))
    assert found.attributes["modes"] == ["rail.stroke"] * 2
    np.testing.assert_allclose(found["parts"].sum(axis=2)[:, 0], found["transfer"][:, 0], rtol=1e-9)


def sprung_mass(m: float, k: float, c: float) -> fd.Scene:
    mass = fd.rigid_body("m", mass=m, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    rail = fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
    spring = fd.JointSpring("spring", "rail", stiffness=k, damping=c, coordinate="stroke")
    return fd.Scene((fd.Body("m", mass),), (rail,), forces=(spring,), ground={"O": (0, 0, 0)})


@pytest.mark.slow  # the notes themselves in test_validity
def test_steady_motions_and_diagrams_of_a_linear_blade_tell_that_it_does_not_stiffen():
    """By the fastest of their speeds, and what to do: its body has the second order."""
    scene = rotor(1.0, stiffening=True)
    scene = replace(scene, bodies=[replace(body, stiffening=False) for body in scene.bodies])
    speeds = [0.0, 0.5 * float(np.sqrt(scene.bodies[-1].model.omega2.min()))]
    for found in (fd.steady(scene, speeds=speeds), fd.campbell(scene, speeds=speeds, modes=1)):
        (note,) = [note for note in found.attributes["notes"] if "without geometric stiffening" in note]
        assert "by up to 12 %" in note
        assert note.endswith("leave out stiffening = false")
