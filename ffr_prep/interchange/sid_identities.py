"""Orders, layouts and identities of standard input data: which blocks repeat each other, and what a file adds to mass.

Source: Wallrapp 1994, see `ffr_prep.interchange.sid`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import IDENTITY_TOLERANCE, Bounds, from_parts, hold, relative
from ffr_prep.interchange.sid_blocks import Taylor
from ffr_prep.model.invariants import from_inertia, skew

Layout = Literal["mode-major", "axis-major"]

J_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# The products of the angular velocity that the columns of Oe belong to, among the loads of `FlexibleBody.stiffening`.
PRODUCTS = [6, 7, 8, 9, 11, 10]
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


def check_repeated(found: Mapping[str, Taylor], limit: Bounds) -> dict[str, str]:
    """The layouts of Gr and Ge, which may repeat all of Cr.m1 or its part of the mass. Raises InputError where blocks that
    repeat each other differ."""
    J1 = tensor(found["J"].m1[:, :, 0])
    P_dm, rP_dm = found["mdCM"].m1[:, :, 0], from_parts(from_inertia(J1), found["Cr"].m0.T)
    hold("Ct = transpose of mdCM.m1", found["Ct"].m0 - P_dm.T, limit.first[:, None])
    hold("Oe.m0 = centrifugal forces from J.m1", found["Oe"].m0 - centrifugal(rP_dm).T, limit.second[:, None])
    Cr1 = found["Cr"].m1

    def of_Gr(Gr: Array) -> float:
        return relative(Gr + Gr.transpose(2, 1, 0) - 2 * J1.transpose(0, 2, 1), limit.second[:, None])

    def of_Ge(Ge: Array) -> float:
        off = [relative(Ge - 2 * part, limit.third[:, :, None]) for part in (Cr1, of_mass(Cr1))]
        return min(off)

    Gr = {layout: of_Gr(taken_apart(found["Gr"].m0, layout)) for layout in get_args(Layout)}
    Ge = {layout: of_Ge(taken_apart(found["Ge"].m0, layout)) for layout in get_args(Layout)}
    return {"Gr": _fitting("Gr_l + transpose = 2 dJ/dq_l", Gr), "Ge": _fitting("Ge = 2 Cr.m1", Ge)}


def _fitting(identity: str, residuals: Mapping[str, float]) -> str:
    best = min(residuals, key=lambda layout: residuals[layout])
    if residuals[best] > IDENTITY_TOLERANCE:
        off = ", ".join(f"{layout} by {residual:.1e}" for layout, residual in residuals.items())
        raise InputError(f"the identity {identity} fails in both layouts ({off}, relative): a block is damaged")
    return best


def of_accelerations(found: Mapping[str, Taylor], layout: Mapping[str, str], limit: Bounds) -> tuple[Array, list[str]]:
    """(6, n, n) geometric stiffness of the acceleration and the angular acceleration: Ct.m1, and what is symmetric in
    the modes of Cr.m1; and a warning where that is none.

    FEMBS repeats all of Cr.m1 in Ge, where no stiffness belongs, in files that have none of accelerations either: its
    symmetric part is then what lumping the mass has left.
    """
    Ct1, Cr1, Ge = found["Ct"].m1, found["Cr"].m1, taken_apart(found["Ge"].m0, layout["Ge"])
    symmetric, bound = Cr1 - of_mass(Cr1), limit.third[:, :, None]
    size, warnings = relative(symmetric, bound), []
    repeated = relative(Ge - 2 * Cr1, bound) <= IDENTITY_TOLERANCE
    if size > IDENTITY_TOLERANCE and repeated and not Ct1.any():
        symmetric = np.zeros_like(Cr1)
        warnings = [
            f"dropped: the part of Cr.m1 that is symmetric in the modes ({size:.1e}, relative); Ge repeats it, so it is no "
            "geometric stiffness, and no mass has it"
        ]
    return np.concatenate([Ct1.transpose(2, 0, 1), symmetric.transpose(2, 0, 1)]), warnings


def lost_blocks(found: Mapping[str, Taylor]) -> list[str]:
    """Warnings of what a body cannot hold: prestress, higher orders."""
    lost = ["dropped: the prestress forces ksigma"] if found["ksigma"].m0.any() else []
    higher = [name for name in ("Me", "Gr", "Ge", "ksigma", "Ke", "De") if found[name].m1.any()]
    return [*lost, f"dropped: the terms of order 1 of {', '.join(higher)}"] if higher else lost


def lumped_mass(found: Mapping[str, Taylor], layout: Mapping[str, str], limit: Bounds) -> list[str]:
    """A consistent mass has Gr_l - transpose = -2 skew(Cr_l); rotary inertia of nodes is in Cr only."""
    Gr = taken_apart(found["Gr"].m0, layout["Gr"])
    off = relative(Gr - Gr.transpose(2, 1, 0) + 2 * skew(found["Cr"].m0.T).transpose(0, 2, 1), limit.second[:, None])
    if off <= IDENTITY_TOLERANCE:
        return []
    return [f"lumped mass: the identity antisym(Gr_l) = -skew(Cr_l) fails by {off:.1e} (relative); Cr was taken"]
