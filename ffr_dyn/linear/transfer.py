"""Transfer functions of a linear system, part by part of its modes, and its response to noise.

    H(i w) = C (i w - A)^-1 B + D = D + sum_k (C r_k) (l_k B) / (l_k r_k (i w - lambda_k))

for right and left eigenvectors r_k, l_k of A; where derivatives of the input act too, B and D are polynomials in i w.
A stationary noise with the one-sided density S(f) at the input has the density |H|^2 S at an output, and its root mean
square is the root of the integral over f. (Preumont 1994, Random Vibration, ch. 5.)

Poles that eigenvalues without rounding tell to lie on i w, of undamped vibrations and at zero, are no matter of solving an
equation that is singular but for rounding: from values on a circle around it follow whether an output has the pole
(its Laurent series), and if not, its value there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from ffr_prep.common.arrays import Array

POINTS, AROUND = 400, 41  # frequencies of a band, and those around each resonance
GAUSS, BELOW = 3, 1e-5  # points between frequencies of an integral; the first one after zero, of the last
FREE = 1e-6  # of the largest eigenvalue: what is below may be a free motion by rounding, and no part
SAME = 0.01  # of an eigenvalue, by which rounding may change it
BESIDE = 1e-3  # of an undamped frequency, as wide as its resonance is taken
# An integral is divided at growing distances from a resonance: from so many of its widths, where those of `band` end, to a
# share of its frequency.
NEAR, GROWING, FAR = 12.0, 1.5, 0.25
ON = 1e-9  # of a pole: how near to i w it is on it
CIRCLE = 32  # points around a pole
HIGHEST = 4  # order of a pole: two of a free motion, two of a motion that is prescribed
PRINCIPAL = 1e-7  # of the values around a pole: its principal part, if it is no rounding
ROUNDING = 1e-12  # of the largest state: an output that is no more sees nothing of it


@dataclass(frozen=True)
class Transfer:
    """frequencies (F,) [Hz];  H (F, O) of O outputs to one input;  parts (F, O, K) of it by the modes numbered `modes` (K,),
    of each pair the eigenvalue (K,) [1/s] with the positive frequency in `values`, of what only decays each."""

    frequencies: Array
    H: Array
    parts: Array
    modes: Array
    values: Array


def transfer(
    A: Array, B: Array, C: Array, D: Array, frequencies: Array, count: int, order: int = 0, known: Array | None = None
) -> Transfer:
    """From an input to the outputs of C (O, S); with the parts of the `count` modes that do most.

    B (S, P), D (O, P) : shares of the input and of its first P - 1 derivatives
    order              : which derivative of that the input is
    known              : (m,) [1/s] eigenvalues of A without rounding
    """
    s, known = 2j * np.pi * frequencies, np.zeros(0) if known is None else known
    H, powers = receptances(A, B, C, D, frequencies, order, known), _powers(s, B, order)
    values, left, right = eig(A, left=True, right=True)
    scale = np.einsum("sk,sk->k", left.conj(), right)
    chosen = np.flatnonzero((values.imag >= 0) & _no_rounding(values, known) & (np.abs(scale) > 1e-12))
    seen, fed = C @ right[:, chosen] / scale[chosen], left[:, chosen].conj().T @ B
    one, twin = (_inverse(s[:, None, None] - of) for of in (values[chosen], values[chosen].conj()))
    paired = values[chosen].imag > 0
    parts = seen * (powers @ fed.T)[:, None] * one + paired * seen.conj() * (powers @ fed.conj().T)[:, None] * twin
    bounded = np.abs(H[np.isfinite(H)]).max(initial=0.0)
    size = np.abs(parts).max(axis=(0, 1), initial=0.0) / max(bounded, 1e-300)
    most = np.sort(np.argsort(-size, kind="stable")[:count])
    most = most[np.argsort(np.abs(values[chosen][most]), kind="stable")]
    return Transfer(frequencies, H, parts[:, :, most], chosen[most], values[chosen][most])


def _inverse(distances: Array) -> Array:
    """1 / distances; large where there is none."""
    found: Array = 1 / np.where(distances, distances, np.finfo(float).tiny ** 0.25)
    return found


def _no_rounding(values: Array, known: Array) -> Array:
    """(S,) whether an eigenvalue is no zero by rounding: it is large enough, or near one that is known not to be zero."""
    near = np.abs(values[:, None] - known[np.abs(known) > 0]) <= SAME * np.abs(values)[:, None]
    found: Array = (np.abs(values) > FREE * np.abs(values).max(initial=0.0)) | near.any(axis=1)
    return found


def receptances(
    A: Array,
    B: Array,
    C: Array,
    D: Array,
    frequencies: Array,
    order: int = 0,
    known: Array | None = None,
    outputs: int | None = None,
) -> Array:
    """(F, O) complex, the transfer function alone; of the input as in `transfer`. Infinite at a pole.

    outputs : of how many outputs the rows of C are, in turn: what is rounding is told by all of one; each its own if None
    """
    H = _answers(A, B, C, D, 2j * np.pi * frequencies, order)
    known = np.zeros(0) if known is None else known
    for k, s in enumerate(2j * np.pi * frequencies):
        if (np.abs(s - known) <= ON * np.abs(s)).any():
            H[k] = _around(A, B, C, D, s, order, known, outputs)
    return H


def _answers(A: Array, B: Array, C: Array, D: Array, s: Array, order: int) -> Array:
    return (_states(A, B, s, order) @ C.T + _powers(s, B, order) @ D.T).astype(complex)


def _states(A: Array, B: Array, s: Array, order: int) -> Array:
    """(F, S) under the input."""
    one, powers = np.eye(len(A)), _powers(s, B, order)
    x = np.array([_answer(at * one - A, B @ u) for at, u in zip(s, powers, strict=True)])
    return x.reshape(s.size, len(A))


def has_pole(A: Array, B: Array, C: Array, D: Array, pole: complex, order: int, known: Array, outputs: int) -> Array:
    """(O,) whether rows of C answer without bound at an eigenvalue; `outputs` as of `receptances`."""
    found: Array = ~np.isfinite(_around(A, B, C, D, pole, order, known, outputs))
    return found


def _around(
    A: Array, B: Array, C: Array, D: Array, pole: complex, order: int, known: Array, outputs: int | None = None
) -> Array:
    """(O,) the transfer functions at an eigenvalue, by their means around it; infinite where they have a pole there."""
    values = np.linalg.eigvals(A)
    far = values[np.abs(values - pole) > FREE * np.abs(values).max(initial=0.0)]
    others = np.concatenate([far, known[np.abs(known - pole) > ON * abs(pole)]])
    beside = np.abs(others - pole).min(initial=abs(pole) or np.inf)  # a motion that is prescribed has a pole at zero
    radius = 0.5 * (beside if beside < np.inf else 1.0)
    turn = np.exp(2j * np.pi * (np.arange(CIRCLE) + 0.5) / CIRCLE)
    s = pole + radius * turn
    x = _states(A, B, s, order)
    H = x @ C.T + _powers(s, B, order) @ D.T
    principal = np.abs(np.array([turn**k @ H for k in range(1, HIGHEST + 1)])).max(axis=0) / CIRCLE
    count = H.shape[1] if outputs is None else outputs
    alike = H.shape[1] // max(count, 1)
    size = PRINCIPAL * np.abs(H).reshape(-1, count).max(axis=0)
    of_states = (
        ROUNDING * np.abs(C).reshape(alike, count, len(A)).max(axis=(0, 2), initial=0.0) * np.abs(x).max(initial=0.0)
    )
    found: Array = np.where(principal > np.tile(np.maximum(size, of_states), alike), np.inf, H.mean(axis=0))
    return found


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


def mean_square(
    A: Array, B: Array, C: Array, D: Array, psd: Array, order: int = 0, known: Array | None = None
) -> Array:
    """(O,) of the outputs under a noise, (K, 2) rising frequencies [Hz] and one-sided densities, linear in between: by
    Gauss's formula between its frequencies, those of `band`, others beside resonances, and zero. Eigenvalues that are known
    without rounding leave out those of free motions, at which there is nothing to be seen but rounding."""
    f, density = psd.T
    values = np.linalg.eigvals(A) if known is None else known
    ends = np.unique(np.concatenate([f, band(values, f[0] or BELOW * f[-1], f[-1]), _beside(values, f[0], f[-1])]))
    half, middle = 0.5 * np.diff(ends), 0.5 * (ends[1:] + ends[:-1])
    at, weight = np.polynomial.legendre.leggauss(GAUSS)
    points = (middle[:, None] + half[:, None] * at).ravel()
    H = receptances(A, B, C, D, points, order)
    found: Array = (half[:, None] * weight).ravel() * np.interp(points, f, density) @ np.abs(H) ** 2
    return found


def _beside(values: Array, low: float, high: float) -> Array:
    """Frequencies [Hz] from low to high at growing distances from resonances, out to where those of `band` are as close."""
    points = [np.zeros(0)]
    for value in values[(values.imag > 0) & (values.real != 0)]:
        first, last = NEAR * abs(value.real), FAR * abs(value.imag)
        distances = first * GROWING ** np.arange(max(0.0, np.log(last / first) / np.log(GROWING)))
        points += [(value.imag + sign * distances) / (2 * np.pi) for sign in (-1, 1)]
    found = np.concatenate(points)
    return found[(found > low) & (found < high)]
