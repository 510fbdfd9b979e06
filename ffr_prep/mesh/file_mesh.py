"""A mesh as its file has it: the form that all readers deliver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.cells import KINDS


@dataclass(frozen=True)
class FileMesh:
    """A mesh as it is in a file, numbers in the unit of the file.

    points  : (N, 3)
    blocks  : volume elements by kind, (kind, nodes (E, k)), in the node order of `ffr_prep.mesh.cells`
    volumes : name -> element numbers, counted through the blocks
    faces   : name -> corners (F, 3) or (F, 4) of faces; the volume elements know the rest of their faces
    nodes   : name -> node indices
    notes   : what was left out or changed, in words
    unit    : of the numbers, where the file declares one
    """

    points: Array
    blocks: tuple[tuple[str, Array], ...]
    volumes: Mapping[str, Array]
    faces: Mapping[str, tuple[Array, ...]]
    nodes: Mapping[str, Array]
    notes: tuple[str, ...] = ()
    unit: str | None = None


def supported_kind(kind: str, name: str) -> str:
    """The kind, if it is one of ours; InputError for others, called `name` in the file."""
    if kind not in KINDS:
        raise InputError(
            f"the mesh has volume elements of kind {name!r}; only {', '.join(KINDS)} can be used: mesh again with "
            "tetrahedra or hexahedra of first or second order"
        )
    return kind
