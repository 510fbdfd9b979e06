"""Loads spread over a body: their integrals over its basis (`ffr_dyn.scene.surface_loads`) at the present q and rotation.

Twin: `ffr_dyn.scene.surface_loads.distributed`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.tables import AFFINE, IN_V, IN_X, N


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
def turned(data, start, A, q, n, k, c):
    """Entry k, c of (sum u f^T) A: position and force of all points in body axes."""
    total = 0.0
    for l in range(3):  # noqa: E741
        value = data[start + 3 + 3 * k + l]
        row = part(data, start + 12 + (3 * k + l) * n, n)
        for j in range(n):
            value += row[j] * q[j]
        total += value * A[l, c]
    return total


@kernel
def add_global(data, start, factor, A, q, n, f):
    """Forces of fixed global direction; data: sum f (3), sum u_0 f^T (9), sum phi_j f^T (9 rows of n)."""
    for c in range(3):
        for l in range(3):  # noqa: E741
            f[c] += factor * data[start + l] * A[l, c]
        a, b = (c + 1) % 3, (c + 2) % 3
        f[3 + c] += factor * (turned(data, start, A, q, n, a, b) - turned(data, start, A, q, n, b, a))
        for l in range(3):  # noqa: E741
            row = part(data, start + 12 + (3 * c + l) * n, n)
            for j in range(n):
                f[6 + j] += factor * row[j] * A[l, c]


@kernel
def apply_spread(where, loads, A, functions, x, f, k):
    """Add spread load k to f; A (B + 1, 3, 3)."""
    b, kind, start, function = loads.spread[k, 0], loads.spread[k, 1], loads.spread[k, 2], loads.spread[k, 3]
    n, i, j = where[b, N], where[b, IN_X], where[b, IN_V]
    q, own = part(x, i + 7, n), part(f, j, 6 + n)
    if kind == AFFINE:
        add_affine(loads.data, start, functions[function, 0], q, n, own)
    else:
        add_global(loads.data, start, functions[function, 0], A[b], q, n, own)
