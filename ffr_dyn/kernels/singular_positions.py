"""Singular positions are stepped over.

Where constraints become dependent the accelerations along what is about to be free are a quotient of two numbers that vanish
with the distance, and a stage that is evaluated there takes rounding and its own error for motion: within 1e-5 of a step's
length digits are lost, within 1e-8 the motion is thrown off. No distance is safe and none needs to be: a position is
singular at a moment, and stages can lie on both sides of it. So a step with a stage beside one is undone together with the
step before, and both are done again in three steps of other lengths, none of which is longer.

Twin: the statement above, held by
`tests/ffr_dyn/kernels/test_dyn_singular.py::test_steps_that_end_or_have_a_stage_beside_a_singular_position_keep_branch_and_energy`.
"""

from ffr_dyn.kernels.options import inlined
from ffr_dyn.kernels.tables import (
    AT_LAST,
    AT_START,
    CLOSEST,
    END,
    FIRST_PASSED,
    HERE,
    HIGH,
    LEAST,
    LOW,
    LOW_AT,
    MOST_PASSED,
    NEXT,
    OK,
    PASSED,
    SPACING,
    START,
    TOLERANCE,
    WHEN,
    H,
)
from ffr_dyn.kernels.vectors import copy

# A stage is beside a singular position when the independence of the rows there (the square of a distance) is below BESIDE,
# and below CLOSER of what it was where the step began, or, for the start itself, the step before: at a tenth of the distance.
BESIDE, CLOSER = 1e-4, 0.01
# Of two steps in three, tried until all stages are farther off than a twentieth of the way from where they begin.
LENGTHS = (
    *(0.8, 0.8, 0.4),
    *(0.5, 1.0, 0.5),
    *(1.0, 0.7, 0.3),
)
ENOUGH = 0.25 * CLOSER
PASSED_BELOW = (
    1e-3  # independence that tells of a singular position (the square of a distance), in a dip of so many times:
)
DIP = 100.0
STAGES_END = 0.95  # of a step: what lies behind belongs to the next one


@inlined
def note_independence(share, t):
    """Keep the independence of rows that have been evaluated at time t."""
    if share[HERE] < share[LEAST]:
        share[LEAST], share[WHEN] = share[HERE], t
    note_passing(share, t)
    if t == share[START]:
        share[AT_START] = share[HERE]
    if t <= share[END]:
        share[CLOSEST] = min(share[CLOSEST], share[HERE])


@inlined
def note_passing(share, t):
    """Keep the time t of the least independence between two high ones: a singular position that was passed."""
    here, low = share[HERE], share[LOW]
    if here > DIP * low:
        if low < PASSED_BELOW and share[HIGH] > DIP * low:
            number = int(share[PASSED])
            if number < MOST_PASSED:
                share[FIRST_PASSED + number] = share[LOW_AT]
            share[PASSED] += 1.0
        share[HIGH], share[LOW] = here, here
    elif here < low:
        share[LOW], share[LOW_AT] = here, t
    share[HIGH] = max(share[HIGH], here)


@inlined
def keep_closest(share, positions, passed, t, x):
    """Keep the position x of an evaluation at time t where it is the closest to a singular one so far; for good where that
    has been passed, after so many that were `passed` before it."""
    if positions.shape[0] > 0:
        if share[PASSED] > passed and passed < MOST_PASSED:
            copy(positions[int(passed)], positions[MOST_PASSED])
        if share[LOW_AT] == t:
            copy(positions[MOST_PASSED], x)


@inlined
def is_beside(share, before):
    return share < BESIDE and share < CLOSER * before


@inlined
def step_from(r, step, t, h):
    """One step from time t. Returns a status."""
    share = r.work.independence
    share[START], share[END], r.clock.time[H] = t, t + STAGES_END * h, h
    return step(r, t, 0)


@inlined
def numbered_step(r, step, t):
    """The engine's next step, from time t; `step` is the entry point. Returns a status."""
    share, h = r.work.independence, r.clock.time[SPACING]
    if r.stages.kept_x.shape[0] == 0 or r.clock.gains[TOLERANCE] == 0.0:
        return step(r, t, 0)
    own, before = r.clock.steps[NEXT] % 2, share[AT_LAST]
    copy(r.stages.kept_x[own], r.x)
    copy(r.stages.kept_v[own], r.v)
    share[AT_START], share[CLOSEST] = 0.0, 1.0
    status = step_from(r, step, t, h)
    share[AT_LAST] = share[AT_START]
    if before > 0.0 and (is_beside(share[AT_START], before) or is_beside(share[CLOSEST], share[AT_START])):
        share[AT_LAST] = 0.0
        for first in range(0, 9, 3):
            status = two_steps_again(r, step, t - h, h, 1 - own, first)
            if status == OK and share[CLOSEST] > ENOUGH * before:
                break
        if status != OK:
            copy(r.x, r.stages.kept_x[own])
            copy(r.v, r.stages.kept_v[own])
            status = step_from(r, step, t, h)
    r.clock.time[H] = h
    return status


@inlined
def two_steps_again(r, step, t, h, kept, first):
    """Two steps of length h from time t and a kept state, in three of lengths from `first`. Returns a status."""
    copy(r.x, r.stages.kept_x[kept])
    copy(r.v, r.stages.kept_v[kept])
    r.work.independence[CLOSEST] = 1.0
    status = OK
    for k in range(first, first + 3):
        if status == OK:
            status = step_from(r, step, t, LENGTHS[k] * h)
        t += LENGTHS[k] * h
    return status
