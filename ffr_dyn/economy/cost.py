"""What a run costs, from the sizes of its model: microseconds that do not depend on the day, so that a search is repeatable.

Fitted to processor times of chains and four-bars with none to fourteen modes a body, in the plane and in space, with and
without geometric stiffening (`benchmarks.planar` and `benchmarks.speed` time the same loops). Only ratios matter.
"""

from __future__ import annotations

from ffr_dyn.economy.choice import Choice, Part
from ffr_dyn.integrators import METHODS

BASE = 0.3  # an evaluation of nothing
# a rigid body; more for a flexible one, per mode, per mode squared; for stiffening, per mode, per mode squared
SPACE = (1.0, 0.65, 0.02, 0.003, 1.05, 0.02, 0.016)
PLANE = (0.7, 0.35, 0.02, 0.003, 1.05, 0.03, 0.004)
STAGES = {"rk4": 4, "ros2": 2, "ros3": 4}
PROJECTION = 1.0  # evaluations per step that bring the state back to its constraints, about


def per_evaluation(choice: Choice) -> float:
    """[us] of one evaluation of the equations of motion."""
    return BASE + sum(_of_body(part, choice.plane != "none") for part in choice.parts)


def per_row(choice: Choice) -> float:
    """[us] from one output row to the next, which is one more evaluation."""
    return per_evaluation(choice) * ((stages(choice.method) + PROJECTION) * choice.divisions + 1)


def of_run(choice: Choice, rows: int) -> float:
    """[us] of a run."""
    return rows * per_row(choice)


def of_evaluations(choice: Choice, evaluations: int) -> float:
    """[us] of a run with as many evaluations."""
    return evaluations * per_evaluation(choice)


def stages(method: str) -> int:
    """Evaluations per step."""
    return STAGES.get(method) or int(getattr(METHODS[method], "stage_count", 4))


def _of_body(part: Part, planar: bool) -> float:
    rigid, flexible, linear, square, stiff, stiff_linear, stiff_square = PLANE if planar else SPACE
    n = part.count
    if n == 0:
        return rigid
    cost = rigid + flexible + linear * n + square * n * n
    return cost + (stiff + stiff_linear * n + stiff_square * n * n if part.stiffened else 0.0)
