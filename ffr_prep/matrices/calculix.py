"""Matrices that CalculiX writes (*FREQUENCY, SOLVER=MATRIXSTORAGE) with the nodes of the input file.

JOB.sti and JOB.mas have a line of row, column, value for each entry of the upper triangles; line k of JOB.dof says in the
form node.direction what row k is.

Source: CalculiX CrunchiX User's Manual, version 2.20, *FREQUENCY; files that this version wrote.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_count, read_text
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, model_of
from ffr_prep.mesh.abaqus import nodes_from_abaqus


def from_calculix(stiffness: Path, mass: Path, rows: Path, deck: Path) -> MatrixModel:
    """The model of two matrix files, the file of rows and an input file, in its unit. Raises InputError for files that
    cannot be used."""
    dofs = _dofs(rows)
    K, M = (_matrix(path, len(dofs)) for path in (stiffness, mass))
    table = NodeTable(*nodes_from_abaqus(deck))
    return model_of(rows, table, dofs, K, M, {"format": "CalculiX"})


def _dofs(path: Path) -> Array:
    """(D, 2) number of the node and component of each row."""
    found = []
    for number, line in enumerate(read_text(path, "a list of rows").splitlines(), 1):
        node, point, direction = line.strip().partition(".")
        if not (node.isdecimal() and point and direction in ("1", "2", "3")) or len(node) > 18:
            raise InputError(
                f"{path}, line {number}: {line.strip()[:40]!r} is not node.direction, as CalculiX writes it"
            )
        found.append((int(node), int(direction)))
    return np.array(found, np.int64).reshape(-1, 2)


def _matrix(path: Path, size: int) -> sp.csr_array:
    check_count(size, "rows of a matrix")
    try:
        entries = np.loadtxt(path, ndmin=2)
    except ValueError as error:
        raise InputError(f"{path} is not a matrix that CalculiX writes ({error})") from None
    if entries.shape[1] != 3:
        raise InputError(f"{path} has {entries.shape[1]} numbers to a line; CalculiX writes row, column and value")
    places = np.clip(entries[:, :2], -1, size + 1).astype(np.int64)
    if not ((places == entries[:, :2]) & (places >= 1) & (places <= size)).all():
        raise InputError(f"{path} has entries outside the {size} rows that the .dof file lists: take files of one job")
    return sp.csr_array(sp.coo_array((entries[:, 2], tuple(places.T - 1)), shape=(size, size)))
