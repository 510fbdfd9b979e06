"""Matrix models in one .npz file of NumPy: the format to write when nothing else fits.

labels      (N,)   numbers of the nodes; optional, 1 ... N without it
points      (N, 3) their coordinates
dofs        (D, 2) number of the node and component 1 ... 6 of each row
K, M        (D, D) dense; or sparse as scipy.sparse.save_npz stores it, under K/data, K/indices, K/indptr, K/shape,
            K/format ("csr" or "csc"), or K/data, K/row, K/col, K/shape for "coo"; the same for M
C           (D, D) viscous damping, likewise; optional
group/NAME  (m,)   numbers of the nodes of a group; optional
triangles   (T, 3) numbers of nodes, a surface to draw; optional
units       text   such as "mm-t-s"; optional
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import save_arrays
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.stored_arrays import read_arrays
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.node_table import NodeTable, model_of

_GROUP = "group/"


def from_npz(path: Path) -> MatrixModel:
    """The model of a .npz file, in the unit of the file. Raises InputError for one that cannot be used."""
    arrays = arrays_of(path)
    missing = [key for key in ("points", "dofs") if key not in arrays]
    if missing:
        raise InputError(f"{path} has no array {missing[0]!r}; it holds {', '.join(map(repr, sorted(arrays)))}")
    points, rows = np.array(arrays["points"], float), np.array(arrays["dofs"])
    if rows.ndim != 2 or rows.shape[1] != 2 or rows.dtype.kind not in "iu":
        raise InputError(f"{path}: 'dofs' has the shape {rows.shape} and type {rows.dtype}; it must be (D, 2) integers")
    table = NodeTable(
        labels=np.array(arrays.get("labels", np.arange(1, len(points) + 1)), np.int64),
        points=points,
        groups={key.removeprefix(_GROUP): arrays[key] for key in sorted(arrays) if key.startswith(_GROUP)},
        triangles=arrays.get("triangles"),
    )
    source = {"format": "npz"} | ({"units": str(arrays["units"])} if "units" in arrays else {})
    C = _matrix(path, arrays, "C") if any(key == "C" or key.startswith("C/") for key in arrays) else None
    return model_of(path, table, rows, _matrix(path, arrays, "K"), _matrix(path, arrays, "M"), source, C=C)


def save_matrices(model: MatrixModel, path: str | Path) -> Path:
    """Write a model to a .npz file in SI units, atomically.

    Raises InputError for a path that is a folder or a link, ComputationError where the file cannot be written.

    >>> fp.save_matrices(model, "part.npz")
    """
    path = Path(path)
    arrays = {
        "labels": model.labels,
        "points": model.points,
        "dofs": np.stack([model.labels[model.nodes], model.components + 1], axis=1),
        "units": np.array("m-kg-s"),
        **{_GROUP + name: model.labels[of] for name, of in model.groups.items()},
    }
    for name, A in model.matrices.items():
        parts = {"data": A.data, "indices": A.indices, "indptr": A.indptr, "shape": A.shape, "format": "csr"}
        arrays |= {f"{name}/{key}": np.array(part) for key, part in parts.items()}
    if model.triangles is not None:
        arrays["triangles"] = model.labels[model.triangles]
    return save_arrays(arrays, path)


_ADVICE = "write it with numpy.savez or scipy.sparse.save_npz"


def arrays_of(path: Path) -> dict[str, Array]:
    """The arrays of a .npz file by name; InputError for a file that is none."""
    if not zipfile.is_zipfile(path):
        raise InputError(f"{path} is damaged or not a .npz file; {_ADVICE}")
    try:
        with open(path, "rb") as stream:
            return read_arrays(stream)
    except Exception as error:  # a damaged zip or array header can fail in any way the readers know
        raise InputError(f"{path} is damaged or not a .npz file ({error}); {_ADVICE}") from None


def _matrix(path: Path, arrays: Mapping[str, Array], name: str) -> sp.csr_array:
    """A dense array or the members of a sparse one."""
    if name in arrays:
        dense = arrays[name]
        if dense.ndim != 2:
            raise InputError(f"{path}: {name} has the shape {dense.shape}; it must be (D, D)")
        return sp.csr_array(dense)
    parts = {key.removeprefix(f"{name}/"): value for key, value in arrays.items() if key.startswith(f"{name}/")}
    return sparse_of(f"{path}: {name}", parts)


def sparse_of(what: str, parts: Mapping[str, Array]) -> sp.csr_array:
    """The sparse matrix of members as scipy.sparse.save_npz names them."""
    try:
        shape = tuple(parts["shape"].tolist())
        if "row" in parts:
            return sp.csr_array(sp.coo_array((parts["data"], (parts["row"], parts["col"])), shape=shape))
        text = parts["format"].item() if "format" in parts else "csr"
        kind = {"csr": sp.csr_array, "csc": sp.csc_array}[text.decode() if isinstance(text, bytes) else str(text)]
        A = kind((parts["data"], parts["indices"], parts["indptr"]), shape=shape)
        A.check_format(full_check=True)
        return sp.csr_array(A)
    except KeyError as error:
        raise InputError(
            f"{what} has no {error.args[0]!r}; store csr, csc or coo as scipy.sparse.save_npz does"
        ) from None
    except (ValueError, TypeError) as error:
        raise InputError(f"{what} cannot be put together ({error})") from None
