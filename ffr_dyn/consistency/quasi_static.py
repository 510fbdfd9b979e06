"""The quasi-static state of a scene at its start: bodies deformed as its motion asks for, which then do not ring.

With E the vibrations of the scene at its start (`ffr_dyn.consistency.unresolved`), J E = 0, of the frequencies omega, the
deflections q(t) along the motion are those at which the elastic accelerations are no more than their own change,

    E^T Omega^2 (q_ddot - d^2/dt^2 q(t)) = 0,        q_dot = d/dt q(t).

A step of q is E omega^-2 times the amplitudes of the acceleration that is too much: it holds every joint to first order and
leaves the mean motion of what is free as it is. Where turning or loads stiffen a body as much as it is stiff, the tangent of
these amplitudes, by differences, takes the place of -omega^2. The derivatives of q(t) are differences along the motion, to
R, p, v that velocities and accelerations lead to; at first they are zero, then those of the pass before. What is
left are the fourth powers of the rate of the motion over omega: two terms of the series of a slow manifold. (Boyd,
Appl. Math. Comput. 72 (1995).)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import (
    Evaluator,
    OpenError,
    accelerations,
    closed,
    evaluate,
    evaluator,
    total_mass_matrix,
)
from ffr_dyn.consistency.unresolved import Vibrations, vibrations
from ffr_dyn.equations.layout import moved, to_body_axes, to_global_axes
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

ITERATIONS = 40
TOLERANCE, ROUNDING = 1e-12, 1e-9  # of a step, and of one that gets no shorter, relative to the deflection or to
LEAST = 1e-9  # sqrt(kg) m, where there is none
FAINT = 1e-4  # of what turning would deflect if it strained all of the mass: deflections that are less count as that
NOTHING = 1e-8  # of the same: rates that are rounding
SLOW = 0.3  # a step of this part of the one before asks for the tangent
APART = 0.1  # of the times of the differences: over the lowest omega, and rad of a turn
PASSES = 2
SMALL = 0.1  # of deflections: what two derivatives more, over omega^2, may be of a slow motion
# One-sided differences by five values, of the derivatives from the first to the fourth.
WEIGHTS = (
    np.array([[-25, 48, -36, 16, -3], [35, -104, 114, -56, 11], [-30, 108, -144, 84, -18], [12, -48, 72, -48, 12]]) / 12
)
DIFFERENCE = 1e-6  # of deflections, relative
_OTHERS = (
    'begin = "steady" starts a scene that rests in its equilibrium, and one whose drivers turn evenly in its steady '
    'motion, "periodic" in a turn that repeats itself'
)


@dataclass(frozen=True)
class _Motion:
    """Derivatives by time (N,), the first to the fourth, of the deflections of all bodies, one after the other."""

    rate: Array
    acceleration: Array
    third: Array
    fourth: Array


@dataclass(frozen=True)
class _Search:
    """A scene with its vibrations, numbers (N,) of the elastic velocities and positions, and Omega^2 (N,).

    inertial : [sqrt(kg) m] what turning would deflect if it strained all of the mass
    """

    at: Evaluator
    of: Vibrations
    elastic: Array
    places: Array
    omega2: Array
    inertial: float

    def amplitudes(self, q: Array) -> Array:
        """(k,) of the vibrations in deflections, their rates or accelerations (N,), nearest in strain energy."""
        found: Array = (self.of.motions[self.elastic].T @ (self.omega2 * q)) / self.of.omega**2
        return found

    def too_much(self, time: float, x: Array, v: Array, wanted: Array) -> Array:
        """(k,) amplitudes of the elastic accelerations beyond those that are wanted."""
        now = evaluate(self.at, time, x, v)
        return self.amplitudes(now.acceleration[self.elastic] - wanted)


def quasi_static(assembled: Assembled, time: float) -> Assembled:
    """The state at `time` [s] with bodies deformed as the motion asks for, and deforming as it goes on.

    Positions and velocities of the bodies stay those of the assembly where joints and drivers tell them; what is free keeps
    its mean motion. Rates are told by the motion in all cases, whether it is driven or free.

    Raises ComputationError where there are no such deflections, as of a body that buckles.
    """
    of = vibrations(assembled, time)
    if not of.omega.size:
        return assembled
    try:
        x, v, slow = _slow(_search(assembled, of), time, assembled.x, assembled.v, _apart(assembled, of))
    except (OpenError, ComputationError, np.linalg.LinAlgError):
        raise _failed(time, of) from None
    notes = [*assembled.notes, "starts with the quasi-static deflections of the motion"]
    if not slow:
        notes.append(
            f"the motion at the start is not slow beside the lowest vibration, {of.omega[0] / 2 / np.pi:.4g} Hz: "
            f"there are no deflections that follow it without vibration, and those of the start do so roughly; {_OTHERS}"
        )
    return replace(assembled, x=x, v=v, notes=tuple(notes))


def _slow(search: _Search, time: float, x: Array, v: Array, h: float) -> tuple[Array, Array, bool]:
    """(x, v) with the deflections of the motion, and whether it is slow."""
    motion = _Motion(*np.zeros((4, search.elastic.size)))
    x, v, tangent = _settled(search, time, x, v, motion, -np.diag(search.of.omega**2))
    for _ in range(PASSES):
        try:
            motion = _followed(search, time, x, v, motion, tangent, h)
            x, v, tangent = _settled(search, time, x, v, motion, tangent)
        except (ComputationError, np.linalg.LinAlgError):
            return x, v, False
    derivatives = x[search.places], motion.rate, motion.acceleration, motion.third, motion.fourth
    sizes = [np.linalg.norm(search.amplitudes(q) / search.of.omega**k) for k, q in enumerate(derivatives)]
    still = max(sizes[2:]) <= NOTHING * search.inertial
    return x, v, bool(still or sizes[2] <= SMALL * (sizes[0] + sizes[1]) or sizes[3] + sizes[4] <= SMALL * sizes[2])


def _failed(time: float, of: Vibrations) -> ComputationError:
    return ComputationError(
        f"at t = {time:.6g} s no quasi-static deflections were found: the load bends a body too far, or is near to "
        f"buckling it, or forces jump, or the motion is as fast as the lowest vibration, {of.omega[0] / 2 / np.pi:.4g} Hz; "
        f'{_OTHERS}, and begin = "as-given" undeformed'
    )


def _inertial(assembled: Assembled, of: Vibrations) -> float:
    """[sqrt(kg) m] what turning would deflect if it strained all of the mass."""
    scene, place = assembled.system.scene, assembled.system.layout
    inside = to_body_axes(place, assembled.x, assembled.v)
    twice_energy = float(inside @ total_mass_matrix(scene, place, assembled.x) @ inside)
    return float(np.sqrt(twice_energy)) * _turning(assembled) / float(of.omega[0]) ** 2


def _turning(assembled: Assembled) -> float:
    """[rad/s] of the body that turns fastest."""
    place = assembled.system.layout
    return max(float(np.linalg.norm(assembled.v[place.omega(b)])) for b in range(len(place.n)))


def _apart(assembled: Assembled, of: Vibrations) -> float:
    """[s] between the times of the differences."""
    return APART / max(float(of.omega[0]), _turning(assembled))


def _search(assembled: Assembled, of: Vibrations) -> _Search:
    place, bodies = assembled.system.layout, assembled.system.scene.bodies
    numbers = range(len(bodies))
    elastic = np.concatenate([np.arange(place.q_dot(b).start, place.q_dot(b).stop) for b in numbers])
    places = np.concatenate([np.arange(place.q(b).start, place.q(b).stop) for b in numbers])
    omega2 = np.concatenate([body.model.omega2 for body in bodies])
    return _Search(evaluator(assembled.system), of, elastic, places, omega2, _inertial(assembled, of))


def _settled(
    search: _Search, time: float, x: Array, v: Array, motion: _Motion, tangent: Array
) -> tuple[Array, Array, Array]:
    """(x, v) near to those given, with the deflections that fit their motion, and the tangent (k, k) that found them."""
    before = np.inf
    for _ in range(ITERATIONS):
        x, v = _with_rates(search, time, x, v, motion.rate)
        step = -np.linalg.solve(tangent, search.too_much(time, x, v, motion.acceleration))
        size = float(np.linalg.norm(step))
        q = x[search.places]
        least = max(
            float(np.linalg.norm(q)), float(np.linalg.norm(search.amplitudes(q))), LEAST, FAINT * search.inertial
        )
        slow = size > SLOW * before
        if size <= (ROUNDING if slow else TOLERANCE) * least:
            return x, v, tangent
        if slow:
            tangent, size = _tangent(search, time, x, v, motion), np.inf
        else:
            x = moved(search.at.system.layout, x, search.of.motions @ step)
        before = size
    raise _failed(time, search.of)


def _with_rates(search: _Search, time: float, x: Array, v: Array, rate: Array) -> tuple[Array, Array]:
    """(x, v) on the constraints, the rates of deflections near to those given (N,) where joints and drivers leave them."""
    place = search.at.system.layout
    x, v = closed(search.at, time, x, v)
    inside = to_body_axes(place, x, v)
    inside += search.of.motions @ search.amplitudes(rate - inside[search.elastic])
    return closed(search.at, time, x, to_global_axes(place, x, inside))


def _tangent(search: _Search, time: float, x: Array, v: Array, motion: _Motion) -> Array:
    """(k, k) derivatives of what is too much by the amplitudes of the deflections."""
    place, columns = search.at.system.layout, []
    h = DIFFERENCE * max(float(np.linalg.norm(x[search.places])), DIFFERENCE)
    for shape in search.of.motions.T:
        sides = (_with_rates(search, time, moved(place, x, s * h * shape), v, motion.rate) for s in (1, -1))
        plus, minus = (search.too_much(time, *side, motion.acceleration) for side in sides)
        columns.append((plus - minus) / (2 * h))
    return np.array(columns).T


def _followed(search: _Search, time: float, x: Array, v: Array, motion: _Motion, tangent: Array, h: float) -> _Motion:
    """The motion of the deflections at x, v, by their differences to those at the times + h to 4 h along the motion."""
    place = search.at.system.layout
    a, q = accelerations(search.at, time, x, v), [x[search.places]]
    for s in (h, 2 * h, 3 * h, 4 * h):
        step = s * v + 0.5 * s**2 * a
        step[search.elastic] = s * motion.rate + 0.5 * s**2 * motion.acceleration
        there = moved(place, x, to_body_axes(place, x, step))
        then = replace(motion, rate=motion.rate + s * motion.acceleration)
        q.append(_settled(search, time + s, there, v + s * a, then, tangent)[0][search.places])
    return _Motion(*(weights @ np.array(q) / h**k for k, weights in enumerate(WEIGHTS, start=1)))
