"""Orders, layouts and identities of standard input data: which blocks repeat each other, and what a file adds to mass.

Source: Wallrapp 1994, see `ffr_prep.interchange.sid`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np

from ffr_prep.body import axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import IDENTITY_TOLERANCE, Bounds, hold, relative
from ffr_prep.interchange.sid_blocks import Taylor
from ffr_prep.model.invariants import skew

Layout = Literal["mode-major", "axis-major"]

J_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
OE_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


# ---- orders and layouts -------------------------------------------------------------------------------------------


def six(matrix: Array) -> Array:
    """(..., 3, 3) -> (..., 6) in the order of J."""
    return np.stack([matrix[..., k, l] for k, l in J_ORDER], axis=-1)  # noqa: E741


def tensor(values: Array) -> Array:
    """(6, ...) in the order of J -> (3, 3, ...)."""
    filled = np.zeros((3, 3, *values.shape[1:]))
    for value_of, (k, l) in zip(values, J_ORDER, strict=True):  # noqa: E741
        filled[k, l] = filled[l, k] = value_of
    return filled


def centrifugal(moment: Array) -> Array:
    """(3, 3, ...) integral of a b^T dm -> (6, ...) integral of b . omega~ omega~ a dm per product of omega."""
    trace = np.einsum("kk...->...", moment)
    return np.stack([moment[k, l] - trace if k == l else moment[k, l] + moment[l, k] for k, l in OE_ORDER])  # noqa: E741


def laid_out(matrices: Array, layout: Layout) -> Array:
    """(rows, n, 3) -> (rows, 3n)."""
    ordered = matrices if layout == "mode-major" else matrices.transpose(0, 2, 1)
    return ordered.reshape(len(matrices), 3 * matrices.shape[1])


def taken_apart(matrix: Array, layout: str) -> Array:
    """(rows, 3n) -> (rows, n, 3)."""
    rows, n = matrix.shape[0], matrix.shape[1] // 3
    return matrix.reshape(rows, n, 3) if layout == "mode-major" else matrix.reshape(rows, 3, n).transpose(0, 2, 1)


def of_mass(Cr1: Array) -> Array:
    """The part of Cr.m1 that is an integral over the mass: antisymmetric in the modes."""
    return 0.5 * (Cr1 - Cr1.transpose(1, 0, 2))


# ---- what repeats and what is lost --------------------------------------------------------------------------------


def check_repeated(P_dm: Array, rP_dm: Array, found: Mapping[str, Taylor], limit: Bounds) -> dict[str, str]:
    """The layouts of Gr and Ge. Raises InputError where blocks that repeat each other differ."""
    hold("Ct = transpose of mdCM.m1", found["Ct"].m0 - P_dm.T, limit.first[:, None])
    hold("Oe.m0 = centrifugal forces from J.m1", found["Oe"].m0 - centrifugal(rP_dm).T, limit.second[:, None])
    J1 = tensor(found["J"].m1[:, :, 0])
    twice = 2 * of_mass(found["Cr"].m1)

    def of_Gr(Gr: Array) -> float:
        return relative(Gr + Gr.transpose(2, 1, 0) - 2 * J1.transpose(0, 2, 1), limit.second[:, None])

    def of_Ge(Ge: Array) -> float:
        return relative(Ge - twice, limit.third[:, :, None])

    Gr = {layout: of_Gr(taken_apart(found["Gr"].m0, layout)) for layout in get_args(Layout)}
    Ge = {layout: of_Ge(taken_apart(found["Ge"].m0, layout)) for layout in get_args(Layout)}
    return {"Gr": _fitting("Gr_l + transpose = 2 dJ/dq_l", Gr), "Ge": _fitting("Ge = 2 Cr.m1", Ge)}


def _fitting(identity: str, residuals: Mapping[str, float]) -> str:
    best = min(residuals, key=lambda layout: residuals[layout])
    if residuals[best] > IDENTITY_TOLERANCE:
        off = ", ".join(f"{layout} by {residual:.1e}" for layout, residual in residuals.items())
        raise InputError(f"the identity {identity} fails in both layouts ({off}, relative): a block is damaged")
    return best


def of_accelerations(found: Mapping[str, Taylor]) -> Array:
    """(6, n, n) geometric stiffness of the acceleration and the angular acceleration: Ct.m1, and what is symmetric in
    the modes of Cr.m1."""
    Cr1 = found["Cr"].m1
    return np.concatenate([found["Ct"].m1.transpose(2, 0, 1), (Cr1 - of_mass(Cr1)).transpose(2, 0, 1)])


def lost_blocks(found: Mapping[str, Taylor]) -> list[str]:
    """Warnings of what a body cannot hold: prestress, damping, higher orders."""
    lost = []
    for name, what in (("ksigma", "the prestress forces"), ("De", "the modal damping")):
        if found[name].m0.any():
            lost.append(f"dropped: {what} {name}")
    higher = [name for name in ("Me", "Gr", "Ge", "ksigma", "Ke", "De") if found[name].m1.any()]
    return [*lost, f"dropped: the terms of order 1 of {', '.join(higher)}"] if higher else lost


def lumped_mass(rP_dm: Array, found: Mapping[str, Taylor], layout: Mapping[str, str], limit: Bounds) -> list[str]:
    """A consistent mass has Gr_l - transpose = -2 skew(Cr_l); rotary inertia of nodes is in Cr only."""
    Gr = taken_apart(found["Gr"].m0, layout["Gr"])
    off = relative(Gr - Gr.transpose(2, 1, 0) + 2 * skew(axial(rP_dm)).transpose(0, 2, 1), limit.second[:, None])
    if off <= IDENTITY_TOLERANCE:
        return []
    return [f"lumped mass: the identity antisym(Gr_l) = -skew(Cr_l) fails by {off:.1e} (relative); Cr was taken"]
