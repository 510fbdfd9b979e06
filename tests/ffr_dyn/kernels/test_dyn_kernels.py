"""The compiled kernels against their readable twins, and the twins against a Lagrangian differentiated numerically."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud, mirrored

from ffr_dyn.compile.body_tables import of_coordinates
from ffr_dyn.compile.engine import evaluate_at, new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.compile.symmetry_blocks import in_blocks
from ffr_dyn.equations.constraint_rows import drive_of, rows_at
from ffr_dyn.equations.constraints import evaluate_word
from ffr_dyn.equations.inertia import elastic_force, gravity_force, mass_matrix, quadratic_velocity
from ffr_dyn.equations.layout import layout
from ffr_dyn.equations.motion import equations_of_motion
from ffr_dyn.functions.rotation import G_bar, rotation_matrix, skew
from ffr_dyn.functions.time_functions import evaluate, harmonic, polynomial, table
from ffr_dyn.integrators import RK4
from ffr_dyn.kernels.functions import evaluate_functions
from ffr_dyn.kernels.tables import EARLY, HEAD, HOW, LANES, LATE_RUNS, MIXED, OK, SORTED, WHOLE, Functions
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.joints import KINDS, Joint
from ffr_dyn.scene.scene import Body, Scene

RNG = np.random.default_rng(7)


def random_state(scene: Scene, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    place = layout(scene)
    x, v = rng.normal(size=place.x_size), rng.normal(size=place.v_size)
    for b in range(len(scene.bodies)):
        x[place.p(b)] /= np.linalg.norm(x[place.p(b)])
        x[place.q(b)] *= 0.05
    return x, v


def moved(scene: Scene, x: np.ndarray, v: np.ndarray, h: float) -> np.ndarray:
    """x after the small time h at the constant velocity v: exact rotation about the body axes."""
    place = layout(scene)
    y = x.copy()
    for b in range(len(scene.bodies)):
        y[place.R(b)] += h * v[place.R_dot(b)]
        y[place.q(b)] += h * v[place.q_dot(b)]
        half = 0.5 * h * v[place.omega(b)]
        angle = np.linalg.norm(half)
        p = x[place.p(b)]
        y[place.p(b)] = np.cos(angle) * p + np.sinc(angle / np.pi) * (G_bar(p).T @ half)
    return y


# ---- one body: mass matrix and forces from the Lagrangian ------------------------------------------------------------


def kinetic_energy(body, R_dot, A, omega, q, q_dot) -> float:
    """Sum over the mass points: no integral of the body is used."""
    mass = np.array(body.provenance["masses"])
    u = body.surface.points + body.surface.Phi @ q
    velocity = R_dot + (np.cross(omega, u) + body.surface.Phi @ q_dot) @ A.T
    return 0.5 * float(mass @ (velocity**2).sum(1))


def test_mass_matrix_is_the_hessian_of_the_kinetic_energy():
    body = cloud(4)
    q, A = RNG.normal(size=4) * 0.1, np.eye(3)
    M = mass_matrix(body, q)
    for _ in range(5):
        y = RNG.normal(size=10)
        energy = kinetic_energy(body, y[:3], A, y[3:6], q, y[6:])
        assert 0.5 * y @ M @ y == pytest.approx(energy, rel=1e-13)


def lagrange_residual(body, R, p, q, v, acc, gravity) -> np.ndarray:
    """d/dt (dL/d(velocity)) - dL/d(position) in the quasi-velocities (A^T R_dot, omega_bar, q_dot), by differences of L.

    For quasi-velocities y the equations are Boltzmann-Hamel's; with the kinetic energy T(q, y) of a free body they are
    d/dt T_v + omega x T_v, d/dt T_omega + omega x T_omega + v x T_v, d/dt T_qdot - T_q.
    """
    h = 1e-6

    def momentum(qq, y):
        return mass_matrix_by_differences(body, qq) @ y

    y, rate = v, acc
    A = rotation_matrix(p)
    P = momentum(q, y)
    dP = (momentum(q + h * y[6:], y + h * rate) - momentum(q - h * y[6:], y - h * rate)) / (2 * h)
    dT = np.array([
        (energy_of(body, q + h * e, y) - energy_of(body, q - h * e, y)) / (2 * h) for e in np.eye(q.size)
    ])  # fmt: skip
    field = A.T @ gravity
    mass = np.array(body.provenance["masses"])
    u = body.surface.points + body.surface.Phi @ q
    weight = np.concatenate([
        mass.sum() * field, np.cross(mass @ u, field), np.einsum("p,pkj,k->j", mass, body.surface.Phi, field)
    ])  # fmt: skip
    return np.concatenate([
        dP[:3] + np.cross(y[3:6], P[:3]),
        dP[3:6] + np.cross(y[3:6], P[3:6]) + np.cross(y[:3], P[:3]),
        dP[6:] - dT + body.omega2 * q,
    ]) - weight  # fmt: skip


def energy_of(body, q, y) -> float:
    return kinetic_energy(body, y[:3], np.eye(3), y[3:6], q, y[6:])


def mass_matrix_by_differences(body, q) -> np.ndarray:
    size = 6 + body.n
    unit = np.eye(size)
    T = [[energy_of(body, q, unit[i] + unit[j]) for j in range(size)] for i in range(size)]
    own = np.array([energy_of(body, q, unit[i]) for i in range(size)])
    return np.array(T) - own[:, None] - own[None, :]


def test_accelerations_satisfy_the_lagrangian_differentiated_numerically():
    body = cloud(5, stiffness=3.0)
    gravity = np.array([0.3, -9.81, 1.0])
    q, q_dot, omega, V = (RNG.normal(size=k) * 0.3 for k in (5, 5, 3, 3))
    p = RNG.normal(size=4)
    p /= np.linalg.norm(p)
    A = rotation_matrix(p)
    forces = (
        quadratic_velocity(body, q, omega, q_dot)
        + elastic_force(body, np.zeros(5), q, q_dot)
        + gravity_force(body, q, A, gravity)
    )
    solution = np.linalg.solve(mass_matrix(body, q), forces)  # a = A^T R_ddot, omega_dot, q_ddot
    y = np.concatenate([A.T @ V, omega, q_dot])
    rate = solution.copy()
    rate[:3] -= np.cross(omega, y[:3])  # d/dt (A^T R_dot) = a - omega x (A^T R_dot)
    residual = lagrange_residual(body, np.zeros(3), p, q, y, rate, gravity)
    assert np.abs(residual).max() < 1e-6 * np.abs(forces).max()


# ---- kernels against twins ----------------------------------------------------------------------------------------


SPECIAL = {"distance": {"length": harmonic(amplitude=0.3, frequency=0.8, phase=0.3, mean=2.0)}, "screw": {"pitch": 0.7}}


def chain(n_first: int = 4, n_second: int = 3, kind: str = "revolute", **joint) -> Scene:
    joint |= SPECIAL.get(kind, {})
    first, second = cloud(n_first, seed=1), cloud(n_second, seed=2)
    return Scene(
        bodies=(Body("one", first, damping=0.02), Body("two", second, damping=0.01)),
        joints=(
            Joint("root", "spherical", "ground.O", "one.a"),
            Joint("tie", kind, "one.b", "two.c", **joint),
        ),
        ground={"O": (0.1, 0.2, 0.3)},
        gravity=(0.5, -9.81, 0.2),
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sizes", [(4, 3), (0, 5), (3, 0), (0, 0), (1, 2)])
def test_compiled_accelerations_and_multipliers_equal_the_dense_solution(kind, sizes):
    scene = chain(*sizes, kind=kind, axis=(0.2, 1.0, 0.3), axis_j=(1.0, -0.5, 0.4))
    system = compile_scene(scene)
    x, v = random_state(scene)
    engine = new_engine(system, x, v)
    assert evaluate_at(engine, 0.0, x, v) == OK
    work, twin = engine.work, equations_of_motion(scene, 0.0, x, v, system.blocks)
    rows, gamma = twin.rows, np.array([row.gamma for row in twin.rows])
    solution, size = np.concatenate([twin.acceleration, twin.lam]), twin.Q.size
    np.testing.assert_allclose(work.rows.Phi, [row.Phi for row in rows], rtol=0, atol=1e-13)
    np.testing.assert_allclose(work.rows.nu, [row.nu for row in rows], rtol=0, atol=1e-12)
    np.testing.assert_allclose(work.rows.gamma, gamma, rtol=0, atol=1e-11)
    scale = np.abs(solution).max()
    np.testing.assert_allclose(work.bodies.acc, solution[:size], rtol=0, atol=1e-10 * scale)
    np.testing.assert_allclose(work.rows.lam, solution[size:], rtol=0, atol=1e-9 * scale)


# ---- products in blocks ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("planes", "blocks"), [(1, 2), (2, 4)])
@pytest.mark.parametrize("rounding", [0.0, 1e-12])
def test_a_symmetric_body_is_computed_in_blocks_and_equals_its_twin(planes, blocks, rounding):
    body = mirrored(24, planes, rounding=rounding)
    scene = Scene(
        bodies=(Body("one", body, damping=0.02), Body("two", cloud(3))),
        joints=(Joint("root", "spherical", "ground.O", "one.a"), Joint("tie", "fixed", "one.b", "two.c")),
        ground={"O": (0.1, 0.2, 0.3)},
        gravity=(0.5, -9.81, 0.2),
    )
    system = compile_scene(scene)
    assert system.model.bodies.blocks[0] == 2 * blocks  # those that are multiplied by q_dot, too, apart
    assert system.model.bodies.PP_dm.size < 0.6 * 9 * 24**2
    x, v = random_state(scene)
    engine = new_engine(system, x, v)
    assert evaluate_at(engine, 0.0, x, v) == OK
    twin = equations_of_motion(scene, 0.0, x, v, system.blocks)
    scale = max(np.abs(twin.acceleration).max(), np.abs(twin.lam).max())
    np.testing.assert_allclose(engine.work.bodies.acc, twin.acceleration, rtol=0, atol=1e-10 * scale)


def products_by_plan(pool, plan, q, q_dot, count, last):
    """sum_i q_i table_i of all components, and sum_i q_dot_i of the last, from their blocks, as `contract` finds them."""
    number, how, early, sums = plan[: EARLY + 2]
    blocks, rest = plan[HEAD : HEAD + 4 * number].reshape(-1, 4), plan[HEAD + 4 * number :]
    order = rest[: q.size] if how == MIXED else np.arange(q.size)
    found, late = np.zeros((2, max(sums, count) + 2 * LANES))
    at = 0
    for first, inputs, out, width in blocks:
        width = -(-width // LANES) * LANES
        block = pool[at : at + inputs * width].reshape(inputs, width)
        found[out : out + width] = q[order][first : first + inputs] @ block
        if out >= early:
            late[out : out + width] = q_dot[order][first : first + inputs] @ block
        at += inputs * width
    if how == WHOLE:
        return found[:count], late[count - last : count]
    place = rest[q.size :] if how == MIXED else placed(rest.reshape(-1, 2), plan[LATE_RUNS], count - last)
    return found[place[:count]], late[place[count - last : count]]


def placed(runs, of_both, early):
    """Where each product is among the sums, by the runs."""
    assert np.count_nonzero(runs[:, 1] >= early) == of_both
    place = np.zeros(runs[-1, 1] + LANES, dtype=int)
    for found, k in runs:
        place[k : k + LANES] = np.arange(found, found + LANES)
    return place


@pytest.mark.parametrize("mixed", [True, False])
def test_blocks_give_the_products_of_the_whole_table(mixed):
    """Also where components vanish, coordinates are in none, and a family's rounding is not zero; families may lie mixed."""
    rng = np.random.default_rng(5)
    n = 30 if mixed else 60
    families = np.arange(n) % 3 if mixed else np.sort(np.arange(n) % 3)
    table = np.zeros((n, 6, n))
    table[:, 0] = rng.normal(size=(n, n)) * (families[:, None] == families)
    table[:, 1] = rng.normal(size=(n, n)) * (families[:, None] + families == 3)
    table[:, 3] = 1e-12
    table[:, 5] = rng.normal(size=(n, n)) * (families[:, None] == families)
    alone = 7 if mixed else 19
    table[alone], table[:, :, alone] = 0.0, 0.0
    table[:, :4] += np.swapaxes(table[:, :4], 0, 2)
    table[:, 4:] -= np.swapaxes(table[:, 4:], 0, 2)
    pool, plan = in_blocks(table, 2, 1e-9)
    assert plan[HOW] == (MIXED if mixed else SORTED)
    assert pool.size < 0.4 * table.size
    table[:, 3] = 0.0  # it was rounding
    q, q_dot = rng.normal(size=(2, n))
    every, last = products_by_plan(pool, plan, q, q_dot, 6 * n, 2 * n)
    np.testing.assert_allclose(every.reshape(6, n), np.einsum("i,icj->cj", q, table), atol=1e-13)
    np.testing.assert_allclose(last.reshape(2, n), np.einsum("i,icj->cj", q_dot, table)[4:], atol=1e-13)


def test_tables_lie_at_the_starts_of_cache_lines():
    system = compile_scene(Scene(bodies=(Body("one", cloud(5)), Body("two", cloud(3)))))
    engine = new_engine(system, *random_state(system.scene), RK4(1e-3))
    for tables in (system.model.bodies, engine.work.rows, engine.work.bodies, engine.tables.stages):
        assert all(array.ctypes.data % 64 == 0 and array.flags.c_contiguous for array in tables if array.size)
    assert engine.work.markers.A is engine.work.bodies.A
    assert engine.tables.x.ctypes.data % 64 == 0


def test_a_body_without_symmetry_and_one_of_few_modes_are_one_block():
    for body in (cloud(20), mirrored(8, 2)):
        bodies = compile_scene(Scene(bodies=(Body("one", body),))).model.bodies
        assert bodies.blocks[0] == 2
        assert bodies.PP_dm.size == body.n * sum(-(-c * body.n // LANES) * LANES for c in (6, 3)) + LANES


def test_equal_bodies_share_what_they_have_by_coordinate_unless_their_damping_differs():
    model = cloud(4)
    ratios = (0.01, 0.05, 0.01)
    bodies = compile_scene(
        Scene(bodies=tuple(Body(f"b{k}", model, damping=r) for k, r in enumerate(ratios)))
    ).model.bodies
    assert bodies.omega2.size == bodies.two_zeta_omega.size == 2 * model.n
    np.testing.assert_array_equal(of_coordinates(bodies, bodies.omega2), np.tile(model.omega2, 3))
    expected = np.concatenate([2 * r * np.sqrt(model.omega2) for r in ratios])
    np.testing.assert_allclose(of_coordinates(bodies, bodies.two_zeta_omega), expected, rtol=1e-15)


# ---- constraints: finite differences ----------------------------------------------------------------------------------


DRIVE = harmonic(amplitude=0.7, frequency=0.8, phase=0.3, mean=0.2)


def constraint_cases():
    return [
        *((kind, sizes, None) for kind in KINDS for sizes in ((4, 3), (0, 0))),
        ("revolute", (4, 3), "angle"),
        ("cylindrical", (4, 3), "stroke"),
        ("translational", (0, 2), "stroke"),
        ("spherical", (3, 2), "path"),
    ]


@pytest.mark.parametrize(("kind", "sizes", "coordinate"), constraint_cases())
def test_jacobian_rate_and_right_hand_side_equal_finite_differences(kind, sizes, coordinate):
    scene = chain(*sizes, kind=kind, axis=(0.2, 1.0, 0.3), axis_j=(1.0, -0.5, 0.4))
    if coordinate == "path":
        scene = replace(scene, drivers=(PointDriver("drive", "one.a", "two.a", x=DRIVE, y=None, z=0.3),))
    elif coordinate:
        scene = replace(scene, drivers=(Driver("drive", "tie", DRIVE, coordinate=coordinate),))
    system = compile_scene(scene)
    x, v = random_state(scene)
    place, h, t = system.layout, 1e-5, 0.37
    acc = np.random.default_rng(5).normal(size=place.v_size)

    def rows_at(s: float):
        """Rows at time t + s along a motion with velocity v and body-axes acceleration acc at s = 0."""
        xs = moved(scene, x, v + 0.5 * s * global_rates(acc), s)
        vs = v + s * global_rates(acc)
        return [
            evaluate_word(scene, place, xs, vs, w, b.markers, drive_of(w, t + s))
            for b in system.blocks
            for w in b.words
        ]

    def global_rates(a):
        out = a.copy()
        for b in range(len(scene.bodies)):
            out[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ a[place.R_dot(b)]
        return out

    here, ahead, behind = rows_at(0.0), rows_at(h), rows_at(-h)
    for row, plus, minus in zip(here, ahead, behind, strict=True):
        assert row.nu == pytest.approx((plus.Phi - minus.Phi) / (2 * h), abs=2e-8)
        nu_dot = (plus.nu - minus.nu) / (2 * h)
        assert row.jacobian @ acc - row.gamma == pytest.approx(nu_dot, abs=2e-7)
    # the Jacobian column by column, time held
    for k in range(place.v_size):
        unit = np.zeros(place.v_size)
        unit[k] = 1.0
        direction = global_rates(unit)

        def value(s, direction=direction):
            xs = moved(scene, x, direction, s)
            return np.array([
                evaluate_word(scene, place, xs, v, w, b.markers, drive_of(w, t)).Phi for b in system.blocks for w in b.words
            ])  # fmt: skip

        slope = (value(h) - value(-h)) / (2 * h)
        np.testing.assert_allclose([row.jacobian[k] for row in here], slope, rtol=0, atol=2e-9)


def test_skew_and_G_bar_conventions():
    p = RNG.normal(size=4)
    p /= np.linalg.norm(p)
    omega = RNG.normal(size=3)
    h = 1e-6
    rate = 0.5 * G_bar(p).T @ omega
    A_dot = (rotation_matrix(p + h * rate) - rotation_matrix(p - h * rate)) / (2 * h)
    np.testing.assert_allclose(A_dot, rotation_matrix(p) @ skew(omega), atol=1e-8)
    np.testing.assert_allclose(2 * G_bar(p) @ rate, omega, atol=1e-14)


@pytest.mark.parametrize(
    ("kind", "coordinate"), [("revolute", "angle"), ("cylindrical", "angle"), ("cylindrical", "stroke")]
)
def test_compiled_drivers_equal_the_readable_ones(kind, coordinate):
    scene = replace(chain(kind=kind), drivers=(Driver("drive", "tie", DRIVE, coordinate=coordinate),))
    system = compile_scene(scene)
    (x, v), t = random_state(scene), 0.37
    engine = new_engine(system, x, v)
    assert evaluate_at(engine, t, x, v) == OK
    work = engine.work
    rows = rows_at(scene, system.layout, list(system.blocks), x, v, t)
    for name in ("Phi", "nu", "gamma"):
        np.testing.assert_allclose(getattr(work.rows, name), [getattr(r, name) for r in rows], rtol=0, atol=1e-11)


TIMES = np.array([0.0, 0.3, 0.7, 1.5, 2.0])
FUNCTIONS = {
    "polynomial": polynomial(1.0, -2.0, 0.5, 3.0),
    "harmonic": DRIVE,
    "table": table(TIMES, np.cos(3 * TIMES)),
    "one piece": table(TIMES[:2], TIMES[:2] ** 2),
}


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=list(FUNCTIONS))
@pytest.mark.parametrize("t", [-0.5, 0.0, 0.1, 0.3, 0.69, 1.9999, 2.0, 2.5])
def test_compiled_time_functions_equal_the_readable_ones(function, t):
    tables = Functions(
        np.array([function.kind]),
        np.array([0, len(function.data)]),
        np.array(function.data, dtype=float),
        np.zeros((0, 3)),
        np.zeros((0, 2), dtype=np.int64),
    )
    out = np.zeros((1, 3))
    evaluate_functions(tables, np.zeros(0), t, out)
    np.testing.assert_allclose(out[0], evaluate(function, t), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=list(FUNCTIONS))
def test_derivatives_of_time_functions_equal_finite_differences(function):
    t, h = 0.11, 1e-5
    _, rate, second = evaluate(function, t)
    ahead, behind = evaluate(function, t + h), evaluate(function, t - h)
    assert rate == pytest.approx((ahead[0] - behind[0]) / (2 * h), abs=1e-7)
    assert second == pytest.approx((ahead[1] - behind[1]) / (2 * h), abs=1e-6)


def test_a_table_passes_through_its_points():
    for t, y in zip(TIMES, np.cos(3 * TIMES), strict=True):
        assert evaluate(FUNCTIONS["table"], t)[0] == pytest.approx(y, abs=1e-12)
