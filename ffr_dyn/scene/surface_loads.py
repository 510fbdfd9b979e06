"""Distributed loads through the reduced basis: forces at surface points, and pressure on surface triangles.

A body's surface has points u = u_0 + Phi q (body axes). Nodal forces f_p do the virtual work

    sum_p f_p . delta(R + A u_p)    so that    F = sum f_p,   M = sum u_p x f_p,   Q = sum Phi_p^T f_p

with f_p in body axes and M about the body's origin: the rigid resultant and the modal forces belong together (Shabana 2013,
sec. 5.6). These loads do not add to the geometric stiffening of the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.scene.forces import check_array, check_function
from ffr_prep.body import FlexibleBody, Surface, axial
from ffr_prep.common.errors import InputError

Array = np.ndarray


@dataclass(frozen=True)
class NodalForces:
    """Forces (N, 3) [N] at points of a body's surface, times a function of time.

    points   : (N,) numbers of the points in the body's surface
    function : a number, a time function or a Python function of time
    axes     : "global", or "body" for forces that turn with the body's frame
    """

    name: str
    body: str
    points: Any
    forces: Any
    function: Any = 1.0
    axes: str = "global"

    def __post_init__(self) -> None:
        who = f"force {self.name!r}"
        if self.axes not in ("global", "body"):
            raise InputError(f"{who}: axes must be 'global' or 'body', not {self.axes!r}")
        check_function(self.function, f"{who}: function")
        points = _indices(self.points, f"{who}: points")
        forces = check_array(self.forces, (points.size, 3), f"{who}: forces")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "forces", forces)


@dataclass(frozen=True)
class Pressure:
    """Pressure [Pa] on triangles of a body's surface; positive pushes against their outward normals.

    pressure  : a number or one for each point of the surface (P,), linear over each triangle
    triangles : None for all, numbers of triangles, or a Python function of their centres (T, 3) [m], undeformed in the body
                frame, that returns which (T,) are loaded
    function  : factor over time: a number, a time function or a Python function
    follower  : True: area and normal follow the elastic deformation, to first order in q; False: they stay those of
                the undeformed body, fixed to its frame
    """

    name: str
    body: str
    pressure: Any
    triangles: Any = None
    function: Any = 1.0
    follower: bool = False

    def __post_init__(self) -> None:
        who = f"pressure {self.name!r}"
        check_function(self.function, f"{who}: function")
        shape = np.shape(self.pressure)
        object.__setattr__(self, "pressure", check_array(self.pressure, shape[:1], f"{who}: pressure"))
        if self.triangles is not None and not callable(self.triangles):
            object.__setattr__(self, "triangles", _indices(self.triangles, f"{who}: triangles"))


@dataclass(frozen=True)
class ModalForce:
    """Forces on the elastic coordinates themselves, times a function of time: no resultant, no moment.

    values : (n,) [1/sqrt(kg) N];  function : a number, a time function or a Python function of time
    """

    name: str
    body: str
    values: Any
    function: Any = 1.0

    def __post_init__(self) -> None:
        who = f"force {self.name!r}"
        check_function(self.function, f"{who}: function")
        shape = np.shape(self.values)
        object.__setattr__(self, "values", check_array(self.values, shape[:1], f"{who}: values"))


SurfaceLoad = NodalForces | Pressure | ModalForce


@dataclass(frozen=True)
class Affine:
    """Generalised forces constant + slope q in body axes: constant (6 + n,), slope (6 + n, n)."""

    constant: Array
    slope: Array


@dataclass(frozen=True)
class Spread:
    """Forces of fixed global direction: force (3,), sum of u_0 f^T (3, 3), sum of phi_j f^T (3, 3, n); f global."""

    force: Array
    u_f: Array
    phi_f: Array


def distributed(load: SurfaceLoad, body: FlexibleBody) -> Affine | Spread:
    """The integrals of a load over the basis of its body, for a factor of one.

    Raises InputError when the body has no surface, or not the points, triangles or modes that the load names.
    """
    if isinstance(load, ModalForce):
        return _modal(load, body)
    surface = _surface(load, body)
    if isinstance(load, Pressure):
        return _pressure(load, body, surface)
    if load.points.max(initial=-1) >= len(surface.points):
        raise InputError(
            f"force {load.name!r}: there is no point {load.points.max()}; the surface of {body.name!r} has "
            f"{len(surface.points)} points, counted from 0"
        )
    u, Phi, f = surface.points[load.points], surface.Phi[load.points], load.forces
    if load.axes == "body":
        return _affine(u, Phi, f, np.zeros((*f.shape, body.n)))
    return Spread(f.sum(0), u.T @ f, np.einsum("pkj,pl->klj", Phi, f))


def _modal(load: ModalForce, body: FlexibleBody) -> Affine:
    if load.values.size != body.n:
        raise InputError(f"force {load.name!r}: {load.values.size} values for the {body.n} modes of {body.name!r}")
    return Affine(np.concatenate([np.zeros(6), load.values]), np.zeros((6 + body.n, body.n)))


def _affine(u: Array, Phi: Array, f: Array, slope: Array) -> Affine:
    """Nodal forces f + slope q (N, 3), (N, 3, n) in body axes at u + Phi q: generalised forces to first order in q."""

    def moment(at: str, arm: Array, force: Array) -> Array:
        return axial(np.einsum(at, arm, force))

    return Affine(
        np.concatenate([f.sum(0), moment("pk,pl->kl", u, f), np.einsum("pkj,pk->j", Phi, f)]),
        np.concatenate([
            slope.sum(0),
            moment("pkj,pl->klj", Phi, f) + moment("pk,plj->klj", u, slope),
            np.einsum("pki,pkj->ij", Phi, slope),
        ]),
    )  # fmt: skip


def _pressure(load: Pressure, body: FlexibleBody, surface: Surface) -> Affine:
    """The work of linear pressure on linear triangles: nodal forces -A/12 (1 + delta_ab) p_b n."""
    corners = surface.triangles[_chosen(load, body, surface)]
    u, Phi = surface.points[corners], surface.Phi[corners]  # (T, 3, 3), (T, 3, 3, n)
    edge, other = u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]
    edge_q, other_q = Phi[:, 1] - Phi[:, 0], Phi[:, 2] - Phi[:, 0]
    area = np.cross(edge, other) / 2  # (T, 3) area times outward normal
    area_q = (np.cross(edge_q, other[:, :, None], axis=1) + np.cross(edge[:, :, None], other_q, axis=1)) / 2
    size = len(surface.points)
    if load.pressure.ndim and load.pressure.size != size:
        raise InputError(
            f"pressure {load.name!r}: {load.pressure.size} values for the {size} points of the surface of {body.name!r}"
        )
    p = np.broadcast_to(load.pressure, size)[corners]
    share = -(p + p.sum(1, keepdims=True)) / 12  # (T, 3)
    f = share[:, :, None] * area[:, None]
    slope = share[:, :, None, None] * area_q[:, None] * (1.0 if load.follower else 0.0)
    count, n = 3 * len(corners), body.n
    return _affine(u.reshape(count, 3), Phi.reshape(count, 3, n), f.reshape(count, 3), slope.reshape(count, 3, n))


def _chosen(load: Pressure, body: FlexibleBody, surface: Surface) -> Array:
    """Numbers of the loaded triangles."""
    count = len(surface.triangles)
    if callable(load.triangles):
        centres = surface.points[surface.triangles].mean(axis=1)
        chosen = np.flatnonzero(np.broadcast_to(load.triangles(centres), count))
    else:
        chosen = np.arange(count) if load.triangles is None else load.triangles
    if chosen.size == 0 or chosen.max() >= count:
        what = "no triangle" if chosen.size == 0 else f"triangle {chosen.max()}"
        raise InputError(f"pressure {load.name!r} acts on {what}; the surface of {body.name!r} has {count}")
    return chosen


def _surface(load: NodalForces | Pressure, body: FlexibleBody) -> Surface:
    if body.surface is None:
        raise InputError(f"force {load.name!r}: body {body.name!r} has no surface to act on")
    return body.surface


def _indices(value: Any, what: str) -> Array:
    array = np.atleast_1d(np.asarray(value))
    if array.ndim != 1 or array.dtype.kind not in "iu" or (array < 0).any():
        raise InputError(f"{what} must be whole numbers from 0, not {value!r}")
    return array.astype(np.int64)
