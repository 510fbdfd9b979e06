"""Results as files of other programs: ParaView (VTKHDF, PVD with VTU), glTF, MATLAB, tables."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from ffr_dyn.results.result import Result, write_csv
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import replacing

# By suffix: the module and function that writes it, and what it is.
WRITERS = {
    ".vtkhdf": ("ffr_dyn.pictures.vtk_files", "write_vtkhdf", "ParaView: one mesh, displacements and stress over time"),
    ".pvd": (
        "ffr_dyn.pictures.vtk_files",
        "write_pvd",
        "ParaView and others: a .vtu file for each row, in a folder beside",
    ),
    ".glb": ("ffr_dyn.pictures.gltf", "write_glb", "glTF: moving bodies for Blender, slides, web pages"),
    ".mat": ("ffr_dyn.pictures.export", "write_mat", "MATLAB: all histories as one structure"),
    ".csv": ("ffr_dyn.pictures.export", "write_table", "spreadsheets: all histories, a column each"),
}

_LONGEST = 63  # letters of a name in MATLAB
_KEYWORDS = (  # of MATLAB
    *("break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if"),
    *("otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while"),
)


def export(result: Result, path: str | Path, names: Iterable[str] | None = None) -> Path:
    """Write a result in the format of another program, by the suffix of the path.

    path  : .vtkhdf (ParaView 5.12 or later), .pvd (with .vtu files in a folder of its name), .glb (glTF 2.0), .mat, .csv
    names : of .mat and .csv, the quantities that are written; all when not given

    In VTKHDF the mesh stands where the undeformed bodies are at the first row; `displacement` (global axes, [m]) leads from
    there to where they are at a time, `elastic` is the deformation alone; `von_mises` [Pa] is there where a body has stress
    modes. An existing file is replaced only by a complete new one.
    Raises InputError for another suffix, unknown names, or names where they have no meaning.

    Example: ``fd.export(result, "out/motion.vtkhdf")``

    >>> fd.export(result, "motion.vtkhdf")
    """
    path = Path(path)
    if path.suffix.lower() not in WRITERS:
        raise InputError(
            f"{path}: results are exported as {', '.join(WRITERS)}, not {path.suffix or 'without a suffix'}"
        )
    module, function, _ = WRITERS[path.suffix.lower()]
    write: Callable[..., Path] = getattr(importlib.import_module(module), function)
    if path.suffix.lower() in (".mat", ".csv"):
        return write(result, path, names)
    if names is not None:
        raise InputError(f"{path}: names of quantities are of .mat and .csv files; this one holds what is drawn")
    return write(result, path)


def write_table(result: Result, path: Path, names: Iterable[str] | None) -> Path:
    """All histories as comma-separated values; see `write_csv`."""
    return write_csv(result, path, names)


def write_mat(result: Result, path: Path, names: Iterable[str] | None) -> Path:
    """Histories as a MATLAB file: `time`, `units`, and structures by the parts of the names: rod.tip.position.

    Raises InputError where two names are one in MATLAB, of which the file could hold one alone.
    """
    from scipy.io import savemat

    content: dict[str, Any] = {"time": result.time[:, None], "units": {}}
    taken: dict[tuple[str, ...], str] = {}
    for name in result.quantities if names is None else names:
        quantity, place = result.quantity(name), _place(name)
        _check_place(path, name, place, taken)
        _put(content, place, quantity.values)
        _put(content["units"], place, quantity.unit)
    with replacing(path) as part, part.open("wb") as stream:
        savemat(stream, content, long_field_names=True, oned_as="column")
    return path


def _place(name: str) -> tuple[str, ...]:
    """Where a quantity stands in structures of structures, by names that MATLAB takes: letters, digits and "_", a letter
    first, at most 63 of them, no keyword."""
    words = ("".join(c if c.isalnum() and c.isascii() else "_" for c in part) for part in name.split("."))
    begun = (f"n{word}" if not word[:1].isalpha() or word in _KEYWORDS else word for word in words)
    return tuple(word[:_LONGEST] for word in begun)


def _check_place(path: Path, name: str, place: tuple[str, ...], taken: dict[tuple[str, ...], str]) -> None:
    """InputError for a place that another name has."""
    for k in range(1, len(place) + 1):
        owner = ".".join(name.split(".")[:k])
        other = "the units of all quantities" if place[0] == "units" else taken.setdefault(place[:k], owner)
        if other != owner:
            raise InputError(
                f"{path}: {owner!r} would be {'.'.join(place[:k])!r} in MATLAB, as {other!r} is; export one of them, by "
                f"names such as {owner + '.*'!r}, or rename one in the scene"
            )


def _put(tree: dict[str, Any], place: tuple[str, ...], value: Any) -> None:
    """At its place; what has a value and parts has the value among its parts."""
    *above, last = place
    for word in above:
        below = tree.setdefault(word, {})
        if not isinstance(below, dict):
            below = tree[word] = {"values": below}
        tree = below
    if isinstance(tree.get(last), dict):
        tree[last]["values"] = value
    else:
        tree[last] = value
