"""Geometric stiffening without a sum of matrices in every stage, for steps of equal length.

A Runge-Kutta or W-method keeps its order where some of its forces are given as functions of time, and along the motion
K_sigma is one. With K_0 = K_sigma at the start of a step the forces in a stage are

    K_0 q + r(t),    r = (K_sigma - K_0) q,

of which r is extrapolated by the polynomial through the forces and the coordinates at the starts of this step and of those
before, with an error of the order of the method. At a start the coordinates are known; the loads are not, since in a
linearly implicit method the accelerations and multipliers of a stage are right to h alone. But their sum over the stages
with the weights of the method is, to its order, their mean over the step, as if the method integrated them, too; the means
over the last steps give the loads at the end of the last one.

So the loads act late on the motion that makes them. That can feed a vibration, by as much as what the loads change in
themselves: the ratio of two sweeps. It must be less than half of what the damping of the method could bear, whatever the
frequency, and is looked at from time to time; else, and where loads jump, sweeps are done (`ffr_dyn.kernels.stiffening`).
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.stiffness import multiply_stiffness, rate_loads, sum_stiffness
from ffr_dyn.kernels.tables import INERTIAL, LANES, MEANS, QUAD
from ffr_dyn.kernels.vectors import add_scaled, get
from ffr_dyn.kernels.views import part

SETTLED = MEANS + 3  # steps of equal length before r is known; before the loads at the start of one are, MEANS
WATCH = 32  # steps from one look at the feedback to the next
JUMP = 0.25  # of the loads at the start of a step, relative to what they are
# Numbers of `w.ahead`: length of this step; how many before it were as long, or, less than zero, since the feedback was found
# to be too large; whether the stages of this step are solved so; the square of the feedback and what it may be; factors of
# the second and third differences; the first weight of the means.
LENGTH, COUNT, IN_USE, FEEDBACK, BEARABLE, SECOND, THIRD, WEIGHTS = range(8)
# Numbers of `w.stage`: what part of the step it is after the start, and its weight.
AT, WEIGHT = range(2)
COORDINATES = 4  # first row of `w.past` with those of q


@inlined
def own_stiffness(bodies, w, b):
    """Where K_0 of body b is kept."""
    return part(w.K_sigma, w.sums[b], bodies.where[b, 6] + QUAD * LANES)


@inlined
def begin_step(r, w):
    """Loads at the start of a step (w.expected), from the means. Returns whether they are known.

    Nothing is done where the method or the feedback do not allow it.
    """
    ahead, h = w.ahead, r.clock.time[0]
    ahead[IN_USE] = 0.0
    if ahead[FEEDBACK] > ahead[BEARABLE]:
        ahead[COUNT] = min(ahead[COUNT], 0.0) - 1.0
        return False
    ahead[COUNT] = max(ahead[COUNT], -1.0) + 1.0 if ahead[LENGTH] == h else 0.0
    ahead[LENGTH] = h
    for b in range(w.expected.shape[0]):
        for k in range(w.expected.shape[1]):
            expected, last = 0.0, 0.0
            for number in range(MEANS):
                own = w.mean[number, b, k]
                expected += ahead[WEIGHTS + number] * own
                w.mean[number, b, k], last = last, own
            w.expected[b, k] = expected
    return ahead[COUNT] >= MEANS


@inlined
def stiffen_by_expected(bodies, w, x):
    """K_0 and w.stiff of all stiffened bodies."""
    for b in range(bodies.mass.size):
        if bodies.where[b, 6] > 0:
            n, K = bodies.where[b, 0], own_stiffness(bodies, w, b)
            rate_loads(get(w.omega, b), w.expected[b])
            sum_stiffness(bodies, w, w.expected[b], b, K)
            q, stiff = part(x, bodies.where[b, 1] + 7, n), part(w.stiff, bodies.where[b, 3], n)
            multiply_stiffness(bodies, w, b, K, q, stiff)


@inlined
def keep_start(bodies, w, x):
    """w.past."""
    for b in range(bodies.mass.size):
        if bodies.where[b, 6] > 0:
            n, e = bodies.where[b, 0], bodies.where[b, 3]
            keep_differences(part(w.stiff, e, n), w.past, 0, e, n)
            keep_differences(part(x, bodies.where[b, 1] + 7, n), w.past, COORDINATES, e, n)


@kernel
def keep_differences(now, past, row, first, n):
    """Four rows of `past`: now, and its backward differences to the third."""
    d0, d1 = part(past[row], first, n), part(past[row + 1], first, n)
    d2, d3 = part(past[row + 2], first, n), part(past[row + 3], first, n)
    for k in range(n):
        one = now[k] - d0[k]
        two = one - d1[k]
        d0[k], d1[k], d2[k], d3[k] = now[k], one, two, two - d2[k]


@inlined
def stiffen_ahead(bodies, w, x):
    """f -= K_sigma q in a stage."""
    at = w.stage[AT]
    second, third = w.ahead[SECOND] * at * (at + 1.0), w.ahead[THIRD] * at * (at + 1.0) * (at + 2.0)
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, 0], bodies.where[b, 3]
        if bodies.where[b, 6] > 0:
            f, q, past = part(w.f, bodies.where[b, 2] + 6, n), part(x, bodies.where[b, 1] + 7, n), w.past
            off, own = part(w.scratch, 0, n), part(w.scratch, n, n)
            d0, d1, d2, d3 = part(past[4], e, n), part(past[5], e, n), part(past[6], e, n), part(past[7], e, n)
            for k in range(n):
                off[k] = q[k] - (d0[k] + at * d1[k] + second * d2[k] + third * d3[k])
            multiply_stiffness(bodies, w, b, own_stiffness(bodies, w, b), off, own)
            d0, d1, d2, d3 = part(past[0], e, n), part(past[1], e, n), part(past[2], e, n), part(past[3], e, n)
            for k in range(n):
                f[k] -= own[k] + (d0[k] + at * d1[k] + second * d2[k] + third * d3[k])


@inlined
def loads_as_expected(bodies, w):
    """Whether the loads of all stiffened bodies are what was expected, but for less than a jump.

    Moments count as forces at the radius of inertia, accelerations as the forces that they take: alike in plane and space.
    """
    for b in range(bodies.mass.size):
        if bodies.where[b, 6] > 0:
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
        if bodies.where[b, 6] > 0:
            add_scaled(w.mean[0, b], w.mean[0, b], w.stage[WEIGHT], w.load[b])
