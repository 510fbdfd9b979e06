"""Forces and constraints at rest with their derivatives: what Newton's method needs for an equilibrium.

Motions are small ones y (V,) of all bodies, [A^T dR, turn about body axes, dq], from the state at hand: R moves along a
straight line, A to A exp(turn~). Where all forces have a potential, the tangent is the matrix of its second derivatives,
symmetric whether the forces balance or not.

Everything acts on markers, by a wrench w = (F, M): the motion of a marker is J y + 1/2 y^T (d^2 of it) y, in which the second
derivative along constant rates is the bias of its acceleration, at velocities y (`ffr_dyn.equations.kinematics`). So a wrench
contributes J^T w to the forces, and to their derivative J^T (dw by the motions of markers) J and what the bias says:

    F . [w x (w x rho) + 2 w x P q_dot - q_dot K_t q_dot] + M . [w x T theta_dot - T (q_dot K_r q_dot) + T_dot theta_dot]

with forces in body axes: the geometric stiffness of multipliers, loads and weight. (Geradin & Cardona 2001, ch. 10.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ffr_dyn.equations.constraint_rows import Block, drive_of
from ffr_dyn.equations.forces import At, gravity_at
from ffr_dyn.equations.inertia import gravity_force, kept_integrals
from ffr_dyn.equations.jets import WORDS, Jet, Pair, coordinates, joint_coordinate
from ffr_dyn.equations.kinematics import body_state, deflection
from ffr_dyn.equations.layout import Layout, moved, to_global_axes
from ffr_dyn.equations.second_order import marker_matrices
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.rotation import (
    from_vector,
    rotation_matrix,
    skew,
    tangent,
    tangent_rate_form,
)
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import AtMarker, OnBody, OnJoint
from ffr_dyn.scene.joints import RELATION, Word
from ffr_dyn.scene.scene import Scene, markers
from ffr_prep.common.arrays import Array

STEP = 1e-6  # m, rad: of differences of laws by what they are functions of


@dataclass(frozen=True)
class Balance:
    """Forces (V,) but those of the constraints, Phi (C,) and jacobian (C, V) of the rows.

    stiffness : (V, V) of forces - jacobian^T lam, at the multipliers lam: less its derivative by y
    """

    forces: Array
    Phi: Array
    jacobian: Array
    stiffness: Array


def balance(
    scene: Scene, place: Layout, blocks: Sequence[Block], t: float, x: Array, lam: Array, near: Mapping[str, float]
) -> Balance:
    """A scene at rest at the time t [s] and the positions x, its rows those of the blocks, with multipliers lam (C,).

    near : angles by the names of the forces on them, to which whole turns are counted (see `counted_angles`)
    """
    now = At(scene, place, t, x, np.zeros(place.v_size))
    placed = [_placed(now, number) for number in range(len(markers(scene)))]
    total = _Sums(placed, np.zeros(place.v_size), np.zeros((place.v_size, place.v_size)))
    for b in range(len(scene.bodies)):
        _add_body(total, now, b)
    for force in forces_of(scene):
        _add_force(total, now, force, near)
    acting, Phi, jacobian = _Sums(placed, np.zeros(place.v_size), -total.tangent), [], []
    multipliers = iter(lam)
    for block in blocks:
        for word in block.words:
            value, gradient = _add_row(acting, block, word, drive_of(word, t)[0], float(next(multipliers)))
            Phi.append(value), jacobian.append(gradient)
    return Balance(total.forces, np.array(Phi), np.array(jacobian).reshape(-1, place.v_size), acting.tangent)


def counted_angles(scene: Scene, place: Layout, x: Array) -> dict[str, float]:
    """The joint angles of forces at the start x, with the whole turns that they say, by the names of the forces."""
    now, found = At(scene, place, 0.0, x, np.zeros(place.v_size)), {}
    for force in forces_of(scene):
        if isinstance(force.place, OnJoint) and force.place.coordinate == "angle":
            pair = _pair(*(_placed(now, number) for number in force.place.ends(scene)))
            found[force.name] = float(coordinates(scene, pair, force.place)[0].value)
    return found


# ---- markers --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Placed:
    """A marker at a state.

    at        : the velocities of its body;  A (3, 3) of the body;  r (3,), axes (3, 3) global, of the undeformed body's axes
    jacobian  : (6, 6 + n) of its velocity and angular velocity, global
    rho, P    : place (3,) and its gradient (3, n) in body axes;  theta, P_r : of its rotation vector;  K : (6, n, n)
    """

    at: slice
    A: Array
    r: Array
    axes: Array
    jacobian: Array
    rho: Array
    P: Array
    theta: Array
    P_r: Array
    K: Array


def _placed(now: At, number: int) -> Placed:
    b, _, point = markers(now.scene)[number]
    if b == len(now.scene.bodies):
        one, none, nothing = np.eye(3), np.zeros(3), np.zeros((3, 0))
        r = np.asarray(now.scene.ground[point], float)
        return Placed(slice(0, 0), one, r, one, np.zeros((6, 0)), none, nothing, none, nothing, np.zeros((6, 0, 0)))
    body, state = now.scene.bodies[b], body_state(now.place, now.x, now.v, b)
    interface, K = body.model.interface(point), marker_matrices(body, point)
    u, theta = deflection(state, interface.phi_t, K[:3]), deflection(state, interface.phi_r, K[3:])
    rho, one = interface.position + u.value, np.eye(3)
    twist = tangent(theta.value) @ theta.gradient
    jacobian = np.block([[one, -skew(rho), u.gradient], [0 * one, one, twist]])
    jacobian = np.concatenate([state.A @ jacobian[:3], state.A @ jacobian[3:]])
    axes = state.A @ rotation_matrix(from_vector(theta.value))
    at = slice(now.place.iv[b], now.place.iv[b] + 6 + now.place.n[b])
    return Placed(at, state.A, state.R + state.A @ rho, axes, jacobian, rho, u.gradient, theta.value, theta.gradient, K)


def curvature(rho: Array, P: Array, theta: Array, P_r: Array, K: Array, force: Array, moment: Array) -> Array:
    """(6 + n, 6 + n) second derivative of the motion of a marker times force and moment (3,) on it, body axes."""
    T, n = tangent(theta), P.shape[1]
    S = np.zeros((6 + n, 6 + n))
    S[3:6, 3:6] = 0.5 * (np.outer(force, rho) + np.outer(rho, force)) - (force @ rho) * np.eye(3)
    S[3:6, 6:] = -skew(force) @ P - 0.5 * skew(moment) @ T @ P_r
    S[6:, 3:6] = S[3:6, 6:].T
    S[6:, 6:] = P_r.T @ tangent_rate_form(theta, moment) @ P_r
    if K.any():
        S[6:, 6:] -= np.tensordot(np.concatenate([force, moment @ T]), K, 1)
    return S


def _pair(i: Placed, j: Placed) -> Pair:
    return Pair(i.r, j.r, i.axes, j.axes)


# ---- sums -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Sums:
    """Forces (V,) and their derivative (V, V), to which every part of a scene adds its own."""

    placed: list[Placed]
    forces: Array
    tangent: Array

    def add_wrench(self, marker: Placed, wrench: Array) -> None:
        """A force and a moment (6,), global, that stay what they are as the marker moves."""
        self.forces[marker.at] += wrench @ marker.jacobian
        force, moment = wrench[:3] @ marker.A, wrench[3:] @ marker.A
        if marker.at.stop > marker.at.start:
            self.tangent[marker.at, marker.at] += curvature(
                marker.rho, marker.P, marker.theta, marker.P_r, marker.K, force, moment
            )

    def add_on_pair(self, ends: tuple[int, int], first: Array, second: Array) -> None:
        """Forces (12,) on the motions of two markers, with their derivative (12, 12)."""
        pair = [(self.placed[number], slice(6 * k, 6 * k + 6)) for k, number in enumerate(ends)]
        for marker, own in pair:
            self.add_wrench(marker, first[own])
            for other, columns in pair:
                self.tangent[marker.at, other.at] += marker.jacobian.T @ second[own, columns] @ other.jacobian

    def gradient(self, ends: tuple[int, int], first: Array) -> Array:
        """(..., V) by the motions of all bodies, of (..., 12) by those of two markers."""
        found = np.zeros((*first.shape[:-1], self.forces.size))
        for k, number in enumerate(ends):
            marker = self.placed[number]
            found[..., marker.at] += first[..., 6 * k : 6 * k + 6] @ marker.jacobian
        return found


def _add_row(total: _Sums, block: Block, word: Word, s: float, multiplier: float) -> tuple[float, Array]:
    """Phi and its gradient (V,); its second derivative times the multiplier is added."""
    value, gradient = -s if word.kind == RELATION else 0.0, np.zeros(total.forces.size)
    for ends, row in _jets(total, block, word, s):
        value += float(row.value)
        gradient += total.gradient(ends, row.first)
        total.add_on_pair(ends, multiplier * row.first, multiplier * row.second)
    return value - word.spacing * round(value / word.spacing) if word.spacing else value, gradient


def _jets(total: _Sums, block: Block, word: Word, s: float) -> list[tuple[tuple[int, int], Jet]]:
    """What a row is the sum of, with the markers of each."""
    found = []
    for k in range(0, len(block.markers), 2):
        ends = block.markers[k], block.markers[k + 1]
        pair = _pair(*(total.placed[number] for number in ends))
        if word.kind != RELATION:
            return [(ends, WORDS[word.kind](pair, word, s))]
        factor, kind = word.relation[k // 2]
        found.append((ends, joint_coordinate(pair, kind, word.axes[3 * (k // 2) : 3 * (k // 2) + 3]) * factor))
    return found


def _add_body(total: _Sums, now: At, b: int) -> None:
    """Weight and elastic forces."""
    body, place, x = now.scene.bodies[b], now.place, now.x
    integrals, q, A = kept_integrals(body), x[place.q(b)], rotation_matrix(x[place.p(b)])
    field, at = gravity_at(now.scene, now.t), slice(place.iv[b], place.iv[b] + 6 + place.n[b])
    s, none = integrals.r_dm + integrals.P_dm @ q, np.zeros(3)
    total.forces[at] += gravity_force(integrals, q, A, field)
    total.tangent[at, at] += curvature(s, integrals.P_dm, none, 0 * integrals.P_dm, np.zeros((6, 0)), field @ A, none)
    elastic = np.arange(place.iv[b] + 6, at.stop)
    total.forces[elastic] -= integrals.omega2 * q
    total.tangent[elastic, elastic] -= integrals.omega2


# ---- applied forces -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Watched(At):
    """Notes whether a law looks at the state."""

    looks: list[bool]

    @property
    def state(self) -> StateView:
        self.looks.append(True)
        return super().state


def _add_force(total: _Sums, now: At, force: Force, near: Mapping[str, float]) -> None:
    if isinstance(force.place, AtMarker):
        _add_at_marker(total, now, force)
    elif isinstance(force.place, OnBody):
        _add_on_body(total, now, force)
    else:
        _add_on_coordinates(total, now, force, near)


def _add_at_marker(total: _Sums, now: At, force: Force) -> None:
    """A moment of fixed direction has no potential: m . (angular velocity), which is no derivative of a rotation vector."""
    place: Any = force.place
    marker = total.placed[place.ends(now.scene)[0]]
    turned = marker.A if place.axes == "body" else np.eye(3)
    watched = _Watched(now.scene, now.place, now.t, now.x, now.v, [])
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


def _add_on_body(total: _Sums, now: At, force: Force) -> None:
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


def _add_on_coordinates(total: _Sums, now: At, force: Force, near: Mapping[str, float]) -> None:
    ends = force.place.ends(now.scene)
    jets = coordinates(now.scene, _pair(*(total.placed[number] for number in ends)), force.place)
    if not jets:
        return
    c = np.array([float(jet.value) for jet in jets])
    if force.name in near:
        c += 2 * np.pi * np.round((near[force.name] - c) / (2 * np.pi))
    watched = _Watched(now.scene, now.place, now.t, now.x, now.v, [])
    still, gradients = np.zeros(c.size), np.array([jet.first for jet in jets])
    given = _law(force, watched, c, still)
    slopes = _differences(lambda step: _law(force, now, c + step, still), range(c.size), c.size)
    second = gradients.T @ slopes @ gradients + sum(f * jet.second for f, jet in zip(given, jets, strict=True))
    total.add_on_pair(ends, given @ gradients, second)
    if watched.looks:
        by_state = _by_state(now, lambda there: _law(force, there, c, still), range(now.place.v_size))
        total.tangent[:] += total.gradient(ends, gradients).T @ by_state


def _law(force: Force, now: At, c: Array, rate: Array) -> Array:
    """(K,) the force on K coordinates."""
    return np.ravel(force.law(now, c, rate) if c.size > 1 else force.law(now, float(c[0]), float(rate[0])))


def _by_state(now: At, law: Callable[[At], Array], columns: Iterable[int]) -> Array:
    """(K, V) derivative of K numbers by the motions `columns` of bodies, by differences."""

    def at(step: Array) -> Array:
        return law(replace(now, x=moved(now.place, now.x, step)))

    return _differences(at, columns, now.place.v_size)


def _differences(function: Callable[[Array], Array], columns: Iterable[int], size: int) -> Array:
    """(K, size) derivative of K numbers at zero by `size` others, of these the columns, by central differences."""
    found = np.zeros((np.size(function(np.zeros(size))), size))
    for k in columns:
        step = np.zeros(size)
        step[k] = STEP
        found[:, k] = np.ravel(function(step) - function(-step)) / (2 * STEP)
    return found


# ---- damping --------------------------------------------------------------------------------------------------------


def damping(scene: Scene, place: Layout, t: float, x: Array) -> Array:
    """(V, V) less the derivative of all forces at rest by the velocities [A^T R_dot, omega_bar, q_dot]."""
    now = At(scene, place, t, x, np.zeros(place.v_size))
    total = _Sums([_placed(now, k) for k in range(len(markers(scene)))], np.zeros(place.v_size), np.zeros((0, 0)))
    D = np.zeros((place.v_size, place.v_size))
    for b, body in enumerate(scene.bodies):
        at = np.arange(place.iv[b] + 6, place.iv[b] + 6 + place.n[b])
        D[at, at] = 2 * body.damping * np.sqrt(body.model.omega2)
    for force in forces_of(scene):
        way, rates, law = _along(total, now, force)
        D -= way.T @ _differences(partial(law, now), range(len(rates)), len(rates)) @ rates
        if isinstance(force.place, OnBody):
            continue
        watched, still = _Watched(scene, place, t, x, now.v, []), np.zeros(len(rates))
        law(watched, still)
        if watched.looks:
            D -= way.T @ _by_speed(now, partial(law, rate=still))
    return D


def _by_speed(now: At, law: Callable[[At], Array]) -> Array:
    """(K, V) derivative of K numbers by the velocities of bodies, by differences."""
    size = now.place.v_size
    return _differences(lambda y: law(replace(now, v=to_global_axes(now.place, now.x, y))), range(size), size)


def _along(total: _Sums, now: At, force: Force) -> tuple[Array, Array, Callable[[At, Array], Array]]:
    """What a force acts along (K, V), the coordinates of whose rates it is a function (L, V), and that function."""
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
    jets = coordinates(scene, _pair(*(total.placed[number] for number in ends)), place)
    way = total.gradient(ends, np.array([jet.first for jet in jets]).reshape(-1, 12))
    c = np.array([float(jet.value) for jet in jets])
    return way, way, lambda there, rate: _law(force, there, c, rate) if c.size else c
