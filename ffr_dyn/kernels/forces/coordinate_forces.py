"""Forces on coordinates between two markers: the length between their points, a joint's angle or stroke.

The generalised force is the law's force times the gradient of the coordinate, so that force and rate make its power on
rigid and flexible bodies alike, and both bodies together feel neither force nor moment.

Twin: `ffr_dyn.equations.forces.applied`.
"""

import math

from ffr_dyn.kernels.forces.force_laws import law
from ffr_dyn.kernels.markers import project, shapes
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.rows import ZERO, coordinate
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.tables import ANGLE, IN_V, LENGTH, N
from ffr_dyn.kernels.vectors import cross, dot, get, scale, subtract, to_body


@kernel
def length(w, i, j):
    """Length, rate and sides of the distance between two points; no direction, and no force, where it is zero."""
    d = subtract(get(w.r, j), get(w.r, i))
    size = dot(d, d) ** 0.5
    if size == 0.0:
        return 0.0, 0.0, (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO)
    along = scale(1.0 / size, d)
    rate = dot(along, subtract(get(w.rd, j), get(w.rd, i)))
    bi, bj = to_body(w.A[w.body[i]], scale(-1.0, along)), to_body(w.A[w.body[j]], along)
    return size, rate, (bi, cross(get(w.u, i), bi), ZERO), (bj, cross(get(w.u, j), bj), ZERO)


@kernel
def lifted(angle, reference):
    """The angle plus the whole turns that bring it nearest to the reference."""
    return angle + 2.0 * math.pi * round((reference - angle) / (2.0 * math.pi))


@kernel
def gradient(loads, w, reference, k):
    """Coordinate, rate and sides of action k; w: MarkerWork."""
    kind, i, j = loads.action[k, 0], loads.action[k, 1], loads.action[k, 2]
    if kind == LENGTH:
        return length(w, i, j)
    axes = loads.action_axes[k]
    value, rate, _, side_i, side_j = coordinate(kind, get(axes, 0), get(axes, 1), get(axes, 2), w, i, j)
    if kind == ANGLE:
        value = lifted(value, reference)
    return value, rate, side_i, side_j


@kernel
def apply_side(where, markers, u, f, load, k, amount, side):
    """Add amount times a side (see `rows`) of marker k, at u, to the right-hand sides f and to the marker's load (6,)."""
    b = markers.body[k]
    if b == where.shape[0] - 1:
        return
    n, j = where[b, N], where[b, IN_V]
    force, turning, twist = scale(amount, side[0]), scale(amount, side[1]), scale(amount, side[2])
    moment = subtract(turning, cross(u, force))
    for c in range(3):
        f[j + c] += force[c]
        f[j + 3 + c] += turning[c]
        load[c] += force[c]
        load[3 + c] += moment[c]
    if n > 0:
        project(shapes(markers, k, n), force, twist, part(f, j + 6, n), n)


@kernel
def apply_action(where, markers, loads, w, s, functions, user, f, load, k):
    """Add action k to f and load (M, 6), and keep its coordinate, rate and force in s.action; w, s: Marker-, LoadWork."""
    value, rate, side_i, side_j = gradient(loads, w, s.reference[k], k)
    drive = (1.0, 0.0, 0.0)
    if loads.action[k, 5] >= 0:
        drive = get(functions, loads.action[k, 5])
    force = law(loads.action[k, 3], loads.data, loads.action[k, 4], value, rate, drive, user)
    s.action[k, 0], s.action[k, 1], s.action[k, 2] = value, rate, force
    i, j = loads.action[k, 1], loads.action[k, 2]
    apply_side(where, markers, get(w.u, i), f, load[i], i, force, side_i)
    apply_side(where, markers, get(w.u, j), f, load[j], j, force, side_j)


@kernel
def keep_turns(loads, s):
    """Count the turns of the angles from this, an accepted state."""
    for k in range(loads.action.shape[0]):
        if s.action[k, 0] - s.action[k, 0] == 0.0:  # not from a state that is no longer finite
            s.reference[k] = s.action[k, 0]
