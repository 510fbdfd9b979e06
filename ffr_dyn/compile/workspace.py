"""Memory for a compiled scene: scratch of evaluations, what an integrator keeps, and rows of results."""

from __future__ import annotations

from collections.abc import Hashable
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ffr_dyn.compile.alignment import Piece, copied, in_one_piece
from ffr_dyn.compile.body_tables import starts
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.functions.rotation import skew
from ffr_dyn.kernels.tables import (
    IN_Q,
    LANES,
    MOST_PASSED,
    NORMAL,
    BodyWork,
    Clock,
    Control,
    LoadWork,
    MarkerWork,
    Model,
    N,
    Record,
    RowWork,
    Stages,
    Tables,
    Work,
)
from ffr_dyn.kernels.vectors import LEAST_PIVOT
from ffr_prep.common.arrays import Array

if TYPE_CHECKING:
    from ffr_dyn.integrators import Integrator

MOST, LARGE = 32, 100_000  # pieces of memory that are known, and numbers of one that is not

_BLANK: dict[Hashable, Piece[Tables]] = {}


class _Needs(NamedTuple):
    """What memory depends on beside the scene: states, rows, numbers and steps that a method keeps, and which kind it is."""

    states: int = 0
    rows: int = 0
    numbers: int = 0
    kept: int = 0
    controlled: bool = False
    keeps_terms: bool = False
    keeps_passed: bool = False


def new_tables(system: System, method: Integrator | None, keeps_passed: bool) -> tuple[Tables, Array]:
    """Memory for a scene and a method (none: evaluations alone), and its words (`pack`), those of the model left open.

    keeps_passed : whether positions beside singular ones are kept

    Scenes of one structure have the same but for the numbers that `_fill` and an engine put there. What depends on the
    elastic diagonal is made when that is set.
    """
    needs = _Needs(keeps_passed=keeps_passed)
    if method is not None:
        kept = 2 if method.repeatable else 0
        sizes = method.stage_count, method.row_stages, len(method.numbers), kept
        needs = _Needs(*sizes, method.controlled, method.keeps_terms, keeps_passed)
    key = _structure(system.model), needs, len(system.kernels)
    blank = _BLANK.get(key)
    if blank is None:
        blank = in_one_piece(_blank(system, needs), but="model")
        if len(_BLANK) >= MOST:
            _BLANK.clear()
        if blank.numbers.size < LARGE:
            _BLANK[key] = blank
    tables, words = copied(blank)
    _fill(tables.work, system.model)
    return tables._replace(model=system.model), words


def _blank(system: System, needs: _Needs) -> Tables:
    X, V = system.layout.x_size, system.layout.v_size
    chosen = {"numbers": 8, "weight_x": X, "weight_v": V, "x": X, "v": V, "held_x": X, "held_v": V}
    return Tables(
        address=0,
        entry_points=np.zeros(len(system.chosen), dtype=np.int64),
        forces=np.zeros(len(system.kernels), dtype=np.int64),
        model=(),  # type: ignore[arg-type]  # each scene has its own
        work=_blank_work(system.model, needs.keeps_terms, needs.keeps_passed),
        stages=_stages(system, needs),
        clock=Clock(
            np.array([0.0, 0.0, -np.inf, np.inf]), np.full(3, np.inf), np.zeros(3, dtype=np.int64), np.zeros(3)
        ),
        control=Control(
            counts=np.zeros(2, dtype=np.int64),
            **_zeros(**{key: size * needs.controlled for key, size in chosen.items()}),
        ),
        **_zeros(x=X, v=V),
    )


def _stages(system: System, needs: _Needs) -> Stages:
    X, V, C = system.layout.x_size, system.layout.v_size, system.model.rows.kind.size
    states, kept = needs.states, needs.kept
    rows = _zeros(rows=(needs.rows, C), target=C, numbers=needs.numbers)
    return Stages(**_zeros(x=(states, X), v=(states, V), kept_x=(kept, X), kept_v=(kept, V)), **rows)


def _structure(m: Model) -> Hashable:
    """All that the scratch of a scene is made by, but for the numbers in it."""
    tables = (m.bodies.where, m.rows.start, m.rows.marker, m.pattern.column_start, m.markers.body)
    sizes = (
        m.bodies.omega2,
        m.bodies.coupled_damping,
        m.markers.phi,
        m.functions.kind,
        m.loads.initial,
        m.loads.kinked,
        m.pattern.sample,
    )
    arrays = b"".join(table.tobytes() for table in tables), m.rows.marker.shape, tuple(map(len, sizes))
    return arrays, m.user_count, m.relaxation > 0.0


def _fill(work: Work, m: Model) -> None:
    """Put in what is constant: shapes of linear bodies, factors of rigid ones, what forces measure at the start."""
    bodies = work.bodies
    work.markers.phi[:] = work.markers.kept[:] = m.markers.phi
    work.loads.reference[:] = m.loads.initial
    bodies.inverse[:, 0] = [_inverse(mass) for mass in m.bodies.mass.tolist()]
    for b in np.flatnonzero(m.bodies.where[:-1, N] == 0).tolist():
        numbers = m.bodies.moments[b].tobytes(), float(m.bodies.mass[b])
        bodies.s[b], bodies.J[b], bodies.L[b] = _rigid_inertia(*numbers, int(m.bodies.where[b, NORMAL]))
        xx, yy, zz = bodies.J[b].diagonal().tolist()
        bodies.inverse[b, 1] = _inverse(xx + yy + zz)


def _blank_work(m: Model, keeps_terms: bool, keeps_passed: bool) -> Work:
    V, n = 6 * m.bodies.mass.size + int(m.bodies.where[-1, IN_Q]), m.bodies.where[:, N]
    F = m.functions.kind.size
    bodies = _body_work(m, keeps_terms)
    return Work(
        bodies=bodies,
        markers=_marker_work(m, bodies),
        rows=_row_work(m),
        loads=_load_work(m, V, m.bodies.mass.size + V),
        field=np.zeros(3),
        diagonal=np.full(1, -1.0),
        implicit=np.array([0.0, 0.0, 0.0, 1.0, 0.0]),
        info=np.zeros(3, dtype=np.int64),
        independence=np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, *np.zeros(MOST_PASSED)]),
        **_zeros(vd=V, y=(2, 6 + int(n.max())), functions=(F, 3), earlier=(F, 3), user=m.user_count, drift=4),
        passed=np.zeros((MOST_PASSED + 1, m.bodies.mass.size + V) if keeps_passed else (0, 0)),
    )


def _marker_work(m: Model, bodies: BodyWork) -> MarkerWork:
    """Scratch of the markers; the axes of rigid bodies, which are constant, are in it."""
    M = m.markers.body.size
    return MarkerWork(
        body=m.markers.body,
        A=bodies.A,
        omega=bodies.omega,
        **_zeros(phi=m.markers.phi.size, kept=m.markers.phi.size),
        R=_identities(M),
        T=_identities(M),
        bent=np.zeros(2 * (6 * int(m.bodies.where[:, N].max()) + LANES)),
        sorted=bodies.sorted,
        **_zeros(r=(M, 3), rd=(M, 3), rb=(M, 3), u=(M, 3), spin=(M, 3), turning=(M, 3), six=(3, 6)),
    )


def _zeros(**shapes: Any) -> dict[str, Array]:
    return {key: np.zeros(shape) for key, shape in shapes.items()}


def _body_work(m: Model, keeps_terms: bool) -> BodyWork:
    """Scratch of the bodies."""
    B, E, n = m.bodies.mass.size, int(m.bodies.where[-1, IN_Q]), m.bodies.where[:, N]
    V, longest = 6 * B + E, int(n.max())
    spaced = n[:-1] + LANES  # sums in whole rows of lanes end beyond the terms
    terms = int(spaced.sum() if keeps_terms else spaced.max(initial=0))
    return BodyWork(
        A=_identities(B + 1),
        dinv=np.ones(m.bodies.omega2.size),
        terms=starts(spaced)[:-1] * keeps_terms,
        **_zeros(omega=(B + 1, 3), s=(B, 3), J=(B, 3, 3), inverse=(B, 2), g=9 * terms, l=3 * terms),
        sorted=np.zeros(42 * longest + 6 * LANES),
        **_zeros(H=3 * E, L=(B, 6, 6), f=V, acc=V, T=(B, 3, 3), rigid=(B, 6)),
        **_zeros(more=V, settled=V if m.bodies.coupled_damping.size else 0, solved=V * (m.relaxation > 0.0)),
    )


def _row_work(m: Model) -> RowWork:
    K, D = m.rows.marker.shape
    C, M, pairs = m.rows.kind.size, m.markers.body.size, m.pattern.sample.size
    size = np.diff(m.rows.start)
    column = np.repeat(np.arange(K), np.diff(m.pattern.column_start))
    stored = LANES * int(size.sum() + size[column].sum())
    return RowWork(
        **_zeros(Phi=C, nu=C, gamma=C, lam=C, left=C, reacted=C * (m.relaxation > 0.0)),
        **_zeros(jac=(K * D, 9, LANES), kept=(K * D, 9, LANES), X=K * D * 12 * LANES, Y=12 * LANES),
        **_zeros(scale=K * LANES, least=K * LANES, pivots=K * LANES, step=K * LANES),
        **_zeros(compliance=K * LANES, pull=K * LANES, relief=K * LANES),
        **_zeros(along=(4, C), begun=(2, C), grown=(3, 2, C), held=(3, C)),
        **_zeros(wrench=6, P=(M, 36), phiphi=(pairs, 36), S=stored),
    )


def _inverse(number: float) -> float:
    """Zero where there is none: such a body is found when it is factorised."""
    return 1.0 / number if number > 0.0 else 0.0


@lru_cache(1024)
def _rigid_inertia(moments: bytes, mass: float, normal: int) -> tuple[Array, Array, Array]:
    """(first moment, inertia tensor, factor as the kernels want it) of a rigid body; -1 for a factor that does not exist.

    Of its numbers in `Bodies`, by which the last bodies are known: every run of a scene asks for them again.
    """
    first = np.frombuffer(moments)[:3]
    xx, yy, zz, xy, xz, yz = np.frombuffer(moments)[3:].tolist()
    J = np.array([[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]])
    M, s = np.zeros((6, 6)), skew(first)
    M[:3, :3].flat[::4] = mass
    M[:3, 3:], M[3:, :3], M[3:, 3:] = -s, s, J
    moving = list(range(6)) if normal < 0 else [*(c for c in range(3) if c != normal), 3 + normal]
    own = M[moving][:, moving]
    try:
        factor = np.linalg.cholesky(own)
    except np.linalg.LinAlgError:
        return first, J, np.full((6, 6), -1.0)
    pivots = factor.diagonal()
    if (pivots**2 <= LEAST_PIVOT * own.diagonal()).any():
        return first, J, np.full((6, 6), -1.0)
    factor.flat[:: len(moving) + 1] = 1.0 / pivots
    L = np.eye(6)
    for row, k in zip(factor, moving, strict=True):
        L[k, moving] = row
    return first, J, L


def _load_work(m: Model, V: int, X: int) -> LoadWork:
    kinks = len(m.loads.kinked)
    return LoadWork(
        reference=np.zeros(m.loads.initial.size),
        measured=np.zeros(m.loads.initial.size),
        axes=np.zeros((2, 4, 3, 3)),
        turn=np.zeros((3, 3, 3)),
        curved=np.zeros(6),
        f=np.zeros(V),
        **_zeros(passing=(kinks, 4), x=X * (kinks > 0), v=V * (kinks > 0)),
    )


def _identities(count: int) -> Array:
    return np.repeat(np.eye(3)[None], count, axis=0)


def new_record(system: System, rows: int) -> Record:
    """Room for `rows` output times."""
    m, place = system.model, system.layout
    M, K = m.markers.body.size, m.rows.marker.shape[0]
    return Record(
        np.zeros(rows),
        np.zeros((rows, place.x_size)),
        np.zeros((rows, place.v_size)),
        np.zeros((rows, place.v_size)),
        np.zeros((rows, M, 3)),
        np.zeros((rows, M, 3)),
        np.zeros((rows, K, 6)),
        np.zeros((rows, m.loads.initial.size)),
        np.zeros((rows, m.functions.kind.size, 3)),
        np.zeros((rows, m.loads.row.shape[0])),
        np.zeros((rows, 3)),
        np.zeros((rows, 2)),
    )
