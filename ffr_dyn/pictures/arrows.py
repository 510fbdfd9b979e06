"""Arrows of forces and moments in pictures: which are asked for, and where they begin and end at the times of a film."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ffr_dyn.pictures.connections import ArrowShown, Connections, SpreadShown
from ffr_dyn.pictures.film import Film
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice


def loads_named(beside: Connections, names: Iterable[str]) -> frozenset[str]:
    """The names of the loads that some words mean: joints, forces, motors ("hinge"), one load ("hinge.moment"), patterns
    ("*").

    Raises InputError for a word that means none, with those that there are.
    """
    words: dict[str, list[str]] = {}
    for load in beside.loads:
        for word in (load.name, load.of):
            words.setdefault(word, []).append(load.name)
    found: set[str] = set()
    for name in names:
        hits = [load for word, loads in words.items() if fnmatch.fnmatchcase(word, name) for load in loads]
        if not hits:
            known = dict.fromkeys(load.of for load in beside.loads)
            hint = choice(name, known) if known else "the result recorded no force and no moment that acts"
            raise InputError(f"there is no arrow for {name!r}; {hint}")
        found.update(hits)
    return frozenset(found)


def with_arrows(film: Film, beside: Connections, rows: Array, names: Iterable[str]) -> Film:
    """The film with the arrows of the loads that are named; beside: those of all rows (T,) [s], between which they are
    interpolated."""
    wanted = loads_named(beside, names)
    drawn = [
        (load, _ends(load, length, rows, film.times))
        for load, length in beside.lengths(film.size)
        if load.name in wanted
    ]
    if not drawn:
        return film
    reach = np.concatenate([film.corners, *(ends.reshape(-1, 3) for _, ends in drawn)])
    none = np.zeros((film.times.size, 0, 2, 3))
    moments, forces = (
        np.concatenate([none, *(ends for load, ends in drawn if (load.unit == "N m") is turns)], axis=1)
        for turns in (True, False)
    )
    return replace(film, forces=forces, moments=moments, low=reach.min(axis=0), high=reach.max(axis=0))


def _ends(load: ArrowShown | SpreadShown, length: float, rows: Array, times: Array) -> Array:
    """(F, N, 2, 3) [m] where the arrows of a load begin and end, one of a unit being drawn with a length [m]."""
    after = np.clip(np.searchsorted(rows, times), 1, max(rows.size - 1, 1))
    before = after - 1 if rows.size > 1 else after * 0
    after = np.minimum(after, rows.size - 1)
    span = np.where(rows[after] > rows[before], rows[after] - rows[before], 1.0)
    share = np.clip((times - rows[before]) / span, 0.0, 1.0)[:, None, None, None]
    known = {k: np.stack(load.ends(k, length), axis=1) for k in {*before.tolist(), *after.tolist()}}
    first, last = (np.array([known[k] for k in of.tolist()]) for of in (before, after))
    return np.asarray(first + share * (last - first))
