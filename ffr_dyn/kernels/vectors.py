"""Vectors of three as tuples: they live in registers.

Twin: `ffr_dyn.functions.rotation.cross`,
`ffr_dyn.functions.rotation.skew`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.slices import six_parts, three_parts


@kernel
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def subtract(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scale(c, a):
    return (c * a[0], c * a[1], c * a[2])


@kernel
def to_global(A, a):
    """A a."""
    return (
        A[0, 0] * a[0] + A[0, 1] * a[1] + A[0, 2] * a[2],
        A[1, 0] * a[0] + A[1, 1] * a[1] + A[1, 2] * a[2],
        A[2, 0] * a[0] + A[2, 1] * a[1] + A[2, 2] * a[2],
    )


@kernel
def to_body(A, a):
    """A^T a."""
    return (
        A[0, 0] * a[0] + A[1, 0] * a[1] + A[2, 0] * a[2],
        A[0, 1] * a[0] + A[1, 1] * a[1] + A[2, 1] * a[2],
        A[0, 2] * a[0] + A[1, 2] * a[1] + A[2, 2] * a[2],
    )


@kernel
def get(array, row):
    """Row of an (N, 3) array as a tuple."""
    return (array[row, 0], array[row, 1], array[row, 2])


@kernel
def put(array, row, a):
    array[row, 0] = a[0]
    array[row, 1] = a[1]
    array[row, 2] = a[2]


LEAST_PIVOT = 1e-14  # of the diagonal entry that it came from


@kernel
def cholesky_three(T):
    """In-place lower Cholesky factor of a 3 x 3 matrix with reciprocal diagonal. Returns True when it is positive."""
    d0, d1, d2 = T[0, 0], T[1, 1], T[2, 2]
    i0 = 1.0 / d0**0.5
    a1, a2 = T[1, 0] * i0, T[2, 0] * i0
    p1 = d1 - a1 * a1
    i1 = 1.0 / p1**0.5
    b2 = (T[2, 1] - a2 * a1) * i1
    p2 = d2 - a2 * a2 - b2 * b2
    T[0, 0], T[1, 0], T[2, 0], T[1, 1], T[2, 1], T[2, 2] = i0, a1, a2, i1, b2, 1.0 / p2**0.5
    return d0 > 0.0 and p1 > LEAST_PIVOT * d1 and p2 > LEAST_PIVOT * d2


@kernel
def cholesky_six(T, L):
    """In-place lower Cholesky factor of a 6 x 6 matrix with reciprocal diagonal. Returns True when it is positive.

    T : (3, 3) that of its upper left block, or not positive in [0, 0];  L : the last three rows of the matrix

    Written out, since the compiler does not.
    """
    i0, a1, i1, a2, b2, i2 = T[0, 0], T[1, 0], T[1, 1], T[2, 0], T[2, 1], T[2, 2]
    d3, d4, d5 = L[3, 3], L[4, 4], L[5, 5]
    a3, a4, a5 = L[3, 0] * i0, L[4, 0] * i0, L[5, 0] * i0
    b3, b4, b5 = (L[3, 1] - a3 * a1) * i1, (L[4, 1] - a4 * a1) * i1, (L[5, 1] - a5 * a1) * i1
    c3, c4, c5 = (
        (L[3, 2] - a3 * a2 - b3 * b2) * i2,
        (L[4, 2] - a4 * a2 - b4 * b2) * i2,
        (L[5, 2] - a5 * a2 - b5 * b2) * i2,
    )
    p3 = d3 - a3 * a3 - b3 * b3 - c3 * c3
    i3 = 1.0 / p3**0.5
    e4, e5 = (L[4, 3] - a4 * a3 - b4 * b3 - c4 * c3) * i3, (L[5, 3] - a5 * a3 - b5 * b3 - c5 * c3) * i3
    p4 = d4 - a4 * a4 - b4 * b4 - c4 * c4 - e4 * e4
    i4 = 1.0 / p4**0.5
    g5 = (L[5, 4] - a5 * a4 - b5 * b4 - c5 * c4 - e5 * e4) * i4
    p5 = d5 - a5 * a5 - b5 * b5 - c5 * c5 - e5 * e5 - g5 * g5
    L[0, 0], L[1, 1], L[2, 2], L[3, 3], L[4, 4], L[5, 5] = i0, i1, i2, i3, i4, 1.0 / p5**0.5
    L[1, 0], L[2, 0], L[3, 0], L[4, 0], L[5, 0] = a1, a2, a3, a4, a5
    L[2, 1], L[3, 1], L[4, 1], L[5, 1] = b2, b3, b4, b5
    L[3, 2], L[4, 2], L[5, 2] = c3, c4, c5
    L[4, 3], L[5, 3], L[5, 4] = e4, e5, g5
    return i0 > 0.0 and p3 > LEAST_PIVOT * d3 and p4 > LEAST_PIVOT * d4 and p5 > LEAST_PIVOT * d5


@kernel
def lower_six(L, b):
    """In place b <- L^-1 b, for a 6 x 6 factor."""
    b0 = b[0] * L[0, 0]
    b1 = (b[1] - L[1, 0] * b0) * L[1, 1]
    b2 = (b[2] - L[2, 0] * b0 - L[2, 1] * b1) * L[2, 2]
    b3 = (b[3] - L[3, 0] * b0 - L[3, 1] * b1 - L[3, 2] * b2) * L[3, 3]
    b4 = (b[4] - L[4, 0] * b0 - L[4, 1] * b1 - L[4, 2] * b2 - L[4, 3] * b3) * L[4, 4]
    b5 = (b[5] - L[5, 0] * b0 - L[5, 1] * b1 - L[5, 2] * b2 - L[5, 3] * b3 - L[5, 4] * b4) * L[5, 5]
    b[0], b[1], b[2], b[3], b[4], b[5] = b0, b1, b2, b3, b4, b5


@kernel
def upper_six(L, b):
    """In place b <- L^-T b, for a 6 x 6 factor."""
    b5 = b[5] * L[5, 5]
    b4 = (b[4] - L[5, 4] * b5) * L[4, 4]
    b3 = (b[3] - L[5, 3] * b5 - L[4, 3] * b4) * L[3, 3]
    b2 = (b[2] - L[5, 2] * b5 - L[4, 2] * b4 - L[3, 2] * b3) * L[2, 2]
    b1 = (b[1] - L[5, 1] * b5 - L[4, 1] * b4 - L[3, 1] * b3 - L[2, 1] * b2) * L[1, 1]
    b0 = (b[0] - L[5, 0] * b5 - L[4, 0] * b4 - L[3, 0] * b3 - L[2, 0] * b2 - L[1, 0] * b1) * L[0, 0]
    b[0], b[1], b[2], b[3], b[4], b[5] = b0, b1, b2, b3, b4, b5


@kernel
def in_plane(normal):
    """The rigid coordinates, ascending, that move in the plane across body axis `normal`."""
    return 1 if normal == 0 else 0, 1 if normal == 2 else 2, 3 + normal


@kernel
def of_two(component, c0, c1, first, second):
    """A component of the vector that has `first` along c0, `second` along c1 and nothing else."""
    return first if component == c0 else (second if component == c1 else 0.0)


@kernel
def fill(target, value):
    for k in range(target.size):
        target[k] = value


@kernel
def copy(target, source):
    for k in range(target.size):
        target[k] = source[k]


@kernel
def product(a, b):
    """The sum of a[k] b[k]."""
    result = 0.0
    for k in range(a.size):
        result += a[k] * b[k]
    return result


@kernel
def add_scaled(target, base, factor, direction):
    """target = base + factor direction."""
    for k in range(target.size):
        target[k] = base[k] + factor * direction[k]


@kernel
def add_both(target, factor, direction, other, second):
    """target += factor direction + other second."""
    for k in range(target.size):
        target[k] += factor * direction[k] + other * second[k]


@kernel
def multiple(target, factor, source):
    """target = factor source."""
    for k in range(target.size):
        target[k] = factor * source[k]


@kernel
def combine_three(d0, d1, d2, target, base, f0, f1, f2, other, g0, g1, g2):
    """target = base + f0 d0 + f1 d1 + f2 d2, other = g0 d0 + g1 d1 + g2 d2, in one pass."""
    for k in range(target.size):
        first, second, third = d0[k], d1[k], d2[k]
        target[k] = base[k] + f0 * first + f1 * second + f2 * third
        other[k] = g0 * first + g1 * second + g2 * third


@kernel
def weigh_four(target, f0, d0, f1, d1, f2, d2, f3, d3):
    """target = f0 d0 + f1 d1 + f2 d2 + f3 d3, in one pass."""
    for k in range(target.size):
        target[k] = f0 * d0[k] + f1 * d1[k] + f2 * d2[k] + f3 * d3[k]


@kernel
def add_four(target, f0, d0, f1, d1, f2, d2, f3, d3):
    """target += f0 d0 + f1 d1 + f2 d2 + f3 d3, in one pass."""
    for k in range(target.size):
        target[k] += f0 * d0[k] + f1 * d1[k] + f2 * d2[k] + f3 * d3[k]


@kernel
def three_rows(rows, q, n):
    """The first three of a pooled array of rows of n, times q: in one loop, which is three times as fast as three."""
    r0, r1, r2 = three_parts(rows, n)
    t0, t1, t2 = 0.0, 0.0, 0.0
    for j in range(n):
        t0 += r0[j] * q[j]
        t1 += r1[j] * q[j]
        t2 += r2[j] * q[j]
    return t0, t1, t2


@kernel
def six_rows(rows, q, n):
    """The first six rows, as `three_rows`."""
    r0, r1, r2, r3, r4, r5 = six_parts(rows, n)
    t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        t0 += r0[j] * q[j]
        t1 += r1[j] * q[j]
        t2 += r2[j] * q[j]
        t3 += r3[j] * q[j]
        t4 += r4[j] * q[j]
        t5 += r5[j] * q[j]
    return t0, t1, t2, t3, t4, t5


@kernel
def weighted_product(left, right, weight, n):
    """sum_k left[k] weight[k] right[k]."""
    total = 0.0
    for k in range(n):
        total += left[k] * weight[k] * right[k]
    return total
