"""What the analyses say of scenes and runs, and runs that fail."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import h5py
import numpy as np
from remedy import DRIVEN, GROUND, HINGED, Case, run
from synthetic import cloud
from test_analyses_kinematic import slider_crank
from test_analyses_mixed import (
    MOTOR,
    PUSH,
    TIP,
    bounded,
    cart_with_pendulum,
    cart_with_rod,
    one_link,
    rest_to_rest,
    spring_carts,
    two_carts,
)
from test_analyses_static import hanging

import ffr_dyn as fd
from ffr_dyn.analyses import run as whole
from ffr_dyn.analyses.checkpoint import decode, encode
from ffr_dyn.analyses.inverse import inverse
from ffr_dyn.analyses.inversion.bounded import Bounded
from ffr_dyn.analyses.mixed import Causal, mixed
from ffr_dyn.analyses.reference import IDA, reference
from ffr_dyn.analyses.settings import MomentSettings, Settings
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import ROS2
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import JointSpring, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene

p = partial

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
        run(HINGED, path=path)
        return whole.run(HINGED, settings, resume=path)


LONGER = Settings(start=0.0, end=0.2, output_step=0.01, method=ROS2(1e-3))
RESUMED = [
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


def led(far: float, solution: object) -> Result:
    tip = replace(TIP, y=rest_to_rest(far, 0.6))
    return mixed(one_link(tip), unknown=(MOTOR,), end=0.6, output_step=0.05, solution=solution)


def cranked(effort: object) -> Result:
    """A crank of known motion, which forces on the slider do not move at its dead point, at half a second."""
    scene = slider_crank(0.2, 0.7, Driver("turn", "main", polynomial(-0.5, 1.0)), offset=-0.5)
    return mixed(scene, unknown=(effort,), end=1.0, output_step=0.5, solution=Causal())


KNOWN = [
    Case(p(mixed, two_carts(GO), unknown=(SECOND,), **SPAN), p(mixed, two_carts(GO), unknown=(FIRST,), **SPAN)),
    Case(p(mixed, spring_carts(AT_END), unknown=(FIRST,), solution=Causal(), **SPAN),
         p(mixed, spring_carts(AT_END), unknown=(FIRST,), solution=BEYOND, **SPAN)),
    Case(p(hung, "spherical"), p(hung, "revolute")),
    Case(p(led, 1.5, Causal(growth=1e300)), p(led, 0.2, BEYOND)),
    Case(p(turned, 1.9), p(turned, 1.0)),
    Case(p(cranked, fd.JointEffort("f", "guide", "stroke")), p(cranked, fd.JointEffort("f", "main"))),
    Case(lambda: bounded(cart_with_rod(300.0, np.pi / 2, gravity=(0, -9.81, 0))),
         lambda: bounded(cart_with_rod(0.1, np.pi / 2, gravity=(0, -9.81, 0)), 0.02)),
]  # fmt: skip

# ---- other analyses -----------------------------------------------------------------------------------------------------


def without_ida() -> Result:
    with patch.dict(sys.modules, {"sksundae.ida": None}):
        return reference(HINGED, method=IDA(), **SPAN)


def fixed_twice(elastic: object, kind: str) -> Result:
    """A crank on two hinges, one of which would do."""
    model = cloud(2)
    joints = (Joint("one", kind, "ground.O", "b.a"), Joint("two", "spherical", "ground.P", "b.b"))
    scene = Scene((Body("b", model),), joints, (Driver("d", "one", 0.0),), ground=GROUND, plane="none")
    return inverse(scene, elastic=elastic, **SPAN)


def weighed(law: Callable[..., object]) -> Result:
    return static(hanging(0.0, Load("wind", "rod.b", function=law)))


def pinned(far: tuple[float, float, float]) -> object:
    joints = (Joint("near", "spherical", "ground.O", "cloud.a"), Joint("far", "spherical", "ground.F", "cloud.b"))
    return assemble(Scene((Body("cloud", cloud(3, stiffness=50.0)),), joints, ground={"O": (0, 0, 0), "F": far}))


def pushed(angle: float) -> object:
    """A slider-crank whose slider is driven."""
    start = 0.2 * np.cos(angle) + np.sqrt(0.49 - (0.2 * np.sin(angle)) ** 2)
    return assemble(
        slider_crank(0.2, 0.7, Driver("push", "guide", polynomial(start, 0.1), coordinate="stroke"), start=angle)
    )


SPRUNG = replace(HINGED, forces=(JointSpring("s", "hinge", 1.0),))
OTHER = [
    Case(without_ida, p(reference, HINGED, method=IDA(), **SPAN)),
    Case(lambda: weighed(lambda t, state: 1 / 0), lambda: weighed(lambda t, state: (0.1, 0, 0))),
    Case(p(pinned, (50.0, 0, 0)), lambda: pinned(tuple(cloud(3).interface("b").position - cloud(3).interface("a").position))),
]  # fmt: skip
CASES = RESUMED + KNOWN + OTHER
