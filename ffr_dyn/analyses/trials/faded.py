"""Outputs of which nothing is left as steps become shorter, such as the torque of a motor that turns a rotor evenly.

What they show is the error of the steps, and no step is short enough for a share of a range that goes to zero with it. They
are held against the scene instead, a thousandth of what its mass, length and speed make of their unit, as outputs that hardly
move are against others of their kind. A force of inertia m l / t^2 deflects a body by l / (t omega)^2, with omega its lowest
vibration, and so do deflections count: those of a stiff part stay as small as they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from ffr_dyn.analyses.trials.runs import Runs
from ffr_dyn.consistency.step_error import (
    KEEPS,
    LITTLE,
    LOADS,
    PLACES,
    SEEN,
    Beside,
    StepError,
    natural_units,
    on_shared_rows,
    range_of,
)
from ffr_dyn.results.result import Result

STIFFLY = re.compile(rf"{LOADS.pattern}|\.(v|omega_bar)$")  # outputs that inertia makes without deflection
NOTHING = 0.5  # of its range, from which an output is off so far that it may be nothing
NEGLIGIBLE = 1e-6  # of what the scene makes of its unit, up to where an output may be, however far it is off


def without_faded(errors: Mapping[str, StepError], run: Result, other: Beside, runs: Runs) -> dict[str, StepError]:
    """The errors of a run, those of outputs that go to zero with the step as shares of the scene's own size; positions and
    angles, whose range is that of the motion, stay as they are."""
    off = [name for name, error in errors.items() if error.of_range > SEEN and not PLACES.search(name)]
    if not off or other.ratio == 1.0:
        return dict(errors)
    here, there = on_shared_rows([run, other.result])
    growth = KEEPS * max(other.ratio, 1.0 / other.ratio)
    spans = {name: range_of(here[name]) for name in off}
    falling = [name for name in off if _falls(spans[name], range_of(there[name]), other.ratio, growth)]
    sizes = _sizes(run, falling, runs) if falling else {}
    return dict(errors) | {name: _held_against(errors[name], spans[name], size) for name, size in sizes.items()}


def _held_against(error: StepError, span: float, size: float) -> StepError:
    """The error of an output with this range as a share of a scene's size, where it is nothing beside that."""
    floor = LITTLE * size
    nothing = error.error >= NOTHING * span or span <= NEGLIGIBLE * size
    if not nothing or error.error >= error.of_range * floor:
        return error
    return replace(error, of_range=error.error / floor, vibrates=False, faded=True)


def _falls(here: float, there: float, ratio: float, growth: float) -> bool:
    """Whether an output with these ranges in two runs is nothing without the error of steps of order one or more."""
    longer, shorter = (there, here) if ratio > 1.0 else (here, there)
    return longer >= growth * shorter > 0.0


def _sizes(run: Result, names: list[str], runs: Runs) -> dict[str, float]:
    """What the scene makes of the units of outputs, by its inertia and by its softness."""
    natural, omega = natural_units(run), runs.vibrations.omega
    softness = min(1.0, (natural("s") * float(omega[0])) ** -2.0) if omega.size and natural("s") > 0 else 0.0
    return {name: natural(run.quantities[name].unit) * (1.0 if STIFFLY.search(name) else softness) for name in names}
