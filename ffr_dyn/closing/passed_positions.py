"""Singular positions that a motion has passed: those of the mechanism, not of the rows that stand for all.

Where rows are redundant some are left out of the motion, and those that are kept may come to depend on one another where the
rows together do not: the mechanism knows nothing of it. So what the steps have passed is looked at with all rows.
"""

from __future__ import annotations

from ffr_dyn.closing.constraints import constraints_of, rows_at
from ffr_dyn.closing.dependent_rows import dependence_at
from ffr_dyn.closing.row_space import Dependence
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.kernels.tables import AT, FIRST_PASSED, LOW, LOW_AT, MOST_PASSED, PASSED, Work
from ffr_prep.common.arrays import Array

FEW = 4.0  # steps
NEARER = 0.2  # least length of a combination of kept rows over that of all: the mechanism is farther from singular


def passed_in_words(system: System, all_rows: System | None, work: Work, step: float) -> list[str]:
    """A note on the singular positions that were passed, or are just being; a few steps [s] apart they are one.

    all_rows : the scene with its redundant rows; None where it has none
    """
    share = work.independence
    count = int(share[PASSED])
    found = dict(enumerate(share[FIRST_PASSED:][: min(count, MOST_PASSED)].tolist()))
    if share[LOW] < AT:
        found[MOST_PASSED] = float(share[LOW_AT])
    if all_rows is not None:
        found = {k: at for k, at in found.items() if _of_all(system, all_rows, at, work.passed[k])}
    times = list(found.values())
    apart = [time for k, time in enumerate(times) if k == 0 or time - times[k - 1] > FEW * step]
    if not apart:
        return []
    more = f" and up to {count - MOST_PASSED} times more" if count > MOST_PASSED else ""
    what = "a singular position" if len(apart) == 1 else "singular positions"
    return [
        f"the motion passes {what} near t = {', '.join(f'{time:.6g}' for time in apart)} s{more}, where constraints become "
        "dependent; it goes on along its branch; rows there are limits of the motion, and what has none, or rests, is nan"
    ]


def _of_all(system: System, all_rows: System, time: float, x: Array) -> bool:
    """Whether all rows come as near to depending on one another, more than they always do, as those of the motion."""
    kept, whole = _dependence(system, time, x), _dependence(all_rows, time, x)
    left_out = all_rows.model.rows.kind.size - system.model.rows.kind.size
    return whole.count > left_out or not kept.least * (kept.count == 0) < NEARER * whole.least


def _dependence(system: System, time: float, x: Array) -> Dependence:
    rows = constraints_of(system.scene, list(system.blocks), time)
    return dependence_at(rows, x, rows_at(rows, x, 0.0 * rows.engine.v).J)
