"""Geometric stiffening: K_sigma(t) q from the current accelerations, rates, applied loads and reactions.

K_sigma is a sum of constant matrices times loads, and the loads contain the accelerations and multipliers that are being
solved for. They enter by fixed-point iteration: each sweep solves the equations with the stiffening of the last one. The
change from sweep to sweep is of the order (elastic deflection / size)^2.

Within a step the first guess is extrapolated from the same stages of the steps before, right to third order in the step. One
sweep that begins with it is right to that order, times the small factor above: none of the methods loses its order. More
follow where the guess turns out poor, as after an impact. Where that factor is very small even less has to be done in every
stage: see `ffr_dyn.kernels.stiffening.ahead`.

Twin: `ffr_dyn.equations.stiffening.geometric_stiffening`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.stiffening.ahead import (
    BEARABLE,
    COUNT,
    IN_USE,
    LENGTH,
    PAUSE,
    SETTLED,
    add_to_means,
    give_up,
    loads_as_expected,
    stiffen_ahead,
    take_up,
)
from ffr_dyn.kernels.stiffening.stiffness import find_loads, multiply_stiffness, rate_loads, sum_stiffness
from ffr_dyn.kernels.tables import ASIDE, IN_Q, IN_V, IN_X, K_SIZE, RELATIVE, STAGES, WATCH, H, N
from ffr_dyn.kernels.vectors import add_scaled, copy, get

SWEEPS = 4  # at most
LAST_STAGE = 2  # number of `w.steady`, after LENGTH and COUNT
# By what the forces may change in a sweep, relative to those of the body with most, for it to be the last: one that begins
# with a guess after steps of equal length, and any other.
ENOUGH, STRICT = 3e-2, 1e-8
ROUGH = 0.1  # by what, likewise, forces without sweeps may be off where that is looked at
REPEATED = 4  # steps of equal length before a guess is one of third order


@kernel
def keep_unstiffened(bodies, w):
    """Elastic right-hand sides without stiffening, and the loads by the rates of all stiffened bodies; w: BodyWork."""
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, N], bodies.where[b, IN_Q]
        if bodies.where[b, K_SIZE] > 0:
            copy(part(w.unstiffened, e, n), part(w.f, bodies.where[b, IN_V] + 6, n))
            rate_loads(get(w.omega, b), w.load[b])


@kernel
def renew_stiffness(bodies, w, x, b):
    """w.stiff of body b by its loads. Returns the squares of its length and of its change."""
    n = bodies.where[b, N]
    stiff, found, force, change = part(w.stiff, bodies.where[b, IN_Q], n), part(w.scratch, 0, n), 0.0, 0.0
    sum_stiffness(bodies, w, w.load[b], b)
    multiply_stiffness(bodies, w, b, part(x, bodies.where[b, IN_X] + 7, n), found)
    for k in range(n):
        force += found[k] * found[k]
        change += (found[k] - stiff[k]) * (found[k] - stiff[k])
        stiff[k] = found[k]
    return force, change


@kernel
def stiffen(bodies, w):
    """f = unstiffened - K_sigma q, elastic rows of all stiffened bodies."""
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, N], bodies.where[b, IN_Q]
        if bodies.where[b, K_SIZE] > 0:
            add_scaled(part(w.f, bodies.where[b, IN_V] + 6, n), part(w.unstiffened, e, n), -1.0, part(w.stiff, e, n))


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
    h, steady = r.clock.time[H], w.steady
    if steady[LENGTH] != h:
        steady[LENGTH], steady[COUNT] = h, -1.0
    if steady[COUNT] < 0.0 or stage <= steady[LAST_STAGE]:
        steady[COUNT] += 1.0
    steady[LAST_STAGE] = stage
    return steady[COUNT] >= REPEATED


@inlined
def first_guess(r, w, stage):
    """w.stiff to begin with. Returns by what it may be off."""
    if stage < 0:
        copy(w.stiff, w.last)
        return STRICT
    guess_stiffening(w, stage)
    if is_settled(r, w, stage):
        return ENOUGH
    return r.control.numbers[RELATIVE] if r.control.numbers.size > 0 else STRICT


@inlined
def renew_all(bodies, w, x):
    """w.stiff by the loads. Returns the squares of its length and of its change, of the body with most."""
    greatest, change = 0.0, 0.0
    for b in range(bodies.mass.size):
        if bodies.where[b, K_SIZE] > 0:
            force, moved = renew_stiffness(bodies, w, x, b)
            greatest, change = max(greatest, force), max(change, moved)
    return greatest, change


@inlined
def move(r, w, target, solve_motion):
    """Motion and multipliers, and the loads that they make."""
    solve_motion(r, target)
    find_loads(r, w)


@inlined
def solve_stiffened(r, x, target, stage, solve_motion, start_stiffening):
    """`solve_motion` with the geometric stiffening of the bodies that have it; the last two are the entry points."""
    bodies, w, ahead = r.model.bodies, r.work.bodies, r.work.bodies.ahead
    if stage > 0 and ahead[IN_USE] > 0.0:
        stiffen_ahead(bodies, w, x)
        move(r, w, target, solve_motion)
        add_to_means(bodies, w)
        return
    keep_unstiffened(bodies, w)
    expected = stage == 0 and ahead[BEARABLE] > 0.0 and start_stiffening(r, x) == 1
    looked = (ahead[COUNT] - SETTLED) % WATCH > 0.0
    waited, enough = False, STRICT
    if not expected:
        enough = first_guess(r, w, stage)
        waited = stage == 0 and ahead[COUNT] <= -ahead[PAUSE]
        enough = STRICT if waited else enough
    sweeps, before, feedback, rough = 0, 0.0, 0.0, False
    while True:
        stiffen(bodies, w)
        move(r, w, target, solve_motion)
        if expected and not loads_as_expected(bodies, w):
            give_up(w)
            expected = False
        if expected and looked:
            break
        greatest, change = renew_all(bodies, w, x)
        sweeps += 1
        small = change <= enough * enough * greatest
        if sweeps == 1:
            rough = change > ROUGH * ROUGH * greatest
        elif sweeps == 2:
            feedback = change / before
        before = change
        if not expected and (small or sweeps == SWEEPS):
            break
        if expected and (small or sweeps == 2):  # the look: on with the expected forces, or with these
            if rough or feedback > ahead[BEARABLE]:
                give_up(w)
                expected = False
            else:
                copy(w.stiff, w.past[0])
                looked = True
                ahead[PAUSE] = max(0.5 * ahead[PAUSE], WATCH / 2)
    if expected:
        ahead[IN_USE], w.steady[COUNT] = 1.0, -1.0
    elif stage >= 0:
        keep_change(w, stage)
    if waited:
        take_up(w, feedback)
    if stage >= 0 and ahead[BEARABLE] > 0.0:
        add_to_means(bodies, w)
    if stage != ASIDE:
        copy(w.last, w.stiff)
