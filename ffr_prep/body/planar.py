"""Planar bodies: the elastic coordinates of a body that move in a plane.

A frame of beams that lies in a plane of symmetry of its sections moves in that plane or across it, one without the other.
For planar scenes only the motions in the plane matter: with nodes of three coordinates (two displacements and a slope)
they are those of the planar beam element. They are the combinations of elastic coordinates without displacement along
the normal, and are brought to the form of every body again, mass-orthonormal with a diagonal stiffness.

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), section 6.2 (planar beam element).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.body import FlexibleBody, recombined
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

_IN_PLANE = 1e-9
_ACROSS = 1e-5


def in_plane(body: FlexibleBody, normal: Sequence[float] = (0.0, 0.0, 1.0)) -> FlexibleBody:
    """The body with only the elastic coordinates that move across `normal` (3,), in body axes, ascending in frequency.

    Modes of equal frequency that mix both directions, as of round rods, are taken apart.

    Raises InputError for a body whose motions in and across the plane are coupled, or that has none in it.
    """
    direction = np.asarray(normal, float)
    if direction.shape != (3,) or not 0 < np.linalg.norm(direction) < np.inf:
        raise InputError(f"in_plane of {body.name!r}: normal {normal} is not a direction (x, y, z)")
    direction = direction / np.linalg.norm(direction)
    along = _across(body, direction)
    values, vectors = np.linalg.eigh((along + along.T) / 2)
    between = values[(values > _IN_PLANE) & (values < _ACROSS)]
    inside = vectors[:, values <= _IN_PLANE]
    stiffness = inside.T @ (body.omega2[:, None] * inside)
    leak = body.omega2[:, None] * inside - inside @ stiffness
    if between.size or np.abs(leak).max(initial=0.0) > 1e-6 * body.omega2.max(initial=0.0):
        raise InputError(
            f"body {body.name!r}: motions in the plane and along its normal {direction.round(6).tolist()} are coupled; the "
            "body must be symmetric about the plane"
        )
    if not inside.shape[1]:
        raise InputError(f"body {body.name!r} has no elastic coordinate in the plane: keep more modes in the reduction")
    omega2, turn = np.linalg.eigh((stiffness + stiffness.T) / 2)
    return combined(body, inside @ turn, omega2)


def _across(body: FlexibleBody, normal: Array) -> Array:
    """(n, n) how much the elastic coordinates move out of the plane: inside, at the surface and at the interfaces [1].

    Mean squares of displacements along the normal times the mass, and of rotations of interfaces about axes in the plane.
    """
    Q = np.einsum("k,l,klij->ij", normal, normal, body.PP_dm)
    in_it = np.eye(3) - np.outer(normal, normal)
    radius = np.sqrt(np.trace(body.rr_dm) / body.mass)
    rows = [np.zeros((1, body.n))]
    for interface in body.interfaces:
        rows += [normal[None] @ interface.phi_t, radius * in_it @ interface.phi_r]
    if body.surface is not None:
        rows.append(normal @ body.surface.Phi / np.sqrt(len(body.surface.points)))
    moved = np.vstack(rows)
    return Q + body.mass * moved.T @ moved


def combined(body: FlexibleBody, V: Array, omega2: Array) -> FlexibleBody:
    """The body in the elastic coordinates q = V q_new, V (n, m) orthonormal, with the squared frequencies omega2 (m,)."""
    return replace(
        body,
        P_dm=body.P_dm @ V,
        rP_dm=body.rP_dm @ V,
        PP_dm=np.einsum("klij,ia,jb->klab", body.PP_dm, V, V, optimize=True),
        omega2=omega2,
        interfaces=tuple(replace(i, phi_t=i.phi_t @ V, phi_r=i.phi_r @ V) for i in body.interfaces),
        surface=body.surface and recombined(body.surface, V, body.surface.Phi @ V),
        stiffening=None if body.stiffening is None else V.T @ body.stiffening @ V,
        damping=None if body.damping is None else V.T @ body.damping @ V,
    )
