"""Damping of a body: Rayleigh's, a loss factor, ratios by frequency, as a matrix of its elastic coordinates.

Of modes of unit mass with the circular frequencies omega, Rayleigh's damping alpha M + beta K is alpha + beta omega^2, a loss
factor eta that of the viscous damping that loses as much at the frequency of each mode, eta omega, and a ratio zeta
2 zeta omega. The frame of a body is not damped: alpha acts on what it deforms by, relative to its frame.

Source: L. Meirovitch, Principles and Techniques of Vibrations (1997), sections 4.9 (structural damping) and 7.10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffr_prep.body.reduced import BodyError, FlexibleBody
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Damping:
    """Damping that a body gets beside what it has, of the modes under its reference conditions.

    alpha, beta : Rayleigh's damping alpha M + beta K [1/s], [s]
    loss_factor : [1], of the viscous damping that loses as much as a loss factor of the material at each mode's frequency
    bands       : (b, 2) pairs of frequency [Hz] and damping ratio, ascending: each ratio is that of the modes up to its
                  frequency, the last one also of all beyond
    ratios      : damping ratios [1] of the modes by rising frequency, the last one also of all others

    Raises BodyError for negative or infinite values and for bands that do not ascend.

    >>> damping = fp.Damping(alpha=2.0, beta=1e-6, ratios=[0.01])  # a Request takes it
    """

    alpha: float = 0.0
    beta: float = 0.0
    loss_factor: float = 0.0
    bands: Sequence[tuple[float, float]] = ()
    ratios: Sequence[float] = ()

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "loss_factor"):
            if not 0 <= (value := getattr(self, name)) < np.inf:
                raise BodyError(f"{name} is {value!r}; damping is a number from zero")
        if np.ndim(self.ratios) != 1:
            raise BodyError(f"damping ratios are {self.ratios!r}; give them in a list, such as [0.01]")
        if not all(0 <= ratio < np.inf for ratio in self.ratios):
            raise BodyError(f"damping ratios are {list(self.ratios)}; give numbers from zero")
        if len(self.bands):
            _check_bands(self.bands)


def damped(
    body: FlexibleBody,
    *,
    alpha: float = 0.0,
    beta: float = 0.0,
    loss_factor: float = 0.0,
    bands: Sequence[tuple[float, float]] = (),
    ratios: Sequence[float] = (),
) -> FlexibleBody:
    """The body with more damping beside what it has; so are its parts. The arguments are as of `Damping`.

    Raises BodyError for negative or infinite values and for bands that do not ascend.

    >>> body = fp.damped(fp.load_body("rod.ffr"), alpha=2.0, beta=1e-6)
    >>> body = fp.damped(body, bands=[(100.0, 0.005), (1000.0, 0.02)])
    >>> body = fp.damped(body, ratios=[0.01])
    """
    try:
        return with_damping(body, Damping(alpha, beta, loss_factor, bands, ratios))
    except BodyError as error:
        raise BodyError(f"body {body.name!r}: {error}") from None


def with_damping(body: FlexibleBody, given: Damping) -> FlexibleBody:
    """The body and its parts with more damping."""
    if not (given.alpha or given.beta or given.loss_factor or len(given.bands) or len(given.ratios)):
        return body
    omega = np.sqrt(body.omega2)
    ratios = _by_band(given.bands, body.frequencies) + _by_number(given.ratios, body.frequencies)
    rates = given.alpha + given.beta * body.omega2 + given.loss_factor * omega + 2 * ratios * omega
    D = np.diag(rates) if body.damping is None else body.damping + np.diag(rates)
    parts = tuple(with_damping(part, given) for part in body.parts)
    return replace(body, damping=D if D.any() else None, parts=parts)


def _by_band(bands: Sequence[tuple[float, float]], frequencies: Array) -> Array:
    """(n,) ratios of modes by their frequencies [Hz]."""
    if not len(bands):
        return np.zeros(frequencies.size)
    limits, ratios = np.array(bands, float).T
    return np.asarray(ratios[np.minimum(np.searchsorted(limits, frequencies), len(ratios) - 1)])


def _by_number(ratios: Sequence[float], frequencies: Array) -> Array:
    """(n,) ratios of modes by the order of their frequencies [Hz]."""
    if not len(ratios):
        return np.zeros(frequencies.size)
    place = np.argsort(np.argsort(frequencies, kind="stable"))
    return np.array(ratios, float)[np.minimum(place, len(ratios) - 1)]


def _check_bands(bands: Sequence[tuple[float, float]]) -> None:
    try:
        limits, ratios = np.array(bands, float).reshape(-1, 2).T
    except (ValueError, TypeError):
        raise BodyError(f"bands are {bands!r}; give pairs of a frequency in Hz and a ratio") from None
    if (np.diff(limits) <= 0).any() or not np.isfinite(bands).all() or min(limits.min(), ratios.min()) < 0:
        raise BodyError(f"bands of damping are {bands!r}; give frequencies in Hz that ascend and ratios from zero")
