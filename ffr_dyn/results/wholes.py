"""Results of bodies in parts as of one body: one surface, whose elastic coordinates are those of all parts.

The frame of the whole is that of its first part. Stress and section forces depend on the coordinates alone; where the points
are depends on the poses of the parts as well (`ffr_dyn.pictures.film`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_dyn.results.result import Quantity, Result, mode_axis
from ffr_prep.body import BeamForces, QuadraticField, Surface
from ffr_prep.common.arrays import Array


def parts_of(result: Result) -> dict[str, list[str]]:
    """The names of the parts by that of their whole, of bodies that are drawn and whose elastic coordinates were kept."""
    wholes: dict[str, list[str]] = result.attributes.get("parts", {})
    return {
        whole: parts
        for whole, parts in wholes.items()
        if all(part in result.geometry and f"{part}.q" in result.quantities for part in parts)
    }


def with_wholes(result: Result) -> Result:
    """The result with the surface of each whole, and its R, p and q, in place of the surfaces of its parts."""
    geometry, found = dict(result.geometry), dict(result.quantities)
    for whole, parts in parts_of(result).items():
        geometry[whole] = one_surface([geometry.pop(part) for part in parts])
        histories = [result.quantity(f"{part}.q") for part in parts]
        q = np.concatenate([history.values for history in histories], axis=1)
        text = "elastic coordinates of all parts"
        found[f"{whole}.q"] = Quantity(q, histories[0].unit, (mode_axis(whole, q.shape[1]),), text)
        found |= {f"{whole}.{key}": found[f"{parts[0]}.{key}"] for key in ("R", "p") if f"{parts[0]}.{key}" in found}
    return replace(result, geometry=geometry, quantities=found)


def one_surface(surfaces: Sequence[Surface]) -> Surface:
    """The surfaces of parts as one, whose elastic coordinates are those of the first part, then those of the second, ..."""
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    stress = [surface.stress for surface in surfaces if surface.stress is not None]
    moduli = [surface.moduli for surface in surfaces if surface.moduli is not None]
    beams = [surface.beams for surface in surfaces if surface.beams is not None]
    stressed, Phi = len(stress) == len(surfaces), [surface.Phi for surface in surfaces]
    return Surface(
        points=np.concatenate([surface.points for surface in surfaces]),
        triangles=np.concatenate([s.triangles + start for s, start in zip(surfaces, first, strict=False)]),
        Phi=_side_by_side(Phi),
        stress=_side_by_side(stress) if stressed else None,
        moduli=np.concatenate(moduli) if stressed else None,
        beams=_one_line(beams) if len(beams) == len(surfaces) else None,
        second=_one_field([surface.second for surface in surfaces], Phi),
        second_stress=_one_field([surface.second_stress for surface in surfaces], stress) if stressed else None,
    )


def _one_line(beams: Sequence[BeamForces]) -> BeamForces:
    """The beam elements of all parts, numbered through."""
    modes = [of.modes for of in beams]
    return BeamForces(
        positions=np.concatenate([of.positions for of in beams]),
        axes=np.concatenate([of.axes for of in beams]),
        modes=_side_by_side(modes),
        second=_one_field([of.second for of in beams], modes),
    )


def _one_field(fields: Sequence[QuadraticField | None], modes: Sequence[Array]) -> QuadraticField | None:
    """The fields of all parts as one, zero where a part has none; modes (P, ..., n) of the same quantity tell its places."""
    if not any(fields):
        return None
    own = [
        field or QuadraticField(np.zeros((*of.shape[:-1], 0)), np.zeros((0, of.shape[-1], of.shape[-1])))
        for field, of in zip(fields, modes, strict=True)
    ]
    ends = np.cumsum([0, *(of.shape[-1] for of in modes)])
    weights = [
        np.pad(of.weights, ((0, 0), *[(a, ends[-1] - b)] * 2)) for of, a, b in zip(own, ends, ends[1:], strict=False)
    ]
    return QuadraticField(_side_by_side([of.shapes for of in own]), np.concatenate(weights))


def _side_by_side(modes: Sequence[Array]) -> Array:
    """(P, ..., n) of all parts: the rows of each with zeros in the columns of the others."""
    ends = np.cumsum([0, *(of.shape[-1] for of in modes)])
    columns = zip(modes, ends, ends[1:], strict=False)
    return np.concatenate([np.pad(of, ((0, 0),) * (of.ndim - 1) + ((a, ends[-1] - b),)) for of, a, b in columns])
