"""Loads spread over a body: their integrals (`ffr_dyn.scene.forces.distributed`) at the present q and rotation.

Twin: `ffr_dyn.scene.forces.distributed`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.simd.slices import part, vector_at
from ffr_dyn.kernels.tables import END_I, FUNCTION, GLOBAL, IN_V, IN_X, LAW, MEASURED, OK, WAY, N, Tables, Vector


@kernel
def by_second(data, row, q, n, j):
    """(X q)_j of the (n, n) numbers X from `row` on."""
    total, numbers = 0.0, part(data, row + j * n, n)
    for c in range(n):
        total += numbers[c] * q[c]
    return total


@kernel
def half_square(data, row, q, n):
    """q^T X q / 2 of them."""
    total = 0.0
    for j in range(n):
        total += 0.5 * q[j] * by_second(data, row, q, n, j)
    return total


@kernel
def add_affine(data, start, factor, q, n, f):
    """f += factor (constant + slope q); data: constant (6 + n), slope (6 + n) rows of n."""
    for r in range(6 + n):
        total = data[start + r]
        row = part(data, start + (6 + n) + r * n, n)
        for c in range(n):
            total += row[c] * q[c]
        f[r] += factor * total


@kernel
def add_second(data, start, factor, q, n, f):
    """The moment and the work of constant forces on the second-order displacement; data: X, nine times n rows of n."""
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        one, other = start + (3 * a + b) * n * n, start + (3 * b + a) * n * n
        f[3 + k] += factor * (half_square(data, one, q, n) - half_square(data, other, q, n))
        for j in range(n):
            f[6 + j] += factor * by_second(data, start + 4 * k * n * n, q, n, j)


@kernel
def turned(data, start, second, A, q, n, k, c):
    """Entry k, c of (sum u f^T) A: position and force of all points in body axes."""
    total = 0.0
    for l in range(3):  # noqa: E741
        value = data[start + 3 + 3 * k + l]
        row = part(data, start + 12 + (3 * k + l) * n, n)
        for j in range(n):
            value += row[j] * q[j]
        if second:
            value += half_square(data, start + 12 + 9 * n + (3 * k + l) * n * n, q, n)
        total += value * A[l, c]
    return total


@kernel
def add_global(data, start, second, factor, A, q, n, f):
    """Forces of fixed global direction; data: sum f (3), sum u_0 f^T (9), sum phi_j f^T (9 rows of n), X (9 n rows of n)."""
    for c in range(3):
        for l in range(3):  # noqa: E741
            f[c] += factor * data[start + l] * A[l, c]
        a, b = (c + 1) % 3, (c + 2) % 3
        f[3 + c] += factor * (turned(data, start, second, A, q, n, a, b) - turned(data, start, second, A, q, n, b, a))
        for l in range(3):  # noqa: E741
            row = part(data, start + 12 + (3 * c + l) * n, n)
            for j in range(n):
                f[6 + j] += factor * row[j] * A[l, c]
                if second:
                    curved = by_second(data, start + 12 + 9 * n + (3 * c + l) * n * n, q, n, j)
                    f[6 + j] += factor * curved * A[l, c]


@force_kernel
def distributed(r: Tables, k: int, x: Vector, f: Vector) -> int:
    """Of directions fixed in the body, affine in q; or of fixed global directions; of second-order bodies with X."""
    where, loads = r.model.bodies.where, r.model.loads
    b, start = loads.row[k, END_I], loads.row[k, LAW] + 1
    second = loads.data[start - 1] > 0
    n, i, j = where[b, N], where[b, IN_X], where[b, IN_V]
    q, own = part(vector_at(x, r.x.size), i + 7, n), part(vector_at(f, r.v.size), j, 6 + n)
    factor = r.work.functions[loads.row[k, FUNCTION], 0]
    r.work.loads.measured[loads.row[k, MEASURED]] = factor
    if loads.row[k, WAY] == GLOBAL:
        add_global(loads.data, start, second, factor, r.work.bodies.A[b], q, n, own)
        return OK
    add_affine(loads.data, start, factor, q, n, own)
    if second:
        add_second(loads.data, start + (6 + n) * (1 + n), factor, q, n, own)
    return OK
