"""Every number that the search for the cheapest model decides by: value, unit, meaning and where it comes from.

A `Policy` is passed to `economise` and `adaptive_forward` and goes with the search (`Ledger.policy`); `replace(Policy(),
surely_rigid=0.1)` is another one. `described()` lists all numbers with their words.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any

SET = "chosen on the scenes of benchmarks.economy"
TIMES = "fitted to processor times by benchmarks.cost_model"
ROUNDING = "well above rounding of double precision, well below anything that matters"
ROUNDS = "searches of the benchmark set need one or two; ends a search that goes nowhere"
READING = "a table that is read at a glance"


def number(value: Any, unit: str, meaning: str, source: str) -> Any:
    """A field of a policy."""
    return field(default=value, metadata={"unit": unit, "meaning": meaning, "source": source})


@dataclass(frozen=True)
class BodyCost:
    """Processor time [us] that a body adds to an evaluation of the equations of motion.

    rigid, flexible         : of a rigid body, and what a flexible one takes more
    mode, mode_pair         : per mode, and per square of their number where I5 or I9 are there
    stiffened, stiffened_mode, stiffened_pair : the same three of geometric stiffening
    """

    rigid: float
    flexible: float
    mode: float
    mode_pair: float
    stiffened: float
    stiffened_mode: float
    stiffened_pair: float


SPACE = BodyCost(0.78, 0.32, 0.038, 0.001, 0.32, 0.048, 0.0)
PLANE = BodyCost(0.49, 0.15, 0.029, 0.002, 0.29, 0.0, 0.005)


@dataclass(frozen=True)
class CostModel:
    """The cost of a run, in microseconds that do not depend on the day (see `ffr_dyn.economy.cost`). Only ratios matter."""

    scene: float = number(0.20, "us", "an evaluation of nothing", TIMES)
    space: BodyCost = number(SPACE, "us", "a body in space", TIMES)  # noqa: RUF009
    plane: BodyCost = number(PLANE, "us", "one in a plane", TIMES)  # noqa: RUF009
    projection: float = number(0.5, "evaluations", "bringing a step back to its constraints, on average", TIMES)
    row: float = number(4.6, "evaluations", "an output row", TIMES)
    row_evaluations: float = number(1.7, "evaluations", "those of an output row that a run counts as such", TIMES)


@dataclass(frozen=True)
class Policy:
    """The numbers of a search. "tolerance" as a unit: a share of the tolerance of an output."""

    # ---- when rigid bodies do
    surely_rigid: float = number(
        0.25, "tolerance", "modes that all together do less, by the estimate alone, are left out without a run", SET
    )
    rigid_tried: float = number(
        1.0,
        "tolerance",
        "where modes do less by the estimate, a run of rigid bodies is made beside the full model",
        SET,
    )
    rigid_share: float = number(0.5, "tolerance", "that rigid bodies may take when run beside the full model", SET)
    nearly_rigid: float = number(
        10.0, "tolerance", "where modes do less by the estimate, two stages are tried at any tolerance", SET
    )
    unmoved: float = number(
        1e-9, "range", "an output that modes change by less is the same in every model; the report says so", ROUNDING
    )
    in_plane: float = number(1e-7, "size, or largest rate", "what counts as no motion across a plane", ROUNDING)

    # ---- what modes and terms may take
    modes_share: float = number(
        0.03, "tolerance", "for modes left out: a margin, as one more mode costs less than another run", SET
    )
    bold_modes_share: float = number(0.15, "tolerance", "the same of a first try in two stages", SET)
    terms_share: float = number(0.15, "tolerance", "for inertia terms and stiffening loads left out", SET)
    omitted_share: float = number(0.5, "tolerance", "for all that is left out, measured beside the full model", SET)
    whole_share: float = number(0.85, "tolerance", "for what is left out and the step together, by the estimates", SET)
    least_step_share: float = number(0.2, "tolerance", "for the step, whatever is left out", SET)

    # ---- the choice of modes
    needed_modes: float = number(
        0.8, "of all modes", "where as many are needed, they are ranked by the motion of the full model", SET
    )
    model_attempts: int = number(5, "runs", "of models beside the full model, before that itself is chosen", ROUNDS)
    more_modes: float = number(1.2, "times", "as many directions, at least, after those that were not enough", SET)
    stalled: float = number(
        0.9, "of the error before", "above it more modes have not helped: something comes by way of another body", SET
    )
    caution: float = number(
        0.6, "of what was allowed", "is aimed at when a model turns out to do more than was predicted", SET
    )
    coarse_tolerance: float = number(5e-3, "of the range", "from here up a model in two stages is tried first", SET)
    two_stages: float = number(
        0.75, "tolerance", "two stages as near the full model in four are trusted, with their steps", SET
    )
    two_stages_ringing: float = number(
        0.5, "tolerance", "the same where something vibrates undamped: the full model errs by its step as well", SET
    )
    two_stages_reach: float = number(
        2.5, "of what is trusted", "a run of two stages with more modes is worth it below", SET
    )

    # ---- method and step
    agreement: float = number(
        0.95, "tolerance", "methods of two orders that differ by less: their difference is the error of the lower", SET
    )
    agreement_ringing: float = number(0.5, "tolerance", "the same where something vibrates undamped", SET)
    wide_step_share: float = number(0.8, "tolerance", "an error told by steps over two rows is trusted up to", SET)
    hopeless: float = number(8.0, "tolerance", "between two stages and four: neither will do with this step", SET)
    far_below: float = number(0.1, "tolerance", "below it a longer or cheaper step is tried", SET)
    accuracies: tuple[float, float] = number(
        (1e-2, 1e-3), "relative", "tolerances of methods that choose their steps, tried one after the other", SET
    )
    controlled_gain: float = number(0.8, "of the cost", "a method that chooses its steps is taken below", SET)
    most_divisions: int = number(4096, "divisions", "of an output row; a tolerance that needs more is refused", ROUNDS)
    step_attempts: int = number(10, "runs", "of a model with other steps", ROUNDS)
    error_margin: float = number(1.6, "times", "the error from which divisions are predicted: orders set in late", SET)
    rung: float = number(3.0, "times", "the divisions of the last run, towards a prediction far away", SET)
    fewer_divisions: float = number(0.6, "of the divisions", "a run with fewer pays below", SET)
    nearest_step: float = number(1.25, "times", "apart, two steps tell an error from here", "closer ones tell rounding")
    farthest_step: float = number(
        3.0, "times", "apart, two steps tell an error up to here", "the order must have set in"
    )
    least_wide_pairs: int = number(8, "pairs of rows", "below them steps over two rows say nothing about a step", SET)
    first_part: int = number(
        8, "of the rows", "the first of so many tells the cost of a method that chooses its steps", SET
    )

    # ---- another look with a finer step
    finer_damped: float = number(6.0, "times", "finer final steps ask for another look, where vibration decays", SET)
    finer_damped_cost: float = number(1.0, "final runs", "that this look may cost", SET)
    finer_ringing: float = number(2.0, "times", "the same where something vibrates undamped", SET)
    finer_ringing_cost: float = number(1.3, "final runs", "that this look may cost", SET)
    finer_verified: float = number(
        4.0, "times", "the same where a verification needs the run of the full model anyway", SET
    )

    # ---- verification
    unasked_verification: float = number(
        5e6, "us", "a verification is allowed, and made without being asked for below", "some seconds are no bother"
    )
    asked_verification: float = number(6e7, "us", "a verification is allowed that is asked for", "a minute")
    reference_share: float = number(
        0.25, "tolerance", "to which the reference must be known", "what a reference leaves of a tolerance to be used"
    )
    fall: float = number(0.9, "times", "the difference before: slower falling ones converge no better", ROUNDING)
    resolved: float = number(0.6, "rad", "a vibration turns at most in a step of an explicit reference", SET)
    lost: float = number(
        0.3,
        "amplitude",
        "that an explicit reference may take of a vibration in all of the run",
        "RK4: (h w)^6 / 144 a step",
    )
    lost_damping: float = number(0.05, "damping", "that an explicit reference may add", "RK4: (h w)^5 / 144 a radian")
    verification_attempts: int = number(4, "looks", "at models against the reference", ROUNDS)
    unexplained: float = number(
        0.25, "tolerance", "an error beyond what is left out by more is the step's, which is shortened too", SET
    )

    # ---- estimates along a motion
    least_samples: int = number(24, "states", "along a run, at which residuals are formed", SET)
    rows_per_sample: int = number(8, "rows", "to a state, in a longer run", SET)
    remainder: float = number(1e-6, "of a mode", "a smaller rest outside a space of shapes is none", ROUNDING)
    looks_at_effect: int = number(4, "states", "where a coordinate is largest, at which its effect is taken", SET)
    minor_effect: float = number(
        0.05, "tolerance", "coordinates that do less where they are largest are looked at there alone", SET
    )
    constraint_weight: float = number(
        1e10, "of the inertia", "of a violated constraint, where frames follow a mode", "half of double precision"
    )

    # ---- outputs
    finest_tolerance: float = number(
        1e-10, "of the range", "a smaller tolerance is refused", "rounding, and the projection on the constraints"
    )
    still: float = number(1e-12, "unit of the output", "a smaller range is no motion", ROUNDING)
    still_stress: float = number(1e-3, "Pa", "the same of a stress", ROUNDING)

    # ---- adaptive order
    piece_repeats: int = number(3, "runs", "of a piece, again with the modes that turn out to matter", ROUNDS)

    # ---- what the report and the chart show
    shown_rows: int = number(6, "rows", "of what is nearest to mattering", READING)
    shown_frequencies: int = number(6, "frequencies", "beside those of the full model", READING)
    rigid_frequency: float = number(1e-3, "of the lowest mode", "a slower small motion is none that vibrates", ROUNDING)
    load_samples: int = number(24, "states", "at which the loads that stiffen are looked at", SET)
    needed_stiffening: float = number(1e-4, "of a stiffness", "a load that changes more is called needed", SET)
    timing_repeats: int = number(3, "runs", "of each point of the chart, whose median time is drawn", READING)
    alone: float = number(
        3.0,
        "times",
        "what omitted modes do together, or a tolerance: more than one can do alone, which is not listed",
        READING,
    )
    advised_effect: float = number(0.02, "tolerance", "modes that do less are not asked for in the advice", SET)
    band: float = number(
        1.5, "times", "the highest frequency that matters: end of the band advised", "rule of component mode synthesis"
    )
    elements_per_wave: int = number(
        8,
        "elements",
        "of second order to the shortest wave that matters",
        "a rule of thumb; ffr-prep --quality tells more",
    )

    cost: CostModel = field(default=CostModel())


DEFAULT = Policy()


def described(policy: Policy = DEFAULT) -> Iterator[tuple[str, Any, str, str, str]]:
    """(name, value, unit, meaning, source) of every number, those of the cost model as cost.NAME."""
    for name, of in (("", policy), ("cost.", policy.cost)):
        for one in fields(of):
            if one.name != "cost":
                yield (
                    name + one.name,
                    getattr(of, one.name),
                    *(one.metadata[key] for key in ("unit", "meaning", "source")),
                )
