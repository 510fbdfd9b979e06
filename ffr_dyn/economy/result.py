"""The result of a search for the cheapest model."""

from __future__ import annotations

from dataclasses import dataclass

from ffr_dyn.analyses.settings import Settings
from ffr_dyn.economy.cache import Tried
from ffr_dyn.economy.checks import Frequency, StiffeningLoad
from ffr_dyn.economy.contributions import Contributions
from ffr_dyn.economy.inertia_terms import TermEffect
from ffr_dyn.economy.model_choice import Choice
from ffr_dyn.economy.outputs import Probe
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief


@dataclass(frozen=True, repr=False)
class Verification(Brief):
    """The errors of the chosen model against the full model and a finer step.

    choice   : the reference;  own : (outputs,) its own error, by convergence
    error    : (outputs,) of the chosen model: its distance from the reference, and the reference's own error
    first    : (outputs,) distance of the model that the estimates had chosen
    is_known : whether the reference is known to the share of the tolerances that a verification takes; or nothing is verified
    attempts : how often the model had to be refined
    cost     : [us] of the references and of the runs that tell their errors, by the cost model
    """

    choice: Choice
    error: Array
    first: Array
    own: Array
    is_known: bool
    attempts: int
    cost: float


@dataclass(frozen=True, repr=False)
class Economy(Brief):
    """The result of `economise`.

    choice, scene, settings : the model;  scene is ready to run with `ffr_dyn.analyses.run.run(scene, settings)`
    limits       : (outputs,) tolerances in the units of the outputs;  scales : (outputs,) their ranges
    model_error, time_error, error : (outputs,) estimates: of what is left out, of the step, of both together
    together     : whether one run beside the full model told both errors, which stand as that of the step then
    effects      : what each mode left out does to each output, driven one-way by the final model's motion
    kept         : what each mode that stays does
    terms        : what inertia terms and stiffening by each load do to each output, kept or not
    before, cost : [us] of a run of the full model with the same step, and of the chosen model
    search_cost  : [us] of all runs and estimates beyond those of one verification, by the cost model
    tried        : what was tried and how far it was from the full model with the same step
    runs         : all runs made, with their errors against the reference, or else the chosen run less its estimated error
    unmoved      : names of outputs that no model changes
    frequencies  : of the model beside those of the full model;  stiffening : what stiffens bodies, and how much
    policy       : the numbers of the search
    new_frames   : names of the bodies whose frame is that of their mean motion here, and whose modes are those of that form

    >>> print(fd.as_text(found))  # of what `fd.economise` returned
    """

    original: Scene
    choice: Choice
    scene: Scene
    settings: Settings
    probe: Probe
    limits: Array
    scales: Array
    model_error: Array
    time_error: Array
    together: bool
    error: Array
    effects: Contributions
    kept: Contributions
    terms: tuple[TermEffect, ...]
    before: float
    cost: float
    search_cost: float
    tried: tuple[Tried, ...]
    runs: tuple[Tried, ...]
    unmoved: tuple[str, ...]
    frequencies: tuple[Frequency, ...]
    stiffening: tuple[StiffeningLoad, ...]
    notes: tuple[str, ...]
    verification: Verification | None
    policy: Policy = DEFAULT
    new_frames: tuple[str, ...] = ()
