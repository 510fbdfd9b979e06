"""Forces and constraints at rest with their derivatives: what Newton's method needs for an equilibrium.

Motions are small ones y (V,) of all bodies, [A^T dR, turn about body axes, dq], from the state at hand: R moves along a
straight line, A to A exp(turn~). Where all forces have a potential, the tangent is the matrix of its second derivatives,
symmetric whether the forces balance or not.

All acts on markers, whose second derivatives are in `ffr_dyn.equations.placed`; those of rows and of the coordinates of
forces are in `ffr_dyn.equations.jets`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.constraint_rows import Block, drive_of
from ffr_dyn.equations.forces import At, gravity_at
from ffr_dyn.equations.forces_at_rest import add_force, damping_of, is_load
from ffr_dyn.equations.inertia import damping_matrix, gravity_force, kept_integrals
from ffr_dyn.equations.jets import WORDS, Jet, joint_coordinate
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.placed import Sums, all_placed, curvature, nothing_on, pair
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.joints import RELATION, Word
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Balance:
    """Forces (V,) but those of the constraints, Phi (C,) and jacobian (C, V) of the rows.

    stiffness : (V, V) of forces - jacobian^T lam, at the multipliers lam: less its derivative by y
    angles    : that forces act on, by their names, with whole turns
    """

    forces: Array
    Phi: Array
    jacobian: Array
    stiffness: Array
    angles: Mapping[str, float]


def balance(
    scene: Scene,
    place: Layout,
    blocks: Sequence[Block],
    t: float,
    x: Array,
    lam: Array,
    near: Mapping[str, float],
    share: float = 1.0,
) -> Balance:
    """A scene at rest at the time t [s] and the positions x, its rows those of the blocks, with multipliers lam (C,).

    near : angles of a state before, to which whole turns are counted; without them as the forces say of the start
    share : of weight and loads
    """
    now, angles = At(scene, place, t, x, np.zeros(place.v_size)), dict[str, float]()
    placed = all_placed(now)
    total, loads, acting = (nothing_on(placed, place.v_size) for _ in range(3))
    for number in range(len(scene.bodies)):
        _add_weight(loads, now, number)
        elastic, omega2 = place.q_dot(number), kept_integrals(scene.bodies[number]).omega2
        total.forces[elastic] -= omega2 * x[place.q(number)]
        total.tangent[elastic, elastic] -= np.diag(omega2)
    for force in forces_of(scene):
        add_force(loads if is_load(force) else total, now, force, near, angles)
    total.forces[:] += share * loads.forces
    total.tangent[:] += share * loads.tangent
    multipliers = iter(lam.tolist())
    rows = [row for block in blocks for row in _add_block(acting, block, t, multipliers)]
    Phi, jacobian = np.array([value for value, _ in rows]), np.array([gradient for _, gradient in rows])
    return Balance(total.forces, Phi, jacobian.reshape(-1, place.v_size), acting.tangent - total.tangent, angles)


def damping(scene: Scene, place: Layout, t: float, x: Array) -> Array:
    """(V, V) less the derivative of all forces at rest by the velocities [A^T R_dot, omega_bar, q_dot]."""
    now, D = At(scene, place, t, x, np.zeros(place.v_size)), np.zeros((place.v_size, place.v_size))
    total = nothing_on(all_placed(now), place.v_size)
    for b, body in enumerate(scene.bodies):
        at = slice(place.iv[b] + 6, place.iv[b] + 6 + place.n[b])
        D[at, at] = damping_matrix(body.model, body.damping)
    for force in forces_of(scene):
        D += damping_of(total, now, force)
    return D


def _add_block(total: Sums, block: Block, t: float, multipliers: Iterator[float]) -> list[tuple[float, Array]]:
    """Phi and its gradient (V,) of each row; their second derivatives times the multipliers are added."""
    found, acting = [], dict[tuple[int, int], Jet]()
    for word, multiplier in zip(block.words, multipliers, strict=False):
        s = drive_of(word, t)[0]
        value, gradient = -s if word.kind == RELATION else 0.0, np.zeros(total.forces.size)
        for ends, row in _jets(total, block, word, s):
            value += float(row.value)
            gradient += total.gradient(ends, row.first)
            acting[ends] = row * multiplier + acting[ends] if ends in acting else row * multiplier
        found.append((value - word.spacing * round(value / word.spacing) if word.spacing else value, gradient))
    for ends, sum_of_rows in acting.items():
        total.add_on_pair(ends, sum_of_rows.first, sum_of_rows.second)
    return found


def _jets(total: Sums, block: Block, word: Word, s: float) -> list[tuple[tuple[int, int], Jet]]:
    """The terms whose sum is a row, with the markers of each."""
    found = []
    for k in range(0, len(block.markers), 2):
        ends = block.markers[k], block.markers[k + 1]
        both = pair(*(total.placed[number] for number in ends))
        if word.kind != RELATION:
            return [(ends, WORDS[word.kind](both, word, s))]
        factor, kind = word.relation[k // 2]
        found.append((ends, joint_coordinate(both, kind, word.axes[3 * (k // 2) : 3 * (k // 2) + 3]) * factor))
    return found


def _add_weight(total: Sums, now: At, b: int) -> None:
    body, place, x = now.scene.bodies[b], now.place, now.x
    integrals, q, A = kept_integrals(body), x[place.q(b)], rotation_matrix(x[place.p(b)])
    field, at = gravity_at(now.scene, now.t), slice(place.iv[b], place.iv[b] + 6 + place.n[b])
    s, none = integrals.r_dm + integrals.P_dm @ q, np.zeros(3)
    total.forces[at] += gravity_force(integrals, q, A, field)
    total.tangent[at, at] += curvature(s, integrals.P_dm, none, 0 * integrals.P_dm, np.zeros((6, 0)), field @ A, none)
