"""Reading matrix models."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.common.registry import loaded
from ffr_prep.matrices.formats import format_of
from ffr_prep.matrices.model import MatrixModel, in_si
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS


def read_matrices(files: Sequence[str | Path], *, units: str | None = None) -> MatrixModel:
    """The model of one or several files, in SI units.

    units : of the numbers in the files, a name in UNIT_SYSTEMS; m-kg-s when not given and the file says nothing

    Raises InputError for files that cannot be used or do not fit each other.

    >>> model = fp.read_matrices(["part.npz"])
    """
    paths = [Path(file) for file in files]
    if units is not None and units not in UNIT_SYSTEMS:
        raise InputError(f"units {units!r} are not known; they are {', '.join(UNIT_SYSTEMS)}")
    with ExitStack() as doors:
        for path in paths:
            doors.enter_context(reading(path, "a matrix file"))
        model: MatrixModel = loaded(format_of(paths).read)(*paths)
    declared = units or model.source.get("units") or "m-kg-s"
    if declared not in UNIT_SYSTEMS:
        raise InputError(f"{paths[0]} declares the units {declared!r}; they must be one of {', '.join(UNIT_SYSTEMS)}")
    source = {**model.source, "files": [path.name for path in paths], "units": declared}
    return in_si(replace(model, source=source), UNIT_SYSTEMS[declared])
