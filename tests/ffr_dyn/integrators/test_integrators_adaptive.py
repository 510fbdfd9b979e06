"""Methods that choose their steps: error against tolerance, rows between steps, what no step can pass, files and resuming."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from synthetic import cloud
from test_analyses_references import END, andrews

import ffr_dyn as fd
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.integrators import RK4, ROS3, AdaptiveROS3, DormandPrince, Tolerances, tolerances
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import save_scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError

KINDS = (AdaptiveROS3, DormandPrince)


def pendulum(stiffness: float = 400.0) -> Scene:
    return Scene(
        (Body("bar", cloud(3, stiffness=stiffness), damping=0.01),),
        (Joint("hinge", "revolute", "ground.O", "bar.a", axis=(0, 0, 1)),),
        ground={"O": (0, 0, 0)},
        gravity=(0.0, -9.81, 0.0),
    )


@pytest.fixture(scope="module")
def reference():
    return integrate(pendulum(), end=1.0, output_step=0.02, method=RK4(2e-5), stabilisation=Projection(1e-13))


def apart(one, other) -> float:
    return max(float(np.abs(one[name] - other[name]).max()) for name in ("bar.R", "bar.q"))


@pytest.mark.parametrize("kind", KINDS)
def test_the_error_follows_the_tolerance(kind, reference):
    """Two powers of ten in the tolerance gain at least one and a half in the error, and rows hold the constraints."""
    errors = []
    for relative in (1e-4, 1e-6, 1e-8):
        run = integrate(pendulum(), end=1.0, output_step=0.02, method=kind(tolerances(relative)))
        errors.append(apart(run, reference))
        assert errors[-1] < 100 * relative
        assert np.abs(run["constraint.position"]).max() < 1e-9
    assert errors[1] < errors[0] / 30
    assert errors[2] < errors[1] / 30


@pytest.mark.parametrize("kind", KINDS)
def test_rows_between_the_steps_are_as_good_as_the_steps(kind, reference):
    """Steps far longer than the rows' spacing: positions and velocities are interpolated."""
    run = integrate(pendulum(), end=0.1, output_step=2.5e-5, method=kind(tolerances(1e-6)))
    assert run.attributes["steps"] < 0.5 * run.time.size
    fine = integrate(pendulum(), end=0.1, output_step=2.5e-5, method=RK4(2.5e-5), stabilisation=Projection(1e-13))
    assert apart(run, fine) < 2e-6
    assert np.abs(run["bar.q_dot"] - fine["bar.q_dot"]).max() < 3e-3 * np.abs(fine["bar.q_dot"]).max()
    assert np.abs(run["bar.omega_bar"] - fine["bar.omega_bar"]).max() < 1e-4


def test_rows_of_dormand_prince_are_within_its_tolerance():
    """A rigid rod on a hinge, few steps between many rows, beside its equation by SciPy."""
    rod = rigid_body(
        "rod", mass=1.0, inertia=(1e-3, 0.1, 0.1), centre_of_mass=(0.5, 0, 0), points={"a": (0, 0, 0), "tip": (1, 0, 0)}
    )
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a")
    scene = Scene((Body("rod", rod),), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))
    run = integrate(scene, end=2.0, output_step=0.02, method=DormandPrince(tolerances(1e-9)))
    assert run.attributes["steps"] < 2 * run.time.size
    exact = solve_ivp(
        lambda t, y: [y[1], -0.5 * 9.81 * np.cos(y[0]) / 0.35],
        *((0.0, 2.0), (0.0, 0.0)),
        method="DOP853", rtol=1e-13, atol=1e-13, t_eval=run.time,
    )  # fmt: skip
    angle, rate = exact.y
    along, across = np.array([np.cos(angle), np.sin(angle)]).T, np.array([-np.sin(angle), np.cos(angle)]).T
    np.testing.assert_allclose(run["rod.tip.position"][:, :2], along, atol=5e-9)
    np.testing.assert_allclose(run["rod.tip.velocity"][:, :2], rate[:, None] * across, atol=2e-8)


def test_stiff_modes_do_not_limit_the_linearly_implicit_method():
    """A thousand times the frequency: no more steps, and the motion of the stiff limit."""
    soft, stiff = (
        integrate(pendulum(stiffness), end=1.0, output_step=0.05, method=AdaptiveROS3(tolerances(1e-4)))
        for stiffness in (4e5, 4e11)
    )
    assert stiff.attributes["steps"] < 1.5 * soft.attributes["steps"]
    rigid = integrate(pendulum(4e11), end=1.0, output_step=0.05, method=ROS3(5e-4))
    assert apart(stiff, rigid) < 1e-3


def test_dzhanibekov_by_dormand_prince():
    """Torque-free top, I = (1, 2, 3), omega(0) = (0.001, 1, 0.001): closed form in elliptic functions, at t = 10 s."""
    top = rigid_body("top", mass=1.0, inertia=(1, 2, 3))
    scene = Scene((Body("top", top, omega_bar=(0.001, 1, 0.001)),))
    run = integrate(scene, end=10, output_step=10, method=DormandPrince(tolerances(1e-11)))
    expected = (-0.117326383719773, 0.993093912821562, 0.0677433399352767)
    np.testing.assert_allclose(run["top.omega_bar"][-1], expected, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_andrews_squeezer(kind):
    run = integrate(
        andrews(), end=0.03, output_step=2.5e-3, method=kind(tolerances(1e-7)), stabilisation=Projection(1e-12)
    )
    for name, expected in END.items():
        assert abs(run[f"{name}.angle"][-1] - expected) < 2e-4, name


@pytest.mark.slow
def test_a_jump_is_passed_with_small_steps_and_a_pole_is_not():
    jump = Load("jump", "bar.b", (0.0, lambda t: 50.0 * (t > 0.31), 0.0))
    run = integrate(
        replace(pendulum(), loads=(jump,)), end=0.6, output_step=0.02, method=AdaptiveROS3(tolerances(1e-5))
    )
    fine = integrate(replace(pendulum(), loads=(jump,)), end=0.6, output_step=0.02, method=RK4(5e-5))
    assert run.attributes["refused_steps"] > 3
    assert apart(run, fine) < 1e-4
    pole = Load("pole", "bar.b", (0.0, lambda t: 1.0 / (0.31 - t) ** 3 if t != 0.31 else 1e300, 0.0))
    with pytest.raises(ComputationError, match=r"t = 0.3.*step has become too small.*smooth"):
        integrate(replace(pendulum(), loads=(pole,)), end=0.6, output_step=0.02, method=DormandPrince())


@pytest.mark.parametrize("kind", KINDS)
def test_a_resumed_run_has_the_same_bits(kind, tmp_path):
    settings = {"output_step": 0.01, "method": kind(tolerances(1e-5)), "outputs": ("*",)}
    whole = integrate(pendulum(), end=0.5, **settings)
    integrate(pendulum(), end=0.2, **settings, path=tmp_path / "run.nc")
    integrate(pendulum(), end=0.5, **settings, resume=tmp_path / "run.nc")
    again = load_result(tmp_path / "run.nc")
    for name in whole.quantities:
        assert whole[name].tobytes() == again[name].tobytes(), name
    assert again.attributes["steps"] == whole.attributes["steps"]


def test_tolerances_must_be_positive():
    with pytest.raises(InputError, match="'elastic' is -1"):
        Tolerances(elastic=-1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_scene_files_keep_them(kind, tmp_path):
    wanted = kind(Tolerances(1e-5, position=1e-6, velocity=2e-6, elastic=3e-9))
    settings = Settings(start=0.0, end=1.0, output_step=0.01, method=wanted, stabilisation=Projection())
    assert load_scene(save_scene(pendulum(), settings, tmp_path / "a.toml"))[1].method == wanted
    text = (tmp_path / "a.toml").read_text()
    for extra, words in (("step = 0.001", "chooses its steps"), ("tolerances.relative = 0", "relative")):
        lines = [line for line in text.splitlines() if not (extra.startswith("tol") and line.startswith("tolerances"))]
        at = lines.index("[analysis]") + 1
        (tmp_path / "b.toml").write_text("\n".join([*lines[:at], extra, *lines[at:]]))
        with pytest.raises(InputError, match=words):
            load_scene(tmp_path / "b.toml")


def _floor(kind):
    """A hard floor, 2e4 N/m: its declaration among the fields of a scene."""
    if kind == "stop":
        stop = fd.JointStop("floor", "rail", stiffness=2e4, entry=2e-3, lower=0.0, coordinate="stroke")
        return {"forces": (stop,)}
    if kind == "curve":
        curve = fd.Curve([-0.02, -0.002, 0.0, 0.1], [-380.0, -20.0, 0.0, 0.0])
        return {"forces": (fd.JointSpring("floor", "rail", stiffness=curve, coordinate="stroke"),)}
    push = fd.Load("floor", "ball.o", function=lambda t, state: (0, 0, 2e4 * max(-state.position("ball.o")[2], 0.0)))
    return {"loads": (push,)}


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5, 1e-6, 1e-8])
@pytest.mark.parametrize("kind", ["stop", "curve", "function"])
@pytest.mark.parametrize("method", [fd.AdaptiveROS3, fd.DormandPrince])
def test_a_ball_that_bounces_keeps_its_energy(method, kind, tolerance):
    """In free flight steps are long, and one may end in the floor that none of its stages has met."""
    ball = fd.rigid_body("ball", mass=1.0, inertia=(1, 1, 1), points={"o": (0, 0, 0)})
    dropped = fd.Scene(
        (fd.Body("ball", ball, position=(0, 0, 0.5)),),
        (fd.Joint("rail", "translational", "ground.O", "ball.o"),),
        ground={"O": (0, 0, 0)},
        gravity=(0, 0, -9.81),
        **_floor(kind),
    )
    method = method(fd.Tolerances(tolerance, position=tolerance, velocity=tolerance))
    found = fd.forward(dropped, end=3.0, output_step=0.01, method=method, check=False)
    height = found["ball.R"][:, 2]
    flying = found["energy.total"][height > 0.01]
    assert height.min() < -0.01
    assert np.abs(flying / flying[0] - 1).max() < max(1000 * tolerance, 1e-5)
