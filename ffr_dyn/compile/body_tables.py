"""Bodies -> the tables that the kernels read: inertia integrals and geometric stiffness, of equal bodies once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.symmetry_blocks import in_blocks, symmetric_blocks
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.second_order import load_matrices
from ffr_dyn.kernels.tables import (
    IN_PP_DM,
    IN_Q,
    IN_SHARED,
    IN_STIFFENING,
    IN_V,
    IN_X,
    K_PLAN,
    K_SIZE,
    LANES,
    NORMAL,
    PP_PLAN,
    Bodies,
    Markers,
    N,
)
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.plane import stiffening_loads
from ffr_prep.body import axial
from ffr_prep.common.arrays import Array

ROUNDING = 1e-8  # of I5 and I9 of unit modes: what symmetry leaves of zeros
STIFFNESS_ROUNDING = 1e-7  # the same of the stiffness by a load, relative to its largest: slopes are rougher
SYMMETRIC = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _six(tensor: Array) -> Array:
    """(3, 3, ...) -> (6, ...) symmetric part."""
    return np.stack([0.5 * (tensor[k, l] + tensor[l, k]) for k, l in SYMMETRIC])  # noqa: E741


def _nine(tensor: Array) -> Array:
    """(3, 3, ...) -> (9, ...) symmetric part and axial vector."""
    return np.concatenate([_six(tensor), axial(tensor)])


def _parts(tensor: Array, symmetric: bool, skew: bool) -> Array:
    """`_nine` of a tensor, with zeros for a part that is left out."""
    nine = _nine(tensor)
    nine[:6] *= symmetric
    nine[6:] *= skew
    return nine


def _rP_parts(body: Body) -> Array:
    return _parts(body.model.rP_dm, "I8" not in body.dropped, "I4" not in body.dropped)


def _PP_parts(body: Body, normal: int) -> Array:
    """(n over i, 9, n over j); of a planar body (n, 3, n): two components in the plane, the axial one across."""
    nine = _parts(body.model.PP_dm, "I9" not in body.dropped, "I5" not in body.dropped)
    return np.moveaxis(nine if normal < 0 else nine[[*np.delete(np.arange(3), normal), 6 + normal]], 1, 0)


def _pool(parts: list[Array]) -> Array:
    return np.concatenate([np.ravel(p) for p in parts]) if parts else np.zeros(0)


def starts(sizes: Sequence[int] | Array) -> Array:
    """Where parts of these sizes begin one after another, and the end."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).astype(np.int64)


def once(parts: Sequence[Array], owners: Sequence[Hashable]) -> tuple[Array, Array]:
    """(pool, starts): parts of one owner are stored once, so that many equal bodies stay in the processor's cache."""
    first: dict[Hashable, int] = {}
    stored: list[Array] = []
    size = 0
    for part, owner in zip(parts, owners, strict=True):
        if owner not in first:
            first[owner] = size
            stored.append(part)
            size += part.size
    return _pool(stored), np.array([first[owner] for owner in owners], dtype=np.int64)


_NONE = np.zeros(0), np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class _Blocks:
    """Tables of all bodies in blocks: pool and starts (or -1), plans and starts."""

    pool: Array
    start: Array
    plans: Array
    first: Array


def _in_blocks(owners: Sequence[Hashable], make: Callable[[int], tuple[Array, Array]]) -> _Blocks:
    """Tables of one owner are made and stored once; a table of zeros starts at -1, and the kernels skip it.

    make : of a body by number: pool and plan, the pool empty where there is none
    """
    stored: dict[Hashable, tuple[Array, Array]] = {}
    for b, owner in enumerate(owners):
        if owner not in stored:
            stored[owner] = make(b)
    pool, first = once([stored[owner][0] for owner in owners], owners)
    plans, first_plan = once([stored[owner][1] for owner in owners], owners)
    zero = np.array([not stored[owner][0].size for owner in owners], dtype=bool)
    return _Blocks(pool, np.where(zero, -1, first), plans.astype(np.int64), first_plan)


def body_tables(scene: Scene, place: Layout, marked: Markers) -> Bodies:
    """Tables of all bodies; `marked` tells at which interfaces anything acts."""
    models = [body.model for body in scene.bodies]
    n = [m.n for m in models]
    owners = [_owner(body) for body in scene.bodies]
    PP = _second_moments(scene, place)
    omega2, column = once([m.omega2 for m in models], owners)
    damping, _ = once([2 * b.damping * np.sqrt(b.model.omega2) for b in scene.bodies], owners)
    P, _ = once([b.model.P_dm * ("I3" not in b.dropped) for b in scene.bodies], owners)
    rP, _ = once([_rP_parts(b) for b in scene.bodies], owners)
    K, sizes = _stiffness(scene, marked)
    where = np.zeros((len(n) + 1, 11), dtype=np.int64)
    where[-1, NORMAL] = -1
    where[:-1, [N, IN_X, IN_V, IN_Q]] = np.column_stack([n, place.ix, place.iv, starts(n)[:-1]])
    where[:-1, [IN_PP_DM, PP_PLAN]] = np.column_stack([PP.start, PP.first])
    where[:-1, [IN_STIFFENING, K_PLAN, K_SIZE]] = np.column_stack([K.start, len(PP.plans) + K.first, sizes])
    where[:-1, [NORMAL, IN_SHARED]] = np.column_stack([place.normals, column])
    where[-1, IN_Q] = sum(n)
    return Bodies(
        where=where,
        mass=np.array([m.mass for m in models]),
        moments=np.array([np.concatenate([m.r_dm, _six(m.rr_dm)]) for m in models]),
        P_dm=P,
        rP_dm=rP,
        PP_dm=np.concatenate([PP.pool, np.zeros(LANES)]),  # whole rows of lanes are read
        omega2=omega2,
        two_zeta_omega=damping,
        stiffening=K.pool,
        blocks=np.concatenate([PP.plans, K.plans]),
    )


def _owner(body: Body) -> tuple[Hashable, ...]:
    """Bodies with the same share what they have by coordinate."""
    return id(body.model), body.dropped, body.damping.tobytes()


def of_coordinates(bodies: Bodies, table: Array) -> Array:
    """(E,) of all elastic coordinates, one body after another, from a table of which equal bodies share their part."""
    return _pool([table[first : first + n] for first, n in bodies.where[:-1, [IN_SHARED, N]]])


def _second_moments(scene: Scene, place: Layout) -> _Blocks:
    """I5 and I9 of all bodies: a unit mode has a second moment of one, so the size of their rounding is known."""

    def make(b: int) -> tuple[Array, Array]:
        table = _PP_parts(scene.bodies[b], place.normals[b])
        return in_blocks(table, table.shape[1] // 3, np.full(table.shape[1], ROUNDING)) if table.any() else _NONE

    owners = [(id(body.model), body.dropped, k) for body, k in zip(scene.bodies, place.normals, strict=True)]
    return _in_blocks(owners, make)


def _stiffness(scene: Scene, marked: Markers) -> tuple[_Blocks, list[int]]:
    """The geometric stiffness of all bodies, and how many numbers of it they keep."""
    acting = [_acting(numbers) for numbers in _used_markers(scene, marked)]
    owners = [(id(body.model), body.stiffening, loads) for body, loads in zip(scene.bodies, acting, strict=True)]

    def make(b: int) -> tuple[Array, Array]:
        K = load_matrices(scene.bodies[b])
        loads = np.intersect1d(stiffening_loads(K), acting[b]).astype(np.int64)
        noise = STIFFNESS_ROUNDING * np.abs(K[loads]).max(axis=(1, 2), initial=0.0)
        return symmetric_blocks(K[loads], loads, noise) if loads.size else _NONE

    blocks = _in_blocks(owners, make)
    return blocks, [_kept(blocks, b) for b in range(len(owners))]


def _kept(blocks: _Blocks, b: int) -> int:
    """How many numbers a sum of the matrices of body b has."""
    plan = blocks.plans[blocks.first[b] :]
    return 0 if blocks.start[b] < 0 else int(plan[4 : 4 + 2 * plan[0] : 2].sum())


def loads_that_stiffen(bodies: Bodies, b: int) -> Array:
    """Numbers of the loads of body b that its stiffness depends on."""
    if bodies.where[b, K_SIZE] == 0:
        return np.zeros(0, dtype=np.int64)
    plan = bodies.blocks[bodies.where[b, K_PLAN] :]
    first = 3 + 2 * plan[0] + 2 * bodies.where[b, N]
    return np.sort(plan[first : first + plan[3 : 3 + 2 * plan[0] : 2].sum()])


def _used_markers(scene: Scene, marked: Markers) -> list[list[int]]:
    """Per body, the numbers among its loads of the forces at markers that anything acts on."""
    used: list[list[int]] = [[] for _ in scene.bodies]
    for k in marked.active:
        if marked.load[k] >= 0:
            used[marked.body[k]].append(int(marked.load[k]))
    return used


def _acting(firsts: list[int]) -> tuple[int, ...]:
    """Which loads a body may have: twelve inertial ones, and those at interfaces that anything acts on."""
    return (*range(12), *(first + c for first in firsts for c in range(6)))
