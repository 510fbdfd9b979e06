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
from ffr_prep.body.reduced import FlexibleBody, cut_names, remembered

CUT_ERROR = "cut_error"  # of the provenance
_MODES = 6  # that are looked at, from the slowest on
_TOLD = 0.02  # of a frequency, from where on it is told unasked
_SAME = 1e-9  # of the largest displacement, by which points move as one piece
_FLAT = 1e-3  # of a section's width, within which its points lie in a plane
_PLANE = 4  # points that may lie in no plane


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
    """The warning about stress beside cuts that hold a section rigid; None of a body of beams, or without stress.

    Where faces of elements lie in the plane of a cut, as of a structured mesh or between two volumes, the section alone is
    held; elsewhere a layer of whole elements is, in which there is next to no stress.
    """
    kinds = [part.interface(cut_names(k)[0]).kind for k, part in enumerate(body.parts[:-1], 1)]
    if "rigid" not in kinds or body.surface is None or body.surface.stress is None:
        return None
    depths = remembered(
        body, "depths of cuts", lambda: [_depth(p, cut_names(k)[0]) for k, p in enumerate(body.parts[:-1], 1)]
    )
    rough = [f"{k} ({depth:.2g} m)" for k, depth in enumerate(depths, 1) if depth]
    held = "that of a section which is held rigid, up to a half off"
    if not rough:
        return (
            f"its stress within about a section's width of a cut is {held}: cut where no stress is asked for, or find it "
            "with the body in one piece"
        )
    return (
        f"its stress within about a section's width of a cut is {held}, and next to none where whole elements are held, as "
        f"no faces of elements lie in a plane: that deep are the cuts {', '.join(rough)}. Cut where the mesh has such faces, "
        "as between two volumes, or where no stress is asked for, or find it with the body in one piece"
    )


def _depth(part: FlexibleBody, name: str) -> float:
    """[m] along the part, over which the points of its surface lie that move with a rigid interface as one piece; 0 of points
    in a plane."""
    cut, surface = part.interface(name), part.surface
    if surface is None or not part.n:
        return 0.0
    arms = surface.points - cut.position
    rigid = cut.phi_t + np.cross(cut.phi_r[None], arms[:, :, None], axis=1)
    off = np.abs(surface.Phi - rigid).max(axis=(1, 2))
    held = arms[off <= _SAME * np.abs(surface.Phi).max()]
    if len(held) < _PLANE:
        return 0.0
    across = np.linalg.svd(held - held.mean(axis=0), compute_uv=False)
    along = cut.position - part.r_dm / part.mass  # as slender as parts are, along the body
    return float(np.ptp(held @ along) / np.linalg.norm(along)) if across[2] > _FLAT * across[0] else 0.0
