"""Energy that comes from nowhere: the sign of a step beyond what its method bears.

At every recorded row kinetic and strain energy are compared with what the scene had to give: what it began with, what
gravity has released, and the work of all forces and drivers, by their powers at the rows. Rows may miss what happens between
them. So where the energy is far beyond, the last part of the run is done again with a quarter of the step, and the run stops
only when the energy does not grow there, or grows to something else and without a source too; and only when it grows on with
the step as it is: a shock that steps do not resolve leaves what it leaves, and no more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.balance import HELD, Account, add_rows, amiss, lost_rebounds, missed_by_rows, shortest_meeting
from ffr_dyn.consistency.evaluation import evaluator, joined, record_states
from ffr_dyn.consistency.explicit_forces import candidates, fastest, told
from ffr_dyn.consistency.tangent import chart, state_matrix
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import excess_of_gains
from ffr_dyn.integrators.tolerances import tightened
from ffr_dyn.kernels.tables import NOT_FINITE, OK, Record
from ffr_dyn.results.power import power
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.scene.force_kinds import forces_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

BEYOND = 10.0  # times what there was to give, from where the energy is looked into
ANCHOR = 2.5  # times that, up to where the part begins that is done again
SHORTER = 4  # times, the steps with which it is
ROWS = 2000  # of the part, at most
FURTHER = 50  # steps at least, with which it must grow on
QUIET = 1e-6  # m^2/s^2, twice the energy by mass that is not looked at
AGREED = 0.1  # part of the energy by which both steps may differ where it is none of their doing


@dataclass(frozen=True)
class _Row:
    """A recorded row: time, state, joint coordinates of the forces, kinetic and strain energy, and that with gravity's."""

    time: float
    x: Array
    v: Array
    reference: Array
    energy: float
    total: float


@dataclass
class EnergyWatch:
    """The account of the energy in the rows so far.

    spacing  : of the steps, or of the rows of a method that chooses its steps [s]
    complete : gives a record the reactions of redundant rows;  moments : of `Account`
    begun    : [J] at the start, with what turned out to have a source later;  highest : [J] energy of gravity so far
    time, powers, work : of the last row, and of each force and driver [W] and [J]
    anchor   : the last row with an energy that is no wonder;  account : of all energy, both ways
    suspect  : two rows between which most of the energy has come or gone that the account leaves open, and how much [J]
    """

    system: System
    method: Integrator
    gains: tuple[float, float, float]
    spacing: float
    complete: Callable[[Record], Record]
    moments: Array = field(default_factory=lambda: np.zeros(0))
    begun: float = 0.0
    highest: float = -np.inf
    time: float = 0.0
    powers: Array = field(default_factory=lambda: np.zeros(0))
    work: Array = field(default_factory=lambda: np.zeros(0))
    anchor: _Row | None = None
    account: Account = field(init=False)
    suspect: tuple[Record, float] | None = None

    def __post_init__(self) -> None:
        self.account = Account(self.system, self.moments)

    def amiss(self) -> list[str]:
        """Notes on energy that forces and drivers do not account for, too little to stop the run."""
        kind, step = type(self.method).__name__, f", {self.method.step:.3g} s"
        remedy = ("", "use smaller tolerances") if self.method.controlled else (step, "use a smaller step")
        found = amiss(self.account, kind + remedy[0], remedy[1])
        return [] if found and self._explained_between_rows() else found

    def shortest_meeting(self) -> float:
        """[s] for which a stop is met at least, infinite where none is."""
        return shortest_meeting(self.account)

    def lost_rebounds(self) -> list[str]:
        """What tells that the steps are too long for the stops that are met."""
        return lost_rebounds(self.account, 0.0 if self.method.controlled else self.method.step)

    def stops_between_rows(self) -> list[str]:
        """Notes on stops whose force rows miss."""
        found = []
        for row, (begin, end, rate) in enumerate(self.account.stops["between"]):
            if not rate > 0:
                continue
            x, v, forces, energy = (self.account.stops[f"between.{name}"][row] for name in HELD)
            first = _Row(float(begin), x, v, forces, float(energy[0]), float(energy.sum()))
            status, fine = self._again(first, float(end), 1)
            if status == OK:
                found += missed_by_rows(self.account, row, View(self.system, fine))
        return found

    def look(self, view: View) -> None:
        """Take note of the rows that follow. Raises ComputationError when their energy comes from nowhere."""
        rows = view.record
        with np.errstate(all="ignore"):
            energy, powers = rows.energy[:, 0] + rows.energy[:, 1], _powers(view)
            self._suspect(rows, np.diff(add_rows(self.account, rows, powers)))
            if self.anchor is None:
                self._begin(rows, energy, powers)
            given = self._given(rows, powers)
        first = 0
        while first < energy.size:
            far = first + np.flatnonzero(~(energy[first:] <= BEYOND * given[first:]))[:1]
            end = int(far[0]) if far.size else energy.size
            for near in first + np.flatnonzero(energy[first:end] <= ANCHOR * given[first:end])[-1:]:
                self.anchor = _row(rows, int(near), energy)
            if far.size:
                self.anchor = self._looked_into(_row(rows, end, energy))
                source = energy[end] - given[end]
                self.begun, given[end:] = self.begun + float(source), given[end:] + source
            first = end + 1

    def _suspect(self, rows: Record, left: Array) -> None:
        """Remember between which rows most is left open, of those that follow and of those before; left (T - 1,) [J]."""
        k = int(np.argmax(np.abs(left))) if left.size else 0
        if left.size and abs(left[k]) > (0.0 if self.suspect is None else abs(self.suspect[1])):
            self.suspect = Record(*(column[k : k + 2].copy() for column in rows)), float(left[k])

    def _explained_between_rows(self) -> bool:
        """Whether powers at the steps account for what powers at the rows leave open: they vary between rows."""
        if self.suspect is None:
            return False
        (rows, left), first = self.suspect, _row(self.suspect[0], 0, self.suspect[0].energy[:, 0])
        status, fine = self._again(first, float(rows.time[1]), 1)
        if status != OK:
            return False
        steps = joined([Record(*(column[:1] for column in rows)), self.complete(fine)])
        with np.errstate(all="ignore"):
            at_steps = add_rows(Account(self.system), steps, _powers(View(self.system, steps)))
        return bool(abs(at_steps[-1]) <= 0.5 * abs(left))

    def _begin(self, rows: Record, energy: Array, powers: Array) -> None:
        mass = sum(body.model.mass for body in self.system.scene.bodies)
        self.begun = float(energy[0]) + QUIET * mass
        self.time, self.powers, self.work = float(rows.time[0]), powers[0], np.zeros(powers.shape[1])
        self.anchor = _row(rows, 0, energy)

    def _given(self, rows: Record, powers: Array) -> Array:
        """(T,) what the scene had to give up to each row."""
        times, known = np.append(self.time, rows.time), np.concatenate([self.powers[None], powers])
        steps, means = (times[1:] - times[:-1])[:, None], 0.5 * (known[1:] + known[:-1])
        work = self.work + (steps * means).cumsum(axis=0)
        height = np.maximum.accumulate(np.append(self.highest, rows.energy[:, 2]))[1:]
        self.time, self.powers, self.work, self.highest = float(rows.time[-1]), powers[-1], work[-1], float(height[-1])
        found: Array = self.begun + np.maximum(work, 0.0).sum(axis=1) + height - rows.energy[:, 2]
        return found

    def _looked_into(self, row: _Row) -> _Row:
        """The row. Raises ComputationError when a quarter of the step tells that its energy has no source."""
        anchor = self.anchor
        assert anchor is not None
        status, fine = self._again(anchor, row.time, SHORTER)
        found = float(fine.energy[-1, :2].sum()) if status == OK else np.inf
        if (status == NOT_FINITE or (status == OK and not found >= 0.5 * row.energy)) and self._grows_on(row):
            raise ComputationError(self._told(anchor, row, found))
        if status == OK and not abs(found - row.energy) <= AGREED * row.energy and self._accountable():
            with np.errstate(all="ignore"):
                powers = _powers(View(self.system, self.complete(fine))).sum(axis=1)
                work = float(np.diff(fine.time, prepend=anchor.time) @ powers)
                grown = float(fine.energy[-1].sum()) - anchor.total
            if not grown - work <= 0.5 * found and self._grows_on(row):
                raise ComputationError(self._told(anchor, row, found))
        return row

    def _grows_on(self, row: _Row) -> bool:
        """Whether the energy doubles as soon again when the run goes on from a row."""
        anchor = self.anchor
        assert anchor is not None
        span = max(row.time - anchor.time, FURTHER * self.spacing)
        status, later = self._again(row, row.time + span, 1)
        with np.errstate(all="ignore"):
            return status != OK or not bool((later.energy[:, :2].sum(axis=1) <= 2.0 * row.energy).all())

    def _again(self, anchor: _Row, end: float, shorter: int) -> tuple[int, Record]:
        """From a row to a time with steps so many times shorter: a status, and the rows."""
        span = end - anchor.time
        steps = shorter * max(1, round(span / self.spacing))
        rows = min(steps, ROWS)
        substeps = -(-steps // rows)
        step = span / (rows * substeps)
        method = _finer(self.method, step) if shorter > 1 or not self.method.controlled else self.method
        spacing = step * substeps if method.controlled else step
        engine = new_engine(self.system, anchor.x, anchor.v, method, self.gains, start=anchor.time, spacing=spacing)
        engine.work.loads.reference[:] = anchor.reference
        record = new_record(self.system, rows)
        return fill_rows(engine, record, anchor.time, 1 if method.controlled else substeps), record

    def _accountable(self) -> bool:
        """Whether the recorded powers are all there are."""
        return bool((self.system.model.base < 0).all())

    def _told(self, anchor: _Row, row: _Row, found: float) -> str:
        finer = f"it is {found:.3g} J" if found < row.energy else "it grows as well"
        return (
            f"at t = {row.time:.6g} s the energy has grown to {row.energy:.3g} J, which no force or driver has put in, most "
            f"of all in body {self._grown(anchor, row)!r}; with a quarter of the step {finer}. {self._cause(anchor)}"
        )

    def _grown(self, anchor: _Row, row: _Row) -> str:
        """The body whose energy has grown most."""
        growth = _by_body(self.system, row) - _by_body(self.system, anchor)
        return self.system.scene.bodies[int(np.argmax(np.nan_to_num(growth, nan=np.inf, posinf=np.inf)))].name

    def _cause(self, anchor: _Row) -> str:
        h, kind = self.spacing, type(self.method).__name__
        if self.method.controlled:
            return "The tolerances of the steps are too large for this motion: use smaller ones"
        if excess := excess_of_gains(self.gains, h):
            return excess
        if stiff_forces := _too_stiff(self.system, self.method, anchor):
            return stiff_forces[0]
        fastest = _fastest(self.system, anchor)
        if h * fastest > self.method.reach:
            stiff = any(force.stiff_coordinates for force in forces_of(self.system.scene))
            other = ", or ROS2" if stiff or max(self.system.layout.n) > 0 else ""
            return (
                f"A step of {h:.3g} s is beyond the stability of {kind}: the scene vibrates with up to {fastest:.4g} "
                f"rad/s, which needs one below {self.method.reach / fastest:.2g} s; use that{other}"
            )
        projected = "" if self.gains[2] > 0 else ", or projection"
        if self.system.scene.drivers and not fastest:
            return (
                f"Its drivers lead it through a dead point, or too fast for steps of {h:.3g} s: keep driven motions within "
                f"reach, or use a smaller step{projected}"
            )
        force = "a stop or a Python function" if self.method.takes_forces else "a stiff spring or stop"
        return (
            f"A step of {h:.3g} s of {kind} is too long for this motion, whose fastest rate is {fastest:.4g} 1/s ({force}, "
            f"fast rotation, or a mode that is loaded); use a smaller step{projected}"
        )


def _row(rows: Record, k: int, energy: Array) -> _Row:
    state = rows.x[k].copy(), rows.v[k].copy(), rows.forces[k].copy()
    return _Row(float(rows.time[k]), *state, float(energy[k]), float(rows.energy[k].sum()))


def _powers(view: View) -> Array:
    """(T, sources) of all forces and drivers."""
    scene = view.system.scene
    drives = [*scene.drivers, *(joint for joint in scene.joints if joint.kind == "distance")]
    return np.concatenate([view.record.power, *(power(view, drive)[:, None] for drive in drives)], axis=1)


def _finer(method: Integrator, step: float) -> Any:
    kept: Any = method
    if method.controlled:
        return replace(kept, tolerances=tightened(kept.tolerances, 100))
    return replace(kept, step=step)


def _too_stiff(system: System, method: Integrator, row: _Row) -> list[str]:
    """Notes on forces that the method takes explicitly, as they are at a row."""
    forces, at = candidates(system, method), evaluator(system)
    if not forces:
        return []
    try:
        rows = record_states(at, np.array([row.time]), row.x[None], row.v[None])
        return told(system, method, fastest(at, rows, forces))
    except (ComputationError, np.linalg.LinAlgError):
        return []


def _by_body(system: System, row: _Row) -> Array:
    """(B,) kinetic and strain energy."""
    found, place = [], system.layout
    with np.errstate(all="ignore"):
        for b, body in enumerate(system.scene.bodies):
            q, q_dot = row.x[place.q(b)], row.v[place.q_dot(b)]
            A = rotation_matrix(row.x[place.p(b)])
            V = np.concatenate([A.T @ row.v[place.R_dot(b)], row.v[place.omega(b)], q_dot])
            found.append(0.5 * V @ mass_matrix(kept_integrals(body), q) @ V + 0.5 * body.model.omega2 @ q**2)
    return np.array(found)


def _fastest(system: System, row: _Row) -> float:
    """Largest modulus of an eigenvalue of the scene at a row [1/s]; zero where it has none."""
    try:
        A, _ = state_matrix(chart(evaluator(system), row.time, row.x, row.v))
    except (ComputationError, np.linalg.LinAlgError):
        return 0.0
    return float(np.abs(np.linalg.eigvals(A)).max(initial=0.0)) if A.size and np.isfinite(A).all() else 0.0
