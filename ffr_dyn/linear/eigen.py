"""Eigenvalues of M y_ddot + C y_dot + K y = 0 in mass-orthonormal coordinates, with those that are zero told exactly.

A motion that nothing holds, such as a free spin, has the eigenvalue zero twice, with one vector: rounding makes of
such a pair a slow growth and a slow decay. So null spaces are divided out one after the other (a staircase) before
the rest is solved. (Golub & Van Loan 2013, section 7.6.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array

NULL = 1e-13  # of a stiffness relative to the largest: rounding


@dataclass(frozen=True)
class Eigen:
    """values (2d,) [1/s], by rising modulus;  vectors (d, 2d) of y;  free : how many are zero, which come first."""

    values: Array
    vectors: Array
    free: int


def eigen(K: Array, C: Array) -> Eigen:
    """Of stiffness K and damping C (d, d), gyroscopic terms included."""
    d = len(K)
    stiffness, U = np.linalg.eigh(0.5 * (K + K.T))
    largest = max(np.sqrt(np.abs(stiffness).max(initial=0.0)), np.abs(C).max(initial=0.0)) or 1.0
    circulating, C = U.T @ (0.5 * (K - K.T)) @ U, U.T @ C @ U
    K = np.diag(np.where(np.abs(stiffness) > NULL * largest**2, stiffness, 0.0))
    K += np.where(np.abs(circulating) > NULL * largest**2, circulating, 0.0)
    scale = np.maximum(np.sqrt(np.abs(stiffness)), largest * np.sqrt(NULL))  # y times its own frequency
    A = np.zeros((2 * d, 2 * d))
    A[:d, d:], A[d:, :d], A[d:, d:] = np.diag(scale), -K / scale, -C
    rest, stages = _without_null_space(A, NULL * largest)
    values, vectors = np.linalg.eig(rest)
    for Q, across in reversed(stages):
        vectors = Q @ np.concatenate([across @ vectors / np.where(values, values, 1.0), vectors])
    free = 2 * d - values.size
    order = np.lexsort((np.sign(values.imag), np.round(np.abs(values), 9)))
    still = _null_vectors(K, NULL * largest**2, free)
    shapes = np.concatenate([still, (vectors[:d, order].T / scale).T], axis=1)
    return Eigen(np.concatenate([np.zeros(free), values[order]]), U @ shapes, free)


def _without_null_space(A: Array, tolerance: float) -> tuple[Array, list[tuple[Array, Array]]]:
    """The rest of A when its zero eigenvalues are divided out, and the steps to vectors of all of it."""
    stages = []
    while len(A):
        _, sizes, W = np.linalg.svd(A)
        null = int((sizes <= tolerance).sum())
        if not null:
            break
        Q = np.concatenate([W[len(A) - null :], W[: len(A) - null]]).T
        A = Q.T @ A @ Q
        stages.append((Q, A[:null, null:]))
        A = A[null:, null:]
    return A, stages


def _null_vectors(K: Array, tolerance: float, count: int) -> Array:
    """(d, count) vectors that K takes to zero, each as often as it is needed."""
    if not count:
        return np.zeros((len(K), 0))
    _, sizes, W = np.linalg.svd(K)
    null = W[sizes <= max(tolerance, sizes.min())]
    return null[np.arange(count) % len(null)].T
