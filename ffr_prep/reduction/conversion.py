"""Other reference conditions for a reduced body, without its finite-element model.

Reference conditions decide how the motion of the body is shared between its frame and its elastic field. The field of
another frame is that of the old one plus rigid motion, so with the rigid motions T about the origin of the body frame

    phi'_j = sum_i phi_i X_ij + T A_j,    L phi'_j = 0,

and every integral of the body follows from the old ones by the same combination Z = [A; X], exactly. Six conditions keep
all motion, and the body is the one that a reduction under them would have made, as long as that takes its basis from the
interfaces: Craig-Bampton, Rubin, static shapes. Plain eigenmodes belong to their conditions; converted, they stay the
deformations that they were.

The geometric stiffness by load follows as well (`ffr_prep.reduction.turned_stiffening`).

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), section 6.7; O. P. Agrawal, A. A. Shabana, Computers &
Structures 21 (1985) 1303-1312.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import FlexibleBody, Interface, Surface
from ffr_prep.body.interface_freedom import interface_freedom
from ffr_prep.body.provenance import described
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.accelerations import turns
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.reference import ReferenceConditions, UserConditions, conditions_of_part, functionals
from ffr_prep.reduction.basis import diagonalised, in_frame
from ffr_prep.reduction.turned_stiffening import condition_count, turned_stiffening


def with_reference(body: FlexibleBody, conditions: ReferenceConditions) -> FlexibleBody:
    """The body in the frame of other reference conditions: fixed to or supported at interfaces, or mean axis.

    Modes are those under the new conditions, diagonal again; with more than six conditions there are fewer. What the old
    body could not represent, the new one cannot either; its provenance says so in "warnings".

    Raises InputError for conditions on the nodes of a mesh, for conditions that name an
    unknown interface or leave a rigid motion, and for a geometric stiffness that does not determine the one in the new
    frame (`ffr_prep.reduction.turned_stiffening`).
    """
    if isinstance(conditions, UserConditions):
        raise InputError("conditions on the nodes of the mesh need the mesh: reduce it again, or use interfaces")
    model = motion_model(body)
    L = functionals(conditions, model)
    elastic = in_frame(model, L, np.eye(6 + body.n)[:, 6:])
    basis = diagonalised(model, elastic, elastic.T @ (model.K @ elastic))
    Z = basis.Z
    return replace(
        body,
        omega2=basis.omega2,
        interfaces=_interfaces(body, model, Z),
        surface=body.surface and _surface(body.surface, Z),
        stiffening=None
        if body.stiffening is None
        else turned_stiffening(body, model, conditions, first_integrals(body), Z),
        provenance=_provenance(body, conditions),
        parts=tuple(
            with_reference(p, conditions_of_part(conditions, [i.name for i in p.interfaces])) for p in body.parts
        ),
        **vars(combined_integrals(body, Z)),
    )


# ---- the body as a model of its own motions -----------------------------------------------------------------------


def motion_model(body: FlexibleBody) -> CoupledModel:
    """The body in the coordinates of six rigid motions about its origin and its n elastic ones, as reference conditions
    and reductions see a model."""
    n = body.n
    length = np.sqrt(np.trace(body.rr_dm) / body.mass)
    points = np.vstack([body.centre_of_mass + length * np.eye(3), *(i.position[None] for i in body.interfaces)])
    coordinates = [_coordinates(interface) for interface in body.interfaces]
    return CoupledModel(
        points=points,
        B=sp.csr_array((points.size, 6 + n)),
        K=sp.csr_array(np.diag(np.concatenate([np.zeros(6), body.omega2]))),
        M=sp.csr_array(_mass(body)),
        T=np.eye(6 + n)[:, :6],
        centre=np.zeros(3),
        places=np.full((6 + n, 3), np.nan),
        names=tuple(interface.name for interface in body.interfaces),
        kinds=tuple(interface.kind for interface in body.interfaces),
        positions=np.array([interface.position for interface in body.interfaces]).reshape(-1, 3),
        C=sp.csr_array(np.vstack([np.zeros((0, 6 + n)), *coordinates])),
    )


def _mass(body: FlexibleBody) -> Array:
    """(6 + n, 6 + n)."""
    turned = (turns() @ body.r_dm).T
    return np.block(
        [
            [body.mass * np.eye(3), turned, body.P_dm],
            [turned.T, body.inertia, body.I4],
            [body.P_dm.T, body.I4.T, np.eye(body.n)],
        ]
    )


def _coordinates(interface: Interface) -> Array:
    """(6, 6 + n) translation and rotation of an interface."""
    return np.block(
        [
            [np.eye(3), (turns() @ interface.position).T, interface.phi_t],
            [np.zeros((3, 3)), np.eye(3), interface.phi_r],
        ]
    )


# ---- what changes -------------------------------------------------------------------------------------------------


def combined_integrals(body: FlexibleBody, Z: Array) -> InertiaIntegrals:
    """The integrals of combinations Z (6 + n, k) of rigid motions about the origin and elastic coordinates."""
    r, rr, unit = body.r_dm, body.rr_dm, np.eye(3)
    P, rP = first_integrals(body)
    of_translations = np.einsum("ka,lj->klaj", unit, P)
    of_rotations = np.einsum("akm,mlj->klaj", turns(), rP)
    elastic = np.concatenate([of_translations[..., 6:], of_rotations[..., 6:]], axis=2).transpose(1, 0, 3, 2)
    PP = np.concatenate([of_translations, of_rotations, np.concatenate([elastic, body.PP_dm], axis=3)], axis=2)
    new = np.einsum("ia,klij,jb->klab", Z, PP, Z, optimize=True)
    return InertiaIntegrals(body.mass, r, rr, P @ Z, rP @ Z, (new + new.transpose(1, 0, 3, 2)) / 2)


def first_integrals(body: FlexibleBody) -> tuple[Array, Array]:
    """(3, 6 + n) P_dm and (3, 3, 6 + n) rP_dm of the rigid motions about the origin and the elastic coordinates."""
    P = np.hstack([body.mass * np.eye(3), (turns() @ body.r_dm).T, body.P_dm])
    of_translations = np.einsum("k,la->kla", body.r_dm, np.eye(3))
    of_rotations = np.einsum("km,alm->kla", body.rr_dm, turns())
    return P, np.concatenate([of_translations, of_rotations, body.rP_dm], axis=2)


def _interfaces(body: FlexibleBody, model: CoupledModel, Z: Array) -> tuple[Interface, ...]:
    shapes = (model.C @ Z).reshape(len(body.interfaces), 6, -1)
    return tuple(replace(i, phi_t=six[:3], phi_r=six[3:]) for i, six in zip(body.interfaces, shapes, strict=True))


def _surface(surface: Surface, Z: Array) -> Surface:
    """Rigid motion moves the points but stresses nothing."""
    turned = np.einsum("akm,pm->pka", turns(), surface.points)
    Phi = Z[:3] + turned @ Z[3:6] + surface.Phi @ Z[6:]
    beams = surface.beams and replace(surface.beams, modes=surface.beams.modes @ Z[6:])
    return replace(surface, Phi=Phi, stress=None if surface.stress is None else surface.stress @ Z[6:], beams=beams)


def _provenance(body: FlexibleBody, conditions: ReferenceConditions) -> dict[str, Any]:
    kept = {key: value for key, value in body.provenance.items() if key != "quality"}
    before = body.provenance.get("reference", {})
    warnings = [*body.provenance.get("warnings", []), *_losses(body, before)]
    return kept | {
        "reference": described(conditions),
        "converted_from": before,
        "warnings": list(dict.fromkeys(warnings)),
    }


def _losses(body: FlexibleBody, before: Mapping[str, Any]) -> list[str]:
    """The losses that the conversion cannot bring back, in words."""
    lost = []
    count = condition_count(before)
    if count > 6:
        lost.append(
            f"the body was reduced under {count} conditions, more than the six that fix a frame: the deformations that they "
            "prevented are lost; reduce the mesh again where they matter"
        )
    possible, wanted = interface_freedom(body) if body.interfaces else (0, 0)
    if possible < wanted:
        lost.append(
            f"the body has only {possible} independent motions of its {wanted} interface coordinates: under other reference "
            "conditions its modes are not those of a direct reduction; use craig-bampton before converting"
        )
    return lost
