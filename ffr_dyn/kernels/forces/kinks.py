"""Steps that end where the motion comes to a kink of a force, as where a stop is met, fully entered, or left.

A step over a kink errs by where within it the kink lies, which is chance: whatever the order of the method, two steps agree
or not by accident, and what they differ by tells little of what they err by. So a step that has passed a kink is done again
in pieces, the first of which ends there. The cubic through coordinates and rates at both ends of the step tells where. A
piece that passes the kink by more than a small part of a step is done again, shorter; after one that ends before it the next
looks again.

A kink is where  a + b x + c x_dot + d x x_dot  changes its sign; x is a coordinate of the force.

Twin: the statement above, held by
`tests/ffr_dyn/integrators/test_steps_at_kinks.py::test_a_method_keeps_its_order_over_an_impact`.
"""

from ffr_dyn.kernels.forces.bushing import measure_six
from ffr_dyn.kernels.forces.coordinate import coordinate_of
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.tables import MEASURED, OK, RESTART, SIX, WAY, H
from ffr_dyn.kernels.vectors import copy

AT_KINK = 1e-4  # of a step: a kink so near to an end is there
LOOKS = 8  # parts of a step in which a kink is looked for
HALVINGS = 20  # of such a part
PIECES, TRIES = 40, 4  # at most: pieces of a step, and trials of one

BEFORE, BEHIND = 0, 2  # columns of `LoadWork.passing`


@inlined
def measure_kinks(r, column):
    """Keep coordinates and rates of forces that have kinks, from the markers."""
    loads, work = r.model.loads, r.work.loads
    value, rate, before = 0.0, 0.0, -1
    for number in range(len(loads.kinked)):
        k, own = loads.kinked[number, 0], loads.kinked[number, 1]
        six, at = loads.row[k, WAY] == SIX, loads.row[k, MEASURED]
        if k != before and six:
            measure_six(r, k)
        elif k != before:
            value, rate, _ = coordinate_of(r, k)
        before = k
        work.passing[number, column] = work.measured[at + own] if six else value
        work.passing[number, column + 1] = work.measured[at + own + 6] if six else rate


@kernel
def beyond_kink(kink, ends, span, s):
    """Whether a kink lies behind at the time s of a step of length `span`, of the cubic through (x, x_dot) at both ends."""
    x0, rate0, x1, rate1 = ends[BEFORE], ends[BEFORE + 1], ends[BEHIND], ends[BEHIND + 1]
    slope = (x1 - x0) / span
    bend, twist = (3.0 * slope - 2.0 * rate0 - rate1) / span, (rate0 + rate1 - 2.0 * slope) / (span * span)
    x, rate = x0 + s * (rate0 + s * (bend + s * twist)), rate0 + s * (2.0 * bend + 3.0 * s * twist)
    return kink[0] + kink[1] * x + kink[2] * rate + kink[3] * x * rate > 0.0


@kernel
def first_kink(loads, passing, span, near):
    """When the motion comes to a kink first, farther than `near` from both ends of a step of length `span`; or `span`."""
    first = span
    for number in range(len(loads.kinked)):
        kink, ends = loads.kinks[number], passing[number]
        before, part = near, (span - 2.0 * near) / LOOKS
        beyond = beyond_kink(kink, ends, span, before)
        for look in range(1, LOOKS + 1):
            behind = near + look * part
            if not behind - part < first:
                break
            if beyond_kink(kink, ends, span, behind) != beyond:
                for _ in range(HALVINGS):
                    middle = 0.5 * (before + behind)
                    if beyond_kink(kink, ends, span, middle) != beyond:
                        behind = middle
                    else:
                        before = middle
                first = min(first, behind)
                break
            before = behind
    return first


@kernel
def keep_end(passing):
    """The end of a piece is the start of the next one."""
    for number in range(passing.shape[0]):
        for k in range(2):
            passing[number, BEFORE + k] = passing[number, BEHIND + k]


@inlined
def step_to_kinks(r, pieces, measure, close, t, again):
    """One step from time t in pieces that end at kinks of forces; `pieces` does one of any length. Returns a status.

    As at breaks of functions of time, what steps have left the constraints by is closed before a short piece would.
    """
    time, begun = r.clock.time, r.work.loads
    h = time[H]
    now, end, near = t, t + h, AT_KINK * h
    status, number = measure(r, BEFORE), 0
    while status == OK and now < end:
        copy(begun.x, r.x)
        copy(begun.v, r.v)
        span, tries = end - now, 0
        while status == OK:
            time[H] = span
            status = pieces(r, now, again)
            if status == OK:
                status = measure(r, BEHIND)
            kink = span
            if status == OK and span > 2.0 * near and tries < TRIES and number < PIECES:
                kink = first_kink(r.model.loads, begun.passing, span, near)
            if not kink < span:
                break
            copy(r.x, begun.x)
            copy(r.v, begun.v)
            if number == 0 and tries == 0:
                status = close(r, now)
                copy(begun.x, r.x)
                copy(begun.v, r.v)
            span, tries, again = kink, tries + 1, RESTART
        now = end if span == end - now else now + span
        if status == OK and now < end:
            status = close(r, now)
        number += 1
        keep_end(begun.passing)
    time[H] = h
    return status
