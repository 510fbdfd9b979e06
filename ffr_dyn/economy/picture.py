"""All combinations that a search has tried, and the one it chose, as a work-precision diagram of the scene.

It is a `Diagram` as `ffr-dyn chart` makes them: draw it, write its page or table, or put its points beside those of another
diagram of the scene (`Diagram.with_points`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ffr_dyn.analyses.forward import Forward
from ffr_dyn.chart.diagram import Diagram, Point, spread
from ffr_dyn.chart.draw import draw_chart
from ffr_dyn.chart.reference import Reference
from ffr_dyn.chart.variants import STEP, TOLERANCE, Model, Variant
from ffr_dyn.economy.model_choice import Choice
from ffr_dyn.economy.result import Economy
from ffr_dyn.economy.run import Made, Span, make, simulated
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.pictures.histories import plain
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class OutputMeasure:
    """An output of a search as a measure of a diagram."""

    name: str
    unit: str
    own: float  # its range

    @property
    def words(self) -> str:
        """For an axis."""
        return self.name

    @property
    def outputs(self) -> tuple[str, ...]:
        """Quantities to keep."""
        return (self.name,)

    def values(self, result: Result) -> Array:
        """(T, k) history."""
        return result[self.name].reshape(result.time.size, -1)

    def scale(self, result: Result) -> float:
        """Its range over the run of the search."""
        return self.own


def diagram(found: Economy) -> Diagram:
    """The runs of a search with their processor times, which takes some repetitions of each, and their errors.

    Raises ComputationError where a run of the search cannot be repeated.

    >>> fd.draw_chart(fd.diagram(found), "search.png")
    """
    measures = tuple(
        OutputMeasure(output.name, unit, float(scale))
        for output, unit, scale in zip(found.probe.outputs, found.probe.units, found.scales, strict=True)
    )
    words = _model_words(found)
    points = [_point(found, one.choice, words[one.choice], one.error) for one in found.runs]
    chosen = tuple(p.label for p, one in zip(points, found.runs, strict=True) if one.choice == found.choice)
    limits = {m.name: float(limit) for m, limit in zip(measures, found.limits, strict=True)}
    return Diagram(found.original.name, measures, tuple(points), (), _reference(found), (), chosen, limits)


def draw(found: Economy, path: str | Path) -> Path:
    """Draw the runs of a search and the one it chose, .png or .svg, a panel for each output."""
    return draw_chart(diagram(found), path, title=plain(f"{found.original.name}: what was tried, and chosen"))


def _reference(found: Economy) -> Reference:
    """The reference from which errors are measured: the run of a verification, whose own error is the floor."""
    names = [output.name for output in found.probe.outputs]
    verified = found.verification
    scales = {name: float(scale) for name, scale in zip(names, found.scales, strict=True)}
    own = np.zeros(len(names)) if verified is None else verified.own
    variant = Variant(found.choice.method, 1.0) if verified is None else _variant(found, verified.choice, "full model")
    story = ("estimated errors: there was no verification",) if verified is None else ("verification of the search",)
    nothing = {name: np.zeros((0, 1)) for name in names}
    return Reference(nothing, scales, dict(zip(names, map(float, own), strict=True)), variant, variant, story)


def _model_words(found: Economy) -> dict[Choice, str]:
    """A name for every model that was run: the coordinates of each body, and a number where that says too little."""
    models = list(dict.fromkeys((one.choice.parts, one.choice.plane) for one in found.runs))
    plain = [" ".join(str(part.count) for part in parts) for parts, _ in models]
    count, seen, names = Counter(plain), Counter[str](), {}
    for model, words in zip(models, plain, strict=True):
        seen[words] += 1
        names[model] = f"{words} coordinates" + (f" ({seen[words]})" if count[words] > 1 else "")
    return {one.choice: names[one.choice.parts, one.choice.plane] for one in found.runs}


def _variant(found: Economy, choice: Choice, words: str) -> Variant:
    step = found.settings.output_step / choice.divisions
    return Variant(choice.method, choice.accuracy if choice.controlled else step, Model(words))


def _point(found: Economy, choice: Choice, words: str, error: Array) -> Point:
    settings, variant = found.settings, _variant(found, choice, words)
    begin = settings.analysis.begin if isinstance(settings.analysis, Forward) else "as-given"
    span = Span(settings.start, settings.end, settings.output_step, settings.stabilisation, begin)
    wall, cpu, evaluations = _timed(make(found.original, choice, span), choice, span, found.policy.timing_repeats)
    errors = {output.name: float(e) for output, e in zip(found.probe.outputs, error, strict=True)}
    kind = TOLERANCE if choice.controlled else STEP
    label = variant.label
    return Point(choice.method, words, label, kind, variant.number, errors, spread(wall), spread(cpu), evaluations)


def _timed(made: Made, choice: Choice, span: Span, repeats: int) -> tuple[list[float], list[float], int]:
    """Wall and processor times [s] of the time loop of some repetitions, and evaluations."""
    wall, cpu, evaluations = [], [], 0
    for _ in range(repeats):
        watch = Stopwatch()
        result = simulated(made, choice, span, ("constraint.position",), watch)
        wall.append(watch.wall)
        cpu.append(watch.cpu)
        evaluations = int(result.attributes["evaluations"])
    return wall, cpu, evaluations
