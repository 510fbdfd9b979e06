"""Whether what grows from next to nothing follows a function of time, as a pulse that sets in softly.

exp(-((t - a) / w)**2) and 1 / (1 + exp((a - t) / w)) begin below rounding and grow through all decades, and so does what
they move. An unstable motion grows by itself, whatever they do: its size over theirs changes as much as it does.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ffr_dyn.compile.scene_tables import System, given_at
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array

LOOKS = 400  # rows at most at which functions are evaluated, while something grows and of the whole run
EARLY = 1e-13, 1e-3  # of what an output comes to: the sizes from which to which it is looked at
FOLLOWS = 0.3  # of the decades that an output grows through there: by which its size over the function's may change
MOST = 10, 90  # percent of rows, between which the others may tremble


def not_led(run: Result, system: System, x: Array, v: Array, grown: Mapping[str, float]) -> dict[str, float]:
    """Those of the outputs that have grown, and by how much, that no function of time leads.

    x, v : the state at the start, at which functions of the state are looked at over time
    """
    if not grown:
        return {}
    sizes = {name: _sizes(run[name]).max(axis=1) for name in grown}
    least = max(int(np.count_nonzero(size < EARLY[1] * size[-1])) for size in sizes.values())
    ends = least, run.time.size - 1
    rows = np.unique(np.concatenate([np.linspace(0, end, LOOKS).round().astype(int) for end in ends]))
    try:
        given = [given_at(system, float(t), x, v).values() for t in run.time[rows]]
    except Exception:  # whatever a function of the user raises at a state that is not of its time
        return dict(grown)
    leads = _sizes(np.array([np.concatenate([*of, np.zeros(0)]) for of in given]))
    leads = leads[:, np.isfinite(leads).all(axis=0) & (leads[-1] > 0)]
    return {name: size for name, size in grown.items() if not _is_led(sizes[name][rows], leads)}


def _sizes(values: Array) -> Array:
    """(T, k) how far numbers (T, ...) have come from where they began, at most so far."""
    table = values.reshape(len(values), -1)
    found: Array = np.maximum.accumulate(np.abs(table - table[:1]), axis=0)
    return found


def _is_led(size: Array, leads: Array) -> bool:
    """Whether a size (T,) goes with one of others (T, F) while it is small beside what it comes to."""
    least, most = (share * size[-1] for share in EARLY)
    early = (size > least) & (size < most)
    if np.count_nonzero(early) < 2 or not leads.size:
        return False
    own = np.log(size[early])
    beside = own[:, None] - np.log(np.maximum(leads[early], np.finfo(float).tiny))
    low, high = np.percentile(beside, MOST, axis=0)
    return bool((high - low).min() <= FOLLOWS * np.subtract(*np.percentile(own, MOST[::-1])))
