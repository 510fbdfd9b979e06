"""What is raced over: a scene, its time, what is measured of its motion and how wrong that may be; the reference.

The *elastic deflection* of a link is the offset of its middle from the chord between its ends, a vector. Its error is the
largest over all links and output times, relative to the largest deflection of any link; the error of the tip is the largest
over all output times, relative to the extent of its motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.scenes import chain, connecting_rod, pendulum, pendulum_rod, slider_crank, with_middle
from ffr_dyn.analyses.forward import forward
from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.integrators import RK4, ROS3, Integrator
from ffr_dyn.scene import Scene
from ffr_dyn.stabilisation import Projection, Stabilisation
from ffr_dyn.stopwatch import Stopwatch
from ffr_prep.body import FlexibleBody

Array = np.ndarray

ACCURACY = 1e-3
FIXED_INTERFACE_MODES = {8: 2, 32: 26}  # with six static shapes
LINKS = 32


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

    @property
    def bare(self) -> Scene:
        """The scene that is timed: in space, as it is for Exudyn, and without geometric stiffening."""
        return self._scene(self.rod)

    @property
    def looked_at(self) -> Scene:
        """The same with a marker in the middle of every link."""
        return self._scene(with_middle(self.rod))

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
    """tip (T, 3) and deflections (links, T, 3) [m]."""

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


def ours(course: Course, method: Integrator, stabilisation: Stabilisation = Projection()) -> tuple[Motion, float, int]:  # noqa: B008
    """The motion, the processor time of the compiled loop [s], and how many evaluations it took."""
    watch = Stopwatch()
    outputs = [f"{marker}.position" for marker in course.markers]
    found = forward(
        course.looked_at, end=course.end, output_step=course.output_step, method=method,
        stabilisation=stabilisation, outputs=outputs, stopwatch=watch,
    )  # fmt: skip
    at = {marker: found[f"{marker}.position"] for marker in course.markers}
    return motion(course, at), watch.cpu, int(found.attributes["evaluations"])


def reference(course: Course) -> tuple[Motion, Errors, str]:
    """A converged motion, how far another run is from it that shares nothing but the equations, and who they were.

    RK4 checked by ROS3 with the same step; where RK4 is not stable, ROS3 checked by itself with twice the step.
    """
    h = course.output_step / course.fine
    check = ours(course, ROS3(h))[0]
    try:
        best, names = ours(course, RK4(h))[0], f"RK4 and ROS3, step {h:.2g} s"
    except (InputError, SimulationError):
        best, names = ours(course, ROS3(h / 2))[0], f"ROS3, steps {h / 2:.2g} and {h:.2g} s"
    return best, errors(check, best), names


# ---- the courses --------------------------------------------------------------------------------------------------


def courses(name: str, damping: float, quick: bool) -> list[Course]:
    """Those whose name contains `name`, with 8 and 32 elastic coordinates; quick: half the time or less."""
    makers = {"slider-crank": _slider_crank, "chain": _chain, "pendulum": _pendulum}
    found = [make(n, quick) for key, make in makers.items() if name in key for n in FIXED_INTERFACE_MODES]
    return [replace(course, damping=damping) for course in found]


def _slider_crank(n: int, quick: bool) -> Course:
    rod = connecting_rod("rigid", FIXED_INTERFACE_MODES[n]).body
    end, goal, elsewhere = 0.021 if quick else 0.084, {8: 15, 32: 50}[n], {8: (213, 152), 32: (1177, 808)}[n]
    return Course("slider-crank", rod, slider_crank, ("rod",), "slider.pin", end, 1e-3, 256, goal, elsewhere)


def _chain(n: int, quick: bool) -> Course:
    rod = pendulum_rod("rigid", FIXED_INTERFACE_MODES[n]).body
    links = tuple(f"link{k}" for k in range(LINKS))
    end, goal, elsewhere = 0.1 if quick else 0.2, {8: 15, 32: 50}[n], {8: (151 * LINKS,), 32: (713 * LINKS,)}[n]
    return Course("chain of 32", rod, chained, links, f"{links[-1]}.tip", end, 0.02, 128, goal, elsewhere)


def chained(rod: FlexibleBody) -> Scene:
    return chain(rod, LINKS, "revolute")


def _pendulum(n: int, quick: bool) -> Course:
    rod = pendulum_rod("rigid", FIXED_INTERFACE_MODES[n]).body
    goal, elsewhere = {8: 6, 32: 20}[n], {8: (79, 19), 32: (563, 186)}[n]
    return Course("pendulum", rod, pendulum, ("rod",), "rod.tip", 0.25 if quick else 0.5, 0.01, 128, goal, elsewhere)
