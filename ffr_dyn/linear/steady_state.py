"""Steady motions of a scene: every body keeps its shape and moves in a screw of its own, and all forces balance.

The screws are those of the assembled scene: what drivers of constant speed, or the velocities of the scene, ask for.
With T_0, the kinetic energy of the screws (`ffr_dyn.equations.spinning`), the condition is that of an equilibrium in
the amended potential V - T_0,

    d(T_0 - V) - Phi_q^T lam = 0,      Phi = 0,

solved by Newton's method with the exact tangent (of Python forces that look at velocities by differences); what is
free to go on turning has no stiffness and stays where it is. Above critical speeds the amended potential has no
minimum, so the state is followed from rest where Newton's method does not reach it at once, and not sought downhill.

A scene that turns meets its ground, gravity and bearings anew at every angle. Rows that then do not hold are no
steady motion; forces and stiffness that vary are taken as their means of a turn, of bodies at several speeds of so many that
each has come round, and a note says so. How stiffness and
damping vary is kept by its harmonics, for the modes (`ffr_dyn.linear.hill`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import (
    free_motions,
    locked,
    of_mass,
    row_sizes,
    smallest_step,
    total_mass_matrix,
    unit_rows,
)
from ffr_dyn.consistency.mobility import named_motion
from ffr_dyn.consistency.tangent import sizes_of
from ffr_dyn.equations.forces import At, applied_by
from ffr_dyn.equations.forces_at_rest import Watched, add_force, damping_of
from ffr_dyn.equations.forces_in_motion import add_velocities
from ffr_dyn.equations.inertia import kept_integrals
from ffr_dyn.equations.layout import Layout, moved, to_body_axes, to_global_axes, velocity_sizes
from ffr_dyn.equations.placed import Sums, all_placed, nothing_on
from ffr_dyn.equations.spinning import spinning
from ffr_dyn.equations.statics import balance, damping
from ffr_dyn.functions.differences import differences
from ffr_dyn.functions.rotation import from_vector, product, rotation_matrix, skew
from ffr_dyn.linear.hill import harmonics
from ffr_dyn.linear.turning_on import turning_on
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import AtMarker, BetweenAxes, OnBody
from ffr_dyn.scene.scene import length_of, markers
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS = 20  # of Newton's method
TOLERANCE = 1e-9  # of its last step, rad or relative to the scene: the next would be its square
STALLED = 1e-7  # the same, below which steps that shrink no more are the rounding of differences
LARGEST = 0.5  # of a step, the same
NEAR = 0.01  # the same, of steps that lead to no other steady motion
LEAST_SHARE = 0.01  # of the speed, by which it is followed
NEARLY = 1e-2  # of the forces, what an unbalance or the weight of a shaft is at most, to be nearly balanced
BALANCED = (
    1e-13  # of forces relative to all, and of rows relative to their sizes: what is left of a balance by rounding
)
NEUTRAL = 1e-13  # of a stiffness relative to the largest: rounding
UNBALANCED = 1e-6  # of forces along what turns on by itself, relative to all
LET_GO = 1e-7  # the same along other motions without stiffness
HELD = 1e-6  # of the largest stiffness of forces, from where they hold what would turn
VARIES, OPENS = 1e-7, 1e-7  # of forces and stiffness over a turn, relative; of rows, relative to the scene
ALL_TURN = (
    "bodies that no joint ties to what is driven turn with it: with the velocities that the scene gives them, forces on them "
    "would vary more; give them omega_bar to say it"
)
PHASES = 8  # of a turn, over which a mean is taken
TURNS = 16  # of the fastest body, at most, over which it is taken where others have turned by whole turns as well
SAME = 1e-6  # of a state that is in its steady motion: of velocities and forces, relative
BESIDE = 1e-6  # of the scene: how far the axis of what turns may pass its bearings
TURNED = 1.0  # rad: how far on the scene is looked at again
STEP = 1e-4  # rad, or relative to the bodies: of differences, extrapolated


@dataclass(frozen=True)
class Screws:
    """Motions R_dot = u + w x R of all bodies: u [m/s] and w [rad/s] (B, 3), global axes."""

    u: Array
    w: Array

    def times(self, share: float) -> Screws:
        return Screws(share * self.u, share * self.w)

    @property
    def fastest(self) -> float:
        """[rad/s]"""
        return float(np.linalg.norm(self.w, axis=1).max())

    @property
    def rate(self) -> float:
        """[rad/s] of all that turns, where that is one; else 0."""
        speeds = np.linalg.norm(self.w, axis=1)
        same = np.isclose(speeds, self.fastest, rtol=SAME, atol=0.0) | (speeds <= SAME * self.fastest)
        return self.fastest if same.all() else 0.0

    def in_whole_turns(self) -> tuple[Screws, int]:
        """The screws at speeds so near to these that all bodies have turned by whole turns when the fastest has done so many:
        these themselves where they do. Bodies that turn at several speeds go on doing so."""
        speeds = np.linalg.norm(self.w, axis=1)
        shares = np.where(speeds > SAME * self.fastest, speeds / (self.fastest or 1.0), 0.0)
        offers = [_whole(count * shares) / count for count in range(1, TURNS + 1)]
        off = [float(np.abs(one - shares).max()) if (one[shares > 0] > 0).all() else np.inf for one in offers]
        best = next((k for k, one in enumerate(off) if one <= SAME), int(np.argmin(off)))
        if off[best] <= SAME or off[best] == np.inf:
            return self, best + 1
        paces = np.divide(offers[best], shares, out=np.ones(len(shares)), where=shares > 0)[:, None]
        return Screws(paces * self.u, paces * self.w), best + 1


def _whole(turns: Array) -> Array:
    """(B,) the nearest whole turns, at least one, fewer of what is slower; zero where none are left, and of what rests."""
    left, found, below = turns.copy(), np.zeros(len(turns)), np.inf
    while left.max() > 0:
        alike = left >= (1 - SAME) * left.max()
        below = max(0.0, min(max(1.0, np.rint(left.max())), below - 1))
        found[alike], left[alike] = below, 0.0
    return found


def screws_of(place: Layout, x: Array, v: Array) -> Screws:
    """The screws in which the frames of the bodies move at a state."""
    count = range(len(place.n))
    w = np.array([rotation_matrix(x[place.p(b)]) @ v[place.omega(b)] for b in count])
    return Screws(np.array([v[place.R_dot(b)] - np.cross(w[b], x[place.R(b)]) for b in count]), w)


def velocities(place: Layout, screws: Screws, x: Array) -> Array:
    """(V,) velocities of bodies that keep their shape, global axes."""
    v = np.zeros(place.v_size)
    for b in range(len(place.n)):
        v[place.R_dot(b)] = screws.u[b] + np.cross(screws.w[b], x[place.R(b)])
        v[place.omega(b)] = rotation_matrix(x[place.p(b)]).T @ screws.w[b]
    return v


def carried(place: Layout, screws: Screws, x: Array, time: float) -> Array:
    """(X,) where the screws carry the bodies in a time [s]."""
    out = x.copy()
    for b in range(len(place.n)):
        u, w = screws.u[b], screws.w[b]
        square = w @ w
        centre, along = (np.cross(w, u) / square, w * (w @ u) / square) if square else (np.zeros(3), u)
        turn = from_vector(w * time)
        out[place.R(b)] = centre + rotation_matrix(turn) @ (x[place.R(b)] - centre) + along * time
        out[place.p(b)] = product(turn, x[place.p(b)])
    return out


@dataclass(frozen=True)
class Machine:
    """A compiled scene at a time [s] whose bodies move in screws; `phases` (P,) [s] over which forces are averaged."""

    system: System
    time: float
    screws: Screws
    phases: tuple[float, ...] = (0.0,)

    @property
    def place(self) -> Layout:
        return self.system.layout


@dataclass(frozen=True)
class Matrices:
    """About a motion, in body axes: forces (V,) but those of the constraints; Phi (C,), jacobian (C, V) of the rows.

    M, G, D, K : (V, V) mass, gyroscopic, damping and stiffness matrix, centrifugal part and multipliers (C,) included
    over_turn  : (2, H + 1, V, V) complex, K and D of what varies over a turn by their harmonics exp(i k w t), k = 0 ... H
    """

    forces: Array
    Phi: Array
    jacobian: Array
    M: Array
    G: Array
    D: Array
    K: Array
    lam: Array
    over_turn: Array


def matrices(machine: Machine, x: Array, lam: Array, own: Sequence[_Loads] = ()) -> Matrices:
    """At the positions x (X,), with the multipliers lam (C,); `own` is what `_over_turn` has found there."""
    system, place = machine.system, machine.place
    across, rows = locked(place), sum(len(block.words) for block in system.blocks)
    at = balance(system.scene, place, system.blocks, machine.time, x, lam[:rows], {})
    Phi = np.concatenate([at.Phi, np.zeros(across.size)])
    jacobian = np.concatenate([at.jacobian, unit_rows(across, place.v_size)])
    forces, K = at.forces, at.stiffness
    own = own or _over_turn(machine, x)
    if len(own) > 1:
        only = balance(system.scene, place, system.blocks, machine.time, x, np.zeros(rows), {})
        forces, K = 0 * forces, K - only.stiffness
    over_turn = harmonics(np.array([one[1:] for one in own])).swapaxes(0, 1)
    forces, K = forces + sum(one[0] for one in own) / len(own), K + over_turn[0, 0].real
    D, G = over_turn[1, 0].real, np.zeros_like(K)
    inside = to_body_axes(place, x, velocities(place, machine.screws, x))
    for b, body in enumerate(system.scene.bodies):
        one = slice(place.iv[b], place.iv[b] + 6 + place.n[b])
        part = spinning(kept_integrals(body), x[place.q(b)], inside[place.R_dot(b)], inside[place.omega(b)])
        forces[one] += part.force
        K[one, one] -= part.hessian
        G[one, one] = part.gyroscopic
    if not np.isfinite(K).all():
        raise ComputationError(
            f"at t = {machine.time:.6g} s a force has no finite value beside the steady motion; look at its function"
        )
    return Matrices(forces, Phi, jacobian, total_mass_matrix(system.scene, place, x), G, D, K, lam, over_turn)


_Loads = tuple[Array, Array, Array]


def _over_turn(machine: Machine, x: Array) -> list[_Loads]:
    """Forces (V,), stiffness and damping (V, V) at every phase: of one phase alone, what velocities add to forces at rest."""
    system, place = machine.system, machine.place
    now = At(system.scene, place, machine.time, x, velocities(place, machine.screws, x))
    seeing = [(force, _looks(now, force)) for force in forces_of(system.scene) if _sees_velocities(now, force)]
    paced, _ = machine.screws.in_whole_turns()
    return [_loads(machine, time, carried(place, paced, x, time), seeing) for time in machine.phases]


def _loads(machine: Machine, later: float, x: Array, seeing: Sequence[tuple[Force, bool]]) -> _Loads:
    """At a phase; `seeing` are the forces that change with velocities, and whether their laws look at the state."""
    system, place, time = machine.system, machine.place, machine.time + later
    forces, K = np.zeros(place.v_size), np.zeros((place.v_size, place.v_size))
    D = damping(system.scene, place, time, x)
    if len(machine.phases) > 1:
        none = np.zeros(sum(len(block.words) for block in system.blocks))
        at = balance(system.scene, place, system.blocks, time, x, none, {})
        forces, K = forces + at.forces, K + at.stiffness
    if not (machine.screws.fastest or machine.screws.u.any()):
        return forces, K, D
    now = At(system.scene, place, time, x, velocities(place, machine.screws, x))
    total = nothing_on(all_placed(replace(now, v=np.zeros(place.v_size))), place.v_size)
    for force, looks in seeing:
        if isinstance(force.place, (AtMarker, OnBody)) or looks:
            _add_by_differences(total, D, machine.screws, now, force)
        else:
            add_velocities(total, D, now, force, _ends(machine.screws, now, force))
    return forces + total.forces, K - total.tangent, D


def _ends(screws: Screws, now: At, force: Force) -> tuple[Array, Array]:
    """(2, 3) u and w of the markers of a force; the ground's are zero."""
    numbers = [markers(now.scene)[number][0] for number in force.place.ends(now.scene)]
    u, w = (np.concatenate([one, np.zeros((1, 3))]) for one in (screws.u, screws.w))
    return u[numbers], w[numbers]


def _sees_velocities(now: At, force: Force) -> bool:
    """Whether a force changes with velocities: asked once, at others than those of the motion."""
    still = applied_by(replace(now, v=np.zeros(now.v.size)), force).generalised
    shaken = applied_by(replace(now, v=now.v + np.cos(np.arange(now.v.size))), force).generalised
    return bool(np.abs(shaken - still).max(initial=0.0) > 1e-14 * np.abs(shaken).max(initial=0.0))


def _looks(now: At, force: Force) -> bool:
    """Whether the law of a force on coordinates looks at the state of the scene."""
    watched = Watched(now.scene, now.place, now.t, now.x, now.v, [])
    applied_by(watched, force)
    return bool(watched.looks)


def _add_by_differences(total: Sums, D: Array, screws: Screws, now: At, force: Force) -> None:
    """Add the part that velocities have in a force of any kind, in its tangent and in the damping (V, V)."""
    place, still, sizes = now.place, np.zeros(now.v.size), velocity_sizes(now.scene, now.place)
    pace = float(np.abs(now.v / sizes).max())

    def given(at: At) -> Array:
        return applied_by(at, force).generalised

    def added(y: Array) -> Array:
        there = moved(place, now.x, y)
        moving = replace(now, x=there, v=velocities(place, screws, there))
        return given(moving) - given(replace(moving, v=still))

    def rated(rate: Array) -> Array:
        return given(replace(now, v=now.v + to_global_axes(place, now.x, rate)))

    here = added(still)
    total.forces[:] += here
    total.tangent[:] += _derivative(added, STEP * sizes)
    for b in range(len(place.n)):  # they are in the axes of bodies that are moved, the tangent is in those at x
        shift, turn = place.R_dot(b), place.omega(b)
        total.tangent[shift, turn] -= skew(here[shift])
        total.tangent[turn, turn] -= 0.5 * skew(here[turn])
    D -= damping_of(total, replace(now, v=still), force) + _derivative(rated, pace * sizes)


def _derivative(function: Callable[[Array], Array], steps: Array) -> Array:
    """(V, V) derivative of V numbers by as many at zero, by extrapolated central differences of steps (V,)."""
    return differences(function, steps, range(steps.size))[0]


# ---- the balance ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Steady:
    """A steady motion: positions x (X,), velocities v (V,), the matrices about it, and free motions Z (V, d), Z^T M Z = 1.

    steps : of Newton's method;  notes : what is left out of it
    leapt : whether it may be another than that near the start
    """

    machine: Machine
    x: Array
    v: Array
    about: Matrices
    Z: Array
    steps: int
    notes: tuple[str, ...] = ()
    leapt: bool = False


def steady_state(
    assembled: Assembled,
    time: float,
    start: Array | None = None,
    reached: Callable[[Machine, Array], Steady] | None = None,
    *,
    varies: bool = False,
) -> Steady:
    """The steady motion with the velocities of an assembled scene at `time` [s]; `start` (X,) is where to begin to look, and
    `reached` how it is found from there: `from_rest`, the default, or `nearby`. varies : whether forces or stiffness are
    known to change with the angle, as at another speed, so that none is looked for that stands at this one.

    Raises InputError for a scene whose joints do not allow it, and for a motion that something drives or brakes;
    ComputationError where the bodies find no balance.
    """
    system, reach = assembled.system, reached or from_rest
    machine = Machine(system, time, screws_of(system.layout, assembled.x, assembled.v))
    begin = assembled.x if start is None else start
    if varies:
        return _of_the_mean(machine, begin, reach)
    try:
        found = reach(machine, begin)
    except (InputError, LeapError) as error:
        # A weight across the axis turns what is not balanced at one angle, and not over a turn.
        if (mean := _of_the_mean_if_any(machine, begin, reach)) is None:
            raise error from None
        return mean
    refused = _not_lasting(found)
    varying, notes = np.inf if refused else _varying(found), tuple[str, ...]()
    one = _all_turning(found, begin, reach) if varying > VARIES else None
    if one is None and refused:
        raise refused
    if one is not None and (less := _varying(one)) < varying:
        found, varying, notes = one, less, (ALL_TURN,)
    notes = (*_turned_on(found.machine, found.x), *notes)  # of the motion that is taken, not of one that was tried
    if varying > VARIES:
        found = reach(replace(found.machine, phases=_phases(found.machine)), found.x)
        notes = (*notes, _varies(varying, found.machine.screws.rate))
    return replace(found, notes=notes)


def _of_the_mean(machine: Machine, x: Array, reach: Callable[[Machine, Array], Steady]) -> Steady:
    """That of the forces' mean over a turn, near x (X,)."""
    found = reach(replace(machine, phases=_phases(machine)), x)
    if refused := _not_lasting(replace(found, machine=machine)):
        raise refused
    notes, varying = _turned_on(machine, found.x), _varying(_at(machine, found.x))
    notes = (*notes, _varies(varying, machine.screws.rate)) if varying > VARIES else notes
    return replace(found, notes=notes)


def _of_the_mean_if_any(machine: Machine, x: Array, reach: Callable[[Machine, Array], Steady]) -> Steady | None:
    """The same, None where there is none, or nothing changes over a turn."""
    try:
        return _of_the_mean(machine, x, reach) if _varying(_at(machine, x)) > VARIES else None
    except (ComputationError, InputError, LeapError):
        return None


def _all_turning(found: Steady, x: Array, reach: Callable[[Machine, Array], Steady]) -> Steady | None:
    """The steady motion near x (X,) in which all bodies turn with the fastest; None where there is none, and where something
    holds them, as the feet of a casing do."""
    together = _together(found)
    if together is None or _held_against_turning(together, found.x):
        return None
    try:
        one = reach(together, x)
    except (ComputationError, InputError, LeapError):
        return None
    return None if _not_lasting(one) else one


def _held_against_turning(machine: Machine, x: Array) -> bool:
    """Whether forces between markers, at rest, are stiff against all bodies turning on together."""
    size = machine.place.v_size
    now = At(machine.system.scene, machine.place, machine.time, x, np.zeros(size))
    total = nothing_on(all_placed(now), size)
    for force in forces_of(now.scene):
        if min(force.place.ends(now.scene)) >= 0:
            add_force(total, now, force, {}, {})
    on = to_body_axes(machine.place, x, velocities(machine.place, machine.screws, x)) / (machine.screws.fastest or 1.0)
    sizes = sizes_of(machine.system)
    return bool(-on @ total.tangent @ on > HELD * np.abs(np.diag(total.tangent) * sizes**2).max(initial=0.0))


def _together(found: Steady) -> Machine | None:
    """The machine with all bodies in the screw of one of the fastest, where the joints allow it; None where they do not, and
    where others turn in another way."""
    w = found.machine.screws.w
    speeds = np.linalg.norm(w, axis=1)
    fastest = np.flatnonzero(speeds >= (1 - SAME) * speeds.max())
    turning = w[speeds > SAME * speeds.max()]
    if len(turning) and not (np.abs(turning - w[fastest[0]]) <= SAME * speeds.max()).all():
        return None
    return next((one for b in fastest if (one := _in_screw(found, int(b)))), None)


def _in_screw(found: Steady, b: int) -> Machine | None:
    """The machine with all bodies in the screw of body b; None where joints do not allow it, or they are in it."""
    machine, place = found.machine, found.machine.place
    count = len(machine.screws.w)
    screws = Screws(np.tile(machine.screws.u[b], (count, 1)), np.tile(machine.screws.w[b], (count, 1)))
    change = to_body_axes(place, found.x, velocities(place, screws, found.x) - found.v)
    size, J = sizes_of(machine.system), found.about.jacobian
    across = (np.abs(J @ change) / row_sizes(J, size)).max(initial=0.0)
    largest = float(np.abs(change / size).max())
    return replace(machine, screws=screws) if largest and across <= OPENS * largest else None


def steady_here(system: System, time: float, x: Array, v: Array) -> Steady | None:
    """The steady motion that a state (x, v) on its constraints is in; None where it is in none."""
    machine = Machine(system, time, screws_of(system.layout, x, v))
    size = sizes_of(system)
    apart = np.abs((v - velocities(machine.place, machine.screws, x)) / size).max(initial=0.0)
    if apart > SAME * max(machine.screws.fastest, float(np.abs(v / size).max(initial=0.0))):
        return None
    found, notes = _in_balance(machine, x), _turned_on(machine, x)
    if found is not None and _varying(found) <= VARIES:
        return replace(found, notes=notes)
    found = _in_balance(replace(machine, phases=_phases(machine)), x)
    return found and replace(found, notes=(*notes, _varies(_varying(_at(machine, x)), machine.screws.rate)))


def _in_balance(machine: Machine, x: Array) -> Steady | None:
    """The steady motion at positions (X,) that balance; None where they do not."""
    found = _at(machine, x)
    if np.abs(found.Z.T @ found.about.forces).max(initial=0.0) > SAME * _size_of_forces(found):
        return None
    return None if _not_lasting(found) else found


def _at(machine: Machine, x: Array) -> Steady:
    """The matrices at a state, balanced or not."""
    count = sum(len(block.words) for block in machine.system.blocks) + locked(machine.place).size
    own = _over_turn(machine, x)
    about = matrices(machine, x, np.zeros(count), own)
    about = matrices(machine, x, _multipliers(about, about.forces), own)
    Z = free_motions(about.jacobian, about.M)
    return Steady(machine, x, velocities(machine.place, machine.screws, x), about, Z, 0)


def _phases(machine: Machine) -> tuple[float, ...]:
    """[s] in which all bodies have turned by whole turns; the fastest by one, where there is but one speed."""
    fastest, (_, turns) = machine.screws.fastest, machine.screws.in_whole_turns()
    return tuple(2 * np.pi / fastest * k / PHASES for k in range(PHASES * turns)) if fastest else (0.0,)


def _turned_on(machine: Machine, x: Array) -> tuple[str, ...]:
    """Notes on bushings whose ends turn against each other for good, and that are stiff against rotation."""
    now = At(machine.system.scene, machine.place, machine.time, x, velocities(machine.place, machine.screws, x))
    stiff = [force for force in forces_of(now.scene) if force.holds_turning]
    against = [np.linalg.norm(np.diff(_ends(machine.screws, now, force)[1], axis=0)) for force in stiff]
    notes = tuple(
        f"bushing {force.name!r} is turned on and on, and its moments are for less than half a turn: they are no bearing's. "
        "Leave out its stiffness against rotation; two bushings at a distance along the axis hold a shaft against tilting"
        for force, turning in zip(stiff, against, strict=True)
        if turning > SAME * machine.screws.fastest
    )
    return (*notes, *_beside_the_axis(machine, now))


def _beside_the_axis(machine: Machine, now: At) -> tuple[str, ...]:
    """A note on the bushing that holds a turning body to what does not turn farthest from the body's axis."""
    far, who, placed = 0.0, "", all_placed(now)
    for force in forces_of(now.scene):
        if not isinstance(force.place, BetweenAxes):
            continue
        u, w = _ends(machine.screws, now, force)
        turning = np.linalg.norm(w, axis=1) > SAME * machine.screws.fastest
        if turning.sum() != 1:
            continue
        k = int(np.argmax(turning))
        held = placed[force.place.ends(now.scene)[1 - k]].r
        beside = np.linalg.norm(np.cross(w[k], u[k] + np.cross(w[k], held))) / float(w[k] @ w[k])
        far, who = max((far, who), (float(beside), force.name))
    if far <= BESIDE * length_of(now.scene):
        return ()
    return (
        f"the axis, about which bodies turn by the velocities of the scene, passes bushing {who!r} by up to {far:.3g} m, and "
        "strains it at every turn: give bodies whose origin is not on the axis the velocity that it has, omega x r, and draw "
        "a foundation that loads move aside where it then stands",
    )


def _varies(varying: float, rate: float) -> str:
    of_modes = (
        "The modes take account of the change; `periodic` finds the motion itself"
        if rate
        else "Bodies turn at several speeds: the modes are found for the mean, too, and are off by what couples them, as a "
        "bearing between two rotors does; `periodic` with floquet finds the motion itself and its modes"
    )
    return (
        "the stiffness of the supports or the forces change with the angle of the turning bodies, by up to "
        f"{varying:.1g} of their size. Bearings that are not isotropic, weight across the axis and loads of fixed direction "
        f"do so. The steady motion is found for the mean over a turn. {of_modes}"
    )


def steadily(assembled: Assembled, time: float) -> Assembled:
    """The scene in its steady motion at `time` [s], for a run that begins in it. Raises as `steady_state`."""
    found = steady_state(assembled, time)
    notes = (*assembled.notes, "starts in its steady motion", *found.notes)
    return replace(assembled, x=found.x, v=found.v, notes=notes)


class LeapError(Exception):
    """No steady motion is known to be near."""


def nearby(machine: Machine, x: Array, drag: float = UNBALANCED) -> Steady:
    """By Newton's method alone; `drag` as of `from_rest`. Raises LeapError where it fails or may have led to another motion
    than that near x."""
    found = _newton(machine, x, drag=drag)
    if found is None or found.leapt:
        raise LeapError
    return found


def from_rest(machine: Machine, x: Array, drag: float = UNBALANCED) -> Steady:
    """By Newton's method, or by shares of the speed that grow; with no more `drag` than that of the forces along what turns
    on by itself, where something beside the scene keeps its speed."""
    share, size, now, steps = 0.0, 1.0, x, 0
    while True:
        goal = min(share + size, 1.0)
        found = _newton(replace(machine, screws=machine.screws.times(goal)), now, drag=drag)
        if found is not None and goal == 1.0:
            return replace(found, steps=steps + found.steps)
        if found is not None:
            share, size, now, steps = goal, 2 * size, found.x, steps + found.steps
        elif (size := size / 4) < LEAST_SHARE:
            raise ComputationError(
                f"no steady motion was found at {machine.screws.fastest:.6g} rad/s; from rest it could be followed to "
                f"{share * machine.screws.fastest:.4g} rad/s: a body may be too soft for more, a joint near a dead point, "
                "or a load larger than what holds it"
            )


def nearly_balanced(machine: Machine, x: Array) -> Steady:
    """At positions (X,) themselves, which all but balance: as near a critical speed, where next to nothing bends a shaft
    without bound. Raises LeapError where they do not."""
    found = _at(machine, x)
    if np.abs(found.Z.T @ found.about.forces).max(initial=0.0) > NEARLY * _size_of_forces(found):
        raise LeapError
    return found


def held_at_rest(machine: Machine, x: Array) -> Steady:
    """Where a machine rests that little turns, and nothing holds, as the weight of a rotor in bearings that is not quite
    balanced: it is held there. Raises LeapError where it is no little, and where nothing is found."""
    found = None if machine.screws.fastest else _newton(machine, x, NEARLY)
    if found is None:
        raise LeapError
    return found


def _newton(machine: Machine, x: Array, unbalanced: float = LET_GO, drag: float = UNBALANCED) -> Steady | None:
    """The steady motion near x, None where the steps do not come to an end; with no more `unbalanced` of the forces along
    what has no stiffness, and `drag` along what turns on."""
    place, size = machine.place, sizes_of(machine.system)
    about, lengths = _at(machine, x).about, list[float]()
    for count in range(1, ITERATIONS + 1):
        Z = free_motions(about.jacobian, about.M)
        steady = Steady(machine, x, velocities(place, machine.screws, x), about, Z, count, (), _leapt(lengths))
        if _balanced(steady):
            return steady
        closing = smallest_step(about.jacobian, about.M, -about.Phi)
        y = closing + _solved(steady, about.forces - about.K @ closing)
        length = float(np.abs(y / size).max())
        if not np.isfinite(length):
            return None
        lengths.append(length)
        lam = _multipliers(about, about.forces - about.K @ y)
        x = moved(place, x, min(1.0, LARGEST / length) * y if length else y)
        about = matrices(machine, x, lam)
        if length < TOLERANCE or (length < STALLED and length > 0.5 * min(lengths[:-1], default=np.inf)):
            steady = replace(steady, x=x, v=velocities(place, machine.screws, x), about=about)
            _require_balance(steady, unbalanced, drag)
            return steady
    return None


def _leapt(lengths: Sequence[float]) -> bool:
    """Whether steps so long may have led to another steady motion: one is cut, or they do not halve from the first on, as
    where there is hardly any stiffness (Deuflhard, Newton Methods for Nonlinear Problems (2004), ch. 5). Small ones lead to
    what is near, and do not halve where a stop is met."""
    later = max(lengths[1:], default=0.0)
    return bool(lengths) and (max(lengths) > LARGEST or later > max(0.5 * lengths[0], NEAR))


def _balanced(found: Steady) -> bool:
    """Whether nothing is left to do but rounding, as of what is straight at its critical speed."""
    left = np.abs(found.Z.T @ found.about.forces).max(initial=0.0)
    reach = row_sizes(found.about.jacobian, sizes_of(found.machine.system))
    open_rows = (np.abs(found.about.Phi) / reach).max(initial=0.0)
    return bool(left <= BALANCED * _size_of_forces(found) and open_rows <= BALANCED)


def _multipliers(about: Matrices, forces: Array) -> Array:
    """(C,) of the rows, that leave the least of the forces (V,) in the norm of the inverse mass matrix."""
    if not len(about.jacobian):
        return np.zeros(0)
    rows = of_mass(about.M, about.jacobian.T)
    length = np.linalg.norm(rows, axis=0)
    rows = rows / (unit := np.where(length > 0, length, 1.0))  # alike: those of a small machine differ by its size
    found: Array = np.linalg.lstsq(rows.T @ rows, rows.T @ of_mass(about.M, forces), rcond=None)[0] / unit
    return found


def _solved(near: Steady, forces: Array) -> Array:
    """(V,) the smallest free motion that balances forces (V,); none along what has no stiffness, or turns on by itself."""
    g, complete = turning_freely(near)
    Z = near.Z @ complete[:, g:]
    if not Z.size:
        return np.zeros(forces.size)
    U, values, W = np.linalg.svd(Z.T @ near.about.K @ Z)
    stiff = values > _neutral(near, values)
    found: Array = Z @ (W[stiff].T @ ((U.T @ (Z.T @ forces))[stiff] / values[stiff]))
    return found


def turning_freely(near: Steady) -> tuple[int, Array]:
    """How many free motions only turn on what turns by itself; with them first, (d, d) free motions that are orthogonal."""
    system, about = near.machine.system, near.about
    now = At(system.scene, system.layout, near.machine.time, near.x, near.v)
    together = any(_looks(now, force) for force in forces_of(system.scene))
    V = to_body_axes(system.layout, near.x, near.v)
    motions = near.Z.T @ about.M @ turning_on(system, about.jacobian, V, sizes_of(system), together)
    count = motions.shape[1]
    return count, np.linalg.qr(motions, mode="complete")[0] if count else np.eye(len(motions))


def _neutral(near: Steady, values: Array) -> float:
    """Stiffness of free motions below which it is rounding, beside the largest and beside that of inertia."""
    return NEUTRAL * max(float(values.max(initial=0.0)), near.machine.screws.fastest**2)


def _require_balance(found: Steady, unbalanced: float, drag: float) -> None:
    """InputError where forces act along a motion that nothing holds: it speeds up or slows down."""
    about, Z = found.about, found.Z
    left = Z.T @ about.forces
    U, values, _ = np.linalg.svd(Z.T @ about.K @ Z)
    g, complete = turning_freely(found)
    turning, slack, size = complete[:, :g], U[:, values <= _neutral(found, values)], _size_of_forces(found)
    along = turning.T @ left
    others = slack.T @ (left - turning @ along)
    if np.abs(along).max(initial=0.0) <= drag * size and np.abs(others).max(initial=0.0) <= unbalanced * size:
        return
    system = found.machine.system
    motion = named_motion(system.scene, system.layout, found.x, Z @ (turning @ along + slack @ others))
    raise InputError(
        f"no steady motion: what acts along {motion} speeds it up or slows it down; add a driver of constant speed, or leave "
        "out the force that does; at a critical speed, where nothing holds a shaft, begin beside it"
    )


def _size_of_forces(found: Steady) -> float:
    """Of all forces, of the weight that they may balance, or of those that would hold the scene's mass at its size from the
    axis; in the free motions' units."""
    about, machine = found.about, found.machine
    mass, place = np.sqrt(np.diag(about.M)), machine.place
    applied = np.abs(of_mass(about.M, about.forces)).max()
    weight = np.linalg.norm(machine.system.scene.gravity) * max(mass[place.R_dot(b)].max() for b in range(len(place.n)))
    held = machine.screws.fastest**2 * (sizes_of(machine.system) * mass).max()
    return float(max(applied, weight, held)) or 1.0


# ---- the same at every angle ----------------------------------------------------------------------------------------


def _later(found: Steady) -> tuple[Machine, Array]:
    """The machine when its fastest body has turned on by a radian, and the positions (X,) then."""
    machine, fastest = found.machine, found.machine.screws.fastest
    later = TURNED / fastest if fastest else 0.0
    return replace(machine, time=machine.time + later), carried(machine.place, machine.screws, found.x, later)


def _not_lasting(found: Steady) -> InputError | None:
    """Why it is none: rows that do not hold as the bodies move on in their screws; None where all do."""
    machine, x = _later(found)
    about = matrices(machine, x, found.about.lam)
    size = sizes_of(machine.system)
    reach = row_sizes(about.jacobian, size)
    opened = np.abs(about.Phi) / reach
    turned = np.abs(about.jacobian @ (found.Z / np.abs(found.Z / size[:, None]).max(axis=0, initial=1e-300))).max(
        axis=1, initial=0.0
    )
    bad = np.maximum(opened, turned / reach)
    if bad.max(initial=0.0) <= OPENS:
        return None
    names = [block.name for block in machine.system.blocks for _ in block.words]
    worst = int(np.argmax(bad[: len(names)])) if names else 0
    if opened.max(initial=0.0) <= OPENS:
        return InputError(
            f"about the steady motion {names[worst]!r} lets bodies that turn at different speeds move aside together, which "
            "has no constant axes: put a stiff Bushing in its place, which may turn freely, or take `periodic` with floquet"
        )
    return InputError(
        f"no steady motion: with every body turning on at a constant speed, {names[worst]!r} does not hold; a machine whose "
        "bodies do not all turn evenly, about axes that stay, has a periodic motion: `periodic`"
    )


def _varying(found: Steady) -> float:
    """How much forces and stiffness change over a radian, relative."""
    machine, x = _later(found)
    if machine.time == found.machine.time:
        return 0.0
    first, Z = found.about, found.Z
    again = matrices(machine, x, np.zeros_like(first.lam))
    again = matrices(machine, x, _multipliers(again, again.forces))
    K, there = Z.T @ first.K @ Z, Z.T @ again.K @ Z
    scale = np.sqrt(np.abs(np.diag(K)) + machine.screws.fastest**2)
    by_stiffness = np.abs((there - K) / np.outer(scale, scale)).max(initial=0.0)
    by_forces = np.abs(Z.T @ (again.forces - first.forces)).max(initial=0.0) / _size_of_forces(found)
    return float(max(by_stiffness, by_forces))
