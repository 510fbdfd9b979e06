"""Singular positions that a motion has passed: those of the mechanism, not of the rows that stand for all, nor of a step.

Where rows are redundant some are left out of the motion, and those that are kept may come to depend on one another where the
rows together do not: the mechanism knows nothing of it. Nor does it where a long step makes bodies stiff that rows need to
deform. So what the steps have passed is looked at with all rows, and with bodies as they are.
"""

from __future__ import annotations

from collections.abc import Sequence

from ffr_dyn.closing.constraints import Constraints, constraints_of, rows_at
from ffr_dyn.closing.dependent_rows import dependence_at
from ffr_dyn.closing.row_space import Dependence
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.kernels.tables import AT, FIRST_PASSED, LOW, LOW_AT, MOST_PASSED, PASSED, Work
from ffr_prep.common.arrays import Array

FEW = 4.0  # steps
NEARER = 0.2  # least length of a combination of unit rows over that of others: nearer to depending on one another
NEAR, AS_USUAL = 0.03, 0.5  # of rows of length one, what tells of a singular position; of what is usual, what does not


def passed_in_words(
    system: System, blocks: Sequence[Block], ends: Sequence[Array], work: Work, step: float
) -> list[str]:
    """A note on the singular positions that were passed, or are just being; a few steps [s] apart they are one.

    blocks : of all rows, redundant ones among them;  ends : positions (X,) where the motion began and where it is
    """
    share = work.independence
    count = int(share[PASSED])
    found = dict(enumerate(share[FIRST_PASSED:][: min(count, MOST_PASSED)].tolist()))
    if share[LOW] < AT:
        found[MOST_PASSED] = float(share[LOW_AT])
    if found:
        at = float(next(iter(found.values())))  # rows depend on one another by the position alone
        kept, whole = (constraints_of(system.scene, list(some), at) for some in (system.blocks, blocks))
        usual = max(_dependence(whole, x).least for x in ends)
        found = {k: time for k, time in found.items() if _of_all(kept, whole, work.passed[k], usual)}
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


def _of_all(kept: Constraints, whole: Constraints, x: Array, usual: float) -> bool:
    """Whether all rows come nearer to depending on one another than they usually do, and as near as those of the motion."""
    of_all, left_out = _dependence(whole, x), len(whole.numbers) - len(kept.numbers)
    if of_all.count > left_out:
        return True
    if of_all.least > min(AS_USUAL * usual, max(NEARER * usual, NEAR)):
        return False
    of_kept = _dependence(kept, x)
    return not of_kept.least * (of_kept.count == 0) < NEARER * of_all.least


def _dependence(rows: Constraints, x: Array) -> Dependence:
    return dependence_at(rows, x, rows_at(rows, x, 0.0 * rows.engine.v).J)
