"""What the analyses say of scenes and runs, and runs that fail."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import chdir
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import h5py
import numpy as np
from ffr_gallery.bodies import bar, beam, pendulum
from remedy import CLOUD, DOUBLE, DRIVEN, GROUND, HINGED, run, stressed
from said import Case
from synthetic import cloud
from test_analyses_kinematic import slider_crank
from test_analyses_mixed import (
    PUSH,
    bounded,
    cart_with_pendulum,
    cart_with_rod,
    spring_carts,
    two_carts,
)
from test_analyses_static import hanging
from test_assemble import tied

import ffr_dyn as fd
from ffr_dyn.analyses import run as whole
from ffr_dyn.analyses.checkpoint import decode, encode
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.inverse import QuasiStatic, inverse
from ffr_dyn.analyses.inversion.bounded import Bounded
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.mixed import Causal, mixed
from ffr_dyn.analyses.reference import IDA, SciPy, reference
from ffr_dyn.analyses.settings import MomentSettings, Settings
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4, ROS2, ROS3, DormandPrince, HalfExplicit, tolerances
from ffr_dyn.integrators.stabilisation import Drifting
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import JointSpring, JointStop, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.variant import vary

p = partial


def damped(method: object) -> Result:
    """By more than explicit steps bear."""
    damper = JointSpring("damper", "hinge", damping=1e7)
    return run(replace(HINGED, gravity=(0, -9.81, 0), forces=(damper,)), method)


def shoved(force: str) -> Result:
    """By a function of time."""
    scene = replace(HINGED, loads=(Load("push", "bar.b", (0, formula(force), 0)),))
    return forward(scene, end=0.1, output_step=0.01, method=ROS2(1e-3), check=False)


def tumbled(step: float) -> Result:
    """A free body that turns by hundreds of radians in the longer step."""
    fast = (replace(TUMBLING.bodies[0], omega_bar=(1e5, 2e5, 3e5)),)
    return run(replace(TUMBLING, bodies=fast), RK4(step), 100 * step, 10 * step)


# ---- runs that go on ----------------------------------------------------------------------------------------------------


def resumed(change: Callable[[np.ndarray], np.ndarray]) -> Result:
    """A run that goes on from a result file whose checkpoint was changed."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        run(DRIVEN, path=path)
        with h5py.File(path, "r+", locking=False) as file:
            content = change(file["checkpoint/state"][:])
            del file["checkpoint/state"]
            file["checkpoint/state"] = content
        return run(DRIVEN, end=0.2, resume=path)


def older(content: np.ndarray) -> np.ndarray:
    saved = decode(content)
    return encode(replace(saved, arrays={}))


def continued(settings: object) -> Result:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        forward(HINGED, end=0.1, output_step=0.01, method=ROS2(1e-3), check=False, path=path)
        return whole.run(HINGED, settings, resume=path)


LONGER = Settings(start=0.0, end=0.2, output_step=0.01, method=ROS2(1e-3))
RESUMED = [
    Case(p(run, DRIVEN, ROS2(1e-20)), p(run, DRIVEN, ROS2(1e-3))),
    Case(p(resumed, lambda content: content[:50]), p(run, DRIVEN, end=0.2)),
    Case(p(resumed, older), p(run, DRIVEN, end=0.2)),
    Case(p(continued, MomentSettings()), p(continued, LONGER)),
]

# ---- known motions ------------------------------------------------------------------------------------------------------

GO = Driver("go", "rail1", polynomial(0, 0, 1.0), coordinate="stroke")
AT_END = Driver("go", "rail2", polynomial(1.0), coordinate="stroke")
FIRST, SECOND = fd.JointEffort("f1", "rail1", "stroke"), fd.JointEffort("f2", "rail2", "stroke")
SPAN = {"end": 0.3, "output_step": 0.1}
BEYOND = Bounded(before=0.5, after=0.5)


def hung(kind: str) -> Result:
    """A body on a cart of known motion."""
    base = two_carts(GO)
    joint = Joint("ball", kind, "one.c", "two.c")
    bodies = base.bodies[0], replace(base.bodies[1], position=(0, 0, 0))
    scene = replace(base, bodies=bodies, joints=(base.joints[0], joint))
    return mixed(scene, unknown=(fd.MarkerEffort("p", "one.c", (1, 0, 0)),), **SPAN)


def turned(speed: float) -> Result:
    """A pendulum on a cart, forces on which do not turn it when it is horizontal, at one radian."""
    scene = cart_with_pendulum(Driver("turn", "pin", polynomial(-1.0, speed)))
    return mixed(scene, unknown=(PUSH,), end=0.6, output_step=0.1, solution=Causal(1e-4, growth=1e9))


def pulled(speed: float) -> Result:
    """The slider of a crank of known motion, 0.1 m from its end, with a rod that hangs on it."""
    base = slider_crank(0.2, 0.7, offset=0.3)
    end = base.bodies[2].position
    push = Driver("push", "guide", polynomial(end[0], speed), coordinate="stroke")
    rod = Body("load", bar("load"), position=end, rotation=(0, 0, -np.pi / 2))
    hinge = Joint("hinge", "revolute", "slider.c", "load.a")
    scene = replace(base, bodies=(*base.bodies, rod), joints=(*base.joints, hinge), drivers=(push,))
    return mixed(scene, unknown=(fd.JointEffort("m", "main"),), end=0.4, output_step=0.1, solution=Causal(1e-4))


def cranked(effort: object) -> Result:
    """A crank of known motion, which forces on the slider do not move at its dead point, at half a second."""
    scene = slider_crank(0.2, 0.7, Driver("turn", "main", polynomial(-0.5, 1.0)), offset=-0.5)
    return mixed(scene, unknown=(effort,), end=1.0, output_step=0.5, solution=Causal())


KNOWN = [
    Case(p(mixed, two_carts(GO), unknown=(SECOND,), **SPAN), p(mixed, two_carts(GO), unknown=(FIRST,), **SPAN)),
    Case(p(mixed, spring_carts(AT_END), unknown=(FIRST,), solution=Causal(), **SPAN),
         p(mixed, spring_carts(AT_END), unknown=(FIRST,), solution=BEYOND, **SPAN)),
    Case(p(hung, "spherical"), p(hung, "revolute")),
    Case(p(pulled, 0.1), p(pulled, -0.1)),
    Case(p(turned, 1.9), p(turned, 1.0)),
    Case(p(cranked, fd.JointEffort("f", "guide", "stroke")), p(cranked, fd.JointEffort("f", "main"))),
    Case(lambda: bounded(cart_with_rod(300.0, np.pi / 2, gravity=(0, -9.81, 0))),
         lambda: bounded(cart_with_rod(0.1, np.pi / 2, gravity=(0, -9.81, 0)), 0.02)),
]  # fmt: skip

# ---- other analyses -----------------------------------------------------------------------------------------------------


def without_ida() -> Result:
    with patch.dict(sys.modules, {"sksundae.ida": None}):
        return reference(HINGED, method=IDA(), **SPAN)


def doored(elastic: object) -> Result:
    """A flexible door on two hinges, one of which would do."""
    model = cloud(8)
    a, b = (model.interface(name).position for name in "ab")
    joints = tuple(Joint(f"h{k}", "revolute", f"ground.{k}", f"door.{k}", axis=b - a) for k in "ab")
    scene = Scene((Body("door", model),), joints, (Driver("d", "ha", 0.0),), ground={"a": a, "b": b}, plane="none")
    return inverse(scene, elastic=elastic, **SPAN)


def weighed(law: Callable[..., object]) -> Result:
    return static(hanging(0.0, Load("wind", "rod.b", function=law)))


def kinked(law: Callable[..., object]) -> Result:
    """A hinge with a spring, under a moment."""
    spring, moment = JointSpring("spring", "hinge", stiffness=100.0), Load("load", "bar.b", function=law)
    return static(replace(HINGED, forces=(spring,), loads=(moment,)))


def pinned(far: tuple[float, float, float]) -> object:
    joints = (Joint("near", "spherical", "ground.O", "cloud.a"), Joint("far", "spherical", "ground.F", "cloud.b"))
    return assemble(Scene((Body("cloud", cloud(3, stiffness=50.0)),), joints, ground={"O": (0, 0, 0), "F": far}))


def pushed(angle: float) -> object:
    """A crank at an angle, whose slider is driven."""
    scene = slider_crank(0.2, 0.7, offset=angle)
    reach = float(scene.bodies[2].position[0])
    return assemble(replace(scene, drivers=(Driver("push", "guide", polynomial(reach, -0.1), coordinate="stroke"),)))


def twisted(moment: float, begin: str) -> Result:
    """A body by a moment, from its quasi-static deflections if there are any."""
    scene = replace(CLOUD, loads=(Load("far", "cloud.b", moment=(0, 0, moment)),))
    return forward(scene, end=1e-3, output_step=1e-3, method=ROS2(1e-4), begin=begin, check=False)


def diverging(moment: float) -> Result:
    return run(replace(CLOUD, loads=(Load("far", "cloud.b", moment=(0, 0, moment)),)), RK4(1e-4), end=0.3)


def beside(t: float, state: object) -> tuple[float, float, float]:
    """A force that has a value at rest alone."""
    return (0, 0, 0) if state.omega_bar("bar")[2] == 0 else (np.nan, 0, 0)


def spun(rate: float) -> Scene:
    return replace(DOUBLE, bodies=tuple(replace(b, omega_bar=(0, 0, rate)) for b in DOUBLE.bodies), gravity=(0, 0, 0))


def cut(tolerance: float, **more: object) -> Result:
    return run(TUMBLING, DormandPrince(tolerances(tolerance)), **more)


def felt(law: Callable[..., object]) -> object:
    return linearise(replace(HINGED, loads=(Load("gust", "bar.b", function=law),)))


def loose(tolerance: float) -> Result:
    """A clamped body that vibrates."""
    scene = Scene(
        (Body("b", cloud(12, points=6, stiffness=150.0), q_dot=np.ones(12)),),
        (Joint("clamp", "fixed", "ground.O", "b.a"),),
        ground=GROUND,
    )
    return run(scene, DormandPrince(tolerances(tolerance)), 0.5, 0.5)


def locking() -> Scene:
    """A slider that is pushed beyond its dead point, where it is after a second."""
    scene = slider_crank(0.2, 0.7, offset=0.3)
    reach = float(scene.bodies[2].position[0])
    push = Driver("push", "guide", polynomial(reach, 0.1), coordinate="stroke")
    return replace(scene, drivers=(push,))


def shrinking(end: float) -> Result:
    """Two bodies, whose points come together at half a second."""
    return run(tied("distance", 0.5, length=formula("0.5 - t")), RK4(1e-2), end, 0.1)


def rocked(end: float, **more: object) -> Result:
    """A crank of 0.6 m, which cannot turn around under a coupler of 0.9 m and a rocker of 0.5 m on a base of 1 m."""
    bodies = (
        Body("crank", bar("crank", 0.6), rotation=(0, 0, 1.2)),
        Body("coupler", bar("coupler", 0.9), position=(0.2, 0.56, 0), rotation=(0, 0, -0.2)),
        Body("rocker", bar("rocker", 0.5), position=(1, 0, 0), rotation=(0, 0, 1.5)),
    )
    pairs = {"A": ("ground.O", "crank.a"), "B": ("crank.b", "coupler.a"), "C": ("coupler.b", "rocker.b")}
    joints = (
        *(Joint(name, "revolute", *pair) for name, pair in pairs.items()),
        Joint("D", "revolute", "ground.D", "rocker.a"),
    )
    motor = Driver("motor", "A", polynomial(1.2, 10.0))
    ground = {"O": (0, 0, 0), "D": (1, 0, 0)}
    return run(Scene(bodies, joints, (motor,), ground=ground), RK4(1e-3), end, 0.01, **more)


def given_up(end: float) -> Result:
    return reference(locking(), method=IDA(1e-2, 1e-2), end=end, output_step=end)


def far_off(tolerance: float) -> Result:
    return reference(spun(50.0), method=SciPy("RK45", tolerance, tolerance), end=0.5, output_step=0.5)


TUMBLING = Scene((Body("bar", bar("bar"), omega_bar=(300.0, 1e3, 0)),), plane="none")


def turned(speed: float) -> Scene:
    return replace(HINGED, drivers=(fd.Driver("d", "hinge", fd.polynomial(0.0, speed)),))


HUGE = replace(HINGED, bodies=(replace(HINGED.bodies[0], omega_bar=(0, 0, 9e59)),), plane="none")
APART = tuple((cloud(3).interface("b").position - cloud(3).interface("a").position).tolist())
SPACE = replace(CLOUD, plane="none")


def coiled(moment: float) -> Scene:
    """A clamped beam of length and stiffness one, bent by a moment at its end."""
    return Scene(
        (Body("beam", beam("beam", 1.0, 1.0, 1.0, 4, spare=0)),),
        (Joint("clamp", "fixed", "ground.O", "beam.a"),),
        loads=(Load("moment", "beam.b", moment=(0, 0, moment)),),
        ground=GROUND,
        plane="z",
    )


OTHER = [
    Case(partial(static, coiled(6.0)), partial(static, coiled(0.1))),
    Case(without_ida, p(reference, HINGED, method=IDA(), **SPAN)),
    Case(p(given_up, 0.5), p(given_up, 0.05)),
    Case(p(far_off, 0.99), p(far_off, 1e-3)),
    Case(p(doored, "quasi-static"), p(doored, QuasiStatic())),
    Case(lambda: weighed(lambda t, state: 1 / 0), lambda: weighed(lambda t, state: (0.1, 0, 0))),
    Case(lambda: weighed(lambda t, state: (np.nan, 0, 0)), lambda: weighed(lambda t, state: (0.1, 0, 0))),
    Case(p(shrinking, 1.0), p(shrinking, 0.4)),
    Case(p(felt, beside), lambda: felt(lambda t, state: (0.1, 0, 0))),
    Case(p(pinned, (50.0, 0, 0)), p(pinned, APART)),
    Case(p(pushed, 0.0), p(pushed, 0.3)),
    Case(
        p(kinked, lambda t, s: (0, 10.0 * np.sign(0.05 - s.position("bar.b")[1]), 0)),
        p(kinked, lambda t, s: (0, 1.0, 0)),
    ),
    Case(lambda: assemble(vary(SPACE, drop=("I3",))), lambda: assemble(vary(SPACE, drop=("I3", "I4")))),
    Case(p(twisted, 1e5, "quasi-static"), p(twisted, 1e5, "as-given")),
    Case(p(diverging, 1e5), p(diverging, 1e2)),
    Case(p(rocked, 0.5, stabilisation=Drifting()), p(rocked, 0.05)),
    Case(p(cut, 0.9, end=1.0, output_step=0.1), p(cut, 1e-6, end=0.01)),
    Case(p(loose, 0.9), p(loose, 1e-3)),
    Case(p(run, HUGE), p(run, HINGED)),
    Case(p(run, turned(1e200)), p(run, turned(1.0))),
    Case(p(run, HUGE, fd.AdaptiveROS3()), p(run, HINGED, fd.AdaptiveROS3())),
    Case(p(shoved, "1 / abs(t - 0.05)"), p(shoved, "1 / sqrt((t - 0.05)**2 + 0.01**2)")),
    Case(p(damped, HalfExplicit(1e-3)), p(damped, ROS2(1e-3))),
    Case(p(tumbled, 1e-3), p(tumbled, 1e-8)),
    Case(lambda: run(locking(), RK4(1e-3), 0.5, stabilisation=Drifting()), lambda: run(locking(), RK4(1e-3))),
]


def beside(**how: object) -> object:
    """Two runs at once."""
    with TemporaryDirectory() as folder, chdir(folder):
        return fd.forward_many([HINGED] * 2, end=0.1, output_step=0.05, method=ROS2(1e-2), **how)


MANY = [
    Case(p(beside, paths=["a.nc"]), p(beside, paths=["a.nc", "b.nc"])),
    Case(p(beside, threads=0), p(beside, threads=1)),
]


def notched(what: str) -> object:
    """The slopes of the stress of a body that nothing strains."""
    notch = fd.StressMeasurement("notch", "cloud", (0, 0, 0), what=what)
    scene = replace(CLOUD, bodies=(Body("cloud", stressed(cloud(2))),), measurements=(notch,))
    return linearise(scene, outputs=("measured.notch",))


SEEN = [
    Case(p(notched, "von-mises"), p(notched, "xx")),
    Case(lambda: fd.scene_at(HINGED, fd.assembly(HINGED), 5), lambda: fd.scene_at(HINGED, fd.assembly(HINGED), -1)),
]


def stopped(step: float) -> Result:
    """A soft arm that falls on a hard stop: longer steps throw it into shapes that no arm has."""
    stop = JointStop("stop", "hinge0", stiffness=1e6, entry=1e-4, lower=-0.5)
    return run(pendulum(beam("arm", 1.0, 1.0, 20.0, 3), forces=(stop,)), ROS3(step), 0.3)


BENT = [Case(p(stopped, 5e-3), p(stopped, 1e-4))]
CASES = RESUMED + KNOWN + OTHER + MANY + SEEN
