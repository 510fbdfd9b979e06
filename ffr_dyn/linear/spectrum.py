"""Vibrations of a steady motion, and the same vibrations over a list of speeds.

A vibration has the eigenvalue with the positive frequency or its conjugate, one of which turns into the other where the
frequency in turning axes passes through zero. So each is followed by its shape from speed to speed, both conjugates among the
candidates, by the assurance criterion with the mass matrix,

    MAC = |a^H M b|^2 / (a^H M a  b^H M b),

as the assignment of all vibrations at once that loses least. (Allemang, Sound and Vibration 37 (2003) 14-23.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from ffr_dyn.linear.eigen import eigen
from ffr_dyn.linear.matrices import reduced
from ffr_dyn.linear.steady_state import Steady
from ffr_dyn.linear.whirl import ways_of, whirls
from ffr_dyn.linear.words import in_words
from ffr_prep.common.arrays import Array

NEAR = 0.1  # of the assignment: what a frequency that changes by itself costs, beside MAC


@dataclass(frozen=True)
class Spectrum:
    """Vibrations of a steady motion, by rising frequency: eigenvalues (m,) with signed frequencies, shapes (V, m), and

    seen  : (m,) [rad/s] frequencies from the ground, positive of forward whirls
    whirl : (m,) share of the amplitude that whirls so (see `ffr_dyn.linear.whirl`)
    """

    found: Steady
    values: Array
    shapes: Array
    seen: Array
    whirl: Array

    @property
    def names(self) -> tuple[str, ...]:
        ways = ways_of(self.seen, self.whirl)
        rates = np.where([bool(way) for way in ways], np.abs(self.seen), np.abs(self.values))
        system = self.found.machine.system
        return in_words(system.scene, system.layout, self.found.x, self.found.about.M, self.shapes, rates, ways)

    def only(self, numbers: Array) -> Spectrum:
        return replace(
            self,
            values=self.values[numbers],
            shapes=self.shapes[:, numbers],
            seen=self.seen[numbers],
            whirl=self.whirl[numbers],
        )


def spectrum(found: Steady) -> Spectrum:
    """One eigenvalue of each pair; of two real ones the larger. Free motions have none."""
    of = reduced(found)
    solved = eigen(of.K, of.C)
    values, modes = solved.values[solved.free :], found.Z @ solved.vectors[:, solved.free :]
    real = np.flatnonzero(values.imag == 0)
    real = real[np.argsort(values[real].real)][len(real) // 2 :]
    numbers = np.concatenate([np.flatnonzero(values.imag > 0), real])
    numbers = numbers[np.argsort(np.abs(values[numbers]), kind="stable")]
    values, modes = values[numbers], modes[:, numbers]
    modes = modes / np.sqrt(np.einsum("vm,vw,wm->m", modes.conj(), found.about.M, modes).real)
    machine = found.machine
    seen, whirl = whirls(machine.system.scene, machine.place, machine.screws, found.x, values, modes)
    return Spectrum(found, values, modes, seen, whirl)


def _with_still_ones(now: Spectrum, count: int) -> Spectrum:
    """With vibrations that stand still in the turning axes at just this speed, as at a critical one, so that there
    are `count`."""
    missing = count - now.values.size
    if missing <= 0:
        return now
    shapes = np.concatenate([now.shapes, np.zeros((len(now.shapes), missing))], axis=1)
    seen = np.append(now.seen, np.full(missing, now.found.machine.screws.fastest))
    return replace(
        now,
        values=np.append(now.values, np.zeros(missing)),
        shapes=shapes,
        seen=seen,
        whirl=np.append(now.whirl, np.full(missing, np.nan)),
    )


def followed(before: Spectrum, now: Spectrum) -> Spectrum:
    """The vibrations at another speed in the order of those before, each by the conjugate that goes on from it."""
    now, M = _with_still_ones(now, before.values.size), now.found.about.M
    same = np.abs(before.shapes.conj().T @ M @ now.shapes) ** 2
    turned = np.abs(before.shapes.conj().T @ M @ now.shapes.conj()) ** 2
    size = np.abs(before.values)[:, None] + np.abs(now.values)[None]
    costs = [
        -mac + NEAR * np.abs(before.values.imag[:, None] - sign * now.values.imag) / np.maximum(size, 1e-300)
        for mac, sign in ((same, 1.0), (turned, -1.0))
    ]
    rows, columns = linear_sum_assignment(np.minimum(*costs))
    columns = columns[np.argsort(rows)]
    found, turn = now.only(columns), (costs[1] < costs[0])[np.sort(rows), columns]
    turn &= found.values.imag != 0
    values = np.where(turn, found.values.conj(), found.values)
    shapes = np.where(turn, found.shapes.conj(), found.shapes)
    return replace(found, values=values, shapes=np.where(shapes.any(axis=0), shapes, before.shapes))
