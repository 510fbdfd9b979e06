"""Eigenvalues of M y_ddot + C y_dot + K y = 0 in mass-orthonormal coordinates, with those that are zero told exactly.

A motion that nothing holds, such as a free spin, has the eigenvalue zero twice, with one vector: rounding makes of
such a pair a slow growth and a slow decay. So null spaces are divided out one after the other (a staircase) before
the rest is solved. (Golub & Van Loan 2013, section 7.6.) What is free has no stiffness: beside the largest, not beside a
damper, which may be as large as it likes. Its second zero, and no other, is found among what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array

NULL = 1e-13  # of a stiffness relative to the largest: rounding
SLOWEST = 1.0  # 1/s: the least that rounding of a stiffness is measured by
FLAT = 1e-10  # of the fastest rate: the least that coordinates are scaled by


@dataclass(frozen=True)
class Eigen:
    """values (2d,) [1/s], by rising modulus;  vectors (d, 2d) of y;  free : how many are zero, which come first."""

    values: Array
    vectors: Array
    free: int


def eigen(K: Array, C: Array, rounding: Array | None = None, loose: Array | None = None) -> Eigen:
    """Of stiffness K and damping C (d, d), gyroscopic terms included.

    rounding : (d,) of the diagonal of K, below which it is none; by default `NULL` of the largest. Where K is nearly diagonal
               with small entries that are right to their own size, these stay so.
    loose    : (d, g) orthonormal motions y that are known to have no stiffness, K y = 0. What K is not symmetric by may be
               more than its rounding, as of a damped rotor with an unbalance: its symmetric part does not show them.
    """
    d = len(K)
    loose = np.zeros((d, 0)) if loose is None else loose
    U = _orthonormal(K, loose)
    held = np.arange(d) >= loose.shape[1]
    K, C = np.where(held, U.T @ K @ U, 0.0), U.T @ C @ U
    stiffness = np.diag(K)
    circulating = np.where(np.outer(held, held), 0.5 * (K - K.T), K)
    turning = 0.5 * np.abs(C - C.T).max(initial=0.0)
    rate = np.sqrt(max(np.abs(stiffness).max(initial=0.0), np.abs(circulating).max(initial=0.0), turning**2, SLOWEST))
    none = np.full(d, NULL * rate**2) if rounding is None else rounding @ U**2
    K = np.diag(np.where(np.abs(stiffness) > none, stiffness, 0.0))
    K += np.where(np.abs(circulating) > np.sqrt(np.outer(none, none)), circulating, 0.0)
    scale = np.sqrt(np.maximum(np.maximum(np.abs(stiffness), none), (FLAT * rate) ** 2))  # y times its own frequency
    still = _null_vectors(K, scale)
    A = np.zeros((2 * d, 2 * d))
    A[:d, d:], A[d:, :d], A[d:, d:] = np.diag(scale), -K / scale, -C
    rest, stages = _without_null_space(A, NULL * max(rate, np.abs(C).max(initial=0.0)), len(still))
    values, vectors = np.linalg.eig(rest)
    for Q, across in reversed(stages):
        vectors = Q @ np.concatenate([across @ vectors / np.where(values, values, 1.0), vectors])
    free = 2 * d - values.size
    order = np.lexsort((np.sign(values.imag), np.round(np.abs(values), 9)))
    shapes = (vectors[:d, order].T / scale).T
    if free:
        shapes = np.concatenate([still[np.arange(free) % len(still)].T, shapes], axis=1)
    return Eigen(np.concatenate([np.zeros(free), values[order]]), U @ shapes, free)


def _orthonormal(K: Array, loose: Array) -> Array:
    """(d, d) motions: the loose ones (d, g), then others along which the symmetric part of K is diagonal."""
    g = loose.shape[1]
    others = np.linalg.qr(loose, mode="complete")[0][:, g:]
    rest = others.T @ K @ others
    return np.concatenate([loose, others @ np.linalg.eigh(0.5 * (rest + rest.T))[1]], axis=1)


def _without_null_space(A: Array, tolerance: float, most: int) -> tuple[Array, list[tuple[Array, Array]]]:
    """The rest of A when its zero eigenvalues, `most` with vectors of their own, are divided out, and the steps to vectors of
    all of it."""
    stages, null = [], most
    while len(A) and null:
        _, sizes, W = np.linalg.svd(A)
        null = min(int((sizes <= tolerance).sum()), null)
        if not null:
            break
        Q = np.concatenate([W[len(A) - null :], W[: len(A) - null]]).T
        A = Q.T @ A @ Q
        stages.append((Q, A[:null, null:]))
        A = A[null:, null:]
    return A, stages


def _null_vectors(K: Array, scale: Array) -> Array:
    """(n, d) vectors that K takes to zero, for coordinates of frequencies scale (d,)."""
    _, sizes, W = np.linalg.svd(K / scale / scale[:, None])
    null = W[sizes <= NULL] / scale
    found: Array = null / np.linalg.norm(null, axis=1, keepdims=True)
    return found
