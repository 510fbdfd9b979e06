"""Reference conditions: linear functionals L u = 0 that make the elastic field of a body frame unique.

A body frame may be attached to its body in any way that leaves no rigid motion in the elastic field:
rank(L T) = 6 for the six rigid motions T. Six functionals only decide how the motion is shared between frame and
elastic field; more than six restrict the deformation itself.

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), section 6.7 (reference conditions); O. P. Agrawal,
A. A. Shabana, Computers & Structures 21 (1985) 1303-1312 (mean axis).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import scipy.linalg

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.geometry.node_regions import nodes_of_region
from ffr_prep.mesh.geometry.region_words import is_query
from ffr_prep.model.coupled import CoupledModel, in_words, interface_index

Vector = tuple[float, float, float]

_RANK = 1e-9


class ReferenceConditions(Protocol):
    """The protocol of all reference conditions."""

    def rows(self, model: CoupledModel) -> Array:
        """(r, Z) functionals on the independent coordinates."""


def functionals(conditions: ReferenceConditions, model: CoupledModel) -> Array:
    """L (r, Z): the independent functionals of the reference conditions, of unit length.

    Raises InputError, naming the free motion in words, when they leave a rigid motion in the elastic field.
    """
    L = _independent(conditions.rows(model))
    free = free_rigid_motions(L @ model.T, body_length(model))
    if free.shape[1]:
        motions = " and ".join(motion_in_words(motion, model.centre, body_length(model)) for motion in free.T)
        raise InputError(f"the reference conditions do not prevent {motions}: add a condition that does")
    return L


def conditions_of_part(conditions: ReferenceConditions, interfaces: Collection[str]) -> ReferenceConditions:
    """The conditions for a part of a body with these interfaces: as they are where it has all that they name, and mean axis
    where it has not, or where they are on the nodes of the whole.
    """
    named = named_interfaces(conditions)
    return conditions if named and set(named) <= set(interfaces) else MeanAxis()


def named_interfaces(conditions: ReferenceConditions) -> tuple[str, ...]:
    """The interfaces that the conditions name, in the order in which they do; none where they are on mass or nodes."""
    match conditions:
        case FixedTo(interface=name):
            return (name,)
        case SimplySupported(pin=pin, roller=roller):
            return pin, roller
        case Supports(supports=supports):
            return tuple(support.interface for support in supports)
    return ()


def renamed(conditions: ReferenceConditions, meant: Mapping[str, str]) -> ReferenceConditions:
    """The conditions on the interfaces that are meant by the names in them."""
    match conditions:
        case FixedTo(interface=name):
            return FixedTo(meant[name])
        case SimplySupported(pin=pin, roller=roller):
            return SimplySupported(meant[pin], meant[roller])
        case Supports(supports=supports):
            return Supports(tuple(replace(one, interface=meant[one.interface]) for one in supports))
    return conditions


def at_interfaces(conditions: ReferenceConditions, names: Sequence[str], positions: Array) -> ReferenceConditions:
    """The conditions, where these may say a place, such as "nearest 0,0,0" or "plane x=0" [m], for the interface there.

    names, positions : of the interfaces, (m, 3) [m]

    Raises InputError for a place where no interface is, or more than one.
    """
    meant = {name: name for name in named_interfaces(conditions)}
    for name in meant.keys() - set(names):
        if is_query(name):
            found = nodes_of_region(positions, {}, name, "there is no interface")
            if len(found) > 1:
                both = " and ".join(repr(names[k]) for k in found)
                raise InputError(f"reference conditions: at {name!r} lie {both}: name the one that is meant")
            meant[name] = names[found[0]]
    return renamed(conditions, meant)


# ---- the choices --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FixedTo:
    """The body frame moves with one interface: its six coordinates vanish.

    >>> request = fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.CraigBampton(8))
    """

    interface: str

    def rows(self, model: CoupledModel) -> Array:
        """(6, Z) the coordinates of the interface; InputError for an unknown one."""
        return _coordinates(model, self.interface)


@dataclass(frozen=True)
class SimplySupported:
    """The x' axis of the elastic field passes through two interfaces.

    The pin does not move and does not turn about the chord pin -> roller; the roller moves along the chord only.

    >>> request = fp.Request(name="rod", reference=fp.SimplySupported("hinge", "tip"), reduction=fp.CraigBampton(8))
    """

    pin: str
    roller: str

    def rows(self, model: CoupledModel) -> Array:
        """(6, Z); InputError for an unknown interface or two at the same point."""
        pin, roller = _coordinates(model, self.pin), _coordinates(model, self.roller)
        chord = model.positions[interface_index(model, self.roller)] - model.positions[interface_index(model, self.pin)]
        if np.linalg.norm(chord) <= 1e-12 * body_length(model):
            raise InputError(
                f"simply supported between {self.pin!r} and {self.roller!r}: both are at the same point; "
                "choose two interfaces that are apart"
            )
        along = chord / np.linalg.norm(chord)
        across = scipy.linalg.null_space(along[None]).T
        return np.vstack([pin[:3], across @ roller[:3], along @ pin[3:]])


@dataclass(frozen=True)
class Support:
    """One prevented motion of an interface: "translation" along or "rotation" about a direction.

    Raises InputError for another motion, and a direction of no length.

    >>> support = fp.Support("hinge", "translation", (1, 0, 0))
    """

    interface: str
    motion: str
    direction: Vector

    def __post_init__(self) -> None:
        if self.motion not in ("translation", "rotation"):
            raise InputError(f"support of {self.interface!r}: motion is {self.motion!r}, not translation or rotation")
        if np.shape(self.direction) != (3,) or not 0 < np.linalg.norm(self.direction) < np.inf:
            raise InputError(f"support of {self.interface!r}: direction {self.direction} is not a direction")


@dataclass(frozen=True)
class Supports:
    """Any choice of prevented motions: six make the body statically determinate, more restrict its deformation.

    >>> held = [fp.Support("hinge", "translation", axis) for axis in np.eye(3)]
    >>> reference = fp.Supports((*held, *(fp.Support("hinge", "rotation", axis) for axis in np.eye(3))))
    """

    supports: tuple[Support, ...]

    def rows(self, model: CoupledModel) -> Array:
        """(r, Z) one row per support; InputError for an unknown interface."""
        return np.vstack([np.zeros((0, model.K.shape[0])), *(_row(model, support) for support in self.supports)])


@dataclass(frozen=True)
class MeanAxis:
    """The elastic field has no mean translation and no mean rotation over the mass: L = T^T M (Tisserand).

    >>> request = fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Rubin(8))
    """

    def rows(self, model: CoupledModel) -> Array:
        """(6, Z)."""
        return (model.M @ model.T).T


@dataclass(frozen=True)
class UserConditions:
    """Functionals on the nodal displacements, given as an array or made from the nodes' positions.

    on_nodes : (r, N, 3), or a function of the positions (N, 3) [m] that returns it

    >>> reference = fp.UserConditions(lambda points: rows_on(points))
    """

    on_nodes: Array | Callable[[Array], Array]

    def rows(self, model: CoupledModel) -> Array:
        """(r, Z); InputError when the array does not fit the mesh or is not finite."""
        given = np.asarray(self.on_nodes(model.points) if callable(self.on_nodes) else self.on_nodes, float)
        expected = (*model.points.shape,)
        if given.ndim != 3 or given.shape[1:] != expected:
            raise InputError(f"user conditions have shape {given.shape}; they must be (r, {expected[0]}, 3)")
        if not np.isfinite(given).all():
            raise InputError("user conditions hold values that are not finite")
        return (model.B.T @ given.reshape(len(given), -1).T).T


def _coordinates(model: CoupledModel, interface: str) -> Array:
    k = interface_index(model, interface)
    return model.C[6 * k : 6 * k + 6].toarray()


def _row(model: CoupledModel, support: Support) -> Array:
    six = _coordinates(model, support.interface)
    direction = np.asarray(support.direction) / np.linalg.norm(support.direction)
    return direction @ (six[:3] if support.motion == "translation" else six[3:])


# ---- rank ---------------------------------------------------------------------------------------------------------


def _independent(rows: Array) -> Array:
    """The independent ones among the rows, of unit length."""
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    unit = rows[length[:, 0] > 0] / length[length[:, 0] > 0]
    if not len(unit):
        return unit
    R, order = scipy.linalg.qr(unit.T, mode="r", pivoting=True)
    pivots = np.abs(np.diag(R))
    return unit[np.sort(order[: pivots.size][pivots > _RANK])]


def free_rigid_motions(held: Array, length: float) -> Array:
    """(6, f) the rigid motions (translation, rotation) that the conditions with L T = held (r, 6) do not prevent.

    length : size of the body [m], which makes rotations comparable with translations
    """
    scaled = held / np.array([1.0, 1.0, 1.0, length, length, length])
    norms = np.linalg.norm(scaled, axis=1, keepdims=True)
    scaled = scaled / np.where(norms > _RANK * norms.max(initial=0.0), norms, np.inf)
    null = scipy.linalg.null_space(np.vstack([scaled, np.zeros((1, 6))]), rcond=1e-8)
    null[3:] /= length
    return _simplest(null)


def _simplest(motions: Array) -> Array:
    """Another basis (6, f) of the same motions: reduced echelon form, rotations about the axes first."""
    order = [3, 4, 5, 0, 1, 2]
    rows = motions.T[:, order].copy()
    done = 0
    for column in range(6):
        if done == len(rows):
            break
        pivot = done + int(np.argmax(np.abs(rows[done:, column])))
        if np.abs(rows[pivot, column]) <= 1e-9 * np.abs(rows).max():
            continue
        rows[[done, pivot]] = rows[[pivot, done]]
        rows[done] /= rows[done, column]
        others = np.arange(len(rows)) != done
        rows[others] -= np.outer(rows[others, column], rows[done])
        done += 1
    return rows[:, np.argsort(order)].T


def motion_in_words(motion: Array, centre: Array, length: float) -> str:
    """Names the rigid motion (6,) of translation at `centre` and rotation: an axis, a direction or a screw."""
    translation, turn = motion[:3], motion[3:]
    rate = np.linalg.norm(turn)
    if rate * length <= 1e-8 * np.linalg.norm(translation):
        return f"translation along {in_words(translation / np.linalg.norm(translation), 1.0)}"
    axis = turn / rate
    point = centre + np.cross(axis, translation) / rate
    pitch = axis @ translation / rate
    through = f"about the axis through {in_words(point, length)} m along {in_words(axis, 1.0)}"
    if abs(pitch) <= 1e-8 * length:
        return f"rotation {through}"
    return f"screw motion {through} with pitch {pitch:.4g} m/rad"


def body_length(model: CoupledModel) -> float:
    return float(np.linalg.norm(np.ptp(model.points, axis=0)))
