"""Scenes brought into the plane that they are a hair off: places that a mesh leaves beside it, double modes that mix it.

Modes of equal frequency are any combinations of each other, as those in which a square bar bends. Of a body that is symmetric
about the plane, what moves in it and what leaves it have no product in the part of the mass matrix across it, so that the
eigenvectors of this part set them apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ffr_dyn.scene.own_frame import OwnFrame
from ffr_dyn.scene.scene import Body, Scene, altered, body_normal, used_interfaces
from ffr_dyn.variants.variant import with_basis
from ffr_prep.body import PRODUCTS, FlexibleBody, FrameMarker, remembered
from ffr_prep.common.arrays import Array

BESIDE = 1e-6  # of the size of a body: what a mesh leaves of a place in its plane
DOUBLE = 1e-6  # of a squared frequency: what a mesh leaves between equal ones
TURNED = 1e-12  # of a mode of norm one


def size_of(body: FlexibleBody) -> float:
    """[m] the radius of gyration of a body about its origin."""
    xx, yy, zz = body.rr_dm.diagonal().tolist()
    return math.sqrt((xx + yy + zz) / body.mass)


def height_of(model: FlexibleBody, k: int, used: tuple[str, ...]) -> float:
    """[m] along its axis k: where the plane lies about which a body is symmetric, if it is about any.

    That of its centre of mass, exactly through the origin, or through a place that is used, where only a hair is missing.
    """

    def found() -> float:
        centre, near = float(model.centre_of_mass[k]), BESIDE * size_of(model)
        places = [0.0, *(float(i.position[k]) for i in model.interfaces if i.name in used)]
        return next((place for place in places if abs(place - centre) <= near), centre)

    return remembered(model, ("height", k, used), found)


def about_height(model: FlexibleBody, k: int, height: float) -> FlexibleBody:
    """Inertia, places and matrices of rates of a body from an origin that lies higher along its axis k, to judge it by."""
    if not height:
        return model
    up, K = height * np.eye(3)[k], model.stiffening
    first = np.outer(up, model.r_dm)
    rr_dm = model.rr_dm - first - first.T + model.mass * np.outer(up, up)
    rP_dm = model.rP_dm - up[:, None, None] * model.P_dm
    interfaces = tuple(replace(i, position=i.position - up) for i in model.interfaces)
    made = replace(model, r_dm=model.r_dm - model.mass * up, rr_dm=rr_dm, rP_dm=rP_dm, interfaces=interfaces)
    return made if K is None else replace(made, stiffening=_from_above(K, k, height))


def _from_above(stiffening: Array, k: int, height: float) -> Array:
    """Load matrices of rates about the higher origin: it is accelerated by them, along the axis by -height (w_c)^2, along c
    by height w_c w_k."""
    K = np.array(stiffening)
    for number, (c, d) in enumerate(PRODUCTS, start=6):
        if c == d != k:
            K[number] += height * K[k]
        elif c != d and k in (c, d):
            K[number] -= height * K[c + d - k]
    return K


def levelled(scene: Scene, normal: int) -> Scene:
    """The scene with places that are used in the middle plane of their body, and bodies at one height, where only a hair is
    missing; itself where nothing is."""
    near = BESIDE * max(size_of(body.model) for body in scene.bodies)
    places = [*(body.position for body in scene.bodies), *scene.ground.values()]
    heights = _merged([float(place[normal]) for place in places], near)
    bodies = tuple(_flat(scene, body, body_normal(body, normal), normal, next(heights)) for body in scene.bodies)
    ground = {name: _with(point, normal, next(heights)) for name, point in scene.ground.items()}
    changed = [new is not old for new, old in zip(bodies, scene.bodies, strict=True)]
    changed += [ground[name] is not point for name, point in scene.ground.items()]
    return altered(scene, bodies=bodies, ground=ground) if any(changed) else scene


def _merged(heights: list[float], near: float) -> Iterator[float]:
    """The heights, those that are near to each other made equal."""
    merged, last = list(heights), -math.inf
    for k in sorted(range(len(heights)), key=heights.__getitem__):
        last = merged[k] = last if merged[k] - last <= near else merged[k]
    return iter(merged)


def _with(point: Array, axis: int, value: float) -> Array:
    if point[axis] == value:
        return point
    out = np.array(point, float)
    out[axis] = value
    out.setflags(write=False)
    return out


def _flat(scene: Scene, body: Body, k: int, normal: int, height: float) -> Body:
    position = _with(body.position, normal, height)
    model = _without_hairs(body.model, k, used_interfaces(scene, body)) if k >= 0 else body.model
    same = position is body.position and model is body.model
    return body if same else altered(body, position=position, model=model)


def _without_hairs(model: FlexibleBody, k: int, used: tuple[str, ...]) -> FlexibleBody:
    """The body with used places that are next to its middle plane in it."""
    near, height = BESIDE * size_of(model), height_of(model, k, used)
    hair = tuple(i.name for i in model.interfaces if i.name in used and 0 < abs(i.position[k] - height) <= near)

    def make() -> FlexibleBody:
        moved = (replace(i, position=_with(i.position, k, height)) if i.name in hair else i for i in model.interfaces)
        return replace(model, interfaces=tuple(moved))

    return remembered(model, ("without hairs", k, hair), make) if hair else model


def basis_in_plane(body: Body, k: int) -> Array | None:
    """(n, n) double modes of a body combined into those in the plane across body axis k and those across it, each in the
    place of the one it is most of; None where nothing is to be turned."""
    if not body.model.n:
        return None
    V = np.eye(body.model.n)
    for group in _groups(body):
        vectors = np.linalg.eigh(body.model.PP_dm[k, k][np.ix_(group, group)])[1]
        if np.abs(vectors).max(axis=0).min() < 1.0 - TURNED:
            V[np.ix_(group, group)] = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), range(len(group))])
    return None if (np.eye(body.model.n) == V).all() else V


def _groups(body: Body) -> Iterator[list[int]]:
    """Numbers of modes of equal frequency and damping, two or more."""
    omega2 = body.model.omega2
    order = np.argsort(omega2, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(omega2[order]) > DOUBLE * omega2[order][1:]) + 1):
        if group.size > 1 and np.ptp(body.damping[group]) == 0:
            yield group.tolist()


def combined(body: Body, V: Array) -> Body:
    """The body in the coordinates p, q = V p, with what it says of itself in its own."""
    n = body.model.n
    still = FrameMarker(np.zeros(3), np.zeros((3, n)), np.zeros((3, n)), np.zeros((6, n, n)))
    own = OwnFrame(body.model, still, np.eye(n))
    frame = (body.frame or own).combined(V)
    return replace(body, model=with_basis(body.model, V), frame=frame, q=V.T @ body.q, q_dot=V.T @ body.q_dot)
