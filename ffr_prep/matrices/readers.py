"""Reading matrix models: which reader takes which files.

MODEL.npz                          everything in one file (`ffr_prep.matrices.npz`)
K.mtx M.mtx DOFS.csv               Matrix Market, or scipy.sparse.save_npz (`ffr_prep.matrices.matrix_market`)
STIF.mtx MASS.mtx MODEL.inp        Abaqus (`ffr_prep.matrices.abaqus`)
MATRICES.op4 MODEL.bdf, MODEL.op2  Nastran (`ffr_prep.matrices.nastran`)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import UNIT_SYSTEMS, MatrixModel, in_si

_NASTRAN_DECKS = (".bdf", ".dat", ".nas")


FILES = "MODEL.npz; K.mtx M.mtx DOFS.csv; STIF.mtx MASS.mtx MODEL.inp; MATRICES.op4 MODEL.bdf; or MODEL.op2"


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
        from ffr_prep.matrices.npz import from_npz

        return from_npz(paths[0])
    if len(kinds) == 3 and set(kinds[:2]) <= {".mtx", ".npz"} and kinds[2] == ".csv":
        from ffr_prep.matrices.matrix_market import from_matrix_market

        return from_matrix_market(*paths)
    if len(kinds) == 3 and set(kinds[:2]) == {".mtx"} and kinds[2] == ".inp":
        from ffr_prep.matrices.abaqus import from_abaqus_matrices

        return from_abaqus_matrices(*paths)
    if kinds == (".op2",):
        from ffr_prep.matrices.nastran import from_op2

        return from_op2(paths[0])
    if len(kinds) == 2 and kinds[0] == ".op4" and kinds[1] in _NASTRAN_DECKS:
        from ffr_prep.matrices.nastran import from_op4

        return from_op4(*paths)
    raise InputError(f"these are not files of a matrix model: {', '.join(map(str, paths))}; give {FILES}")
