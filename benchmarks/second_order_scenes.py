"""The bodies and scenes of `benchmarks.second_order`: beams whole or in parts, under any reference conditions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

import ffr_prep as fp
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body, with_point
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, ReferenceConditions, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import Section, circle, rectangle

Array = np.ndarray

REFERENCES = {"fixed": FixedTo("root"), "supported": SimplySupported("root", "tip"), "mean": MeanAxis()}
GRAVITY = (0.0, -9.81, 0.0)
ELEMENTS = 48  # of a whole beam
CRANK, CRANK_SPEED = 0.15, 150.0  # m, rad/s


@cache
def beam(
    section: Section, material: Material, length: float, modes: int, reference: ReferenceConditions, elements: int = ELEMENTS
) -> FlexibleBody:
    """A beam along x with the interfaces "root" and "tip", `modes` fixed-interface modes, and two markers on opposite sides of
    its middle, "above" and "below"."""
    frame = polyline([(0, 0, 0), (length, 0, 0)], Member(section, material, (0, 1.0, 0)), elements=elements)
    body = fp.reduce(
        fp.from_frame(
            named(frame, root=(0, 0, 0), tip=(length, 0, 0)), [InterfaceRegion("root"), InterfaceRegion("tip")]
        ),
        fp.Request(name="beam", reference=reference, reduction=CraigBampton(modes)),
    )
    side = np.ptp(body.surface.points[:, 1]) / 2
    edge = np.array([length / 2, side, body.surface.points[:, 2].max()])
    return with_point(with_point(body, "above", edge), "below", edge * (1, -1, 1))


def row(
    section: Section, material: Material, length: float, modes: int, reference: ReferenceConditions, parts: int
) -> tuple[tuple[Body, ...], tuple[Joint, ...]]:
    """A beam along x from the origin, in equal parts "p0", "p1", ... that fixed joints hold together."""
    size = length / parts
    part = beam(section, material, size, modes, reference, max(ELEMENTS // parts, 12))
    bodies = tuple(Body(f"p{k}", part, position=(k * size, 0, 0)) for k in range(parts))
    return bodies, tuple(Joint(f"cut{k}", "fixed", f"p{k - 1}.tip", f"p{k}.root") for k in range(1, parts))


def places(parts: int) -> tuple[str, ...]:
    """Markers at the root and the tip of a beam in parts, and one or two whose mean is its middle."""
    between = ("p0.above", "p0.below") if parts == 1 else (f"p{parts // 2}.root",)
    return ("p0.root", f"p{parts - 1}.tip", *between)


# ---- pendulum ---------------------------------------------------------------------------------------------------------


def pendulum(E: float, modes: int, reference: ReferenceConditions, parts: int = 1) -> Scene:
    """L = 1.2 m, 0.2 m x 9 mm, rho = 5540 kg/m^3, hinged at the origin, released from the horizontal."""
    bodies, cuts = row(rectangle(0.2, 0.009), Material("metal", E, 0.3, 5540.0), 1.2, modes, reference, parts)
    hinge = Joint("hinge", "revolute", "ground.O", "p0.root")
    return Scene(bodies, (hinge, *cuts), ground={"O": (0, 0, 0)}, gravity=GRAVITY)


# ---- slider-crank -----------------------------------------------------------------------------------------------------


def slider_crank(modes: int, reference: ReferenceConditions, parts: int = 1) -> Scene:
    """Rod of 0.3 m and 6 mm on a crank of 0.15 m at 150 rad/s, slider of half its mass; the rod moves as a rigid one."""
    bodies, cuts = row(circle(0.006), Material("steel", 2e11, 0.3, 7870.0), 0.3, modes, reference, parts)
    spin = -CRANK * CRANK_SPEED / 0.3
    rod = []
    for body in bodies:
        x = float(body.position[0])
        rod.append(
            Body(body.name, body.model, position=(CRANK + x, 0, 0), velocity=(0, -spin * (0.3 - x), 0),
                 omega_bar=(0, 0, spin))
        )  # fmt: skip
    mass = sum(body.model.mass for body in bodies)
    ends = {"hub": np.zeros(3), "pin": np.array([CRANK, 0, 0])}
    crank = rigid_body("crank", mass=0.1, inertia=np.full(3, 1e-4), points=ends)
    slider = rigid_body("slider", mass=mass / 2, inertia=np.full(3, 1e-5), points={"pin": np.zeros(3)})
    others = (
        Body("crank", crank, omega_bar=(0, 0, CRANK_SPEED)),
        Body("slider", slider, position=(CRANK + 0.3, 0, 0)),
    )
    joints = (
        Joint("bearing", "revolute", "ground.O", "crank.hub"),
        Joint("crankpin", "revolute", "crank.pin", "p0.root"),
        *cuts,
        Joint("wrist", "revolute", f"p{parts - 1}.tip", "slider.pin"),
        Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
    )
    motor = Driver("motor", "bearing", polynomial(0.0, CRANK_SPEED))
    return Scene((*rod, *others), joints, (motor,), ground={"O": (0, 0, 0)})


# ---- cantilevers ------------------------------------------------------------------------------------------------------

PRINCETON = Material("aluminium", 71.7e9, 0.31, 2700.0)
PRINCETON_LENGTH, PRINCETON_SECTION = 0.508, rectangle(0.0032024, 0.0123777)
PRINCETON_FORCE = 8.896  # N


def princeton(degrees: float, modes: int, reference: ReferenceConditions, parts: int) -> Scene:
    """Cantilever along x, its height along y, with a dead force at its end, `degrees` from the height towards z."""
    bodies, cuts = row(PRINCETON_SECTION, PRINCETON, PRINCETON_LENGTH, modes, reference, parts)
    angle = np.radians(degrees)
    force = PRINCETON_FORCE * np.array([0.0, np.cos(angle), np.sin(angle)])
    load = Load("push", f"p{parts - 1}.tip", force=tuple(force))
    return Scene(bodies, (Joint("clamp", "fixed", "ground.O", "p0.root"), *cuts), loads=(load,), ground={"O": (0, 0, 0)})


def rotor(body: FlexibleBody, motion: Callable[..., object] | object, speed: float = 0.0) -> Scene:
    """A beam from the axis z outwards, whose root turns by a function of time, in its stretch of steady rotation."""
    stretch = speed**2 * (body.rP_dm[0, 0] + body.rP_dm[1, 1]) / body.omega2
    start = Body("p0", body, omega_bar=(0, 0, speed), q=stretch)
    axis = Joint("axis", "revolute", "ground.O", "p0.root")
    return Scene((start,), (axis,), (Driver("motor", "axis", motion),), ground={"O": (0, 0, 0)})
