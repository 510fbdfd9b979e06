"""The loads on a second-order body that its load matrices belong to, at a state: what each does to its elastic coordinates.

To first order the second-order displacement acts on the elastic coordinates as a stiffness by the loads of the moment, the
products of the angular velocity and the forces and moments at interfaces, -K_L q times each: by these shares its terms are
weighed against one another, and kept or left out. The motion itself has the terms whole (`ffr_dyn.equations.second_order`).
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.consistency.evaluation import Evaluator
from ffr_dyn.equations.forces import applied
from ffr_dyn.equations.second_order import INTERFACES, PRODUCTS, load_matrices
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene, marker_number, markers
from ffr_prep.common.arrays import Array


def loads_that_act(scene: Scene) -> tuple[tuple[int, int], ...]:
    """(body, number of the load) of all loads with matrices of the second-order bodies of a scene."""
    return tuple(
        (b, int(k)) for b, body in enumerate(scene.bodies) for k in np.flatnonzero(load_matrices(body).any(axis=(1, 2)))
    )


def second_order_forces(at: Evaluator, time: float, x: Array, v: Array, numbers: tuple[tuple[int, int], ...]) -> Array:
    """(V, L) -K_L q times each of the loads `numbers`, at the state (x, v) that was evaluated last."""
    place, scene = at.system.layout, at.system.scene
    forces, loads = np.zeros((place.v_size, len(numbers))), loads_at(at, time, x, v) if numbers else []
    for k, (b, load) in enumerate(numbers):
        forces[place.q_dot(b), k] = -loads[b][load] * (load_matrices(scene.bodies[b])[load] @ x[place.q(b)])
    return forces


def loads_at(at: Evaluator, time: float, x: Array, v: Array) -> list[Array]:
    """By body, its loads in the order of its matrices, (12 + 6 I,), body axes, at the state that was evaluated last."""
    scene, place = at.system.scene, at.system.layout
    wrenches = _reactions(at) + _applied(at, time, x, v)
    found = []
    for b, body in enumerate(scene.bodies):
        products = np.outer(v[place.omega(b)], v[place.omega(b)])
        squares = [products[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        own = [k for k, entry in enumerate(markers(scene)) if entry[0] == b]
        found.append(np.concatenate([np.zeros(PRODUCTS), squares, wrenches[own].ravel()]))
        assert len(body.model.interfaces) * 6 + INTERFACES == found[-1].size
    return found


def _reactions(at: Evaluator) -> Array:
    """(M, 6) forces and moments of the joints at all markers."""
    rows, work = at.system.model.rows, at.work
    out = np.zeros((len(work.markers.u), 6))
    for block, ends in enumerate(rows.marker):
        lines = slice(rows.start[block], rows.start[block + 1])
        for side, marker in enumerate(ends):
            if marker >= 0:
                jac = work.rows.jac[block * len(ends) + side, :6, : lines.stop - lines.start]
                out[marker] += _at_point(-jac @ work.rows.lam[lines], work.markers.u[marker])
    return out


def _applied(at: Evaluator, time: float, x: Array, v: Array) -> Array:
    """(M, 6) forces and moments of the applied loads at all markers; there are no matrices for those spread over surfaces."""
    scene, place = at.system.scene, at.system.layout
    out = np.zeros((len(markers(scene)), 6))
    for force, load in zip(forces_of(scene), applied(scene, place, time, x, v), strict=True):
        for name in force.place.markers(scene):
            k = marker_number(scene, name)
            b = markers(scene)[k][0]
            if b < len(scene.bodies):
                out[k] += _at_point(load.generalised[place.rigid(b)], at.work.markers.u[k])
    return out


def _at_point(six: Array, u: Array) -> Array:
    """Force, and moment about the point u (3,), of a force and a moment about the origin of the body (6,)."""
    return np.concatenate([six[:3], six[3:] - np.cross(u, six[:3])])
