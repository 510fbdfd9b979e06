"""The formats that matrix models are read from, one entry each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import Registry, Target


@dataclass(frozen=True)
class MatrixFormat:
    """Files that make a matrix model together.

    name     : the files as one writes them after `ffr-prep reduce-matrices`
    suffixes : of each file, in their order, those that it may have, in lower case
    read     : function, or "package.module:function", of the paths that returns a `MatrixModel` in the unit of the files
    help     : whose files they are

    >>> entry = fp.MatrixFormat("own", ((".own",),), read="own:read", help="K and M of own.")
    """

    name: str
    suffixes: tuple[tuple[str, ...], ...]
    read: Target
    help: str


_ROOM = "ffr_prep.matrices"
MATRIX_FORMATS: Registry[MatrixFormat] = Registry(
    "matrix format",
    (
        MatrixFormat(
            "MODEL.npz", ((".npz",),), f"{_ROOM}.npz:from_npz", "everything in one file: points, dofs, K, M, groups"
        ),
        MatrixFormat(
            "K.mtx M.mtx DOFS.csv",
            ((".mtx", ".npz"), (".mtx", ".npz"), (".csv",)),
            f"{_ROOM}.matrix_market:from_matrix_market",
            "Matrix Market (or scipy's save_npz) and a line node,component,x,y,z for each row",
        ),
        MatrixFormat(
            "K.mtx M.mtx C.mtx DOFS.csv",
            ((".mtx", ".npz"), (".mtx", ".npz"), (".mtx", ".npz"), (".csv",)),
            f"{_ROOM}.matrix_market:from_matrix_market",
            "the same with viscous damping",
        ),
        MatrixFormat(
            "STIF.mtx MASS.mtx MODEL.inp",
            ((".mtx",), (".mtx",), (".inp",)),
            f"{_ROOM}.abaqus:from_abaqus_matrices",
            "Abaqus, *MATRIX OUTPUT, STIFFNESS, MASS; the nodes and node sets of the input file",
        ),
        MatrixFormat(
            "STIF.mtx MASS.mtx DMPV.mtx MODEL.inp",
            ((".mtx",), (".mtx",), (".mtx",), (".inp",)),
            f"{_ROOM}.abaqus:from_abaqus_matrices",
            "Abaqus, with VISCOUS DAMPING, which dashpots and Rayleigh's damping make",
        ),
        MatrixFormat(
            "JOB.sti JOB.mas JOB.dof JOB.inp",
            ((".sti",), (".mas",), (".dof",), (".inp",)),
            f"{_ROOM}.calculix:from_calculix",
            "CalculiX, *FREQUENCY, SOLVER=MATRIXSTORAGE without *BOUNDARY; the nodes and node sets of the input file",
        ),
        MatrixFormat(
            "MATRICES.op4 MODEL.bdf",
            ((".op4",), (".bdf", ".dat", ".nas")),
            f"{_ROOM}.nastran:from_op4",
            "Nastran, KGG, MGG and, where it is there, BGG (pip install 'ffr[nastran]')",
        ),
        MatrixFormat(
            "MATRICES.pch MODEL.bdf",
            ((".pch",), (".bdf", ".dat", ".nas", ".fem")),
            f"{_ROOM}.dmig:from_dmig",
            "Nastran and OptiStruct, punched as DMIG: KAAX, MAAX and, where it is there, BAAX",
        ),
        MatrixFormat(
            "MODEL.op2",
            ((".op2",),),
            f"{_ROOM}.nastran:from_op2",
            "Nastran, with BGPDT and EQEXIN (pip install 'ffr[nastran]')",
        ),
    ),
)


def register_matrix_format(entry: MatrixFormat) -> None:
    """Offer a format to `read_matrices`, and so to the command line. Raises InputError for a name that is taken.

    >>> fp.register_matrix_format(fp.MatrixFormat("own", ((".own",),), "own:read", "K and M of own."))
    """
    MATRIX_FORMATS.register(entry)


def format_of(paths: Sequence[Path]) -> MatrixFormat:
    """The format of these files by their suffixes, the last that takes them; InputError lists what there is."""
    given = [path.suffix.lower() for path in paths]
    found = [
        entry
        for entry in MATRIX_FORMATS
        if len(entry.suffixes) == len(given) and all(one in of for one, of in zip(given, entry.suffixes, strict=True))
    ]
    if not found:
        known = "; ".join(entry.name for entry in MATRIX_FORMATS)
        raise InputError(f"these are not files of a matrix model: {', '.join(map(str, paths))}; give {known}")
    return found[-1]
