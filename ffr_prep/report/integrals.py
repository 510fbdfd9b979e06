"""The inertia integrals by the names of the books: a table of them, and each in full."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import FlexibleBody
from ffr_prep.body.file import save_arrays
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice

if TYPE_CHECKING:
    from ffr_prep.structures.nodal_integrals import NodalIntegrals

    Source = FlexibleBody | NodalIntegrals

_PAIRS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}
_MEANING = {
    "I1": ("mass", "kg"),
    "I2": ("int u0 dm", "kg m"),
    "I3": ("int Phi dm", "kg^(1/2)"),
    "I4": ("int u0 x phi_j dm", "m kg^(1/2)"),
    "I5": ("int phi_i x phi_j dm", "-"),
    "I6": ("int Phi^T Phi dm", "-"),
    "I7": ("int u0~^T u0~ dm", "kg m^2"),
    "I8": ("int u0~ phi_j~ dm", "m kg^(1/2)"),
    "I9": ("int phi_i~ phi_j~ dm", "-"),
    "S_bar": ("int S dm = I3", "kg^(1/2)"),
    **{f"S_bar_{kl}": (f"int S_{kl[0]}^T S_{kl[1]} dm", "-") for kl in _PAIRS},
    **{f"N_bar_{kl}": (f"S_bar_{kl} - S_bar_{kl}^T", "-") for kl in ("xy", "yz", "zx")},
    "S_bar_ff": ("S_bar_xx + S_bar_yy + S_bar_zz = I6", "-"),
}
NAMES = tuple(_MEANING)
_MOST_COORDINATES = 1200  # of which arrays of all pairs are still shown or kept in full


def integral(source: Source, name: str) -> Any:
    """An integral by its name, of `NAMES`: an array, a sparse matrix, or several of those."""
    if name not in _MEANING:
        raise InputError(f"there is no integral {name!r}; {choice(name, _MEANING)}")
    kind, _, pair = name.rpartition("_")
    if pair in _PAIRS:
        return (source.S_bar_kl if kind == "S_bar" else source.N_bar_kl)(*_PAIRS[pair])
    return getattr(source, name)


def integral_lines(source: Source) -> Iterator[str]:
    """A table of all: name, shape, the largest entry, unit, meaning. Units of nodal coordinates differ by entry."""
    nodal = not isinstance(source, FlexibleBody)
    yield "integrals   name       shape               largest entry"
    for name, (meaning, unit) in _MEANING.items():
        value = integral(source, name)
        shape = "x".join(map(str, _shape(value))) or "number"
        said = (
            meaning.replace("phi", "N").replace("Phi", "N").replace("S_", "N_") if nodal and name[0] == "I" else meaning
        )
        yield f"{'':12}{name:9}  {shape:16}{_largest(value):17.6g} {'SI' if nodal else unit:11}  {said}"


def term_lines(source: Source, names: Sequence[str]) -> Iterator[str]:
    """The named integrals in full, of "all" every one."""
    for name in chosen(names):
        value = in_full(source, name)
        yield f"{name}  {'x'.join(map(str, value.shape)) or 'number'}  {_MEANING[name][0]}"
        for at in np.ndindex(value.shape[:-2]):
            if at:
                yield f"  [{', '.join(str(k + 1) for k in at)}]"
            yield from _rows(np.atleast_2d(value[at]))


def save_terms(source: Source, names: Sequence[str], path: Path) -> Path:
    """The named integrals as arrays of an .npz file."""
    return save_arrays({name: in_full(source, name) for name in chosen(names)}, path)


def chosen(names: Sequence[str]) -> tuple[str, ...]:
    """The names, where "all" stands for every one; InputError for one that does not exist."""
    unknown = [name for name in names if name not in (*NAMES, "all")]
    if unknown:
        raise InputError(f"there is no integral {unknown[0]!r}; {choice(unknown[0], {**_MEANING, 'all': ''})}")
    return NAMES if "all" in names else tuple(dict.fromkeys(names))


def in_full(source: Source, name: str) -> Array:
    """The integral as one array of the shape that it has for a body; InputError for pairs of too many nodal coordinates."""
    value = integral(source, name)
    if max(_shape(value), default=0) > _MOST_COORDINATES and not isinstance(value, np.ndarray):
        raise InputError(
            f"{name} has {_shape(value)[-1]} rows and columns; take the sparse matrices from Python (fp.nodal_integrals)"
        )
    whole = _dense(value)
    return whole.transpose(2, 3, 0, 1) if name == "I9" and isinstance(value, tuple) else whole


def _dense(value: Any) -> Array:
    if isinstance(value, tuple):
        return np.stack([_dense(part) for part in value])
    return value.toarray() if sp.issparse(value) else np.asarray(value, float)


def _shape(value: Any) -> tuple[int, ...]:
    return (len(value), *_shape(value[0])) if isinstance(value, tuple) else np.shape(value)


def _largest(value: Any) -> float:
    if isinstance(value, tuple):
        return max(_largest(part) for part in value)
    return float(np.abs(value.data if sp.issparse(value) else value).max(initial=0.0))


def _rows(matrix: Array) -> Iterator[str]:
    for row in matrix:
        yield "  " + " ".join(f"{x:13.6g}" for x in row)
