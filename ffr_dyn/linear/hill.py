"""Modes of a machine whose matrices vary with its angle, as those of a rotor in bearings that are not the same all around.

With K = sum_k K_k exp(i k w t), k = -H ... H, and C alike, in axes that turn at w, a mode is

    y = exp(lambda t) sum_k y_k exp(i k w t)
    (lambda + i k w)^2 y_k + sum_j [C_(k-j) (lambda + i j w) + K_(k-j)] y_j = 0

of which as many k are taken as leave no more open than RESIDUAL (Hill's determinant). Of a rotor that is the same all around
two suffice for each mode, the forward and the backward part of one ellipse as seen from the ground, and the modes are
exact. lambda + i j w with y_(k+j) is the same mode; told is the one whose largest part is y_0.
(Genta 2005, Dynamics of Rotating Systems, ch. 6; Xu & Gasch, Archive of Applied Mechanics 65 (1995) 178-193.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from math import gcd

import numpy as np

from ffr_prep.common.arrays import Array

PRESENT = 1e-7  # of a harmonic, relative to the means of both coordinates: no rounding
RESIDUAL = 1e-8  # of the equations beyond the last harmonic, relative
HARMONICS = (*range(1, 9), 12, 16, 24, 32, 48)  # on either side
ANYHOW, LARGEST = 8, 800  # harmonics of any machine; rows of a determinant with more
STILL = 1e-10  # of a frequency relative to the largest: of what stands still in the turning axes, by rounding
SAME, ALIKE = 1e-6, 0.5  # of eigenvalues and shapes of one mode that is found twice


@dataclass(frozen=True)
class Varying:
    """K, C (H + 1, d, d), complex, for k = 0 ... H, in mass-orthonormal coordinates that turn at rate [rad/s]."""

    K: Array
    C: Array
    rate: float

    @property
    def step(self) -> int:
        """Of the harmonics that there are; 0 where nothing varies."""
        own = np.sqrt(np.abs(np.einsum("ii->i", self.K[0].real)) + self.rate**2)
        sizes = [np.abs(self.K) / np.outer(own, own), np.abs(self.C) / np.sqrt(np.outer(own, own))]
        there = [k for one in sizes for k in range(1, len(one)) if one[k].max(initial=0.0) > PRESENT]
        return reduce(gcd, there, 0)


@dataclass(frozen=True)
class Hill:
    """values (2 d,) [1/s] and parts (2 h + 1, d, 2 d) of the modes, at the harmonics step (-h ... h) of the rate, and what is
    left of the equations beyond the last, relative."""

    values: Array
    parts: Array
    step: int
    left: float


def harmonics(over_a_turn: Array) -> Array:
    """(H + 1, ...) Fourier coefficients of a quantity at P angles of a turn (P, ...), H < P / 2."""
    found: Array = np.fft.rfft(over_a_turn, axis=0)[: (len(over_a_turn) + 1) // 2] / len(over_a_turn)
    return found


def hill(of: Varying) -> Hill:
    """All modes, two for each coordinate. What turns slowly beside its vibrations takes many harmonics; numbers of them that
    will not do, by what the first ones leave open, are passed over."""
    step, count = of.step, 2 * of.K.shape[1]
    offers = [h for h in HARMONICS if h <= ANYHOW or (2 * h + 1) * count <= LARGEST]
    known = list[tuple[int, float]]()
    for h in offers:
        if h < min(_enough(known), offers[-1]):
            continue
        values, parts = _distinct(*_solved(of, step, h), step * of.rate, count)
        known.append((h, _left_open(of, step, values, parts)))
        if known[-1][1] <= RESIDUAL:
            break
    return Hill(*_centred(values, parts, step * of.rate), step, known[-1][1])


def _enough(known: Sequence[tuple[int, float]]) -> float:
    """How many harmonics will do, by how much of the equations the last two of `known` leave open: each more leaves the same
    part of it."""
    if len(known) < 2 or not 0 < known[-1][1] < known[-2][1]:
        return 0.0
    (before, more), (now, less) = known[-2:]
    return now + float(np.log(RESIDUAL / less) / (np.log(less / more) / (now - before)))


def _coefficient(of: Array, k: int) -> Array:
    found: Array = np.zeros_like(of[0]) if abs(k) >= len(of) else of[k] if k >= 0 else of[-k].conj()
    return found


def _solved(of: Varying, step: int, h: int) -> tuple[Array, Array]:
    """All eigenvalues (2 d (2 h + 1),) and parts (2 h + 1, d, ...) of the determinant of this size.

    K(t) and C(t) are real, and so is the determinant in cosines and sines: a third of the work in complex numbers.
    """
    d, numbers = of.K.shape[1], range(-h, h + 1)
    waves = _cosines_and_sines(h)
    C, K = (
        _in_waves(waves, np.array([[_coefficient(one, step * (k - j)) for j in numbers] for k in numbers]))
        for one in (of.C, of.K)
    )
    turning = _in_waves(waves, np.einsum("kj,ab->kjab", np.diag([1j * step * k * of.rate for k in numbers]), np.eye(d)))
    values, vectors = np.linalg.eig(np.block([[-turning, np.eye(len(K))], [-K, -C - turning]]))
    parts = vectors[: len(K)].reshape(2 * h + 1, -1)
    return values, (waves.conj().T @ parts).reshape(2 * h + 1, d, -1)


def _cosines_and_sines(h: int) -> Array:
    """(2 h + 1, 2 h + 1) unitary, what takes the parts at exp(i k w t), k = -h ... h, to those of sines, 1 and cosines."""
    one = np.eye(h)
    middle = np.zeros((1, 2 * h + 1))
    middle[0, h] = 1.0
    back, none = one[:, ::-1], np.zeros((h, 1))
    cosines, sines = (np.hstack([sign * back, none, one]) * np.sqrt(0.5) for sign in (1.0, -1.0))
    found: Array = np.vstack([1j * sines[::-1], middle, cosines])
    return found


def _in_waves(waves: Array, blocks: Array) -> Array:
    """(h d, h d), real, of blocks (h, h, d, d) between parts."""
    found = np.einsum("ka,abij,lb->kilj", waves, blocks, waves.conj(), optimize=True)
    side = len(waves) * blocks.shape[-1]
    real: Array = found.real.reshape(side, side)
    return real


def _distinct(values: Array, parts: Array, shift: float, count: int) -> tuple[Array, Array]:
    """`count` modes, each once, by the harmonics in whose middle it lies."""
    h = len(parts) // 2
    sizes = (np.abs(parts) ** 2).sum(axis=1)
    parts = parts / np.sqrt(np.maximum(sizes.sum(axis=0), 1e-300))
    middle = np.arange(-h, h + 1) @ sizes / np.maximum(sizes.sum(axis=0), 1e-300)
    kept, near = list[int](), SAME * max(float(np.abs(values).max()), shift)
    for m in np.argsort(np.abs(middle), kind="stable"):
        if len(kept) == count:
            break
        apart = (values[m] - values[kept]) / (1j * shift) if kept else np.zeros(0)
        turns = np.round(apart.real).astype(int)
        close = np.flatnonzero((turns != 0) & (np.abs(apart - turns) * shift <= near))
        if not any(_overlap(parts[..., kept[k]], parts[..., m], int(turns[k])) > ALIKE for k in close):
            kept.append(int(m))
    return values[kept], parts[..., kept]


def _overlap(a: Array, b: Array, turns: int) -> float:
    """Of the parts of two modes (2 h + 1, d), one of which is numbered by `turns` more."""
    return float(abs(np.vdot(moved_on(a[..., None], turns)[..., 0], b)))


def moved_on(parts: Array, turns: int) -> Array:
    """(2 h + 1, d, m) the parts of the same modes for lambda + i turns step w: y_(k + turns) in the place of y_k."""
    found = np.zeros_like(parts)
    if abs(turns) < len(parts):
        found[max(0, -turns) : len(parts) - max(0, turns)] = parts[max(0, turns) : len(parts) - max(0, -turns)]
    return found


def _left_open(of: Varying, step: int, values: Array, parts: Array) -> float:
    """The largest part of the equations beyond the harmonics of modes, relative to their inertia."""
    h, reach = len(parts) // 2, (len(of.K) - 1) // step
    rates = values + 1j * step * of.rate * np.arange(-h, h + 1)[:, None]
    largest = 0.0
    for k in (*range(-h - reach, -h), *range(h + 1, h + reach + 1)):
        left = sum(
            _coefficient(of.C, step * (k - j)) @ (parts[j + h] * rates[j + h])
            + _coefficient(of.K, step * (k - j)) @ parts[j + h]
            for j in range(-h, h + 1)
        )
        size = np.maximum(np.abs(rates).max(axis=0), of.rate) ** 2
        largest = max(largest, float((np.linalg.norm(left, axis=0) / size).max(initial=0.0)))
    return largest


def _centred(values: Array, parts: Array, shift: float) -> tuple[Array, Array]:
    """The same modes, the largest part of each in the middle of twice as many harmonics; of several the slowest."""
    h = len(parts) // 2
    wide, sizes = np.pad(parts, ((h, h), (0, 0), (0, 0))), (np.abs(parts) ** 2).sum(axis=1)
    near, found, moved = SAME * max(float(np.abs(values).max()), shift), [], []
    for m, value in enumerate(values):
        large = np.flatnonzero(sizes[:, m] >= sizes[:, m].max() - SAME) - h
        rates = value.imag + shift * large
        turns = int(large[np.lexsort((rates < 0, np.round(np.abs(rates) / near)))[0]])
        rate = value.imag + shift * turns
        found.append(complex(value.real, rate if abs(rate) > STILL * near / SAME else 0.0))
        moved.append(moved_on(wide[..., [m]], turns))
    return np.array(found), np.concatenate(moved, axis=2)


def one_of_each(values: Array, shift: float) -> Array:
    """Numbers of one eigenvalue (m,) of each pair: of conjugates that with the positive frequency; of those that are
    their own conjugates, but for multiples of the shift, the larger half of those at each place."""
    near = SAME * max(float(np.abs(values).max(initial=0.0)), shift) if shift else 0.0
    turns = np.round(2 * values.imag / (shift or 1.0))
    alone = np.abs(2 * values.imag - shift * turns) <= near
    places = _places(np.abs(turns) if shift else 0 * turns, alone)
    halves = [_larger_half(values, np.flatnonzero(places == one)) for one in np.unique(places[alone])]
    return np.concatenate([np.flatnonzero((values.imag > 0) & ~alone), *halves])


def _places(turns: Array, alone: Array) -> Array:
    """(m,) where eigenvalues are that seem to be their own conjugates; nan of others. A pair of conjugates that is a multiple
    of the shift apart is at half of it, both at one place; what is alone there has its other half at another numbering."""
    places = np.where(alone, turns, np.nan)
    odd = [one for one in np.unique(turns[alone]) if (places == one).sum() % 2]
    found: Array = np.where(np.isin(places, odd), -1.0 - places % 2, places)
    return found


def _larger_half(values: Array, numbers: Array) -> Array:
    found: Array = numbers[np.lexsort((values[numbers].imag, values[numbers].real))][len(numbers) // 2 :]
    return found
