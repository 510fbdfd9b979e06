"""Bodies of files that lack inertia: what can be added without changing their motion, and what is said of the rest.

Rods and point masses have no inertia about their axes. A trace of it lets joints hold or free those rotations as they like,
and moves nothing: no moment acts about such an axis. Where the modes take up more of the mass than there is, no motion is
possible; a body that is held fixed needs none of its mass as a whole, so that this may be raised for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.body import FlexibleBody, Interface, immovable, mass_of_motions
from ffr_prep.common.errors import InputError

FRAME = "frame"
TRACE = 1e-6  # of the largest moment of inertia: what is added about an axis that has none
_NONE = 1e-9
_ENOUGH = 1.5  # times what the modes take up of the mass


def judged(body: FlexibleBody) -> FlexibleBody:
    """A body as it was read, with a trace of inertia about axes that have none, and a warning where no motion is possible."""
    body = _with_traces(body)
    still = immovable(body, _free_in(body.provenance.get("plane")))
    if not still:
        return body
    return _warned(
        body,
        f"no free motion is possible: no inertia is left for {still}. The body can be shown, exported, and used where its "
        "frame is held fixed (import it with --held)",
    )


def held(body: FlexibleBody) -> FlexibleBody:
    """The body with as much mass, about the same centre, as its modes need to be moved in a frame that is held fixed, and
    with a point "frame" at its origin, which the modes leave in place.

    Where nothing moves the frame its mass moves nothing; its weight in reactions is that of the raised mass. Raises
    InputError for a body that needs no more, or has a point of that name.
    """
    free = list(range(6))
    if not immovable(body, free):
        raise InputError(f"body {body.name!r} can move with the mass it has; leave --held out")
    central = body.rr_dm - np.outer(body.r_dm, body.r_dm) / body.mass
    spread = max(float(np.trace(body.rr_dm)), body.mass * _extent(body) ** 2)
    raised = replace(
        body, rr_dm=body.rr_dm + (np.linalg.eigvalsh(central)[0] <= _NONE * spread) * 1e-3 * spread * np.eye(3)
    )
    M = mass_of_motions(raised)
    root = np.linalg.cholesky(M[:6, :6])
    taken = float(np.linalg.norm(np.linalg.solve(root, M[:6, 6:]), 2)) ** 2
    factor = max(_ENOUGH * taken, 1.0)
    raised = replace(
        raised,
        mass=factor * body.mass,
        r_dm=factor * body.r_dm,
        rr_dm=factor * raised.rr_dm,
        interfaces=(*body.interfaces, Interface(FRAME, np.zeros(3), np.zeros((3, body.n)), np.zeros((3, body.n)))),
        stiffening=None if body.stiffening is None else np.pad(body.stiffening, ((0, 6), (0, 0), (0, 0))),
    )
    return _warned(
        raised,
        f"to be held fixed only, at its point {FRAME!r}: the mass was raised from {body.mass:.6g} to "
        f"{raised.mass:.6g} kg; the motion of the modes is that of the file, the weight in reactions is not",
    )


def _warned(body: FlexibleBody, warning: str) -> FlexibleBody:
    facts = body.provenance
    return replace(body, provenance={**facts, "warnings": [*facts.get("warnings", ()), warning]})


def _with_traces(body: FlexibleBody) -> FlexibleBody:
    """The body with a trace of inertia about the axes that have none; those of a planar model are not missed."""
    if body.provenance.get("plane"):
        return body
    values, axes = np.linalg.eigh(body.central_inertia)
    size = max(float(values[-1]), TRACE * body.mass * _extent(body) ** 2)
    none = values <= _NONE * size
    if not none.any() or size <= 0:
        return body
    about = axes[:, none]
    # A mass spread evenly across an axis has inertia about all axes, most about that one.
    added = 0.5 * TRACE * size * sum(np.eye(3) - np.outer(axis, axis) for axis in about.T)
    filled = replace(body, rr_dm=body.rr_dm + added)
    names = ", ".join(np.array2string(axis.round(3) + 0.0, separator=", ") for axis in about.T)
    return _warned(
        filled,
        f"no inertia about {names}: {TRACE:g} of the largest moment was added, so that joints can hold these rotations or "
        "leave them free",
    )


def _extent(body: FlexibleBody) -> float:
    return body.size or float(np.linalg.norm(body.centre_of_mass)) or 1.0


def _free_in(plane: str | None) -> Sequence[int]:
    """The rigid motions of a planar model, or of any other."""
    if plane is None:
        return range(6)
    normal = "xyz".index(plane)
    return [*(k for k in range(3) if k != normal), 3 + normal]
