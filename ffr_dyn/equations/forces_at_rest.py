"""Applied forces at rest: what they add to forces and tangent, and how they change with velocities.

Laws are differentiated by differences, by no more than what they are functions of: coordinates of their place, and the state
of all bodies where a law looks at it. The motion of their places has exact derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.equations.forces import At
from ffr_dyn.equations.jets import SECOND, SIZE, Jet, coordinates
from ffr_dyn.equations.layout import moved, to_global_axes, velocity_sizes
from ffr_dyn.equations.placed import Sums, pair
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.differences import differences as differences_by
from ffr_dyn.functions.rotation import skew
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import AtMarker, OnBody, OnJoint
from ffr_dyn.scene.scene import length_of
from ffr_prep.common.arrays import Array

STEP = 1e-6  # rad, or of the size of the scene: of differences of laws by what they are functions of, the first
FAR = 1e-3  # of a distance or coordinate over the same, from where steps grow with it: of 1e7 m rounding is 1e-9


@dataclass(frozen=True)
class Watched(At):
    """Notes whether a law looks at the state."""

    looks: list[bool]

    @property
    def state(self) -> StateView:
        self.looks.append(True)
        return super().state


def is_load(force: Force) -> bool:
    """Whether a force is given from outside, and not made by the state."""
    return force.given > 0 or isinstance(force.place, OnBody)


def add_force(total: Sums, now: At, force: Force, near: Mapping[str, float], angles: dict[str, float]) -> None:
    if isinstance(force.place, AtMarker):
        _add_at_marker(total, now, force)
    elif isinstance(force.place, OnBody):
        _add_on_body(total, now, force)
    else:
        _add_on_coordinates(total, now, force, near, angles)


def _add_at_marker(total: Sums, now: At, force: Force) -> None:
    """A moment of fixed direction has no potential: m . (angular velocity), which is no derivative of a rotation vector."""
    place: Any = force.place
    marker = total.placed[place.ends(now.scene)[0]]
    turned = marker.A if place.axes == "body" else np.eye(3)
    watched = Watched(now.scene, now.place, now.t, now.x, now.v, [])
    given = force.law(watched, None, None).reshape(2, 3)
    wrench = np.ravel(given @ turned.T)
    total.add_wrench(marker, wrench)
    by_motion = np.zeros((6, marker.jacobian.shape[1]))
    by_motion[3:] = 0.5 * skew(wrench[3:]) @ marker.jacobian[3:]
    if place.axes == "body" and marker.at.stop:
        by_motion[:3, 3:6] -= skew(wrench[:3]) @ marker.A
        by_motion[3:, 3:6] -= skew(wrench[3:]) @ marker.A
    total.tangent[marker.at, marker.at] += marker.jacobian.T @ by_motion
    if watched.looks:
        slopes = _by_state(now, lambda there: force.law(there, None, None), range(now.place.v_size))
        total.tangent[marker.at] += marker.jacobian.T @ np.kron(np.eye(2), turned) @ slopes


def _add_on_body(total: Sums, now: At, force: Force) -> None:
    """Laws of forces through the basis look at the state of their body alone."""
    b = force.place.ends(now.scene)[0]
    at, place = slice(now.place.iv[b], now.place.iv[b] + 6 + now.place.n[b]), now.place

    def law(there: At) -> Array:
        return np.asarray(force.law(there, there.x[place.q(b)], np.zeros(place.n[b])))

    given = law(now)
    total.forces[at] += given
    total.tangent[at, at] += _by_state(now, law, range(at.start, at.stop))[:, at]
    turn = slice(at.start + 3, at.start + 6)
    total.tangent[at.start : at.start + 3, turn] -= skew(given[:3])
    total.tangent[turn, turn] -= 0.5 * skew(given[3:6])


def _add_on_coordinates(
    total: Sums, now: At, force: Force, near: Mapping[str, float], angles: dict[str, float]
) -> None:
    ends = force.place.ends(now.scene)
    jets = coordinates(now.scene, pair(*(total.placed[number] for number in ends)), force.place)
    if not jets:
        return
    c = np.array([float(jet.value) for jet in jets])
    if isinstance(force.place, OnJoint) and force.place.coordinate == "angle":
        angle = float(c[0])
        angles[force.name] = angle + 2 * np.pi * round((near.get(force.name, angle) - angle) / (2 * np.pi))
        c[0] = angles[force.name]
    watched = Watched(now.scene, now.place, now.t, now.x, now.v, [])
    still, gradients = np.zeros(c.size), np.array([jet.first for jet in jets])
    given = law_on(force, watched, c, still)
    slopes = differences(lambda step: law_on(force, now, c + step, still), steps_of(now, jets, c))
    second = gradients.T @ slopes @ gradients + sum(f * jet.second for f, jet in zip(given, jets, strict=True))
    total.add_on_pair(ends, given @ gradients, second)
    if watched.looks:
        by_state = _by_state(now, lambda there: law_on(force, there, c, still), range(now.place.v_size))
        total.tangent[:] += total.gradient(ends, gradients).T @ by_state


def law_on(force: Force, now: At, c: Array, rate: Array) -> Array:
    """(K,) the force on K coordinates."""
    return np.ravel(force.law(now, c, rate) if c.size > 1 else force.law(now, float(c[0]), float(rate[0])))


def _by_state(now: At, law: Callable[[At], Array], columns: Iterable[int]) -> Array:
    """(K, V) derivative of K numbers by the motions `columns` of bodies, by differences."""

    def at(step: Array) -> Array:
        return law(replace(now, x=moved(now.place, now.x, step)))

    steps = STEP * velocity_sizes(now.scene, now.place)
    for b in range(len(now.place.n)):
        shift = now.place.R_dot(b)
        steps[shift] = np.maximum(steps[shift], STEP * FAR * np.abs(now.x[now.place.R(b)]).max())
    return differences(at, steps, columns)


def steps_of(now: At, jets: Sequence[Jet], c: Array) -> Array:
    """(K,) of differences by coordinates of the values c (K,): lengths are those that a shift changes."""
    shifts = [bool(jet.first[..., :3].any() or jet.first[..., SECOND : SECOND + 3].any()) for jet in jets]
    return STEP * np.maximum(np.where(shifts, length_of(now.scene), 1.0), FAR * np.abs(c))


def differences(function: Callable[[Array], Array], steps: Array, columns: Iterable[int] | None = None) -> Array:
    """(K, M) derivative of K numbers at zero by M others, of these the columns, by steps (M,), the first."""
    return differences_by(function, steps, range(steps.size) if columns is None else columns)[0]


def _steps_of_rates(now: At, of: Array) -> Array:
    """(M,) of differences by rates, whose gradients by the velocities of bodies are (M, V): of a scene that is larger than a
    metre they are larger. How fast it is, nothing tells."""
    reach = np.abs(of) @ velocity_sizes(now.scene, now.place)
    return STEP * np.maximum(1.0, np.minimum(reach, length_of(now.scene)))


# ---- damping --------------------------------------------------------------------------------------------------------


def damping_of(total: Sums, now: At, force: Force) -> Array:
    """(V, V) less the derivative of a force by the velocities [A^T R_dot, omega_bar, q_dot]."""
    way, rates, law = _along(total, now, force)
    D = way.T @ differences(lambda rate: law(now, rate), _steps_of_rates(now, rates)) @ rates
    watched, still = Watched(now.scene, now.place, now.t, now.x, now.v, []), np.zeros(len(rates))
    law(watched, still)
    if watched.looks and not isinstance(force.place, OnBody):
        D += way.T @ _by_speed(now, lambda there: law(there, still))
    return -D


def _by_speed(now: At, law: Callable[[At], Array]) -> Array:
    """(K, V) derivative of K numbers by the velocities of bodies, by differences."""
    steps = _steps_of_rates(now, np.eye(now.place.v_size))
    return differences(lambda y: law(replace(now, v=to_global_axes(now.place, now.x, y))), steps)


def _along(total: Sums, now: At, force: Force) -> tuple[Array, Array, Callable[[At, Array], Array]]:
    """The coordinates that a force acts along (K, V), those of whose rates it is a function (L, V), and that function."""
    place, scene = force.place, now.scene
    if isinstance(place, AtMarker):
        marker, way = total.placed[place.ends(scene)[0]], np.zeros((6, now.place.v_size))
        turned = marker.A if place.axes == "body" else np.eye(3)
        way[:, marker.at] = np.kron(np.eye(2), turned.T) @ marker.jacobian
        return way, way[:0], lambda there, rate: force.law(there, None, None)
    if isinstance(place, OnBody):
        b = place.ends(scene)[0]
        way, q = np.eye(now.place.v_size)[now.place.iv[b] : now.place.iv[b] + 6 + now.place.n[b]], now.x[now.place.q(b)]
        return way, way[6:], lambda there, rate: np.asarray(force.law(there, q, rate))
    ends = place.ends(scene)
    jets = coordinates(scene, pair(*(total.placed[number] for number in ends)), place)
    way = total.gradient(ends, np.array([jet.first for jet in jets]).reshape(-1, SIZE))
    c = np.array([float(jet.value) for jet in jets])
    return way, way, lambda there, rate: law_on(force, there, c, rate) if c.size else c
