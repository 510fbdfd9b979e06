"""Energy without a source stops a run; energy with one does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ffr_gallery.bodies import bar, pendulum
from ffr_gallery.spin_up import scene as spinning
from synthetic import cloud

from ffr_dyn.analyses.energy import EnergyWatch
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import harmonic, polynomial, user
from ffr_dyn.integrators import RK4, ROS2, DormandPrince, HalfExplicit, Variational
from ffr_dyn.integrators.stabilisation import Baumgarte, Drifting
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator, JointStop, Load, Servo, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError

GROUND = {"O": (0, 0, 0), "P": (3, 0, 0), "Q": (1, 2, 0)}
PENDULUM = pendulum(bar("upper"), bar("lower"))
HINGED = Scene((Body("bar", bar("bar")),), (Joint("hinge", "revolute", "ground.O", "bar.a"),), ground=GROUND)
RUN = {"end": 2.0, "output_step": 0.02}


def clamped() -> tuple[Scene, float]:
    """A flexible body that a joint makes stiffer, and the fastest frequency of it alone."""
    model = cloud(12, points=6, stiffness=150.0)
    joint = Joint("clamp", "fixed", "ground.O", "b.a")
    return Scene((Body("b", model, q_dot=np.ones(12)),), (joint,), ground=GROUND), float(np.sqrt(model.omega2.max()))


# ---- without a source ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "rows"), [(RK4, 1), (RK4, 4), (HalfExplicit, 1)])
def test_an_explicit_step_beyond_the_assembled_limit_stops_and_tells_the_limit(kind, rows):
    scene, omega = clamped()
    h = 0.97 * kind.reach / omega
    words = (
        rf"energy has grown.*body 'b'.*beyond the stability of {kind.__name__}.*needs one below .* s; use that, or ROS2"
    )
    with pytest.raises(ComputationError, match=words):
        integrate(scene, end=2000 * h, output_step=rows * h, method=kind(h))


def test_too_large_gains_stop_and_tell_what_gains_would_do():
    with pytest.raises(
        ComputationError, match=r"Baumgarte's gains of 600 1/s are too large for a step of 0\.005 s.*200 1/s"
    ):
        integrate(PENDULUM, method=RK4(5e-3), stabilisation=Baumgarte(600.0, 600.0), **RUN)


def test_a_stiff_spring_beyond_the_step_stops_and_tells_its_rate():
    spring = SpringDamper("spring", "ground.Q", "bar.b", stiffness=1e6, free_length=2.0)
    with pytest.raises(
        ComputationError,
        match=r"energy has grown.*'bar'.*'spring' is too stiff.*1732 1/s.*below 0\.0016 s; use that, or ROS2$",
    ):
        integrate(replace(HINGED, springs=(spring,), gravity=(0, -9.81, 0)), method=RK4(5e-3), **RUN)
    integrate(replace(HINGED, springs=(spring,), gravity=(0, -9.81, 0)), method=ROS2(5e-3), **RUN)


def test_an_implicit_method_that_loses_the_motion_stops():
    """Rotation by a turn in three steps, on hinges without stabilisation."""
    spun = replace(
        PENDULUM, bodies=tuple(replace(b, omega_bar=(0, 0, 400.0)) for b in PENDULUM.bodies), gravity=(0, 0, 0)
    )
    with pytest.raises(ComputationError, match=r"energy has grown.*(ROS2|too long)"):
        integrate(spun, method=ROS2(5e-3), stabilisation=Drifting(), **RUN)


def test_a_beam_that_diverges_without_stiffening_stops():
    """At 1.4 times its first frequency: its motor puts the energy in, as linear theory has it."""
    spun = spinning(polynomial(0.0, 5.4), stiffened=False, q=1e-6)
    with pytest.raises(
        ComputationError, match=r"'beam' has turned within itself by .* spins without geometric stiffening"
    ):
        integrate(spun, end=60.0, output_step=1.0, method=ROS2(5e-3))


# ---- with one -----------------------------------------------------------------------------------------------------------


def whipped(t, state):
    """A negative damper."""
    return 3.0 * state.omega_bar("bar")[2]


def kick(t):
    """90 N s within 3 ms, which no row sees."""
    return 3e4 if 0.1234 <= t < 0.1264 else 0.0


def shaken(t):
    """Angle, rate and acceleration; the rate is zero at every row."""
    w = 100 * np.pi
    return 5 * (1 - np.cos(w * t)), 5 * w * np.sin(w * t), 5 * w**2 * np.cos(w * t)


HEALTHY = {
    "falls from rest": (PENDULUM, RK4(1e-3)),
    "is kicked between two rows": (replace(HINGED, loads=(Load("kick", "bar.b", force=(0, user(kick), 0)),)), RK4(1e-4)),
    "is driven while no row looks": (replace(HINGED, drivers=(Driver("motor", "hinge", user(shaken)),)), RK4(1e-4)),
    "is thrown by a negative damper": (
        replace(
            HINGED,
            bodies=(replace(HINGED.bodies[0], omega_bar=(0, 0, 1e-3)),),
            forces=(Actuator("whip", "hinge", function=whipped),),
        ),
        ROS2(1e-3),
    ),
    "swings on a shaken base": (
        replace(PENDULUM, gravity=(0, 0, 0), base_acceleration=(harmonic(amplitude=300.0, frequency=31.0), 0, 0)),
        ROS2(1e-3),
    ),
    "is stopped": (
        replace(HINGED, gravity=(0, -9.81, 0), forces=(JointStop("stop", "hinge", 1e5, 1e-3, lower=-1.0),)),
        RK4(1e-4),
    ),
    "is turned by a stiff servo": (replace(HINGED, forces=(Servo("servo", "hinge", 1.0, 1e4, 10.0),)), RK4(1e-3)),
    "is thrown by a spring": (
        replace(HINGED, springs=(SpringDamper("spring", "ground.P", "bar.b", stiffness=1e4, free_length=4.0),)),
        DormandPrince(),
    ),
    "turns for long": (replace(PENDULUM, plane="z"), Variational(1e-3)),
}  # fmt: skip


@pytest.mark.parametrize("what", HEALTHY)
def test_what_has_a_source_goes_on(what):
    scene, method = HEALTHY[what]
    result = integrate(scene, method=method, **RUN)
    assert result.time[-1] == pytest.approx(2.0)


@pytest.mark.slow
def test_what_rows_do_not_explain_is_looked_into(monkeypatch):
    """Without which such runs would show nothing."""
    looked: list[float] = []
    look = EnergyWatch._looked_into
    monkeypatch.setattr(EnergyWatch, "_looked_into", lambda self, row: (looked.append(row.time), look(self, row))[1])
    scene, method = HEALTHY["is kicked between two rows"]
    integrate(scene, method=method, **RUN)
    assert looked


def test_a_step_that_rk4_bears_is_not_stopped():
    scene, omega = clamped()
    h = 0.3 * RK4.reach / omega
    result = integrate(scene, end=2000 * h, output_step=h, method=RK4(h))
    energy = result["energy.total"]
    assert energy.max() < 1.01 * energy[0]


@pytest.mark.parametrize("method", [RK4(1e-3), DormandPrince()], ids=repr)
def test_power_that_rows_catch_in_the_same_phase_is_no_doubt_of_the_steps(method):
    """A force that is zero at all rows and does its work between them."""
    push = Load("push", "ball.c", force=(formula("5 * (1 - cos(200 * pi * t))"), 0, 0))
    ball = rigid_body("ball", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = Scene((Body("ball", ball),), loads=(push,))
    result = integrate(scene, end=0.5, output_step=0.01, method=method)
    assert result["energy.kinetic"][-1] == pytest.approx((5.0 * 0.5) ** 2 / 4.0, rel=1e-3)
    assert not [note for note in result.attributes["notes"] if "energy" in note]
