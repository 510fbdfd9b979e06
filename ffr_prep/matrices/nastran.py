"""Matrices of Nastran: OUTPUT4 files with the bulk data, or OP2 files, of the g-set (KGG, MGG, and BGG of dampers).

Needs pyNastran, an optional extra. Rows follow the internal sequence of the grid points: six for a grid point, one for a
scalar point; scalar points must have neither stiffness nor mass. KAA and MAA are taken when they have as many rows as the
g-set; where supports, rigid elements or omitted coordinates made them smaller, their rows are not known from these files:
ask for KGG and MGG (PARAM,POST or DMAP), or give a table of rows (see `ffr_prep.matrices.matrix_market`).

Source: MSC Nastran Quick Reference Guide (OUTPUT4, PARAM POST); MSC Nastran DMAP Programmer's Guide (data blocks BGPDT,
EQEXIN, GPDT).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, mirrored, model_of
from ffr_prep.mesh.left_out import left_out_of_nastran

_SETS = (("KGG", "MGG", "BGG"), ("KAA", "MAA", "BAA"))  # stiffness, mass and, optional, viscous damping
_GRID, _SCALAR = 1, 2


@dataclass(frozen=True)
class GridTable:
    """The points of the g-set in internal sequence.

    labels : (P,) numbers; kinds : (P,) 1 for grid points, 2 for scalar points
    points : (P, 3) in basic coordinates; systems : (P,) coordinate system of the displacements (CD)
    groups : name -> numbers of grid points
    """

    labels: Array
    kinds: Array
    points: Array
    systems: Array
    groups: Mapping[str, Array]


def from_op4(matrices: Path, deck: Path) -> MatrixModel:
    """The model of an OUTPUT4 file and its bulk data, in the unit of the files.

    Raises InputError without pyNastran and for files that cannot be used.
    """
    with _reading(matrices):
        from pyNastran.op4.op4 import read_op4

        found = read_op4(str(matrices), debug=False)
    with _reading(deck):
        from pyNastran.bdf.bdf import read_bdf

        bulk = read_bdf(str(deck), punch=_is_punch(deck), debug=None)
    return model_of_nastran(matrices, found, grids_of_deck(bulk), {"format": "Nastran OP4"}, rigid_of_deck(bulk))


def from_op2(path: Path) -> MatrixModel:
    """The model of an OP2 file with matrices and tables of the grid points, in the unit of the file.

    Raises InputError without pyNastran and for a file that cannot be used.
    """
    with _reading(path):
        from pyNastran.op2.op2 import read_op2

        results = read_op2(str(path), debug=None)
    return model_of_nastran(path, results.matrices, grids_of_op2(path, results), {"format": "Nastran OP2"})


def model_of_nastran(
    path: Path, found: Mapping[str, Any], grids: GridTable, source: Mapping[str, Any], notes: Sequence[str] = ()
) -> MatrixModel:
    """The model of matrices by name, as pyNastran holds them in `data`, and the points of the g-set."""
    names = _names(path, found)
    for name in names:
        if isinstance(found[name].data, list):
            raise InputError(f"{path} holds {name} {len(found[name].data)} times; write one model to a file")
    matrices = tuple(sp.csr_array(found[name].data) for name in names)
    widths = np.where(grids.kinds == _GRID, 6, 1)
    if {A.shape[0] for A in matrices} != {int(widths.sum())}:
        sizes = ", ".join(f"{name} has {A.shape[0]} rows" for name, A in zip(names, matrices, strict=True))
        raise InputError(
            f"{path}: {sizes}, but the {len(widths)} points have "
            f"{widths.sum()} degrees of freedom: write KGG and MGG of this model, before supports and reductions"
        )
    _check_systems(path, grids)
    of_grids = np.repeat(grids.kinds == _GRID, widths)
    _check_scalar_points(
        path, grids, np.repeat(grids.labels, widths), of_grids, (mirrored("K", matrices[0])[0], *matrices[1:])
    )
    grid = grids.kinds == _GRID
    labels = grids.labels[grid]
    rows = np.stack([np.repeat(labels, 6), np.tile(np.arange(1, 7), len(labels))], axis=1)
    kept = np.flatnonzero(of_grids)
    table = NodeTable(labels, grids.points[grid], grids.groups)
    K, M, *C = (A[kept][:, kept] for A in matrices)
    left = ["K4GG, the structural damping, is left out: give a loss factor"] if "K4GG" in found else []
    return model_of(path, table, rows, K, M, {**source, "matrices": ", ".join(names)}, [*left, *notes], *C)


# ---- points -------------------------------------------------------------------------------------------------------


def grids_of_deck(deck: Any) -> GridTable:
    """The points of bulk data as pyNastran holds them: ascending numbers, sets SET1 as groups."""
    labels = np.array(sorted([*deck.nodes, *deck.spoints]), np.int64)
    is_grid = np.array([label in deck.nodes for label in labels.tolist()], bool)
    points, systems = np.full((len(labels), 3), np.nan), np.zeros(len(labels), np.int64)
    for k in np.flatnonzero(is_grid):
        node = deck.nodes[int(labels[k])]
        points[k], systems[k] = node.get_position(), node.Cd()
    sets = {
        f"set_{number}": np.array(one.get_ids(), np.int64) for number, one in deck.sets.items() if one.type == "SET1"
    }
    groups = {name: of for name, of in sets.items() if np.isin(of, labels[is_grid]).all()}
    return GridTable(labels, np.where(is_grid, _GRID, _SCALAR), points, systems, groups)


def rigid_of_deck(deck: Any) -> tuple[str, ...]:
    """A note on rigid elements and multi-point constraints of bulk data as pyNastran holds them: Nastran eliminates their
    nodes after KGG, which knows nothing of them."""
    found = Counter(one.type for one in deck.rigid_elements.values())
    found.update(MPC=len(deck.mpcs))
    return left_out_of_nastran(+found)


def grids_of_op2(path: Path, results: Any) -> GridTable:
    """The points of the tables EQEXIN and BGPDT (or GPDT, in basic coordinates) of an OP2 file.

    Raises InputError without them, or when they do not fit each other.
    """
    tables = results.op2_results
    numbers = getattr(tables, "eqexin", None)
    places = getattr(tables, "bgpdt", None) or getattr(tables, "gpdt", None)
    if numbers is None or places is None:
        raise InputError(
            f"{path} lacks the table {'EQEXIN' if numbers is None else 'BGPDT'}, which says where the rows are: write it "
            "(PARAM,POST,-1 does), or give the matrices as .op4 with the bulk data"
        )
    columns = np.asarray(places.nid_cp_cd_ps)
    columns = columns.reshape(len(columns), -1)
    xyz = _as_floats(np.asarray(places.xyz))
    if columns.shape[1] >= 3 and columns[:, 1].any():
        raise InputError(f"{path} has its points in local coordinates only (GPDT); write BGPDT, or give the bulk data")
    if len(xyz) != len(numbers.nid):
        raise InputError(f"{path}: EQEXIN has {len(numbers.nid)} points, BGPDT {len(xyz)}: write one model to a file")
    order = np.argsort(np.asarray(numbers.dof), kind="stable")
    return GridTable(
        labels=np.asarray(numbers.nid, np.int64)[order],
        kinds=np.asarray(numbers.doftype, np.int64)[order],
        points=xyz,
        systems=np.maximum(columns[:, 2 if columns.shape[1] >= 3 else 0], 0).astype(np.int64),
        groups={},
    )


def _as_floats(xyz: Array) -> Array:
    """(P, 3). pyNastran returns the bits of single-precision coordinates as integers, in some versions, and rows of double
    precision with two columns of integers before the coordinates, read as numbers."""
    numbers = np.array(xyz.view(np.float32) if xyz.dtype == np.int32 else xyz, float)
    return numbers.reshape(len(numbers), -1)[:, -3:]


def _is_punch(deck: Path) -> bool:
    """Whether the file is bulk data alone, without executive and case control."""
    return "BEGIN BULK" not in " ".join(deck.read_text(encoding="latin-1").upper().split())


# ---- guards -------------------------------------------------------------------------------------------------------


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Says that pyNastran is missing, or that it cannot read the file."""
    try:
        yield
    except ImportError:
        raise InputError(
            "reading Nastran matrices needs pyNastran, which is not installed: pip install 'ffr[nastran]' (it may need "
            "NumPy 1.26), or write K and M to .npz elsewhere, by pyNastran and scipy.sparse.save_npz"
        ) from None
    except Exception as error:  # the reader raises whatever its parsers meet
        if isinstance(error, AttributeError) and "module 'numpy'" in str(error):
            raise InputError(
                f"the pyNastran that is installed does not work with NumPy {np.__version__} ({error}): install both in an "
                "environment of their own (pip install pyNastran brings a NumPy that fits), and write K and M to .npz there, "
                "by pyNastran and scipy.sparse.save_npz"
            ) from None
        raise InputError(f"pyNastran cannot read {path} ({type(error).__name__}: {error})") from None


def _names(path: Path, found: Mapping[str, Any]) -> tuple[str, ...]:
    for names in _SETS:
        if all(name in found for name in names[:2]):
            return names if names[2] in found else names[:2]
    raise InputError(
        f"{path} holds {', '.join(sorted(found)) or 'no matrices'}; it must hold KGG and MGG (or KAA and MAA)"
    )


def _check_systems(path: Path, grids: GridTable) -> None:
    local = np.flatnonzero((grids.systems != 0) & (grids.kinds == _GRID))
    if local.size:
        raise InputError(
            f"{path}: the displacements of grid point {grids.labels[local[0]]} are in coordinate system "
            f"{grids.systems[local[0]]} ({local.size} such points): set their CD to 0, so that all rows are in basic axes"
        )


def _check_scalar_points(
    path: Path, grids: GridTable, label_of: Array, of_grids: Array, matrices: tuple[sp.csr_array, ...]
) -> None:
    for row in np.flatnonzero(~of_grids):
        if any(abs(A[[row]]).sum() > 0 for A in matrices):
            raise InputError(
                f"{path}: scalar point {label_of[row]} has stiffness or mass; it has no place in a body: replace it by grid "
                "points, or take modal coordinates out"
            )
