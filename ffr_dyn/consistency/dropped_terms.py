"""How far a body may deform without some of its inertia terms: where the mass matrix M(q) stops being positive.

With all its terms M is the Gram matrix of the motions of a mass. Without some of them the elastic coordinates can still take
nearly all of that mass with them, as they do in a frame fixed at one end, and little deformation then makes the rest, the
Schur complement of the elastic block, negative. In the mean-axis frame the modes move no mass on the whole, and none is lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.scene.scene import Body
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

NARROW = 0.1  # mean deflection over the size of the body below which a mass matrix that stops being positive is told
# The same, below which terms may not be left out: the inertia that is left is off by the share of this deflection that a
# body takes up, and what is worth being computed as flexible deforms by more than that. A run that goes further stops.
TOO_NARROW = 1e-4
REAL = 1e-7  # imaginary part of an eigenvalue, relative to the largest, below which it is taken as real
SINGULAR = 1e-9  # of the least eigenvalue of the rigid part, relative to that of the undeformed body


def check_dropped(body: Body, active: Sequence[int]) -> list[str]:
    """Notes on a body without some of its inertia terms; none where they may be left out at any deflection of its theory.

    active : numbers of its rigid velocities; those across the plane of a planar scene are not among them

    Raises InputError, naming the terms, where its mass matrix is not positive at the start or does not stay so.
    """
    if not body.dropped or not body.model.n:
        return []
    if _least(body, active) < SINGULAR:
        raise InputError(
            f"body {body.name!r}: without {_blamed(body, active)} its mass matrix is not positive at the start, so that it "
            f"has no motion; {remedy(body)}"
        )
    share = deflection(body, active) / body.model.size if body.model.size > 0 else np.inf
    if share > NARROW:
        return []
    said = (
        f"body {body.name!r}: without {', '.join(body.dropped)} its mass matrix is positive up to a mean deflection of "
        f"{share:.2g} of its size only, mostly for want of {_narrowest(body, active)}"
    )
    if share < TOO_NARROW:
        raise InputError(f"{said}; {remedy(body)}")
    return [
        f"{said}: its inertia is off by the share of that which it takes up, and a run that goes on stops; {remedy(body)}"
    ]


def remedy(body: Body) -> str:
    """The remedy for dropped terms without which there is no mass matrix."""
    halves = {"I3", "I4"} & set(body.dropped)
    if len(halves) == 1:
        return f"drop {({'I3', 'I4'} - halves).pop()} with it, or keep it"
    return (
        "keep the term, or take the body in its mean-axis frame, where modes carry no mass as a whole "
        "(ffr-prep convert --reference mean-axis, or with_reference)"
    )


def deflection(body: Body, active: Sequence[int]) -> float:
    """The least mean deflection [m], root mean square over the mass, at which a mass matrix is not positive any more.

    Looked for along each mode and along the deflections that gravity and forces at the interfaces cause.
    """
    model = body.model
    rows = [model.P_dm, *(part for i in model.interfaces for part in (i.phi_t, i.phi_r))]
    static = np.concatenate(rows) / np.where(model.omega2 > 0, model.omega2, np.inf)
    directions = np.concatenate([np.eye(model.n), static])
    length = np.linalg.norm(directions, axis=1)
    units = _units(body, active)
    found = [_amplitude(body, active, units, d) for d in directions[length > 0] / length[length > 0, None]]
    return float(min(found, default=np.inf)) / np.sqrt(model.mass)


def _narrowest(body: Body, active: Sequence[int]) -> str:
    """The one of the dropped terms whose lack alone is felt first."""
    return min(body.dropped, key=lambda term: deflection(replace(body, dropped=(term,)), active))


def _blamed(body: Body, active: Sequence[int]) -> str:
    """The dropped terms each of which alone leaves no mass matrix at the start, or all of them."""
    alone = [term for term in body.dropped if _least(replace(body, dropped=(term,)), active) < SINGULAR]
    return ", ".join(alone or body.dropped)


def _amplitude(body: Body, active: Sequence[int], units: Array, d: Array) -> float:
    """The least r > 0 at which the rigid part is singular for q = r d or -r d, d (n,) of length one."""
    at = [units.T @ _rigid_part(body, active, r * d) @ units for r in (0.0, 1.0, -1.0)]
    linear, square = 0.5 * (at[1] - at[2]), 0.5 * (at[1] + at[2]) - at[0]
    first, second = np.linalg.solve(at[0], linear), np.linalg.solve(at[0], square)
    size = len(first)
    inverses = np.linalg.eigvals(np.block([[-first, -second], [np.eye(size), np.zeros((size, size))]]))
    real = np.abs(inverses[np.abs(inverses.imag) <= REAL * np.abs(inverses).max()])
    return float(1 / real.max()) if real.max(initial=0.0) > 0 else np.inf


def _units(body: Body, active: Sequence[int]) -> Array:
    """(A, k) rigid motions in which the undeformed rigid body has the unit matrix, without those that move no mass."""
    M = mass_matrix(kept_integrals(body), np.zeros(body.model.n))[:6, :6]
    scale = np.repeat(1 / np.sqrt([body.model.mass, np.trace(M[3:, 3:])]), 3)[list(active)]
    M = M[np.ix_(active, active)]
    values, vectors = np.linalg.eigh(M * np.outer(scale, scale))
    kept = values > SINGULAR
    units: Array = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    return units


def _rigid_part(body: Body, active: Sequence[int], q: Array) -> Array:
    """(A, A) what the elastic coordinates q (n,) leave of the mass matrix for rigid motion: a polynomial of degree two."""
    M = mass_matrix(kept_integrals(body), q)
    part: Array = (M[:6, :6] - M[:6, 6:] @ M[6:, :6])[np.ix_(active, active)]
    return part


def _least(body: Body, active: Sequence[int]) -> float:
    """The least eigenvalue of the rigid part at the start, in units of the undeformed rigid body."""
    units = _units(body, active)
    return float(np.linalg.eigvalsh(units.T @ _rigid_part(body, active, body.q) @ units)[0])
