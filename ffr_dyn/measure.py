"""From recorded states to named quantities with units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations import System
from ffr_dyn.force_tables import Action, actions_of, bushings_of, spread_of
from ffr_dyn.forces import SpringDamper
from ffr_dyn.joints import COORDINATES, Joint, frames
from ffr_dyn.kernels.tables import Record
from ffr_dyn.result import EULER_PARAMETERS, XYZ, Axis, Quantity, mode_axis
from ffr_dyn.rotation import rotation_matrix
from ffr_dyn.scene import Scene, marker_names, marker_number, markers

Array = np.ndarray


@dataclass(frozen=True)
class Unwound:
    """The last joint angle [rad], its rate [rad/s] and time [s], from which the next angle is unwound."""

    angle: float
    rate: float
    time: float


def measure(system: System, record: Record, last: dict[str, Unwound]) -> tuple[dict[str, Quantity], dict[str, Unwound]]:
    """All quantities of the recorded rows; `last` (by joint) continues angles from an earlier part of the run."""
    found: dict[str, Quantity] = {}
    found |= _bodies(system, record)
    found |= _markers(system, record)
    found |= _reactions(system, record)
    coordinates, unwound = _joint_coordinates(system, record, last)
    found |= coordinates
    found |= _forces(system, record)
    return found | _totals(record), unwound


def _bodies(system: System, record: Record) -> dict[str, Quantity]:
    found: dict[str, Quantity] = {}
    place = system.layout

    def add(name: str, values: Array, unit: str, axis: Axis, text: str) -> None:
        found[name] = Quantity(values, unit, (axis,), text)

    for b, body in enumerate(system.scene.bodies):
        n = body.name
        add(f"{n}.R", record.x[:, place.R(b)], "m", XYZ, "origin of the body frame, global axes")
        add(f"{n}.p", record.x[:, place.p(b)], "1", EULER_PARAMETERS, "Euler parameters, body to global")
        add(f"{n}.v", record.v[:, place.R_dot(b)], "m/s", XYZ, "velocity of the origin, global axes")
        add(f"{n}.omega_bar", record.v[:, place.omega(b)], "rad/s", XYZ, "angular velocity, body axes")
        if place.n[b]:
            modes = mode_axis(n, place.n[b])
            add(f"{n}.q", record.x[:, place.q(b)], "m sqrt(kg)", modes, "elastic coordinates (mass-normalised)")
            add(f"{n}.q_dot", record.v[:, place.q_dot(b)], "m sqrt(kg)/s", modes, "rates of the elastic coordinates")
    return found


def _markers(system: System, record: Record) -> dict[str, Quantity]:
    found = {}
    ground = len(system.scene.bodies)
    for k, (name, (b, _, point)) in enumerate(zip(marker_names(system.scene), markers(system.scene), strict=True)):
        if b == ground:
            continue
        found[f"{name}.position"] = Quantity(record.r[:, k], "m", (XYZ,), "position of the marker, global axes")
        found[f"{name}.velocity"] = Quantity(record.rd[:, k], "m/s", (XYZ,), "velocity of the marker, global axes")
        if system.layout.n[b]:
            moved = record.x[:, system.layout.q(b)] @ system.scene.bodies[b].model.interface(point).phi_t.T
            found[f"{name}.displacement"] = Quantity(
                moved, "m", (XYZ,), "elastic displacement of the marker, body axes"
            )
    return found


def _reactions(system: System, record: Record) -> dict[str, Quantity]:
    found = {}
    for k, block in enumerate(system.blocks):
        text = "that the first body exerts on the second at its marker, global axes"
        found[f"{block.name}.force"] = Quantity(record.reaction[:, k, :3], "N", (XYZ,), f"force {text}")
        found[f"{block.name}.moment"] = Quantity(record.reaction[:, k, 3:], "N m", (XYZ,), f"moment {text}")
    return found


def _forces(system: System, record: Record) -> dict[str, Quantity]:
    """Coordinates, forces and powers of the applied loads."""
    scene = system.scene
    found: dict[str, Quantity] = {}
    for k, action in enumerate(actions_of(scene)):
        found |= _action(action, record.action[:, k])
    for k, bushing in enumerate(bushings_of(scene)):
        found |= _bushing(bushing.name, record.bushing[:, k])
    loads = [*scene.loads, *actions_of(scene), *bushings_of(scene), *spread_of(scene)]
    for k, load in enumerate(loads):
        found[f"{load.name}.power"] = Quantity(record.power[:, k], "W", (), "power that the force gives to the bodies")
    return found


def _action(action: Action, values: Array) -> dict[str, Quantity]:
    name = action.name
    if isinstance(action, SpringDamper):
        return {
            f"{name}.tension": Quantity(-values[:, 2], "N", (), "spring-damper force, tension positive"),
            f"{name}.length": Quantity(values[:, 0], "m", (), "distance of the ends"),
        }
    if action.coordinate == "angle":
        angle = "joint angle as the force counts it, with whole turns"
        return {
            f"{name}.torque": Quantity(values[:, 2], "N m", (), "torque that increases the joint angle"),
            f"{name}.angle": Quantity(values[:, 0], "rad", (), angle),
        }
    return {
        f"{name}.force": Quantity(values[:, 2], "N", (), "force that increases the joint stroke"),
        f"{name}.stroke": Quantity(values[:, 0], "m", (), "joint stroke along its axis"),
    }


def _bushing(name: str, values: Array) -> dict[str, Quantity]:
    return {
        f"{name}.displacement": Quantity(values[:, :3], "m", (XYZ,), "of j from i, axes of the bushing on i"),
        f"{name}.rotation": Quantity(values[:, 3:6], "rad", (XYZ,), "rotation vector from the axes of i to those of j"),
        f"{name}.force": Quantity(values[:, 12:15], "N", (XYZ,), "force on j, axes of the bushing on i"),
        f"{name}.moment": Quantity(values[:, 15:], "N m", (XYZ,), "conjugate to the rotation vector, on j"),
    }


def _totals(record: Record) -> dict[str, Quantity]:
    names = ("kinetic", "strain", "gravity")
    found = {f"energy.{name}": Quantity(record.energy[:, k], "J", (), f"{name} energy") for k, name in enumerate(names)}
    found["energy.total"] = Quantity(record.energy.sum(axis=1), "J", (), "kinetic, strain and gravity energy")
    found["constraint.position"] = Quantity(record.violation[:, 0], "m", (), "largest violation of a constraint row")
    found["constraint.velocity"] = Quantity(record.violation[:, 1], "m/s", (), "largest rate of a constraint row")
    return found


# ---- joint coordinates --------------------------------------------------------------------------------------------


def _joint_coordinates(
    system: System, record: Record, last: dict[str, Unwound]
) -> tuple[dict[str, Quantity], dict[str, Unwound]]:
    found: dict[str, Quantity] = {}
    unwound: dict[str, Unwound] = {}
    for joint in system.scene.joints:
        if "angle" in COORDINATES[joint.kind]:
            angle, rate = _angles(system, record, joint)
            values, unwound[joint.name] = unwind(record.time, angle, rate, last.get(joint.name))
            found[f"{joint.name}.angle"] = Quantity(values, "rad", (), "joint angle, unwound")
        if "stroke" in COORDINATES[joint.kind]:
            values = _stroke(system, record, joint)
            found[f"{joint.name}.stroke"] = Quantity(values, "m", (), "joint stroke along its axis")
    return found, unwound


def unwind(time: Array, angle: Array, rate: Array, last: Unwound | None) -> tuple[Array, Unwound]:
    """Angles (T,) without jumps of a turn: each is the one nearest to what the rates (T,) predict."""
    out = np.empty_like(angle)
    before = last or Unwound(float(angle[0]), float(rate[0]), float(time[0]))
    for k in range(angle.size):
        predicted = before.angle + 0.5 * (before.rate + rate[k]) * (time[k] - before.time)
        out[k] = angle[k] + 2 * np.pi * np.round((predicted - angle[k]) / (2 * np.pi))
        before = Unwound(float(out[k]), float(rate[k]), float(time[k]))
    return out, before


def _frame(system: System, record: Record, marker: int, frame: Array) -> tuple[Array, Array]:
    """Joint frame (T, 3, 3) of a marker in global axes, columns f, g, h, and its angular velocity (T, 3)."""
    scene, place = system.scene, system.layout
    b, _, point = markers(scene)[marker]
    rows = record.time.size
    if b == len(scene.bodies):
        return np.broadcast_to(frame, (rows, 3, 3)), np.zeros((rows, 3))
    A = rotation_matrix(record.x[:, place.p(b)])
    phi_r = scene.bodies[b].model.interface(point).phi_r
    theta = record.x[:, place.q(b)] @ phi_r.T
    turned = frame + np.cross(theta[:, None, :], frame.T[None]).transpose(0, 2, 1)
    spin = record.v[:, place.omega(b)] + record.v[:, place.q_dot(b)] @ phi_r.T
    return A @ turned, np.einsum("tkl,tl->tk", A, spin)


def _ends(scene: Scene, joint: Joint) -> tuple[int, int]:
    return marker_number(scene, joint.i), marker_number(scene, joint.j)


def _angles(system: System, record: Record, joint: Joint) -> tuple[Array, Array]:
    on_i, on_j = frames(joint)
    i, j = _ends(system.scene, joint)
    frame_i, spin_i = _frame(system, record, i, on_i)
    frame_j, spin_j = _frame(system, record, j, on_j)
    f_j = frame_j[:, :, 0]
    angle = np.arctan2((frame_i[:, :, 1] * f_j).sum(1), (frame_i[:, :, 0] * f_j).sum(1))
    return angle, ((spin_j - spin_i) * frame_i[:, :, 2]).sum(1)


def _stroke(system: System, record: Record, joint: Joint) -> Array:
    i, j = _ends(system.scene, joint)
    frame_i, _ = _frame(system, record, i, frames(joint)[0])
    return (frame_i[:, :, 2] * (record.r[:, j] - record.r[:, i])).sum(1)
