"""One machine in other units of length, mass and time: micrometres and microseconds, ten kilometres and hours.

Every number of a result is that of the machine of a metre, a kilogram and a second, times its units.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.functions.time_functions import piecewise


@dataclass(frozen=True)
class Units:
    """[m], [kg] and [s] that are one."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def inertia(self) -> float:
        return self.mass * self.length**2

    @property
    def force(self) -> float:
        return self.mass * self.length / self.time**2

    @property
    def moment(self) -> float:
        return self.force * self.length

    @property
    def stiffness(self) -> float:
        return self.mass / self.time**2

    @property
    def damping(self) -> float:
        return self.mass / self.time


ONE, SMALL, LARGE = Units(), Units(1e-3, 1e-9), Units(1e4, 1e12)
CHIP, SLOW = Units(1e-6, 1e-16, 1e-6), Units(1e4, 1e10, 3600.0)
LIGHT, HEAVY = Units(mass=1e-6), Units(mass=1e6)
NAMES = {"chip": CHIP, "large": LARGE, "small": SMALL, "slow": SLOW, "light": LIGHT, "heavy": HEAVY}


def quickly(*quick: str) -> list:
    """All units; only the quick ones are not marked slow."""
    marks = {name: () if name in quick else (pytest.mark.slow,) for name in NAMES}
    return [pytest.param(units, id=name, marks=marks[name]) for name, units in NAMES.items()]


def agrees(case, of: Units, tolerance: float) -> None:
    for name, value in case(ONE).items():
        found = case(of)[name]
        np.testing.assert_allclose(found, value, rtol=tolerance, atol=tolerance * np.abs(value).max(), err_msg=name)


def rigid(of: Units, name: str, mass: float, inertia, centre=(0, 0, 0), **points) -> fp.FlexibleBody:
    return fd.rigid_body(
        name,
        mass=mass * of.mass,
        inertia=np.array(inertia) * of.inertia,
        centre_of_mass=of.length * np.array(centre),
        points={key: of.length * np.array(at, float) for key, at in points.items()},
    )


@cache
def strip(of: Units, height: float, reference) -> fp.FlexibleBody:
    """A strip of 1 m, 3 cm wide, in these units; of aluminium where they are one."""
    material = fp.Material("m", E=7e10 * of.force / of.length**2, nu=0.3, rho=2700.0 * of.mass / of.length**3)
    member = fp.Member(fp.rectangle(b=0.03 * of.length, h=height * of.length), material, (0, 1, 0))
    line = fp.polyline([(0, 0, 0), (of.length, 0, 0)], member, elements=6)
    frame = fp.named(line, root=(0, 0, 0), tip=(of.length, 0, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
    return fp.reduce(model, fp.Request(name="strip", reference=reference, reduction=fp.CraigBampton(1), linear=True))


def from_rest(of: Units, height: float, lasts: float, start: float = 0.0):
    """To rest, with five derivatives zero at both ends."""
    step = np.array([0, 0, 0, 0, 0, 0, 462, -1980, 3465, -3080, 1386, -252.0])
    values = height * step / (lasts * of.time) ** np.arange(12.0) + start * np.eye(12)[0]
    return piecewise([0.0, lasts * of.time], of.length * values[None])


# ---- forces that realise known motions ---------------------------------------------------------------------------------


@cache
def two_carts(of: Units) -> dict[str, np.ndarray]:
    """A force on one moves the other by a spring: the bounded solution."""
    cart = rigid(of, "cart", 1.0, (1, 1, 1), c=(0, 0, 0))
    scene = fd.Scene(
        [fd.Body("one", cart), fd.Body("two", cart, position=(of.length, 0, 0))],
        [fd.Joint(f"on_{name}", "translational", "ground.O", f"{name}.c", axis=(1, 0, 0)) for name in ("one", "two")],
        [fd.Driver("go", "on_two", from_rest(of, 0.5, 0.6, 1.0), coordinate="stroke")],
        springs=[fd.SpringDamper("s", "one.c", "two.c", stiffness=400 * of.stiffness, free_length=of.length)],
        ground={"O": (0, 0, 0)},
    )
    push = fd.JointEffort("push", "on_one", "stroke")
    found = fd.mixed(scene, unknown=(push,), end=0.6 * of.time, output_step=0.05 * of.time)
    return {"push": found["push.effort"] / of.force, "stroke": found["on_one.stroke"] / of.length}


@pytest.mark.parametrize("of", quickly("chip"))
def test_a_force_by_way_of_a_spring(of: Units):
    """Before, nothing held the carts of a chip against the forces there."""
    agrees(two_carts, of, 1e-7)


@cache
def swung(of: Units) -> dict[str, np.ndarray]:
    """A slanting push moves a cart, and the rod that hangs from it on a spring swings: the causal solution."""
    cart = rigid(of, "cart", 1.0, (1, 1, 1), c=(0, 0, 0))
    rod = rigid(of, "rod", 1.0, (1e-3, 1 / 12, 1 / 12), (0.5, 0, 0), o=(0, 0, 0))
    down = -np.pi / 2
    spring = fd.JointSpring("k", "hinge", stiffness=2 * of.moment, free=down, damping=0.1 * of.moment * of.time)
    scene = fd.Scene(
        [fd.Body("cart", cart), fd.Body("rod", rod, rotation=(0, 0, down))],
        [
            fd.Joint("rail", "translational", "ground.O", "cart.c", axis=(1, 0, 0)),
            fd.Joint("hinge", "revolute", "cart.c", "rod.o"),
        ],
        [fd.Driver("go", "rail", from_rest(of, 0.1, 0.3), coordinate="stroke")],
        forces=[spring],
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81 * of.length / of.time**2, 0),
    )
    push = fd.MarkerEffort("push", "cart.c", (0.8, 0.6, 0))
    span = {"end": 0.15 * of.time, "output_step": 0.05 * of.time}
    found = fd.mixed(scene, unknown=(push,), solution=fd.Causal(tolerance=1e-8), **span)
    return {"push": found["push.effort"] / of.force, "angle": found["hinge.angle"]}


@pytest.mark.parametrize("of", quickly("large"))
def test_a_push_that_swings_what_hangs(of: Units):
    """Before, the unknown force of a large one no longer determined the known motion."""
    agrees(swung, of, 1e-9)


@cache
def flexible_arm(of: Units) -> dict[str, np.ndarray]:
    """The moment at the hub moves the tip on its path."""
    hub = rigid(of, "hub", 0.2, (0.02, 0.02, 0.02), axle=(0, 0, 0), flange=(0, 0, 0))
    scene = fd.Scene(
        [fd.Body("hub", hub), fd.Body("arm", strip(of, 0.004, fp.FixedTo("root")), damping=0.01)],
        [
            fd.Joint("bearing", "revolute", "ground.O", "hub.axle"),
            fd.Joint("weld", "fixed", "hub.flange", "arm.root"),
        ],
        [fd.PointDriver("path", "ground.O", "arm.tip", y=from_rest(of, 0.4, 0.6))],
        ground={"O": (0, 0, 0)},
    )
    motor = fd.JointEffort("motor", "bearing")
    found = fd.mixed(scene, unknown=(motor,), end=0.6 * of.time, output_step=0.05 * of.time)
    return {"motor": found["motor.effort"] / of.moment, "time": found.time / of.time}


@pytest.mark.parametrize("of", quickly())
def test_a_flexible_arm_on_its_path(of: Units):
    """Before, no position belonged to the known motions of a small one, and a matrix of a large one was singular."""
    agrees(flexible_arm, of, 1e-7)


# ---- steady motions ----------------------------------------------------------------------------------------------------


def on_bearings(of: Units, off: float) -> fd.Scene:
    """A flexible shaft with an overhung disc, off its centre."""
    shaft = strip(of, 0.03, fp.MeanAxis())
    disc = rigid(of, "disc", 2.0, (0.032, 0.017, 0.017), (0, off, 0), c=(0, 0, 0))
    at, turn = {"root": (0, 0, 0), "tip": (of.length, 0, 0)}, {"omega_bar": (50 / of.time, 0, 0)}
    stiff, damped = (1e6 * of.stiffness,) * 3 + (0,) * 3, (0.0 if off else 100 * of.damping,) * 3 + (0,) * 3
    return fd.Scene(
        [fd.Body("shaft", shaft, **turn), fd.Body("disc", disc, position=at["tip"], **turn)],
        [fd.Joint("hub", "fixed", "shaft.tip", "disc.c")],
        forces=[fd.Bushing(f"at_{end}", f"ground.{end}", f"shaft.{end}", stiff, damped) for end in at],
        ground=at,
    )


@cache
def rotor(of: Units) -> dict[str, np.ndarray]:
    unbalanced = fd.steady(on_bearings(of, 0.01))
    diagram = fd.campbell(on_bearings(of, 0.0), speeds=(0.0, 300 / of.time), modes=4)
    return {"whirls": unbalanced["disc.R"] / of.length, "frequencies": diagram["frequencies"] * of.time}


@pytest.mark.parametrize("of", quickly("chip"))
def test_a_rotor_and_its_diagram(of: Units):
    """Before, something sped up the disc on a chip, or the hub let bodies move aside together."""
    agrees(rotor, of, 1e-7)


@cache
def governor(of: Units) -> dict[str, np.ndarray]:
    """An arm that swings out, and that a Python function drags."""
    arm = rigid(of, "arm", 1.0, (0.01 / 12, 1 / 12, 1 / 12), (0.5, 0, 0), a=(0, 0, 0), b=(1, 0, 0))
    spindle = rigid(of, "spindle", 1.0, (0.1, 0.1, 0.1), o=(0, 0, 0))

    def against(t, state):
        velocity = np.asarray(state.velocity("arm.b")) * of.time / of.length
        return np.concatenate([-3.0 * of.force * velocity, -0.2 * of.moment * velocity])

    scene = fd.Scene(
        [fd.Body("spindle", spindle), fd.Body("arm", arm, rotation=(0, 0.5, 0))],
        [
            fd.Joint("bearing", "revolute", "ground.O", "spindle.o"),
            fd.Joint("pin", "revolute", "spindle.o", "arm.a", axis=(0, 1, 0)),
        ],
        [fd.Driver("motor", "bearing", fd.polynomial(0.0, 6.0 / of.time))],
        loads=[fd.Load("air", "arm.b", function=against)],
        ground={"O": (0, 0, 0)},
        gravity=(0, 0, -9.81 * of.length / of.time**2),
    )
    speeds = np.array([6.0, 12.0]) / of.time
    out, diagram = (run(scene, speeds=speeds, turn="motor") for run in (fd.steady, fd.campbell))
    return {"out": out["arm.b.position"] / of.length, "frequencies": diagram["frequencies"] * of.time}


@pytest.mark.parametrize("of", quickly())
def test_a_governor_in_air(of: Units):
    agrees(governor, of, 1e-6)


# ---- small motions -----------------------------------------------------------------------------------------------------


@cache
def hanging(of: Units) -> dict[str, np.ndarray]:
    """A mass on a spring under its weight: its rest, its frequency, and what a force on it does."""
    mass = rigid(of, "m", 2.0, (1, 1, 1), c=(0, 0, 0))
    spring = fd.JointSpring(
        "s", "rail", stiffness=300 * of.stiffness, damping=2 * of.damping, free=0.2 * of.length, coordinate="stroke"
    )
    scene = fd.Scene(
        [fd.Body("m", mass)],
        [fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))],
        forces=[spring],
        ground={"O": (0, 0, 0)},
        gravity=(9.81 * of.length / of.time**2, 0, 0),
    )
    at_rest = fd.static(scene)
    there = fd.scene_at(scene, at_rest)
    wanted = {"input": "m.c.force.x", "frequencies": np.array([0.5, 1.5, 5.0]) / of.time}
    found = fd.response(there, outputs=["m.c.position.x"], **wanted)
    based = fd.response(there, outputs=["m.c.position.x"], input="base.x", frequencies=wanted["frequencies"])
    return {
        "stroke": at_rest["rail.stroke"] / of.length,
        "rates": np.sort_complex(np.linalg.eigvals(fd.linearise(there).A) * of.time),
        "gain": found["gain"] * of.stiffness,
        "of the base": based["gain"] / of.time**2,
    }


@pytest.mark.parametrize("of", quickly("chip", "large"))
def test_what_hangs_on_a_spring(of: Units):
    """Before, one newton was lost beside the weight of a large one, and moved nothing."""
    agrees(hanging, of, 1e-8)
