"""Nodes by their numbers in a file, and the matrix model of numbered rows, which all readers use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel


@dataclass(frozen=True)
class NodeTable:
    """The nodes of a file by their numbers.

    labels    : (N,) numbers; points : (N, 3) in the unit of the file
    groups    : name -> numbers of nodes
    triangles : (T, 3) numbers of nodes, or None
    """

    labels: Array
    points: Array
    groups: Mapping[str, Array] = field(default_factory=dict)
    triangles: Array | None = None


# ---- shared by the readers ----------------------------------------------------------------------------------------


def model_of(
    path: Path,
    table: NodeTable,
    rows: Array,
    K: sp.sparray,
    M: sp.sparray,
    source: Mapping[str, Any],
    notes: Sequence[str] = (),
    C: sp.sparray | None = None,
) -> MatrixModel:
    """The model of numbers of nodes and components 1 ... 6 of each row (D, 2); InputError for a node not in the table."""
    index = {label: k for k, label in enumerate(table.labels.tolist())}
    if len(index) < len(table.labels):
        labels, counts = np.unique(table.labels, return_counts=True)
        raise InputError(f"{path}: node {labels[counts > 1][0]} is defined twice")
    (K, K_notes), (M, M_notes) = mirrored("K", K), mirrored("M", M)
    C, C_notes = (None, []) if C is None else mirrored("C", C)
    try:
        return MatrixModel(
            points=table.points,
            K=sp.csr_array(K),
            M=sp.csr_array(M),
            nodes=_indices(index, rows[:, 0], "a row"),
            components=np.asarray(rows[:, 1], np.int64) - 1,
            labels=table.labels,
            groups={name: _indices(index, of, f"group {name!r}") for name, of in table.groups.items()},
            triangles=None if table.triangles is None else _indices(index, table.triangles, "the surface"),
            source=source,
            notes=(*notes, *K_notes, *M_notes, *C_notes),
            C=C,
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _indices(index: Mapping[int, int], labels: Array, what: str) -> Array:
    flat = np.asarray(labels, np.int64)
    try:
        return np.array([index[label] for label in flat.ravel().tolist()], np.int64).reshape(flat.shape)
    except KeyError as error:
        raise InputError(f"{what} belongs to node {error.args[0]}, which has no coordinates") from None


def mirrored(name: str, A: sp.sparray) -> tuple[sp.csr_array, list[str]]:
    """The whole of a symmetric matrix of which one triangle may have been given, in whatever order of its rows, and a note
    when it was: no entry has another across the diagonal."""
    A = sp.csr_array(A)
    if A.shape[0] != A.shape[1]:
        return A, []
    off = sp.csr_array(A - sp.diags_array(A.diagonal()))
    off.eliminate_zeros()
    there = abs(off).sign()
    if not off.nnz or there.multiply(there.T).nnz:
        return A, []
    return sp.csr_array(A + off.T), [f"{name} was given by one triangle and made symmetric"]
