"""What an integrator calls: the units by name, on the unpacked tables r."""

from ffr_dyn.kernels.options import inlined
from ffr_dyn.kernels.simd.table_address import call_unit
from ffr_dyn.kernels.tables import AGAIN, ASIDE, CORRECT, EVALUATE, LOOK_AHEAD, PREPARE, PROJECT, SETTLE, SOLVE


@inlined
def evaluate(r, t, x, v):
    """Right-hand sides, rows and factors at (t, x, v). Returns a status."""
    return call_unit(r.units[EVALUATE], r.address, t, x.ctypes.data, v.ctypes.data)


@inlined
def settle(r, t):
    """`evaluate` at the machine's state, brought back onto the constraints before. Returns a status."""
    return call_unit(r.units[SETTLE], r.address, t, r.x.ctypes.data, r.v.ctypes.data)


@inlined
def solve(r, x, target, stage):
    """Accelerations (bodies.acc) and multipliers (rows.lam) of what was evaluated last at x, in stage number `stage`."""
    call_unit(r.units[SOLVE], r.address, float(stage), x.ctypes.data, target.ctypes.data)


@inlined
def solve_stage(r, x, target, stage, at, weight):
    """`solve` in a method that looks ahead.

    at, weight : what part of the step after its start, from 0 in the first stage; of the stage in what the step adds
    """
    place = r.work.bodies.stage
    place[0], place[1] = at, weight
    solve(r, x, target, stage)


@inlined
def solve_again(r, x, target):
    """`solve` near what was solved last."""
    call_unit(r.units[SOLVE], r.address, AGAIN, x.ctypes.data, target.ctypes.data)


@inlined
def solve_aside(r, x, target):
    """`solve` aside from the steps, which do not go on from it."""
    call_unit(r.units[SOLVE], r.address, ASIDE, x.ctypes.data, target.ctypes.data)


@inlined
def correct(r, r_v, target):
    """f += M r_v, target += Phi_q r_v."""
    call_unit(r.units[CORRECT], r.address, 0.0, r_v.ctypes.data, target.ctypes.data)


@inlined
def look_ahead(r, t, x, v):
    """Constraint rows at (t, x, v); the factors of the last evaluation stay. Returns a status."""
    return call_unit(r.units[LOOK_AHEAD], r.address, t, x.ctypes.data, v.ctypes.data)


@inlined
def project(r, value, out):
    """out, shaped like v: the smallest motion with Phi_q out = -value, by the factors of the last evaluation."""
    call_unit(r.units[PROJECT], r.address, 0.0, value.ctypes.data, out.ctypes.data)


@inlined
def set_diagonal(r, gh):
    """The elastic diagonal 1 + (gamma h)^2 Omega^2 + gamma h 2 zeta Omega of a linearly implicit method; gh = 0: explicit."""
    if r.work.diagonal[0] == gh:
        return
    r.work.diagonal[0] = gh
    bodies, dinv = r.model.bodies, r.work.bodies.dinv
    for k in range(dinv.size):
        dinv[k] = 1.0 / (1.0 + gh * gh * bodies.omega2[k] + gh * bodies.two_zeta_omega[k])
    call_unit(r.units[PREPARE], r.address, 0.0, 0, 0)


@inlined
def add_elastic_part(bodies, f, v, r_x, gh):
    """f -= gamma h Omega^2 (q_dot + r_q)."""
    for b in range(bodies.mass.size):
        n, i, j, shared = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2], bodies.where[b, 8]
        for k in range(n):
            f[j + 6 + k] -= gh * bodies.omega2[shared + k] * (v[j + 6 + k] + r_x[i + 7 + k])
