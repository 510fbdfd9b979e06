"""Every message's remedy works: a scene that raises it, and the same mended as the text says, which runs.

The texts are found in the sources: all that `ffr_dyn` raises, and what some functions say as a part of it. `CASES` cover
them all, those of other folders than the analyses by the tables of tests/ffr_dyn/remedies.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from unittest.mock import patch

import analysis_cases
import command_cases
import cost_cases
import numpy as np
import pytest
import result_cases
import scene_cases
import study_cases
from ffr_gallery.bodies import bar
from remedy import CLOUD, DOUBLE, DRIVEN, GROUND, HINGED, TURNING, run
from said import Case, numbered, texts_of
from synthetic import cloud
from test_analyses_inverse import flexible_arm
from test_analyses_kinematic import slider_crank
from test_analyses_mixed import MOTOR, TIP, bounded, cart_with_rod, mixed, one_link, rest_to_rest
from test_analyses_static import hanging
from test_independence import locomotive

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.assemble import assembly
from ffr_dyn.analyses.efforts import recorded
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.inverse import Dynamic, QuasiStatic, inverse
from ffr_dyn.analyses.inversion.bounded import Bounded
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.mixed import Causal, Mixed
from ffr_dyn.analyses.outcome import output_times
from ffr_dyn.analyses.reference import SciPy
from ffr_dyn.analyses.reference import reference as by_solver
from ffr_dyn.analyses.registry import analysis
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.validity import in_enough_parts, parts_needed
from ffr_dyn.economy.adaptive import Adaptation
from ffr_dyn.economy.outputs import Output
from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.operations import SQRT
from ffr_dyn.functions.time_functions import as_time_function, harmonic, operation, polynomial, signal, table
from ffr_dyn.integrators import (
    HHT,
    RK4,
    ROS2,
    DormandPrince,
    GeneralisedAlpha,
    HalfExplicit,
    Within,
    method_named,
    stepped,
    tolerances,
)
from ffr_dyn.integrators.stabilisation import Baumgarte, Drifting, Projection
from ffr_dyn.linear.continuation import Problem, branch
from ffr_dyn.linear.turn_map import placed, turns
from ffr_dyn.pictures.scene_view import open_window, scene_view
from ffr_dyn.realtime.stepper import Stepper
from ffr_dyn.results.file import load_result
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces import (
    Actuator,
    Bushing,
    JointFriction,
    JointSpring,
    JointStop,
    Load,
    ModalForce,
    NodalForces,
    Servo,
    SpringDamper,
)
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene, marker_number
from ffr_dyn.scene.sensors import Measurement, SectionMeasurement
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.material import Material
from ffr_prep.structures.frame import Member, polyline
from ffr_prep.structures.frame import named as named_frame
from ffr_prep.structures.sections import rectangle

# What is a part of a message, or one made elsewhere.
PARTS = {
    "results/file.py": ("_damaged",),
    "analyses/energy.py": ("_told", "_cause"),
    "analyses/inversion/internal_dynamics.py": ("_unfit",),
    "functions/told_rates.py": ("misled",),
    "consistency/explicit_forces.py": ("told",),
    "consistency/failure.py": ("_locks", "_overflow", "_unconverged"),
    "consistency/validity.py": ("meaningless",),
    "integrators/stabilisation.py": ("excess_of_gains",),
    "scene_file/assignments.py": ("unknown",),
}

# ---- scenes -------------------------------------------------------------------------------------------------------------

EVENLY = replace(HINGED, drivers=(Driver("d", "hinge", fd.polynomial(0.0, 5.0)),))
DRAGGED = replace(TURNING, forces=(fd.JointSpring("drag", "hinge", damping=1.0),))
CRANKED = slider_crank(0.2, 0.7, Driver("motor", "main", fd.polynomial(0.3, 5.0)))
SWAYING = replace(
    HINGED,
    forces=(fd.JointSpring("s", "hinge", stiffness=100.0, damping=5.0),),
    loads=(Load("sway", "bar.b", force=(0, harmonic(amplitude=1.0, frequency=1.3), 0)),),
)


def swung(damping: float, moment: float = 1.0, angle: float = 0.0) -> Scene:
    """A bar on a spring, swung with its natural frequency, drawn at an angle."""
    spring = fd.JointSpring("s", "hinge", stiffness=(2 * np.pi * 1.3) ** 2 / 3, damping=damping)
    load = Load("l", "bar.b", moment=(0, 0, harmonic(amplitude=moment, frequency=1.3)))
    bodies = (replace(HINGED.bodies[0], rotation=(0, 0, angle)),)
    return replace(HINGED, bodies=bodies, forces=(spring,), loads=(load,))


SPRUNG = replace(HINGED, forces=(fd.JointSpring("s", "hinge", stiffness=100.0, damping=5.0),))
IDLE = replace(
    SPRUNG,
    loads=(
        Load("none", "bar.b"),
        Load("looking", "bar.b", function=lambda t, state: (0.0, 0.0, 0.0)),
    ),
)
SHAKEN = replace(
    DOUBLE,
    gravity=(0, 0, 0),
    drivers=(Driver("d", DOUBLE.joints[0].name, 0.0),),
    forces=(fd.JointSpring("s", DOUBLE.joints[1].name, stiffness=100.0, damping=5.0),),
)


def spun(speed: float) -> Scene:
    """A bar that nothing drives, on its hinge."""
    return replace(HINGED, gravity=(0, 0, 0), bodies=(replace(HINGED.bodies[0], omega_bar=(0, 0, speed)),))


def deviated(share: float) -> object:
    """The state of a double pendulum at a share of the scene's size from where it hangs."""
    at = assemble(DOUBLE)
    of = turns(at.system, 0.0, at.x, at.v, ROS2(0.01), 1.0)
    return placed(of, share * of.scale)


def swayed(scene: Scene = SPRUNG, **how: object) -> object:
    """Forced vibrations about the resonance."""
    usual = {
        "input": "hinge.moment",
        "amplitude": 0.1,
        "outputs": ["bar.b.position.y"],
        "band_of": (1.0, 1.01),
        "steps": 80,
    }
    if scene is SHAKEN:
        usual["outputs"] = ["lower.b.position.y"]
    return fd.forced(scene, **{**usual, **how})


_HALF = np.random.default_rng(0).normal(size=(8, 8))
_HEAVY = replace(cloud(8, stiffness=100.0), damping=2e4 * _HALF @ _HALF.T)
LOSSY = replace(CLOUD, bodies=(Body("cloud", _HEAVY, q=np.full(8, 1e-3)),))


def followed(slope: float, end: float = 1.0) -> object:
    """The branch u = 1 + sin(slope p)."""

    def left(u: np.ndarray, p: float) -> np.ndarray:
        return u - 1 - np.sin(slope * p)

    def derivative(u: np.ndarray, p: float, G: np.ndarray) -> np.ndarray:
        return np.array([[1.0, -slope * np.cos(slope * p)]])

    return list(branch(Problem(left, derivative, (0.0, end), 0.05, str), np.ones(1)))


def torn(end: float) -> object:
    """The branch u = 1 + p, which ends at p = 1/2, to where it is asked for."""

    def left(u: np.ndarray, p: float) -> np.ndarray:
        return u - 1 - p + (10.0 if p > 0.5 else 0.0) * (1.0 + u**2)

    def derivative(u: np.ndarray, p: float, G: np.ndarray) -> np.ndarray:
        return np.array([[1.0, -1.0]])

    return list(branch(Problem(left, derivative, (0.0, end), 0.05, str), np.ones(1)))


def struck(damping: float) -> Scene:
    """A bar between two stops, swung so that it strikes them again and again, at random where little damps it."""
    spring = fd.JointSpring("s", "hinge", stiffness=3.0, damping=damping)
    stop = fd.JointStop("stop", "hinge", stiffness=2e4, entry=1e-3, lower=-0.1, upper=0.12)
    moment = Load("l", "bar.b", moment=(0, 0, harmonic(amplitude=80.0 if damping < 1 else 6.0, frequency=1.3)))
    return replace(HINGED, forces=(spring, stop), loads=(moment,))


def on_springs(stiff: bool) -> Scene:
    """A rotor that turns in a housing on springs, in a joint or in a stiff bushing."""
    housing = fd.rigid_body("housing", mass=5.0, inertia=(1, 1, 1), points={"o": (0, 0, 0)})
    rotor = fd.rigid_body("rotor", mass=1.0, inertia=(0.1, 0.1, 0.2), points={"o": (0, 0, 0)})
    springs = fd.Bushing("springs", "ground.O", "housing.o", np.diag([1e4, 1e4, 1e7, 1e7, 1e7, 1e7]))
    bearing = fd.Bushing("bearing", "housing.o", "rotor.o", np.diag([1e7, 1e7, 1e7, 1e6, 1e6, 0.0]))
    joint = Joint("mast", "revolute", "housing.o", "rotor.o")
    return Scene(
        (Body("housing", housing), Body("rotor", rotor, omega_bar=(0, 0, 5.0))),
        () if stiff else (joint,),
        () if stiff else (Driver("motor", "mast", fd.polynomial(0.0, 5.0)),),
        forces=(springs, bearing) if stiff else (springs,),
        ground=GROUND,
    )


def governor(moment: float) -> Scene:
    """An arm that an axle of constant speed lifts, against a moment [N m]."""
    return Scene(
        (Body("axle", bar("axle")), Body("arm", bar("arm"), position=(1, 0, 0))),
        (
            Joint("turn", "revolute", "ground.O", "axle.a"),
            Joint("lift", "revolute", "axle.b", "arm.a", axis=(0, 1, 0)),
        ),
        (Driver("motor", "turn", fd.polynomial(0.0, 5.0)),),
        loads=(Load("push", "arm.b", moment=(0, moment, 0), axes="body"),),
        ground=GROUND,
    )


TWICE_DRIVEN = replace(
    DOUBLE,
    gravity=(0, 0, 0),
    drivers=(Driver("first", "hinge0", fd.polynomial(0.0, 5.0)), Driver("second", "hinge1", 0.0)),
)
MOMENT = fd.MomentSettings()
FAR = SpringDamper("spring", "ground.P", "cloud.b", stiffness=1e14, free_length=2.0)
FAST = Scene((Body("b", cloud(3, stiffness=1e4)),))


TURNED_OVER = formula("9.81 * (1 - 2 * smooth(t / 0.3))")
LONG, TIP_RUN = Bounded(before=0.5, after=0.5), {"end": 0.6, "output_step": 0.05}
SPUN = replace(DOUBLE, bodies=tuple(replace(b, omega_bar=(0, 0, 400.0)) for b in DOUBLE.bodies), gravity=(0, 0, 0))


def tumbling(spin: float) -> Scene:
    return Scene((Body("bar", bar("bar"), omega_bar=(0.3 * spin, spin, 0)),), plane="none")


def saved(name: str, make: Callable[..., object], end: float = 0.1, **more: object) -> object:
    """A result that `make` writes to a file, and a run that resumes it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        make(DRIVEN, end=0.1, output_step=0.01, path=path)
        return run(DRIVEN, end=end, resume=path, **more)


def written(function: Callable[..., object], thing: object, name: str, *more: object) -> object:
    """What `function` writes of a thing to a file of that name."""
    with TemporaryDirectory() as folder:
        return function(thing, Path(folder) / name, *more)


def window() -> object:
    """A window on a machine that has none."""
    with patch.dict(os.environ):
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):
            os.environ.pop(name, None)
        return open_window(scene_view(HINGED))


def tabled(library: object) -> object:
    """A result as a table of pandas, which is installed or not (None)."""
    with patch.dict(sys.modules, {"pandas": library}):
        return Result([0.0], {}).to_pandas()


def as_frame(columns: object, index: object) -> SimpleNamespace:
    return SimpleNamespace(attrs={})


PANDAS = SimpleNamespace(Index=lambda values, name: values, DataFrame=as_frame)


def loaded(name: str) -> Result:
    with TemporaryDirectory() as folder:
        run(HINGED, path=Path(folder) / "run.nc")
        return load_result(Path(folder) / name)


def pushed(size: float) -> Scene:
    return replace(HINGED, loads=(Load("push", "bar.b", force=(0, size, 0)),))


def shaken(frequency: float, step: float = 1e-2) -> Result:
    shake = Load("shake", "bar.b", force=(0, formula(f"sin(2 * pi * {frequency} * t)"), 0))
    end = 100 * step
    return forward(replace(HINGED, loads=(shake,)), end=end, output_step=step, method=ROS2(step), check=False)


def felt(function: Callable) -> Scene:
    return replace(HINGED, loads=(Load("gust", "bar.b", function=function),))


def rubbing(damping: float) -> Scene:
    """A damper by a Python function."""
    own = Actuator("own", "hinge", function=lambda t, state: -damping * state.omega_bar("bar")[2])
    return replace(TURNING, forces=(own,))


def defined_at_one_point(beside: float) -> Scene:
    """A force by a Python function that is zero where the scene turns."""
    at = fd.steady(TURNING)["bar.a.position"][0]
    own = Load("own", "bar.a", function=lambda t, s: (0.0 if (s.position("bar.a") == at).all() else beside, 0, 0))
    return replace(TURNING, loads=(own,))


def clamped() -> tuple[Scene, float]:
    model = cloud(12, points=6, stiffness=150.0)
    joint = Joint("clamp", "fixed", "ground.O", "b.a")
    return Scene((Body("b", model, q_dot=np.ones(12)),), (joint,), ground=GROUND), float(np.sqrt(model.omega2.max()))


def heavy(share: float) -> Scene:
    """A body whose only mode moves all of its mass along x, but for a share."""
    model = cloud(1)
    P_dm = np.array([[np.sqrt(model.mass * (1 - share))], [0.0], [0.0]])
    rP_dm = model.r_dm[:, None, None] * P_dm / model.mass
    return Scene((Body("body", replace(model, P_dm=P_dm, rP_dm=rP_dm)),), plane="none")


def shrinking(q: float) -> Scene:
    """A body whose moments of inertia fall with its elastic coordinate, beyond what a mass can do."""
    model = cloud(1)
    model = replace(model, rP_dm=model.rP_dm + 10.0 * np.eye(3)[:, :, None])
    return Scene((Body("body", model, q=(q,)),), plane="none")


def flat(plane: str) -> Scene:
    """A planar model in a scene of a plane or in space."""
    return replace(HINGED, bodies=(Body("bar", replace(bar("bar"), provenance={"plane": "z"})),), plane=plane)


def locking(speed: float, end: float) -> Callable[..., Result]:
    """The slider is pushed towards its outer dead point r + l = 0.9, 0.1 m away."""
    start = 0.2 * np.cos(0.3) + np.sqrt(0.49 - (0.2 * np.sin(0.3)) ** 2)
    scene = slider_crank(0.2, 0.7, Driver("push", "guide", polynomial(start, speed), coordinate="stroke"))
    return partial(run, scene, end=end, output_step=0.01)


def bent(turn: float) -> Scene:
    model = cloud(2)
    q = turn / np.abs(model.interfaces[0].phi_r).max()
    return Scene((Body("bent", model, q=(q, q)),), ground=GROUND)


def held_in_a_row(angle: float) -> Scene:
    """Two parallel cranks, held at an angle: in a row where it is zero."""
    return replace(locomotive(2, angle), drivers=(Driver("hold", "foot0", polynomial(angle)),))


def wrung(turn: float) -> Scene:
    """A strip in four parts, on edge, under an end moment that would bend it by so much [rad] if it were lying."""
    ends = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}
    member = Member(rectangle(0.02, 0.002), Material("steel", 2.1e11, 0.3, 7850.0), (0, 1, 0))
    frame = named_frame(polyline(list(ends.values()), member, elements=8), **ends)
    model = fp.from_frame(frame, [fp.InterfaceRegion(end) for end in ends])
    body = fp.reduce(model, fp.Request(name="strip", reference=fp.MeanAxis(), reduction=fp.CraigBampton(1), parts=4))
    moment = Load("moment", "strip.b", moment=(0, 2.1e11 * 0.02 * 0.002**3 / 12 * turn, 0))
    return Scene(
        (Body("strip", body),), (Joint("root", "fixed", "ground.O", "strip.a"),), loads=(moment,), ground=GROUND
    )


# Two parallel cranks, in a row at the start and after every half of a second.
TURNED = replace(locomotive(2, 0.0, 2 * np.pi), drivers=(Driver("turn", "foot0", polynomial(0.0, 2 * np.pi)),))


def jumping() -> Scene:
    up = np.sign(flexible_arm().bodies[1].model.interface("b").phi_t[0, 0])

    def law(t: float, state: object) -> tuple[float, float, float]:
        return up * (1e4 if state.q("b")[:1].sum() < 0.01 else -1e4), 0, 0

    return replace(flexible_arm(), loads=(Load("jump", "b.b", axes="body", function=law),))


def pole(end: float) -> Result:
    load = Load("pole", "bar.b", (0.0, lambda t: 1.0 / (0.31 - t) ** 3 if t != 0.31 else 1e300, 0.0))
    return run(replace(HINGED, loads=(load,)), DormandPrince(), end, 0.02)


def tip(far: float, solution: object) -> Result:
    led = replace(TIP, y=rest_to_rest(far, 0.6))
    return mixed(one_link(led), unknown=(MOTOR,), end=0.6, output_step=0.05, solution=solution)


def hanging_rod(height: float, output_step: float, *loads: Load) -> Result:
    return bounded(cart_with_rod(height, -np.pi / 2, *loads, gravity=(0, -9.81, 0)), output_step)


def twist(moment: float) -> Load:
    return Load("twist", "rod.o", moment=(0, 0, moment))


def named(name: str) -> Quantity:
    return run(HINGED, end=0.01).quantity(name)


def in_bearings(*kinds: str) -> object:
    """A bar whose second bearing is a tenth of a millimetre off the line of the first."""
    joints = [
        Joint(end, kind, f"ground.{end}", f"bar.{end}", axis=(1, 0, 0)) for end, kind in zip("ab", kinds, strict=True)
    ]
    return assemble(replace(HINGED, joints=joints, ground={"a": (0, 0, 0), "b": (1, 0, 1e-4)}))


def stepper(**more: object) -> Stepper:
    load = Load("push", "bar.b", force=(signal("push", 0.0), 0, 0))
    return Stepper(replace(HINGED, loads=(load,)), **{"method": ROS2(1e-3), **more})


def gone_on(restored: bool) -> None:
    """A step after one that failed."""
    ends = Load("ends", "bar.b", function=lambda t, state: (np.nan if t > 0.01 else 0.0, 0, 0))
    found = Stepper(replace(HINGED, loads=(ends,)), ROS2(1e-3))
    kept = found.save()
    with suppress(ComputationError):
        found.step(20)
    if restored:
        found.restore(kept)
    found.step()


# ---- the cases ------------------------------------------------------------------------------------------------------------


p = partial
RUNS = [
    Case(lambda: run(felt(lambda t, state: 1 / 0)), p(run, felt(lambda t, state: (0, 0, 0)))),
    Case(lambda: run(felt(lambda t, state: (1.0, 2.0))), p(run, felt(lambda t, state: (1.0, 2.0, 0.0)))),
    Case(lambda: run(felt(lambda t, state: (np.nan, 0, 0))), p(run, felt(lambda t, state: (1.0, 2.0, 0.0)))),
    Case(
        lambda: run(DOUBLE, stabilisation=Baumgarte(1e5, 1e5), output_step=0.05),
        p(run, DOUBLE, stabilisation=Baumgarte(900.0, 900.0), output_step=0.05),
    ),
    Case(lambda: run(pushed(1e300)), p(run, pushed(1.0))),
    Case(p(shaken, 1e7), p(shaken, 10.0)),
    Case(p(shaken, 4e4), p(shaken, 4e4, 1e-6)),
    Case(
        lambda: run(replace(HINGED, loads=(Load("push", "bar.b", force=(0, formula("sqrt(t - 1)"), 0)),))),
        p(run, replace(HINGED, loads=(Load("push", "bar.b", force=(0, formula("sqrt(t + 1)"), 0)),))),
    ),
    Case(
        lambda: run(replace(CLOUD, springs=(FAR,)), RK4(1e-3)),
        p(run, replace(CLOUD, springs=(FAR,)), RK4(1e-8), 1e-7, 1e-8),
    ),
    Case(lambda: run(rubbing(1e4), ROS2(1e-2), 5.0, 5.0), p(run, rubbing(1e4), ROS2(5e-5), 0.01, 0.01)),
    Case(lambda: assembly(heavy(0.0)), p(assembly, heavy(0.1))),
    Case(lambda: run(shrinking(-0.2)), p(run, shrinking(0.0))),
    Case(lambda: assembly(flat("none")), p(assembly, flat("z"))),
    Case(lambda: run(replace(CLOUD, springs=(FAR,))), p(run, replace(CLOUD, springs=(FAR,)), ROS2(1e-8), 1e-7, 1e-8)),
    Case(locking(0.1, 0.5), locking(0.1, 0.1)),
    Case(p(pole, 0.6), p(pole, 0.3)),
    Case(
        lambda: run(DOUBLE, RK4(5e-3), 2.0, 0.02, stabilisation=Baumgarte(600.0, 600.0)),
        p(run, DOUBLE, RK4(5e-3), 2.0, 0.02, stabilisation=Baumgarte(190.0, 190.0)),
    ),
    Case(lambda: run(rubbing(1e4), ROS2(1e-2), 1.0, 0.01), p(run, rubbing(1e4), ROS2(5e-5), 0.01, 0.01)),
    Case(
        lambda: run(clamped()[0], RK4(h := 0.97 * RK4.reach / clamped()[1]), 2000 * h, h),
        lambda: run(clamped()[0], RK4(h := 0.5 * RK4.reach / clamped()[1]), 2000 * h, h),
    ),
    Case(
        lambda: run(clamped()[0], RK4(h := 0.97 * RK4.reach / clamped()[1]), 2000 * h, h),
        lambda: run(clamped()[0], ROS2(h := 0.97 * RK4.reach / clamped()[1]), 2000 * h, h),
    ),
    Case(
        lambda: run(replace(CLOUD, loads=(Load("far", "cloud.b", moment=(0, 0, 1e9)),))),
        p(run, replace(CLOUD, loads=(Load("far", "cloud.b", moment=(0, 0, 1.0)),))),
    ),
    Case(
        lambda: static(hanging(0.0, Load("wind", "rod.b", (formula("1 / t"), 0, 0)))),
        p(static, hanging(0.0, Load("wind", "rod.b", (formula("1 / (1 + t)"), 0, 0)))),
    ),
    Case(
        lambda: kinematic(locking(0.1, 0.5).args[0], end=1.0, output_step=0.05),
        lambda: kinematic(locking(0.1, 0.5).args[0], end=0.1, output_step=0.05),
    ),
    Case(*(p(kinematic, held_in_a_row(angle), end=1.0, output_step=0.5) for angle in (0.0, 0.1))),
    Case(lambda: static(wrung(12.0)), lambda: static(wrung(2.0))),
    Case(p(run, TURNED, HalfExplicit(1e-3)), p(run, TURNED, RK4(1e-3))),
    Case(*(p(inverse, TURNED, start=t, end=t + 0.2, output_step=0.1, elastic=QuasiStatic()) for t in (0.0, 0.1))),
    Case(
        lambda: inverse(jumping(), end=0.05, output_step=0.05, elastic=QuasiStatic()),
        lambda: inverse(jumping(), end=0.05, output_step=0.05, elastic=Dynamic(ROS2(1e-4))),
    ),
    Case(lambda: tip(1.5, Bounded(before=0.1, after=0.1)), p(tip, 0.2, Bounded(before=0.5, after=0.5))),
    Case(lambda: tip(0.2, Causal()), p(tip, 0.2, Bounded(before=0.5, after=0.5))),
    Case(lambda: hanging_rod(0.1, 0.1, twist(6.0)), p(hanging_rod, 0.1, 0.1, twist(4.0))),
    Case(
        lambda: run(
            replace(HINGED, loads=(Load("push", "bar.b", force=(0, operation(SQRT, polynomial(0.01, -1.0)), 0)),))
        ),
        lambda: run(
            replace(HINGED, loads=(Load("push", "bar.b", force=(0, operation(SQRT, polynomial(0.01, 1.0)), 0)),))
        ),
    ),
    Case(
        lambda: run(tumbling(1e3), GeneralisedAlpha(1e-2)),
        lambda: run(tumbling(1e3), GeneralisedAlpha(1e-5), 1e-3, 1e-3),
    ),
    Case(lambda: locking(0.1, 0.5)(RK4(1e-3), stabilisation=Drifting()), lambda: locking(0.1, 0.1)(RK4(1e-3))),
    Case(
        lambda: run(replace(CLOUD, loads=(Load("far", "cloud.b", moment=(0, 0, 1e6)),)), end=1.0),
        lambda: run(replace(CLOUD, loads=(Load("far", "cloud.b", moment=(0, 0, 1.0)),)), end=1.0),
    ),
    Case(lambda: run(SPUN, ROS2(5e-3), 2.0, 0.02, stabilisation=Drifting()), lambda: run(SPUN, ROS2(1e-4), 0.02, 0.02)),
    Case(
        lambda: bounded(cart_with_rod(0.1, -np.pi / 2, base_acceleration=(0, TURNED_OVER, 0))),
        lambda: bounded(cart_with_rod(0.1, -np.pi / 2, base_acceleration=(0, 9.81, 0))),
    ),
    Case(
        lambda: mixed(one_link(replace(TIP, y=polynomial(0.0, 0.1))), unknown=(MOTOR,), solution=LONG, **TIP_RUN),
        lambda: mixed(one_link(replace(TIP, y=rest_to_rest(0.1, 0.6))), unknown=(MOTOR,), solution=LONG, **TIP_RUN),
    ),
    Case(  # in so many parts each deforms less
        lambda: in_enough_parts(lambda parts: bent(0.5), p(assembly, outputs=("*.q",))),
        lambda: in_enough_parts(lambda parts: bent(0.01), p(assembly, outputs=("*.q",))),
    ),
]

made = p(integrate, method=ROS2(1e-3))
TIE = Joint("tie", "distance", "ground.O", "bar.a", length=0.5)
JOINT = p(Joint, "j", "revolute", "ground.O", "bar.a")
HALF = {"end": 1.0, "output_step": 0.1}
INPUT = [
    Case(lambda: table((0.0, 1e-300, 1.0), (0.0, 1e10, 1.0)), p(table, (0.0, 1e-3, 1.0), (0.0, 1.0, 1.0))),
    Case(p(run, HINGED, "rk4"), p(run, HINGED, RK4(1e-3))),
    Case(p(run, HINGED, output_step=0.0), p(run, HINGED)),
    Case(p(run, HINGED, end=-1.0), p(run, HINGED)),
    Case(lambda: run(HINGED, ROS2(0.03), 1.0, 0.1), p(run, HINGED, ROS2(0.0333333333333333333), 1.0, 0.1)),
    Case(p(run, HINGED, end=0.105), p(run, HINGED)),
    Case(p(run, HINGED, stabilisation="projection"), p(run, HINGED, stabilisation=Projection())),
    Case(
        lambda: run(HINGED, GeneralisedAlpha(1e-3), stabilisation=Baumgarte(1.0, 1.0)),
        p(run, HINGED, GeneralisedAlpha(1e-3)),
    ),
    Case(lambda: run(FAST, RK4(1e-3)), p(run, FAST, ROS2(1e-3))),
    Case(lambda: run(HINGED, events=(Event("e", "hinge.angel"),)), p(run, HINGED, events=(Event("e", "hinge.angle"),))),
    Case(p(Event, "e", "hinge.angle", direction="up"), p(Event, "e", "hinge.angle", direction="rising")),
    Case(p(Event, "e", "hinge.angle", value=np.inf), p(Event, "e", "hinge.angle", value=1.0)),
    Case(p(fd.JointEffort, "e", "hinge", "turn"), p(fd.JointEffort, "e", "hinge", "angle")),
    Case(p(fd.MarkerEffort, "e", "bar.b", (0, 0, 0)), p(fd.MarkerEffort, "e", "bar.b", (1, 0, 0))),
    Case(
        p(fd.MarkerEffort, "e", "bar.b", (1, 0, 0), axes="x"), p(fd.MarkerEffort, "e", "bar.b", (1, 0, 0), axes="body")
    ),
    Case(p(output_times, 0.0, 1.0, 0.3), p(output_times, 0.0, 1.0, 0.25)),
    Case(lambda: by_solver(HINGED, method=SciPy(rtol=2.0), **HALF), p(by_solver, HINGED, method=SciPy(), **HALF)),
    Case(p(SciPy, "Euler"), p(SciPy, "Radau")),
    Case(p(analysis, "statics"), p(analysis, "static")),
    Case(p(linearise, DRIVEN), p(linearise, HINGED)),
    Case(p(linearise, HINGED, inputs=("push",)), p(linearise, pushed(1.0), inputs=("push",))),
    Case(
        p(linearise, pushed(0.0), inputs=("push",)),
        lambda: linearise(pushed(0.0), inputs=(fd.MarkerEffort("more", "bar.b", (1, 0, 0)),)),
    ),
    Case(
        lambda: linearise(felt(lambda t, s: (0, 0, 0)), inputs=("gust",)),
        p(linearise, HINGED, inputs=(fd.JointEffort("motor", "hinge"),)),
    ),
    Case(
        lambda: kinematic(replace(HINGED, drivers=(Driver("d", "hinge", lambda t: 2 * t),)), **HALF),
        lambda: kinematic(replace(HINGED, drivers=(Driver("d", "hinge", lambda t: (2 * t, 2, 0)),)), **HALF),
    ),
    Case(
        lambda: linearise(replace(HINGED, forces=(JointSpring("s", "hinge", 1.0),)), outputs=("s.work",)),
        p(linearise, replace(HINGED, forces=(JointSpring("s", "hinge", 1.0),)), outputs=("s.power",)),
    ),
    Case(p(static, HINGED), p(static, replace(HINGED, forces=(JointSpring("s", "hinge", 1.0),)))),
    Case(p(kinematic, HINGED, **HALF), p(kinematic, DRIVEN, **HALF)),
    Case(lambda: assemble(replace(DRIVEN, drivers=(*DRIVEN.drivers, Driver("e", "hinge", 0.0)))), p(assemble, DRIVEN)),
    Case(
        lambda: kinematic(replace(DRIVEN, drivers=(*DRIVEN.drivers, Driver("e", "hinge", 0.0))), **HALF),
        p(kinematic, DRIVEN, **HALF),
    ),
    Case(p(parts_needed, HINGED, None, 0.0), p(parts_needed, HINGED, None, 0.1)),
    Case(p(Curve, [0.0], [1.0]), p(Curve, [0.0, 1.0], [0.0, 1.0])),
    Case(p(Curve, [0.0, 1.0], [0.0, np.inf]), p(Curve, [0.0, 1.0], [0.0, 1.0])),
    Case(p(Curve, [0.0, 0.0], [0.0, 1.0]), p(Curve, [0.0, 1.0], [0.0, 1.0])),
    Case(p(formula, "2 * x"), p(formula, "2 * t")),
    Case(p(formula, "2 *"), p(formula, "2 * t")),
    Case(p(formula, "3 kg * t", unit="N"), p(formula, "3 N/s * t", unit="N")),
    Case(p(formula, "5 mm + 3 kg"), p(formula, "5 mm + 3 m")),
    Case(p(formula, "2 Hz * t", unit="rad"), p(formula, "2*pi * 2 Hz * t", unit="rad")),
    Case(p(formula, "exp(3 m)"), p(formula, "exp(3 m / 1 m)")),
    Case(p(as_time_function, "fast", "the speed"), p(as_time_function, 1.0, "the speed")),
    Case(p(table, [0.0, 0.0], [1.0, 2.0]), p(table, [0.0, 1.0], [1.0, 2.0])),
    Case(p(signal, "1st", 0.0), p(signal, "first", 0.0)),
    Case(p(harmonic, 1.0), p(harmonic, amplitude=1.0, frequency=1.0)),
    Case(p(harmonic, amplitude=np.nan, frequency=1.0), p(harmonic, amplitude=1.0, frequency=1.0)),
    Case(lambda: stepped(Within(method="dopri5"), 1e-3), lambda: stepped(Within(method="ros3"), 1e-3)),
    Case(p(method_named, "rk5"), p(method_named, "rk4")),
    Case(p(GeneralisedAlpha, 1e-3, tolerance=2.0), p(GeneralisedAlpha, 1e-3, tolerance=1e-8)),
    Case(p(GeneralisedAlpha, 1e-3, iterations=1), p(GeneralisedAlpha, 1e-3, iterations=2)),
    Case(p(GeneralisedAlpha, 1e-3, spectral_radius=2.0), p(GeneralisedAlpha, 1e-3, spectral_radius=0.8)),
    Case(p(GeneralisedAlpha, 1e-3, form="index 2"), p(GeneralisedAlpha, 1e-3, form="index 3")),
    Case(p(HHT, 1e-3, alpha=1.0), p(HHT, 1e-3, alpha=0.1)),
    Case(p(Projection, 0.0), p(Projection, 1e-9)),
    Case(p(Baumgarte, 0.0, 1.0), p(Baumgarte, 1.0, 1.0)),
    Case(p(RK4, 0.0), p(RK4, 1e-3)),
    Case(p(tolerances, -1.0), p(tolerances, 1e-6)),
    Case(p(Within, 2.0), p(Within, 1e-3)),
    Case(p(stepper, method="ros2"), stepper),
    Case(lambda: stepper(method=DormandPrince()), stepper),
    Case(p(stepper, start=np.inf), stepper),
    Case(lambda: stepper().step(0), lambda: stepper().step(1)),
    Case(lambda: stepper().restore(stepper(start=1.0).save()), lambda: stepper().restore(stepper().save())),
    Case(p(gone_on, restored=False), p(gone_on, restored=True)),
    Case(lambda: stepper().set_inputs(push=(1.0, 2.0)), lambda: stepper().set_inputs(push=(1.0, 2.0, 0.0))),
    Case(lambda: stepper().set_inputs(push=np.inf), lambda: stepper().set_inputs(push=1.0)),
    Case(lambda: stepper().set_inputs(pull=1.0), lambda: stepper().set_inputs(push=1.0)),
    Case(p(stepper, outputs=("push.work",)), p(stepper, outputs=("push.power",))),
    Case(p(run, HINGED, outputs="energy.total"), p(run, HINGED, outputs=["energy.total"])),
    Case(p(run, HINGED, outputs=["energy.totl"]), p(run, HINGED, outputs=["energy.total"])),
    Case(p(named, "hinge.angel"), p(named, "hinge.angle")),
    Case(p(Axis, "xyz", ("x", "x")), p(Axis, "xyz", ("x", "y"))),
    Case(p(Axis, "xyz", ("x.",)), p(Axis, "xyz", ("x",))),
    Case(p(Axis, "a/b", ("x",)), p(Axis, "a", ("x",))),
    Case(lambda: Quantity(np.zeros((2, 3)), "m"), p(Quantity, np.zeros(2), "m")),
    Case(lambda: Result(np.zeros((1, 1)), {}), p(Result, np.zeros(1), {})),
    Case(lambda: Result(np.array([np.nan]), {}), p(Result, np.zeros(1), {})),
    Case(lambda: Result(np.array([1.0, 0.0]), {}), p(Result, np.array([0.0, 1.0]), {})),
    Case(
        lambda: Result(np.zeros(2), {"a": Quantity(np.zeros(1), "m")}),
        p(Result, np.zeros(1), {"a": Quantity(np.zeros(1), "m")}),
    ),
    Case(lambda: Result(np.zeros(1), {}, {}, {"a": np.zeros}), p(Result, np.zeros(1), {}, {}, {"a": 0})),
    Case(p(replace, HINGED, bodies=HINGED.bodies[0]), p(replace, HINGED, bodies=HINGED.bodies)),
    Case(p(replace, HINGED, joints=5), p(replace, HINGED, joints=())),
    Case(p(replace, HINGED, joints=(1,)), p(replace, HINGED, joints=())),
    Case(p(Joint, 1, "revolute", "ground.O", "bar.a"), JOINT),
    Case(p(Joint, "j", "revolute", "bar.a", "bar.a"), JOINT),
    Case(p(Joint, "j", "revolute", "ground", "bar.a"), JOINT),
    Case(p(Joint, "j", "hinge", "ground.O", "bar.a"), JOINT),
    Case(
        p(Joint, "j", "universal", "ground.O", "bar.a"),
        p(Joint, "j", "universal", "ground.O", "bar.a", axis=(1, 0, 0), axis_j=(0, 1, 0)),
    ),
    Case(p(JOINT, length=1.0), JOINT),
    Case(
        p(Joint, "j", "distance", "ground.O", "bar.a", length=-1.0),
        p(Joint, "j", "distance", "ground.O", "bar.a", length=1.0),
    ),
    Case(p(JOINT, pitch=1.0), JOINT),
    Case(p(JOINT, axis=(0, 0, 0)), p(JOINT, axis=(0, 0, 1))),
    Case(p(Coupling, "c", "a.angle", "b.angle", ratio=0.0), p(Coupling, "c", "a.angle", "b.angle", ratio=1.0)),
    Case(p(PointDriver, "d", "ground.O", "bar.b"), p(PointDriver, "d", "ground.O", "bar.b", x=0.0)),
    Case(
        lambda: assemble(replace(HINGED, drivers=(Driver("d", "hinge", 0.0, coordinate="stroke"),))),
        p(assemble, DRIVEN),
    ),
    Case(p(SpringDamper, "s", "ground.O", "bar.b", np.inf), p(SpringDamper, "s", "ground.O", "bar.b", 1.0)),
    Case(p(SpringDamper, "s", "ground.O", "bar.b", 1.0, -1.0), p(SpringDamper, "s", "ground.O", "bar.b", 1.0, 1.0)),
    Case(p(SpringDamper, "s", "bar.b", "bar.b", 1.0), p(SpringDamper, "s", "ground.O", "bar.b", 1.0)),
    Case(p(JointFriction, "f", "hinge", 1.0, 0.0), p(JointFriction, "f", "hinge", 1.0, 1e-3)),
    Case(
        p(JointFriction, "f", "hinge", 1.0, 1.0, static=2.0),
        p(JointFriction, "f", "hinge", 1.0, 1.0, static=2.0, stribeck=1.0),
    ),
    Case(
        p(JointStop, "s", "hinge", stiffness=1.0, entry=1.0),
        p(JointStop, "s", "hinge", upper=1.0, stiffness=1.0, entry=1.0),
    ),
    Case(
        p(JointStop, "s", "hinge", lower=2.0, upper=1.0, stiffness=1.0, entry=1.0),
        p(JointStop, "s", "hinge", lower=0.0, upper=1.0, stiffness=1.0, entry=1.0),
    ),
    Case(p(Load, "l", "bar.b", axes="local"), p(Load, "l", "bar.b", axes="body")),
    Case(p(Load, "l", "bar.b", force=(1.0, 2.0)), p(Load, "l", "bar.b", force=(1.0, 2.0, 0.0))),
    Case(lambda: run(replace(HINGED, loads=(Load("l", "bar.b", force=(np.nan, 0, 0)),))), p(run, pushed(1.0))),
    Case(p(Bushing, "b", "bar.b", "bar.b", (1.0,) * 6), p(Bushing, "b", "ground.O", "bar.b", (1.0,) * 6)),
    Case(
        p(Bushing, "b", "ground.O", "bar.b", (1.0,) * 6, (-1.0,) * 6), p(Bushing, "b", "ground.O", "bar.b", (1.0,) * 6)
    ),
    Case(p(Bushing, "b", "ground.O", "bar.b", (1.0,) * 5), p(Bushing, "b", "ground.O", "bar.b", (1.0,) * 6)),
    Case(p(marker_number, HINGED, "bar.c"), p(marker_number, HINGED, "bar.b")),
    Case(p(marker_number, HINGED, "bat.b"), p(marker_number, HINGED, "bar.b")),
    Case(p(assemble, "scene.toml"), p(assemble, HINGED)),
    Case(lambda: assemble(replace(HINGED, drivers=(Driver("d", "hing", 0.0),))), p(assemble, DRIVEN)),
    Case(p(Scene, ()), p(Scene, HINGED.bodies)),
    Case(p(replace, HINGED, bodies=HINGED.bodies * 2), p(replace, HINGED)),
    Case(p(replace, HINGED, plane="xy"), p(replace, HINGED, plane="z")),
    Case(p(replace, HINGED, ground=(0, 0, 0)), p(replace, HINGED, ground={"O": (0, 0, 0)})),
    Case(p(replace, HINGED, gravity=(0, 0)), p(replace, HINGED, gravity=(0, 0, 0))),
    Case(p(replace, HINGED, gravity=(0, 0, np.inf)), p(replace, HINGED, gravity=(0, 0, 0))),
    Case(p(Body, "b", "bar.ffr"), p(Body, "b", bar("b"))),
    Case(lambda: Body("b", cloud(2), damping=-1.0), p(Body, "b", cloud(2), damping=0.1)),
    Case(lambda: Scene((Body("a b", bar("b")),)), lambda: Scene((Body("b", bar("b")),))),
    Case(lambda: Body("b", cloud(2), dropped=("I10",)), p(Body, "b", cloud(2), dropped=("I9",))),
    Case(lambda: Body("b", bar("b"), rotation=(2.0, 0, 0, 0)), p(Body, "b", bar("b"), rotation=(1.0, 0, 0, 0))),
    Case(lambda: Body("b", bar("b"), rotation=(0, 0)), p(Body, "b", bar("b"), rotation=(0, 0, 1.0))),
    Case(lambda: Body("b", bar("b"), rotation=(0, 0, np.nan)), p(Body, "b", bar("b"), rotation=(0, 0, 1.0))),
    Case(lambda: Body("b", bar("b"), rotation=2 * np.eye(3)), p(Body, "b", bar("b"), rotation=np.eye(3))),
    Case(
        lambda: assemble(replace(HINGED, joints=(*HINGED.joints, Joint("tie", "spherical", "ground.Q", "bar.b")))),
        p(
            assemble,
            replace(
                HINGED,
                ground={**GROUND, "Q": (0.6, 0.8, 0)},
                joints=(*HINGED.joints, Joint("tie", "spherical", "ground.Q", "bar.b")),
            ),
        ),
    ),
    Case(p(in_bearings, "revolute", "revolute"), p(in_bearings, "spherical", "point-on-line")),
    Case(
        lambda: linearise(HINGED, inputs=(fd.JointEffort("m", "hing"),)),
        lambda: linearise(HINGED, inputs=(fd.JointEffort("m", "hinge"),)),
    ),
    Case(
        lambda: saved("run.nc", made, events=(Event("e", "hinge.angle"),)),
        lambda: run(DRIVEN, events=(Event("e", "hinge.angle"),)),
    ),
    Case(lambda: saved("run.nc", kinematic), lambda: saved("run.nc", made)),
    Case(lambda: saved("run.nc", made, method=RK4(1e-3)), lambda: run(DRIVEN, RK4(1e-3))),
    Case(lambda: saved("run.nc", made, end=0.05), lambda: saved("run.nc", made, end=0.2)),
    Case(lambda: loaded(""), lambda: loaded("run.nc")),
    Case(lambda: loaded("walk.nc"), lambda: loaded("run.nc")),
    Case(
        lambda: mixed(HINGED, unknown=(fd.JointEffort("m", "hinge"),), **HALF),
        lambda: mixed(DRIVEN, unknown=(fd.JointEffort("m", "hinge"),), **HALF),
    ),
    Case(
        lambda: mixed(DRIVEN, unknown=(fd.JointEffort("m", "hinge"),), known=("e",), **HALF),
        lambda: mixed(DRIVEN, unknown=(fd.JointEffort("m", "hinge"),), known=("d",), **HALF),
    ),
    Case(
        lambda: mixed(DRIVEN, unknown=(), **HALF),
        lambda: mixed(DRIVEN, unknown=(fd.JointEffort("m", "hinge"),), **HALF),
    ),
    Case(lambda: Mixed(), lambda: Mixed(unknown=(fd.JointEffort("m", "hinge"),))),
    Case(
        lambda: by_solver(
            replace(HINGED, forces=(JointSpring("s", "hinge", 1.0),)), method=SciPy(), outputs=("s.work",), **HALF
        ),
        lambda: by_solver(
            replace(HINGED, forces=(JointSpring("s", "hinge", 1.0),)), method=SciPy(), outputs=("s.power",), **HALF
        ),
    ),
    Case(
        lambda: assemble(replace(HINGED, loads=(Load("l", "bar.b", force=(signal("u", 0.0), signal("u", 1.0), 0)),))),
        lambda: assemble(replace(HINGED, loads=(Load("l", "bar.b", force=(signal("u", 0.0), signal("u", 0.0), 0)),))),
    ),
    Case(
        lambda: assemble(replace(HINGED, joints=(TIE,))),
        lambda: assemble(replace(HINGED, joints=(TIE,), bodies=(replace(HINGED.bodies[0], position=(0.3, 0, 0)),))),
    ),
    Case(
        lambda: assemble(replace(HINGED, joints=(replace(TIE, j="bar.b", length=polynomial(1.0, -1.0)),)), time=2.0),
        lambda: assemble(replace(HINGED, joints=(replace(TIE, j="bar.b", length=polynomial(1.0, -1.0)),)), time=0.5),
    ),
    Case(
        lambda: assemble(
            replace(HINGED, drivers=(Driver("d", "hinge", lambda t: (np.sqrt(-1.0) if t < 0 else 1 / t, 0, 0)),)),
            time=0.0,
        ),
        lambda: assemble(
            replace(HINGED, drivers=(Driver("d", "hinge", lambda t: (1 / t, -1 / t**2, 2 / t**3)),)), time=1.0
        ),
    ),
    Case(
        lambda: Result(np.zeros(1), {"a": Quantity(np.zeros((1, 2)), "m", (Axis("a", ("x", "y")),))}),
        lambda: Result(np.zeros(1), {"a": Quantity(np.zeros((1, 2)), "m", (Axis("b", ("x", "y")),))}),
    ),
    Case(
        lambda: replace(HINGED, couplings=(Coupling("c", "hinge", "hinge.angle", 1.0),)),
        lambda: Coupling("c", "hinge.angle", "other.angle", 1.0),
    ),
    Case(
        lambda: replace(HINGED, couplings=(Coupling("c", "hinge.stroke", "hinge.angle", 1.0),)),
        lambda: Coupling("c", "hinge.angle", "other.angle", 1.0),
    ),
    Case(lambda: marker_number(HINGED, "bar"), lambda: marker_number(HINGED, "bar.b")),
    Case(
        lambda: replace(HINGED, drivers=(PointDriver("d", "bar.a", "bar.b", x=0.0),)),
        lambda: replace(HINGED, drivers=(PointDriver("d", "ground.O", "bar.b", x=0.0),)),
    ),
    Case(
        lambda: replace(HINGED, joints=(Joint("j", "revolute", "bar.a", "bar.b"),)),
        lambda: replace(HINGED, joints=(Joint("j", "revolute", "ground.O", "bar.b"),)),
    ),
    Case(
        lambda: Bushing("b", "ground.O", "bar.b", np.triu(np.ones((6, 6)))),
        lambda: Bushing("b", "ground.O", "bar.b", np.eye(6)),
    ),
    Case(lambda: Bushing("b", "ground.O", "bar.b", "soft"), lambda: Bushing("b", "ground.O", "bar.b", np.eye(6))),
    Case(
        lambda: SpringDamper("s", "ground.O", "bar.b", 1.0, Curve([-1.0, 1.0], [1.0, -1.0])),
        lambda: SpringDamper("s", "ground.O", "bar.b", 1.0, Curve([-1.0, 1.0], [-1.0, 1.0])),
    ),
    Case(
        lambda: replace(HINGED, forces=(JointStop("s", "hinge", upper=1.0, stiffness=1.0, entry=1.0, turns=0.5),)),
        lambda: replace(HINGED, forces=(JointStop("s", "hinge", upper=1.0, stiffness=1.0, entry=1.0, turns=1),)),
    ),
    Case(
        lambda: replace(CLOUD, forces=(ModalForce("m", "cloud", (1.0,)),)),
        lambda: replace(CLOUD, forces=(ModalForce("m", "cloud", (1.0, 1.0)),)),
    ),
    Case(lambda: Servo("s", "hinge", 0.0, 1.0, limit=-1.0), lambda: Servo("s", "hinge", 0.0, 1.0, limit=1.0)),
    Case(lambda: Measurement("m", "bar.a", "bar.b", "speed"), lambda: Measurement("m", "bar.a", "bar.b", "velocity")),
    Case(
        lambda: replace(HINGED, measurements=(Measurement("m", "bar.a", "bar.b", axes="bat"),)),
        lambda: replace(HINGED, measurements=(Measurement("m", "bar.a", "bar.b", axes="bar"),)),
    ),
    Case(lambda: recorded(np.zeros(3), np.zeros(3)), lambda: recorded(np.arange(8.0), np.zeros(8))),
    Case(
        lambda: recorded(np.arange(8.0), np.zeros(8), rates=np.zeros(3)),
        lambda: recorded(np.arange(8.0), np.zeros(8), rates=np.zeros(8)),
    ),
    Case(
        lambda: mixed(DRIVEN, unknown=(fd.JointEffort("m", "hing"),), **HALF),
        lambda: mixed(DRIVEN, unknown=(fd.JointEffort("m", "hinge"),), **HALF),
    ),
    Case(
        lambda: NodalForces("f", "bar", [0.5], [[1.0, 0.0, 0.0]]),
        lambda: NodalForces("f", "bar", [0], [[1.0, 0.0, 0.0]]),
    ),
    Case(
        lambda: replace(CLOUD, forces=(NodalForces("f", "cloud", [99], [[1.0, 0.0, 0.0]]),)),
        lambda: replace(CLOUD, forces=(NodalForces("f", "cloud", [0], [[1.0, 0.0, 0.0]]),)),
    ),
    Case(
        lambda: NodalForces("f", "bar", [0], [[1.0, 0.0, 0.0]], axes="local"),
        lambda: NodalForces("f", "bar", [0], [[1.0, 0.0, 0.0]], axes="body"),
    ),
    Case(
        lambda: SectionMeasurement("m", "bar", (0, 0, 0), what="torque"),
        lambda: SectionMeasurement("m", "bar", (0, 0, 0), what="moment"),
    ),
    Case(
        lambda: SectionMeasurement("m", "bar", (0, 0)),
        lambda: SectionMeasurement("m", "bar", (0, 0, 0)),
    ),
    Case(lambda: SectionMeasurement("m", "bar", "tip"), lambda: SectionMeasurement("m", "bar", (0, 0, 0))),
    Case(
        lambda: forward(CLOUD, end=0.1, output_step=0.01, begin="still"),
        lambda: forward(CLOUD, end=0.1, output_step=0.01, begin="as-given"),
    ),
    Case(lambda: fd.steady(defined_at_one_point(np.nan)), lambda: fd.steady(defined_at_one_point(0.0))),
    Case(lambda: fd.steady(HINGED, speeds=(1.0,)), lambda: fd.steady(HINGED, speeds=(1.0,), turn="hinge.angle")),
    Case(
        lambda: fd.steady(HINGED, speeds=(1.0,), turn="hing"),
        lambda: fd.steady(HINGED, speeds=(1.0,), turn="hinge.angle"),
    ),
    Case(lambda: fd.Steady(speeds=("fast",)).perform(HINGED, fd.MomentSettings()), lambda: fd.steady(DRIVEN)),
    Case(
        lambda: fd.campbell(CLOUD, speeds=(1.0,), turn="hinge"),
        lambda: fd.campbell(CLOUD, speeds=(1.0, 2.0), turn="hinge"),
    ),
    Case(
        lambda: fd.campbell(EVENLY, speeds=(1.0, 2.0)),
        lambda: fd.campbell(CLOUD, speeds=(1.0, 2.0), turn="hinge"),
    ),
    Case(
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], frequencies=3),
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], frequencies=[3.0]),
    ),
    Case(
        lambda: fd.response(HINGED, input="hing.moment", outputs=["bar.b.position.x"]),
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], frequencies=[1.0]),
    ),
    Case(
        lambda: fd.response(HINGED, input="hinge.force", outputs=["bar.b.position.x"], frequencies=[1.0]),
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], frequencies=[1.0]),
    ),
    Case(
        lambda: fd.response(HINGED, input="hinge.moment", outputs=[]),
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], frequencies=[1.0]),
    ),
    Case(
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], about="rest"),
        lambda: fd.response(HINGED, input="hinge.moment", outputs=["bar.b.position.x"], frequencies=[1.0]),
    ),
    Case(
        lambda: fd.response(DRIVEN, input="d.angle", outputs=["d.moment.z"], frequencies=[1.0]),
        lambda: fd.response(DRIVEN, input="d.angle", outputs=["d.effort"], frequencies=[1.0]),
    ),
    Case(
        lambda: fd.response(SPRUNG, input="base.y.velocity", outputs=["bar.b.position.y"], frequencies=[0.0, 1.0]),
        lambda: fd.response(SPRUNG, input="base.y.velocity", outputs=["bar.b.position.y"], frequencies=[0.5, 1.0]),
    ),
    Case(lambda: deviated(3.0), lambda: deviated(0.1)),
    *(
        Case(partial(swayed, **wrong), partial(swayed, **right))
        for wrong, right in (
            ({"amplitude": 0.0}, {"amplitude": 0.1}),
            ({"band_of": (0.0, 1.0)}, {"band_of": (1.0, 1.01)}),
            ({"steps": 10}, {"steps": 80}),
            ({"about": "steady"}, {"about": "start"}),
            ({"scene": replace(SPRUNG, gravity=(fd.harmonic(amplitude=1, frequency=1), 0, 0))}, {"scene": SPRUNG}),
            ({"outputs": []}, {"outputs": ["hinge.angle"]}),
            ({"input": "none", "scene": IDLE}, {"input": "hinge.moment", "scene": IDLE}),
            ({"input": "looking", "scene": IDLE}, {"input": "hinge.moment", "scene": IDLE}),
            ({"input": "d.angle_rate", "scene": SHAKEN}, {"input": "d.angle", "scene": SHAKEN}),
        )
    ),
    Case(
        lambda: fd.Forced(input="hinge.moment", amplitude=1.0, quantities=("hinge.angle",)).perform(
            SPRUNG, MOMENT, path=None
        ),
        lambda: fd.Forced(
            input="hinge.moment", amplitude=1.0, quantities=("hinge.angle",), band="1..1.01", steps=80
        ).perform(SPRUNG, MOMENT, path=None),
    ),
    Case(partial(run, LOSSY, GeneralisedAlpha(1e-3)), partial(run, LOSSY, ROS2(1e-3))),
    Case(
        lambda: fd.Linearise(film="m.html", mode=9).perform(TURNING, MOMENT, path=None),
        lambda: fd.mode_motion(fd.linearise(TURNING), 0),
    ),
    Case(lambda: followed(200.0), lambda: followed(200.0, 0.01)),
    Case(lambda: torn(1.0), lambda: torn(0.4)),
    Case(lambda: fd.user(len, breaks=0.5), lambda: fd.user(len, breaks=[0.5])),  # type: ignore[arg-type]
    Case(lambda: fd.periodic(HINGED), lambda: fd.periodic(EVENLY)),
    Case(lambda: fd.periodic(EVENLY, period=-1.0), lambda: fd.periodic(EVENLY)),
    Case(lambda: fd.periodic(EVENLY, period=0.3), lambda: fd.periodic(EVENLY)),
    Case(lambda: fd.periodic(spun(10.0), period=0.3), lambda: fd.periodic(spun(20 * np.pi), period=0.3)),
    Case(lambda: fd.periodic(spun(12.0), period=0.3), lambda: fd.periodic(EVENLY)),
    Case(lambda: fd.Steady(speeds=("inf",)).perform(EVENLY, MOMENT), lambda: fd.steady(EVENLY)),
    Case(lambda: fd.steady(DRAGGED), lambda: fd.steady(TURNING)),
    Case(lambda: fd.steady(governor(1000.0)), lambda: fd.steady(governor(1.0))),
    Case(lambda: fd.periodic(swung(0.0), period=1 / 1.3), lambda: fd.periodic(swung(1.0), period=1 / 1.3)),
    Case(
        lambda: fd.periodic(swung(1.0, 20.0), period=1 / 1.3),
        lambda: fd.periodic(swung(1.0, 20.0, -2.0), period=1 / 1.3),
    ),
    Case(lambda: fd.periodic(struck(0.02), period=1 / 1.3), lambda: fd.periodic(struck(5.0), period=1 / 1.3)),
    Case(lambda: fd.periodic(struck(0.5), period=1 / 1.3), lambda: fd.periodic(struck(5.0), period=1 / 1.3)),
    Case(lambda: fd.steady(on_springs(stiff=False)), lambda: fd.steady(on_springs(stiff=True))),
    Case(
        lambda: fd.floquet_motion(swung(1.0), 9, period=1 / 1.3),
        lambda: fd.floquet_motion(swung(1.0), 0, period=1 / 1.3),
    ),
    Case(lambda: fd.steady(CRANKED), lambda: fd.periodic(CRANKED)),
    Case(lambda: fd.periodic(SWAYING, period=1.0), lambda: fd.periodic(SWAYING, period=1 / 1.3)),
    Case(lambda: fd.steady(TWICE_DRIVEN, speeds=(1.0,)), lambda: fd.steady(TWICE_DRIVEN, speeds=(1.0,), turn="first")),
    Case(
        lambda: fd.Linearise(at_equilibrium=True, at_steady=True).perform(TURNING, MOMENT, path=None),
        lambda: fd.Linearise(at_steady=True).perform(TURNING, MOMENT, path=None),
    ),
    Case(
        lambda: fd.Campbell(speeds=("1..2",), turn="hinge", orders=("a",)).perform(CLOUD, MOMENT, path=None),
        lambda: fd.Campbell(speeds=("1..2:2",), turn="hinge").perform(CLOUD, MOMENT, path=None),
    ),
    Case(
        lambda: fd.Response(input="base.x", quantities=("bar.b.position.x",), band="3").perform(
            HINGED, MOMENT, path=None
        ),
        lambda: fd.Response(input="base.x", quantities=("bar.b.position.x",), band="1..2").perform(
            HINGED, MOMENT, path=None
        ),
    ),
    Case(
        lambda: fd.Response(input="base.x", quantities=("bar.b.position.x",), psd=("3",)).perform(
            HINGED, MOMENT, path=None
        ),
        lambda: fd.Response(input="base.x", quantities=("bar.b.position.x",), psd=("3:1", "4:1")).perform(
            HINGED, MOMENT, path=None
        ),
    ),
    Case(
        lambda: fd.Response(input="base.x", quantities=("bar.b.position.x",), psd=("3:1",)).perform(
            HINGED, MOMENT, path=None
        ),
        lambda: fd.Response(input="base.x", quantities=("bar.b.position.x",), psd=("3:1", "4:1")).perform(
            HINGED, MOMENT, path=None
        ),
    ),
    Case(
        lambda: fd.response(HINGED, frequencies=(-1.0, 2.0), input="base.x", outputs=("bar.b.position.x",)),
        lambda: fd.response(HINGED, frequencies=(1.0, 2.0), input="base.x", outputs=("bar.b.position.x",)),
    ),
    Case(lambda: fd.mode_motion(fd.linearise(HINGED), 9), lambda: fd.mode_motion(fd.linearise(HINGED), 1)),
    Case(
        lambda: fd.assembly(CLOUD).to_statespace(),
        lambda: fd.linearise(CLOUD, inputs=(fd.JointEffort("m", "hinge"),), outputs=("hinge.angle",)).to_statespace(),
    ),
    Case(lambda: Output("energy.total", -1.0), lambda: Output("energy.total", 1.0)),
    Case(lambda: Adaptation(enter=0.1, leave=0.2), lambda: Adaptation(enter=0.2, leave=0.1)),
    Case(lambda: Adaptation(rows=1), lambda: Adaptation(rows=2)),
    Case(lambda: written(fd.export, run(HINGED), "a.stl"), lambda: written(fd.export, run(HINGED), "a.glb")),
    Case(
        lambda: written(fd.export, run(HINGED), "a.glb", ["bar.R"]),
        lambda: written(fd.export, run(HINGED), "a.csv", ["bar.R"]),
    ),
    Case(lambda: written(fd.show, HINGED, "a.gif"), lambda: written(fd.show, HINGED, "a.html")),
    Case(window, lambda: written(fd.show, HINGED, "a.html")),
    Case(lambda: tabled(None), lambda: tabled(PANDAS)),
    Case(
        lambda: kinematic(replace(HINGED, drivers=(Driver("d", "hinge", lambda t: (2 * t, 1, 0)),)), **HALF),
        lambda: kinematic(replace(HINGED, drivers=(Driver("d", "hinge", lambda t: (2 * t, 2, 0)),)), **HALF),
    ),
    Case(
        lambda: by_solver(HINGED, method=ROS2(1e-3), **HALF),  # type: ignore[arg-type]
        p(by_solver, HINGED, method=SciPy(), **HALF),
    ),
    Case(p(fd.inverse, DRIVEN, elastic="dynamic", **HALF), p(fd.inverse, DRIVEN, elastic=fd.Dynamic(), **HALF)),
    Case(
        p(fd.mixed, DRIVEN, unknown=(fd.JointEffort("f", "hinge"),), solution="causal", **HALF),
        p(fd.mixed, DRIVEN, unknown=(fd.JointEffort("f", "hinge"),), **HALF),
    ),
    Case(
        lambda: run(HINGED, events=(Event("e", "hinge.angle"), Event("e", "hinge.angle_rate"))),
        lambda: run(HINGED, events=(Event("e", "hinge.angle"), Event("f", "hinge.angle_rate"))),
    ),
    Case(
        lambda: run(HINGED, events=(Event("e", lambda t, s: s.q("bra")),)),
        lambda: run(HINGED, events=(Event("e", lambda t, s: s.position("bar.b")[1]),)),
    ),
    Case(
        lambda: run(HINGED, events=(Event("e", lambda t, s: np.nan),)),
        lambda: run(HINGED, events=(Event("e", lambda t, s: t - 0.1),)),
    ),
    Case(
        lambda: run(felt(lambda t, s: (0, s.omega_bar("bra")[0], 0))),
        lambda: run(felt(lambda t, s: (0, s.omega_bar("bar")[0], 0))),
    ),
    Case(
        p(fd.piecewise, [0.0, 1.0, 2.0], [[1.0], [1.0, 2.0]]),
        p(fd.piecewise, [0.0, 1.0, 2.0], [[1.0, 0.0], [1.0, 2.0]]),
    ),
    Case(lambda: fd.steady(EVENLY, speeds=5.0), lambda: fd.steady(EVENLY, speeds=[5.0])),  # type: ignore[arg-type]
    Case(
        lambda: run(felt(lambda t, s, calls=[]: (0, calls.append(t) or len(calls), 0))),
        lambda: run(felt(lambda t, s: (0, t, 0))),
    ),
]
CASES, NAMES = numbered(
    {
        "runs": RUNS,
        "input": INPUT,
        "command": command_cases.CASES,
        "cost": cost_cases.CASES,
        "result": result_cases.CASES,
        "scene": scene_cases.CASES,
        "analysis": analysis_cases.CASES,
        "study": study_cases.CASES,
        "bent": analysis_cases.BENT,
    }
)


# ---- the texts ------------------------------------------------------------------------------------------------------------


@cache
def texts() -> dict[str, tuple[re.Pattern[str], ...]]:
    """What each module says, as patterns."""
    return texts_of("ffr_dyn", PARTS)


@cache
def message(number: int) -> str:
    """What a case raises."""
    with pytest.raises((InputError, ComputationError)) as caught:
        CASES[number].raised()
    return str(caught.value)


@pytest.mark.parametrize("number", range(len(CASES)), ids=NAMES)
def test_a_text_is_raised_and_its_remedy_works(number):
    said = message(number)
    assert any(text.search(said) for found in texts().values() for text in found), said
    CASES[number].mended()


UNCOVERED: dict[str, int] = {}  # texts without a case, by module: new ones are written with one


@pytest.mark.slow
def test_every_text_has_a_case():
    said = [message(k) for k in range(len(CASES))]
    missing = {m: [t.pattern for t in found if not any(map(t.search, said))] for m, found in texts().items()}
    assert {m: without for m, without in missing.items() if len(without) > UNCOVERED.get(m, 0)} == {}


@pytest.mark.parametrize("kind", [RK4, ROS2, GeneralisedAlpha])
def test_no_method_is_advised_to_one_who_uses_it(kind):
    scene = replace(CLOUD, springs=(FAR,))
    with pytest.raises(ComputationError) as caught:
        run(scene, kind(1e-3))
    said = str(caught.value).replace(f"of {kind.__name__}", "").replace(f"in which {kind.__name__} takes it", "")
    assert kind.__name__ not in said
    assert "use projection" not in str(caught.value)
    assert "driver" not in str(caught.value)
