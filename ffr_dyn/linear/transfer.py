"""Transfer functions of a linear system, part by part of its modes, and its response to noise.

    H(i w) = C (i w - A)^-1 B + D = D + sum_k (C r_k) (l_k B) / (l_k r_k (i w - lambda_k))

for right and left eigenvectors r_k, l_k of A; where derivatives of the input act too, B and D are polynomials in i w.
A stationary noise with the one-sided density S(f) at the input has the density |H|^2 S at an output, and its root mean
square is the root of the integral over f. (Preumont 1994, Random Vibration, ch. 5.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from ffr_prep.common.arrays import Array

POINTS, AROUND = 400, 41  # frequencies of a band, and those around each resonance
GAUSS, BELOW = 3, 1e-5  # points between frequencies of an integral; the first one after zero, of the last
FREE = 1e-6  # of the largest eigenvalue: what is below is a free motion by rounding, no part
BESIDE = 1e-3  # of an undamped frequency, as wide as its resonance is taken


@dataclass(frozen=True)
class Transfer:
    """frequencies (F,) [Hz];  H (F, O) of O outputs to one input;  parts (F, O, K) of it by the modes numbered `modes` (K,),
    of each pair the eigenvalue (K,) [1/s] with the positive frequency in `values`, of what only decays each."""

    frequencies: Array
    H: Array
    parts: Array
    modes: Array
    values: Array


def transfer(A: Array, B: Array, C: Array, D: Array, frequencies: Array, count: int, order: int = 0) -> Transfer:
    """From an input to the outputs of C (O, S); with the parts of the `count` modes that do most.

    B (S, P), D (O, P) : shares of the input and of its first P - 1 derivatives
    order              : which derivative of that the input is
    """
    s = 2j * np.pi * frequencies
    H, powers = receptances(A, B, C, D, frequencies, order), _powers(s, B, order)
    values, left, right = eig(A, left=True, right=True)
    scale = np.einsum("sk,sk->k", left.conj(), right)
    moves = (values.imag >= 0) & (np.abs(values) > FREE * np.abs(values).max(initial=0.0))
    chosen = np.flatnonzero(moves & (np.abs(scale) > 1e-12))
    seen, fed = C @ right[:, chosen] / scale[chosen], left[:, chosen].conj().T @ B
    pole = s[:, None, None] - values[chosen]
    twin = s[:, None, None] - values[chosen].conj()
    paired = values[chosen].imag > 0
    parts = seen * (powers @ fed.T)[:, None] / pole + paired * seen.conj() * (powers @ fed.conj().T)[:, None] / twin
    size = np.abs(parts).max(axis=(0, 1), initial=0.0) / np.maximum(np.abs(H).max(initial=0.0), 1e-300)
    most = np.sort(np.argsort(-size, kind="stable")[:count])
    most = most[np.argsort(np.abs(values[chosen][most]), kind="stable")]
    return Transfer(frequencies, H, parts[:, :, most], chosen[most], values[chosen][most])


def receptances(A: Array, B: Array, C: Array, D: Array, frequencies: Array, order: int = 0) -> Array:
    """(F, O) complex, the transfer function alone; of the input as in `transfer`."""
    s, one = 2j * np.pi * frequencies, np.eye(len(A))
    H = np.array([C @ _answer(at * one - A, B @ u) + D @ u for at, u in zip(s, _powers(s, B, order), strict=True)])
    return H.reshape(s.size, len(C))


def _powers(s: Array, B: Array, order: int) -> Array:
    """(F, P) of the input and its derivatives beside the input."""
    found: Array = s[:, None] ** (np.arange(B.shape[1]) - float(order))
    return found


def _answer(matrix: Array, right: Array) -> Array:
    """The solution; where there are several, of what is free and not excited, the smallest."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        found: Array = np.linalg.lstsq(matrix, right, rcond=None)[0]
        return found


def band(values: Array, low: float | None = None, high: float | None = None) -> Array:
    """(F,) [Hz] evenly spaced by their logarithms from low to high, and close to every eigenvalue (m,) [1/s] in between.

    By default from a tenth of the lowest frequency to three times the sixth, or the highest if there are fewer.
    """
    own = np.sort(np.abs(values[np.abs(values.imag) > 0])) / (2 * np.pi)
    first = low if low is not None else (own[0] / 10 if own.size else 0.1)
    last = high if high is not None else (3 * own[::2][:6][-1] if own.size else 100.0)
    points = [np.geomspace(first, max(last, first * (1 + 1e-9)), POINTS)]
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, AROUND + 2)[1:-1]
    for value in values[values.imag > 0]:
        width = max(abs(value.real), BESIDE * abs(value.imag) if value.real == 0 else 0.0, 1e-9 * abs(value.imag))
        points.append((abs(value.imag) + width * np.tan(angles)) / (2 * np.pi))
    found = np.unique(np.concatenate(points))
    return found[(found >= first) & (found <= last)]


def mean_square(A: Array, B: Array, C: Array, D: Array, psd: Array, order: int = 0) -> Array:
    """(O,) of the outputs under a noise, (K, 2) rising frequencies [Hz] and one-sided densities, linear in between: by
    Gauss's formula between its frequencies, those of `band` and zero."""
    f, density = psd.T
    ends = np.unique(np.concatenate([f, band(np.linalg.eigvals(A), f[0] or BELOW * f[-1], f[-1])]))
    half, middle = 0.5 * np.diff(ends), 0.5 * (ends[1:] + ends[:-1])
    at, weight = np.polynomial.legendre.leggauss(GAUSS)
    points = (middle[:, None] + half[:, None] * at).ravel()
    H = receptances(A, B, C, D, points, order)
    found: Array = (half[:, None] * weight).ravel() * np.interp(points, f, density) @ np.abs(H) ** 2
    return found
