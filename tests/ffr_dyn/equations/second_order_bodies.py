"""Second-order bodies in their mean-axis form, made of mass points whose second-order displacements are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from synthetic import cloud

import ffr_prep as fp
from ffr_prep.body import FlexibleBody

PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def bending_cloud(n: int, *, size: float = 1.0, **more) -> tuple[FlexibleBody, np.ndarray]:
    """A `cloud` (of the arguments `more`) in its mean-axis form, and the N (points, 3, n, n) of u_2 = 1/2 q^T N q.

    N is random, `size` times as large as the modes, without mean translation and rotation. Interfaces are the first three
    points, their rotations of second order are random as well.
    """
    body = without_rounding(fp.with_reference(cloud(n, **more), fp.MeanAxis()))
    mass, x, rng = np.array(body.provenance["masses"]), body.surface.points, np.random.default_rng(n)
    raw = rng.normal(size=(x.size, n, n))
    T = np.hstack([np.tile(np.eye(3), (len(x), 1)), np.cross(np.eye(3)[:, None], x).reshape(3, -1).T])
    weighted = T.T * np.repeat(mass, 3)
    N = (raw + raw.transpose(0, 2, 1)).reshape(x.size, -1)
    N = size * (N - T @ np.linalg.solve(weighted @ T, weighted @ N)).reshape(len(x), 3, n, n)
    X = np.einsum("p,pk,plij->klij", mass, x, N)
    spin = size * rng.normal(size=(3, 3, n, n))
    of_points = np.stack([-N[:3], spin + spin.transpose(0, 1, 3, 2)], axis=1).reshape(18, n, n)
    K = np.concatenate([np.zeros((6, n, n)), _by_products(X), of_points])
    return replace(body, stiffening=K), N


def _by_products(X: np.ndarray) -> np.ndarray:
    """(6, n, n) the matrices of the products of angular velocities, of int u_0 u_2^T dm = 1/2 q^T X q."""
    trace = np.einsum("kkij->ij", X)
    return np.array([X[k, k] - trace if k == l else X[k, l] + X[l, k] for k, l in PRODUCTS])  # noqa: E741


def without_rounding(body: FlexibleBody) -> FlexibleBody:
    """A body under mean-axis conditions with exact zeros where these leave rounding."""
    skew = 0.5 * (body.rP_dm - body.rP_dm.transpose(1, 0, 2))
    assert max(np.abs(body.P_dm).max(), np.abs(skew).max()) < 1e-9 * np.sqrt(body.mass)
    if body.stiffening is None:
        return replace(body, P_dm=np.zeros_like(body.P_dm), rP_dm=body.rP_dm - skew)
    K = body.stiffening.copy()
    assert np.abs(K[:6]).max() < 1e-8 * np.abs(K).max()
    K[:6] = 0.0
    return replace(body, P_dm=np.zeros_like(body.P_dm), rP_dm=body.rP_dm - skew, stiffening=K)
