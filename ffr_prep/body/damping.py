"""Damping of a body: Rayleigh's, a loss factor, ratios by frequency, as a matrix of its elastic coordinates.

Of modes of unit mass with the circular frequencies omega, Rayleigh's damping alpha M + beta K is alpha + beta omega^2, a loss
factor eta that of the viscous damping that loses as much at the frequency of each mode, eta omega, and a ratio zeta
2 zeta omega. The frame of a body is not damped: alpha acts on what it deforms by, relative to its frame.

Source: L. Meirovitch, Principles and Techniques of Vibrations (1997), sections 4.9 (structural damping) and 7.10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.body.reduced import BodyError, FlexibleBody
from ffr_prep.common.arrays import Array


def damped(
    body: FlexibleBody,
    *,
    alpha: float = 0.0,
    beta: float = 0.0,
    loss_factor: float = 0.0,
    bands: Sequence[tuple[float, float]] = (),
) -> FlexibleBody:
    """The body with more damping, beside what it has; so are its parts.

    alpha, beta : Rayleigh's damping alpha M + beta K [1/s], [s], of the modes under the reference conditions of the body
    loss_factor : [-], of the viscous damping that loses as much as a loss factor of the material at each mode's frequency
    bands       : (frequency [Hz], damping ratio), ascending: each ratio is that of the modes up to its frequency, the last
                  one also of all beyond

    Raises BodyError for negative or infinite values and for bands that do not ascend.

    >>> body = fp.damped(fp.load_body("rod.ffr"), alpha=2.0, beta=1e-6)
    >>> body = fp.damped(body, bands=[(100.0, 0.005), (1000.0, 0.02)])
    """
    _check(body, alpha=alpha, beta=beta, loss_factor=loss_factor)
    if not (alpha or beta or loss_factor or len(bands)):
        return body
    omega = np.sqrt(body.omega2)
    rates = alpha + beta * body.omega2 + loss_factor * omega + 2 * _ratios(body, bands) * omega
    D = np.diag(rates) if body.damping is None else body.damping + np.diag(rates)
    parts = tuple(damped(part, alpha=alpha, beta=beta, loss_factor=loss_factor, bands=bands) for part in body.parts)
    return replace(body, damping=D if D.any() else None, parts=parts)


def _ratios(body: FlexibleBody, bands: Sequence[tuple[float, float]]) -> Array:
    """(n,) of the modes by their frequencies."""
    if not len(bands):
        return np.zeros(body.n)
    try:
        limits, ratios = np.array(bands, float).reshape(-1, 2).T
    except (ValueError, TypeError):
        raise BodyError(
            f"body {body.name!r}: bands are {bands!r}; give pairs of a frequency in Hz and a ratio"
        ) from None
    if (np.diff(limits) <= 0).any() or not np.isfinite(bands).all() or min(limits.min(), ratios.min()) < 0:
        raise BodyError(
            f"body {body.name!r}: bands of damping are {bands!r}; give frequencies in Hz that ascend and ratios from zero"
        )
    return ratios[np.minimum(np.searchsorted(limits, body.frequencies), len(ratios) - 1)]


def _check(body: FlexibleBody, **values: float) -> None:
    for name, value in values.items():
        if not 0 <= value < np.inf:
            raise BodyError(f"body {body.name!r}: {name} is {value!r}; damping is a number from zero")
