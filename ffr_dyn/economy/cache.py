"""The cache of a search: the models made and the runs done so far, and their cost. No model is assembled or run twice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from ffr_dyn.consistency.unresolved import Vibrations, lasting, vibrations
from ffr_dyn.economy.cost import of_run, per_evaluation
from ffr_dyn.economy.model_choice import Choice, Part
from ffr_dyn.economy.outputs import Probe
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.run import Made, Span, Trial, cost, make, run
from ffr_dyn.functions.together import Say, at_hand, together
from ffr_dyn.integrators.ros2 import Twin
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError


@dataclass(frozen=True)
class Tried:
    """A model that was run.

    cost  : [us] of a whole run by the cost model
    error : (outputs,) how far it is from the full model with the same step, or estimated error of the step; NaN unknown
    """

    choice: Choice
    what: str
    cost: float
    error: Array


@dataclass
class Ledger:
    """Runs by their choice; `spent` [us] by the cost model.

    asked : [us] of the runs and twins that were asked for since it was emptied, made then or before
    ahead : what came of runs that were made before they are asked for, and until then count as not made
    """

    scene: Scene
    span: Span
    of: Probe
    tell: Callable[[str], None]
    policy: Policy = DEFAULT
    runs: dict[Choice, Trial] = field(default_factory=dict)
    wide: dict[Choice, Trial] = field(default_factory=dict)
    twins: dict[Choice, Trial] = field(default_factory=dict)
    models: dict[tuple[tuple[Part, ...], str], Made] = field(default_factory=dict)
    ahead: dict[tuple[Choice, bool], Trial | Exception] = field(default_factory=dict)
    spent: float = 0.0
    asked: dict[tuple[Choice, bool], float] = field(default_factory=dict)
    tried: list[Tried] = field(default_factory=list)

    def made(self, choice: Choice) -> Made:
        """The model, assembled."""
        key = (choice.parts, choice.plane)
        if key not in self.models:
            self.models[key] = make(self.scene, choice, self.span)
        return self.models[key]

    def cost(self, trial: Trial) -> float:
        """[us] of a run, by the cost model."""
        return cost(trial, self.span, self.policy.cost)

    def cost_of(self, choice: Choice) -> float:
        """[us] of a run of a model with steps of one length, by the cost model."""
        return of_run(choice, self.span.rows, self.policy.cost)

    def run(self, choice: Choice) -> Trial:
        """A run of the model."""
        if choice not in self.runs:
            self.runs[choice] = self._had(choice, is_twin=False)
            self.spent += self.cost(self.runs[choice])
        self.asked[choice, False] = self.cost(self.runs[choice])
        return self.runs[choice]

    def vibrations(self, choice: Choice) -> Vibrations:
        """Of the model at the start."""
        return vibrations(self.made(choice).assembled, self.span.start)

    def twin(self, choice: Choice) -> Trial:
        """A run of the model that keeps vibration which its steps do not resolve (`ffr_dyn.integrators.ros2.Twin`)."""
        like = replace(choice, method="ros2")
        if like not in self.twins:
            self.twins[like] = self._had(like, is_twin=True)
            self.spent += self.cost(self.twins[like])
        self.asked[like, True] = self.cost(self.twins[like])
        return self.twins[like]

    def begin(self, runs: Sequence[Choice], twins: Sequence[Choice] = ()) -> None:
        """Make runs at the same time that are going to be asked for, where there are processors for it.

        What is decided by them, and in which order they are kept, is as if each were made when it is asked for.
        """
        twins = [replace(choice, method="ros2") for choice in twins]
        keys = [(choice, False) for choice in runs if choice not in self.runs]
        keys += [(choice, True) for choice in twins if choice not in self.twins]
        try:
            calls = {key: self._call(*key) for key in keys if key not in self.ahead}
        except (ComputationError, InputError):  # which is told when it is asked for
            return
        if at_hand() > 1 and not any(self.made(choice).assembled.system.user.count for choice, _ in calls):
            outcomes = dict(together(list(calls.values())))
            self.ahead |= {key: outcomes[k] for k, key in enumerate(calls)}

    def _had(self, choice: Choice, is_twin: bool) -> Trial:
        """A run, or its twin, that may have been made ahead. Raises what it raised."""
        outcome = self.ahead.pop((choice, is_twin), None)
        if isinstance(outcome, Exception):
            raise outcome
        return self._call(choice, is_twin)(None) if outcome is None else outcome

    def _call(self, choice: Choice, is_twin: bool) -> Callable[[Say | None], Trial]:
        """The call that makes a run, or its twin."""
        made, method = self.made(choice), None
        if is_twin:
            step = self.span.output_step / choice.divisions
            method = Twin(step, lasting(self.vibrations(choice), step))
        return lambda say: run(made, choice, self.span, self.of, method=method, say=say)

    def over_two_rows(self, choice: Choice) -> Trial | None:
        """A run with every other output row, and steps twice as long; None where these rows are too few."""
        pairs, odd = divmod(self.span.rows, 2)
        if odd or pairs < self.policy.least_wide_pairs:
            return None
        if choice not in self.wide:
            span = replace(self.span, output_step=2 * self.span.output_step)
            self.wide[choice] = run(self.made(choice), choice, span, self.of)
            self.spent += cost(self.wide[choice], span, self.policy.cost)
        return self.wide[choice]

    def first_part(self, choice: Choice) -> float:
        """[us] of a whole run of a method that chooses its steps, by the cost of its first rows; infinite where they fail."""
        rows = max(1, self.span.rows // self.policy.first_part)
        span = replace(self.span, end=self.span.start + rows * self.span.output_step)
        try:
            trial = run(self.made(choice), choice, span, self.of)
        except (ComputationError, InputError):
            return float("inf")
        spent = cost(trial, span, self.policy.cost)
        self.spent += spent
        return spent * self.span.rows / rows

    def looked(self, choice: Choice, evaluations: int) -> None:
        """Account for evaluations of a model in an estimate."""
        self.spent += evaluations * per_evaluation(choice, self.policy.cost)

    def note(self, trial: Trial, what: str, error: Array) -> None:
        """Keep for the report how far a model is off."""
        self.tried.append(Tried(trial.choice, what, self.cost(trial), error))
