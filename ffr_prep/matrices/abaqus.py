"""Matrices that Abaqus writes (*MATRIX GENERATE, *MATRIX OUTPUT) with the nodes of the input file.

The text files have lines of node, component, node, component, value (FORMAT=MATRIX INPUT and LABELS), or of row, column,
value (FORMAT=COORDINATE). Of a symmetric matrix one triangle may be there. Coordinate format does not say which row is
which; it is read with the rows in ascending order of nodes, three or six to a node, and the checks of a free body find out
when they are not.

Source: Abaqus Analysis User's Guide, "Generating structural matrices" and "Defining matrices".
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, model_of
from ffr_prep.mesh.abaqus import nodes_from_abaqus

_SUPPORTED = 1e30


def from_abaqus_matrices(stiffness: Path, mass: Path, *last: Path) -> MatrixModel:
    """The model of two matrix files, perhaps one of viscous damping, and an input file, in its unit. Raises InputError for
    files that cannot be used."""
    *damping, deck = last
    labels, points, groups = nodes_from_abaqus(deck)
    table = NodeTable(labels, points, groups)
    entries = {path: _entries(path) for path in (stiffness, mass, *damping)}
    widths = {len(entry[0]) for entry in entries.values()}
    if widths not in ({3}, {5}):
        raise InputError(f"{stiffness} and {mass} are in different formats: write all by one *MATRIX OUTPUT")
    if np.abs(entries[stiffness][:, -1]).max() >= _SUPPORTED:
        raise InputError(
            f"{stiffness} holds stiffnesses of {np.abs(entries[stiffness][:, -1]).max():.0e}, by which Abaqus marks boundary "
            "conditions: remove them, and generate the matrices of the free body"
        )
    source = {"format": "Abaqus"}
    if widths == {3}:
        size = max(_check_numbers(path, entry) for path, entry in entries.items())
        K, M, *C = (_coordinate(entry, size) for entry in entries.values())
        rows, notes = _ascending(deck, table, size), ["rows are taken in ascending order of nodes"]
        return model_of(stiffness, table, rows, K, M, source, notes, *C)
    for path, entry in entries.items():
        _check_labels(path, entry)
    rows, (K, M, *C) = _labelled(list(entries.values()))
    return model_of(stiffness, table, rows, K, M, source, (), *C)


def _entries(path: Path) -> Array:
    """(E, 3 or 5) the lines as numbers."""
    try:
        with open(path, encoding="utf-8-sig", errors="replace") as stream:
            lines = _lines(stream)
            first = next(lines, "")
            entries = np.loadtxt(chain([first], lines), ndmin=2) if first else np.zeros((0, 0))
    except ValueError as error:
        raise InputError(f"{path} is not a matrix that Abaqus writes as text ({error})") from None
    if entries.shape[1] not in (3, 5):
        raise InputError(
            f"{path} is not a matrix that Abaqus writes as text: its lines have {entries.shape[1]} "
            "numbers; use *MATRIX OUTPUT, STIFFNESS, MASS, FORMAT=MATRIX INPUT"
        )
    return entries


def _lines(stream: Iterator[str]) -> Iterator[str]:
    """Without comments and keywords, separated by blanks, with exponents of E."""
    for line in stream:
        if line.strip() and not line.startswith(("*", "%")):
            yield line.replace(",", " ").replace("D", "E").replace("d", "e")


def _check_labels(path: Path, entries: Array) -> None:
    numbers = entries[:, [0, 2]]
    internal = np.unique(numbers[numbers <= 0]).astype(int)
    if internal.size:
        raise InputError(
            f"{path} has {internal.size} internal nodes (the first is {internal[-1]}): Lagrange multipliers of hybrid "
            "elements, connectors, contact or kinematic constraints, or unknowns inside elements. They have no place and no "
            "mass, and multipliers make K indefinite: replace those elements or constraints, and tie regions here, as rigid "
            "or mean interfaces"
        )


def _labelled(parts: list[Array]) -> tuple[Array, list[sp.csr_array]]:
    """Number and component (D, 2) of the rows, ascending, and the matrices."""
    pairs = [entry[:, columns].astype(np.int64) for entry in parts for columns in ((0, 1), (2, 3))]
    rows, places = np.unique(np.vstack(pairs), axis=0, return_inverse=True)
    ends = np.cumsum([len(pair) for pair in pairs])[:-1]
    of = np.split(places.ravel(), ends)
    shape = (len(rows), len(rows))
    places_of = zip(of[::2], of[1::2], strict=True)
    return rows, [
        sp.csr_array(sp.coo_array((entry[:, 4], at), shape=shape)) for entry, at in zip(parts, places_of, strict=True)
    ]


def _check_numbers(path: Path, entries: Array) -> int:
    """The largest row or column of entries in coordinate format."""
    smallest = int(entries[:, :2].min())
    if smallest < 1:
        raise InputError(
            f"{path} has row or column {smallest}: Lagrange multipliers or unknowns inside elements; write it with "
            "FORMAT=MATRIX INPUT to see their nodes"
        )
    return int(entries[:, :2].max())


def _coordinate(entries: Array, size: int) -> sp.csr_array:
    numbers = entries[:, :2].astype(np.int64) - 1
    return sp.csr_array(sp.coo_array((entries[:, 2], tuple(numbers.T)), shape=(size, size)))


def _ascending(deck: Path, table: NodeTable, size: int) -> Array:
    """(D, 2) all nodes in ascending order, with three or six rows each."""
    each, rest = divmod(size, len(table.labels))
    if rest or each not in (3, 6):
        raise InputError(
            f"{deck} has {len(table.labels)} nodes, which do not make {size} rows with three or six to a node: write the "
            "matrices with FORMAT=MATRIX INPUT, which names the rows"
        )
    return np.stack(
        [np.repeat(np.sort(table.labels), each), np.tile(np.arange(1, each + 1), len(table.labels))], axis=1
    )
