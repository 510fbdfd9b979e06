"""A linear machine in axes that turn, with inputs and outputs in axes that do not.

With A, B, C, D = sum_k (A_k, B_k, C_k, D_k) exp(i k w t), the answer to an input u is x = sum_n x_n exp(i n w t) with

    x_n_dot + i n w x_n = sum_j A_(n-j) x_j + B_n u,        y = sum_n C_(-n) x_n + D_0 u + what has sidebands u +- k w:

again a linear system, of the envelopes x_n, whose real and imaginary parts are its states. (Wereley 1990, Analysis and
Control of Linear Periodically Time Varying Systems, ch. 3: harmonic transfer functions.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_prep.common.arrays import Array

PRESENT = 1e-7  # of a harmonic relative to the largest of its kind: no rounding
SETTLED, MOST = 1e-8, 2000  # of answers that more harmonics do not change, relative; states, from where none are added


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
    makes the sidebands of its outputs, real and imaginary parts of C_(k-n) and D_k for k = 1 ... in turn. `left` is how much
    more harmonics than these change the answers, relative."""

    A: Array
    B: Array
    C: Array
    D: Array
    numbers: tuple[int, ...]
    rate: float
    beside: tuple[Array, Array]
    left: float = 0.0


def turned(of: OverTurn) -> Turned:
    """Of all harmonics that the input reaches. Where A varies they are as many as change what is answered: a rotor that is
    not round in supports that are not alike has all of them."""
    furthest = len(of.A) - 1
    found = _up_to(of, furthest)
    spread = [k for k in range(1, len(of.A)) if of.A[k].any()]
    if not spread:
        return found
    found = replace(found, left=np.inf)
    while found.left > SETTLED and (len(found.A) <= MOST or found.left == np.inf):
        furthest += max(spread)
        more = _up_to(of, furthest)
        left = _changed(found, more)
        found = replace(found if left <= SETTLED else more, left=left)
    return found


def _up_to(of: OverTurn, furthest: int) -> Turned:
    numbers, S = _reached(of, furthest), of.A.shape[1]
    A = np.block([[_part(of.A, n - j) for j in numbers] for n in numbers]).astype(complex)
    A -= np.diag(np.repeat([1j * n * of.rate for n in numbers], S))
    B = np.concatenate([_part(of.B, n) for n in numbers])
    to_real = _real_parts(numbers, S)
    back = np.linalg.inv(to_real)
    C = np.concatenate([_part(of.C, -n) for n in numbers], axis=1) @ back
    there = range(1, furthest + 1)
    beside = [np.concatenate([_part(of.C, k - n) for n in numbers], axis=1) @ back for k in there]
    sides = np.concatenate([part for one in beside for part in (one.real, one.imag)])
    through = np.concatenate([part for k in there for part in (_part(of.D, k).real, _part(of.D, k).imag)])
    A, B = (to_real @ A @ back).real, (to_real @ B).real
    return Turned(A, B, C.real, of.D[0].real, tuple(numbers), of.rate, (sides, through))


def _changed(few: Turned, many: Turned) -> float:
    """How much the answers of two systems differ, relative to the largest, near the frequencies of the first."""
    own = np.unique(np.round(np.abs(np.linalg.eigvals(few.A)), 6))
    at = (0.02 + 1j) * own[own > 0][:: max(1, own.size // 16)]
    one, other = (
        np.array([of.C @ np.linalg.solve(s * np.eye(len(of.A)) - of.A, of.B) for s in at]) for of in (few, many)
    )
    sizes = np.abs(other).max(axis=(0, 2), initial=0.0)
    least = 1e-300 + 1e-9 * sizes.max(initial=0.0)
    return float((np.abs(one - other).max(axis=(0, 2), initial=0.0) / np.maximum(sizes, least)).max(initial=0.0))


def _part(of: Array, k: int) -> Array:
    found: Array = np.zeros_like(of[0]) if abs(k) >= len(of) else of[k] if k >= 0 else of[-k].conj()
    return found


def _there(of: Array) -> list[int]:
    """Which harmonics are none of rounding."""
    sizes = np.abs(of).reshape(len(of), -1).max(axis=1, initial=0.0)
    return [k for k in range(len(of)) if sizes[k] > PRESENT * sizes.max()]


def _reached(of: OverTurn, most: int) -> list[int]:
    """Harmonics n of the states, with their negatives, that inputs excite, and what varies spreads to, as far as `most`."""
    found, spread = set(_there(of.B)) or {0}, [k for k in range(1, len(of.A)) if of.A[k].any()]
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
