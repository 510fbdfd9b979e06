"""One run of one model of a scene, with what the estimates need of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.analyses.integration import fast_within, integrate
from ffr_dyn.analyses.trials.begin import Beginning, begun
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.economy.cost import of_evaluations, of_run
from ffr_dyn.economy.model_choice import Choice, applied
from ffr_dyn.economy.outputs import Probe, histories, needed
from ffr_dyn.economy.policy import DEFAULT, CostModel
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.functions.together import Say
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import ComputationError

STATES = ("*.R", "*.p", "*.v", "*.omega_bar", "*.q", "*.q_dot")


@dataclass(frozen=True)
class Span:
    """From `start` to `end` [s] with a row every `output_step` [s]; how drift is held, and in what state a run begins."""

    start: float
    end: float
    output_step: float
    stabilisation: Stabilisation = Projection()  # noqa: RUF009 - frozen
    begin: Beginning = "as-given"

    @property
    def rows(self) -> int:
        """Output rows after the start."""
        return round((self.end - self.start) / self.output_step)


@dataclass(frozen=True, repr=False)
class Made(Brief):
    """A model: the scene with it, and that scene assembled, in the state in which the run begins."""

    scene: Scene
    assembled: Assembled


@dataclass(frozen=True, repr=False)
class Trial(Brief):
    """A run.

    made   : the model;  values : per output (T, k);  evaluations : of the equations of motion
    result : kept quantities, states among them, and notes
    """

    choice: Choice
    made: Made
    values: tuple[Array, ...]
    evaluations: int
    result: Result

    @property
    def scene(self) -> Scene:
        """With the model applied."""
        return self.made.scene


def make(scene: Scene, choice: Choice, span: Span) -> Made:
    """The model of a scene, assembled."""
    applied_to = applied(scene, choice)
    return Made(applied_to, begun(assemble(applied_to, time=span.start), span.start, span.begin))


def cost(trial: Trial, span: Span, model: CostModel = DEFAULT.cost) -> float:
    """[us] of a run, by the cost model: from its steps, or from its evaluations where the method chooses its steps."""
    if trial.choice.controlled:
        return of_evaluations(trial.choice, trial.evaluations, span.rows, model)
    return of_run(trial.choice, span.rows, model)


def simulated(
    made: Made,
    choice: Choice,
    span: Span,
    outputs: tuple[str, ...],
    stopwatch: Stopwatch | None = None,
    method: Integrator | None = None,
    say: Say | None = None,
) -> Result:
    """A forward run of a model, by its own method unless another is given. Raises ComputationError as `forward` does.

    say : called with the time reached, a few times a second
    """
    steps = choice.integrator(span.output_step) if method is None else method
    return integrate(
        made.scene,
        start=span.start,
        end=span.end,
        output_step=span.output_step,
        method=steps,
        stabilisation=span.stabilisation,
        outputs=outputs,
        stopwatch=stopwatch,
        progress=say,
        assembled=made.assembled,
        fast=fast_within(made.assembled.system, steps, span.start, span.end, span.output_step),
    )


def run(
    made: Made,
    choice: Choice,
    span: Span,
    of: Probe,
    outputs: tuple[str, ...] = (),
    method: Integrator | None = None,
    say: Say | None = None,
) -> Trial:
    """Run a model, by its own method unless another is given, keeping its states and what `outputs` name.

    Raises ComputationError as `forward` does, and where the outputs are no longer finite.
    """
    kept = (*needed(of, made.assembled.system), *_states(made.scene), *outputs)
    result = simulated(made, choice, span, kept, method=method, say=say)
    if "rebounds" in result.attributes:  # runs that lose them agree, and tell no error of it
        raise ComputationError(
            f"steps of {span.output_step / choice.divisions:.3g} s are too long for the stops that bodies "
            "rebound from; take a shorter output_step, or softer stops"
        )
    with np.errstate(over="ignore", invalid="ignore"):  # told below
        values = histories(of, made.scene, result)
    for output, one in zip(of.outputs, values, strict=True):
        if not np.isfinite(one).all():
            raise ComputationError(
                f"the output {output.name!r} of the run is not finite; look at the units of its body"
            )
    return Trial(choice, made, values, int(result.attributes["evaluations"]), result)


def _states(scene: Scene) -> tuple[str, ...]:
    return STATES if any(body.model.n for body in scene.bodies) else STATES[:4]


def rings(trial: Trial) -> bool:
    """Whether a body vibrates without damping: coarse runs damp that, and may agree on what is not so."""
    return any(bool(body.model.n) and not body.damping.all() for body in trial.scene.bodies)


def states(trial: Trial) -> tuple[Array, Array]:
    """(T, X) positions and (T, V) velocities of a run."""
    system, result = trial.made.assembled.system, trial.result
    place, T = system.layout, result.time.size
    x, v = np.zeros((T, place.x_size)), np.zeros((T, place.v_size))
    for b, body in enumerate(system.scene.bodies):
        kept = list(body.kept[0]) if body.kept else list(range(place.n[b]))
        x[:, place.R(b)], x[:, place.p(b)] = result[f"{body.name}.R"], result[f"{body.name}.p"]
        v[:, place.R_dot(b)], v[:, place.omega(b)] = result[f"{body.name}.v"], result[f"{body.name}.omega_bar"]
        if place.n[b]:
            x[:, place.q(b)] = result[f"{body.name}.q"][:, kept]
            v[:, place.q_dot(b)] = result[f"{body.name}.q_dot"][:, kept]
    return x, v
