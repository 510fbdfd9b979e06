"""The numbers of a search: each is documented, none stands elsewhere, and each that is moved changes what is decided.

Every field has a figure here: what a part of the search decides, on made-up runs, just below and just above the number.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from places import ROOT
from synthetic import cloud

from ffr_dyn.analyses.forward import Forward
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.economy import (
    adaptive,
    advice,
    cache,
    checks,
    contributions,
    picture,
    report,
    search,
    selection,
    steps,
    verification,
)
from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.contributions import Contributions
from ffr_dyn.economy.cost import of_evaluations, of_run, per_evaluation, per_row
from ffr_dyn.economy.inertia_terms import TermEffect
from ffr_dyn.economy.model_choice import Choice, Part, _stays, full, rigid
from ffr_dyn.economy.outputs import Output, Probe, limits, probe
from ffr_dyn.economy.policy import DEFAULT, BodyCost, CostModel, Policy, described
from ffr_dyn.economy.residual_estimate import followed
from ffr_dyn.economy.rigid_start import Ground, least, unmoved
from ffr_dyn.economy.run import Made, Span, Trial
from ffr_dyn.economy.selection import Ranking, Selection
from ffr_dyn.economy.steps import Stepped, _cheapest, _coarse, _controlled, _far_off, _needed, _of_both, _rung, measured
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError

SCENE = Scene(
    (Body("rod", cloud(4, seed=1), damping=0.01), Body("arm", cloud(3, seed=2), damping=0.01)),
    (Joint("root", "spherical", "ground.O", "rod.a"), Joint("tie", "spherical", "rod.b", "arm.a")),
    ground={"O": (0.0, 0.0, 0.0)},
)
RINGING = replace(SCENE, bodies=tuple(replace(body, damping=0.0) for body in SCENE.bodies))
SPAN = Span(0.0, 1.0, 0.01)
EVERYTHING = full(SCENE, "ros3", 1)
ONE = np.ones(1)
OF = Probe((Output("x", 1.0, absolute=True),), ("x",), ((),), ("m",))
Error = Callable[[Choice], float]


class Runs(Ledger):
    """A ledger whose runs are off by a number each, told by a function of the model and its step."""

    def with_errors(self, error: Error, wide: Error | None = None) -> Runs:
        self.error, self.wide_error = error, wide
        return self

    def trial(self, choice: Choice, off: float, rows: int) -> Trial:
        if not np.isfinite(off):
            raise ComputationError("the run fails")
        return Trial(choice, Made(self.scene, None), (np.full((rows, 1), off),), 300, None)

    def run(self, choice: Choice) -> Trial:
        if choice not in self.runs:
            self.runs[choice] = self.trial(choice, self.error(choice), 101)
        return self.runs[choice]

    def over_two_rows(self, choice: Choice) -> Trial | None:
        return None if self.wide_error is None else self.trial(choice, self.wide_error(choice), 51)


def runs(policy: Policy, error: Error = lambda choice: 0.0, wide: Error | None = None, scene: Scene = SCENE) -> Runs:
    return Runs(scene, SPAN, OF, lambda stage: None, policy).with_errors(error, wide)


def ground(ledger: Ledger, limit: float = 1.0, scale: float = 1.0) -> Ground:
    return Ground(EVERYTHING, EVERYTHING, ledger.run(EVERYTHING), limit * ONE, scale * ONE)


def effects(*sizes: float, body: tuple[int, ...] | None = None) -> Contributions:
    """Modes in the order of the first body's, with their effects on one output."""
    where = np.zeros(len(sizes), int) if body is None else np.array(body)
    mode = np.array([int((where[:k] == b).sum()) for k, b in enumerate(where)])
    shapes = tuple(np.eye(SCENE.bodies[b].model.n)[m] for b, m in zip(where, mode, strict=True))
    return Contributions(where, mode, shapes, np.ones(len(sizes)), np.array(sizes)[:, None])


def ranking(policy: Policy, found: Contributions) -> Ranking:
    return Ranking(SCENE, EVERYTHING, found, ONE, policy.remainder)


class StoppedError(Exception):
    """The search has gone further than is looked at."""


def stop(*_: Any, **__: Any) -> None:
    raise StoppedError


def around(value: float) -> tuple[float, float]:
    """Just below and just above."""
    return 0.97 * value, 1.03 * value


# ---- figures: rigid bodies ---------------------------------------------------------------------------------------------


def surely_rigid(policy: Policy, patch: Any) -> Any:
    """Whether rigid bodies are believed without a run of everything."""
    patch.setattr(search, "_acts_between_rows", lambda trial, span: False)
    patch.setattr(search, "_may_be_deaf", lambda trial: False)

    def decided(effect: float) -> bool:
        ledger = runs(policy)
        stiff = SimpleNamespace(
            limits=ONE, trial=ledger.run(rigid(EVERYTHING)), everything=EVERYTHING, spatial=EVERYTHING
        )
        return search._surely_rigid(ledger, stiff, effects(effect)) is not None

    return [decided(effect) for effect in around(0.25)]


def selected(policy: Policy, patch: Any, effect: float, error: Error) -> str:
    """What is decided before modes are ranked."""
    patch.setattr(selection, "_rankings", stop)
    ledger = runs(policy, error)
    try:
        return selection.selected_model(ledger, ground(ledger, 1.0, 1e3), effects(effect)).choice.method
    except StoppedError:
        return f"{len(ledger.runs)} runs"


def rigid_tried(policy: Policy, patch: Any) -> Any:
    return [selected(policy, patch, effect, lambda choice: 0.0) for effect in around(1.0)]


def rigid_share(policy: Policy, patch: Any) -> Any:
    def error(off: float) -> Error:
        return lambda choice: np.inf if choice.method == "ros2" else off * (choice != EVERYTHING)

    return [selected(policy, patch, 0.0, error(off)) for off in around(0.5)]


def nearly_rigid(policy: Policy, patch: Any) -> Any:
    """Whether two stages are tried although the tolerance is fine."""
    ledger = runs(policy)
    tried: list[bool] = []
    patch.setattr(selection, "_rankings", lambda *a: ([ranking(policy, effects(0.0))], ()))
    patch.setattr(selection, "_in_two_stages", lambda *a: tried.append(True))
    patch.setattr(selection, "_enough", lambda *a: EVERYTHING)
    for effect in around(10.0):
        tried.append(False)
        selection.selected_model(ledger, ground(ledger, 1e-3, 1.0), effects(1e-3 * effect))
    return tried


def unmoved_(policy: Policy, patch: Any) -> Any:
    return [unmoved(effects(effect), ONE, ["x"], policy) for effect in around(1e-9)]


def in_plane(policy: Policy, patch: Any) -> Any:
    """Whether a motion across the plane of this share counts."""
    form = Scene(SCENE.bodies[:1], plane="z")

    def stays(share: float) -> bool:
        R = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, share]])
        return _stays(form, {"rod.R": R, "rod.omega_bar": np.array([[0.0, 0.0, 1.0]])}, policy.in_plane)

    return [stays(share) for share in around(1e-7)]


# ---- figures: modes and terms ------------------------------------------------------------------------------------------

SIZES = (1.0, 0.11, 0.028, 0.0)


def two_stage_sizes(policy: Policy, patch: Any) -> Any:
    """Elastic coordinates of the models tried in two stages."""
    ledger = runs(policy, lambda choice: 1.2 * (choice.method == "ros2"))
    selection._in_two_stages(ledger, ground(ledger), ranking(policy, effects(*SIZES)), ())
    return [choice.count for choice in ledger.runs if choice.method == "ros2"]


def terms_share(policy: Policy, patch: Any) -> Any:
    """Terms that a model goes without."""
    ledger = runs(policy)
    terms = tuple(TermEffect(0, term, None, size * ONE) for term, size in (("I9", 0.014), ("I5", 0.13), ("I8", 1.2)))
    model = selection._enough(ledger, ground(ledger), ranking(policy, effects(*SIZES)), terms, None)
    return model.parts[0].dropped


def enough(policy: Policy, error: Error, found: Contributions | None = None) -> Ledger:
    ledger = runs(policy, error)
    of = ranking(policy, effects(*SIZES) if found is None else found)
    selection._enough(ledger, ground(ledger), of, (), None)
    return ledger


def omitted_share(policy: Policy, patch: Any) -> Any:
    """Whether a model as far from everything is taken at once."""
    return [len(enough(policy, lambda choice, off=off: off * (choice != EVERYTHING)).runs) for off in around(0.5)]


def model_attempts(policy: Policy, patch: Any) -> Any:
    noted = enough(policy, lambda choice: 1e9 * (choice != EVERYTHING), effects(*(1.0 / k for k in range(1, 5)))).tried
    return len(noted)


def stalled(policy: Policy, patch: Any) -> Any:
    """Whether the other body gets a shape after a second try that helped little."""

    def tried(gain: float) -> list[int]:
        found = effects(3.0, 2.0, 1.0, 0.0, body=(0, 0, 0, 1))
        error = iter([0.0, 1.0, gain, *(0.0,) * 9])
        ledger = runs(replace(policy, modes_share=3.5), lambda choice: next(error))
        selection._enough(ledger, ground(ledger), ranking(policy, found), (), None)
        return [choice.parts[1].count for choice in ledger.runs]

    return [tried(gain) for gain in around(0.9)]


def caution(policy: Policy, patch: Any) -> Any:
    """How many modes the second model has after one whose error is twice what is allowed."""
    found = effects(8.0, *(1.0,) * 6, body=(0, 0, 0, 0, 1, 1, 1))
    error = iter([0.0, 1.0, 0.0])
    ledger = runs(replace(policy, modes_share=5.5, terms_share=0.0), lambda choice: next(error))
    selection._enough(ledger, ground(ledger), ranking(policy, found), (), None)
    return [choice.count for choice in ledger.runs]


def more_modes(policy: Policy, patch: Any) -> Any:
    of = SimpleNamespace(order=np.arange(1000))
    return [selection._more(of, count, policy) for count in (2, 50)]


def needed_modes(policy: Policy, patch: Any) -> Any:
    """Whether modes are ranked by the motion of everything, of a hundred of which so many are needed."""

    def ranked(count: int) -> bool:
        ledger, looked = runs(policy), []
        for name in ("own", "of_shapes", "term_effects"):
            patch.setattr(selection, name, lambda *a: None)
        patch.setattr(selection, "of_motion", lambda *a: looked.append(True))
        omitted = SimpleNamespace(effect=np.array([1.0] * count + [0.0] * (100 - count))[:, None], body=np.zeros(100))
        selection._rankings(ledger, ground(ledger), omitted)
        return bool(looked)

    return [ranked(count) for count in (79, 80)]


def remainder(policy: Policy, patch: Any) -> Any:
    """Whether a direction that is nearly a mode is taken as that mode."""

    def model(rest: float) -> Any:
        found = effects(1.0, 0.5)
        found = replace(found, shape=(found.shape[0] + rest * np.eye(4)[3], found.shape[1]))
        return ranking(policy, found).model(2).parts[0].shapes is None

    return [model(rest) for rest in around(1e-6)]


def directly(policy: Policy, scene: Scene, scale: float) -> float:
    ledger = runs(policy, lambda choice: 0.3 * (choice.method == "ros2"), scene=scene)
    return round(selection._directly(ledger, ground(ledger, 1.0, scale), EVERYTHING), 6)


def two_stages_reach(policy: Policy, patch: Any) -> Any:
    """How many models are tried in two stages, the first so far off."""

    def tried(off: float) -> int:
        ledger = runs(policy, lambda choice: off * 0.75 * (choice.method == "ros2"))
        selection._in_two_stages(ledger, ground(ledger), ranking(policy, effects(*SIZES)), ())
        return len(ledger.tried)

    return [tried(off) for off in around(2.5)]


def coarse_tolerance(policy: Policy, patch: Any) -> Any:
    ledger = runs(policy)
    return [selection._is_coarse(ledger, ground(ledger, share, 1.0)) for share in around(5e-3)]


def step_limit(policy: Policy, patch: Any) -> Any:
    """What is left for the step beside a small and a large error of the model."""
    patch.setattr(search, "chosen_step", lambda ledger, choice, limit: limit)
    return [round(float(x), 6) for x in search._with_step(runs(policy), EVERYTHING, np.array([0.1, 0.8]), np.ones(2))]


# ---- figures: method and step ------------------------------------------------------------------------------------------


def of_both(policy: Policy, scene: Scene, *offs: float) -> list[str]:
    """Which of two methods is believed that differ by a share of the limit."""
    found = []
    for off in offs:
        ledger = runs(policy, lambda choice, off=off: off * (choice.method == "ros2"), scene=scene)
        stepped = _of_both(ledger.run(replace(EVERYTHING, method="ros2")), ledger.run(EVERYTHING), ONE, policy)
        found.append("none" if stepped is None else stepped.trial.choice.method)
    return found


def coarse(policy: Policy, share: float, simple: float = 9.0) -> str:
    """The method taken where steps over two rows tell this error of one of four stages."""
    ledger = runs(policy, lambda choice: simple * (choice.method == "ros2"), lambda choice: 7.0 * share)
    stepped = _coarse(ledger, ledger.run(EVERYTHING), ONE)
    return "none" if stepped is None else stepped.trial.choice.method


def hopeless(policy: Policy, patch: Any) -> Any:
    def far(off: float) -> bool:
        ledger = runs(policy, lambda choice: off * (choice.method == "ros2"))
        ledger.run(replace(EVERYTHING, method="ros2"))
        return _far_off(ledger, ledger.run(EVERYTHING), ONE)

    return [far(off) for off in around(8.0)]


def far_below(policy: Policy, patch: Any) -> Any:
    return [coarse(policy, share, simple=0.0) for share in around(0.1)]


def controlled(policy: Policy, evaluations: int, meets: float) -> Any:
    """The accuracy of a method that chooses its steps, and needs so many evaluations."""
    ledger = runs(policy, lambda choice: 9.0 * (choice.accuracy > meets))
    make = ledger.trial
    ledger.trial = lambda *a: replace(make(*a), evaluations=evaluations)  # type: ignore[method-assign]
    best = Stepped(ledger.run(EVERYTHING), (np.zeros((101, 1)),))
    choice = replace(EVERYTHING, method="dopri5", accuracy=1.0)
    found = _controlled(ledger, choice, (np.zeros((101, 1)),), ONE, best)
    return None if found is None else found.trial.choice.accuracy


def most_divisions(policy: Policy, patch: Any) -> Any:
    """The finest step tried of a model that fails with all."""
    tried: list[int] = []

    def fails(choice: Choice) -> Trial:
        tried.append(choice.divisions)
        raise ComputationError("too long a step")

    with pytest.raises(ComputationError):
        least(fails, EVERYTHING, 1, policy)
    return max(tried)


def step_attempts(policy: Policy, patch: Any) -> Any:
    """Attempts at a step that no error follows."""
    attempts: list[int] = []
    patch.setattr(steps, "_rung", lambda ledger, choice, needed: attempts.append(needed) or needed)
    ledger = runs(replace(policy, most_divisions=10**9), lambda choice: 9.0 * len(ledger.runs))
    with pytest.raises(ComputationError):
        _cheapest(ledger, ledger.run(EVERYTHING), {"ros3": 2}, 1e-3 * ONE, 9.0)
    return len(attempts)


def error_margin(policy: Policy, patch: Any) -> Any:
    return _needed(runs(policy).run(EVERYTHING), 1000.0, policy)


def rung(policy: Policy, patch: Any) -> Any:
    """The next divisions after one, where three and a hundred are needed."""
    ledger = runs(policy)
    ledger.run(EVERYTHING)
    return [_rung(ledger, EVERYTHING, needed) for needed in (3, 4, 100)]


def near_steps(policy: Policy, patch: Any) -> Any:
    """From which run the error of one of 100 steps is told."""
    told = []
    for other in (79, 81, 33, 34):
        ledger = runs(policy)
        for divisions in (100, other):
            ledger.run(replace(EVERYTHING, divisions=divisions))
        measured(ledger, ledger.run(replace(EVERYTHING, divisions=100)))
        told.append(len(ledger.runs) == 2)
    return told


def fewer_divisions(policy: Policy, patch: Any) -> Any:
    """The divisions taken after a run with ten whose error is smaller than it need be."""

    patch.setattr(steps, "_rung", lambda ledger, choice, needed: needed)

    def taken(share: float) -> int:
        ledger = runs(policy, lambda choice: share * (10.0 / choice.divisions) ** 3)
        found = _cheapest(ledger, ledger.run(EVERYTHING), {"ros3": 10}, ONE, share * 1000)
        return found.trial.choice.divisions

    return [taken(share) for share in (0.1, 0.3)]


def least_wide_pairs(policy: Policy, patch: Any) -> Any:
    patch.setattr(cache, "run", lambda *a: Trial(EVERYTHING, Made(SCENE, None), (), 0, None))
    patch.setattr(cache, "make", lambda *a: None)
    spans = [Span(0.0, rows * 0.01, 0.01) for rows in (14, 16)]
    return [Ledger(SCENE, span, OF, print, policy).over_two_rows(EVERYTHING) is not None for span in spans]


def first_part(policy: Policy, patch: Any) -> Any:
    """Rows that are run to tell the cost of a method."""
    seen: list[int] = []
    patch.setattr(cache, "make", lambda *a: None)
    patch.setattr(
        cache,
        "run",
        lambda made, choice, span, of: seen.append(span.rows) or Trial(choice, Made(SCENE, None), (), 0, None),
    )
    Ledger(SCENE, SPAN, OF, print, policy).first_part(replace(EVERYTHING, method="dopri5"))
    return seen


# ---- figures: a finer look, verification -------------------------------------------------------------------------------


def finer(policy: Policy, scene: Scene, divisions: int, verify: bool, model: Choice = EVERYTHING) -> int | None:
    """Steps to a row of another look, after a final run of a model with so many."""
    ledger = runs(policy, scene=scene)
    final = ledger.run(replace(model, divisions=divisions))
    found = search._finer_ground(ledger, ground(ledger), final, verify)
    return None if found is None else found.coarsest


def unasked_verification(policy: Policy, patch: Any) -> Any:
    decided = []
    for cost in around(5e6):
        patch.setattr(search, "reference_cost", lambda *a, cost=cost: cost)
        decided.append(search._is_verified(runs(policy), EVERYTHING, None, None))
    return decided


def verification_attempts(policy: Policy, patch: Any) -> Any:
    """Looks at a model that stays wrong."""
    ledger = runs(policy, lambda choice: 0.0 if choice.parts == EVERYTHING.parts else 5.0)
    final = ledger.run(rigid(EVERYTHING))
    patch.setattr(verification, "_better", lambda *a: final)
    return verified_(ledger, final).attempts


def verified_(ledger: Runs, final: Trial, allowed: float = 1e9) -> Any:
    """A verification of made-up runs, which vibrate in nothing."""
    ledger.vibrations = lambda choice: SimpleNamespace(omega=np.zeros(0))
    ledger.twin = ledger.run
    return verification.verified(ledger, EVERYTHING, ONE, final, effects(1.0), allowed)[1]


def asked_verification(policy: Policy, patch: Any) -> Any:
    """What a verification is allowed that is asked for, and one that is not."""
    given: list[float] = []
    patch.setattr(search, "_is_verified", lambda *a: True)
    patch.setattr(search, "verified", lambda *a: given.append(a[-1]) or stop())
    ledger = runs(policy)
    found = SimpleNamespace(final=ledger.run(EVERYTHING), everything=EVERYTHING, error=ONE, limits=ONE, omitted=None)
    for verify in (True, None):
        try:
            search._finished(ledger, found, verify)
        except StoppedError:
            continue
    return given


def reference_share(policy: Policy, patch: Any) -> Any:
    """Whether an error of the reference is small enough."""
    return [
        verified_(runs(policy, lambda choice, share=share: share * (8 / choice.divisions) ** 3), LAST, 0.0).is_known
        for share in around(0.25)
    ]


LAST = Trial(replace(EVERYTHING, divisions=4), Made(SCENE, None), (np.zeros((101, 1)),), 300, None)


def fall(policy: Policy, patch: Any) -> Any:
    """The error of a run that no step changes by less."""
    ledger = runs(policy, lambda choice: float(choice.divisions != 4))
    ledger.twin = ledger.run
    return round(float(verification._known(ledger, replace(EVERYTHING, divisions=8)).own[0]), 6)


def resolving(policy: Policy, omega: float, ratio: float) -> int:
    """Divisions of an explicit reference."""
    ledger = runs(policy)
    ledger.vibrations = lambda choice: SimpleNamespace(omega=np.array([omega]), ratio=np.array([ratio]))
    return verification._resolving(ledger, EVERYTHING)


def unexplained(policy: Policy, patch: Any) -> Any:
    """Whether the step is shortened too, where what is left out explains all but a share of the error."""
    patch.setattr(verification, "selected_model", lambda *a: Selection(EVERYTHING, ONE))

    def divisions(rest: float) -> int:
        ledger = runs(policy, lambda choice: 0.8 * (choice.parts != EVERYTHING.parts))
        final = ledger.run(rigid(EVERYTHING))
        looks = 1, np.array([0.8 + rest])
        return verification._better(ledger, ONE, final, ledger.run(EVERYTHING), effects(1.0), looks).choice.divisions

    return [divisions(rest) for rest in around(0.25)]


# ---- figures: estimates ------------------------------------------------------------------------------------------------


def samples(policy: Policy, patch: Any) -> Any:
    return [contributions._spaced(rows, policy).size for rows in (100, 1000)]


def looks(policy: Policy, patch: Any) -> Any:
    """States looked at of a coordinate of so much effect, and all fifty of the motion."""

    def count(effect: float) -> int:
        patch.setattr(contributions, "_changed", lambda seen, rows, shift, rates: len(rows))
        patch.setattr(
            contributions, "_outputs", lambda seen, n, *a: (np.full((n, 1), effect) if n != 50 else np.zeros((50, 1)),)
        )
        Z, q = np.ones((50, 2, 1)), np.arange(50.0)[:, None]
        return contributions.effects_of(None, OF, SimpleNamespace(record=50), Z, q, q, ONE, policy)[1]

    return [count(effect) for effect in around(0.05)]


def constraint_weight(policy: Policy, patch: Any) -> Any:
    """By how much a frame that a row ties to a mode stays behind: M = 1, one row x + q = 0."""
    place = Layout((1,), (0,), (0,), 8, 7, (-1,))
    row = np.eye(7)[0] + np.eye(7)[6]
    seen = SimpleNamespace(system=SimpleNamespace(layout=place), M=np.eye(7)[None], jacobian=row[None, None])
    return float(f"{1 + followed(seen, np.eye(7)[:, 6:], policy)[0, 0, 0]:.2g}")


def finest_tolerance(policy: Policy, patch: Any) -> Any:
    """Whether an output may be asked for to a share of its range."""
    assembled, refused = assemble(SCENE), []
    for tolerance in around(1e-10):
        try:
            probe(assembled, [Output("rod.b.position.x", tolerance)], policy)
            refused.append(False)
        except InputError:
            refused.append(True)
    return refused


def still(policy: Policy, unit: str, value: float) -> list[bool]:
    """Whether a range counts as none."""
    of, refused = Probe((Output("x", 0.1),), ("x",), ((),), (unit,)), []
    for scale in around(value):
        try:
            limits(of, scale * ONE, policy)
            refused.append(False)
        except InputError:
            refused.append(True)
    return refused


def piece_repeats(policy: Policy, patch: Any) -> Any:
    """Runs of a piece in which modes enter every time."""
    pieces: list[int] = []
    for name, result in {"probe": OF, "_bound": ONE, "_entering": [0], "_entered": None, "_next": None}.items():
        patch.setattr(adaptive, name, lambda *a, result=result: result)
    patch.setattr(adaptive, "assemble", lambda *a, **k: None)
    patch.setattr(adaptive, "_piece", lambda *a: pieces.append(1))
    patch.setattr(adaptive, "_result", lambda *a: len(pieces))
    return adaptive.adaptive_forward(SCENE, [], end=0.1, output_step=0.01, policy=policy)


# ---- figures: report ---------------------------------------------------------------------------------------------------


def found_by(policy: Policy, **more: Any) -> Any:
    """What a search would return, as far as its report is concerned."""
    choice = replace(EVERYTHING, parts=(Part((0,)), Part(())))
    given = {"policy": policy, "limits": ONE, "original": SCENE, "probe": OF, "choice": choice, "frequencies": ()}
    given |= {"new_frames": (), "model_error": ONE}
    return SimpleNamespace(**given | more)


def shown_rows(policy: Policy, patch: Any) -> Any:
    many = effects(*([0.1] * 4), *([0.2] * 3), body=(0, 0, 0, 0, 1, 1, 1))
    return [len(list(report._leading(found_by(policy), many, most=most))) for most in (True, False)]


def needed_stiffening(policy: Policy, patch: Any) -> Any:
    loads = tuple(checks.StiffeningLoad("rod", "spin xx", share) for share in around(1e-4))
    (table,) = report._checks(found_by(policy, stiffening=loads))
    return [row[-1] for row in table.rows]


def vibrations(policy: Policy, patch: Any) -> Any:
    """Frequencies that are shown of a system whose lowest mode is at 1 rad/s, in rad/s."""
    place = Layout((1,), (0,), (0,), 8, 7, (-1,))
    squares = np.array([*around(1e-3), *np.arange(1.0, 99.0)]) ** 2
    system = SimpleNamespace(layout=place, model=SimpleNamespace(bodies=SimpleNamespace(omega2=ONE)))
    assembled = SimpleNamespace(system=system)
    for name in ("evaluator", "evaluated_mass_matrix"):
        patch.setattr(checks, name, lambda *a: np.eye(7))
    patch.setattr(checks, "evaluate", lambda *a: SimpleNamespace(jacobian=np.zeros((1, 7))))
    patch.setattr(checks, "of_coordinates", lambda bodies, table: table)
    patch.setattr(checks, "eigvalsh", lambda *a: squares)
    patch.setattr(checks, "states", lambda trial: (np.zeros((3, 8)), np.zeros((3, 7))))
    choice = Choice((Part((0,)),), "none", "ros3", 1)
    made = Made(None, assembled)
    final = Trial(choice, made, (), 0, SimpleNamespace(time=np.arange(3.0)))
    original = SimpleNamespace(bodies=(SimpleNamespace(model=SimpleNamespace(n=1)),))
    shown = checks.frequencies(final, made, choice, original, policy)
    return [round(2 * np.pi * one.model, 6) for one in shown]


def load_samples(policy: Policy, patch: Any) -> Any:
    """States at which loads are looked at."""
    looked: list[int] = []
    body = replace(SCENE.bodies[0], model=replace(SCENE.bodies[0].model, stiffening=np.zeros((30, 4, 4))))
    system = SimpleNamespace(scene=SimpleNamespace(bodies=(body,)))
    patch.setattr(checks, "evaluator", lambda *a: None)
    patch.setattr(checks, "evaluate", lambda *a: looked.append(1))
    patch.setattr(checks, "loads_at", lambda *a: [np.zeros(30)])
    patch.setattr(checks, "states", lambda trial: (np.zeros((1000, 1)), np.zeros((1000, 1))))
    made = Made(None, SimpleNamespace(system=system))
    checks.stiffening_loads(Trial(EVERYTHING, made, (), 0, SimpleNamespace(time=np.arange(1000.0))), policy)
    return len(looked)


def timing_repeats(policy: Policy, patch: Any) -> Any:
    """Runs of a point of the chart."""
    ran: list[int] = []
    done = SimpleNamespace(attributes={"evaluations": 7})
    patch.setattr(picture, "simulated", lambda *a, **k: ran.append(1) or done)
    patch.setattr(picture, "make", lambda *a: Made(SCENE, None))
    settings = SimpleNamespace(start=0.0, end=1.0, output_step=0.01, stabilisation=None, analysis=Forward())
    picture._point(found_by(policy, settings=settings), EVERYTHING, "all", ONE)
    return len(ran)


def advised(policy: Policy, size: float) -> list[str]:
    """Highest frequency, band and mesh advised for a body of which the first mode stays, and the second would do so much."""
    left = effects(size)
    line = advice._line(found_by(policy, effects=replace(left, mode=left.mode + 1)), 0, SCENE.bodies[0])
    return re.findall(r"(?:up to|at most) (\S+)", line)


@dataclass(frozen=True)
class Figure:
    """What is decided, and what it is with the numbers as they are."""

    of: Callable[[Policy, Any], Any]
    pinned: Any


FIGURES: dict[str, Figure] = {
    "surely_rigid": Figure(surely_rigid, [True, False]),
    "rigid_tried": Figure(rigid_tried, ["ros2", "1 runs"]),
    "rigid_share": Figure(rigid_share, ["ros3", "2 runs"]),
    "nearly_rigid": Figure(nearly_rigid, [False, True, False]),
    "unmoved": Figure(unmoved_, [("x",), ()]),
    "in_plane": Figure(in_plane, [True, False]),
    "modes_share": Figure(two_stage_sizes, [1, 2]),
    "bold_modes_share": Figure(two_stage_sizes, [1, 2]),
    "terms_share": Figure(terms_share, ("I5", "I9")),
    "omitted_share": Figure(omitted_share, [2, 4]),
    "whole_share": Figure(step_limit, [0.75, 0.2]),
    "least_step_share": Figure(step_limit, [0.75, 0.2]),
    "needed_modes": Figure(needed_modes, [False, True]),
    "model_attempts": Figure(model_attempts, 5),
    "more_modes": Figure(more_modes, [3, 60]),
    "stalled": Figure(stalled, [[3, 0, 0, 0], [3, 0, 0, 1]]),
    "caution": Figure(caution, [7, 2, 6]),
    "coarse_tolerance": Figure(coarse_tolerance, [False, True]),
    "two_stages": Figure(lambda policy, patch: directly(policy, SCENE, 1e3), 0.4),
    "two_stages_ringing": Figure(lambda policy, patch: directly(policy, RINGING, 1e3), 0.6),
    "two_stages_reach": Figure(two_stages_reach, [2, 1]),
    "agreement": Figure(lambda policy, patch: of_both(policy, SCENE, *around(0.95)), ["ros2", "none"]),
    "agreement_ringing": Figure(lambda policy, patch: of_both(policy, RINGING, *around(0.5)), ["ros2", "ros3"]),
    "wide_step_share": Figure(lambda policy, patch: [coarse(policy, share) for share in around(0.8)], ["ros3", "none"]),
    "hopeless": Figure(hopeless, [False, True]),
    "far_below": Figure(far_below, ["ros2", "ros3"]),
    "accuracies": Figure(lambda policy, patch: [controlled(policy, 100, one) for one in (1e-2, 2e-3)], [1e-2, 1e-3]),
    "controlled_gain": Figure(lambda policy, patch: [controlled(policy, n, 1.0) for n in (430, 445)], [1e-2, None]),
    "most_divisions": Figure(most_divisions, 4096),
    "step_attempts": Figure(step_attempts, 10),
    "error_margin": Figure(error_margin, 12),
    "rung": Figure(rung, [3, 3, 3]),
    "fewer_divisions": Figure(fewer_divisions, [5, 10]),
    "nearest_step": Figure(near_steps, [True, False, False, True]),
    "farthest_step": Figure(near_steps, [True, False, False, True]),
    "least_wide_pairs": Figure(least_wide_pairs, [False, True]),
    "first_part": Figure(first_part, [12]),
    "finer_damped": Figure(lambda policy, patch: [finer(policy, SCENE, d, False) for d in (5, 6)], [None, 6]),
    "finer_damped_cost": Figure(lambda policy, patch: finer(policy, SCENE, 40, False, rigid(EVERYTHING)), 18),
    "finer_ringing": Figure(lambda policy, patch: [finer(policy, RINGING, d, False) for d in (1, 2)], [None, 2]),
    "finer_ringing_cost": Figure(lambda policy, patch: finer(policy, RINGING, 40, False, rigid(EVERYTHING)), 24),
    "finer_verified": Figure(lambda policy, patch: [finer(policy, SCENE, d, True) for d in (3, 4)], [None, 4]),
    "unasked_verification": Figure(unasked_verification, [True, False]),
    "verification_attempts": Figure(verification_attempts, 3),
    "unexplained": Figure(unexplained, [1, 2]),
    "asked_verification": Figure(asked_verification, [6e7, 5e6]),
    "reference_share": Figure(reference_share, [True, False]),
    "fall": Figure(fall, 9.0),
    "resolved": Figure(lambda policy, patch: resolving(policy, 2e3, 1.0), 34),
    "lost": Figure(lambda policy, patch: resolving(policy, 1e5, 0.0), 4709),
    "lost_damping": Figure(lambda policy, patch: resolving(policy, 1e5, 0.001), 2683),
    "least_samples": Figure(samples, [24, 125]),
    "rows_per_sample": Figure(samples, [24, 125]),
    "remainder": Figure(remainder, [True, False]),
    "looks_at_effect": Figure(looks, [51, 54]),
    "minor_effect": Figure(looks, [51, 54]),
    "constraint_weight": Figure(constraint_weight, 1e-10),
    "finest_tolerance": Figure(finest_tolerance, [True, False]),
    "still": Figure(lambda policy, patch: still(policy, "m", 1e-12), [True, False]),
    "still_stress": Figure(lambda policy, patch: still(policy, "Pa", 1e-3), [True, False]),
    "piece_repeats": Figure(piece_repeats, 4),
    "shown_rows": Figure(shown_rows, [6, 3]),
    "shown_frequencies": Figure(vibrations, [0.00103, 1.0, 2.0, 3.0, 4.0, 5.0]),
    "rigid_frequency": Figure(vibrations, [0.00103, 1.0, 2.0, 3.0, 4.0, 5.0]),
    "load_samples": Figure(load_samples, 24),
    "needed_stiffening": Figure(needed_stiffening, ["could go", "needed"]),
    "timing_repeats": Figure(timing_repeats, 3),
    "alone": Figure(
        lambda policy, patch: [advice.tells_apart(found_by(policy, effects=effects(size))) for size in around(3.0)],
        [True, False],
    ),
    "advised_effect": Figure(
        lambda policy, patch: [advised(policy, size)[0] for size in around(0.02)], ["6.366", "12.73"]
    ),
    "band": Figure(lambda policy, patch: advised(policy, 1.0), ["12.73", "19.1", "0.051"]),
    "elements_per_wave": Figure(lambda policy, patch: advised(policy, 1.0), ["12.73", "19.1", "0.051"]),
}


def moved(value: Any, factor: float) -> Any:
    if isinstance(value, tuple):
        return tuple(factor * one for one in value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


MOVES = {"nearest_step": (10.0, 0.9), "fall": (0.5, 0.1)}  # equal steps tell no error, nor do rising ones


def test_every_number_has_a_figure():
    assert FIGURES.keys() == {one.name for one in fields(Policy)} - {"cost"}


@pytest.mark.parametrize("name", FIGURES)
def test_a_number_that_is_moved_changes_what_is_decided(name, monkeypatch):
    figure = FIGURES[name]
    assert figure.of(DEFAULT, monkeypatch) == figure.pinned
    for factor in MOVES.get(name, (10.0, 0.1)):
        other = replace(DEFAULT, **{name: moved(getattr(DEFAULT, name), factor)})
        assert figure.of(other, monkeypatch) != figure.pinned, f"{name} times {factor}"


# ---- the cost model -----------------------------------------------------------------------------------------------------


def costs(model: CostModel) -> list[float]:
    """Of evaluations of rigid, flexible and stiffened bodies in space and in the plane, of a row, and of runs."""
    flexible = tuple(Part((0, 1), dropped) for dropped in ((), ("stiffening",), ("I5", "I9")))
    choices = [
        replace(EVERYTHING, parts=(part,), plane=plane) for part in (Part(()), *flexible) for plane in ("none", "z")
    ]
    found = [per_evaluation(choice, model) for choice in choices]
    found += [per_row(choices[0], model), of_run(choices[0], 10, model), of_evaluations(choices[0], 100, 10, model)]
    return [round(one, 6) for one in found]


PINNED = [0.98, 0.69, 1.796, 1.216, 1.38, 0.906, 1.792, 1.208, 8.918, 89.18, 126.42]


def test_the_cost_model_is_what_the_benchmark_has_fitted():
    assert costs(CostModel()) == PINNED


@pytest.mark.parametrize("name", [one.name for one in fields(CostModel)])
def test_a_constant_of_the_cost_model_that_is_moved_changes_what_runs_cost(name):
    value = getattr(CostModel(), name)
    if not isinstance(value, BodyCost):
        assert costs(replace(CostModel(), **{name: 10 * value})) != PINNED
        return
    for one in fields(BodyCost):
        number = getattr(value, one.name)
        other = replace(value, **{one.name: 10 * number if number else 0.1})
        assert costs(replace(CostModel(), **{name: other})) != PINNED, f"{name}.{one.name}"


# ---- in the open --------------------------------------------------------------------------------------------------------


def test_every_number_says_what_it_means_in_which_unit_and_where_it_is_from():
    listed = {name: words for name, _, *words in described()}
    assert len(listed) == len(fields(Policy)) + len(fields(CostModel)) - 1
    assert all(len(word) >= 2 or word == "1" for words in listed.values() for word in words)


def test_the_documentation_lists_every_number_as_it_is():
    text = (ROOT / "docs" / "economy.md").read_text(encoding="utf-8")
    for name, value, unit, meaning, source in described():
        shown = "per body, see `BodyCost`" if isinstance(value, BodyCost) else f"{value}"
        assert f"| `{name}` | {shown} | {unit} | {meaning} | {source} |" in text


FACTS = {"STAGES"}  # evaluations that a step of a method takes


def numbers_of(path: Path) -> list[str]:
    """Names that a module binds to numbers, or to tuples and tables of numbers."""
    found = []
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            inner = [one for one in ast.walk(node.value) if isinstance(one, ast.Constant)]
            if any(isinstance(one.value, int | float) and not isinstance(one.value, bool) for one in inner):
                found += [ast.unparse(one) for one in (node.targets if isinstance(node, ast.Assign) else [node.target])]
    return found


def test_no_number_stands_in_another_module():
    modules = sorted((ROOT / "ffr_dyn" / "economy").glob("*.py"))
    found = {path.stem: set(numbers_of(path)) - FACTS for path in modules if path.stem != "policy"}
    assert {name: numbers for name, numbers in found.items() if numbers} == {}
    assert {"SPACE", "PLANE"} <= set(numbers_of(ROOT / "ffr_dyn" / "economy" / "policy.py"))
