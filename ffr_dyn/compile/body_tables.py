"""Bodies -> the tables that the kernels read: inertia integrals and geometric stiffness, of equal bodies once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from ffr_dyn.compile.symmetry_blocks import in_blocks
from ffr_dyn.equations.inertia import Integrals, damping_matrix, kept_integrals
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.second_order import second_moments
from ffr_dyn.kernels.tables import (
    IN_DAMPING,
    IN_PP_DM,
    IN_Q,
    IN_SHARED,
    IN_V,
    IN_X,
    LANES,
    NORMAL,
    PP_PLAN,
    Bodies,
    N,
)
from ffr_dyn.kernels.vectors import LEAST_PIVOT
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.families import ROUNDING, rounding_of
from ffr_prep.body import axial, remembered
from ffr_prep.common.arrays import Array

SYMMETRIC = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]


def _six(tensor: Array) -> Array:
    """(3, 3, ...) -> (6, ...) symmetric part."""
    rows, columns = SYMMETRIC
    found: Array = 0.5 * (tensor[rows, columns] + tensor[columns, rows])
    return found


def _nine(tensor: Array) -> Array:
    """(3, 3, ...) -> (9, ...) symmetric part and axial vector."""
    return np.concatenate([_six(tensor), axial(tensor)])


def _PP_parts(integrals: Integrals, normal: int) -> Array:
    """(n over i, 9, n over j); of a planar body (n, 3, n): two components in the plane, the axial one across."""
    nine = _nine(integrals.PP_dm)
    return np.moveaxis(nine if normal < 0 else nine[[*np.delete(np.arange(3), normal), 6 + normal]], 1, 0)


def _pool(parts: list[Array]) -> Array:
    return np.concatenate([part.ravel() for part in parts]) if parts else np.zeros(0)


def starts(sizes: Sequence[int] | Array) -> Array:
    """Where parts of these sizes begin one after another, and the end."""
    return np.array(list(accumulate(sizes, initial=0)), dtype=np.int64)


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


@dataclass(frozen=True)
class Blocks:
    """Tables in blocks: pool and starts (or -1 where there is none), plans and their starts."""

    pool: Array
    start: Array
    plans: Array
    first: Array


def tables_in_blocks(owners: Sequence[Hashable], make: Callable[[int], tuple[Array, Array]]) -> Blocks:
    """Tables of one owner are made and stored once; a table of zeros starts at -1, and the kernels skip it.

    make : of an owner by number: pool and plan, the pool in whole rows of lanes, empty where there is none
    """
    stored: dict[Hashable, tuple[Array, Array]] = {}
    for b, owner in enumerate(owners):
        if owner not in stored:
            stored[owner] = make(b)
    pool, first = once([stored[owner][0] for owner in owners], owners)
    plans, first_plan = once([stored[owner][1] for owner in owners], owners)
    for k, owner in enumerate(owners):
        if not stored[owner][0].size:
            first[k] = -1
    padded = np.concatenate([pool, np.zeros(LANES)])  # whole rows of lanes are read
    return Blocks(padded, first, plans.astype(np.int64, copy=False), first_plan)


NO_BLOCKS = np.zeros(0), np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class _Tables:
    """Of one body: parts of the tables; PP_dm in blocks, a pool and a plan; of a rigid one what `RigidBodies` holds of it."""

    mass: float
    moments: Array
    omega2: Array
    P_dm: Array
    rP_dm: Array
    PP_dm: tuple[Array, Array]
    rigid: tuple[Array, Array, Array] | None = None


def _tables(body: Body, normal: int) -> _Tables:
    """Kept with the model: they are the same in every scene."""
    return remembered(
        body.model, ("tables", body.dropped, body.stiffening, normal), lambda: _made(body, kept_integrals(body), normal)
    )


def _made(body: Body, kept: Integrals, normal: int) -> _Tables:
    moments, P_dm = np.concatenate([kept.r_dm, _six(kept.rr_dm)]), kept.P_dm.ravel()
    if not body.model.n:
        rigid = _rigid_inertia(moments, kept.mass, normal)
        return _Tables(kept.mass, moments, kept.omega2, P_dm, P_dm, NO_BLOCKS, rigid)
    return _Tables(
        kept.mass, moments, kept.omega2, P_dm, _nine(kept.rP_dm).ravel(), _second_moments(body, kept, normal)
    )


def _second_moments(body: Body, kept: Integrals, normal: int) -> tuple[Array, Array]:
    """I5, I9 and X: a unit mode has a second moment of one, so the size of their rounding is known."""
    table = _PP_parts(kept, normal)
    if not table.any():
        return NO_BLOCKS
    X = second_moments(body).reshape(9, *kept.I5.shape[1:])
    noise = ROUNDING + rounding_of(X, kept.omega2).max(axis=0)
    return in_blocks(table, table.shape[1] // 3, noise[:, None])


def masses_and_moments(scene: Scene, place: Layout) -> tuple[Array, Array]:
    """`Bodies.mass` and `Bodies.moments`."""
    of = [_tables(body, normal) for body, normal in zip(scene.bodies, place.normals, strict=True)]
    return np.array([i.mass for i in of]), np.array([i.moments for i in of])


class RigidBodies(NamedTuple):
    """What is constant of bodies: of R rigid ones, by numbers (R,), s (R, 3), J (R, 3, 3), L (R, 6, 6); inverse (B, 2), of
    flexible bodies 1 / mass alone. See `BodyWork`."""

    numbers: Array
    s: Array
    J: Array
    L: Array
    inverse: Array


def rigid_bodies(scene: Scene, place: Layout) -> RigidBodies:
    """Of a scene."""
    of = [_tables(body, normal) for body, normal in zip(scene.bodies, place.normals, strict=True)]
    inverse = [(_inverse(i.mass), _inverse(sum(i.rigid[1].diagonal().tolist())) if i.rigid else 0.0) for i in of]
    numbers = [b for b, i in enumerate(of) if i.rigid]
    s, J, L = zip(*(i.rigid for i in of if i.rigid), strict=True) if numbers else ((), (), ())
    return RigidBodies(
        np.array(numbers, dtype=np.int64),
        np.array(s).reshape(-1, 3),
        np.array(J).reshape(-1, 3, 3),
        np.array(L).reshape(-1, 6, 6),
        np.array(inverse),
    )


def _inverse(number: float) -> float:
    """Zero where there is none: such a body is found when it is factorised."""
    return 1.0 / number if number > 0.0 else 0.0


def _rigid_inertia(moments: Array, mass: float, normal: int) -> tuple[Array, Array, Array]:
    """(first moment, inertia tensor, factor as the kernels want it) of a rigid body; -1 for a factor that does not exist."""
    x, y, z, xx, yy, zz, xy, xz, yz = moments.tolist()
    first, J = moments[:3], np.array([[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]])
    M = [
        [mass, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, mass, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, mass, 0.0, 0.0, 0.0],
        [0.0, -z, y, yy + zz, 0.0, 0.0],
        [z, 0.0, -x, -xy, xx + zz, 0.0],
        [-y, x, 0.0, -xz, -yz, xx + yy],
    ]  # the lower triangle, which is all that is read
    moving = list(range(6)) if normal < 0 else [*(c for c in range(3) if c != normal), 3 + normal]
    own = np.array([[M[row][column] for column in moving] for row in moving])
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


def body_tables(scene: Scene, place: Layout, mass: Array, moments: Array) -> Bodies:
    """Tables of all bodies, with these masses and moments."""
    of = [_tables(body, normal) for body, normal in zip(scene.bodies, place.normals, strict=True)]
    owners = [_owner(body) for body in scene.bodies]
    in_plane = [(*owner, k) * (n > 0) for owner, k, n in zip(owners, place.normals, place.n, strict=True)]
    PP = tables_in_blocks(in_plane, lambda b: of[b].PP_dm)
    omega2, column = once([i.omega2 for i in of], owners)
    bounds, beside = zip(*(_damping(body) for body in scene.bodies), strict=True)
    coupled, first = once(beside, owners)
    own = sorted({owner: b for b, owner in reversed([*enumerate(owners)])}.values())  # of each owner the first
    where = np.zeros((len(of) + 1, 9), dtype=np.int64)
    where[:, IN_DAMPING] = where[-1, NORMAL] = -1
    where[:-1, IN_DAMPING] = [start if part.size else -1 for start, part in zip(first, beside, strict=True)]
    where[:-1, N], where[:-1, IN_X], where[:-1, IN_V] = place.n, place.ix, place.iv
    where[:-1, IN_PP_DM], where[:-1, PP_PLAN] = PP.start, PP.first
    where[:-1, NORMAL], where[:-1, IN_SHARED] = place.normals, column
    where[:, IN_Q] = starts(place.n)
    return Bodies(
        where=where,
        mass=mass,
        moments=moments,
        P_dm=_pool([of[b].P_dm for b in own]),
        rP_dm=_pool([of[b].rP_dm for b in own]),
        PP_dm=PP.pool,
        omega2=omega2,
        two_zeta_omega=_pool([bounds[b] for b in own]),
        coupled_damping=coupled,
        blocks=PP.plans,
    )


def _damping(body: Body) -> tuple[Array, Array]:
    """(n,) a diagonal that is no less than the damping matrix, which implicit methods take for it, and (n n,) what it has too
    much; empty where the matrix is diagonal."""
    if not body.model.n:
        return body.damping, body.damping
    if body.model.damping is None:
        return 2 * body.damping * np.sqrt(body.model.omega2), np.zeros(0)
    D = damping_matrix(body.model, body.damping)
    diagonal = np.diag(D)
    rest = D - np.diag(diagonal)
    if not rest.any():
        return diagonal, np.zeros(0)
    bound = diagonal + np.abs(rest).sum(axis=1)
    return bound, (np.diag(bound) - D).ravel()


def _owner(body: Body) -> tuple[Hashable, ...]:
    """Bodies with the same share what they have by coordinate."""
    return id(body.model), body.dropped, body.stiffening, body.damping.tobytes()


def of_coordinates(bodies: Bodies, table: Array) -> Array:
    """(E,) of all elastic coordinates, one body after another, from a table of which equal bodies share their part."""
    return _pool([table[first : first + n] for first, n in bodies.where[:-1, [IN_SHARED, N]]])
