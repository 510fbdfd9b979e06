"""Every slice of the state: positions x = [R, p, q] and velocities v = [R_dot, omega_bar, q_dot] of body after body."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ffr_dyn.functions.rotation import from_vector, product, rotation_matrix
from ffr_dyn.scene.scene import Scene, body_normal, length_of
from ffr_dyn.variants.plane import AXES
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief

ROUNDING = 2e-15  # of a row of constraints, over the longest vector that it is a difference of


@dataclass(frozen=True, repr=False)
class Layout(Brief):
    """Where each body's coordinates begin in x and v, how many elastic coordinates it has, and what may move.

    normals : per body, the body axis along the normal of a planar scene, or -1
    """

    n: tuple[int, ...]
    ix: tuple[int, ...]
    iv: tuple[int, ...]
    x_size: int
    v_size: int
    normals: tuple[int, ...]

    def R(self, b: int) -> slice:
        return slice(self.ix[b], self.ix[b] + 3)

    def p(self, b: int) -> slice:
        return slice(self.ix[b] + 3, self.ix[b] + 7)

    def q(self, b: int) -> slice:
        return slice(self.ix[b] + 7, self.ix[b] + 7 + self.n[b])

    def R_dot(self, b: int) -> slice:
        return slice(self.iv[b], self.iv[b] + 3)

    def omega(self, b: int) -> slice:
        return slice(self.iv[b] + 3, self.iv[b] + 6)

    def q_dot(self, b: int) -> slice:
        return slice(self.iv[b] + 6, self.iv[b] + 6 + self.n[b])

    def rigid(self, b: int) -> slice:
        """R_dot and omega_bar together."""
        return slice(self.iv[b], self.iv[b] + 6)

    def active(self, b: int) -> list[int]:
        """The rigid coordinates of body b that may move (body axes, among its velocities): all six, or three in a plane."""
        k = self.normals[b]
        return list(range(6)) if k < 0 else [c for c in range(3) if c != k] + [3 + k]


def layout(scene: Scene) -> Layout:
    """The slices of a scene."""
    n = tuple(body.model.n for body in scene.bodies)
    ix = tuple(accumulate((7 + k for k in n), initial=0))
    iv = tuple(accumulate((6 + k for k in n), initial=0))
    normals = [body_normal(b, AXES.index(scene.plane)) if scene.plane in AXES else -1 for b in scene.bodies]
    return Layout(n, ix[:-1], iv[:-1], ix[-1], iv[-1], tuple(normals))


def initial_state(scene: Scene, place: Layout) -> tuple[Array, Array]:
    """(x, v) as the scene's bodies declare them, before assembly."""
    x, v = np.zeros(place.x_size), np.zeros(place.v_size)
    for b, body in enumerate(scene.bodies):
        x[place.R(b)], x[place.p(b)], x[place.q(b)] = body.position, body.rotation, body.q
        v[place.R_dot(b)], v[place.omega(b)], v[place.q_dot(b)] = body.velocity, body.omega_bar, body.q_dot
    return x, v


def velocity_sizes(scene: Scene, place: Layout) -> Array:
    """(V,) velocities that move and bend each body by about its size, and turn it by a radian, in a second; bodies without a
    size of their own are taken as large as the largest, or as the scene."""
    sizes, largest = np.ones(place.v_size), max(body.model.size for body in scene.bodies) or length_of(scene)
    for b, body in enumerate(scene.bodies):
        sizes[place.R_dot(b)] = size = body.model.size or largest
        sizes[place.q_dot(b)] = size * np.sqrt(body.model.mass)
    return sizes


def meets(scene: Scene, x: Array, Phi: Array, tolerance: float) -> bool:
    """Whether rows Phi (C,) [m, -] vanish to a tolerance, or to the rounding of positions (X,) and bodies that are large."""
    starts = accumulate((7 + body.model.n for body in scene.bodies), initial=0)
    farthest = (float(np.abs(x[k : k + 3]).max()) for k, _ in zip(starts, scene.bodies, strict=False))
    reach = max(*farthest, *(body.model.size for body in scene.bodies))
    return float(np.abs(Phi).max(initial=0.0)) <= max(tolerance, ROUNDING * reach)


def angular_speeds(place: Layout, v: Array) -> Array:
    """Angular speeds (T, B) [rad/s] of all bodies, from velocities (T, V)."""
    omega = v[:, [[first + 3, first + 4, first + 5] for first in place.iv]]
    speeds: Array = np.sqrt((omega * omega).sum(axis=2))
    return speeds


def moved(place: Layout, x: Array, step: Array) -> Array:
    """x moved by a small motion (V,) in body axes; rotations are exact."""
    out = x.copy()
    for b in range(len(place.n)):
        p = x[place.p(b)]
        out[place.R(b)] += rotation_matrix(p) @ step[place.R_dot(b)]
        out[place.p(b)] = product(p, from_vector(step[place.omega(b)]))
        out[place.q(b)] += step[place.q_dot(b)]
    return out


def to_body_axes(place: Layout, x: Array, v: Array) -> Array:
    """[R_dot, omega_bar, q_dot] -> [A^T R_dot, omega_bar, q_dot] for all bodies."""
    out = v.copy()
    for b in range(len(place.n)):
        out[place.R_dot(b)] = rotation_matrix(x[place.p(b)]).T @ v[place.R_dot(b)]
    return out


def to_global_axes(place: Layout, x: Array, v: Array) -> Array:
    """[A^T R_dot, omega_bar, q_dot] -> [R_dot, omega_bar, q_dot] for all bodies."""
    out = v.copy()
    for b in range(len(place.n)):
        out[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ v[place.R_dot(b)]
    return out
