"""A linear system of which one output is prescribed: what moves it is no longer given, but what that takes.

From x_dot = A x + B m with the output u = c x, of a coordinate that the effort m accelerates (c B = 0, c A B > 0), follow
u_dot = c A x and u_ddot = c A^2 x + c A B m, and with that m. With x = N xi + W (u, u_dot), N across c and c A,

    xi_dot = A' xi + B0 u + B1 u_dot + B2 u_ddot      outputs = C' xi + D0 u + D1 u_dot + D2 u_ddot

(zero dynamics: Isidori 1995, Nonlinear Control Systems, section 4.3), with the eigenvalues of the system that is held there.
"""

from __future__ import annotations

import numpy as np

from ffr_prep.common.arrays import Array


def prescribed(A: Array, B: Array, C: Array, D: Array, c: Array) -> tuple[Array, Array, Array, Array]:
    """A' (S-2, S-2), [B0 B1 B2] (S-2, 3), C' (O, S-2), [D0 D1 D2] (O, 3) from A (S, S), B (S, 1), C (O, S), D (O, 1)
    and the row c (S,) of the output that is prescribed."""
    rows = np.array([c, c @ A])
    W = np.linalg.pinv(rows)
    N = np.linalg.qr(rows.T, mode="complete")[0][:, 2:]
    share = B / (rows[1] @ B)  # of u_ddot
    bound = A - share @ (rows[1] @ A)[None]
    seen = C - D @ (rows[1] @ A)[None] / (rows[1] @ B)
    inputs = np.hstack([N.T @ bound @ W, N.T @ share])
    return N.T @ bound @ N, inputs, seen @ N, np.hstack([seen @ W, D / (rows[1] @ B)])
