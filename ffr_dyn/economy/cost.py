"""What a run costs, from the sizes of its model: microseconds that do not depend on the day, so that a search is repeatable.

The constants are what `python -m benchmarks.cost_model` prints, fitted to processor times of the compiled loop for mechanisms
of two to six bodies with none to fourteen modes a body, in the plane and in space, with and without geometric stiffening
and I5 and I9: within 14 per cent (root mean square). Only ratios matter.
"""

from __future__ import annotations

from ffr_dyn.economy.model_choice import Choice, Part
from ffr_dyn.integrators import METHODS

BASE = 0.20  # an evaluation of nothing
# a rigid body; more for a flexible one, per mode, per mode squared with I5 or I9; for stiffening, per mode, per mode squared
SPACE = (0.78, 0.32, 0.038, 0.001, 0.32, 0.048, 0.0)
PLANE = (0.49, 0.15, 0.029, 0.002, 0.29, 0.0, 0.005)
STAGES = {"rk4": 4, "ros2": 2, "ros3": 4}
PROJECTION = 0.5  # evaluations per step that bring the state back to its constraints, about
ROW = 4.6  # evaluations' time that an output row takes
RECORDED = 1.7  # of them that are counted as evaluations
QUADRATIC = {"I5", "I9"}  # without these two their integrals are not touched


def per_evaluation(choice: Choice) -> float:
    """[us] of one evaluation of the equations of motion."""
    return BASE + sum(_of_body(part, choice.plane != "none") for part in choice.parts)


def per_row(choice: Choice) -> float:
    """[us] from one output row to the next."""
    return per_evaluation(choice) * ((stages(choice.method) + PROJECTION) * choice.divisions + ROW)


def of_run(choice: Choice, rows: int) -> float:
    """[us] of a run."""
    return rows * per_row(choice)


def of_evaluations(choice: Choice, evaluations: int, rows: int) -> float:
    """[us] of a run with as many evaluations, those of its output rows among them."""
    return (evaluations + (ROW - RECORDED) * rows) * per_evaluation(choice)


def stages(method: str) -> int:
    """Evaluations per step."""
    return STAGES.get(method) or int(getattr(METHODS[method], "stage_count", 4))


def _of_body(part: Part, planar: bool) -> float:
    rigid, flexible, linear, square, stiff, stiff_linear, stiff_square = PLANE if planar else SPACE
    n = part.count
    if n == 0:
        return rigid
    cost = rigid + flexible + linear * n + (0.0 if set(part.dropped) >= QUADRATIC else square * n * n)
    return cost + (stiff + stiff_linear * n + stiff_square * n * n if part.stiffened else 0.0)
