"""The second-order displacement of a surface in the frame of other reference conditions.

The new modes are old ones and rigid motions, q = X q' with a rotation psi = A_r q' and a translation A_t q'. A point of the
old field u_0 + Phi q + u_2 is seen from the new frame at

    tau + exp(psi~) (u_0 + Phi q + u_2),    psi = A_r q' + psi_2,  tau = A_t q' + tau_2,

so to second order its displacement is

    u_2' = u_2 + psi x Phi q + psi x (psi x u_0) / 2 + psi_2 x u_0 + tau_2.

psi_2 and tau_2, which the new conditions hold, follow from the mean translation and rotation of u_2' over the mass: those of
the first six matrices of the geometric stiffness,

    int u_2,k dm = 1/2 q K_k q,    int (u_0 x u_2)_k dm = 1/2 q K_(3+k) q.

The stress of second order is that of Green's strain, which no rigid motion changes.

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 2.2 and 6.7.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.body.accelerations import turned, turns
from ffr_prep.body.constructors import recombined
from ffr_prep.body.reduced import FlexibleBody, Surface, axial
from ffr_prep.body.second_order import compressed, linear_surface
from ffr_prep.common.arrays import Array


def turned_surface(body: FlexibleBody, Z: Array, omega2: Array, stiffening: Array | None) -> Surface | None:
    """The surface of the body for the modes Z (6 + n, k) with squared frequencies omega2 (k,).

    stiffening : (12 + 6 I, k, k) of the new modes; None of a body without, whose surface moves to first order
    """
    if body.surface is None:
        return None
    surface = body.surface
    arms = np.einsum("akm,pm->pka", turns(), surface.points)
    old = recombined(surface, Z[6:], surface.Phi @ Z[6:])
    new = replace(old, Phi=old.Phi + Z[:3] + arms @ Z[3:6])
    if surface.second is None or stiffening is None or body.stiffening is None:
        return linear_surface(new)
    held = _held(body, Z, stiffening)
    parts = [_pairs(old, arms, Z[3:6], i, held[:, i, i:]) for i in range(omega2.size)]
    return replace(new, second=compressed(np.concatenate(parts, axis=2), omega2))


def _pairs(old: Surface, arms: Array, psi: Array, i: int, held: Array) -> Array:
    """(P, 3, k - i) second derivatives of the displacement of the points by the coordinates i and those from i on.

    held : (6, k - i) of tau_2 and psi_2
    """
    assert old.second is not None
    relaxed = np.tensordot(old.second.shapes, old.second.weights[:, i, i:], 1)
    rotated = _crossed(psi[:, i], psi[:, i:], old.Phi[..., i], old.Phi[..., i:])
    of_arm = np.einsum("klm,pl->pkm", turned(psi[:, i], psi[:, i:]), old.points)
    return np.asarray(relaxed + rotated + of_arm + held[:3] + arms @ held[3:])


def _crossed(one: Array, others: Array, phi: Array, phis: Array) -> Array:
    """(P, 3, m) one x phis + others x phi; one (3,), others (3, m), phi (P, 3), phis (P, 3, m)."""
    return np.cross(one[None, :, None], phis, axis=1) + np.cross(others[None], phi[..., None], axis=1)


def _held(body: FlexibleBody, Z: Array, stiffening: Array) -> Array:
    """(6, k, k) second derivatives of tau_2 and psi_2."""
    assert body.stiffening is not None
    X, psi = Z[6:], Z[3:6]
    P, rP = body.P_dm @ X, body.rP_dm @ X
    G = np.moveaxis(turned(psi.T, psi), 0, -2)
    moved = np.einsum("akm,ai,mj->kij", turns(), psi, P)
    spun = np.einsum("ki,llj->kij", psi, rP) - np.einsum("lkj,li->kij", rP, psi)
    turning = np.concatenate([moved + moved.transpose(0, 2, 1), spun + spun.transpose(0, 2, 1)])
    turning[:3] += np.einsum("klij,l->kij", G, body.r_dm)
    turning[3:] += axial(np.einsum("km,lmij->klij", body.rr_dm, G))
    shift = np.einsum("akm,m->ka", turns(), body.r_dm)
    M_r = np.block([[body.mass * np.eye(3), shift], [shift.T, body.inertia]])
    wanted = stiffening[:6] - X.T @ body.stiffening[:6] @ X - turning
    return np.linalg.solve(M_r, wanted.reshape(6, -1)).reshape(wanted.shape)
