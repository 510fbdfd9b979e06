"""The benchmark set: thirteen scenes in which every body that can be flexible is, with the outputs that are asked of each.

    python -m examples.scene_set          # what is in it, and what building each scene takes

Bodies are beams with Craig-Bampton modes, section stress and geometric stiffening, so that a scene is built in well under a
second. Nothing is simplified in a scene: which bodies may be rigid, which modes and terms may go, is for others to find out.
The bending frequencies and the spin profile of the rotating beam are those of Simo & Vu-Quoc (1987), J. Sound Vib. 119, 487;
the pendulum is the plate strip of E = 7e10 and 7e9 Pa that is hinged at one end and released from the horizontal.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

import ffr_prep as fp
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import TimeFunction, harmonic
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement
from ffr_prep.body import FlexibleBody, rigid_body
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, ReferenceConditions, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import Section, circle, general, rectangle, tube

GRAVITY = (0.0, -9.81, 0.0)
STEEL = Material("steel", 2e11, 0.3, 7870.0)
ALUMINIUM = Material("aluminium", 7e10, 0.33, 2700.0)
DAMPING = 0.01  # modal damping ratio where nothing else is said


@dataclass(frozen=True)
class Case:
    """A scene to be simulated.

    scene   : makes the scene with everything flexible, all modes and all terms
    end     : end of the run [s];  output_step : between rows [s]
    outputs : scalar histories that matter, named as in a result; "<body>.stress" is the largest von Mises stress
    """

    name: str
    scene: Callable[[], Scene]
    end: float
    output_step: float
    outputs: tuple[str, ...]


# ---- bodies ---------------------------------------------------------------------------------------------------------


@cache
def beam(
    name: str, length: float, section: Section, material: Material, modes: int, reference: ReferenceConditions
) -> FlexibleBody:
    """A straight beam along x' from interface "a" to "b", with `modes` normal modes and six of its interfaces."""
    member = Member(section, material, orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (length, 0, 0)], member, elements=16), a=(0, 0, 0), b=(length, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(name=name, reference=reference, reduction=CraigBampton(modes), stress=True),
    )


def bar(name: str, length: float, section: Section, material: Material = STEEL, modes: int = 8) -> FlexibleBody:
    """A beam whose x' axis passes through both its ends."""
    return beam(name, length, section, material, modes, SimplySupported("a", "b"))


def cantilever(name: str, length: float, section: Section, material: Material, modes: int = 8) -> FlexibleBody:
    """A beam whose frame moves with its end "a"."""
    return beam(name, length, section, material, modes, FixedTo("a"))


def flat(d: float) -> Section:
    """Area and bending in the plane of a round bar of diameter d [m], but 1.7 times as stiff across: no frequency twice."""
    round_bar = circle(d)
    return replace(round_bar, name=f"flat {d:g} m", Iy=1.7 * round_bar.Iz, mass_moments=None, outline=(), shear=())


def block(name: str, mass: float, size: float) -> FlexibleBody:
    """A rigid cube with a point "pin" at its centre."""
    return rigid_body(name, mass=mass, inertia=np.full(3, mass * size**2 / 6), points={"pin": np.zeros(3)})


def placed(name: str, model: FlexibleBody, start: tuple[float, float], end: tuple[float, float]) -> Body:
    """A body in the xy plane whose x' axis points from start to end [m]."""
    angle = float(np.arctan2(end[1] - start[1], end[0] - start[0]))
    return Body(name, model, position=(*start, 0.0), rotation=(0, 0, angle), damping=DAMPING)


def distance(start: tuple[float, float], end: tuple[float, float]) -> float:
    return float(np.hypot(end[0] - start[0], end[1] - start[1]))


# ---- scenes ---------------------------------------------------------------------------------------------------------


def slider_crank(speed: float) -> Scene:
    """Crank of 0.15 m brought to a speed [rad/s] within half a turn, slender rod of 0.3 m, slider of half the rod's mass."""
    crank, rod = bar("crank", 0.15, rectangle(0.02, 0.03)), bar("rod", 0.3, flat(0.006))
    bodies = (
        placed("crank", crank, (0, 0), (0.15, 0)),
        placed("rod", rod, (0.15, 0), (0.45, 0)),
        Body("slider", block("slider", rod.mass / 2, 0.02), position=(0.45, 0, 0)),
    )
    joints = (
        Joint("bearing", "revolute", "ground.O", "crank.a"),
        Joint("crankpin", "revolute", "crank.b", "rod.a"),
        Joint("wrist", "revolute", "rod.b", "slider.pin"),
        Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
    )
    motor = Driver("motor", "bearing", speeding_up(speed, 2 * np.pi / speed))
    return Scene(bodies, joints, (motor,), ground={"O": (0, 0, 0)}, name=f"slider-crank at {speed:g} rad/s")


def pendulum(modulus: float) -> Scene:
    """A strip of 1.2 m and 9 mm hinged at one end, released from the horizontal; undamped; modulus [Pa]."""
    rod = bar("rod", 1.2, rectangle(0.2, 0.009), Material("metal", modulus, 0.3, 5540.0))
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a")
    return Scene((Body("rod", rod),), (hinge,), ground={"O": (0, 0, 0)}, gravity=GRAVITY, name="pendulum")


def spin_up(speed: float) -> Scene:
    """A beam of 10 m, first frequency 3.8 rad/s, on an axis that speeds up to `speed` [rad/s] within 15 s."""
    material = Material("beam", 2.8e7, 0.0, 1.2)
    section = general("unit area", A=1.0, Iy=5e-3, Iz=5e-4, J=2e-3, ky=5 / 7, kz=5 / 7)
    blade = cantilever("blade", 10.0, section, material)
    hub = rigid_body("hub", mass=1.0, inertia=np.ones(3), points={"axis": np.zeros(3)})
    joints = (Joint("axle", "revolute", "ground.O", "hub.axis"), Joint("clamp", "fixed", "hub.axis", "blade.a"))
    bodies = (Body("hub", hub), Body("blade", blade))
    motor, tip = (
        Driver("motor", "axle", speeding_up(speed, 15.0)),
        Measurement("tip", "hub.axis", "blade.b", axes="hub"),
    )
    return Scene(bodies, joints, (motor,), ground={"O": (0, 0, 0)}, measurements=(tip,), name="spin-up")


def four_bar(speed: float) -> Scene:
    """Crank of 0.1 m brought to a speed [rad/s] within half a turn, coupler of 0.4 m, rocker of 0.3 m; aluminium bars."""
    A, B, C, D = (0.0, 0.0), (0.1, 0.0), _corner((0.1, 0.0), (0.4, 0.0), 0.4, 0.3), (0.4, 0.0)
    section = rectangle(0.02, 0.012)
    bodies = (
        placed("crank", bar("crank", distance(A, B), section, ALUMINIUM), A, B),
        placed("coupler", bar("coupler", distance(B, C), section, ALUMINIUM), B, C),
        placed("rocker", bar("rocker", distance(D, C), section, ALUMINIUM), D, C),
    )
    joints = (
        Joint("A", "revolute", "ground.A", "crank.a"),
        Joint("B", "revolute", "crank.b", "coupler.a"),
        Joint("C", "revolute", "coupler.b", "rocker.b"),
        Joint("D", "revolute", "ground.D", "rocker.a"),
    )
    ground, motor = {"A": (*A, 0), "D": (*D, 0)}, Driver("motor", "A", speeding_up(speed, 2 * np.pi / speed))
    return Scene(bodies, joints, (motor,), ground=ground, name="four-bar")


def six_bodies() -> Scene:
    """A four-bar whose rocker drives a slider by a slender rod, and a bar that hangs on the slider: six bodies."""
    base = four_bar(25.0)
    C = _corner((0.1, 0.0), (0.4, 0.0), 0.4, 0.3)
    slider, height = (C[0] + float(np.sqrt(0.5**2 - 0.02**2)), C[1] + 0.02), C[1] + 0.02
    rod = bar("rod", distance(C, slider), flat(0.004))
    hanger = bar("hanger", 0.2, rectangle(0.02, 0.01))
    bodies = (
        *base.bodies,
        placed("rod", rod, C, slider),
        Body("slider", block("slider", 0.1, 0.02), position=(*slider, 0)),
        placed("hanger", hanger, slider, (slider[0], slider[1] - 0.2)),
    )
    joints = (
        *base.joints,
        Joint("E", "revolute", "rocker.b", "rod.a"),
        Joint("F", "revolute", "rod.b", "slider.pin"),
        Joint("guide", "translational", "ground.G", "slider.pin", axis=(1, 0, 0)),
        Joint("H", "revolute", "slider.pin", "hanger.a"),
    )
    ground = {**base.ground, "G": (0.0, height, 0.0)}
    return replace(base, bodies=bodies, joints=joints, ground=ground, name="six bodies, one slender")


def chain(count: int = 6) -> Scene:
    """Links of 0.3 m in a row, the first held by the ground, released from the horizontal."""
    link = bar("link", 0.3, rectangle(0.017, 0.005), ALUMINIUM)
    ends = ["ground.O", *(f"link{k}.b" for k in range(count - 1))]
    bodies = tuple(Body(f"link{k}", link, position=(0.3 * k, 0, 0), damping=DAMPING) for k in range(count))
    joints = tuple(Joint(f"joint{k}", "revolute", ends[k], f"link{k}.a") for k in range(count))
    return Scene(bodies, joints, ground={"O": (0, 0, 0)}, gravity=GRAVITY, name="chain")


def robot() -> Scene:
    """Three driven axes, yaw about y and two bends; the last link is a thin tube."""
    column, upper = bar("column", 0.4, tube(0.12, 0.004)), bar("upper", 0.6, tube(0.08, 0.003))
    fore = cantilever("fore", 0.8, tube(0.016, 0.001), ALUMINIUM)
    tool = block("tool", 0.1, 0.03)
    bodies = (
        Body("column", column, position=(0, 0, 0), rotation=(0, 0, np.pi / 2), damping=DAMPING),
        Body("upper", upper, position=(0, 0.4, 0), damping=DAMPING),
        Body("fore", fore, position=(0.6, 0.4, 0), damping=DAMPING),
        Body("tool", tool, position=(1.4, 0.4, 0)),
    )
    joints = (
        Joint("yaw", "revolute", "ground.O", "column.a", axis=(0, 1, 0), axis_j=(1, 0, 0)),
        Joint("shoulder", "revolute", "column.b", "upper.a"),
        Joint("elbow", "revolute", "upper.b", "fore.a"),
        Joint("wrist", "fixed", "fore.b", "tool.pin"),
    )
    moves = (("yaw", 0.8, 0.0), ("shoulder", 0.3, -np.pi / 2), ("elbow", -0.5, 0.0))
    drivers = tuple(Driver(f"{name}_motor", name, _swing(angle, start)) for name, angle, start in moves)
    return Scene(bodies, joints, drivers, ground={"O": (0, 0, 0)}, name="robot arm, light last link")


def appendage() -> Scene:
    """A free stiff bus that a short torque turns, with a soft boom and a mass at its tip."""
    bus = bar("bus", 0.5, rectangle(0.2, 0.2), ALUMINIUM)
    boom = cantilever("boom", 2.0, tube(0.02, 0.001), ALUMINIUM)
    bodies = (
        Body("bus", bus, damping=DAMPING),
        Body("boom", boom, position=(0.5, 0, 0), damping=DAMPING),
        Body("mass", block("mass", 0.2, 0.05), position=(2.5, 0, 0)),
    )
    joints = (Joint("root", "fixed", "bus.b", "boom.a"), Joint("tip", "fixed", "boom.b", "mass.pin"))
    push = harmonic(amplitude=4.0, frequency=0.5)
    loads = (Load("thruster", "bus.a", moment=(0.0, formula("1.5 * sin(2 * pi * t) ** 2"), push)),)
    return Scene(bodies, joints, loads=loads, name="soft appendage")


def suspended() -> Scene:
    """A slow stiff four-bar whose rocker end hangs on a spring: nothing in it bends to speak of."""
    scene = four_bar(2.0)
    spring = SpringDamper("spring", "ground.S", "rocker.b", 200.0, 1.0, free_length=0.2)
    return replace(
        scene,
        springs=(spring,),
        gravity=GRAVITY,
        ground={**scene.ground, "S": (0.7, 0.3, 0.0)},
        name="slow stiff four-bar",
    )


def speeding_up(speed: float, time: float) -> TimeFunction:
    """An angle from rest to `speed` [rad/s] within `time` [s], then at that speed; smooth enough not to ring."""
    u = f"min(t, {time})"
    ramp = f"{speed / time} * ({u} ** 2 / 2 + {(time / (2 * np.pi)) ** 2} * (cos({2 * np.pi / time} * {u}) - 1))"
    return formula(f"{ramp} + {speed} * max(t - {time}, 0)")


def _swing(angle: float, start: float) -> TimeFunction:
    """From rest at `start` [rad] to `start + angle` and back within a second, without jumps of the acceleration."""
    return formula(f"{start} + {angle} * (smooth(2 * t) - smooth(2 * t - 1))")


def _corner(one: tuple[float, float], other: tuple[float, float], r: float, s: float) -> tuple[float, float]:
    """The point above the line from one to other at the distances r from one and s from other."""
    base = np.subtract(other, one)
    d = float(np.hypot(*base))
    along = (d**2 + r**2 - s**2) / (2 * d)
    up = float(np.sqrt(r**2 - along**2))
    ex = base / d
    x, y = np.asarray(one) + along * ex + up * np.array([-ex[1], ex[0]])
    return float(x), float(y)


# ---- the set --------------------------------------------------------------------------------------------------------

CASES = (
    Case("slider-crank-10", partial(slider_crank, 10.0), 1.26, 0.014, ("slider.pin.position.x",)),
    Case("slider-crank-50", partial(slider_crank, 50.0), 0.252, 0.0021, ("slider.pin.position.x", "rod.stress")),
    Case("slider-crank-150", partial(slider_crank, 150.0), 0.126, 0.0007, ("slider.pin.position.x", "rod.stress")),
    Case("pendulum-stiff", partial(pendulum, 7e10), 1.0, 0.01, ("rod.b.position.x", "rod.b.position.y")),
    Case("pendulum-soft", partial(pendulum, 7e9), 1.0, 0.01, ("rod.b.position.x", "rod.b.position.y")),
    Case("spin-up-below", partial(spin_up, 2.0), 20.0, 0.1, ("measured.tip.y",)),
    Case("spin-up-above", partial(spin_up, 6.0), 20.0, 0.1, ("measured.tip.y", "blade.b.position.x")),
    Case("six-bodies", six_bodies, 0.75, 0.005, ("slider.pin.position.x", "rod.stress")),
    Case("chain", chain, 0.5, 0.005, ("link5.b.position.x", "link5.b.position.y")),
    Case("robot", robot, 1.0, 0.01, ("tool.pin.position.x", "tool.pin.position.y", "fore.stress")),
    Case("four-bar-slow", suspended, 6.4, 0.04, ("rocker.b.position.x", "spring.tension")),
    Case("four-bar-fast", partial(four_bar, 60.0), 0.21, 0.0015, ("rocker.b.position.x", "coupler.stress")),
    Case("appendage", appendage, 4.0, 0.02, ("mass.pin.position.y", "mass.pin.position.z", "bus.a.position.y")),
)


def case(name: str) -> Case:
    """The case of that name."""
    return next(one for one in CASES if one.name == name)


def main() -> None:
    from ffr_dyn.consistency.assemble import assemble

    for one in CASES:
        began = time.perf_counter()
        scene = one.scene()
        built = time.perf_counter() - began
        found = assemble(scene)
        modes = ", ".join(f"{body.name} {body.model.n}" for body in scene.bodies if body.model.n)
        print(
            f"{one.name:18} built in {built:5.2f} s, {found.degrees_of_freedom:3d} degrees of freedom; modes: {modes}"
        )
        for note in found.notes:
            print(f"{'':18} {note}")


if __name__ == "__main__":
    main()
