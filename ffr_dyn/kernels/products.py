"""Sums over the elastic coordinates of a body of tables by coordinate: its quadratic terms, its geometric stiffness.

The tables are stored in blocks, as `ffr_dyn.decoupling` makes them.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.vectors import fill
from ffr_dyn.kernels.views import part, peek


@kernel
def contract(table, plan, at, q, qd, n, width, last, scratch, g, l):  # noqa: E741
    """g (width,) += sum_i q_i table_i, l (last,) += sum_i q_dot_i (the last of table_i): the only O(n^2) work of a body.

    Block by block, as the plan that begins at `at` says (see `ffr_dyn.decoupling`).
    """
    blocks = plan[at]
    order = at + 1 + 3 * blocks
    place = order + n
    x, xd, y, yd = q, qd, g, l
    if blocks > 0:
        x, xd = part(scratch, 0, n), part(scratch, n, n)
        y, yd = part(scratch, 2 * n, width + 1), part(scratch, 2 * n + width + 1, last + 1)
        for k in range(n):
            number = peek(plan, order + k)
            x[k], xd[k] = peek(q, number), peek(qd, number)
        fill(y, 0.0)
        fill(yd, 0.0)
    start, first, product, late = 0, 0, 0, 0
    for block in range(max(blocks, 1)):
        count, outputs, of_last = n, width, last
        if blocks > 0:
            count, outputs, of_last = plan[at + 1 + 3 * block], plan[at + 2 + 3 * block], plan[at + 3 + 3 * block]
        add_products(
            part(table, start, count * outputs), count, outputs, of_last,
            part(x, first, count), part(xd, first, count), part(y, product, outputs), part(yd, late, of_last),
        )  # fmt: skip
        start += count * outputs
        first += count
        product += outputs
        late += of_last
    if blocks > 0:
        for k in range(width):
            g[k] += peek(y, peek(plan, place + k))
        for k in range(last):
            l[k] += peek(yd, peek(plan, place + width + k))


@kernel
def add_products(table, count, width, last, q, qd, g, l):  # noqa: E741
    """`contract` for one block. Four rows at a time, so that each result is loaded and stored a quarter as often."""
    skipped = width - last
    for i in range(0, count - 3, 4):
        q0, q1, q2, q3 = q[i], q[i + 1], q[i + 2], q[i + 3]
        first, second = part(table, i * width, width), part(table, (i + 1) * width, width)
        third, fourth = part(table, (i + 2) * width, width), part(table, (i + 3) * width, width)
        for k in range(width):
            g[k] += q0 * first[k] + q1 * second[k] + q2 * third[k] + q3 * fourth[k]
        if last > 0:
            q0, q1, q2, q3 = qd[i], qd[i + 1], qd[i + 2], qd[i + 3]
            first, second = part(first, skipped, last), part(second, skipped, last)
            third, fourth = part(third, skipped, last), part(fourth, skipped, last)
            for k in range(last):
                l[k] += q0 * first[k] + q1 * second[k] + q2 * third[k] + q3 * fourth[k]
    for i in range(count - count % 4, count):
        x, row = q[i], part(table, i * width, width)
        for k in range(width):
            g[k] += x * row[k]
        x, row = qd[i], part(row, skipped, last)
        for k in range(last):
            l[k] += x * row[k]
