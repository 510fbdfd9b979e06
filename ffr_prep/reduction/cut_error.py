"""How much too high the frequencies of a body in parts are by its cuts, as a reduction keeps it with the body.

The nodes at a cut move as one piece, so that a section which warps, or contracts as it bends, is held there, and where a cut
goes through several members of a frame they are tied to each other. The free vibrations of the parts that fixed joints hold
together, beside those of the whole, tell how much that is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from ffr_prep.body import FlexibleBody, Interface, cut_names, mass_of_motions
from ffr_prep.body.accelerations import turns
from ffr_prep.common.arrays import Array

CUT_ERROR = "cut_error"  # of the provenance
_MODES = 6  # that are looked at, from the slowest on
_TOLD = 0.02  # of a frequency, from where on it is told unasked


def cut_error(body: FlexibleBody) -> dict[str, Any]:
    """The lowest frequencies [Hz] of the free body in one piece and in parts, as JSON values; empty of one without parts."""
    if not body.parts:
        return {}
    found = {"whole": free_frequencies([body]), "parts": free_frequencies(body.parts)}
    count = min(map(len, found.values()))
    return {CUT_ERROR: {key: [float(f"{f:.6g}") for f in of[:count]] for key, of in found.items()}}


def cut_errors_of(provenance: Mapping[str, Any]) -> list[float]:
    """For each of the lowest modes of the free body, how much too high its frequency is by the cuts: 0.02 of 2 per cent."""
    kept = provenance.get(CUT_ERROR, {"whole": [], "parts": []})
    return [max(parts / whole - 1, 0.0) for whole, parts in zip(kept["whole"], kept["parts"], strict=True)]


def cut_doubt(provenance: Mapping[str, Any]) -> str | None:
    """The warning about a body whose parts are stiffer than the whole; None where they are not."""
    errors = cut_errors_of(provenance)
    if max(errors, default=0.0) < _TOLD:
        return None
    worst = int(np.argmax(errors))
    whole, parts = (provenance[CUT_ERROR][key][worst] for key in ("whole", "parts"))
    percent = f"{100 * errors[worst]:.{0 if errors[worst] >= 0.1 else 1}f}"
    return (
        f"its parts together are stiffer than the whole: free vibration {worst + 1} has {parts:.4g} Hz, and in one piece "
        f"{whole:.4g} Hz ({percent} % too high). A cut moves as one rigid piece: cut into fewer parts, or where a single "
        "member passes whose section keeps its shape (stations or planes), and take craig-bampton, whose shapes let cuts move"
    )


def cut_stress_doubt(body: FlexibleBody) -> str | None:
    """The warning about stress beside cuts that hold a section rigid; None of a body of beams, or without stress."""
    kinds = [part.interface(cut_names(k)[0]).kind for k, part in enumerate(body.parts[:-1], 1)]
    if "rigid" not in kinds or body.surface is None or body.surface.stress is None:
        return None
    return (
        "its stress within about a section's width of a cut is that of a section which is held rigid, up to a third off: cut "
        "where no stress is asked for, or find it with the body in one piece"
    )


# ---- vibrations of parts that hang together -----------------------------------------------------------------------


@dataclass(frozen=True)
class _Chain:
    """Bodies in a row, of which each holds the next at a cut, moving by their elastic coordinates alone.

    masses : (6 + n, 6 + n) of the motions of each body
    before, behind : at each cut, the rigid motion that brings the body behind it to the place where the one before it has it,
             (6, n) by the elastic coordinates of either
    """

    masses: list[Array]
    before: list[Array]
    behind: list[Array]
    first: Array

    def momenta(self, q: Array) -> Array:
        """(n, m) what accelerations q (n, m) of the elastic coordinates ask for, with the rigid motion that keeps the whole
        free of momentum."""
        own = [q[a:b] for a, b in pairwise(self.first)]
        rigid = [np.zeros((6, q.shape[1]))]
        for k, (a, b) in enumerate(zip(self.before, self.behind, strict=True)):
            rigid.append(rigid[-1] + a @ own[k] - b @ own[k + 1])
        forces = [M @ np.vstack([g, of]) for M, g, of in zip(self.masses, rigid, own, strict=True)]
        floating = np.linalg.solve(sum(M[:6, :6] for M in self.masses), sum(f[:6] for f in forces))
        forces = [f - M[:, :6] @ floating for M, f in zip(self.masses, forces, strict=True)]
        found, carried = [f[6:] for f in forces], np.zeros_like(rigid[0])
        for k in range(len(self.before) - 1, -1, -1):
            carried = carried + forces[k + 1][:6]
            found[k] = found[k] + self.before[k].T @ carried
            found[k + 1] = found[k + 1] - self.behind[k].T @ carried
        return np.vstack(found)


def free_frequencies(bodies: Sequence[FlexibleBody]) -> list[float]:
    """The lowest frequencies [Hz] of the parts of a body, or of one body, that nothing holds."""
    rates = np.sqrt(np.concatenate([body.omega2 for body in bodies]))[:, None]
    chain = _chain(bodies)

    def compliance(y: Array) -> Array:
        return np.asarray(chain.momenta(y.reshape(len(rates), -1) / rates) / rates)

    count = min(_MODES, len(rates) - 1)
    if count < 0:
        return []
    if not count:  # too few for Lanczos
        found = np.ravel(compliance(np.ones(1)))
    else:
        operator = LinearOperator((len(rates),) * 2, matvec=compliance, matmat=compliance, dtype=float)
        found = eigsh(operator, k=count, v0=1 / rates[:, 0], return_eigenvectors=False)
    return [float(f) for f in 1 / (2 * np.pi * np.sqrt(np.sort(found)[::-1]))]


def _chain(bodies: Sequence[FlexibleBody]) -> _Chain:
    cuts = [
        (one.interface(a), other.interface(b))
        for (one, other), (a, b) in zip(pairwise(bodies), map(cut_names, range(1, len(bodies))), strict=True)
    ]
    return _Chain(
        masses=[mass_of_motions(body) for body in bodies],
        before=[_motion_of_body(a) for a, _ in cuts],
        behind=[_motion_of_body(b) for _, b in cuts],
        first=np.cumsum([0, *(body.n for body in bodies)]),
    )


def _motion_of_body(at: Interface) -> Array:
    """(6, n) the rigid motion about the origin that moves a place as its elastic shapes do."""
    return np.vstack([at.phi_t - np.einsum("akm,m,aj->kj", turns(), at.position, at.phi_r), at.phi_r])
