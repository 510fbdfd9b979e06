"""The part of geometric stiffness that comes from the regions of interfaces: their rotation to second order.

Geometric stiffness is the second order of the work of stress and loads, so it needs the displacements to second order.
Those of free nodes are coordinates themselves. A region that an interface moves as one piece turns by the rotation vector
phi,

    u_k = u + phi x r_k + 1/2 phi x (phi x r_k),

and the forces f_k that its nodes exert on the body, less the loads on them, do work on the last term. With S = sum of
f_k r_k^T the region adds

    K = sym S - (tr S) I        per phi phi^T.

A mean interface has the rotation R of the best fit, sum of w (r + u) r^T = R U with U symmetric (polar decomposition). To
first order in D = sum of w u r^T, with J = sum of w r r^T and  I_J = (tr J) I - J,  that is the mean rotation phi of
`ffr_prep.model.coupled` and the stretch E = D - phi~ J. To second order the rotation vector is
phi - I_J^-1 [(J phi) x phi / 2 + ((tr E) I - E) phi], and where the point of the interface is c from the centroid it moves
by phi x (phi x c) / 2 besides. The force and the moment of the interface do work on both. Where rotations R_i of the nodes
count as well, by R_i Q beside (r + u) r^T, they are in J, D and E, and add I_J^-1 (sum of (Q theta_i) x theta_i) / 2.

So the moment at an interface is the one whose work is M . phi, phi being the rotation vector: semitangential, turning with
half the rotation, for rigid and mean interfaces, solids, beams and plates alike, and in every frame.

Sources: J. H. Argyris et al., Computer Methods in Applied Mechanics and Engineering 20 (1979) 105-155 (semitangential
moments); B. K. P. Horn, J. Opt. Soc. Am. A 4 (1987) 629-642 (the rotation of the best fit).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.body.accelerations import INERTIAL, turned, turns
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel


@dataclass(frozen=True)
class RigidRegion:
    """Nodes that follow an interface, as far as their rotation does work.

    nodes, offsets : (m,) and (m, 3) [m] from the point of the interface
    rotation : (3, Z) of the interface
    internal : (9, Z) S of the forces on the nodes that the stiffness asks for, K u
    loads    : (9, 12 + 6 I) S of the known loads on them
    """

    nodes: Array
    offsets: Array
    rotation: sp.csr_array
    internal: sp.csr_array
    loads: Array


@dataclass(frozen=True)
class MeanRegion:
    """Nodes that an interface follows in the mean.

    rotation : (3, Z) of the interface
    spread   : (9, Z) D
    second_moment : (3, 3) J
    arm      : (3,) from the centroid to the point of the interface [m]
    first    : which of the known loads is the first force of the interface
    turning, of_each : (3 m, Z) rotations of the nodes that count as well and what each adds to J; none of solids
    """

    rotation: sp.csr_array
    spread: sp.csr_array
    second_moment: Array
    arm: Array
    first: int
    turning: sp.csr_array
    of_each: Array


def region_stiffening(regions: Sequence[RigidRegion | MeanRegion], static: Array, loads: Array, basis: Array) -> Array:
    """(r, n, n) what the regions add to the geometric stiffness of the basis (Z, n).

    static : (Z, r) displacements; loads : (12 + 6 I, r) amplitudes of the known loads, reactions included
    """
    K = np.zeros((static.shape[1], basis.shape[1], basis.shape[1]))
    for region in regions:
        phi = region.rotation @ basis
        if isinstance(region, RigidRegion):
            S = region.internal @ static - region.loads @ loads
            K += phi.T @ second_order_turn(S.T.reshape(-1, 3, 3)) @ phi
        else:
            K += _of_mean(region, loads[region.first : region.first + 6].T, basis)
    return K


def known_second_order(regions: Sequence[RigidRegion | MeanRegion], model: CoupledModel, basis: Array) -> Array:
    """(12 + 6 I, n, n) the part E of `region_stiffening` as linear form of the amplitudes of the known loads."""
    size, count = model.C.shape[1], INERTIAL + model.C.shape[0]
    return region_stiffening(regions, np.zeros((size, count)), np.eye(count), basis)


def second_order_forces(regions: Sequence[RigidRegion | MeanRegion], one: Array, others: Array) -> Array:
    """(Z, m) the part F of `region_stiffening` as linear form of the static displacement, of one (Z,) with others (Z, m)."""
    rigid = [region for region in regions if isinstance(region, RigidRegion)]
    pairs = [turned(region.rotation @ one, region.rotation @ others).reshape(9, -1) for region in rigid]
    return sum((of.internal.T @ G for of, G in zip(rigid, pairs, strict=True)), np.zeros(others.shape))


def turned_nodes(regions: Sequence[RigidRegion | MeanRegion], count: int, one: Array, others: Array) -> Array:
    """(N, 3, m) second derivatives of the displacement of `count` nodes, those of rigid regions by their rotation."""
    field = np.zeros((count, 3, others.shape[1]))
    for region in regions:
        if isinstance(region, RigidRegion):
            G = turned(region.rotation @ one, region.rotation @ others)
            field[region.nodes] = np.einsum("klm,pl->pkm", G, region.offsets)
    return field


def second_order_turn(S: Array) -> Array:
    """(..., 3, 3) second derivatives by phi of the work of forces f at arms r that turn by phi; S = sum of f r^T."""
    return (S + np.swapaxes(S, -1, -2)) / 2 - np.trace(S, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)


def force_moments(nodes: Array, offsets: Array, width: int, count: int) -> sp.csr_array:
    """(9, width N) sum of f_a r_b at row 3 a + b, of forces or displacements at nodes with `width` coordinates.

    offsets : (m, 3) r at the `nodes` (m,) of the `count` N
    """
    a, b = np.divmod(np.arange(9), 3)
    columns = width * nodes[None, :] + a[:, None]
    return sp.csr_array(
        sp.coo_array(
            (offsets[:, b].T.ravel(), (np.repeat(np.arange(9), len(nodes)), columns.ravel())), shape=(9, width * count)
        )
    )


def _of_mean(region: MeanRegion, wrench: Array, basis: Array) -> Array:
    """(r, n, n) of the loads wrench (r, 6) on a mean interface."""
    J, n = region.second_moment, basis.shape[1]
    phi, spread, nodal = region.rotation @ basis, region.spread @ basis, (region.turning @ basis).reshape(-1, 3, n)
    force, moment = wrench[:, :3], wrench[:, 3:] + np.cross(region.arm, wrench[:, :3])
    turn = np.linalg.solve(_inertia(J[None])[0], moment.T).T
    stretch = spread.T.reshape(n, 3, 3) - np.einsum("akm,aj->jkm", turns(), phi) @ J
    of_stretch = np.einsum("rk,jkl,li->rij", turn, _inertia((stretch + stretch.transpose(0, 2, 1)) / 2), phi)
    of_rotation = phi.T @ _gyroscopic(turn, J) @ phi
    of_nodes = np.einsum("pki,rkl,plj->rij", nodal, _gyroscopic(turn, region.of_each), nodal, optimize=True)
    of_arm = phi.T @ second_order_turn(-force[:, :, None] * region.arm) @ phi
    return of_stretch + of_stretch.transpose(0, 2, 1) + of_rotation - of_nodes + of_arm


def _gyroscopic(turn: Array, second_moment: Array) -> Array:
    """(r, 3, 3) second derivatives of turn . (J phi) x phi / 2."""
    product = np.einsum("akm,ra->rkm", turns(), turn) @ second_moment
    return (product + product.transpose(0, 2, 1)) / 2


def _inertia(second_moments: Array) -> Array:
    """(..., 3, 3) (tr A) I - A."""
    return np.trace(second_moments, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - second_moments
