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
    """Histories as a MATLAB file: `time`, `units`, and structures by the parts of the names: rod.tip.position."""
    from scipy.io import savemat

    content: dict[str, Any] = {"time": result.time[:, None], "units": {}}
    for name in result.quantities if names is None else names:
        quantity = result.quantity(name)
        _put(content, name, quantity.values)
        _put(content["units"], name, quantity.unit)
    with replacing(path) as part, part.open("wb") as stream:
        savemat(stream, content, long_field_names=True, oned_as="column")
    return path


def _put(tree: dict[str, Any], name: str, value: Any) -> None:
    """At its place in structures of structures; names as MATLAB allows them."""
    *above, last = ("".join(c if c.isalnum() and c.isascii() else "_" for c in part) for part in name.split("."))
    for part in above:
        below = tree.setdefault(_word(part), {})
        if not isinstance(below, dict):
            below = tree[_word(part)] = {"values": below}
        tree = below
    tree[_word(last)] = value


def _word(text: str) -> str:
    return (text if text[:1].isalpha() else f"n{text}")[:63]
