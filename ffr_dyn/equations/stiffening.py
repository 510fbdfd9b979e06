"""Geometric stiffening in readable form: one constant matrix per unit of each load, times the loads of the moment.

The compiled form, which the tests hold equal to this one, is `ffr_dyn.kernels.stiffening`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.equations.constraint_rows import Instant, drive_of
from ffr_dyn.equations.constraints import evaluate_word
from ffr_dyn.equations.forces import applied, gravity_at
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.joints import RELATION, Word
from ffr_dyn.scene.scene import Body, marker_number, markers
from ffr_prep.common.arrays import Array


def stiffness_of(body: Body) -> Array:
    """(loads, n, n) geometric stiffness of a body, none where it has none or the scene does without."""
    n = body.model.n
    if body.model.stiffening is None or not body.stiffening:
        return np.zeros((0, n, n))
    return body.model.stiffening


def frame_loads(acceleration: Array, omega: Array, gravity: Array) -> Array:
    """(12,) the loads of the moving frame, body axes: acceleration less gravity, angular acceleration, and the products xx,
    yy, zz, xy, xz, yz of the angular velocity.

    Equation (24) of docs/notation.md.

    acceleration (6 + n,) of the body [a, omega_bar_dot, q_ddot];  omega, gravity (3,) in body axes
    """
    products = np.outer(omega, omega)
    squares = [products[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return np.concatenate([acceleration[:3] - gravity, acceleration[3:6], squares])


def wrench_at(force: Array, u: Array) -> Array:
    """(6,) force and moment about the point u (3,) of a body of generalised forces (6 + n,) that act there, body axes.

    Equation (25) of docs/notation.md.
    """
    return np.concatenate([force[:3], force[3:6] - np.cross(u, force[:3])])


def stiffening_force(stiffness: Array, loads: Array, q: Array) -> Array:
    """(n,) elastic forces -K_sigma q, K_sigma the sum of stiffness (L, n, n) times loads (L,).

    Equation (26) of docs/notation.md.
    """
    return -np.asarray(np.einsum("l,lij,j->i", loads, stiffness, q))


def geometric_stiffening(now: Instant, wrenches: Array, v_dot: Array, lam: Array) -> Array:
    """(V,) -K_sigma q by the loads that belong to a solution; wrenches (M, 6) of the applied loads at all markers."""
    place, out = now.place, np.zeros(now.place.v_size)
    at_markers, field = wrenches + _reaction_wrenches(now, lam), gravity_at(now.scene, now.t)
    for b, body in enumerate(now.scene.bodies):
        stiffness = stiffness_of(body)
        if len(stiffness):
            own = [k for k, entry in enumerate(markers(now.scene)) if entry[0] == b]
            gravity = rotation_matrix(now.x[place.p(b)]).T @ field
            frame = frame_loads(v_dot[place.rigid(b)], now.v[place.omega(b)], gravity)
            loads = np.concatenate([frame, at_markers[own].ravel()])
            out[place.q_dot(b)] = stiffening_force(stiffness, loads, now.x[place.q(b)])
    return out


def applied_wrenches(now: Instant) -> Array:
    """(M, 6) of the loads on markers; those spread over surfaces stiffen nothing."""
    out = np.zeros((len(markers(now.scene)), 6))
    loads = applied(now.scene, now.place, now.t, now.x, now.v)
    for force, load in zip(forces_of(now.scene), loads, strict=True):
        ends = tuple(marker_number(now.scene, name) for name in force.place.markers(now.scene))
        _add_wrenches(now, out, ends, load.generalised)
    return out


def _reaction_wrenches(now: Instant, lam: Array) -> Array:
    """(M, 6) of the constraint forces -J^T lam; a relation acts by each of its coordinates."""
    out, values = np.zeros((len(markers(now.scene)), 6)), iter(lam)
    for block in now.blocks:
        for word in block.words:
            value = next(values)
            for k, part in enumerate(_halves(word) if word.kind == RELATION else [word]):
                row = evaluate_word(now.scene, now.place, now.x, now.v, part, block.markers, drive_of(word, now.t))
                _add_wrenches(now, out, block.markers[2 * k : 2 * k + 2], -value * row.jacobian)
    return out


def _halves(word: Word) -> list[Word]:
    """A relation with the factor of one of its coordinates at a time, the other zero."""
    (one, kind), (other, kind_2) = word.relation
    halves = ((one, kind), (0.0, kind_2)), ((0.0, kind), (other, kind_2))
    return [replace(word, relation=half, spacing=0.0) for half in halves]


def _add_wrenches(now: Instant, out: Array, ends: tuple[int, ...], force: Array) -> None:
    """Add to out (M, 6) the generalised force (V,) that acts at `ends`, markers of different bodies."""
    for k in ends:
        b, _, point = markers(now.scene)[k]
        if b < len(now.scene.bodies):
            interface = now.scene.bodies[b].model.interface(point)
            u = interface.position + interface.phi_t @ now.x[now.place.q(b)]
            out[k] += wrench_at(force[now.place.rigid(b)], u)
