"""What the length of the steps costs every output of a run: compared with runs of other steps, and with a twin.

Two runs that damp a vibration which neither resolves agree on the wrong curve, so that their difference tells nothing. Hence
the twin (`ffr_dyn.integrators.ros2.Twin`), which keeps its amplitude: with R of the run, at steps h and r h, order p,

    s = max |R(h) - R(r h)| / (r^p - 1),    v = max |R(h) - T(h)|,    error = max(s, v),

over all rows and components of an output. For ROS3, whose twin is of lower order, v is the smaller of the differences from
T(h/2) and from its extrapolation (4 T(h/2) - T(h)) / 3: the one is right for what is not resolved, the other for what is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.results.result import Quantity
from ffr_prep.common.arrays import Array

VIBRATION = 4.5  # v over s beyond which a difference is vibration that the step does not resolve
NEXT_TO_NOTHING = 1e-6  # of the largest range of a unit: what moves by less counts as if it moved by this
COARSE = 0.01  # of the range, by which a row may be off the curve through its neighbours


@dataclass(frozen=True)
class StepError:
    """Of an output, in its unit and as a part of its range; `vibrates` where most of it is vibration."""

    error: float
    of_range: float
    vibrates: bool


Histories = Mapping[str, Quantity]


def step_errors(
    run: Histories, other: Histories, ratio: float, order: int, twins: Sequence[Histories] = ()
) -> dict[str, StepError]:
    """The error of every output of a run with the step h.

    other : the same with the step `ratio` h;  order : of the method
    twins : of the step h, and of h/2 for a method of higher order; () where vibration is not damped
    """
    scales, found = ranges(run), {}
    for name, scale in scales.items():
        y = run[name].values
        step = largest_difference(y, other[name].values) * abs(1.0 / (ratio**order - 1.0))
        vibration = _beside_twins(y, [twin[name].values for twin in twins])
        error = max(step, vibration)
        found[name] = StepError(error, error / scale if scale > 0 else 0.0, vibration > VIBRATION * step)
    return found


def _beside_twins(y: Array, twins: Sequence[Array]) -> float:
    if len(twins) < 2:
        return largest_difference(y, twins[0]) if twins else 0.0
    rows = min(len(twin) for twin in twins)
    extrapolated = (4.0 * twins[1][:rows] - twins[0][:rows]) / 3.0
    return min(largest_difference(y, twins[1]), largest_difference(y, extrapolated))


def largest_difference(one: Array, other: Array) -> float:
    """Over the rows that both have; infinite where one is not finite."""
    rows = min(len(one), len(other))
    with np.errstate(all="ignore"):
        found = float(np.abs(one[:rows] - other[:rows]).max(initial=0.0))
    return found if np.isfinite(found) else np.inf


def ranges(run: Histories) -> dict[str, float]:
    """Of every output but the violations of constraints: the largest range of a component, or a millionth of the largest of
    its unit, if that is more."""
    spans = {name: _range(q.values) for name, q in run.items() if not name.startswith("constraint.")}
    largest: dict[str, float] = {}
    for name, span in spans.items():
        largest[run[name].unit] = max(span, largest.get(run[name].unit, 0.0))
    return {name: max(span, NEXT_TO_NOTHING * largest[run[name].unit]) for name, span in spans.items()}


def _range(values: Array) -> float:
    return float(np.ptp(values, axis=0).max(initial=0.0)) if len(values) else 0.0


def too_coarse(run: Histories) -> dict[str, float]:
    """Outputs whose rows are too far apart to show what they do, and by how much of their range a row lies off the curve
    through the two before and the two after it."""
    found = {}
    for name, scale in ranges(run).items():
        y = run[name].values
        if scale > 0 and len(y) > 4:
            off = y[2:-2] - (-y[:-4] + 4.0 * y[1:-3] + 4.0 * y[3:-1] - y[4:]) / 6.0
            share = float(np.abs(off).max()) / scale
            if share > COARSE:
                found[name] = share
    return found
