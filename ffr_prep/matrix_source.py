"""Reading matrix models: which reader takes which files, and what all readers share.

MODEL.npz                          everything in one file (`ffr_prep.npz_source`)
K.mtx M.mtx DOFS.csv               Matrix Market, or scipy.sparse.save_npz (`ffr_prep.matrix_market_source`)
STIF.mtx MASS.mtx MODEL.inp        Abaqus (`ffr_prep.abaqus_matrix_source`)
MATRICES.op4 MODEL.bdf, MODEL.op2  Nastran (`ffr_prep.nastran_source`)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.errors import InputError
from ffr_prep.matrix_model import UNIT_SYSTEMS, MatrixModel, in_si

Array = np.ndarray

_NASTRAN_DECKS = (".bdf", ".dat", ".nas")
FILES = "MODEL.npz; K.mtx M.mtx DOFS.csv; STIF.mtx MASS.mtx MODEL.inp; MATRICES.op4 MODEL.bdf; or MODEL.op2"


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


def read_matrices(files: Sequence[str | Path], *, units: str | None = None) -> MatrixModel:
    """The model of one or several files, in SI units.

    units : of the numbers in the files, a name in UNIT_SYSTEMS; m-kg-s when not given and the file says nothing

    Raises InputError for files that cannot be used or do not fit each other.
    """
    paths = [Path(file) for file in files]
    for path in paths:
        if not path.is_file():
            raise InputError(f"matrix file {path} does not exist")
    if units is not None and units not in UNIT_SYSTEMS:
        raise InputError(f"units {units!r} are not known; they are {', '.join(UNIT_SYSTEMS)}")
    model = _read(paths)
    declared = units or model.source.get("units") or "m-kg-s"
    if declared not in UNIT_SYSTEMS:
        raise InputError(f"{paths[0]} declares the units {declared!r}; they must be one of {', '.join(UNIT_SYSTEMS)}")
    source = {**model.source, "files": [path.name for path in paths], "units": declared}
    return in_si(replace(model, source=source), UNIT_SYSTEMS[declared])


def _read(paths: Sequence[Path]) -> MatrixModel:
    kinds = tuple(path.suffix.lower() for path in paths)
    if kinds == (".npz",):
        from ffr_prep.npz_source import from_npz

        return from_npz(paths[0])
    if len(kinds) == 3 and set(kinds[:2]) <= {".mtx", ".npz"} and kinds[2] == ".csv":
        from ffr_prep.matrix_market_source import from_matrix_market

        return from_matrix_market(*paths)
    if len(kinds) == 3 and set(kinds[:2]) == {".mtx"} and kinds[2] == ".inp":
        from ffr_prep.abaqus_matrix_source import from_abaqus_matrices

        return from_abaqus_matrices(*paths)
    if kinds == (".op2",):
        from ffr_prep.nastran_source import from_op2

        return from_op2(paths[0])
    if len(kinds) == 2 and kinds[0] == ".op4" and kinds[1] in _NASTRAN_DECKS:
        from ffr_prep.nastran_source import from_op4

        return from_op4(*paths)
    raise InputError(f"these are not files of a matrix model: {', '.join(map(str, paths))}; give {FILES}")


# ---- shared by the readers ----------------------------------------------------------------------------------------


def model_of(
    path: Path,
    table: NodeTable,
    rows: Array,
    K: sp.sparray,
    M: sp.sparray,
    source: Mapping[str, Any],
    notes: Sequence[str] = (),
) -> MatrixModel:
    """The model of numbers of nodes and components 1 ... 6 of each row (D, 2); InputError for a node not in the table."""
    index = {label: k for k, label in enumerate(table.labels.tolist())}
    if len(index) < len(table.labels):
        labels, counts = np.unique(table.labels, return_counts=True)
        raise InputError(f"{path}: node {labels[counts > 1][0]} is defined twice")
    (K, K_notes), (M, M_notes) = mirrored("K", K), mirrored("M", M)
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
            notes=(*notes, *K_notes, *M_notes),
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
    """The whole of a symmetric matrix of which one triangle may have been given, and a note when it was."""
    A = sp.csr_array(A)
    if A.shape[0] != A.shape[1]:
        return A, []
    strict = [sp.csr_array(part) for part in (sp.tril(A, -1), sp.triu(A, 1))]
    for part in strict:
        part.eliminate_zeros()
    if all(part.nnz for part in strict) or not any(part.nnz for part in strict):
        return A, []
    return sp.csr_array(A + strict[0].T + strict[1].T), [f"{name} was given by one triangle and made symmetric"]
