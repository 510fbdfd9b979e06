"""The description of the scene in every result: title, parts, and which points connections join, so that it can be drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ffr_dyn.functions.time_functions import is_zero
from ffr_dyn.scene.couplings import Coupling, coupled
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.given import is_number
from ffr_dyn.scene.forces.places import effort
from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.parts import wholes
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import cut_stress_doubt, left_out_stress, shear_doubt

# Joints of these kinds have no axis to speak of.
_WITHOUT_AXIS = ("spherical", "fixed", "distance", "orientation")


def described(scene: Scene) -> dict[str, Any]:
    """Plain JSON values: the title; the `mass` [kg] of all bodies and a `length` [m], the largest radius of gyration about
    the origin of a body's frame, which tell what is small; the parts of bodies by the name of the whole; places (3,) of the
    ground's points [m]; by the name of a joint, driver, coupling or force the markers `at` which it is, and what of it is
    drawn; `gravity` [m/s^2]; and of bodies with stress what it lacks, in words, and, where the base rests, what their
    shapes leave out (`ffr_prep.body.left_out_stress`).
    """
    parts = {name: [part.name for part in of] for name, of in wholes(scene.bodies).items()}
    ground = {name: at.tolist() for name, at in scene.ground.items()}
    sizes = {"mass": sum(body.model.mass for body in scene.bodies), "length": _length(scene)}
    stress = {body.name: of for body in scene.bodies if (of := left_out_stress(body.model.provenance))}
    lacks = {body.name: "; ".join(said) for body in scene.bodies if (said := [*_lacks(body)])}
    found: dict[str, Any] = {**sizes, "parts": parts, "ground": ground, "connections": _connections(scene)}
    found |= {"stress_lacks": lacks, "gravity": scene.gravity.tolist() if scene.gravity.any() else []}
    if stress and all(is_zero(f) for f in scene.base_acceleration):  # which a result does not keep
        found |= {"left_out_stress": stress}
    return {"title": scene.name} | {key: value for key, value in found.items() if value}


def _lacks(body: Body) -> Iterator[str]:
    if said := shear_doubt(body.model.provenance):
        yield said
    if body.part_of and (said := cut_stress_doubt(body.part_of.model)):
        yield said


def _length(scene: Scene) -> float:
    moments = ((sum(body.model.rr_dm.diagonal().tolist()), body.model.mass) for body in scene.bodies)
    return max((math.sqrt(moment / mass) for moment, mass in moments), default=0.0)


def _connections(scene: Scene) -> dict[str, Any]:
    driven: dict[str, list[str]] = {}
    for driver in scene.drivers:
        if isinstance(driver, Driver):
            driven.setdefault(driver.joint, []).append(driver.name)
    joints = {joint.name: joint for joint in scene.joints}
    found = {name: _joint(joint, driven.get(name, [])) for name, joint in joints.items()}
    for driver in scene.drivers:
        at = [driver.j] if isinstance(driver, PointDriver) else [joints[driver.joint].i, joints[driver.joint].j]
        found[driver.name] = {"kind": "point driver" if len(at) == 1 else "driver", "at": at, "axis": None}
    found |= {coupling.name: _coupling(coupling, joints) for coupling in scene.couplings}
    return found | {force.name: _force(force, scene) for force in forces_of(scene)}


def _joint(joint: Joint, drivers: list[str]) -> dict[str, Any]:
    axis = None if joint.kind in _WITHOUT_AXIS else frames(joint)[0][:, 2].tolist()
    return {"kind": joint.kind, "at": [joint.i, joint.j], "axis": axis} | ({"drivers": drivers} if drivers else {})


def _coupling(coupling: Coupling, joints: Mapping[str, Joint]) -> dict[str, Any]:
    """The second bodies of its joints, and what it does to them."""
    (first, way), (second, other) = coupled(coupling)
    named = ((first, way, -coupling.ratio), (second, other, 1.0))
    efforts = [
        effort(joints[joint], of, "effort", factor) | {"name": f"{coupling.name}.effort on {joint}"}
        for joint, of, factor in named
    ]
    return {"kind": "coupling", "at": [joints[first].j, joints[second].j], "efforts": efforts}


def _force(force: Any, scene: Scene) -> dict[str, Any]:
    """Its markers, what a picture needs beside, and what of it is constant and not zero, for scenes that have not run."""
    parts = {what: getattr(force, what, ()) for what in ("force", "moment")}
    constant = {
        what: [float(component) for component in of]
        for what, of in parts.items()
        if isinstance(of, tuple | list) and len(of) == 3 and all(map(is_number, of)) and any(of)
    }
    found: dict[str, Any] = {"kind": type(force).__name__, "at": list(force.place.markers(scene))}
    return found | force.drawn(scene) | ({"constant": constant} if constant else {})
