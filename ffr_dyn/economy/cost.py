"""The cost of a run, from the sizes of its model: microseconds that do not depend on the day, so that a search is repeatable.

The constants are what `python -m benchmarks.cost_model` prints, fitted to processor times of the compiled loop for mechanisms
of two to six bodies with none to fourteen modes a body, in the plane and in space, with and without geometric stiffening
and I5 and I9: within 14 per cent (root mean square). Only ratios matter.
"""

from __future__ import annotations

from ffr_dyn.economy.model_choice import Choice, Part
from ffr_dyn.economy.policy import DEFAULT, BodyCost, CostModel
from ffr_dyn.integrators import METHODS

STAGES = {"rk4": 4, "ros2": 2, "ros3": 4}
QUADRATIC = {"I5", "I9"}  # without these two their integrals are not touched


def per_evaluation(choice: Choice, model: CostModel = DEFAULT.cost) -> float:
    """[us] of one evaluation of the equations of motion."""
    return model.scene + sum(
        _of_body(part, model.space if choice.plane == "none" else model.plane) for part in choice.parts
    )


def per_row(choice: Choice, model: CostModel = DEFAULT.cost) -> float:
    """[us] from one output row to the next."""
    return per_evaluation(choice, model) * ((stages(choice.method) + model.projection) * choice.divisions + model.row)


def of_run(choice: Choice, rows: int, model: CostModel = DEFAULT.cost) -> float:
    """[us] of a run."""
    return rows * per_row(choice, model)


def of_evaluations(choice: Choice, evaluations: int, rows: int, model: CostModel = DEFAULT.cost) -> float:
    """[us] of a run with as many evaluations, those of its output rows among them."""
    return (evaluations + (model.row - model.row_evaluations) * rows) * per_evaluation(choice, model)


def stages(method: str) -> int:
    """Evaluations per step."""
    return STAGES.get(method) or int(getattr(METHODS[method], "stage_count", 4))


def _of_body(part: Part, cost: BodyCost) -> float:
    n = part.count
    if n == 0:
        return cost.rigid
    pairs = 0.0 if set(part.dropped) >= QUADRATIC else cost.mode_pair * n * n
    own = cost.rigid + cost.flexible + cost.mode * n + pairs
    stiffened = cost.stiffened + cost.stiffened_mode * n + cost.stiffened_pair * n * n
    return own + (stiffened if part.stiffened else 0.0)
