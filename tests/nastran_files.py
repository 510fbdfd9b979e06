"""OP2 files as Nastran writes them with PARAM,POST,-1: matrices of the g-set with the tables of the grid points.

A file is a sequence of Fortran records. A record of data is preceded by one that holds its length in words; tables and
their parts are counted by negative markers. Source: MSC Nastran DMAP Programmer's Guide (OUTPUT2, data blocks BGPDT,
EQEXIN and matrices).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ffr_prep.matrices.model import MatrixModel


def write_op2(model: MatrixModel, path: Path, *, wide: bool = True) -> Path:
    """The matrices KGG and MGG and the tables EQEXIN and BGPDT (wide: with coordinates of double precision)."""
    parts = [_header(), _eqexin(model.labels), _bgpdt(model, wide)]
    parts += [_matrix(101 + k, name, A) for k, (name, A) in enumerate((("KGG", model.K), ("MGG", model.M)))]
    path.write_bytes(b"".join([*parts, _markers(0)]))
    return path


def _record(data: bytes) -> bytes:
    length = np.int32(len(data)).tobytes()
    return length + data + length


def _markers(*values: int) -> bytes:
    return b"".join(_record(np.int32(value).tobytes()) for value in values)


def _data(data: bytes) -> bytes:
    return _markers(len(data) // 4) + _record(data)


def _ints(*values: int) -> bytes:
    return np.array(values, np.int32).tobytes()


def _header() -> bytes:
    tape = _markers(7) + _record(b"NASTRAN FORT TAPE ID CODE - ")
    return _data(_ints(1, 1, 20)) + tape + _markers(2) + _record(b"XXXXXXXX") + _markers(-1, 0)


def _table(name: str, trailer: bytes, *parts: bytes) -> bytes:
    title = name.ljust(8).encode()
    head = _data(title) + _markers(-1) + _data(trailer) + _markers(-2, 1, 0) + _data(title + _ints(0))
    body = [_markers(-3 - k, 1, 0) + _data(part) for k, part in enumerate(parts)]
    return b"".join([head, *body, _markers(-3 - len(parts), 1, 0, 0)])


def _eqexin(labels: np.ndarray) -> bytes:
    """External numbers with their place, and with ten times their first row and one, which says grid point."""
    order = np.argsort(labels)
    places = np.stack([labels[order], order + 1], axis=1)
    rows = np.stack([labels[order], 10 * (6 * order + 1) + 1], axis=1)
    return _table("EQEXINS", _ints(101, len(labels), 0, 0, 0, 0, 0), *(_ints(*part.ravel()) for part in (places, rows)))


def _bgpdt(model: MatrixModel, wide: bool) -> bytes:
    count = len(model.labels)
    if wide:
        fields = [("int", np.int32, 6), ("xyz", np.float64, 3)]
        points = np.zeros(count, np.dtype(fields))
        points["int"] = [(0, 6 * k + 1, label, 61, 0, 0) for k, label in enumerate(model.labels.tolist())]
    else:
        points = np.zeros(count, np.dtype([("cd", np.int32), ("xyz", np.float32, 3)]))
    points["xyz"] = model.points
    return _table("BGPDTS", _ints(105, count, 0, 0, 0, 0, 0), points.tobytes())


def _matrix(number: int, name: str, A: sp.csr_array) -> bytes:
    """Symmetric, double precision: for each column the runs of entries that are not zero."""
    columns = sp.csc_array(A)
    columns.sort_indices()
    longest = int(np.diff(columns.indptr).max())
    title = name.ljust(8).encode()
    parts = [_data(title), _markers(-1), _data(_ints(number, A.shape[1], A.shape[0], 6, 2, 2 * longest, 1000))]
    parts += [_markers(-2, 1, 0), _data(title + _ints(170, 170))]
    for k in range(A.shape[1]):
        own = slice(*columns.indptr[k : k + 2])
        parts += [_markers(-3 - k, 1, 1), *_strings(columns.indices[own], columns.data[own])]
    parts.append(_markers(-3 - A.shape[1], 1, 0, 0))
    return b"".join(parts)


def _strings(rows: np.ndarray, values: np.ndarray) -> Iterator[bytes]:
    for run in np.split(np.arange(rows.size), np.flatnonzero(np.diff(rows) > 1) + 1):
        if run.size:
            yield _markers(2 * run.size) + _record(_ints(rows[run[0]] + 1) + values[run].tobytes())
