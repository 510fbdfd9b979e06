"""The mean-axis form of a body: its frame without mean translation or rotation of the elastic field (Tisserand's).

There int Phi dm = 0, int x x phi dm = 0, and the second-order displacement has no mean translation and no mean rotation
either: its first six load matrices vanish. With C and the frame of the old form the way back is exact:

    q_old = C q;   the old frame is a marker of the new form: its point `pivot` is at  rho = pivot + phi_t q - q K_t q / 2,
    its axes are turned by exp(theta),  theta = phi_r q - q K_r q / 2.

A frame that is fixed to an interface is that interface. The elastic coordinates are those of the modes in the new frame;
a body that was reduced under more than six conditions keeps its n deformations.

Source: O. P. Agrawal, A. A. Shabana, Computers & Structures 21 (1985) 1303-1312.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_prep.body.accelerations import INERTIAL, turns
from ffr_prep.body.constructors import recombined
from ffr_prep.body.frame_change import (
    in_motions,
    loads_on_motions,
    mass_of_motions,
    second_moments,
    stiffening_in,
)
from ffr_prep.body.reduced import FlexibleBody, Interface, Surface
from ffr_prep.body.turned_surface import turned_surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import ComputationError, InputError

_EQUAL = 1e-8  # relative difference of squared frequencies that are meant to be equal
_DISTINCT = 1e-6  # difference of the directions of two modes
_ROUNDING = 1e-9  # of what vanishes in the mean-axis frame, relative to what it is made of
_FRAME = "the frame"  # no name of an interface of the body, while it is one


@dataclass(frozen=True, repr=False)
class FrameMarker(Brief):
    """A frame that moves with the elastic field: pivot (3,) [m], phi_t, phi_r (3, n) as of an interface, and K (6, n, n) of
    unit forces and moments at it.

    >>> frame = fp.mean_axis_form(body).frame
    """

    pivot: Array
    phi_t: Array
    phi_r: Array
    K: Array


@dataclass(frozen=True, repr=False)
class MeanAxisForm(Brief):
    """A body in its mean-axis frame, the frame that it had before, and C (n, n) with q before = C q.

    >>> form = fp.mean_axis_form(body)
    >>> form.body.omega2
    """

    body: FlexibleBody
    frame: FrameMarker
    C: Array


def mean_axis_form(body: FlexibleBody) -> MeanAxisForm:
    """The mean-axis form of a body with load matrices; of the same body the same object.

    Raises InputError for a body without load matrices, ComputationError where rounding is too large.

    >>> form = fp.mean_axis_form(fp.load_body("rod.ffr"))
    """
    if body.stiffening is None or not body.n:
        raise InputError(
            f"body {body.name!r} has no load matrices, and no second-order displacement: reduce it again without --linear"
        )
    kept = vars(body)  # an immutable body has one form
    if _FRAME not in kept:
        kept[_FRAME] = _form(body)
    form: MeanAxisForm = kept[_FRAME]
    return form


def _form(body: FlexibleBody) -> MeanAxisForm:
    framed = _with_frame(body)
    Z, omega2 = _motions(framed)
    K = stiffening_in(framed, Z, _reactions(framed))
    K[np.concatenate([np.zeros(INERTIAL, bool), idle_loads(framed)])] = 0.0
    moved = in_motions(framed, Z, omega2, K)
    _check(body, moved)
    frame = moved.interfaces[-1]
    made = replace(_exact(moved), surface=body.surface and _surface(body.surface, Z))
    for array in (K, Z):
        array.setflags(write=False)
    form = MeanAxisForm(made, FrameMarker(frame.position, frame.phi_t, frame.phi_r, K[-6:]), Z[6:])
    nothing = np.zeros((3, body.n))
    still = FrameMarker(np.zeros(3), nothing, nothing, np.zeros((6, body.n, body.n)))
    vars(made)[_FRAME] = MeanAxisForm(made, still, np.eye(body.n))
    return form


def _with_frame(body: FlexibleBody) -> FlexibleBody:
    """The body with its frame as one more interface, which does not move, at an interface that does not move either; without
    its surface."""
    still = [i for i in body.interfaces if np.abs(i.phi_t).max(initial=0.0) * np.sqrt(body.mass) < _ROUNDING]
    pivot = min(still, key=lambda i: np.abs(i.phi_r).max(initial=0.0)).position if still else np.zeros(3)
    nothing = np.zeros((3, body.n))
    stiffening = np.concatenate([np.asarray(body.stiffening), np.zeros((6, body.n, body.n))])
    frame = Interface(_FRAME, pivot, nothing, nothing)
    return replace(body, interfaces=(*body.interfaces, frame), stiffening=stiffening, surface=None, parts=())


def _surface(surface: Surface, Z: Array) -> Surface:
    """Without the second-order displacement: pictures are drawn in the frame that the body had, and few bodies have loads
    over their surface, for which `mean_axis_surface` has it."""
    arms = np.einsum("akm,pm->pka", turns(), surface.points)
    return recombined(replace(surface, second=None), Z[6:], Z[:3] + arms @ Z[3:6] + surface.Phi @ Z[6:])


def mean_axis_surface(body: FlexibleBody, made: FlexibleBody, C: Array) -> Surface | None:
    """The surface of the mean-axis form `made` of a body, with its second-order displacement; q of the body are C q."""
    M = mass_of_motions(body)
    Z = np.vstack([np.linalg.solve(M[:6, :6], -M[:6, 6:]) @ C, C])
    return turned_surface(body, Z, made.omega2, made.stiffening)


def _motions(body: FlexibleBody) -> tuple[Array, Array]:
    """Z (6 + n, n) and omega2 (n,) of the modes in the mean-axis frame."""
    M = mass_of_motions(body)
    rigid = np.linalg.solve(M[:6, :6], -M[:6, 6:])
    try:
        L = np.linalg.cholesky(M[6:, 6:] + M[6:, :6] @ rigid)
    except np.linalg.LinAlgError:
        raise ComputationError(
            f"body {body.name!r}: an elastic coordinate is a rigid motion; reduce it again"
        ) from None
    free = np.linalg.solve(L, np.eye(body.n))
    omega2, V = np.linalg.eigh((free * body.omega2) @ free.T)
    elastic = _aligned(body, rigid, free.T @ V, omega2)
    elastic = elastic * np.sign(elastic[np.abs(elastic).argmax(axis=0), np.arange(body.n)])
    return np.vstack([rigid @ elastic, elastic]), np.maximum(omega2, 0.0)


def _aligned(body: FlexibleBody, rigid: Array, elastic: Array, omega2: Array) -> Array:
    """(n, n) the modes, those of equal frequency turned among themselves to move along the axes, so that motions in a plane
    of symmetry and across it stay apart."""
    motions, elastic = np.vstack([rigid, np.eye(body.n)]), elastic.copy()
    moments = second_moments(body)
    along = motions.T @ np.einsum("k,kkij->ij", [1.0, 2.0, 3.0], moments) @ motions
    for equal in np.split(np.arange(omega2.size), np.flatnonzero(np.diff(omega2) > _EQUAL * omega2[1:]) + 1):
        if equal.size > 1:
            shares, turn = np.linalg.eigh(elastic[:, equal].T @ along @ elastic[:, equal])
            if np.ptp(shares) > _DISTINCT:  # else no direction is better than another
                elastic[:, equal] = elastic[:, equal] @ turn
    return elastic


def _reactions(body: FlexibleBody) -> Array:
    """(12 + 6 I, 12 + 6 I) the inertia that balances each unit load, as combinations of loads."""
    loads = loads_on_motions(body)[:, :6]
    carried = np.zeros((len(loads), len(loads)))
    carried[:, :6] = -np.linalg.solve(loads[:6].T, loads.T).T
    return carried


def idle_loads(body: FlexibleBody) -> Array:
    """(6 I,) the loads that have no matrix although what they act on moves: at points that were added after the reduction.

    A place where the body is held moves by rounding. Against that stand the motions of the modes, of unit norm in the mass:
    about 1 / sqrt(mass), and for rotations 1 / sqrt(second moment of mass).
    """
    assert body.stiffening is not None
    six = body.stiffening[INERTIAL:].reshape(len(body.interfaces), 6 * body.n * body.n)
    shift, turn = np.sqrt(body.mass), np.sqrt(np.trace(body.rr_dm) - body.r_dm @ body.r_dm / body.mass)
    motions = [np.stack([shift * i.phi_t, turn * i.phi_r]) for i in body.interfaces]
    moving = np.array([np.abs(of).max(initial=0.0) > _ROUNDING for of in motions], bool)
    return np.repeat(moving & ~six.any(axis=1), 6)


# ---- exact zeros ---------------------------------------------------------------------------------------------------


def _exact(moved: FlexibleBody) -> FlexibleBody:
    """The body, without the frame as an interface, with zeros for what vanishes in the mean-axis frame."""
    K = np.array(moved.stiffening)[:-6]
    K[:6] = 0.0
    symmetric = (moved.rP_dm + moved.rP_dm.transpose(1, 0, 2)) / 2
    return replace(
        moved, interfaces=moved.interfaces[:-1], stiffening=K, P_dm=np.zeros_like(moved.P_dm), rP_dm=symmetric
    )


def _check(body: FlexibleBody, moved: FlexibleBody) -> None:
    """ComputationError where what is about to become zero is more than rounding."""
    length = np.sqrt(np.trace(body.rr_dm) / body.mass)
    old, new = (np.asarray(b.stiffening)[:INERTIAL] for b in (body, moved))
    size = max(np.abs(old[:3]).max(initial=0.0) * length, *(np.abs(K[3:]).max(initial=0.0) for K in (old, new)))
    left = {
        "momentum of the modes": np.abs(moved.P_dm).max(initial=0.0) / np.sqrt(body.mass),
        "angular momentum of the modes": np.abs(moved.I4).max(initial=0.0) / np.sqrt(np.trace(body.rr_dm)),
        "mean second-order displacement": np.abs(new[:3]).max(initial=0.0) * length / (size or 1.0),
        "mean second-order rotation": np.abs(new[3:6]).max(initial=0.0) / (size or 1.0),
    }
    for what, value in left.items():
        if not value <= _ROUNDING:
            raise ComputationError(
                f"body {body.name!r} has no accurate mean-axis frame: a {what} of {value:.1e} is left, {_ROUNDING:g} is "
                "allowed; reduce it again"
            )
