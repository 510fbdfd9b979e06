"""The stress that the shapes of a body leave out where its own inertia loads it, as a reduction keeps it with the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

STEADY_STRESS = "steady_stress"  # of the provenance
TOLD = 0.1  # of the largest stress under a load, from where on it is told unasked
_LOADS = (
    *(f"weight or acceleration along {axis}" for axis in "xyz"),
    *(f"angular acceleration about {axis}" for axis in "xyz"),
    *(f"spin about {axis}" for axis in "xyz"),
    *(f"spin about {a} and {b} together" for a, b in ("xy", "xz", "yz")),
)


def left_out_stress(provenance: Mapping[str, Any]) -> list[float]:
    """For each of the twelve unit accelerations (`ffr_prep.body.accelerations`) the largest von Mises stress at the surface
    that the shapes leave out [Pa per m/s^2 or 1/s^2]; empty where that is not known."""
    return list(provenance.get(STEADY_STRESS, {}).get("left_out", []))


def steady_stress_doubt(provenance: Mapping[str, Any]) -> str | None:
    """The warning about a body whose shapes do not show the stress of its own inertia; None where they do."""
    kept = provenance.get(STEADY_STRESS, {"left_out": [], "largest": []})
    shares = [out / most if most else 0.0 for out, most in zip(kept["left_out"], kept["largest"], strict=True)]
    worst = max(range(len(shares)), key=shares.__getitem__, default=0)
    if not shares or shares[worst] < TOLD:
        return None
    return (
        f"its shapes leave out stress of its own inertia: up to {100 * shares[worst]:.0f} % of the largest, under "
        f"{_LOADS[worst]}; add the shapes of such loads (`--method craig-bampton --method inertia-relief`; "
        "InertiaRelief() in a Union)"
    )
