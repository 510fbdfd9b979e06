"""Geometric stiffening: K_sigma(t) q from the current accelerations, rates, applied loads and reactions.

K_sigma is a sum of constant matrices times loads, and the loads contain the accelerations and multipliers that are being
solved for. They enter by fixed-point iteration: each sweep solves the equations with the stiffening of the last one. The
change from sweep to sweep is of the order (elastic deflection / size)^2.

Within a step the first guess is extrapolated from the same stages of the steps before, right to third order in the step. One
sweep that begins with it is right to that order, times the small factor above: none of the methods loses its order. More
follow where the guess turns out poor, as after an impact. Where that factor is very small even less has to be done in every
stage: see `ffr_dyn.kernels.ahead`.
"""

from ffr_dyn.kernels.ahead import (
    BEARABLE,
    COUNT,
    IN_USE,
    PAUSE,
    SETTLED,
    add_to_means,
    begin_step,
    give_up,
    keep_start,
    loads_as_expected,
    stiffen_ahead,
    stiffen_by_expected,
    take_up,
)
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.packing import call_unit
from ffr_dyn.kernels.stiffness import find_loads, multiply_stiffness, rate_loads, sum_stiffness
from ffr_dyn.kernels.tables import ASIDE, MOTION, RELATIVE, STAGES, WATCH
from ffr_dyn.kernels.vectors import add_scaled, copy, get
from ffr_dyn.kernels.views import part

SWEEPS = 4  # at most
# By what the forces may change in a sweep, relative to those of the body with most, for it to be the last: one that begins
# with a guess after steps of equal length, and any other.
ENOUGH, STRICT = 3e-2, 1e-8
REPEATED = 4  # steps of equal length before a guess is one of third order


@kernel
def keep_unstiffened(bodies, w):
    """Elastic right-hand sides without stiffening, and the loads by the rates of all stiffened bodies; w: BodyWork."""
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, 0], bodies.where[b, 3]
        if bodies.where[b, 6] > 0:
            copy(part(w.unstiffened, e, n), part(w.f, bodies.where[b, 2] + 6, n))
            rate_loads(get(w.omega, b), w.load[b])


@kernel
def renew_stiffness(bodies, w, x, b):
    """w.stiff of body b by its loads. Returns the squares of its length and of its change."""
    n = bodies.where[b, 0]
    stiff, found, force, change = part(w.stiff, bodies.where[b, 3], n), part(w.scratch, 0, n), 0.0, 0.0
    sum_stiffness(bodies, w, w.load[b], b)
    multiply_stiffness(bodies, w, b, part(x, bodies.where[b, 1] + 7, n), found)
    for k in range(n):
        force += found[k] * found[k]
        change += (found[k] - stiff[k]) * (found[k] - stiff[k])
        stiff[k] = found[k]
    return force, change


@kernel
def stiffen(bodies, w):
    """f = unstiffened - K_sigma q, elastic rows of all stiffened bodies."""
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, 0], bodies.where[b, 3]
        if bodies.where[b, 6] > 0:
            add_scaled(part(w.f, bodies.where[b, 2] + 6, n), part(w.unstiffened, e, n), -1.0, part(w.stiff, e, n))


@inlined
def guess_stiffening(w, stage):
    """w.stiff from the last solution and what stage number `stage` added to the one before in three steps."""
    stiff, last = w.stiff, w.last
    one, two, three = w.change[stage], w.change[STAGES + stage], w.change[2 * STAGES + stage]
    for k in range(stiff.size):
        stiff[k] = last[k] + 3.0 * (one[k] - two[k]) + three[k]


@inlined
def keep_change(w, stage):
    """What the solution at stage number `stage` added to the one before."""
    one, two, three = w.change[stage], w.change[STAGES + stage], w.change[2 * STAGES + stage]
    for k in range(w.stiff.size):
        three[k], two[k], one[k] = two[k], one[k], w.stiff[k] - w.last[k]


@inlined
def is_settled(r, w, stage):
    """Whether the last steps were of the length of this one."""
    h, steady = r.clock.time[0], w.steady
    if steady[0] != h:
        steady[0], steady[1] = h, -1.0
    if steady[1] < 0.0 or stage <= steady[2]:
        steady[1] += 1.0
    steady[2] = stage
    return steady[1] >= REPEATED


@inlined
def solve_so(r, w, x, target):
    """Motion, multipliers and loads with the forces w.stiff."""
    stiffen(r.model.bodies, w)
    call_unit(r.units[MOTION], r.address, 0.0, x.ctypes.data, target.ctypes.data)
    find_loads(r, w)


@inlined
def sweep(r, w, x, target, enough, most):
    """Solve until the forces change by less than enough. Returns the square of the feedback, by what a change changes them
    again; -1 where there was but one."""
    bodies, feedback, before = r.model.bodies, -1.0, 0.0
    for number in range(most):
        solve_so(r, w, x, target)
        greatest, change = 0.0, 0.0
        for b in range(bodies.mass.size):
            if bodies.where[b, 6] > 0:
                force, moved = renew_stiffness(bodies, w, x, b)
                greatest, change = max(greatest, force), max(change, moved)
        if number == 1:
            feedback = change / before
        if change <= enough * enough * greatest:
            break
        before = change
    return feedback


@inlined
def solve_start_ahead(r, w, x, target):
    """The first stage of a step as in `ahead`. Returns whether that can be, for it and the stages to come."""
    bodies, ahead = r.model.bodies, w.ahead
    if not begin_step(r, w):
        return False
    stiffen_by_expected(bodies, w, x)
    keep_start(bodies, w, x)
    if ahead[COUNT] < SETTLED:
        return False
    solve_so(r, w, x, target)
    if not loads_as_expected(bodies, w):
        give_up(w)
        return False
    if (ahead[COUNT] - SETTLED) % WATCH == 0.0:
        if sweep(r, w, x, target, STRICT, 2) > ahead[BEARABLE]:
            give_up(w)
            return False
        stiffen_by_expected(bodies, w, x)
        solve_so(r, w, x, target)
    ahead[IN_USE] = 1.0
    return True


@inlined
def solve_stiffened(r, x, target, stage):
    """`solve_motion` with the geometric stiffening of the bodies that have it.

    stage : number of a step's stage, from 0; AGAIN: near the last solution; ASIDE: so, and nothing is kept of it
    """
    bodies, w = r.model.bodies, r.work.bodies
    if stage > 0 and w.ahead[IN_USE] > 0.0:
        stiffen_ahead(bodies, w, x)
        call_unit(r.units[MOTION], r.address, 0.0, x.ctypes.data, target.ctypes.data)
        find_loads(r, w)
        add_to_means(bodies, w)
        return
    keep_unstiffened(bodies, w)
    allowed, enough = w.ahead[BEARABLE] > 0.0, STRICT
    if stage == 0 and allowed and solve_start_ahead(r, w, x, target):
        add_to_means(bodies, w)
        copy(w.last, w.stiff)
        w.steady[1] = -1.0
        return
    if stage < 0:
        copy(w.stiff, w.last)
    else:
        guess_stiffening(w, stage)
        if is_settled(r, w, stage):
            enough = ENOUGH
        elif r.control.numbers.size > 0:
            enough = r.control.numbers[RELATIVE]
    if stage == 0 and w.ahead[COUNT] <= -w.ahead[PAUSE]:
        take_up(w, sweep(r, w, x, target, STRICT, SWEEPS))
    else:
        sweep(r, w, x, target, enough, SWEEPS)
    if stage >= 0:
        keep_change(w, stage)
        if allowed:
            add_to_means(bodies, w)
    if stage != ASIDE:
        copy(w.last, w.stiff)
