"""The constants of `ffr_dyn.economy.cost`, fitted to processor times of the time loop.

    python -m benchmarks.cost_model

Mechanisms of two to six bodies with none to fourteen modes each, in the plane and in space, with and without geometric
stiffening and I5 and I9: each is run with 2 and with 12 steps to a row, the least time of some repetitions counts. The
difference gives an evaluation, what is left over gives an output row. The constants have the least sum of squares of
relative errors, and none of them is negative (Lawson and Hanson, Solving Least Squares Problems (1974), ch. 23).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ffr_gallery.scene_set import chain, four_bar, slider_crank
from scipy.optimize import nnls

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.economy.model_choice import Choice, full, held_in_plane
from ffr_dyn.economy.run import Span, make
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.scene.scene import Scene
from ffr_dyn.variants.plane import planar_forms
from ffr_dyn.variants.variant import STIFFENING
from ffr_prep.common.errors import ComputationError

Array = np.ndarray

SCENES = (
    (slider_crank(50.0), Span(0.0, 0.126, 0.0021)),
    (four_bar(60.0), Span(0.0, 0.105, 0.0015)),
    (chain(2), Span(0.0, 0.3, 0.005)),
    (chain(6), Span(0.0, 0.3, 0.005)),
)
COUNTS = (0, 1, 2, 4, 7, 14)
DROPPED = ((), (STIFFENING,), (STIFFENING, "I5", "I9"))
FEW, MANY = 2, 12  # steps to a row
REPEATS = 7


@dataclass(frozen=True)
class Timing:
    """Processor time [us] of an evaluation and of an output row of a model, and evaluations of a step."""

    choice: Choice
    evaluation: float
    row: float
    per_step: float


def models(scene: Scene) -> Iterator[Choice]:
    """In space, and in the plane where there is one; by method, modes and terms."""
    space = full(scene, "ros3", 1)
    flat = (held_in_plane(space, form) for form in planar_forms(scene))
    for base in (space, *(choice for choice in flat if choice is not None)):
        for count in COUNTS:
            for dropped in DROPPED if count else ((),):
                parts = tuple(
                    replace(p, modes=p.modes[:count], dropped=dropped if p.modes[:count] else ()) for p in base.parts
                )
                if any(part.count == count for part in parts):
                    yield replace(base, parts=parts)


def timed(scene: Scene, choice: Choice, span: Span) -> Timing:
    """The time loop of a model. Raises ComputationError where its run fails."""
    made = make(scene, choice, span)
    times, evaluations = np.zeros(2), np.zeros(2)
    for k, divisions in enumerate((FEW, MANY)):
        found = []
        for _ in range(REPEATS):
            watch = Stopwatch()
            result = integrate(
                made.scene,
                end=span.end,
                output_step=span.output_step,
                method=replace(choice, divisions=divisions).integrator(span.output_step),
                outputs=("constraint.position",),
                stopwatch=watch,
                assembled=made.assembled,
            )
            found.append(1e6 * watch.cpu)
        times[k], evaluations[k] = min(found), result.attributes["evaluations"]
    each = float(np.diff(times)[0] / np.diff(evaluations)[0])
    per_step = float(np.diff(evaluations)[0] / (MANY - FEW) / span.rows)
    return Timing(choice, each, float(times[0] / span.rows - FEW * per_step * each), per_step)


def features(choice: Choice) -> list[float]:
    """The counts that make up an evaluation, in the order of the constants: in space, then in the plane, after the first."""
    found = np.zeros(7)
    for part in choice.parts:
        n = part.count
        found[0] += 1
        if n:
            found[1:4] += 1, n, 0 if {"I5", "I9"} <= set(part.dropped) else n * n
            found[4:] += (1, n, n * n) if part.stiffened else (0, 0, 0)
    nothing = np.zeros(7)
    return [1.0, *(found if choice.plane == "none" else nothing), *(nothing if choice.plane == "none" else found)]


def main() -> None:
    timings = []
    for scene, span in SCENES:
        for choice in models(scene):
            try:
                timings.append(timed(scene, choice, span))
            except ComputationError:  # bodies in which a term that is missing counts
                continue
    A = np.array([features(timing.choice) for timing in timings])
    times = np.array([timing.evaluation for timing in timings])
    constants, _ = nnls(A / times[:, None], np.ones(len(times)))
    off = A @ constants / times - 1
    print(f"{len(timings)} models")
    print(f"BASE  = {constants[0]:.2f}")
    print("SPACE =", tuple(round(float(c), 3) for c in constants[1:8]))
    print("PLANE =", tuple(round(float(c), 3) for c in constants[8:]))
    print(f"ROW   = {np.median([t.row / t.evaluation for t in timings]):.2f} evaluations, in the median")
    print(f"PROJECTION = {np.median([t.per_step for t in timings]) - 4:.2f} evaluations of a step, in the median")
    print(f"relative errors of an evaluation: {np.sqrt(np.mean(off**2)):.3f} rms, {np.abs(off).max():.2f} at most")


if __name__ == "__main__":
    main()
