"""Where a search starts: the plane, rigid bodies with a coarse step, and what they leave out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.contributions import Contributions, of_omitted
from ffr_dyn.economy.model_choice import Choice, full, held_in_plane, in_plane, rigid
from ffr_dyn.economy.outputs import limits, ranges
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.run import Trial
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

SCOUT, PILOT = "ros2", "ros3"  # methods of coarse runs of rigid bodies, and of the full model


@dataclass(frozen=True)
class Ground:
    """Where a search starts.

    everything : all modes, in the plane where there is one, with the step of the pilot;  spatial : the same in space
    pilot      : run of the full model
    limits, scales : (outputs,) tolerances in the units of the outputs, and their ranges
    """

    everything: Choice
    spatial: Choice
    pilot: Trial
    limits: Array
    scales: Array

    @property
    def coarsest(self) -> int:
        """Steps to a row of the pilot."""
        return self.everything.divisions


def least(run: Callable[[Choice], Trial], choice: Choice, divisions: int, policy: Policy = DEFAULT) -> Trial:
    """The run with the fewest divisions, from `divisions` up by doubling, with which it comes to an end."""
    failed: Exception | None = None
    while divisions <= policy.most_divisions:
        try:
            return run(replace(choice, divisions=divisions))
        except (ComputationError, InputError) as error:
            failed, divisions = error, 2 * divisions
    raise ComputationError(f"no step down to 1/{policy.most_divisions} of the output step completes a run: {failed}")


@dataclass(frozen=True)
class Rigid:
    """Rigid bodies with a coarse step, and all modes driven one-way by their motion.

    everything, spatial : choices as of `Ground`
    """

    ledger: Ledger
    trial: Trial
    everything: Choice
    spatial: Choice

    def contributions(self, limit: Array) -> Contributions:
        """The contributions that each mode would make."""
        ledger = self.ledger
        ledger.tell("modes driven by the rigid motion")
        return of_omitted(ledger, self.trial, self.everything, limit)

    @property
    def limits(self) -> Array | None:
        """(outputs,) tolerances in the units of the outputs; None where rigid bodies do not tell the range of one."""
        try:
            return limits(self.ledger.of, ranges(self.trial.values), self.ledger.policy)
        except InputError:
            return None

    def ground(self) -> Ground:
        """With a run of the full model beside that of rigid bodies."""
        self.ledger.tell("full model, coarse step")
        pilot = least(self.ledger.run, self.everything, self.everything.divisions, self.ledger.policy)
        scales = ranges(pilot.values)
        bound = limits(self.ledger.of, scales, self.ledger.policy)
        self.ledger.note(pilot, "full model", np.zeros(len(bound)))
        return Ground(pilot.choice, self.spatial, pilot, bound, scales)


def started(ledger: Ledger, flat: Scene) -> Rigid:
    """Rigid bodies with steps as long as complete a run, over two rows at most; `flat` is the scene as it is assembled, with
    its plane."""
    ledger.tell("rigid bodies, coarse step")
    spatial = full(ledger.scene, PILOT, 1)
    held = held_in_plane(spatial, flat)
    everything = spatial if held is None else held
    trial = _scouted(ledger, rigid(replace(everything, method=SCOUT)))
    everything = replace(everything, divisions=trial.choice.divisions)
    free = None if held is not None else in_plane(ledger.scene, everything, trial.result, ledger.policy)
    if free is not None:
        everything, trial = free, _scouted(ledger, rigid(replace(free, method=SCOUT)))
    return Rigid(ledger, trial, everything, spatial)


def _scouted(ledger: Ledger, choice: Choice) -> Trial:
    """A run with steps over two rows, half of what a whole one costs; where that fails, the longest that completes."""
    try:
        wide = ledger.over_two_rows(choice)
    except (ComputationError, InputError):
        wide = None
    return least(ledger.run, choice, 1, ledger.policy) if wide is None else wide


def unmoved(omitted: Contributions, scales: Array, names: list[str], policy: Policy) -> tuple[str, ...]:
    """Names of the outputs that are the same with rigid bodies and with flexible ones, from what the modes do to them."""
    still = omitted.effect.sum(axis=0) <= policy.unmoved * np.maximum(scales, 1e-300)
    return tuple(name for name, quiet in zip(names, still, strict=True) if quiet)
