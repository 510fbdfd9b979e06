"""Processor time at equal accuracy, beside Exudyn 1.13 in the same run.

    python -m benchmarks.race [--quick] [--scene slider-crank] [--damping 0.02] [--stiffening]

Scenes: a slider-crank with a flexible rod (150 rad/s, started with the rod straight), a chain of 32 links and a pendulum
(both released from the horizontal), with 8 and 32 elastic coordinates per body. Both codes get the same modes, stiffness,
mass, joints, gravity and initial state, without geometric stiffening, which Exudyn does not have; in space. Nothing is damped
unless --damping gives all modes a ratio (in both), so that what the start excites has to be resolved by both.

Question: what does the motion cost when both the elastic deflection (see `benchmarks.courses`) and the tip are to be right to
1e-3? Each code is tried with its methods and settings; for each the largest step (or tolerance) that is accurate enough is
looked for by halving and then closing in to 6 %. Nothing is interpolated: what is printed was run, and was that accurate.

  ours    every method of `ffr_dyn.integrators`, constraints projected at 1e-9 (the default) or at 1e-6
  Exudyn  generalised alpha of index 3 (spectral radius 0.9 and 0.6), the trapezoidal rule of index 2 (Newmark's of index 2
          gives the same motion in the same time); Newton's iterations to 1e-3, 1e-4, 1e-6, modified (full ones are two to
          ten times dearer); frames in Euler parameters and Tait-Bryan angles; three linear solvers. The fast build, one
          thread, bodies of mass terms and interface nodes. First the fastest frame and linear solver are found, then
          every method with either frame and the tolerances are tried, with larger steps as far as they will do, until
          nothing helps. Three of either code race at the end.

Times are processor times of the compiled loop and of Exudyn's solver (less that of a run of two steps, that is without its
start), medians of runs taken in turns. The reference is computed by two of our methods and, independently, by Exudyn's best
with its step halved and extrapolated.

With --stiffening: what geometric stiffening costs per step on our side, and what it gains, see `benchmarks.race_stiffening`.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # read where exudyn is first imported

from benchmarks.courses import ACCURACY, Course, Errors, Motion, courses, drive, errors, motion, ours, reference  # noqa: E402
from benchmarks.exudyn_twin import exu, quiet  # noqa: E402
from benchmarks.race_exudyn import FIRST, TRAPEZOIDAL, USUAL, Way, fastest, run, variants  # noqa: E402
from benchmarks.race_stiffening import report as report_stiffening  # noqa: E402
from ffr_dyn.integrators import CONTROLLED, METHODS, Integrator, tolerances  # noqa: E402
from ffr_dyn.integrators.stabilisation import Projection  # noqa: E402

FINEST = 1024  # steps per output step that are still tried
CLOSE = 1.06  # ratio of steps at which the search ends
LARGER = 0.93  # ratio of fineness from one try to the next, once a step is known that will do
PASSES = 3  # through all variants, at most
FINALISTS = 3  # of each code, raced in turns at the end
PROJECTIONS = (Projection(), Projection(1e-6))
TRIED = (
    "ros3",
    *(name for name in METHODS if name != "ros3"),
    *(name for name, method in CONTROLLED.items() if method.implicit),
)


@dataclass(frozen=True)
class Entry:
    """The entry of a code in the race: words, how fine, the errors found, and the timed run."""

    words: str
    fineness: int
    found: Errors
    again: Callable[[], tuple[float, int]]  # processor time [s] and number of steps (controlled: evaluations)


def coarsest(attempt: Callable[[int], Errors | None], first: int, below: int = 0) -> tuple[int, Errors] | None:
    """The smallest fineness that is accurate, to within `CLOSE`; None where none is.

    attempt : gives None for failed runs;  first : fineness to begin with;  below : a fineness that will not do, 0 for none
    """

    def good(k: int) -> Errors | None:
        found = attempt(k)
        return found if found is not None and found.worst <= ACCURACY else None

    k, best = first, good(first)
    while best is None and 2 * k <= FINEST:
        below, k = k, 2 * k
        best = good(k)
    if best is None:
        return None
    while below == 0 and k > 1:
        found = good(k // 2)
        if found is None:
            below = k // 2
        else:
            k, best = k // 2, found
    while k > CLOSE * below and k - below > 1:
        middle = (k + below) // 2
        found = good(middle)
        k, best, below = (middle, found, below) if found is not None else (k, best, middle)
    return k, best


# ---- ours ---------------------------------------------------------------------------------------------------------


def method_of(course: Course, name: str, fineness: int) -> tuple[Integrator, str]:
    """With so many steps per output step, or the tolerance that corresponds, and its words."""
    if name in CONTROLLED:
        relative = 1e-2 / fineness**2
        return CONTROLLED[name](tolerances(relative)), f"{name}, tolerance {relative:.2g}"
    step = course.output_step / fineness
    return METHODS[name](step), f"{name}, {1e6 * step:.4g} us"


def our_entry(course: Course, wanted: Motion, name: str, projection: Projection, limit: float) -> Entry | None:
    """None where the method is not accurate within `limit` seconds of processor time."""
    spent = 0.0

    def attempt(fineness: int) -> Errors | None:
        nonlocal spent
        if spent > limit:
            return None
        done = ours(course, method_of(course, name, fineness)[0], projection)
        if done is None:
            return None
        spent = done[1]
        return errors(done[0], wanted, spent)

    found = coarsest(attempt, 8)
    if found is None:
        return None
    method, words = method_of(course, name, found[0])

    def again() -> tuple[float, int]:
        timed = drive(course.start, course, method, projection)
        if timed is None:
            raise RuntimeError(f"{course.name}: {words} failed without the markers in the middle")
        return timed.cpu, timed.evaluations if name in CONTROLLED else found[0] * course.rows

    return Entry(f"{words}, projection {projection.tolerance:g}", *found, again)


def our_entries(course: Course, wanted: Motion, log: Callable[[str], None]) -> list[Entry]:
    """Of all methods; given up are those that cost more than three times the best before them."""
    entries: list[Entry] = []
    for way in product(TRIED, PROJECTIONS):
        limit = 3 * min((entry.found.cpu for entry in entries), default=float("inf"))
        entry = our_entry(course, wanted, *way, limit)
        if entry is not None:
            entries.append(entry)
            log(f"{entry.words}: {shown(entry.found)}")
    return entries


# ---- Exudyn -------------------------------------------------------------------------------------------------------


def exudyn_errors(course: Course, way: Way, steps: int, wanted: Motion) -> Errors | None:
    found = run(course, way, steps, looked_at=True)
    return found and errors(motion(course, found[1]), wanted, found[0])


@dataclass
class Search:
    """Exudyn's runs so far: errors by way and fineness; None where a run failed."""

    course: Course
    wanted: Motion
    log: Callable[[str], None]
    tried: dict[tuple[Way, int], Errors | None]

    def attempt(self, way: Way, fineness: int) -> Errors | None:
        """The errors of a run, which is made once."""
        if (way, fineness) not in self.tried:
            steps = fineness * self.course.rows
            found = exudyn_errors(self.course, way, steps, self.wanted)
            self.tried[way, fineness] = found
            self.log(f"{way.words}, {1e6 * self.course.output_step / fineness:.4g} us: {shown(found)}")
        return self.tried[way, fineness]

    def accurate(self, way: Way, fineness: int) -> bool:
        found = self.attempt(way, fineness)
        return found is not None and found.worst <= ACCURACY

    def front(self) -> list[tuple[Way, int, Errors]]:
        """Accurate runs, the cheapest first."""
        good = [(*key, found) for key, found in self.tried.items() if found is not None and found.worst <= ACCURACY]
        return sorted(good, key=lambda run: run[2].cpu)


def explore(search: Search, way: Way) -> None:
    """Try settings and steps. Raises RuntimeError where nothing is accurate."""
    if coarsest(lambda k: search.attempt(way, k), 8) is None:
        raise RuntimeError(f"{search.course.name}: Exudyn is not accurate at {FINEST} steps per output step")
    for _ in range(PASSES):
        before, k, _ = search.front()[0]
        for other in variants(before):
            if search.accurate(other, k):
                closing = k
                while closing > 1 and search.accurate(other, smaller := min(closing - 1, round(LARGER * closing))):
                    closing = smaller
        if search.front()[0][0] == before:
            return


def exudyn_entries(course: Course, wanted: Motion, log: Callable[[str], None]) -> tuple[list[Entry], Way]:
    """The best that the search finds, and the way of the first."""
    search = Search(course, wanted, log, {})
    explore(search, fastest(course, FIRST))
    entries = [
        Entry(f"{way.words}, {1e6 * course.output_step / k:.4g} us", k, found, again_of(course, way, k))
        for way, k, found in search.front()[:FINALISTS]
    ]
    return entries, search.front()[0][0]


def again_of(course: Course, way: Way, fineness: int) -> Callable[[], tuple[float, int]]:
    def again() -> tuple[float, int]:
        found = run(course, way, fineness * course.rows, looked_at=False)
        if found is None:
            raise RuntimeError(f"{course.name}: Exudyn did not reach the end again")
        return found[0], fineness * course.rows

    return again


def report_agreement(course: Course, entry: Entry, way: Way, wanted: Motion, seconds: float) -> None:
    """How far Exudyn's motion, extrapolated to step zero (order two) from steps as small as time allows, is from ours."""
    way = replace(way, method=TRAPEZOIDAL, tolerance=1e-8)
    finer = 2 ** int(np.clip(np.log2(seconds / (6 * entry.found.cpu)), 0, 6))
    steps = finer * entry.fineness * course.rows
    coarse, fine = (run(course, way, count, looked_at=True) for count in (steps, 2 * steps))
    if coarse is None or fine is None:
        print("  Exudyn's trapezoidal rule fails at small steps")
        return
    at = {name: fine[1][name] + (fine[1][name] - coarse[1][name]) / 3 for name in fine[1]}
    apart, h = errors(motion(course, at), wanted), 0.5 * course.end / steps
    print(f"  Exudyn extrapolated to step zero from {1e6 * h:.3g} us: {apart.worst:.1e} from the reference")


def shown(found: Errors | None) -> str:
    return f"{found.deflection:.1e} {found.tip:.1e} {1e3 * found.cpu:.0f} ms" if found else "failed"


# ---- the race -----------------------------------------------------------------------------------------------------


def in_turns(entries: Sequence[Entry], seconds: float) -> list[tuple[float, float]]:
    """Medians of the processor time [ms] and of the time of a step [us], of runs in turns that take about `seconds`."""
    once = sum(entry.found.cpu for entry in entries)
    taken = [[entry.again() for entry in entries] for _ in range(int(np.clip(seconds / once, 3, 15)))]
    return [
        (1e3 * statistics.median(t for t, _ in column), 1e6 * statistics.median(t / steps for t, steps in column))
        for column in zip(*taken, strict=True)
    ]


def usual_step(course: Course, fineness: int) -> float:
    """Exudyn's time per step [us] at its standard settings, over the first steps of that size."""
    rows = max(1, min(course.rows, 100 // fineness))
    found = run(course, USUAL, rows * fineness, looked_at=False, end=rows * course.output_step)
    return 1e6 * found[0] / (rows * fineness) if found else float("nan")


def race(course: Course, seconds: float, log: Callable[[str], None]) -> None:
    """Run one course and print what came out."""
    wanted, check, who = reference(course)
    print(
        f"\n{course.name}, {course.rod.n} modes, {course.end:g} s; reference {who}: apart {check.worst:.1e}", flush=True
    )
    mine = our_entries(course, wanted, log)
    theirs, way = exudyn_entries(course, wanted, log)
    report_agreement(course, theirs[0], way, wanted, seconds)
    mine = sorted(mine, key=lambda entry: entry.found.cpu)[:FINALISTS]
    raced = list(zip(in_turns([*mine, *theirs], seconds), [*mine, *theirs], strict=True))
    best, other = (min(side, key=lambda pair: pair[0][0]) for side in (raced[: len(mine)], raced[len(mine) :]))
    ratio = other[0][0] / best[0][0]
    print_line("ours", *best)
    print_line("Exudyn", *other)
    usual, elsewhere = usual_step(course, other[1].fineness), ", best ".join(f"{value:g}" for value in course.elsewhere)
    print(f"  Exudyn's step: {other[0][1]:.0f} us, at its standard settings {usual:.0f} us", end="")
    print(f" (elsewhere: usual {elsewhere} us)")
    met = "met" if ratio >= course.goal else "not met"
    print(f"  ratio {ratio:.1f}, goal {course.goal:g}: {met}; load {os.getloadavg()[0]:.1f}", flush=True)


def print_line(name: str, taken: tuple[float, float], entry: Entry) -> None:
    found = entry.found
    print(
        f"  {name:8}{taken[0]:9.2f} ms {taken[1]:9.2f} us per step;  error of deflection {found.deflection:.1e}, "
        f"of tip {found.tip:.1e};  {entry.words}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repeats, larger steps in the check by Exudyn")
    parser.add_argument("--scene", default="", help="scenes whose name contains this")
    parser.add_argument("--damping", type=float, default=0.0, help="modal damping ratio in both codes")
    parser.add_argument("--stiffening", action="store_true", help="only what geometric stiffening costs and gains")
    parser.add_argument("--search", action="store_true", help="print every run of the search")
    given = parser.parse_args()
    print(f"Exudyn {exu.config.Version()}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    if given.stiffening:
        return report_stiffening(5 if given.quick else 25)

    def log(text: str) -> None:
        if given.search:
            print(f"    {text}", flush=True)

    with quiet():
        for course in courses(given.scene, given.damping):
            race(course, 2.0 if given.quick else 8.0, log)


if __name__ == "__main__":
    main()
