"""A run knows its error, and finds the step for an accuracy."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.registry import summary
from ffr_dyn.analyses.trials.runs import Runs
from ffr_dyn.consistency.step_error import largest_difference, of_the_range, ranges
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4, ROS2, ROS3, AdaptiveROS3, Within, stepped, tolerances
from ffr_dyn.integrators.stabilisation import Drifting, Projection
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError

CLOSED = Projection(1e-8 * 1e-3)  # as far as a step that is found closes its constraints
SPAN = {"end": 0.5, "output_step": 0.01}
EVENT = Event("up", "hinge.angle", value=0.1)


def swinging(damping: float, stiffer: float = 1.0) -> Scene:
    """A flexible body on a hinge, released with a spin: it begins with a shock."""
    soft = cloud(4, seed=1)
    body = Body("rod", replace(soft, omega2=stiffer**2 * soft.omega2), omega_bar=(0.0, 0.0, 6.0), damping=damping)
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a", axis=(0, 0, 1))
    return Scene((body,), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0.0, -9.81, 0.0))


def driven() -> Scene:
    scene = swinging(0.02)
    still = replace(scene.bodies[0], omega_bar=(0.0, 0.0, 0.0))
    return replace(scene, bodies=(still,), drivers=(Driver("motor", "hinge", formula("0.5*(1 - cos(3*t))")),))


@pytest.fixture(scope="module")
def truth():
    made = {}

    def of(scene, outputs=("default",)):
        key = id(scene.drivers), scene.bodies[0].damping.tobytes()
        if key not in made:
            made[key] = integrate(
                scene, **SPAN, method=RK4(0.01 / 2048), stabilisation=Projection(1e-12), outputs=outputs
            )
        return made[key]

    return of


@pytest.mark.parametrize("method", [ROS2(1e-3), ROS2(2.5e-4), ROS3(1e-3), RK4(2e-3)])
@pytest.mark.parametrize("scene", [swinging(0.0), swinging(0.02), driven()], ids=["undamped", "damped", "driven"])
def test_the_error_that_is_told_is_the_true_one(scene, method, truth):
    found, true = forward(scene, **SPAN, method=method), truth(scene)
    scales = ranges(found)
    pairs = {
        name: told / largest_difference(found[name], true[name])
        for name, (told, share) in found.attributes["errors"].items()
        if largest_difference(found[name], true[name]) > 1e-6 * scales[name]
    }
    assert pairs
    assert min(pairs.values()) > 0.2
    assert np.mean([0.3 <= pair <= 5 for pair in pairs.values()]) >= 0.8


def test_what_rings_is_told_with_its_price():
    found = forward(swinging(0.0, stiffer=100.0), **SPAN, method=ROS2(1e-3))
    told = [note for note in found.attributes["notes"] if "does not resolve" in note]
    assert len(told) == 1
    assert "Hz" in told[0]
    assert "rk4" in told[0]
    assert 'begin = "quasi-static"' in told[0]


def test_an_error_beyond_the_range_is_told_in_ranges():
    """Not in thousands of per cent, and without advice that has been followed."""
    found = forward(swinging(0.0, stiffer=100.0), **SPAN, method=ROS2(1e-3), begin="quasi-static")
    assert not any('begin = "quasi-static"' in note for note in found.attributes["notes"])
    assert of_the_range(0.015) == "1.5 % of the range"
    assert of_the_range(412.3) == "410 times the range"


def test_without_a_step_the_accuracy_is_kept(truth):
    scene = driven()
    found, true = forward(scene, **SPAN), truth(scene)
    scales = ranges(found)
    for name in ("rod.b.position", "hinge.angle", "rod.p", "hinge.force", "rod.b.displacement"):
        assert largest_difference(found[name], true[name]) <= 1.2e-3 * scales[name], name
    finer = forward(scene, **SPAN, method=Within(1e-5))
    assert finer.attributes["step"] < found.attributes["step"]
    assert largest_difference(finer["rod.b.position"], true["rod.b.position"]) <= 1.2e-5 * scales["rod.b.position"]


def test_the_run_of_a_found_step_is_that_of_the_step_given():
    found = forward(driven(), **SPAN)
    again = integrate(driven(), **SPAN, method=ROS2(found.attributes["step"]), stabilisation=CLOSED)
    assert all(found[name].tobytes() == again[name].tobytes() for name in again.quantities)


def test_forces_that_ring_do_not_hold_up_the_positions():
    found = forward(swinging(0.0, stiffer=100.0), **SPAN)
    errors = found.attributes["errors"]
    assert errors["rod.b.position"][1] <= 1e-3
    assert errors["hinge.force"][1] > 1e-3
    assert found.attributes["step"] >= SPAN["output_step"] / 1024


def test_the_error_is_in_the_file_and_in_the_summary(tmp_path):
    path = tmp_path / "run.nc"
    found = forward(driven(), **SPAN, path=path)
    kept = load_result(path)
    assert kept.attributes["errors"] == found.attributes["errors"]
    assert any(line.startswith("accuracy     step: within") for line in summary(kept.attributes))
    assert not list(tmp_path.glob("*.attributes"))


class StoppedError(Exception):
    pass


def stopped(scene: Scene, path, trial: int, **settings) -> float:
    """The step of the trial in which the search for a step was stopped, by its number."""
    reached = [0.0]

    def progress(time):
        reached.append(time)
        if sum(after < before for before, after in pairwise(reached)) >= trial:
            raise StoppedError

    with pytest.raises(StoppedError):
        forward(scene, **SPAN | settings, path=path, progress=progress)
    return load_result(path).attributes["step"]


def assert_same_run(found, whole):
    assert {name: found.attributes.get(name) for name in whole.attributes} == whole.attributes
    assert all(found[name].tobytes() == quantity.values.tobytes() for name, quantity in whole.quantities.items())


@pytest.mark.parametrize("trial", [0, 1])
def test_a_search_that_was_stopped_goes_on_to_the_same_run(tmp_path, trial):
    """With the same step, errors and notes: what rings is known by two trials, one of them before the file's."""
    scene, path = swinging(0.0, stiffer=100.0), tmp_path / "run.nc"
    whole = forward(scene, **SPAN)
    step = stopped(scene, path, trial)
    assert (step == whole.attributes["step"]) == (trial == 1)
    assert_same_run(forward(scene, **SPAN, resume=path), whole)
    assert_same_run(load_result(path), whole)


def test_a_search_to_a_later_end_is_that_of_the_long_run(tmp_path):
    path = tmp_path / "run.nc"
    forward(driven(), **SPAN | {"end": 0.25}, path=path)
    whole = forward(driven(), **SPAN)
    assert_same_run(forward(driven(), **SPAN, resume=path), whole)
    assert_same_run(forward(driven(), **SPAN, resume=path), whole)  # nothing is left to do


def test_a_step_that_was_given_is_not_one_that_was_found(tmp_path):
    path, span = tmp_path / "run.nc", SPAN | {"end": 0.1}
    forward(driven(), **span, method=ROS2(5e-3), path=path)
    assert_same_run(forward(driven(), **span, resume=path), forward(driven(), **span))


def test_an_accuracy_is_kept_where_the_stabilisation_does_not_tell_it(tmp_path):
    path, how = tmp_path / "run.nc", SPAN | {"end": 0.1, "stabilisation": Drifting()}
    forward(driven(), **how, method=Within(1e-2), path=path)
    finer = how | {"method": Within(1e-4)}
    assert_same_run(forward(driven(), **finer, resume=path), forward(driven(), **finer))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"scene": swinging(0.03)}, "another scene or of other settings"),
        ({"end": 0.01}, "s beyond this end already"),
        ({"events": (EVENT,)}, "another scene or of other settings"),
    ],
)
def test_a_search_leaves_a_file_that_it_does_not_continue(tmp_path, change, text):
    path = tmp_path / "run.nc"
    forward(driven(), **SPAN | {"end": 0.02}, path=path)
    before = path.read_bytes()
    with pytest.raises(InputError, match=text):
        forward(**{"scene": driven()} | SPAN | change, resume=path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("method", ["ros2", "ros3"])
def test_a_search_costs_few_final_runs_and_says_how_many(method):
    found = forward(driven(), **SPAN, method=Within(1e-3, method))
    alone = forward(driven(), **SPAN, method=Within(1e-3, method), check=False)
    assert 2.0 < found.attributes["effort"] == alone.attributes["effort"] < 4.0
    step = found.attributes["step"]
    given = forward(driven(), **SPAN, method=stepped(Within(1e-3, method), step), check=True)
    assert 2.0 < given.attributes["effort"] < 3.5
    assert "effort" not in forward(driven(), **SPAN, method=ROS2(1e-3), check=False).attributes


def test_an_error_that_leaves_out_what_steps_damp_says_so(monkeypatch):
    """As where the twin, which damps nothing, comes to no end."""

    def failing(*_):
        raise ComputationError("the energy has grown")

    monkeypatch.setattr("ffr_dyn.analyses.trials.errors._twin", failing)
    found = forward(swinging(0.02), **SPAN, method=ROS2(1e-3), check=True)
    assert found.attributes["errors"]
    assert sum("leaves out vibration" in note for note in found.attributes["notes"]) == 1


def test_a_check_can_be_left_out_or_asked_for():
    assert forward(driven(), **SPAN, method=ROS2(1e-3), check=False).attributes["errors"] == {}
    assert forward(driven(), **SPAN, method=ROS2(1e-3), check=True).attributes["errors"]


@pytest.mark.slow
def test_a_method_that_chooses_its_steps_knows_its_error(truth):
    found = forward(driven(), **SPAN, method=AdaptiveROS3(tolerances(1e-4)))
    true = truth(driven())
    told = found.attributes["errors"]["rod.b.position"][0]
    assert 0.2 <= told / largest_difference(found["rod.b.position"], true["rod.b.position"]) <= 20


def test_an_accuracy_that_means_nothing_is_refused():
    for accuracy in (0.0, -1.0, 2.0, np.nan):
        with pytest.raises(InputError, match="accuracy"):
            Within(accuracy)
    with pytest.raises(InputError, match="chooses its steps"):
        forward(driven(), **SPAN, method=Within(1e-3, "dopri5"))


def test_a_step_that_cannot_be_found_is_the_failure_of_the_run():
    scene = replace(driven(), loads=(Load("push", "rod.b", force=(formula("sqrt(0.3 - t)"), 0.0, 0.0)),))
    with pytest.raises(ComputationError, match=r"t = 0\.3"):
        forward(scene, **SPAN)


def test_an_error_that_no_run_tells_is_told_to_be_unknown(monkeypatch):
    """As of iterations that converge with one step and with no other."""
    only, run = ROS2(1e-3), Runs.run

    def failing(self, method, **more):
        if method != only:
            raise ComputationError("does not converge")
        return run(self, method, **more)

    monkeypatch.setattr(Runs, "run", failing)
    result = forward(swinging(0.0), **SPAN, method=only, check=True)
    assert result.attributes["accuracy"] == "step: not known"
    assert any("runs that would tell the error of the steps have failed" in note for note in result.attributes["notes"])
    unasked = forward(swinging(0.0), **SPAN, method=only, check=False)
    assert unasked.attributes["accuracy"] == "step: not known"
    assert not any("failed" in note for note in unasked.attributes["notes"])


@pytest.mark.parametrize(
    "span", [{"output_step": 0.1, "method": ROS2(7.8e-4)}, {"output_step": 0.03, "method": ROS2(1e-2)}]
)
def test_a_step_that_a_refusal_names_is_taken(span):
    """It was rounded to six digits, and refused again by the same words."""
    with pytest.raises(InputError) as refused:
        forward(swinging(0.0), end=0.1, **span)
    named = re.search(r"try a step of (?P<step>\S+)|try an output step of (?P<row>[^,]+)", str(refused.value))
    row = float(named["row"] or span["output_step"])
    result = forward(swinging(0.0), end=0.1, output_step=row, method=ROS2(float(named["step"] or row / 3)), check=False)
    assert result.time[-1] == pytest.approx(0.1)
