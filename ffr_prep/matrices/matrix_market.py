"""Matrix Market files, or scipy.sparse.save_npz files, with a table that says what their rows are.

The table is a .csv file with one line for each row of the matrices, in their order:

    node,component,x,y,z,groups
    17,1,0.0,0.1,0.0,tip;edge

with the number of the node, the component 1 ... 6 (translations, rotations), the coordinates of the node, and, if wanted,
the groups that the node is in, separated by semicolons. A first line of names may be there or not.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_count, read_text
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, model_of
from ffr_prep.matrices.npz import arrays_of, sparse_of


def from_matrix_market(stiffness: Path, mass: Path, *last: Path) -> MatrixModel:
    """The model of two matrices, perhaps one of viscous damping, and a table, in the unit of the files. Raises InputError
    for files that cannot be used."""
    *damping, rows = last
    table, dofs = read_rows(rows)
    C = _matrix(damping[0]) if damping else None
    return model_of(rows, table, dofs, _matrix(stiffness), _matrix(mass), {"format": "Matrix Market"}, C=C)


def read_rows(path: Path) -> tuple[NodeTable, Array]:
    """The nodes, and number and component (D, 2) of each row."""
    lines = list(csv.reader(read_text(path, "a table of rows").splitlines()))
    first = 1 if lines and lines[0] and not _is_integer(lines[0][0]) else 0
    points: dict[int, list[float]] = {}
    groups: dict[str, dict[int, None]] = {}
    dofs = []
    for number, line in enumerate(lines[first:], first + 1):
        if not line:
            continue
        node, component, at, names = _fields(path, number, line)
        if points.setdefault(node, at) != at:
            raise InputError(f"{path}, line {number}: node {node} is at {at}, but was at {points[node]} before")
        for name in names:
            groups.setdefault(name, {})[node] = None
        dofs.append((node, component))
    table = NodeTable(
        labels=np.array(list(points), np.int64),
        points=np.array(list(points.values()), float).reshape(-1, 3),
        groups={name: np.array(list(of), np.int64) for name, of in groups.items()},
    )
    return table, np.array(dofs, np.int64).reshape(-1, 2)


def _fields(path: Path, number: int, line: Sequence[str]) -> tuple[int, int, list[float], list[str]]:
    try:
        node, component = int(line[0]), int(line[1])
        at = [float(word) for word in line[2:5]]
        if len(at) < 3:
            raise ValueError("three coordinates are needed")
    except (ValueError, IndexError) as error:
        raise InputError(f"{path}, line {number}: write node,component,x,y,z[,groups] ({error})") from None
    names = line[5].split(";") if len(line) > 5 else []
    return node, component, at, [name.strip() for name in names if name.strip()]


def _is_integer(word: str) -> bool:
    return word.strip().lstrip("+-").isdecimal()


def _matrix(path: Path) -> sp.csr_array:
    if path.suffix.lower() == ".npz":
        return sparse_of(str(path), arrays_of(path))
    try:
        with open(path, encoding="utf-8-sig", errors="replace") as stream:
            return _read(stream)
    except (ValueError, IndexError) as error:
        raise InputError(f"{path} is not a Matrix Market file of real numbers ({error})") from None


def _read(stream: TextIO) -> sp.csr_array:
    """The matrix of a file, whose indices are held against its size: SciPy's own reader does not bear wrong ones."""
    words = stream.readline().lower().split()
    if words[:2] != ["%%matrixmarket", "matrix"] or words[3] not in ("real", "double", "integer"):
        raise ValueError("its first line is not '%%MatrixMarket matrix coordinate real ...'")
    if words[4] not in ("general", "symmetric"):
        raise ValueError(f"it is {words[4]}; general and symmetric matrices are read")
    size = next((line for line in stream if line.strip() and not line.startswith("%")), "")
    if not size:
        raise ValueError("it ends before the size of the matrix")
    rows, columns, *entries = (int(word) for word in size.split())
    if min(rows, columns) < 1 or rows != columns:
        raise ValueError(f"it is {rows} x {columns}; the matrices of a body are square")
    numbers = np.loadtxt(stream, ndmin=2, comments="%")
    return (_coordinate if words[2] == "coordinate" else _dense)(numbers, rows, entries, words[4] == "symmetric")


def _coordinate(numbers: Array, size: int, entries: list[int], symmetric: bool) -> sp.csr_array:
    if numbers.shape != (*entries, 3):
        raise ValueError(f"it has {numbers.shape} numbers where it announces {entries} entries")
    places = numbers[:, :2].astype(np.int64) - 1
    if not ((places >= 0) & (places < size) & (places + 1 == numbers[:, :2])).all():
        raise ValueError(f"an entry stands outside the {size} x {size} matrix")
    check_count(size, "rows of a matrix")
    A = sp.csr_array(sp.coo_array((numbers[:, 2], (places[:, 0], places[:, 1])), shape=(size, size)))
    return sp.csr_array(A + sp.triu(A.T, 1) + sp.tril(A.T, -1)) if symmetric else A


def _dense(numbers: Array, size: int, entries: list[int], symmetric: bool) -> sp.csr_array:
    """By columns; of a symmetric one the lower triangle."""
    if entries or numbers.size != (size * (size + 1) // 2 if symmetric else size * size):
        raise ValueError(f"{numbers.size} numbers do not fill a {size} x {size} matrix")
    if not symmetric:
        return sp.csr_array(numbers.reshape(size, size).T)
    A = np.zeros((size, size))
    A[np.triu_indices(size)] = numbers.ravel()
    return sp.csr_array(A + np.triu(A, 1).T)
