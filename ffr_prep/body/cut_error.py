"""How much too high the frequencies of a body in parts are by its cuts, as a reduction keeps it with the body.

The nodes at a cut move as one piece, so that a section which warps, or contracts as it bends, is held there, and where a cut
goes through several members of a frame they are tied to each other. The free vibrations of the parts that fixed joints hold
together, beside those of the whole, tell how much that is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ffr_prep.body.chain import free_vibrations
from ffr_prep.body.reduced import FlexibleBody, cut_names

CUT_ERROR = "cut_error"  # of the provenance
_MODES = 6  # that are looked at, from the slowest on
_TOLD = 0.02  # of a frequency, from where on it is told unasked


def cut_error(body: FlexibleBody) -> dict[str, Any]:
    """The lowest frequencies [Hz] of the free body in one piece and in parts, as JSON values; empty of one without parts."""
    if not body.parts:
        return {}
    bodies = {"whole": (body,), "parts": body.parts}
    found = {key: free_vibrations(of, _MODES).omega / (2 * np.pi) for key, of in bodies.items()}
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
