"""Memory for a compiled scene: scratch of evaluations, what an integrator keeps, and rows of results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ffr_dyn.compile.alignment import Piece, copied, in_one_piece
from ffr_dyn.compile.body_tables import starts
from ffr_dyn.compile.first_use import ensure_compiled
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.equations.layout import Layout
from ffr_dyn.kernels.entry_points import step
from ffr_dyn.kernels.simd.force_kernel import kernel_of
from ffr_dyn.kernels.tables import (
    IN_Q,
    LANES,
    MOST_PASSED,
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
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array

if TYPE_CHECKING:
    from ffr_dyn.integrators import Integrator


class _Needs(NamedTuple):
    """What memory depends on beside the scene: states, rows, numbers and steps that a method keeps, and which kind it is."""

    states: int = 0
    rows: int = 0
    numbers: int = 0
    kept: int = 0
    controlled: bool = False
    keeps_terms: bool = False
    keeps_passed: bool = False


def memory_of(system: System, method: Integrator | None) -> Piece[Tables]:
    """Memory for a scene and a method (none: evaluations alone), to be copied, with the addresses of what they call.

    Scenes of one structure have the same; words of the model are left open. The first one of a kind waits until what it
    needs is compiled.
    """
    kinds: tuple[type[Integrator], ...] = ()
    needs = _Needs()
    if method is not None:
        kept = 2 if method.repeatable else 0
        sizes = method.stage_count, method.row_stages, len(method.numbers), kept
        kinds, needs = (type(method),), _Needs(*sizes, method.controlled, method.keeps_terms, True)
    if not system.structure.shared:
        return _memory(system, kinds, needs)
    return remembered(system.structure, ("memory", kinds, needs), lambda: _memory(system, kinds, needs))


def _memory(system: System, kinds: tuple[type[Integrator], ...], needs: _Needs) -> Piece[Tables]:
    chosen, forces = system.chosen, system.kernels
    ensure_compiled(*kinds, chosen=chosen, forces=forces)
    addresses = np.array([0 if each is None else each.address for each in chosen], dtype=np.int64)
    for kind in kinds:
        addresses[step.number] = kind.do_step.address
    kernels = np.array([kernel_of(kernel).address for kernel in forces], dtype=np.int64)
    return in_one_piece(_blank(system, needs, addresses, kernels), but="model")


def new_tables(system: System, memory: Piece[Tables]) -> tuple[Tables, Array]:
    """Memory of its own for a scene, and its words (`pack`), those of the model left open.

    In it is what is constant: shapes of linear bodies, factors of rigid ones, what forces measure at the start. What depends
    on the elastic diagonal is made when that is set.
    """
    tables, words = copied(memory)
    work, m, rigid = tables.work, system.model, system.rigid
    work.markers.phi[:] = work.markers.kept[:] = m.markers.phi
    work.loads.reference[:] = m.loads.initial
    bodies = work.bodies
    bodies.inverse[:] = rigid.inverse
    bodies.s[rigid.numbers], bodies.J[rigid.numbers], bodies.L[rigid.numbers] = rigid.s, rigid.J, rigid.L
    return tables._replace(model=m), words


def _blank(system: System, needs: _Needs, entry_points: Array, forces: Array) -> Tables:
    X, V = system.layout.x_size, system.layout.v_size
    chosen = {"numbers": 8, "weight_x": X, "weight_v": V, "x": X, "v": V, "held_x": X, "held_v": V}
    return Tables(
        address=0,
        entry_points=entry_points,
        forces=forces,
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
        **_zeros(more=V, settled=V if m.bodies.coupled_damping.size else 0),
        **_zeros(solved=V * (m.relaxation > 0.0), search=(2, V * (m.relaxation > 0.0))),
    )


def _row_work(m: Model) -> RowWork:
    K, D = m.rows.marker.shape
    C, M, pairs = m.rows.kind.size, m.markers.body.size, m.pattern.sample.size
    size = np.diff(m.rows.start)
    column = np.repeat(np.arange(K), np.diff(m.pattern.column_start))
    stored = LANES * int(size.sum() + size[column].sum())
    return RowWork(
        **_zeros(Phi=C, nu=C, gamma=C, lam=C, left=C),
        **_zeros(reacted=C * (m.relaxation > 0.0), search=(5, C * (m.relaxation > 0.0))),
        **_zeros(jac=(K * D, 9, LANES), kept=(K * D, 9, LANES), X=K * D * 12 * LANES, Y=12 * LANES),
        **_zeros(scale=K * LANES, least=K * LANES, pivots=K * LANES, step=K * LANES),
        **_zeros(compliance=K * LANES, pull=K * LANES, relief=K * LANES),
        **_zeros(along=(4, C), begun=(2, C), grown=(3, 2, C), held=(3, C)),
        **_zeros(wrench=6, P=(M, 36), phiphi=(pairs, 36), S=stored),
    )


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
    return Record(**{name: np.zeros((rows, *shape)) for name, shape in row_shapes(system).items()})


def row_shapes(system: System) -> dict[str, tuple[int, ...]]:
    """Of a row, the shape of its part of each column of a record; scenes of one structure share them."""
    return remembered(system.structure, "row", lambda: _row_shapes(system.model, system.layout))


def _row_shapes(m: Model, place: Layout) -> dict[str, tuple[int, ...]]:
    M, K, X, V = m.markers.body.size, m.rows.marker.shape[0], place.x_size, place.v_size
    of_forces = {
        "forces": (m.loads.initial.size,),
        "functions": (m.functions.kind.size, 3),
        "power": (len(m.loads.row),),
    }
    states = {"time": (), "x": (X,), "v": (V,), "vd": (V,)}
    return {**states, "r": (M, 3), "rd": (M, 3), "reaction": (K, 6), **of_forces, "energy": (3,), "violation": (2,)}
