"""A linear machine in axes that turn, with inputs and outputs in axes that do not.

With A, B, C, D = sum_k (A_k, B_k, C_k, D_k) exp(i k w t), the answer to an input u is x = sum_n x_n exp(i n w t) with

    x_n_dot + i n w x_n = sum_j A_(n-j) x_j + B_n u,        y = sum_n C_(-n) x_n + D_0 u + what has sidebands u +- k w:

again a linear system, of the envelopes x_n, whose real and imaginary parts are its states. (Wereley 1990, Analysis and
Control of Linear Periodically Time Varying Systems, ch. 3: harmonic transfer functions.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array

PRESENT = 1e-7  # of a harmonic relative to the largest of its kind: no rounding


@dataclass(frozen=True)
class OverTurn:
    """A (H + 1, S, S), B (H + 1, S, P), C (H + 1, O, S), D (H + 1, O, P), complex, by harmonics of the rate w [rad/s]; those
    of A are zero where it does not vary."""

    A: Array
    B: Array
    C: Array
    D: Array
    rate: float

    @property
    def varies(self) -> bool:
        return not self.input_turns or any(_there(one)[-1:] > [0] for one in (self.C, self.D))

    @property
    def input_turns(self) -> bool:
        """Whether all but the outputs is the same at every angle."""
        return not self.A[1:].any() and not _there(self.B)[-1:] > [0]


@dataclass(frozen=True)
class Turned:
    """The system of the envelopes: A, B, C, D, real; the numbers of the harmonics in it, and their rate [rad/s]; and what
    makes the sidebands of its outputs, real and imaginary parts of C_(k-n) and D_k for k = 1 ... H in turn."""

    A: Array
    B: Array
    C: Array
    D: Array
    numbers: tuple[int, ...]
    rate: float
    beside: tuple[Array, Array]


def turned(of: OverTurn) -> Turned:
    """Of all harmonics that the input reaches."""
    numbers, S, most = _reached(of), of.A.shape[1], len(of.A) - 1
    A = np.block([[_part(of.A, n - j) for j in numbers] for n in numbers]).astype(complex)
    A -= np.diag(np.repeat([1j * n * of.rate for n in numbers], S))
    B = np.concatenate([_part(of.B, n) for n in numbers])
    to_real = _real_parts(numbers, S)
    back = np.linalg.inv(to_real)
    C = np.concatenate([_part(of.C, -n) for n in numbers], axis=1) @ back
    beside = [np.concatenate([_part(of.C, k - n) for n in numbers], axis=1) @ back for k in range(1, most + 1)]
    sides = np.concatenate([part for one in beside for part in (one.real, one.imag)])
    through = np.concatenate([part for one in of.D[1:] for part in (one.real, one.imag)])
    return Turned(
        (to_real @ A @ back).real, (to_real @ B).real, C.real, of.D[0].real, tuple(numbers), of.rate, (sides, through)
    )


def _part(of: Array, k: int) -> Array:
    found: Array = np.zeros_like(of[0]) if abs(k) >= len(of) else of[k] if k >= 0 else of[-k].conj()
    return found


def _there(of: Array) -> list[int]:
    """Which harmonics are none of rounding."""
    sizes = np.abs(of).reshape(len(of), -1).max(axis=1, initial=0.0)
    return [k for k in range(len(of)) if sizes[k] > PRESENT * sizes.max()]


def _reached(of: OverTurn) -> list[int]:
    """Harmonics n of the states, with their negatives, that inputs excite, and what varies spreads to."""
    most = len(of.A) - 1
    found, spread = set(_there(of.B)) or {0}, [k for k in range(1, most + 1) if of.A[k].any()]
    for _ in range(2 * most):
        found |= {abs(n + sign * k) for n in found for k in spread for sign in (1, -1) if abs(n + sign * k) <= most}
    return sorted({sign * n for n in found for sign in (1, -1)})


def _real_parts(numbers: list[int], S: int) -> Array:
    """T with T (x_-n, ..., x_n) = real and imaginary parts of x_n, n > 0, in the places of x_n and x_-n."""
    T = np.zeros((len(numbers), len(numbers)), complex)
    for row, n in enumerate(numbers):
        own, twin = (1.0, 0.0) if n == 0 else (0.5, 0.5) if n > 0 else (0.5j, -0.5j)
        T[row, numbers.index(-n)], T[row, row] = twin, own
    return np.kron(T, np.eye(S))
