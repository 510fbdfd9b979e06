"""Distributed loads through the reduced basis: their integrals, which laws and kernels of surface loads share.

A body's surface has points u = u_0 + Phi q (body axes). Nodal forces f_p do the virtual work

    sum_p f_p . delta(R + A u_p)    so that    F = sum f_p,   M = sum u_p x f_p,   Q = sum Phi_p^T f_p

with f_p in body axes and M about the body's origin: the rigid resultant and the modal forces belong together (Shabana 2013,
sec. 5.6). These loads do no work on the second-order displacement of the body.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.scene.forces.force import LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.given import is_number
from ffr_dyn.scene.forces.places import FACTOR, Measured
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody, Surface, axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

_SAME_PLACE = 1e-9  # of the size of the body
_MOST_ARROWS = 16  # of a load


@dataclass(frozen=True)
class Affine:
    """Generalised forces constant + slope q in body axes: constant (6 + n,), slope (6 + n, n)."""

    constant: Array
    slope: Array

    def at(self, q: Array, A: Array) -> Array:
        """(6 + n,) generalised forces."""
        forces: Array = self.constant + self.slope @ q
        return forces

    def numbers(self) -> Array:
        return np.concatenate([self.constant, self.slope.ravel()])


@dataclass(frozen=True)
class Spread:
    """Forces of fixed global direction: force (3,), sum of u_0 f^T (3, 3), sum of phi_j f^T (3, 3, n); f global."""

    force: Array
    u_f: Array
    phi_f: Array

    def at(self, q: Array, A: Array) -> Array:
        """(6 + n,) generalised forces."""
        u_f = (self.u_f + self.phi_f @ q) @ A
        return np.concatenate([self.force @ A, axial(u_f), np.einsum("klj,lk->j", self.phi_f, A)])

    def numbers(self) -> Array:
        return np.concatenate([self.force, self.u_f.ravel(), self.phi_f.ravel()])


# Of every kind whose `integrals(model)` are these, with a place on a body and a `function` of time.


def check_integrals(force: Any, scene: Scene) -> None:
    """InputError when the body has not what the force needs."""
    force.integrals(force.place.of(scene).model)


def law_of_integrals(force: Any, now: Moment, c: Any, rate: Any) -> Any:
    """(6 + n,) generalised forces: a function of time times the integrals."""
    made: Affine | Spread = force.integrals(force.place.of(now.state.scene).model)
    return now.value(force.function)[0] * made.at(c, now.state.axes(force.body))


def compiled_integrals(force: Any, table: LoadTable) -> LawNumbers:
    """The numbers that the kernel of distributed loads reads."""
    made: Affine | Spread = force.integrals(force.place.of(table.scene).model)
    return LawNumbers(made.numbers(), table.function(force.function))


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
