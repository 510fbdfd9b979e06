"""Whether measures mean the same in all models of a diagram, and whether its lines can be told apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ffr_dyn.chart.measures import Deflection, Measure, Quantity, Shape, Stress
from ffr_dyn.chart.variants import Model
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.common.errors import InputError
from ffr_prep.common.in_words import settings_in_words

COORDINATES = ("q", "q_dot", "q_ddot")
SEEN = ("R", "p", "v", "omega_bar", "a", "alpha_bar", "displacement")  # of the body's frame, or from it


def check_meaning(scene: Scene, measures: Sequence[Measure], models: Sequence[Model]) -> None:
    """Raises InputError for models of one label, for measures of elastic coordinates where models have others, for those that
    are seen from the frame of a body where models have another one, and for those of a body that is in parts in a model."""
    labels = [model.label for model in models]
    for model in models:
        if labels.count(model.label) > 1:
            raise InputError(
                f"there are {labels.count(model.label)} models with the label {model.label!r}, whose points would make one "
                'line; give each a label of its own, as in fd.Model("4 modes", modes=4)'
            )
        bodies = {body.name: body.model for body in model.of(scene).bodies}
        for measure in measures:
            _check(measure, scene, bodies, model.label)


def _check(measure: Measure, scene: Scene, bodies: Mapping[str, FlexibleBody], label: str) -> None:
    owner, what = _read(measure)
    own = next((body.model for body in scene.bodies if body.name == owner), None)
    if own is None or not what:
        return
    other = bodies.get(owner)
    if other is None:
        raise InputError(
            f"measure {measure.name!r} is one of body {owner!r} in its frame, and in {label!r} the body is in parts, each "
            "with a frame of its own; measure positions, angles or reactions"
        )
    if what in COORDINATES and not np.array_equal(other.omega2, own.omega2):
        raise InputError(
            f"measure {measure.name!r}: elastic coordinates are those of a model, and {label!r} has others; measure what "
            f"they do, as by deflection:{owner}"
        )
    if what in SEEN and other.n and _frame(other) != _frame(own):
        raise InputError(
            f"measure {measure.name!r} is seen from the frame of body {owner!r}, and {label!r} has another frame; measure "
            "positions or the deflection from a chord, or bring the files into one frame (ffr-prep convert --reference)"
        )


def _read(measure: Measure) -> tuple[str, str]:
    """The body whose frame or modes a measure depends on, and what of it; empty words where on none."""
    if isinstance(measure, Shape):
        return measure.body, "displacement"
    if isinstance(measure, Deflection):
        return measure.marker.partition(".")[0], "chord" if measure.chord else "displacement"
    if isinstance(measure, Stress):
        return measure.body, "stress"
    owner, _, what = measure.of.rpartition(".") if isinstance(measure, Quantity) else ("", "", "")
    return owner.partition(".")[0], what if what in (*COORDINATES, *SEEN) else ""


def _frame(model: FlexibleBody) -> str:
    """What is known of the reference conditions of a flexible body."""
    return settings_in_words(model.provenance.get("reference", ""))
