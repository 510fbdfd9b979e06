"""Geometric stiffening without a sum of matrices in every stage, for steps of equal length.

A Runge-Kutta or W-method keeps its order where some of its forces are given as functions of time, and along the motion
K_sigma q is one. So it is found once a step, at its start. In the stages it is

    F + D (q - Q),

with F and Q the polynomials in time through K_sigma q and q at the starts of this step and of those before, to the order of
the method, and D the diagonal of K_sigma at the start. The second term, which vanishes to that order, is there for vibrations
too fast for polynomials: of what stiffening does to the frequency of a mode the diagonal is the first term, so it acts at
once.

At a start the coordinates are known; the loads are not, since in a linearly implicit method the accelerations and multipliers
of a stage are right to h alone. But their sum over the stages with the weights of the method is, to its order, their mean
over the step, as if the method integrated them, too; the means over the last steps give the loads at the end of the last one.

So the loads act late on the motion that makes them. That can feed a vibration, by as much as what the loads change in
themselves: the ratio of two sweeps. It must be less than half of what the damping of the method bears, whatever the
frequency, and is looked at from time to time, as are the forces; else, and where loads jump, sweeps are done
(`ffr_dyn.kernels.stiffening.by_load`).

Twin: `ffr_dyn.equations.stiffening.geometric_stiffening`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.stiffening.stiffness import multiply_stiffness, rate_loads, sum_stiffness, take_diagonal
from ffr_dyn.kernels.tables import IN_Q, IN_V, IN_X, INERTIAL, K_SIZE, MEANS, H, N
from ffr_dyn.kernels.vectors import add_scaled, fill, get

SETTLED = MEANS + 3  # steps of equal length before F and Q are known; before the loads at the start of one are, MEANS
JUMP = 0.25  # of the loads at the start of a step, relative to what they are
# Numbers of `w.ahead`: length of this step; how many before it were as long, or, less than zero, since all this was given up;
# how many there are before it is taken up again, once it is; whether the stages of this step are solved so; what the feedback
# may be, squared; factors of the second and third differences; the first weight of the means.
LENGTH, COUNT, PAUSE, IN_USE, BEARABLE, SECOND, THIRD, WEIGHTS = range(8)
# Numbers of `w.stage`: what part of the step it is after the start, and its weight.
AT, WEIGHT = range(2)
COORDINATES = 4  # first row of `w.past` with those of q


@inlined
def begin_step(r, w):
    """Loads at the start of a step (w.expected), from the means. Returns whether they are known."""
    ahead, h = w.ahead, r.clock.time[H]
    ahead[IN_USE] = 0.0
    if ahead[COUNT] < 0.0:
        ahead[COUNT] -= 1.0
        return False
    ahead[COUNT] = ahead[COUNT] + 1.0 if ahead[LENGTH] == h else 0.0
    ahead[LENGTH] = h
    weights = part(ahead, WEIGHTS, MEANS)
    for b in range(w.expected.shape[0]):
        for k in range(w.expected.shape[1]):
            expected, last = 0.0, 0.0
            for number in range(MEANS):
                own = w.mean[number, b, k]
                expected += weights[number] * own
                w.mean[number, b, k], last = last, own
            w.expected[b, k] = expected
    return ahead[COUNT] >= MEANS


@kernel
def give_up(w):
    """Go on by sweeps for a while, twice as long as the time before; each look that finds nothing wrong halves that again."""
    w.ahead[COUNT], w.ahead[PAUSE] = -1.0, 2.0 * w.ahead[PAUSE]
    fill(part(w.change, 0, w.change.size), 0.0)
    w.steady[COUNT] = -1.0


@kernel
def take_up(w, feedback):
    """Begin again, if the feedback (squared) allows it."""
    if feedback <= w.ahead[BEARABLE]:
        w.ahead[COUNT], w.ahead[LENGTH] = 0.0, 0.0
    else:
        w.ahead[COUNT] = -1.0


@inlined
def stiffen_by_expected(bodies, w, x):
    """w.stiff of all stiffened bodies at the start of a step, and the diagonal of K_sigma."""
    for b in range(bodies.mass.size):
        if bodies.where[b, K_SIZE] > 0:
            n, e = bodies.where[b, N], bodies.where[b, IN_Q]
            rate_loads(get(w.omega, b), w.expected[b])
            sum_stiffness(bodies, w, w.expected[b], b)
            multiply_stiffness(bodies, w, b, part(x, bodies.where[b, IN_X] + 7, n), part(w.stiff, e, n))
            take_diagonal(bodies, w, b, part(w.diagonal, e, n))


@kernel
def four_rows(past, row, first, n):
    """From row `row` on, those of a body."""
    return (
        part(past[row], first, n),
        part(past[row + 1], first, n),
        part(past[row + 2], first, n),
        part(past[row + 3], first, n),
    )


@inlined
def keep_start(bodies, w, x):
    """w.past."""
    for b in range(bodies.mass.size):
        if bodies.where[b, K_SIZE] > 0:
            n, e = bodies.where[b, N], bodies.where[b, IN_Q]
            keep_differences(part(w.stiff, e, n), w.past, 0, e, n)
            keep_differences(part(x, bodies.where[b, IN_X] + 7, n), w.past, COORDINATES, e, n)


@kernel
def keep_differences(now, past, row, first, n):
    """Four rows of `past`: now, and its backward differences to the third."""
    d0, d1, d2, d3 = four_rows(past, row, first, n)
    for k in range(n):
        one = now[k] - d0[k]
        two = one - d1[k]
        d0[k], d1[k], d2[k], d3[k] = now[k], one, two, two - d2[k]


@inlined
def start_ahead(r, w, x):
    """w.stiff and what the stages need at the start of a step. Returns whether it may be used."""
    if not begin_step(r, w):
        return False
    stiffen_by_expected(r.model.bodies, w, x)
    keep_start(r.model.bodies, w, x)
    return w.ahead[COUNT] >= SETTLED


@inlined
def stiffen_ahead(bodies, w, x):
    """f -= K_sigma q in a stage."""
    at = w.stage[AT]
    second, third = w.ahead[SECOND] * at * (at + 1.0), w.ahead[THIRD] * at * (at + 1.0) * (at + 2.0)
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, N], bodies.where[b, IN_Q]
        if bodies.where[b, K_SIZE] > 0:
            f, q = part(w.f, bodies.where[b, IN_V] + 6, n), part(x, bodies.where[b, IN_X] + 7, n)
            (f0, f1, f2, f3), (q0, q1, q2, q3) = four_rows(w.past, 0, e, n), four_rows(w.past, COORDINATES, e, n)
            diagonal = part(w.diagonal, e, n)
            for k in range(n):
                off = q[k] - (q0[k] + at * q1[k] + second * q2[k] + third * q3[k])
                f[k] -= diagonal[k] * off + (f0[k] + at * f1[k] + second * f2[k] + third * f3[k])


@inlined
def loads_as_expected(bodies, w):
    """Whether the loads of all stiffened bodies are what was expected, but for less than a jump.

    Moments count as forces at the radius of inertia, accelerations as the forces that they take: alike in plane and space.
    """
    for b in range(bodies.mass.size):
        if bodies.where[b, K_SIZE] > 0:
            mass, inverse = bodies.mass[b], w.inverse[b, 1]
            size, missed = 0.0, 0.0
            for k in range(w.load.shape[1]):
                if k < INERTIAL:
                    scale = mass * mass if k < 3 else mass / inverse
                else:
                    scale = 1.0 if (k - INERTIAL) % 6 < 3 else mass * inverse
                size += scale * w.expected[b, k] ** 2
                missed += scale * (w.load[b, k] - w.expected[b, k]) ** 2
            if not missed <= JUMP * JUMP * size:
                return False
    return True


@inlined
def add_to_means(bodies, w):
    """The loads of a stage, to their means over the step."""
    for b in range(bodies.mass.size):
        if bodies.where[b, K_SIZE] > 0:
            add_scaled(w.mean[0, b], w.mean[0, b], w.stage[WEIGHT], w.load[b])
