"""Coordinates that follow interfaces, the independent coordinates of a model, and the coordinates of interfaces in them.

Rows are coordinates of nodes, however many a node has. Those that follow a rigid interface are replaced by its six.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import scipy.sparse as sp

from ffr_prep.body.constructors import require_name
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError, require_kind
from ffr_prep.model.coupled import InterfaceRegion


def tied_rows(count: int, free: Array, following: Sequence[tuple[Array, Array]]) -> sp.csr_array:
    """(D, Z) the rows from the independent coordinates: the free rows (f,), then six for each rigid interface.

    following : for each rigid interface the rows (r,) that follow it, and how (r, 6)
    """
    rows, columns, values = [free], [np.arange(free.size)], [np.ones(free.size)]
    for k, (own, motion) in enumerate(following):
        rows.append(np.repeat(own, 6))
        columns.append(np.tile(free.size + 6 * k + np.arange(6), own.size))
        values.append(motion.ravel())
    places = (
        np.concatenate(rows).astype(np.int32),
        np.concatenate(columns).astype(np.int32),
    )  # K takes over their type
    triplets = (np.concatenate(values), places)
    return sp.csr_array(sp.coo_array(triplets, shape=(count, free.size + 6 * len(following))))


def interface_coordinates(
    rigid: Sequence[bool], ties: sp.csr_array, mean_motion: Callable[[int], sp.csr_array]
) -> sp.csr_array:
    """C (6I, Z) of all interfaces in their order, with `mean_motion` (6, D) of those that are not rigid, by number."""
    first = ties.shape[1] - 6 * sum(rigid)
    parts = [sp.csr_array((0, ties.shape[1]))]
    for k, follows in enumerate(rigid):
        if follows:
            parts.append(sp.eye_array(6, ties.shape[1], k=first, format="csr"))
            first += 6
        else:
            parts.append(mean_motion(k) @ ties)
    return sp.csr_array(sp.vstack(parts, format="csr"))


def six_rows(motion: Array, columns: Array, size: int) -> sp.csr_array:
    """(6, size) with motion (6, c) in these columns (c,)."""
    ends = columns.size * np.arange(7)
    return sp.csr_array((motion.ravel(), np.tile(columns, 6), ends), shape=(6, size))


def check_names(interfaces: Sequence[InterfaceRegion]) -> None:
    """Raises InputError for texts in the place of interfaces, for names that no quantity could carry, and repeated ones."""
    require_kind(interfaces, Iterable, "interfaces", "a list of InterfaceRegion(name)")
    texts = [interface for interface in interfaces if isinstance(interface, str)]
    if texts:
        raise InputError(f"interface {texts[0]!r} is a text; write InterfaceRegion({texts[0]!r})")
    names = [interface.name for interface in interfaces]
    for name in names:
        require_name("interface", name)
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InputError(f"interface name {repeated[0]!r} is given more than once: every interface needs its own name")
