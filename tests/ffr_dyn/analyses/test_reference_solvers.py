"""The equations through solvers of SciPy and SUNDIALS agree with our own integration."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from planar_beam import planar_beam
from synthetic import cloud
from test_analyses_references import END, andrews

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.reference import IDA, SciPy, reference
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError

GRAVITY = (0.0, -9.81, 0.0)
METHODS = {
    "DOP853": (SciPy("DOP853", 1e-11, 1e-12), 1e-9),
    "Radau": (SciPy("Radau", 1e-8, 1e-10), 1e-8),
    "LSODA": (SciPy("LSODA", 1e-10, 1e-11), 1e-8),
    "IDA": (IDA(1e-8, 1e-10), 5e-7),
}


def bar(name: str, **place) -> Body:
    ends = {"a": (0, 0, 0), "b": (1, 0, 0)}
    model = rigid_body(name, mass=1.0, inertia=(0.01, 0.1, 0.1), centre_of_mass=(0.5, 0, 0), points=ends)
    return Body(name, model, **place)


def double_pendulum() -> Scene:
    """Two bars, released from the horizontal."""
    joints = (Joint("A", "revolute", "ground.O", "one.a"), Joint("B", "revolute", "one.b", "two.a"))
    return Scene((bar("one"), bar("two", position=(1, 0, 0))), joints, ground={"O": (0, 0, 0)}, gravity=GRAVITY)


def flexible_arm() -> Scene:
    """A flexible body that swings and turns in space on a ball joint."""
    model = cloud(3)
    arm, hinge = Body("two", model, omega_bar=(0.5, 0, 2), damping=0.05), model.interfaces[0].position
    return Scene((arm,), (Joint("hinge", "spherical", "ground.O", "two.a"),), ground={"O": hinge}, gravity=GRAVITY)


def flexible_pendulum() -> Scene:
    """A slender planar beam, hinged at its root and released from the horizontal."""
    beam = planar_beam("rod", 1.2, 11.9664, 850.5, 2)
    return Scene((Body("rod", beam),), (Joint("hinge", "revolute", "ground.O", "rod.root"),), ground={"O": (0, 0, 0)},
                 gravity=GRAVITY)  # fmt: skip


@pytest.mark.parametrize(("method", "apart"), METHODS.values(), ids=METHODS)
@pytest.mark.parametrize(
    ("scene", "tip"),
    [
        (double_pendulum(), "two.b.position"),
        (flexible_arm(), "two.b.position"),
        (flexible_pendulum(), "rod.tip.position"),
    ],
    ids=["double pendulum", "flexible arm", "flexible pendulum"],
)
def test_other_solvers_find_the_same_motion(scene, tip, method, apart):
    end = 0.1 if tip.startswith("rod") else 0.25
    ours = integrate(scene, end=end, output_step=0.05, method=RK4(1e-4), stabilisation=Projection(1e-13))
    theirs = reference(scene, end=end, output_step=0.05, method=method)
    np.testing.assert_allclose(theirs[tip], ours[tip], rtol=0, atol=apart)
    assert theirs["constraint.position"].max() < 1e-11
    assert theirs["constraint.velocity"].max() < 1e-11
    assert set(theirs.quantities) == set(ours.quantities)
    assert theirs.attributes["evaluations"] > 0


@pytest.mark.parametrize("method", [SciPy(), IDA()], ids=["DOP853", "IDA"])
def test_drivers_redundant_rows_and_reactions(method):
    """A door on two hinges that a driver opens: moment and reactions equal those of our own run."""
    door = rigid_body("door", mass=3.0, inertia=(1, 1, 1), centre_of_mass=(0.5, 0, 0.5),
                      points={"low": (0, 0, 0), "high": (0, 0, 1)})  # fmt: skip
    scene = Scene(
        (Body("door", door),),
        (Joint("low", "revolute", "ground.low", "door.low"), Joint("high", "revolute", "ground.high", "door.high")),
        (Driver("motor", "low", polynomial(0, 0, 2, 1)),),
        loads=(Load("wind", "door.high", force=(0, 5, 0)),),
        ground={"low": (0, 0, 0), "high": (0, 0, 1)},
        gravity=(0, 0, -9.81),
        plane="none",
    )
    ours = integrate(scene, end=0.4, output_step=0.1, method=RK4(1e-3), stabilisation=Projection(1e-13))
    theirs = reference(scene, end=0.4, output_step=0.1, method=method)
    for name in ("low.force", "high.moment", "motor.moment", "low.angle"):
        np.testing.assert_allclose(theirs[name], ours[name], atol=2e-6, err_msg=name)


def test_the_result_is_written(tmp_path):
    times: list[float] = []
    made = reference(double_pendulum(), end=0.1, output_step=0.05, path=tmp_path / "r.nc", progress=times.append)
    read = load_result(tmp_path / "r.nc")
    np.testing.assert_array_equal(read["two.b.position"], made["two.b.position"])
    assert read.attributes["method"] == "SciPy(solver='DOP853', rtol=1e-10, atol=1e-12)"
    assert times == [0.0, 0.05, 0.1]


def test_mistakes_are_named(monkeypatch):
    with pytest.raises(InputError, match="no solver 'Euler'"):
        SciPy("Euler")
    with pytest.raises(InputError, match="rtol is 1e-15"):
        IDA(1e-15)
    with pytest.raises(InputError, match="atol 0;"):
        SciPy(atol=0.0)
    with pytest.raises(InputError, match="multiple of the output step"):
        reference(double_pendulum(), end=0.1, output_step=0.03)
    loaded = replace(double_pendulum(), loads=(Load("push", "two.b", force=(1, 0, 0)),))
    with pytest.raises(InputError, match="work adds up"):
        reference(loaded, end=0.1, output_step=0.05, outputs=("push.work",))
    monkeypatch.setitem(sys.modules, "sksundae.ida", None)
    with pytest.raises(InputError, match=r"pip install ffr\[ida\]"):
        reference(double_pendulum(), end=0.1, output_step=0.05, method=IDA())


@pytest.mark.parametrize("method", [SciPy(), SciPy("Radau"), IDA()], ids=["DOP853", "Radau", "IDA"])
def test_a_failed_run_says_so(method):
    """A force that has no value from 0.02 s on."""
    scene = replace(double_pendulum(), loads=(Load("push", "two.b", function=lambda t, state: _none_after(t)),))
    with pytest.raises(ComputationError, match=r"t = 0\.0|the run stopped in a Python function"):
        reference(scene, end=0.1, output_step=0.05, method=method)


def _none_after(t: float) -> tuple[float, float, float]:
    if t > 0.02:
        raise ValueError("no force")
    return 0.0, 0.0, 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "apart"),
    [(SciPy("DOP853", 1e-12, 1e-13), 1e-8), (SciPy("Radau", 1e-9, 1e-10), 1e-6), (IDA(1e-9, 1e-10), 1e-4)],
    ids=["DOP853", "Radau", "IDA"],
)
def test_andrews(method, apart):
    """Seven angles of Andrews' squeezing mechanism at 0.03 s (IVP Test Set)."""
    result = reference(andrews(), end=0.03, output_step=1e-3, method=method)
    for name, expected in END.items():
        assert abs(result[f"{name}.angle"][-1] - expected) < apart, name


PULSES = {
    "smooth": (formula("1e4 * exp(-((t - 0.0533) / 1e-5)**2)"), 0.1 * np.sqrt(np.pi)),
    "box": (formula("100 * step(t - 0.0533) - 100 * step(t - 0.0534)"), 1e-2),
    "python": (lambda t: 100.0 if 0.0533 <= t < 0.0534 else 0.0, 1e-2),
}


@pytest.mark.parametrize(
    ("method", "pulse"),
    [
        *(("DOP853", one) for one in PULSES),
        *(("LSODA", one) for one in PULSES),
        ("IDA", "box"),
        pytest.param("IDA", "smooth", marks=pytest.mark.slow),
    ],
)
def test_a_pulse_between_two_steps_of_a_solver_is_seen(method, pulse):
    """By its impulse; the solvers stepped over it, and the body was left at rest."""
    function, impulse = PULSES[pulse]
    rail = Joint("rail", "translational", "ground.O", "one.a", axis=(1, 0, 0))
    push = Load("push", "one.a", force=(function, 0, 0))
    scene = Scene((bar("one"),), (rail,), loads=(push,), ground={"O": (0, 0, 0)})
    found = reference(scene, end=0.2, output_step=0.02, method=METHODS[method][0])
    assert found["one.v"][-1, 0] == pytest.approx(impulse, rel=2e-7)


@pytest.mark.parametrize("method", ["DOP853", pytest.param("IDA", marks=pytest.mark.slow)])
def test_a_driver_whose_rate_jumps_is_told_and_jumps_where_it_does(method):
    """What hangs on it swings as with a row there; it went on at the old rate until the next row."""
    rail = Joint("rail", "translational", "ground.O", "one.a", axis=(1, 0, 0))
    hinge = Joint("hinge", "revolute", "one.b", "two.a")
    driver = Driver("cam", "rail", formula("max(0, t - 0.05)"), coordinate="stroke")
    hung = bar("two", position=(1, 0, 0), rotation=(0, 0, -np.pi / 2))
    scene = Scene((bar("one"), hung), (rail, hinge), drivers=(driver,), ground={"O": (0, 0, 0)}, gravity=GRAVITY)
    between, at = (reference(scene, end=0.2, output_step=h, method=METHODS[method][0]) for h in (0.04, 0.05))
    np.testing.assert_allclose(between["two.b.velocity"][-1], at["two.b.velocity"][-1], rtol=0, atol=1e-5)
    (note,) = (note for note in between.attributes["notes"] if "at once" in note)
    assert "driver 'cam' changes its rate by 1 m/s at once at t = 0.05 s" in note
