"""Whether runs know their error, on the benchmark set and variants of it.

    python -m benchmarks.accuracy [--method ros2] [--variants plain,undamped,...] [case ...]

For every scene, with the step that is found for an accuracy of 1e-3 and with steps given around it:

    pairs    the error that a run tells of every default output over the true one, where the true one is 1e-6 to 0.5 of the
             range: share within 0.3 to 5, share below 0.1, least and largest
    places   the true error of positions and angles, in thousandths of their ranges, with the step that was found
    forces   the same of forces, moments and deflections that are not told to ring
    silent   true error over three times the told one, the worst of all outputs
    cost     processor time of the time loop of all runs, in final runs: of a default run, search and check included, and what
             the check of a given step adds

The truth is RK4 with a step that resolves the fastest vibration (h omega <= 0.3), no longer than a sixteenth of the run's; a
scene where that takes more than LONGEST steps is left out and said so. Variants: "plain", "undamped", "shock" (bodies set
off with a deflection), "soft" and "stiff" (frequencies a third and four times as high).
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from ffr_gallery.scene_set import CASES, Case

from ffr_dyn.analyses.forward import DRIVING, PLACES, forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.step_error import largest_difference, ranges
from ffr_dyn.consistency.unresolved import vibrations
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import RK4, Within, method_named
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError

LONGEST = 1_500_000  # steps of a reference
RESOLVED, FINER = 0.3, 16
STEPS = (4, 16)  # to a row, given
ACCURACY = 1e-3
LEAST, MOST = 1e-6, 0.5  # true errors over range that are looked at
LOW, HIGH, FALSE = 0.3, 5.0, 0.1


def undamped(body: Body) -> Body:
    return replace(body, damping=0.0)


def set_off(body: Body) -> Body:
    """With rates of its elastic coordinates that a deflection of a thousandth of its size in its first mode would have."""
    if not body.model.n or body.part_of:
        return body
    rate = np.zeros(body.model.n)
    rate[0] = 1e-3 * body.model.size * np.sqrt(body.model.mass * body.model.omega2[0])
    return replace(body, q_dot=tuple(rate))


def with_frequencies(factor: float) -> Callable[[Body], Body]:
    return lambda body: replace(body, model=replace(body.model, omega2=factor**2 * body.model.omega2))


VARIANTS: dict[str, Callable[[Body], Body]] = {
    "plain": lambda body: body,
    "undamped": undamped,
    "shock": set_off,
    "soft": with_frequencies(1 / 3),
    "stiff": with_frequencies(4.0),
}


@dataclass(frozen=True)
class Found:
    """Of a scene: pairs of told over true errors, true errors of what is to be kept, costs."""

    pairs: list[float]
    places: float
    forces: float
    silent: float
    cost: float
    extra: float


def examined(scene: Scene, case: Case, method: str) -> Found:
    """Raises InputError where the reference is too long."""
    span = {"end": case.end, "output_step": case.output_step}
    watch, alone, checked = Stopwatch(), Stopwatch(), Stopwatch()
    found = forward(scene, **span, method=Within(ACCURACY, method), stopwatch=watch)
    step = found.attributes["step"]
    made = method_named(method)(step)
    integrate(scene, **span, method=made, stabilisation=Projection(1e-8 * ACCURACY), stopwatch=alone)
    forward(scene, **span, method=made, stabilisation=Projection(1e-8 * ACCURACY), check=True, stopwatch=checked)
    true = reference(scene, span, step)
    pairs, silent = compared(found, true)
    for count in STEPS:
        more, worst = compared(given(scene, span, method, count), true)
        pairs, silent = [*pairs, *more], max(silent, worst)
    places, forces = kept(found, true)
    return Found(pairs, places, forces, silent, watch.cpu / alone.cpu, checked.cpu / alone.cpu - 1.0)


def given(scene: Scene, span: dict[str, float], method: str, count: int) -> Result | None:
    try:
        return forward(scene, **span, method=method_named(method)(span["output_step"] / count), check=True)
    except ComputationError:
        return None


def reference(scene: Scene, span: dict[str, float], step: float) -> Result:
    fastest = vibrations(assemble(scene), 0.0).omega.max(initial=0.0)
    finest = min(step / FINER, RESOLVED / fastest) if fastest > 0 else step / FINER
    count = int(np.ceil(span["output_step"] / finest))
    if count * span["end"] / span["output_step"] > LONGEST:
        raise InputError(f"its reference would take {count * span['end'] / span['output_step']:.1e} steps")
    return integrate(scene, **span, method=RK4(span["output_step"] / count), stabilisation=Projection(1e-12))


def compared(found: Result | None, true: Result) -> tuple[list[float], float]:
    """Told over true errors, and the worst of the true error over three times the told one."""
    if found is None:
        return [], 0.0
    pairs, silent, scales = [], 0.0, ranges(true)
    for name, (told, _) in found.attributes["errors"].items():
        off = largest_difference(found[name], true[name])
        if LEAST * scales[name] < off < MOST * scales[name]:
            pairs.append(told / off)
            silent = max(silent, off / (3.0 * told))
    return pairs, silent


def kept(found: Result, true: Result) -> tuple[float, float]:
    """True errors over range: of positions and angles, and of forces and deflections told to be within the accuracy."""
    scales, errors = ranges(true), found.attributes["errors"]
    off = {name: largest_difference(found[name], true[name]) / scales[name] for name in errors if scales[name] > 0}
    places = max((off[name] for name in off if PLACES.search(name)), default=0.0)
    told = [name for name in off if DRIVING.search(name) and errors[name][1] <= ACCURACY]
    return places, max((off[name] for name in told), default=0.0)


def scenes(names: list[str], variants: list[str]) -> Iterator[tuple[str, Case, Scene]]:
    for case in CASES:
        if not names or case.name in names:
            scene = case.scene()
            for variant in variants:
                yield f"{case.name} {variant}", case, replace(scene, bodies=tuple(map(VARIANTS[variant], scene.bodies)))


def line(name: str, found: Found) -> str:
    pairs = np.array(found.pairs)
    inside, below = np.mean((pairs >= LOW) & (pairs <= HIGH)), np.mean(pairs < FALSE)
    return (
        f"{name:26}{pairs.size:6}{100 * inside:8.1f}{100 * below:7.1f}{pairs.min():8.2f}{pairs.max():8.1f}"
        f"{1e3 * found.places:9.3f}{1e3 * found.forces:9.3f}{found.silent:8.2f}{found.cost:7.1f}{found.extra:7.1f}"
    )


def report(method: str, names: list[str], variants: list[str]) -> None:
    print(f"\n{method}: told over true errors; true errors in thousandths of ranges; costs in final runs\n"
          f"{'scene':26}{'pairs':>6}{'in %':>8}{'low %':>7}{'least':>8}{'most':>8}{'places':>9}{'forces':>9}{'silent':>8}"
          f"{'cost':>7}{'extra':>7}")  # fmt: skip
    every: list[Found] = []
    for name, case, scene in scenes(names, variants):
        try:
            found = examined(scene, case, method)
        except (ComputationError, InputError) as error:
            print(f"{name:26}left out: {str(error)[:120]}", flush=True)
            continue
        every.append(found)
        print(line(name, found), flush=True)
    summarise(every)


def summarise(every: list[Found]) -> None:
    pairs = np.array([pair for found in every for pair in found.pairs])
    inside, below = np.mean((pairs >= LOW) & (pairs <= HIGH)), np.mean(pairs < FALSE)
    reached = np.mean([found.places <= ACCURACY for found in every])
    cost, extra = (statistics.median(getattr(found, of) for found in every) for of in ("cost", "extra"))
    print(f"{pairs.size} pairs: {100 * inside:.1f} % within {LOW} to {HIGH} (goal 95), {100 * below:.2f} % below {FALSE}\n"
          f"positions and angles within {ACCURACY:g}: {100 * reached:.0f} % of {len(every)} scenes (goal 95)\n"
          f"forces not told to ring, largest error: {max(found.forces for found in every):.2g} (goal {ACCURACY:g})\n"
          f"true over three times told, worst: {max(found.silent for found in every):.2f} (goal 1)\n"
          f"cost of a default run, median: {cost:.2f} final runs (goal 3); a check adds {extra:.2f} (goal 2)")  # fmt: skip


def option(arguments: list[str], flag: str, default: str) -> str:
    if flag not in arguments:
        return default
    at = arguments.index(flag)
    value = arguments[at + 1]
    del arguments[at : at + 2]
    return value


def main() -> None:
    arguments = sys.argv[1:]
    methods = option(arguments, "--method", "ros2,ros3").split(",")
    variants = option(arguments, "--variants", ",".join(VARIANTS)).split(",")
    for method in methods:
        report(method, arguments, variants)


if __name__ == "__main__":
    main()
