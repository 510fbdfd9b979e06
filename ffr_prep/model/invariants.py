"""The inertia integrals of a reduced body, as exact products with the consistent mass.

The position field and the modes are both nodal fields of the finite elements, so with M = m (x) I_3 every integral of
a product of two of them is a product with m; nothing is lumped. I1...I9 and Shabana's S_bar are views of these
integrals (see `ffr_prep.body`).

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 5.3 and 6.5; O. Wallrapp, Mechanics of
Structures and Machines 22 (1994) 283-304 (standard input data).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.solvers.threads import product


@dataclass(frozen=True)
class InertiaIntegrals:
    """Shapes and units as in `ffr_prep.body.FlexibleBody`."""

    mass: float
    r_dm: Array
    rr_dm: Array
    P_dm: Array
    rP_dm: Array
    PP_dm: Array


def inertia_integrals(points: Array, m: sp.sparray, Phi: Array) -> InertiaIntegrals:
    """The integrals of nodal positions (N, 3) [m] and a basis Phi (N, 3, n) with the scalar mass m (N, N) [kg].

    Equation (5) of docs/notation.md.
    """
    count, _, n = Phi.shape
    of_nodes = m @ np.ones(count)
    momenta = m @ points
    modes = Phi.reshape(count, 3 * n)
    PP = (modes.T @ product(m, modes)).reshape(3, n, 3, n).transpose(0, 2, 1, 3)
    rr = points.T @ momenta
    return InertiaIntegrals(
        mass=float(of_nodes.sum()),
        r_dm=momenta.sum(axis=0),
        rr_dm=(rr + rr.T) / 2,
        P_dm=(of_nodes @ modes).reshape(3, n),
        rP_dm=(momenta.T @ modes).reshape(3, 3, n),
        PP_dm=(PP + PP.transpose(1, 0, 3, 2)) / 2,
    )


# ---- tensors ------------------------------------------------------------------------------------------------------


def skew(v: Array) -> Array:
    """(3, ...) -> (3, 3, ...): the cross product matrix of v."""
    zero = np.zeros_like(v[0])
    return np.stack([np.stack([zero, -v[2], v[1]]), np.stack([v[2], zero, -v[0]]), np.stack([-v[1], v[0], zero])])


def from_inertia(J: Array) -> Array:
    """(3, 3, ...) tensor S with J = tr(S) I - S."""
    return 0.5 * np.einsum("kl,...->kl...", np.eye(3), np.einsum("kk...->...", J)) - J
