"""The bodies, scenes and figures of `benchmarks.second_order`: beams, whole or in parts, under any reference conditions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import ParamSpec

import numpy as np

import ffr_prep as fp
from benchmarks.preparation import Figure
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body, with_point
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, ReferenceConditions, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import Section, circle, rectangle

Array = np.ndarray
P = ParamSpec("P")

REFERENCES = {"fixed": FixedTo("root"), "supported": SimplySupported("root", "tip"), "mean": MeanAxis()}
GRAVITY = (0.0, -9.81, 0.0)
ELEMENTS = 48  # of a whole beam
CRANK, CRANK_SPEED = 0.15, 150.0  # m, rad/s
ROD = replace(circle(0.006), ky=0.9, kz=0.9)  # shear factors of the reference


@cache
def beam(
    section: Section, material: Material, length: float, modes: int, reference: ReferenceConditions, parts: int = 1
) -> FlexibleBody:
    """A beam along x from the origin, whole or in equal parts with `modes` fixed-interface modes each; its interfaces are
    "root" and "tip", markers on opposite sides of its middle "above" and "below"."""
    elements = max(ELEMENTS, 12 * parts)
    frame = polyline([(0, 0, 0), (length, 0, 0)], Member(section, material, (0, 1.0, 0)), elements=elements)
    body = fp.reduce(
        fp.from_frame(
            named(frame, root=(0, 0, 0), tip=(length, 0, 0)), [InterfaceRegion("root"), InterfaceRegion("tip")]
        ),
        fp.Request(
            name="beam", reference=reference, reduction=CraigBampton(modes), parts=None if parts == 1 else parts
        ),
    )
    side = np.ptp(body.surface.points[:, 1]) / 2
    edge = np.array([length / 2, side, body.surface.points[:, 2].max()])
    return with_point(with_point(body, "above", edge), "below", edge * (1, -1, 1))


# ---- pendulum ---------------------------------------------------------------------------------------------------------


STRIP = rectangle(0.2, 0.009)
IN_PLANE = replace(STRIP, Iy=100 * STRIP.Iy, J=100 * STRIP.J)  # whose lowest modes all lie in the plane


def pendulum(E: float, modes: int, reference: ReferenceConditions, parts: int = 1, section: Section = STRIP) -> Scene:
    """L = 1.2 m, 0.2 m x 9 mm, rho = 5540 kg/m^3, hinged at the origin, released from the horizontal."""
    model = beam(section, Material("metal", E, 0.3, 5540.0), 1.2, modes, reference, parts)
    hinge = Joint("hinge", "revolute", "ground.O", "beam.root")
    return Scene((Body("beam", model),), (hinge,), ground={"O": (0, 0, 0)}, gravity=GRAVITY)


# ---- slider-crank -----------------------------------------------------------------------------------------------------


def slider_crank(modes: int, reference: ReferenceConditions, parts: int = 1) -> Scene:
    """Rod of 0.3 m and 6 mm on a crank of 0.15 m at 150 rad/s, slider of half its mass; the rod moves as a rigid one."""
    rod = beam(ROD, Material("steel", 2e11, 0.3, 7870.0), 0.3, modes, reference, parts)
    spin = -CRANK * CRANK_SPEED / 0.3
    ends = {"hub": np.zeros(3), "pin": np.array([CRANK, 0, 0])}
    crank = rigid_body("crank", mass=0.1, inertia=np.full(3, 1e-4), points=ends)
    slider = rigid_body("slider", mass=rod.mass / 2, inertia=np.full(3, 1e-5), points={"pin": np.zeros(3)})
    bodies = (
        Body("beam", rod, position=(CRANK, 0, 0), velocity=(0, -spin * 0.3, 0), omega_bar=(0, 0, spin)),
        Body("crank", crank, omega_bar=(0, 0, CRANK_SPEED)),
        Body("slider", slider, position=(CRANK + 0.3, 0, 0)),
    )
    joints = (
        Joint("bearing", "revolute", "ground.O", "crank.hub"),
        Joint("crankpin", "revolute", "crank.pin", "beam.root"),
        Joint("wrist", "revolute", "beam.tip", "slider.pin"),
        Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
    )
    motor = Driver("motor", "bearing", polynomial(0.0, CRANK_SPEED))
    return Scene(bodies, joints, (motor,), ground={"O": (0, 0, 0)})


# ---- cantilevers ------------------------------------------------------------------------------------------------------

PRINCETON = Material("aluminium", 71.7e9, 0.31, 2700.0)
PRINCETON_LENGTH, PRINCETON_SECTION = 0.508, rectangle(0.0032024, 0.0123777)
PRINCETON_FORCE = 8.896  # N


def princeton(degrees: float, modes: int, reference: ReferenceConditions, parts: int) -> Scene:
    """Cantilever along x, its height along y, with a dead force at its end, `degrees` from the height towards z."""
    model = beam(PRINCETON_SECTION, PRINCETON, PRINCETON_LENGTH, modes, reference, parts)
    angle = np.radians(degrees)
    force = PRINCETON_FORCE * np.array([0.0, np.cos(angle), np.sin(angle)])
    clamp, load = Joint("clamp", "fixed", "ground.O", "beam.root"), Load("push", "beam.tip", force=tuple(force))
    return Scene((Body("beam", model),), (clamp,), loads=(load,), ground={"O": (0, 0, 0)})


def rotor(body: FlexibleBody, motion: Callable[..., object] | object, speed: float = 0.0) -> Scene:
    """A beam from the axis z outwards, whose root turns by a function of time, in its stretch of steady rotation."""
    root = body.interface("root").phi_t
    pull = body.rP_dm[0, 0] + body.rP_dm[1, 1] - body.r_dm[0] * root[0]  # of all masses outwards, of the root inwards
    stretch = speed**2 * pull / body.omega2
    at = -root @ stretch
    spin = np.array([0.0, 0.0, speed])
    start = Body("beam", body, position=at, velocity=np.cross(spin, at), omega_bar=spin, q=stretch)
    axis = Joint("axis", "revolute", "ground.O", "beam.root")
    return Scene((start,), (axis,), (Driver("motor", "axis", motion),), ground={"O": (0, 0, 0)})


# ---- figures ----------------------------------------------------------------------------------------------------------


def measured(
    who: str, goals: Mapping[str, float], compute: Callable[P, tuple[float, ...]], *args: P.args, **kwargs: P.kwargs
) -> Iterator[Figure]:
    """A figure for each goal; infinite where computing stops with an error, which is printed."""
    try:
        found = compute(*args, **kwargs)
    except (ComputationError, InputError) as error:
        print(f"    {who}: {type(error).__name__}: {error}"[:300], flush=True)
        found = (np.inf,) * len(goals)
    for (what, goal), value in zip(goals.items(), found, strict=True):
        yield Figure(f"{who}: {what}", float(value), goal)
