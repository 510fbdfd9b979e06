"""A body in other motions: combinations Z of its rigid motions about the origin and of its elastic coordinates.

The elastic field of another frame is that of the old one plus rigid motion, so every integral, shape and load matrix of the
body in that frame is a combination of the old ones, Z (6 + n, k): three translations, three rotations, n coordinates.

To second order a place that moves by w in a frame which itself moves by delta and turns by the rotation vector theta goes to

    delta + theta x x + w  +  theta x w + theta x (theta x x) / 2 + (what the old frame has of second order),

and its rotation vector psi becomes theta + psi + theta x psi / 2. In the words of loads, of which the second-order part is
-q K q / 2 along each (`FlexibleBody.stiffening`): a load f has the stiffness -f . (theta x u) between a rotation and any
motion u, a moment half of that; translations have none. The same follows from the stress field of the load, since the
gradient of theta x r is a constant rotation. It holds under any conditions of the old frame, as many as there may be.

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), section 6.7; Bathe, Finite Element Procedures (1996), section
6.2 (the linearised stress term); J. H. Argyris et al., Computer Methods in Applied Mechanics and Engineering 20 (1979)
105-155 (semitangential moments).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.body.accelerations import gradients, turns
from ffr_prep.body.reduced import FlexibleBody, Interface
from ffr_prep.body.turned_surface import turned_surface
from ffr_prep.common.arrays import Array


def in_motions(body: FlexibleBody, Z: Array, omega2: Array, stiffening: Array | None) -> FlexibleBody:
    """The body in the motions Z (6 + n, k), with the squared frequencies omega2 (k,) and load matrices (12 + 6 I, k, k)."""
    P, rP = _first_moments(body)
    PP = np.einsum("ia,klij,jb->klab", Z, second_moments(body), Z, optimize=True)
    return replace(
        body,
        P_dm=P @ Z,
        rP_dm=rP @ Z,
        PP_dm=(PP + PP.transpose(1, 0, 3, 2)) / 2,
        omega2=omega2,
        interfaces=_interfaces(body, Z),
        surface=turned_surface(body, Z, omega2, stiffening),
        stiffening=stiffening,
        damping=None if body.damping is None else Z[6:].T @ body.damping @ Z[6:],
    )


# ---- what rigid and elastic motions have together ------------------------------------------------------------------


def mass_of_rigid_motions(body: FlexibleBody) -> list[list[float]]:
    """(6, 6) of translations and rotations about the axes of the body, as plain numbers."""
    (x, y, z), (of_x, of_y, of_z), m = body.r_dm.tolist(), body.rr_dm.tolist(), body.mass
    whole = of_x[0] + of_y[1] + of_z[2]
    return [
        [m, 0.0, 0.0, 0.0, z, -y],
        [0.0, m, 0.0, -z, 0.0, x],
        [0.0, 0.0, m, y, -x, 0.0],
        [0.0, -z, y, whole - of_x[0], 0.0 - of_x[1], 0.0 - of_x[2]],
        [z, 0.0, -x, 0.0 - of_y[0], whole - of_y[1], 0.0 - of_y[2]],
        [-y, x, 0.0, 0.0 - of_z[0], 0.0 - of_z[1], whole - of_z[2]],
    ]


def mass_of_motions(body: FlexibleBody) -> Array:
    """(6 + n, 6 + n)."""
    M = np.eye(6 + body.n)
    M[:6, :6] = mass_of_rigid_motions(body)
    if not body.n:
        return M
    M[:3, 6:], M[3:6, 6:] = body.P_dm, body.I4
    M[6:, :6] = M[:6, 6:].T
    return M


def second_moments(body: FlexibleBody) -> Array:
    """(3, 3, 6 + n, 6 + n) PP_dm of all motions."""
    P, rP = _first_moments(body)
    of_translations = np.einsum("ka,lj->klaj", np.eye(3), P)
    of_rotations = np.einsum("akm,mlj->klaj", turns(), rP)
    elastic = np.concatenate([of_translations[..., 6:], of_rotations[..., 6:]], axis=2).transpose(1, 0, 3, 2)
    return np.concatenate([of_translations, of_rotations, np.concatenate([elastic, body.PP_dm], axis=3)], axis=2)


def interface_motions(body: FlexibleBody) -> Array:
    """(6 I, 6 + n) translations and rotations of the interfaces."""
    return np.vstack([np.zeros((0, 6 + body.n)), *(_six(interface) for interface in body.interfaces)])


def loads_on_motions(body: FlexibleBody) -> Array:
    """(12 + 6 I, 6 + n) the generalised forces of the unit loads of `FlexibleBody.stiffening`."""
    P, rP = _first_moments(body)
    return np.vstack([-P, -np.einsum("akp,pkj->aj", gradients(), rP), interface_motions(body)])


def stiffening_of_motions(body: FlexibleBody) -> Array:
    """(12 + 6 I, 6 + n, 6 + n) the matrices of the unit loads for rigid motions and elastic coordinates.

    Between two rotations they are not symmetric; their symmetric part counts.
    """
    works = np.concatenate([_works_of_inertia(body), _works_at_interfaces(body)])
    K = np.zeros((len(works), 6 + body.n, 6 + body.n))
    K[:, 6:, 6:] = body.stiffening
    K[:, 3:6, 3:] = works[:, :, 3:]
    K[:, 6:, 3:6] = works[:, :, 6:].transpose(0, 2, 1)
    return K


def stiffening_in(body: FlexibleBody, Z: Array, reactions: Array) -> Array:
    """(12 + 6 I, k, k) load matrices of the motions Z (6 + n, k), each load with its reactions (12 + 6 I, 12 + 6 I) as
    combinations of loads."""
    whole = Z.T @ stiffening_of_motions(body) @ Z
    new = whole + np.tensordot(reactions, whole, 1)
    return np.asarray((new + new.transpose(0, 2, 1)) / 2)


def _six(interface: Interface) -> Array:
    """(6, 6 + n)."""
    return np.block(
        [
            [np.eye(3), (turns() @ interface.position).T, interface.phi_t],
            [np.zeros((3, 3)), np.eye(3), interface.phi_r],
        ]
    )


def _first_moments(body: FlexibleBody) -> tuple[Array, Array]:
    """(3, 6 + n) P_dm and (3, 3, 6 + n) rP_dm."""
    P = np.hstack([body.mass * np.eye(3), (turns() @ body.r_dm).T, body.P_dm])
    of_translations = np.einsum("k,la->kla", body.r_dm, np.eye(3))
    of_rotations = np.einsum("km,alm->kla", body.rr_dm, turns())
    return P, np.concatenate([of_translations, of_rotations, body.rP_dm], axis=2)


def _works_of_inertia(body: FlexibleBody) -> Array:
    """(12, 3, 6 + n) integrals of a . (theta x phi_j) dm of unit accelerations a and rotations theta."""
    P, rP = _first_moments(body)
    of_translations = np.einsum("akm,mj->kaj", turns(), P)
    return np.concatenate([of_translations, np.einsum("lkp,akm,pmj->laj", gradients(), turns(), rP)])


def _works_at_interfaces(body: FlexibleBody) -> Array:
    """(6 I, 3, 6 + n) of unit forces on the turned translations, of unit moments on half the turned rotations."""
    six = interface_motions(body).reshape(-1, 2, 3, 6 + body.n)
    works = -np.einsum("akm,islmj->islkaj", turns(), six[:, :, None]) * np.array([1.0, 0.5])[:, None, None, None, None]
    return np.asarray(works.reshape(-1, 3, 6 + body.n))


# ---- combinations --------------------------------------------------------------------------------------------------


def _interfaces(body: FlexibleBody, Z: Array) -> tuple[Interface, ...]:
    shapes = (interface_motions(body) @ Z).reshape(len(body.interfaces), 6, Z.shape[1])
    return tuple(replace(i, phi_t=six[:3], phi_r=six[3:]) for i, six in zip(body.interfaces, shapes, strict=True))
