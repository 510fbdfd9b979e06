"""Distributed loads through the reduced basis: their integrals, which laws and kernels of surface loads share.

A body's surface has points u = u_0 + Phi q (body axes). Nodal forces f_p do the virtual work

    sum_p f_p . delta(R + A u_p)    so that    F = sum f_p,   M = sum u_p x f_p,   Q = sum Phi_p^T f_p

with f_p in body axes and M about the body's origin: the rigid resultant and the modal forces belong together (Shabana 2013,
sec. 5.6). The points of a second-order body move by u_2(q) as well, on which the forces work: they stiffen or buckle the body
as forces at its interfaces do. With X = sum of d^2 u_2p / dq^2 f_p^T, (3, 3, n, n), the sum of u_2p f_p^T is q^T X q / 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.scene.forces.force import LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.given import is_number
from ffr_dyn.scene.forces.places import FACTOR, Measured
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, Surface, axial, mean_axis_surface, remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

_SAME_PLACE = 1e-9  # of the size of the body
_MOST_ARROWS = 16  # of a load
_FOLLOWED = 0.25  # of a load, by the shapes of a body; where they have nine tenths, stress is right to some per cent


@dataclass(frozen=True)
class Affine:
    """Generalised forces constant + slope q in body axes: constant (6 + n,), slope (6 + n, n).

    second : (3, 3, n, n) X of the forces that are constant; None of a linear body
    """

    constant: Array
    slope: Array
    second: Array | None = None

    def at(self, q: Array, A: Array) -> Array:
        """(6 + n,) generalised forces."""
        forces: Array = self.constant + self.slope @ q
        if self.second is not None:
            forces[3:6] += axial(0.5 * self.second @ q @ q)
            forces[6:] += np.trace(self.second) @ q
        return forces

    def numbers(self) -> Array:
        return _with_second(self.second, self.constant, self.slope)


@dataclass(frozen=True)
class Spread:
    """Forces of fixed global direction: force (3,), sum of u_0 f^T (3, 3), sum of phi_j f^T (3, 3, n); f global.

    second : (3, 3, n, n) X; None of a linear body
    """

    force: Array
    u_f: Array
    phi_f: Array
    second: Array | None = None

    def at(self, q: Array, A: Array) -> Array:
        """(6 + n,) generalised forces."""
        by_q = self.phi_f @ q
        phi_f = self.phi_f
        if self.second is not None:
            by_q, phi_f = by_q + 0.5 * self.second @ q @ q, phi_f + self.second @ q
        u_f = (self.u_f + by_q) @ A
        return np.concatenate([self.force @ A, axial(u_f), np.einsum("klj,lk->j", phi_f, A)])

    def numbers(self) -> Array:
        return _with_second(self.second, self.force, self.u_f, self.phi_f)


def _with_second(second: Array | None, *parts: Array) -> Array:
    """Whether there is a second order (1 or 0), the parts, and its numbers."""
    there = [] if second is None else [second.ravel()]
    return np.concatenate([[float(second is not None)], *(one.ravel() for one in parts), *there])


# Of every kind whose `integrals(model)` are these, with a place on a body and a `function` of time.


def check_integrals(force: Any, scene: Scene) -> None:
    """InputError when the body has not what the force needs."""
    force.integrals(force.place.of(scene).model)


def law_of_integrals(force: Any, now: Moment, c: Any, rate: Any) -> Any:
    """(6 + n,) generalised forces: a function of time times the integrals."""
    return now.value(force.function)[0] * _integrals(force, now.state.scene).at(c, now.state.axes(force.body))


def compiled_integrals(force: Any, table: LoadTable) -> LawNumbers:
    """The numbers that the kernel of distributed loads reads."""
    return LawNumbers(_integrals(force, table.scene).numbers(), table.function(force.function))


class _This:
    """A force as a key: itself, and no other of equal values, which arrays do not tell."""

    def __init__(self, force: Any) -> None:
        self.force = force

    def __hash__(self) -> int:
        return id(self.force)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _This) and other.force is self.force


def _integrals(force: Any, scene: Scene) -> Affine | Spread:
    """Those of the body as it moves in the scene, found once: laws are asked thousands of times."""
    model = moving_model(force.place.of(scene))
    made: Affine | Spread = remembered(model, _This(force), lambda: force.integrals(model))
    return made


def moving_model(body: Body) -> FlexibleBody:
    """The body with the second-order displacement that its surface has in the scene: in its mean-axis frame, or none."""
    return remembered(body.model, ("moving", body.stiffening, body.frame is None), lambda: _moving(body))


def _moving(body: Body) -> FlexibleBody:
    model = body.model
    if model.surface is None or (body.frame is None and model.surface.second is None):
        return model
    if model.stiffening is None or not body.stiffening:
        return replace(model, surface=replace(model.surface, second=None))
    if body.frame is None:
        return model
    return replace(model, surface=mean_axis_surface(body.frame.model, model, body.frame.C))


def unstiffened(force: Any, scene: Scene) -> tuple[str, ...]:
    """A note where a load over the surface of a second-order body works on no second-order displacement, or on some of it."""
    body = force.place.of(scene)
    surface = (body.frame or body).model.surface
    if surface is None or body.model.stiffening is None or not body.stiffening:
        return ()
    has = np.flatnonzero(surface.second.weights.any(axis=(0, 2))) if surface.second is not None else np.zeros(0, int)
    count = int(has.max(initial=-1)) + 1
    if count >= body.model.n:
        return ()
    of = f"the first {count} of {body.model.n} modes" if count else "none of its modes"
    return (
        f"force {force.name!r} stiffens or buckles {of} of {force.body!r}: the surface has a second-order displacement of no "
        "more; reduce the body without drawn_modes, or give the load at an interface",
    )


def unfollowed(force: Any, scene: Scene, points: Array, f: Array) -> tuple[str, ...]:
    """A note where a body with stress hardly has motions that are like the load, of forces f (N, 3) on points (N,), as of a
    pressure within a tube, which widens in its fastest modes alone."""
    body = force.place.of(scene).model
    surface = surface_of(body, force.name)
    if surface.stress is None or not body.n:
        return ()
    share = _followed(surface, points, f)
    if share >= _FOLLOWED:
        return ()
    return (
        f"force {force.name!r}: the shapes of {force.body!r} hardly move as it pushes (they follow {100 * share:.2g} % of it "
        "where it acts), so that the stress and the deformation that it causes there are missing; reduce the body with "
        "shapes that do: UserVectors of the deflection under it, or InertiaRelief(), which has walls that widen",
    )


def _followed(surface: Surface, points: Array, f: Array) -> float:
    """How much of the load per area, in the mean square over the points, the shapes and the rigid motions can follow."""
    loaded, of = np.unique(points, return_inverse=True)
    total = np.zeros((len(loaded), 3))
    np.add.at(total, of.ravel(), f)
    a, b, c = np.moveaxis(surface.points[surface.triangles], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    weight = np.sqrt(np.bincount(surface.triangles.ravel(), np.repeat(area, 3), len(surface.points))[loaded])
    weight = np.where(weight > 0, weight, 1.0)
    at = surface.points[loaded] - surface.points[loaded].mean(axis=0)
    turning = np.cross(np.eye(3), at[:, None]).swapaxes(1, 2) / max(np.abs(at).max(), np.finfo(float).tiny)
    motions = np.concatenate([np.broadcast_to(np.eye(3), turning.shape), turning, surface.Phi[loaded]], axis=2)
    columns = (motions * weight[:, None, None]).reshape(3 * len(loaded), -1)
    columns /= np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    pushed = (total / weight[:, None]).ravel()
    work = columns.T @ pushed
    amounts = np.linalg.lstsq(columns.T @ columns, work, rcond=_SAME_PLACE)[0]
    return float(work @ amounts / (pushed @ pushed)) if pushed.any() else 1.0


def measured_factor(force: Any) -> tuple[Measured, ...]:
    """What a result keeps of the load: its function, where that is no number."""
    return () if is_number(force.function) else FACTOR


def arrows_on_surface(force: Any, unit: str, corners: Array, vectors: Array, inward: Array) -> dict[str, Any]:
    """What a picture needs of a load on a surface, in JSON values.

    corners : (N, k) numbers of the points in whose middle an arrow stands;  vectors : (N, 3) [unit] for a factor of one
    inward  : (N,) 1 where the arrow ends there for a positive factor, -1 where it does for a negative one, 0 where it begins
    factor  : of all, where it is a number; others are kept by a result
    """
    strongest = np.argsort(-np.linalg.norm(vectors, axis=1), kind="stable")
    numbers = {"corners": corners, "vectors": vectors, "inward": inward}
    told = {"body": force.body, "unit": unit, "axes": force.place.axes, "factor": force.function}
    if not is_number(force.function):
        del told["factor"]
    return {"spread": told | {key: of[strongest].tolist() for key, of in numbers.items()}}


def far_apart(places: Array) -> Array:
    """Numbers of the places (M, 3) at which arrows are drawn: few, each as far as can be from those before it."""
    distance = np.linalg.norm(places - places.mean(axis=0), axis=1)
    chosen = [int(np.argmin(distance))]
    distance = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < _MOST_ARROWS and distance.max() > 0:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return np.array(chosen)


def affine(u: Array, Phi: Array, f: Array, slope: Array) -> Affine:
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


def second_order(surface: Surface, points: Array, f: Array) -> Array | None:
    """(3, 3, n, n) X of forces f (N, 3) on the points (N,) of a surface; None where its second order was not computed."""
    if surface.second is None:
        return None
    loaded, of = np.unique(points, return_inverse=True)
    total = np.zeros((len(loaded), 3))
    np.add.at(total, of, f)
    by_rank = np.tensordot(total, surface.second.shapes[loaded], (0, 0))  # (l, k, r)
    return np.tensordot(by_rank, surface.second.weights, 1).swapaxes(0, 1)


def surface_of(body: FlexibleBody, name: str) -> Surface:
    """The surface on which the force of that name acts."""
    if body.surface is None:
        raise InputError(f"force {name!r}: body {body.name!r} has no surface to act on; use loads at its interfaces")
    return body.surface


def numbers_at(places: Array, among: Array) -> Array:
    """(N,) which of the places (M, 3) [m] each of the places (N, 3) is; -1 for none."""
    from scipy.spatial import cKDTree  # here, because it is slow to load

    distance, number = cKDTree(among).query(places)
    size = float(np.linalg.norm(np.ptp(among, axis=0)))
    return np.where(distance <= _SAME_PLACE * size, number, -1)


def indices(value: Any, what: str) -> Array:
    """Whole numbers from 0 as an array; InputError when they are none."""
    array = np.atleast_1d(np.asarray(value))
    if array.ndim != 1 or array.dtype.kind not in "iu" or (array < 0).any():
        raise InputError(f"{what} must be whole numbers from 0, not {value!r}")
    return array.astype(np.int64)
