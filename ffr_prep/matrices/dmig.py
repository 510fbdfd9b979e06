"""Matrices of Nastran and OptiStruct as they are punched: DMIG entries (`.pch`), with the grid points of the bulk data.

A matrix has a header (form, type) and an entry for each column: the grid point and component of the column, then grid point,
component and value of each row. Of a symmetric one (form 6) a triangle is given. K and M are taken whose names differ by the
first letter alone, as KAAX and MAAX of EXTSEOUT and PARAM,EXTOUT,DMIGPCH, or K2GG and M2GG; with them the viscous damping,
of the same name with B. The rows are those of the a-set, so that a model that was condensed to its boundary is one, too.

Source: MSC Nastran Quick Reference Guide (DMIG, EXTSEOUT); Altair OptiStruct Reference Guide (PARAM,EXTOUT; DMIG).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, model_of
from ffr_prep.mesh.bulk_data import Card, cards
from ffr_prep.mesh.nastran import grids_of_nastran

_HEADER = "0"  # in the place of the column's grid point
_SQUARE, _SYMMETRIC = 1, 6
_REAL = (1, 2)
_COMPONENTS = range(1, 7)

Row = tuple[int, int]  # grid point and component


@dataclass
class _Punched:
    """A matrix as it comes: its form, and value by row and column."""

    form: int
    rows: list[Row] = field(default_factory=list)
    columns: list[Row] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def from_dmig(matrices: Path, deck: Path) -> MatrixModel:
    """The model of a punched file and its bulk data, in the unit of the files. Raises InputError for files that cannot be
    used."""
    try:
        found = _punched(matrices)
        names = _names(found)
        for name in names:
            _check(name, found[name])
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(matrices)) else f"{matrices}: {text}") from None
    rows = sorted({row for name in names for row in (*found[name].rows, *found[name].columns)})
    index = {row: k for k, row in enumerate(rows)}
    K, M, *C = (_sparse(found[name], index) for name in names)
    left = [name for name in found if name not in names]
    notes = [f"{', '.join(left)} left out: stiffness, mass and viscous damping are taken"] if left else []
    source = {"format": "Nastran DMIG", "matrices": ", ".join(names)}
    return model_of(matrices, _table(deck, rows), np.array(rows, np.int64).reshape(-1, 2), K, M, source, notes, *C)


def _punched(path: Path) -> dict[str, _Punched]:
    """The matrices of a file by name."""
    found: dict[str, _Punched] = {}
    for card in cards(path):
        if card.name != "DMIG":
            continue
        name = card.text(1).upper()
        if card.text(2) == _HEADER:
            if name in found:
                raise InputError(f"{card} begins twice; write one model to a file")
            if card.integer(4, 1) not in _REAL:
                raise InputError(f"{card} has complex numbers (type {card.text(4)}); real ones are read (1 or 2)")
            found[name] = _Punched(card.integer(3))
        elif name not in found:
            raise InputError(f"{card} has a column before its header (DMIG, {name}, 0, ...)")
        else:
            _take_column(card, found[name])
    return found


def _take_column(card: Card, matrix: _Punched) -> None:
    column = card.integer(2), card.integer(3, 0)
    for first in range(5, len(card.fields) + 1, 4):
        if card.text(first):
            matrix.rows.append((card.integer(first), card.integer(first + 1, 0)))
            matrix.columns.append(column)
            matrix.values.append(card.real(first + 2, 0.0))


def _names(found: Mapping[str, _Punched]) -> list[str]:
    """Of stiffness, mass and, where it is there, viscous damping."""
    pairs = [(name, f"M{name[1:]}") for name in found if name[:1] == "K" and f"M{name[1:]}" in found]
    if len(pairs) != 1:
        known = ", ".join(found) or "no matrices"
        raise InputError(
            f"it holds {known}; it must hold one stiffness and one mass by DMIG whose names differ by their first letter "
            "alone, such as KAAX and MAAX"
        )
    damping = f"B{pairs[0][0][1:]}"
    return [*pairs[0], *([damping] if damping in found else [])]


def _check(name: str, matrix: _Punched) -> None:
    if matrix.form not in (_SQUARE, _SYMMETRIC):
        raise InputError(f"{name} is of the form {matrix.form}; a square matrix (1) or a symmetric one (6) is needed")
    for number, component in (*matrix.rows, *matrix.columns):
        if component not in _COMPONENTS:
            raise InputError(
                f"{name} has the row {number}, component {component}: that of a scalar point, as component modes have. A "
                "body takes grid points alone: write the matrices without modes (no QSET, SPOINT or EIGRL for them)"
            )


def _sparse(matrix: _Punched, index: Mapping[Row, int]) -> sp.csr_array:
    places = [index[row] for row in matrix.rows], [index[column] for column in matrix.columns]
    return sp.csr_array(sp.coo_array((matrix.values, places), shape=(len(index), len(index))))


def _table(deck: Path, rows: list[Row]) -> NodeTable:
    """The grid points that have rows, with the sets of nodes among them."""
    grids = grids_of_nastran(deck)
    used = np.unique(np.array([number for number, _ in rows], np.int64))
    local = [k for k in np.flatnonzero(np.isin(grids.labels, used)) if grids.systems[k] != 0]
    if local:
        raise InputError(
            f"{deck}: the displacements of GRID {grids.labels[local[0]]} are in coordinate system "
            f"{grids.systems[local[0]]} ({len(local)} such points): set their CD to 0, so that all rows are in basic axes"
        )
    known = np.isin(grids.labels, used)
    groups: dict[str, Array] = {name: of for name, of in grids.groups.items() if np.isin(of, used).all()}
    return NodeTable(grids.labels[known], grids.points[known], groups)
