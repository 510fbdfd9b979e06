"""Forces on one coordinate between two markers: the length between their points, a joint's angle or stroke.

The generalised force is the law's force times the gradient of the coordinate, so that force and rate make its power on
rigid and flexible bodies alike, and both bodies together feel neither force nor moment.

Twin: `ffr_dyn.equations.forces.applied`.
"""

import math

from ffr_dyn.kernels.forces.implicit import keep_row
from ffr_dyn.kernels.markers import project, shapes
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.rows import ZERO, coordinate
from ffr_dyn.kernels.simd.slices import part, vector_at
from ffr_dyn.kernels.tables import ANGLE, BY_TIME, END_I, END_J, FUNCTION, IN_V, LENGTH, MEASURED, PLACE, WAY, N
from ffr_dyn.kernels.vectors import cross, dot, get, scale, subtract, to_body


@kernel
def length(w, i, j):
    """Distance between two points, its rate and motion; no direction, and no force, where it is zero."""
    d, dd = subtract(get(w.r, j), get(w.r, i)), subtract(get(w.rd, j), get(w.rd, i))
    size = dot(d, d) ** 0.5
    if size == 0.0:
        return 0.0, 0.0, (0.0, (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO))
    along = scale(1.0 / size, d)
    rate = dot(along, dd)
    bias = dot(along, subtract(get(w.rb, j), get(w.rb, i))) + (dot(dd, dd) - rate * rate) / size
    bi, bj = to_body(w.A[w.body[i]], scale(-1.0, along)), to_body(w.A[w.body[j]], along)
    return size, rate, (bias, (bi, cross(get(w.u, i), bi), ZERO), (bj, cross(get(w.u, j), bj), ZERO))


@kernel
def lifted(angle, reference):
    """The angle plus the whole turns that bring it nearest to the reference."""
    return angle + 2.0 * math.pi * round((reference - angle) / (2.0 * math.pi))


@kernel
def three(data, start):
    return data[start], data[start + 1], data[start + 2]


@kernel
def coordinate_of(r, k):
    """Coordinate of force k, its rate and its motion: the quadratic velocity part of its second derivative, and its sides
    (see `rows`); r: `Tables`."""
    row, data, w = r.model.loads.row, r.model.loads.data, r.work.markers
    way, i, j, at = row[k, WAY], row[k, END_I], row[k, END_J], row[k, PLACE]
    if way == LENGTH:
        return length(w, i, j)
    value, rate, gamma, side_i, side_j = coordinate(
        way, three(data, at), three(data, at + 3), three(data, at + 6), w, i, j
    )
    if way == ANGLE:
        value = lifted(value, r.work.loads.reference[row[k, MEASURED]])
    return value, rate, (-gamma, side_i, side_j)


@kernel
def drive_of(r, k):
    """Value and two derivatives of the time function of force k."""
    return get(r.work.functions, r.model.loads.row[k, FUNCTION])


@kernel
def apply_side(where, markers, w, f, k, amount, side):
    """Add amount times a side (see `rows`) of marker k to the right-hand sides f."""
    b = markers.body[k]
    if b == where.shape[0] - 1:
        return
    n, j = where[b, N], where[b, IN_V]
    force, turning, twist = scale(amount, side[0]), scale(amount, side[1]), scale(amount, side[2])
    for c in range(3):
        f[j + c] += force[c]
        f[j + 3 + c] += turning[c]
    if n > 0:
        project(shapes(markers, w.phi, k, n), force, twist, part(f, j + 6, n), n)


@kernel
def apply_along(r, k, f, value, rate, motion, force, stiffness=0.0, damping=0.0, by_time=0.0):
    """Add the force on a coordinate to the vector f, and keep it with coordinate and rate.

    stiffness, damping : how much the force falls with coordinate and rate, or more, for implicit methods; zeros: explicit
    by_time            : how fast it grows where coordinate and rate stay
    """
    m, row, w, kept = r.model, r.model.loads.row, r.work.markers, r.work.loads.measured
    at, i, j = row[k, MEASURED], row[k, END_I], row[k, END_J]
    kept[at], kept[at + 1], kept[at + 2] = value, rate, force
    f = vector_at(f, r.v.size)
    force += r.work.implicit[BY_TIME] * by_time
    apply_side(m.bodies.where, m.markers, w, f, i, force, motion[1])
    apply_side(m.bodies.where, m.markers, w, f, j, force, motion[2])
    keep_row(r, k, 0, value, rate, motion, stiffness, damping)
