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

import numpy as np
import scipy.io
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, model_of
from ffr_prep.matrices.npz import arrays_of, sparse_of


def from_matrix_market(stiffness: Path, mass: Path, rows: Path) -> MatrixModel:
    """The model of two matrices and a table, in the unit of the files. Raises InputError for files that cannot be used."""
    table, dofs = read_rows(rows)
    return model_of(rows, table, dofs, _matrix(stiffness), _matrix(mass), {"format": "Matrix Market"})


def read_rows(path: Path) -> tuple[NodeTable, Array]:
    """The nodes, and number and component (D, 2) of each row."""
    lines = list(csv.reader(path.read_text(encoding="utf-8-sig", errors="replace").splitlines()))
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
        return sp.csr_array(scipy.io.mmread(path))
    except Exception as error:  # the reader raises whatever its parser meets
        raise InputError(f"{path} is not a Matrix Market file ({error})") from None
