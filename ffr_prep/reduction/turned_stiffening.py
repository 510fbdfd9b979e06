"""The geometric stiffness of a body in another frame, from the body alone.

Conversion of the reference conditions (`ffr_prep.reduction.conversion`) changes the matrices of `FlexibleBody.stiffening`
twice.

The loads. Each matrix belongs to a unit load and the reactions that hold it under the reference conditions. Those of the
new conditions are loads that have matrices of their own: forces and moments at interfaces or, for the mean axis, inertial
loads. With its new reactions a load is in equilibrium, so the old supports carry nothing and the old matrices add up.

The shapes. The new modes are old ones and rigid motions. Under a stress field sigma in equilibrium with loads f,

    K_sigma(u, theta x r) = integral of sigma : grad(-theta x u) dV = -sum of f . (theta x u),

because the gradient of theta x r is a constant rotation: the work of the loads on the turned displacement. For inertial
loads f = -rho a it is an integral over the mass that the body has. For a force F and a moment M at an interface that
moves by u and turns by phi it is

    -F . (theta x u) - M . (theta x phi) / 2,

as the moments of all bodies made here are (`ffr_prep.model.region_rotations`). Rigid translations have no gradient. So the
converted stiffness is the one that a reduction in the new frame computes: of solids and beams to rounding. Of plates, whose
bending moments stiffen nothing and whose fields turn up to the size of an element, it is nearly that.

Sources: Bathe, Finite Element Procedures (1996), section 6.2 (the linearised stress term); J. H. Argyris et al., Computer
Methods in Applied Mechanics and Engineering 20 (1979) 105-155 (semitangential moments).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.linalg

from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.accelerations import INERTIAL, gradients, turns
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reactions import supports
from ffr_prep.model.reference import ReferenceConditions

_ROUNDING = 1e-9  # beside one: of what a support carries, and of how a held place moves
_LEAVE_OUT = "or leave the stiffness out (replace(body, stiffening=None) in Python, --without-stiffening)"


def turned_stiffening(
    body: FlexibleBody, model: CoupledModel, conditions: ReferenceConditions, motions: tuple[Array, Array], Z: Array
) -> Array:
    """(12 + 6 I, k, k) geometric stiffness by load of the modes Z (6 + n, k) under the new reference conditions.

    model : the body in the coordinates of its six rigid and n elastic motions; motions : P_dm (3, 6 + n) and rP_dm
    (3, 3, 6 + n) of them

    Raises InputError when the body was reduced under more than six conditions, whose reactions it does not know, and when
    the new frame is held at an interface whose loads have no geometric stiffness.
    """
    _check_determinate(body)
    loads = np.vstack([_inertial(motions), model.C.toarray()])
    held = supports(model, conditions)
    carried = _reactions(body, loads, held @ loads) @ held
    whole = _of_all_motions(body, model, motions)
    idle = _idle(body)
    _check_known(body, idle, held)
    new = Z.T @ (whole + np.tensordot(carried, whole, 1)) @ Z
    new[idle] = 0.0
    return np.asarray((new + new.transpose(0, 2, 1)) / 2)


# ---- loads --------------------------------------------------------------------------------------------------------


def _inertial(motions: tuple[Array, Array]) -> Array:
    """(12, 6 + n) the generalised forces of unit accelerations."""
    P, rP = motions
    return -np.concatenate([P, np.einsum("akp,pkj->aj", gradients(), rP)])


def _reactions(body: FlexibleBody, loads: Array, L: Array) -> Array:
    """(12 + 6 I, r) the reactions of the conditions L (r, 6 + n) to the loads (12 + 6 I, 6 + n).

    Six follow from equilibrium; more are shared as the flexibility of the body says, as far as its modes know it.
    """
    held, wanted = L[:, :6].T, -loads[:, :6].T
    balanced = np.linalg.lstsq(held, wanted, rcond=None)[0]
    free = scipy.linalg.null_space(held, rcond=1e-9)
    flexible = L[:, 6:] / body.omega2
    gap = free.T @ (flexible @ L[:, 6:].T @ balanced + flexible @ loads[:, 6:].T)
    shared = np.linalg.lstsq(free.T @ flexible @ L[:, 6:].T @ free, -gap, rcond=None)[0]
    return np.asarray((balanced + free @ shared).T)


# ---- shapes -------------------------------------------------------------------------------------------------------


def _of_all_motions(body: FlexibleBody, model: CoupledModel, motions: tuple[Array, Array]) -> Array:
    """(12 + 6 I, 6 + n, 6 + n) geometric stiffness of rigid motions (about the origin) and elastic coordinates."""
    works = np.concatenate([_works_of_inertia(motions), _works_at_interfaces(model)])
    K = np.zeros((len(works), 6 + body.n, 6 + body.n))
    K[:, 6:, 6:] = body.stiffening
    K[:, 3:6, 3:] = works[:, :, 3:]
    K[:, 6:, 3:6] = works[:, :, 6:].transpose(0, 2, 1)
    return K


def _works_of_inertia(motions: tuple[Array, Array]) -> Array:
    """(12, 3, 6 + n) integrals of a . (theta x phi_j) dm of unit accelerations a and rotations theta."""
    P, rP = motions
    of_translations = np.einsum("akm,mj->kaj", turns(), P)
    return np.concatenate([of_translations, np.einsum("lkp,akm,pmj->laj", gradients(), turns(), rP)])


def _works_at_interfaces(model: CoupledModel) -> Array:
    """(6 I, 3, 6 + n) of unit forces on the turned translations, of unit moments on half the turned rotations."""
    six = model.C.toarray().reshape(-1, 2, 3, model.C.shape[1])
    works = -np.einsum("akm,islmj->islkaj", turns(), six[:, :, None]) * np.array([1.0, 0.5])[:, None, None, None, None]
    return np.asarray(works.reshape(-1, 3, model.C.shape[1]))


# ---- guards -------------------------------------------------------------------------------------------------------


def condition_count(reference: Mapping[str, Any]) -> int:
    """How many reference conditions a body was reduced under, by its provenance; six where it does not say."""
    nodal = reference.get("on_nodes")
    if isinstance(nodal, Mapping):
        return int(nodal["shape"][0])
    return len(reference["supports"]) if "supports" in reference else 6


def _check_determinate(body: FlexibleBody) -> None:
    count = condition_count(body.provenance.get("reference", {}))
    if count > 6:
        raise InputError(
            f"the geometric stiffness of body {body.name!r} belongs to {count} conditions, more than the six that fix a "
            f"frame, and how they share a load is not known: reduce the mesh again under the new conditions, {_LEAVE_OUT}"
        )


def _idle(body: FlexibleBody) -> Array:
    """(12 + 6 I,) the loads that do not stiffen although what they act on moves: points added after the reduction.

    A place where the body is held moves by rounding. Against that stand the motions of the modes, of unit norm in the mass:
    about 1 / sqrt(mass), and for rotations 1 / sqrt(second moment of mass).
    """
    assert body.stiffening is not None
    six = body.stiffening[INERTIAL:].reshape(len(body.interfaces), -1)
    shift, turn = np.sqrt(body.mass), np.sqrt(np.trace(body.rr_dm) - body.r_dm @ body.r_dm / body.mass)
    motions = [np.stack([shift * i.phi_t, turn * i.phi_r]) for i in body.interfaces]
    moving = np.array([np.abs(of).max(initial=0.0) > _ROUNDING for of in motions], bool)
    return np.concatenate([np.zeros(INERTIAL, bool), np.repeat(moving & ~six.any(axis=1), 6)])


def _check_known(body: FlexibleBody, idle: Array, held: Array) -> None:
    lost = np.flatnonzero((idle & (np.abs(held) > _ROUNDING).any(axis=0))[INERTIAL:])
    if lost.size:
        name = body.interfaces[lost[0] // 6].name
        raise InputError(
            f"loads at interface {name!r} have no geometric stiffness in body {body.name!r} (a point that was added after "
            f"the reduction?): the frame cannot be held there; choose other interfaces, {_LEAVE_OUT}"
        )
