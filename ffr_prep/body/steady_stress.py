"""The stress that the shapes of a body leave out where its own inertia loads it, as a reduction keeps it with the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ffr_prep.body.accelerations import INERTIAL
from ffr_prep.body.frame_change import interface_motions, loads_on_motions
from ffr_prep.body.reduced import FlexibleBody
from ffr_prep.common.arrays import Array

STEADY_STRESS, WITHOUT_SHEAR = "steady_stress", "sections_without_shear"  # of the provenance
TOLD = 0.1  # of the largest stress under a load, from where on it is told unasked
_MEAN = 1e-9  # of the root of the mass: what moves the centre of mass in a frame of the mean motion
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
    told = sorted((k for k, share in enumerate(shares) if share >= TOLD), key=lambda k: -shares[k])
    if not told:
        return None
    return (
        "its shapes leave out stress of its own inertia: of the largest up to "
        f"{', '.join(f'{100 * shares[k]:.0f} % under {_LOADS[k]}' for k in told)}; add the shapes of such loads "
        "(`--method craig-bampton --method inertia-relief`; InertiaRelief() in a Union)"
    )


def of_plane(provenance: Mapping[str, Any], k: int) -> Mapping[str, Any]:
    """The provenance of a body that moves in the plane across its axis k alone: other accelerations, which it never has,
    leave out nothing."""
    kept = provenance.get(STEADY_STRESS)
    if not kept:
        return provenance
    along, about = [axis != k for axis in range(3)], [axis == k for axis in range(3)]
    acting = [*along, *about, *about, *[False] * 3]
    left_out = [out if acts else 0.0 for out, acts in zip(kept["left_out"], acting, strict=True)]
    return {**provenance, STEADY_STRESS: {**kept, "left_out": left_out}}


def shear_doubt(provenance: Mapping[str, Any]) -> str | None:
    """The warning about a body with stress in which beams have sections that do not know their shear; None of others."""
    sections = provenance.get(WITHOUT_SHEAR, [])
    if not sections:
        return None
    named = ", ".join(repr(name) for name in sections)
    return (
        f"the stress of section{'s' * (len(sections) > 1)} {named}, given by constants, is that of a rectangle with the same "
        "second moments, without the shear of transverse forces, and without that of torque unless J = Iy + Iz; a shape "
        "(rectangle, circle, tube, i) has both"
    )


def of_fewer_shapes(body: FlexibleBody, V: Array) -> Mapping[str, Any]:
    """The provenance of the body in the elastic coordinates p, q = V p, with V^T V = I and V^T Omega^2 V diagonal.

    What its shapes leave out is then at most what all n shapes did and what they show beyond those of V (n, m), and at most
    all there is and what those of V show, under the same loads: of statics, held by the reference conditions, or by the first
    interface where these are the mean motion.
    """
    kept = body.provenance.get(STEADY_STRESS)
    if not kept or V.shape[1] == body.n:
        return body.provenance
    others = {key: of for key, of in body.provenance.items() if key != STEADY_STRESS}
    if not V.shape[1] or body.surface is None or body.surface.stress is None:
        return others
    loads = _held_loads(body)
    all_shapes = loads / body.omega2[:, None]
    fewer = V @ ((V.T @ loads) / np.einsum("ia,i,ia->a", V, body.omega2, V)[:, None])
    more, shown = (largest_von_mises(body.surface.stress @ q) for q in (all_shapes - fewer, fewer))
    most = np.minimum(np.array(kept["left_out"]) + more, np.array(kept["largest"]) + shown)
    left_out = [float(f"{x:.6g}") for x in most]
    return {**others, STEADY_STRESS: {**kept, "left_out": left_out}}


def _held_loads(body: FlexibleBody) -> Array:
    """(n, 12) generalised forces of the unit accelerations."""
    loads = loads_on_motions(body)[:INERTIAL]
    if not body.interfaces or np.abs(body.P_dm).max(initial=0.0) > _MEAN * np.sqrt(body.mass):
        return loads[:, 6:].T
    first = interface_motions(body)[:6]
    follows = -np.linalg.solve(first[:, :6], first[:, 6:])
    return np.asarray((loads[:, 6:] + loads[:, :6] @ follows).T)


def largest_von_mises(stress: Array) -> Array:
    """(r,) the largest von Mises stress of stresses (P, 6, r)."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(stress, 1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.asarray(np.sqrt(0.5 * normal + 3.0 * (xy**2 + xz**2 + yz**2)).max(axis=0, initial=0.0))
