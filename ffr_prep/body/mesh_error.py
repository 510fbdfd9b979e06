"""How much too high the frequencies of a body are by the size of its elements, and by the shapes that its reduction leaves
out, as a reduction keeps it with the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.in_words import percent_in_words

MESH_ERROR, TRUNCATION_ERROR = "mesh_error", "truncation_error"  # of the provenance
CONVERTED_FROM = (
    "converted_from"  # of the provenance: the reference conditions under which a converted body was reduced
)
TOLD = 0.02  # of the lowest frequency, from where on it is told unasked
_FINER = {  # by what the record of the model has
    "mesh": "reduce it with smaller elements or with those of second order (`ffr-prep reduce --size`, `--order 2`; a file "
    "that is a mesh already is made finer by the program that wrote it)",
    "members": "give its members more elements (`elements`)",
    "shells": "give its sheets more elements across their width, or quadrilaterals in place of triangles, which are much "
    "stiffer in their plane",
}


def mesh_errors_of(provenance: Mapping[str, Any]) -> dict[int, float]:
    """For each mode that was looked at, by its number from 1, how much too high its frequency is: 0.02 of 2 per cent.

    Of a converted body they are the modes under the reference conditions of its reduction.
    """
    return errors_of_modes(provenance, MESH_ERROR)


def errors_of_modes(provenance: Mapping[str, Any], kind: str) -> dict[int, float]:
    """As `mesh_errors_of`, of either kind."""
    kept = provenance.get(kind, {"modes": [], "too_high": []})
    return dict(zip(kept["modes"], kept["too_high"], strict=True))


def mesh_doubt(provenance: Mapping[str, Any]) -> str | None:
    """The warning about a body whose lowest frequency the mesh makes too high; None where there is none."""
    first = mesh_errors_of(provenance).get(1, 0.0)
    if first < TOLD:
        return None
    percent = f"{100 * first:.{0 if first >= 0.1 else 1}f}"
    remedies = [remedy for key, remedy in _FINER.items() if _has(provenance, key)]
    remedy = ", and ".join(remedies or _FINER.values())
    before = ", under the reference conditions of its reduction," if CONVERTED_FROM in provenance else ""
    return f"its mesh is too coarse: the lowest frequency{before} is about {percent} % too high; {remedy}"


def in_fewer_shapes(provenance: Mapping[str, Any], old: Array, new: Array) -> Mapping[str, Any]:
    """The provenance of a body in fewer combinations of its shapes: what its frequencies are too high by for want of shapes,
    by those that it had and those that it has; without, where they are in no order. old (n,), new (m,) : omega^2 [1/s^2].

    What they are too high by its mesh stays, of as many modes as it has.
    """
    if CONVERTED_FROM in provenance:
        return provenance
    in_order = not ((np.diff(old) < 0).any() or (np.diff(new) < 0).any())
    mesh, shapes = (
        {k: e for k, e in errors_of_modes(provenance, kind).items() if k <= len(new) and in_order}
        for kind in (MESH_ERROR, TRUNCATION_ERROR)
    )
    shapes = {k: float((new[k - 1] / old[k - 1]) ** 0.5 * (1.0 + error) - 1.0) for k, error in shapes.items()}
    others = {key: of for key, of in provenance.items() if key not in (MESH_ERROR, TRUNCATION_ERROR)}
    known = {kind: of for kind, of in ((MESH_ERROR, mesh), (TRUNCATION_ERROR, shapes)) if kind in provenance}
    return others | {kind: {"modes": list(of), "too_high": list(of.values())} for kind, of in known.items()}


def modes_doubt(provenance: Mapping[str, Any]) -> str | None:
    """The warning about a body whose lowest frequency is too high for want of shapes; None where it is not."""
    first = errors_of_modes(provenance, TRUNCATION_ERROR).get(1, 0.0)
    if first < TOLD:
        return None
    return (
        f"its shapes are too few: the lowest frequency under its reference conditions is about {percent_in_words(first)} too "
        "high; keep more modes (`--modes`)"
    )


def made_of_plates(provenance: Mapping[str, Any]) -> bool:
    """Whether plates are in the model, of whose bending the error is not known."""
    return _has(provenance, "shells")


def _has(record: Mapping[str, Any], key: str) -> bool:
    """Whether a model, or a part of it, has the entry in its record."""
    return bool(record.get(key)) or any(_has(part, key) for part in record.get("parts", {}).values())
