"""The moments of the mass in standard input data: what the blocks say of them, in space and of planar models.

A planar model has its moment of inertia about the normal alone, and of J, Cr, Gr and Oe only what belongs to it. What it
leaves out no motion in that plane needs: the mass is taken to lie in the plane, half of what is free along each axis of it.

Source: Wallrapp 1994, see `ffr_prep.interchange.sid`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_prep.body import axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import (
    IDENTITY_TOLERANCE,
    MANY_MOMENTS,
    Bounds,
    Content,
    bounds,
    from_parts,
    hold,
    mended_trace,
    moments,
    nodal_masses,
    relative,
)
from ffr_prep.interchange.sid_blocks import Taylor
from ffr_prep.interchange.sid_identities import OE_ORDER, PRODUCTS, centrifugal, of_mass, tensor
from ffr_prep.model.invariants import from_inertia

_ENOUGH_NODES = 400
_NOTHING = 1e-9
LUMPING_LIMIT = 2.1  # of the sum of Oe.m1 against -2 Me; where a mode is rotary inertia alone it is 2


@dataclass(frozen=True)
class FirstMoments:
    """r_dm, rr_dm, P_dm, rP_dm as in FlexibleBody; normal : of a planar model, 0, 1, 2 for x, y, z, or None."""

    r_dm: Array
    rr_dm: Array
    P_dm: Array
    rP_dm: Array
    normal: int | None

    @property
    def axes(self) -> Sequence[int]:
        """Along which the mass moves."""
        return [k for k in range(3) if k != self.normal]

    def facts(self) -> dict[str, Any]:
        """For the provenance of a planar model: its plane, and a warning."""
        if self.normal is None:
            return {}
        return {"plane": "xyz"[self.normal]}

    def warnings(self) -> list[str]:
        """The blocks that a planar model leaves zero: those of motions out of its plane."""
        if self.normal is None:
            return []
        name = "xyz"[self.normal]
        return [
            f"a planar model: its inertia is that about {name} alone, so it can move in scenes of the plane {name} only "
            f'(plane = "{name}")'
        ]


def first_moments(mass: float, found: Mapping[str, Taylor]) -> FirstMoments:
    """The moments of first order in the shapes, from mdCM, J and Cr; of a planar model as of a mass in the plane."""
    J, J1 = tensor(found["J"].m0[:, 0]), tensor(found["J"].m1[:, :, 0])
    r_dm, P_dm = found["mdCM"].m0[:, 0], found["mdCM"].m1[:, :, 0]
    rr_dm, rP_dm = from_inertia(J), from_parts(from_inertia(J1), found["Cr"].m0.T)
    normal = _normal(J)
    if not J.any() and mass > 0:  # a point mass, as some files of beams have their bodies
        rr_dm = np.outer(r_dm, r_dm) / mass
    if normal is not None and mass > 0:
        flat = np.eye(3)
        flat[normal, normal] = 0.0
        rr_dm = np.outer(r_dm, r_dm) / mass
        rr_dm = rr_dm + 0.5 * (J[normal, normal] - np.trace(rr_dm)) * flat
        rP_dm = flat @ np.moveaxis(rP_dm, 2, 0) @ flat
        rP_dm = np.moveaxis(rP_dm, 0, 2)
    return FirstMoments(r_dm, rr_dm, P_dm, rP_dm, normal)


def _normal(J: Array) -> int | None:
    """The axis about which a model has inertia, where it has none about the others."""
    largest = int(np.abs(np.diag(J)).argmax())
    rest = J.copy()
    rest[largest, largest] = 0.0
    alone = np.abs(rest).max() <= _NOTHING * abs(J[largest, largest]) and J[largest, largest] > 0
    return largest if alone else None


# ---- second order in the shapes -----------------------------------------------------------------------------------


def with_second_moments(
    content: Content, K: Array, found: Mapping[str, Taylor], limit: Bounds, axes: Sequence[int]
) -> Content:
    """The content with a PP_dm whose trace over the axes of motion is Me, as the sum of Oe.m1 over xx, yy, zz = -2 Me
    (planar: -Me) demands, and with the geometric stiffness K (12 + 6 N, n, n) where the file has any, the part in Oe.m1
    included.

    Raises InputError where Oe.m1 is not symmetric in the modes, and where neither geometric stiffness nor lumping explains
    what is lacking.
    """
    symmetric, skewed = _symmetric_in_modes(found["Oe"].m1, limit)
    content = replace(content, PP_dm=_second_moments(symmetric, found, axes))
    stiffened = relative(K, limit.third) > IDENTITY_TOLERANCE
    PP_dm, off = mended_trace(content.PP_dm, content.M, axes)
    times = "2 " if len(axes) == 3 else ""
    identity = f"the identity sum of Oe.m1 over xx, yy, zz = -{times}Me fails by {off:.1e} (relative)"
    warning = ""
    if stiffened and off > IDENTITY_TOLERANCE:
        PP_dm, misfit = _at_nodes(content, axes)
        K[PRODUCTS] = symmetric.transpose(2, 0, 1) - centrifugal(PP_dm)
        warning = (
            f"Oe.m1 holds geometric stiffness beside inertia ({identity}): their sum is kept. The inertia alone is that of "
            f"masses at the nodes, off by {misfit:.1e}, which changes moments of inertia by squares of the deflection only"
        )
    elif not symmetric.any() and content.M.size:
        PP_dm, misfit = _at_nodes(content, axes)
        warning = f"Oe is of order 0: the second moments of the shapes are those of nodal masses, off by {misfit:.1e}"
    elif off > LUMPING_LIMIT:
        raise InputError(f"{identity}: too much for a lumped mass; Oe is damaged, or holds geometric stiffness alone")
    elif off > IDENTITY_TOLERANCE:
        share = "a third" if len(axes) == 3 else "half"
        warning = f"lumped mass: {identity}; each axis of PP_dm took {share}"
    facts = {**content.facts, "warnings": [*content.facts["warnings"], *skewed, *([warning] if warning else [])]}
    return replace(content, PP_dm=PP_dm, facts=facts, stiffening=K if stiffened else None)


def _symmetric_in_modes(Oe1: Array, limit: Bounds) -> tuple[Array, list[str]]:
    """Oe.m1 symmetric in the modes, which forces of the mass are; PY_SID leaves that out of the columns xy, yz, xz."""
    skewed = Oe1 - Oe1.transpose(1, 0, 2)
    hold("Oe.m1(k,l,c) = Oe.m1(l,k,c)", skewed[:, :, :3], limit.third[:, :, None])
    off = relative(skewed[:, :, 3:], limit.third[:, :, None])
    if off <= IDENTITY_TOLERANCE:
        return Oe1, []
    if off > 2 * (1 + IDENTITY_TOLERANCE):
        raise InputError(f"the identity Oe.m1(k,l,c) = Oe.m1(l,k,c) fails by {off:.1e}: the file is damaged")
    warning = (
        f"the columns xy, yz, xz of Oe.m1 are not symmetric in the modes (by {off:.1e}): their symmetric part was taken"
    )
    return 0.5 * (Oe1 + Oe1.transpose(1, 0, 2)), [warning]


def _second_moments(Oe1: Array, found: Mapping[str, Taylor], axes: Sequence[int]) -> Array:
    """(3, 3, n, n) PP_dm from Oe.m1, Me and Cr.m1."""
    M = found["Me"].m0
    both = np.zeros((3, 3, *M.shape))
    for column, (k, l) in enumerate(OE_ORDER):  # noqa: E741
        both[k, l] = both[l, k] = 2 * (Oe1[:, :, column] + M) if k == l else Oe1[:, :, column]
    if len(axes) < 3:
        (normal,) = set(range(3)) - set(axes)
        both[:] = 0.0
        both[axes, axes] = -Oe1[:, :, normal]
    return from_parts(both, of_mass(found["Cr"].m1).transpose(2, 1, 0))


def _at_nodes(content: Content, axes: Sequence[int]) -> tuple[Array, float]:
    """PP_dm of the masses at the nodes that come closest to all other integrals, and their relative misfit.

    However large the misfit, it spoils terms of second order in the elastic coordinates of J alone.
    """
    n, count = len(content.M), len(content.interfaces)
    at = content.interfaces[:: 1 + max(count // _ENOUGH_NODES, 9 * n * n * count // MANY_MOMENTS)]
    positions = np.array([i.position for i in at]).reshape(-1, 3)
    shapes = np.array([i.phi_t for i in at]).reshape(-1, 3, n)
    P, rP, PP = moments(positions, shapes)
    rr = np.einsum("pk,pl->klp", positions, positions)
    limit = bounds(content.mass, content.rr_dm, content.M)
    arm = np.sqrt(np.trace(content.rr_dm) / content.mass)
    known = (
        (np.ones((1, len(at))), np.array([content.mass]), content.mass),
        (positions.T, content.r_dm, content.mass * arm),
        (rr, content.rr_dm, content.mass * arm**2),
        (P, content.P_dm, limit.first[:, None]),
        (rP, content.rP_dm, limit.second[:, None]),
        (np.einsum("kkijp->ijp", PP), content.M, limit.third[:, :, None]),
        (axial(PP), axial(content.PP_dm), limit.third[:, :, None]),
    )
    rows = np.vstack([(one / scale).reshape(np.size(all_), len(at)) for one, all_, scale in known])
    target = np.concatenate([(sum_ / np.reshape(scale, np.shape(scale)[:-1])).ravel() for _, sum_, scale in known])
    masses, misfit = nodal_masses(rows, target)
    lumped = PP @ masses
    mixed = from_parts(lumped + lumped.swapaxes(0, 1), axial(content.PP_dm))
    return mended_trace(mixed, content.M, axes)[0], misfit
