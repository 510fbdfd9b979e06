"""What a linear scene answers without bound: at a frequency, to noise, and where it is not stable.

A pole at i w of what has no damping, or at zero of what nothing holds, makes a gain infinite there, and the mean square under
noise that has this frequency, too: |H|^2 S is no longer integrable. A pole with a positive real part grows from anything.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ffr_dyn.analyses.linearise import Linearisation
from ffr_dyn.analyses.rotating.seen_from_ground import Sides, poles
from ffr_dyn.linear.transfer import FREE, ON, Transfer, has_pole
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import listed


def grows(linear: Linearisation) -> list[int]:
    """The numbers of the eigenvalues whose motions grow, one of each pair; of derivatives by differences no rounding."""
    values = linear.eigenvalues
    least = FREE * np.abs(values).max(initial=0.0) if linear.error else 0.0
    found = (values.real > np.maximum(ON * np.abs(values), least)) & (values.imag >= 0)
    return np.flatnonzero(found).tolist()


def notes_of_growth(linear: Linearisation, growing: Iterable[int]) -> list[str]:
    """A note for what grows fastest."""
    rates = {k: float(linear.eigenvalues[k].real) for k in growing}
    if not rates:
        return []
    worst = max(rates, key=lambda k: rates[k])
    return [
        f"the scene is not stable, {linear.leading[worst]!r} grows by {rates[worst]:.3g} 1/s: nothing settles to this "
        "response, which is that of the transfer function alone, and under noise there is no rms"
    ]


def notes_of_gains(linear: Linearisation, found: Transfer) -> list[str]:
    """A note for every frequency at which gains are infinite, of the first three."""
    rows = np.flatnonzero(~np.isfinite(found.H).all(axis=1))
    said = [
        f"at {found.frequencies[k]:.5g} Hz there is no bound for {_names(linear, ~np.isfinite(found.H[k]))}: "
        + (
            "nothing holds the motion"
            if _is_free(linear, found.frequencies[k])
            else "the vibration there has no damping"
        )
        for k in rows
    ]
    return list(dict.fromkeys(said))[:3]


def _is_free(linear: Linearisation, frequency: float) -> bool:
    """Whether a gain without bound is that of a free motion: at zero, or where no vibration is, in step with the turning."""
    s = 2j * np.pi * frequency
    return not (np.abs(s - linear.eigenvalues) <= ON * np.abs(s)).any() or frequency == 0


def under_noise(
    linear: Linearisation, sides: Sides | None, noise: Array, order: int, growing: Iterable[int]
) -> tuple[Array, list[str]]:
    """(O,) of which outputs the mean square under a noise (K, 2) is infinite, and notes on why."""
    values, (low, high) = linear.eigenvalues, noise[[0, -1], 0]
    known = poles(linear, sides)
    bare = (known.imag > 0) & (np.abs(known.real) <= ON * np.abs(known))
    bare &= (known.imag >= 2 * np.pi * low) & (known.imag <= 2 * np.pi * high)
    undamped, infinite = _seen(linear, sides, values[bare[: values.size]], order)
    turning, beyond = _seen(linear, sides, known[values.size :][bare[values.size :]], order)
    notes = [
        f"the vibration of {value.imag / 2 / np.pi:.5g} Hz has no damping: noise excites it without bound, and the rms of "
        f"{_names(linear, infinite)} is infinite; give bodies or joints damping"
        for value in undamped[:1]
    ]
    notes += [
        f"noise at {value.imag / 2 / np.pi:.5g} Hz, in step with the turning, drives what nothing holds ever farther: the "
        f"rms of {_names(linear, beyond)} is infinite; hold the turning by a driver"
        for value in turning[:1]
    ]
    free = np.zeros(1 if low == 0 and (order or not known.all()) else 0)
    drifting, far = _seen(linear, sides, free, order)
    notes += [
        f"noise down to 0 Hz drives what nothing holds ever farther: the rms of {_names(linear, far)} is infinite; let the "
        "noise begin above 0 Hz"
        for _ in drifting
    ]
    _, without = _seen(linear, sides, values[list(growing)], order)
    return infinite | beyond | far | without, notes


def _seen(linear: Linearisation, sides: Sides | None, at: Array, order: int) -> tuple[list[complex], Array]:
    """Those of the poles `at` that outputs have, and (O,) which outputs have any of them."""
    C, D, count = linear.C, linear.D, len(linear.outputs)
    if sides is not None:
        C, D = np.concatenate([C, sides.C]), np.concatenate([D, sides.D])
    known = poles(linear, sides)
    found = [has_pole(linear.A, linear.B, C, D, pole, order, known, count) for pole in at]
    each = np.any(np.reshape(found, (len(at), len(C) // count, count)), axis=1)
    return [pole for pole, seen in zip(at.tolist(), each, strict=True) if seen.any()], np.any(each, axis=0)


def _names(linear: Linearisation, which: Array) -> str:
    return listed(name for name, there in zip(linear.outputs, which, strict=True) if there)
