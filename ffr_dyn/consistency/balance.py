"""Whether forces and drivers account for the energy of a run, both ways: what has come, and what has gone.

Kinetic, strain and gravity energy and that of undamped springs and stops change by the work of all other forces, of
drivers and of modal damping. The work is the trapezoid of their powers at the rows; what rows cannot tell of it is known by
how much the powers bend from row to row, and nothing is said that is less than that. Between rows where a function of time
breaks, or comes and goes, powers at rows tell nothing, and what the energy changes by is taken for work.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import row_shapes
from ffr_dyn.consistency.evaluation import evaluate, evaluator, free_motions, total_mass_matrix
from ffr_dyn.equations.forces import At
from ffr_dyn.equations.inertia import damping_matrix
from ffr_dyn.equations.jets import coordinates
from ffr_dyn.equations.placed import all_placed, nothing_on, pair
from ffr_dyn.kernels.tables import SINCE, Record
from ffr_dyn.results.power import measured_values
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import COORDINATE, FORCE, RATE, AlongLine, OnJoint
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

AMISS = 0.1  # of the largest kinetic, strain and spring energy: from where it is told
SURE = 3.0  # times what rows leave open of the work
QUIET = 1e-6  # m^2/s^2, twice the energy by mass that is not looked at
# Numbers of an account [s], [J], [W]: see `Account`.
TIME, BEGUN, WORK, OPEN, MOST, WORST, WHEN, POWER, BEFORE, TOTAL, AT_STOPS, BESIDE = range(12)
REACHED = 2.0  # times the steps from row to row: where a stop is as near, it may be met between them
HELD = ("x", "v", "forces", "energy")  # of a row, from which steps begin again
RESOLVED = 4.0  # steps in the time that a stop is met for, with fewer it gives back something else
MISSED = 2.0  # times the largest force at rows, from where on that between them is told
REBOUND = AMISS**2  # of the largest energy, which comes back from a stop: from where on its loss is told


@dataclass(frozen=True)
class Account:
    """The account of the energy of a run: the rows so far.

    numbers : (12,) time of the last row, energy at the start, work since, what rows leave open of it, largest energy of
              motion and strain, largest difference between energy and work, its time, power of the last row and of the one
              before, energy of the last row
    moments : (K,) [s] at which functions of time change between rows, beside those that they break at
    stops   : of S stops "pushed" (S,) [N] the largest force at a row; "met" (S, 2) time and rate of the fastest approach and
              "met.x" (S, X); "between" (S, 3) the times of two rows that miss it and the fastest rate there, and what the
              first one holds, "between.x" (S, X), "between.v", "between.forces", "between.energy"; "last" (S, 2) coordinate
              and rate at the last row, and what that holds, "last.x" (S, X), "last.v", "last.forces", "last.energy"
    """

    system: System
    moments: Array = field(default_factory=lambda: np.zeros(0))
    numbers: Array = field(default_factory=lambda: np.full(12, np.nan))
    stops: dict[str, Array] = field(init=False)

    def __post_init__(self) -> None:
        of, count = row_shapes(self.system), len(_stops(self.system))
        held = {f"{row}.{name}": of[name] for row in ("between", "last") for name in HELD}
        sizes = {"pushed": (), "met": (2,), "met.x": of["x"], "between": (3,), "last": (2,), **held}
        object.__setattr__(self, "stops", {name: np.zeros((count, *size)) for name, size in sizes.items()})


def add_rows(account: Account, rows: Record, powers: Array) -> Array:
    """Go on by the rows that follow; powers (T, F + drivers) of all forces and drivers.

    Returns (T,) [J] what of the energy they do not account for by each row.
    """
    system, numbers = account.system, account.numbers
    stored, power = _stored(system, rows), _power(system, rows, powers)
    own = rows.energy[:, 0] + rows.energy[:, 1]
    energy, total = own + np.abs(stored), own + stored + rows.energy[:, 2]  # that of a negative stiffness is below zero
    if np.isnan(numbers[TIME]):
        numbers[:] = 0.0
        numbers[[TIME, BEGUN, MOST, WHEN, TOTAL]] = rows.time[0], total[0], energy[0], rows.time[0], total[0]
        numbers[[POWER, BEFORE]] = power[0]
    times = np.append(numbers[TIME], rows.time)
    steps = times[1:] - times[:-1]
    known = np.concatenate([numbers[[BEFORE, POWER]], power])
    seen = ~_breaks_between(account, times)
    grown = np.diff(total, prepend=numbers[TOTAL])
    work = numbers[WORK] + np.cumsum(np.where(seen, 0.5 * steps * (known[1:-1] + known[2:]), grown))
    unsure = steps * _left_open(known) * seen
    left_open = numbers[OPEN] + np.cumsum(unsure)
    left = total - numbers[BEGUN] - work
    near = np.append(numbers[BESIDE] > 0, _beside_stops(account, rows, steps))
    if near.any():
        lost = np.abs(np.diff(left, prepend=numbers[TOTAL] - numbers[BEGUN] - numbers[WORK]))
        numbers[AT_STOPS] += float(lost[(lost > SURE * unsure) & (near[:-1] | near[1:])].sum())
    sure = np.where(np.abs(left) > SURE * left_open, left, 0.0)
    worst = int(np.argmax(np.abs(sure)))
    if abs(sure[worst]) > abs(numbers[WORST]):
        numbers[[WORST, WHEN]] = sure[worst], rows.time[worst]
    numbers[MOST] = max(numbers[MOST], float(energy.max()))
    numbers[[TIME, WORK, OPEN, POWER, BEFORE]] = rows.time[-1], work[-1], left_open[-1], known[-1], known[-2]
    numbers[[TOTAL, BESIDE]] = total[-1], near[-1]
    return left


def _breaks_between(account: Account, times: Array) -> Array:
    """(T - 1,) whether a function of time breaks or changes between each two of T times."""
    moments = np.sort(np.concatenate([account.system.model.functions.breaks[:, SINCE], account.moments]))
    if not moments.size:
        return np.zeros(times.size - 1, dtype=bool)
    count = np.searchsorted(moments, times, side="right")
    found: Array = np.diff(count) > 0
    return found


def _beside_stops(account: Account, rows: Record, steps: Array) -> Array:
    """(T,) whether an undamped stop may be met in about the steps [s] from row to row that end at each; and take note of
    the fastest approach to every stop."""
    system = account.system
    view, met = View(system, rows), np.zeros(rows.time.size, dtype=bool)
    for row, (k, stop) in enumerate(_stops(system)):
        c, rate = measured_values(view, k, COORDINATE), measured_values(view, k, RATE)
        _note_missed(account, row, rows, (c, rate, measured_values(view, k, FORCE)), steps)
        if not stop.throws_back:
            continue
        reach = REACHED * steps * np.abs(rate)
        near = stop.energy(c - reach) + stop.energy(c + reach) > 0
        met |= near & _conserves(stop)
        speeds = np.where(near, np.abs(rate), 0.0)
        at = int(np.argmax(speeds))
        if speeds[at] > account.stops["met"][row, 1]:
            account.stops["met"][row], account.stops["met.x"][row] = (rows.time[at], speeds[at]), rows.x[at]
    return met


def _stops(system: System) -> list[tuple[int, Force]]:
    """What is met: stops, and springs whose curve has corners, with their numbers among the forces of a scene."""
    return [
        (k, force)
        for k, force in enumerate(forces_of(system.scene))
        if force.kinks and isinstance(force.place, OnJoint | AlongLine)
    ]


def _note_missed(account: Account, row: int, rows: Record, values: tuple[Array, Array, Array], steps: Array) -> None:
    """Take note of what stop number `row` does at rows, by its coordinate, rate and force, and of two rows between which it
    may be met: both are clear of it, and from both it is reached at the rate there."""
    (c, rate, force), stop, kept = values, _stops(account.system)[row][1], account.stops
    kept["pushed"][row] = max(kept["pushed"][row], np.abs(force).max())
    c, rate = (np.append(last, new) for last, new in zip(kept["last"][row], (c, rate), strict=True))
    clear = stop.energy(c) == 0
    ahead, behind = stop.energy(c[:-1] + rate[:-1] * steps), stop.energy(c[1:] - rate[1:] * steps)
    missed = clear[:-1] & clear[1:] & (rate[:-1] * rate[1:] < 0) & (ahead > 0) & (behind > 0)
    speeds = np.where(missed, np.abs(rate[:-1]), 0.0)
    at = int(np.argmax(speeds))
    if speeds[at] > kept["between"][row, 2]:
        before = account.numbers[TIME] if at == 0 else rows.time[at - 1]
        kept["between"][row] = before, rows.time[at], speeds[at]
        for name in HELD:
            kept[f"between.{name}"][row] = kept[f"last.{name}"][row] if at == 0 else getattr(rows, name)[at - 1]
    kept["last"][row] = c[-1], rate[-1]
    for name in HELD:
        kept[f"last.{name}"][row] = getattr(rows, name)[-1]


def missed_by_rows(account: Account, row: int, steps: View) -> list[str]:
    """A note on stop number `row` if it pushes between rows as it does at none, by the steps between two of them."""
    k, stop = _stops(account.system)[row]
    most, pushed = float(np.abs(measured_values(steps, k, FORCE)).max()), account.stops["pushed"][row]
    if not most > MISSED * pushed:
        return []
    of, (lasts, _) = stop.place.measured[0], _meeting(account, row)
    known = np.isfinite(lasts)
    met = f": the stop is met for about {lasts:.2g} s" if known else ""
    rows = f"an output_step of {0.1 * lasts:.1g} s or less" if known else "a smaller output_step"
    return [
        f"{stop.name}.{of.name} is {most:.3g} {of.unit} between rows and {pushed:.3g} {of.unit} at most in them{met}; take "
        f"{rows} to see it"
    ]


def shortest_meeting(account: Account) -> float:
    """[s] for which a stop is met at least, infinite where none is."""
    return min((_meeting(account, row)[0] for row in range(len(_stops(account.system)))), default=np.inf)


def lost_rebounds(account: Account, step: float) -> list[str]:
    """What tells that bodies come from stops with another energy than that of the scene: in runs of a fixed `step` [s] the
    stops that are met too shortly for it, and what undamped ones have lost or fed."""
    most, found = account.numbers[MOST], []
    for row, (_, stop) in enumerate(_stops(account.system)):
        lasts, returned = _meeting(account, row)
        if lasts < RESOLVED * step and returned > REBOUND * most:
            found.append(
                f"{stop.name!r} is met for about {lasts:.2g} s, which takes steps of {0.1 * lasts:.1g} s or less"
            )
    if not found and account.numbers[AT_STOPS] > AMISS * most and amiss(account, "", ""):
        return ["take a smaller step"]
    return found


def _meeting(account: Account, row: int) -> tuple[float, float]:
    """How long stop number `row` is met [s], and the energy [J] that comes back, by the mass that moves with it as bodies do
    that do not bend."""
    (time, rate), stop = account.stops["met"][row], _stops(account.system)[row][1]
    if not (rate > 0 and stop.throws_back):
        return np.inf, 0.0
    return stop.rebound(_mass_before(account.system, stop, float(time), account.stops["met.x"][row]), rate)


def _mass_before(system: System, stop: Force, time: float, x: Array) -> float:
    """[kg], [kg m^2] what moves with the joint coordinate of a stop; infinite where only bending moves it, and in a position
    that has no accelerations."""
    scene, place = system.scene, system.layout
    now = At(scene, place, time, x, np.zeros(place.v_size))
    total, ends = nothing_on(all_placed(now), place.v_size), stop.place.ends(scene)
    jets = coordinates(scene, pair(*(total.placed[number] for number in ends)), stop.place)
    gradient = total.gradient(ends, np.array([jet.first for jet in jets]))
    bending = np.vstack([np.eye(place.v_size)[place.q_dot(b)] for b in range(len(place.n))])
    try:
        jacobian = np.vstack([evaluate(evaluator(system), time, x, now.v).jacobian, bending])
        along = gradient @ free_motions(jacobian, total_mass_matrix(scene, place, x))
    except (ComputationError, np.linalg.LinAlgError):
        return np.inf
    moved = float(np.sum(along**2))
    return 1 / moved if moved > 0 else np.inf


def amiss(account: Account, method: str, remedy: str) -> list[str]:
    """Notes on energy of a run that has no source, or has gone nowhere; `remedy` is a sentence without its end."""
    scene, (most, worst, when) = account.system.scene, account.numbers[[MOST, WORST, WHEN]]
    least = QUIET * sum(body.model.mass for body in scene.bodies)
    if not abs(worst) > max(AMISS * most, least) or (account.system.model.base >= 0).any():
        return []
    if any(force.throws_back and not _conserves(force) for force in forces_of(scene)):
        return []  # an impact that takes energy may fall between two rows
    way = (
        "has come that no force or driver has put in" if worst > 0 else "has gone that no force or driver has taken out"
    )
    cause = "what the steps do not resolve grows" if worst > 0 else "what the steps do not resolve is damped by them"
    share = f", {abs(worst) / most:.2g} of the largest kinetic and strain energy" if most > 0 else ""
    return [f"by t = {when:.6g} s energy of {abs(worst):.3g} J {way}{share}: {cause} ({method}); {remedy}"]


def _left_open(known: Array) -> Array:
    """(T,) [W] what the trapezoid may be off in the interval that ends at each of the last T of T + 2 powers: by the second
    derivative where they are smooth, by all of a jump where they are not."""
    growth = known[1:] - known[:-1]
    bend = np.abs(growth[1:] - growth[:-1])
    smooth = bend < 0.5 * (np.abs(growth[1:]) + np.abs(growth[:-1]))
    return np.where(smooth, bend / 12, bend / 2)


def _stored(system: System, rows: Record) -> Array:
    """(T,) [J] in springs and stops without damping."""
    view, total = View(system, rows), np.zeros(rows.time.size)
    for k, force in enumerate(forces_of(system.scene)):
        if _conserves(force):
            count = len(force.place.initial) // 3
            total += force.energy(measured_values(view, k, 0 if count == 1 else slice(0, count)))
    return total


def _power(system: System, rows: Record, powers: Array) -> Array:
    """(T,) [W] of all that neither stores energy nor is gravity, modal damping included."""
    counted = np.ones(powers.shape[1], bool)
    own = [not _conserves(force) for force in forces_of(system.scene)]
    counted[: len(own)] = own
    total: Array = powers[:, counted].sum(axis=1)
    for b, body in enumerate(system.scene.bodies):
        if body.model.damping is not None or body.damping.any():
            rates = rows.v[:, system.layout.q_dot(b)]
            total = total - np.einsum("ti,ij,tj->t", rates, damping_matrix(body.model, body.damping), rates)
    return total


def _conserves(force: Force) -> bool:
    """Kinds that lose what they store have a `damping`: a number, a matrix or a curve."""
    return force.stores_energy and not np.any(getattr(force, "damping", 0.0))
