"""Vectors of three as tuples: they live in registers."""

from ffr_dyn.kernels.options import kernel


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


@kernel
def cholesky(matrix, size):
    """In-place lower Cholesky factor with reciprocal diagonal. Returns the row whose pivot is not positive, or -1.

    A pivot counts as positive above 1e-14 of the diagonal entry it came from.
    """
    for j in range(size):
        pivot = matrix[j, j]
        limit = 1e-14 * pivot
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        if not pivot > limit:
            return j
        inverse = 1.0 / pivot**0.5
        matrix[j, j] = inverse
        for i in range(j + 1, size):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = value * inverse
    return -1


@kernel
def solve_lower(factor, b, size):
    """In place b <- L^-1 b."""
    for i in range(size):
        value = b[i]
        for k in range(i):
            value -= factor[i, k] * b[k]
        b[i] = value * factor[i, i]


@kernel
def solve_upper(factor, b, size):
    """In place b <- L^-T b."""
    for i in range(size - 1, -1, -1):
        value = b[i]
        for k in range(i + 1, size):
            value -= factor[k, i] * b[k]
        b[i] = value * factor[i, i]


@kernel
def rigid_lower(factor, b, normal):
    """In place b <- L^-1 b for the rigid coordinates (6,) of a body; of a planar one, three of them and zeros."""
    if normal < 0:
        solve_lower(factor, b, 6)
        return
    i, j, k = in_plane(normal)
    first = b[i] * factor[i, i]
    second = (b[j] - factor[j, i] * first) * factor[j, j]
    third = (b[k] - factor[k, i] * first - factor[k, j] * second) * factor[k, k]
    b[normal], b[3 + (normal + 1) % 3], b[3 + (normal + 2) % 3] = 0.0, 0.0, 0.0
    b[i], b[j], b[k] = first, second, third


@kernel
def rigid_upper(factor, b, normal):
    """In place b <- L^-T b, as `rigid_lower`."""
    if normal < 0:
        solve_upper(factor, b, 6)
        return
    i, j, k = in_plane(normal)
    b[k] = b[k] * factor[k, k]
    b[j] = (b[j] - factor[k, j] * b[k]) * factor[j, j]
    b[i] = (b[i] - factor[j, i] * b[j] - factor[k, i] * b[k]) * factor[i, i]


@kernel
def in_plane(normal):
    """The rigid coordinates, ascending, that move in the plane across body axis `normal`."""
    return 1 if normal == 0 else 0, 1 if normal == 2 else 2, 3 + normal


@kernel
def fill(target, value):
    for k in range(target.size):
        target[k] = value


@kernel
def copy(target, source):
    for k in range(target.size):
        target[k] = source[k]


@kernel
def add_scaled(target, base, factor, direction):
    """target = base + factor direction."""
    for k in range(target.size):
        target[k] = base[k] + factor * direction[k]
