"""The courses of the race: a scene, its time, the measure of its motion with the error allowed; the reference.

The *elastic deflection* of a link is the offset of its middle from the chord between its ends, a vector. Its error is the
largest over all links and output times, relative to the largest deflection of any link; the error of the tip is the largest
over all output times, relative to the extent of its motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from benchmarks.scenes import chain, connecting_rod, pendulum, pendulum_rod, slider_crank, with_middle
from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import RK4, ROS3, Integrator
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation, gains
from ffr_dyn.kernels.tables import OK
from ffr_dyn.scene.scene import Scene, marker_number
from ffr_prep.body import FlexibleBody

Array = np.ndarray

ACCURACY = 1e-3
FIXED_INTERFACE_MODES = {8: 2, 32: 26}  # with six static shapes
LINKS = 32
STANDARD = Projection()
LOOKS = 10  # between output times, of methods that choose their steps


@dataclass(frozen=True)
class Course:
    """A scene of one kind of flexible body.

    make        : the scene of a rod;  links : names of the flexible bodies;  tip : marker
    end, output_step [s];  fine : steps of the reference per output step
    goal        : how many times cheaper than Exudyn
    elsewhere   : cost of a step of Exudyn [us], usual and best, measured by others with these modes
    """

    name: str
    rod: FlexibleBody
    make: Callable[[FlexibleBody], Scene]
    links: tuple[str, ...]
    tip: str
    end: float
    output_step: float
    fine: int
    goal: float
    elsewhere: tuple[float, ...]
    damping: float = 0.0

    @cached_property
    def bare(self) -> Scene:
        """The scene that is timed: in space, as it is for Exudyn, and without geometric stiffening."""
        return self._scene(self.rod)

    @cached_property
    def looked_at(self) -> Scene:
        """The same with a marker in the middle of every link."""
        return self._scene(with_middle(self.rod))

    @cached_property
    def start(self) -> Assembled:
        """Where the timed runs begin."""
        return assemble(self.bare)

    @cached_property
    def start_looked_at(self) -> Assembled:
        """Where the others begin."""
        return assemble(self.looked_at)

    def _scene(self, rod: FlexibleBody) -> Scene:
        scene = self.make(rod)
        bodies = [replace(b, damping=self.damping, stiffening=False) if b.model.n else b for b in scene.bodies]
        return replace(scene, bodies=tuple(bodies), plane="none")

    @property
    def rows(self) -> int:
        return round(self.end / self.output_step)

    @property
    def markers(self) -> tuple[str, ...]:
        """The tip, and of every link both ends and the middle."""
        ends = (*(interface.name for interface in self.rod.interfaces), "middle")
        return (self.tip, *(f"{link}.{end}" for link in self.links for end in ends))


@dataclass(frozen=True)
class Motion:
    """tip (T, 3) and deflections (links, T, 3) [m] at the output times, the start left out."""

    tip: Array
    deflection: Array


@dataclass(frozen=True)
class Errors:
    """Relative; and `cpu`, the processor time [s] of the run that made them."""

    tip: float
    deflection: float
    cpu: float = 0.0

    @property
    def worst(self) -> float:
        return max(self.tip, self.deflection)


def motion(course: Course, at: dict[str, Array]) -> Motion:
    """From positions (T, 3) of the course's markers."""
    first, last, _ = (f".{name.partition('.')[2]}" for name in course.markers[1:4])
    start, end = (interface.position for interface in course.rod.interfaces)
    middle, chord = (start + end) / 2, end - start
    share = float((middle - start) @ chord / (chord @ chord))
    found = [at[f"{b}.middle"] - (1 - share) * at[b + first] - share * at[b + last] for b in course.links]
    return Motion(at[course.tip], np.array(found))


def errors(found: Motion, reference: Motion, cpu: float = 0.0) -> Errors:
    """How far a motion is from the reference."""
    extent = np.linalg.norm(reference.tip - reference.tip.mean(axis=0), axis=1).max()
    largest = np.linalg.norm(reference.deflection, axis=2).max()
    tip = np.linalg.norm(found.tip - reference.tip, axis=1).max() / extent
    return Errors(tip, np.linalg.norm(found.deflection - reference.deflection, axis=2).max() / largest, cpu)


# ---- ours ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """Positions of all markers (rows, markers, 3), processor time of the compiled loop [s], evaluations."""

    positions: Array
    cpu: float
    evaluations: int


def drive(start: Assembled, course: Course, method: Integrator, stabilisation: Stabilisation) -> Run | None:
    """The compiled loop over a course, None where the method fails."""
    substeps = LOOKS if method.controlled else round(course.output_step / method.step)
    spacing = course.output_step / substeps
    engine = new_engine(start.system, start.x, start.v, method, gains(stabilisation), spacing=spacing)
    record, watch = new_record(start.system, course.rows), Stopwatch()
    with watch:
        status = fill_rows(engine, record, 0.0, substeps)
    return Run(record.r, watch.cpu, int(engine.work.info[1])) if status == OK else None


def ours(course: Course, method: Integrator, stabilisation: Stabilisation = STANDARD) -> tuple[Motion, float] | None:
    """The motion and the processor time of the compiled loop [s]; None where the method fails."""
    found = drive(course.start_looked_at, course, method, stabilisation)
    if found is None:
        return None
    numbers = {name: marker_number(course.looked_at, name) for name in course.markers}
    return motion(course, {name: found.positions[:, k] for name, k in numbers.items()}), found.cpu


def reference(course: Course) -> tuple[Motion, Errors, str]:
    """A converged motion, how far another run is from it that shares nothing but the equations, and who they were.

    RK4 checked by ROS3 with the same step; where RK4 is not stable, ROS3 checked by itself with twice the step.
    """
    h = course.output_step / course.fine
    check, other = ours(course, ROS3(h)), ours(course, RK4(h))
    names = f"RK4 and ROS3, step {h:.2g} s"
    if other is None:
        other, names = ours(course, ROS3(h / 2)), f"ROS3, steps {h / 2:.2g} and {h:.2g} s"
    if check is None or other is None:
        raise RuntimeError(f"{course.name}: no reference with a step of {h:.2g} s")
    return other[0], errors(check[0], other[0]), names


# ---- the courses --------------------------------------------------------------------------------------------------


def courses(name: str, damping: float) -> list[Course]:
    """Those whose name contains `name`, with 8 and 32 elastic coordinates."""
    makers = {"slider-crank": _slider_crank, "chain": _chain, "pendulum": _pendulum}
    found = [make(n) for key, make in makers.items() if name in key for n in FIXED_INTERFACE_MODES]
    return [replace(course, damping=damping) for course in found]


def _slider_crank(n: int) -> Course:
    rod = connecting_rod("rigid", FIXED_INTERFACE_MODES[n]).body
    end, goal, elsewhere = 0.084, {8: 15, 32: 50}[n], {8: (213, 152), 32: (1177, 808)}[n]
    return Course("slider-crank", rod, slider_crank, ("rod",), "slider.pin", end, 1e-3, 256, goal, elsewhere)


def _chain(n: int) -> Course:
    rod = pendulum_rod("rigid", FIXED_INTERFACE_MODES[n]).body
    links = tuple(f"link{k}" for k in range(LINKS))
    end, goal, elsewhere = 0.3, {8: 15, 32: 50}[n], {8: (151 * LINKS,), 32: (713 * LINKS,)}[n]
    return Course("chain of 32", rod, chained, links, f"{links[-1]}.tip", end, 0.02, 128, goal, elsewhere)


def chained(rod: FlexibleBody) -> Scene:
    return chain(rod, LINKS, "revolute")


def _pendulum(n: int) -> Course:
    rod = pendulum_rod("rigid", FIXED_INTERFACE_MODES[n]).body
    goal, elsewhere = {8: 6, 32: 20}[n], {8: (79, 19), 32: (563, 186)}[n]
    return Course("pendulum", rod, pendulum, ("rod",), "rod.tip", 0.5, 0.01, 128, goal, elsewhere)
