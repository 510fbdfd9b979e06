"""Vibrations of a steady motion, and the same vibrations over a list of speeds.

A vibration has the eigenvalue with the positive frequency or its conjugate, one of which turns into the other where the
frequency in turning axes passes through zero. So each is followed by its shape from speed to speed, both conjugates among the
candidates, by the assurance criterion with the mass matrix,

    MAC = |a^H M b|^2 / (a^H M a  b^H M b),

as the assignment of all vibrations at once that loses least; of one with several harmonics over all of them, in whichever
numbering. (Allemang, Sound and Vibration 37 (2003) 14-23.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from ffr_dyn.linear.hill import moved_on, one_of_each
from ffr_dyn.linear.matrices import modes_of
from ffr_dyn.linear.prestrained import Prestrained, prestrained
from ffr_dyn.linear.steady_state import Steady
from ffr_dyn.linear.whirl import ONE_WAY, ways_of, whirls
from ffr_dyn.linear.words import in_words
from ffr_prep.common.arrays import Array

NEAR = 0.1  # of the assignment: what a frequency that changes by itself costs, beside MAC


@dataclass(frozen=True)
class Spectrum:
    """Vibrations of a steady motion, by rising frequency: eigenvalues (m,) with signed frequencies, parts (2 h + 1, V, m) of
    their shapes (see `ffr_dyn.linear.matrices.Modes`), and

    shift : [rad/s] from part to part
    seen  : (m,) [rad/s] frequencies from the ground, positive of forward whirls
    whirl : (m,) share of the amplitude that whirls so (see `ffr_dyn.linear.whirl`)
    body  : (m,) number of the body that moves most
    notes : on the modes, and on the steady motion
    """

    found: Steady
    values: Array
    parts: Array
    shift: float
    seen: Array
    whirl: Array
    body: Array
    notes: tuple[str, ...]

    @property
    def speed(self) -> Array:
        """(m,) [rad/s] of the body that moves most."""
        found: Array = np.linalg.norm(self.found.machine.screws.w, axis=1)[self.body]
        return found

    @property
    def names(self) -> tuple[str, ...]:
        ways = ways_of(self.seen, self.whirl)
        rates = np.hypot(self.values.real, np.where([bool(way) for way in ways], self.seen, self.values.imag))
        system, shapes = self.found.machine.system, main_parts(self.parts)
        return in_words(system.scene, system.layout, self.found.x, self.found.about.M, shapes, rates, ways)

    @property
    def prestrained(self) -> Prestrained:
        machine = self.found.machine
        return prestrained(machine.system.scene, machine.place, self.found.x, self.values, main_parts(self.parts))

    def only(self, numbers: Array) -> Spectrum:
        return replace(
            self,
            values=self.values[numbers],
            parts=self.parts[..., numbers],
            seen=self.seen[numbers],
            whirl=self.whirl[numbers],
            body=self.body[numbers],
        )


def main_parts(parts: Array) -> Array:
    """(V, m) the largest part of each of m modes, of parts (h, V, m)."""
    top = np.argmax((np.abs(parts) ** 2).sum(axis=1), axis=0)
    found: Array = parts[top, :, np.arange(len(top))].T
    return found


def spectrum(found: Steady) -> Spectrum:
    """One eigenvalue of each pair; of two real ones the larger. Free motions have none."""
    of = modes_of(found)
    values, parts = of.values[of.free :], found.Z @ of.parts[..., of.free :]
    numbers = one_of_each(values, of.shift)
    numbers = numbers[np.argsort(np.abs(values[numbers]), kind="stable")]
    values, parts = values[numbers], parts[..., numbers]
    parts = parts / np.sqrt(np.einsum("hvm,vw,hwm->m", parts.conj(), found.about.M, parts, optimize=True).real)
    machine = found.machine
    rates = rates_of(values, len(parts), of.shift)
    seen, whirl, body = whirls(machine.system.scene, machine.place, machine.screws, found.x, rates, parts)
    return Spectrum(found, values, parts, of.shift, seen, whirl, body, (*found.notes, *of.notes))


def rates_of(values: Array, count: int, shift: float) -> Array:
    """(count, m) [rad/s] of the parts of modes."""
    found: Array = values.imag + shift * (np.arange(count) - count // 2)[:, None]
    return found


def _with_still_ones(now: Spectrum, count: int) -> Spectrum:
    """With vibrations that stand still in the turning axes at just this speed, as at a critical one, so that there
    are `count`."""
    missing = count - now.values.size
    if missing <= 0:
        return now
    none = np.zeros(missing)
    return replace(
        now,
        values=np.append(now.values, none),
        parts=np.concatenate([now.parts, np.zeros((*now.parts.shape[:2], missing))], axis=2),
        seen=np.append(now.seen, none),
        whirl=np.append(now.whirl, none * np.nan),
        body=np.append(now.body, none.astype(int)),
    )


def followed(before: Spectrum, now: Spectrum) -> Spectrum:
    """The vibrations at another speed in the order of those before, each by the conjugate, and the numbering of its parts,
    that goes on from it. A whirl that stands still in the turning axes is seen as fast as its body turns."""
    now = _with_still_ones(now, before.values.size)
    candidates = [(turn, by) for by in ((0, -1, 1) if now.shift else (0,)) for turn in (False, True)]
    costs = np.array([_costs(before, _turned(now, *one)) for one in candidates])
    rows, columns = linear_sum_assignment(costs.min(axis=0))
    columns = columns[np.argsort(rows)]
    chosen = np.argmin(costs[:, np.sort(rows), columns], axis=0)
    chosen = np.where(now.values[columns].imag == 0, 0, chosen) if not now.shift else chosen
    variants = [_turned(now, *one).only(columns) for one in candidates]
    values = np.choose(chosen, [one.values for one in variants])
    parts = np.choose(chosen, [one.parts for one in variants])
    lost = ~parts.any(axis=(0, 1))
    if lost.any() and parts.shape == before.parts.shape:
        parts = np.where(lost, before.parts, parts)
    found = replace(now.only(columns), values=values, parts=parts)
    found = replace(found, body=np.where(lost, before.body, found.body))
    still = (values.imag == 0) & (before.whirl > ONE_WAY)
    seen, whirl = np.where(still, found.speed, found.seen), np.where(still, before.whirl, found.whirl)
    return replace(found, seen=seen, whirl=whirl)


def _turned(of: Spectrum, conjugate: bool, by: int) -> Spectrum:
    """The same vibrations by their conjugates, and with another part in the middle."""
    values, parts = (of.values.conj(), of.parts[::-1].conj()) if conjugate else (of.values, of.parts)
    return replace(of, values=values + 1j * by * of.shift, parts=moved_on(parts, by) if by else parts)


def _costs(before: Spectrum, now: Spectrum) -> Array:
    """(m, m) of going on from each vibration to each other."""
    M = now.found.about.M
    if len(before.parts) != len(now.parts) and not (before.shift and now.shift):
        still, turning = (before, now) if now.shift else (now, before)
        together = turning.parts.sum(axis=0)  # where axes of bodies and ground are one, what is seen at that moment
        mac = np.abs(still.parts[0].conj().T @ M @ together) ** 2
        rates = [np.abs(one.seen) if one.shift else np.abs(one.values.imag) for one in (still, turning)]
        mac = mac if turning is now else mac.T
        rates = rates if turning is now else rates[::-1]
        return _cost(mac, rates[0], rates[1])
    wide = max(len(before.parts), len(now.parts))
    a, b = (np.pad(one.parts, (((wide - len(one.parts)) // 2,) * 2, (0, 0), (0, 0))) for one in (before, now))
    mac = np.abs(np.einsum("hvm,hvn->mn", a.conj(), M @ b, optimize=True)) ** 2
    return _cost(mac, before.values.imag, now.values.imag)


def _cost(mac: Array, before: Array, now: Array) -> Array:
    size = np.abs(before)[:, None] + np.abs(now)[None]
    found: Array = -mac + NEAR * np.abs(before[:, None] - now) / np.maximum(size, 1e-300)
    return found
