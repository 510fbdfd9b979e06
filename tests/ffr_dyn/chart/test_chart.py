"""Work-precision diagrams: orders seen, references verified, failures kept, files written, bad input refused."""

from __future__ import annotations

import csv
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation
from PIL import Image
from places import ROOT
from synthetic import cloud

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.kinematic import Kinematic
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.chart.diagram import COSTS, Diagram, Lost, Point, measures_of, quantities_of, run_variants, work_precision
from ffr_dyn.chart.draw import FEW, draw_chart, ticks_between_powers
from ffr_dyn.chart.meaning import check_meaning
from ffr_dyn.chart.measures import Deflection, measure_of
from ffr_dyn.chart.page import page, write_page
from ffr_dyn.chart.pareto import pareto_front
from ffr_dyn.chart.reference import reference
from ffr_dyn.chart.runner import Failure, Here, Job, Outcome, Span, default_workers, perform, pool
from ffr_dyn.chart.table import headings, write_table
from ffr_dyn.chart.variants import FULL, Model, Variant, grid, models_of
from ffr_dyn.cli import cli
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import save_scene
from ffr_prep.body import rigid_body, truncated
from ffr_prep.common.errors import ComputationError, InputError

SPAN = Span(0.4, 0.05)


def swinging(n: int = 5) -> Scene:
    """A flexible body on a hinge, kept in space so that all its modes count."""
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a")
    body = cloud(n, stiffness=20.0)
    return Scene(
        (Body("rod", body),), (hinge,), ground={"O": body.interfaces[0].position}, gravity=(0, -9.81, 0),
        name="swing", plane="none",
    )  # fmt: skip


def rigid() -> Scene:
    model = rigid_body(
        "arm", mass=1.0, inertia=np.full(3, 0.1), centre_of_mass=(0.5, 0, 0), points={"a": (0, 0, 0), "b": (1, 0, 0)}
    )
    joint = Joint("hinge", "revolute", "ground.O", "arm.a")
    return Scene((Body("arm", model),), (joint,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    scene = swinging()
    measures = measures_of(scene, ["position:rod.b", "deflection:rod", "energy", "constraint"])
    methods = {"rk4": None, "ros2": (0.0125, 0.00625, 0.003125), "ros3": (0.0125, 0.00625, 0.003125)}
    models = models_of(scene, (None, 3), ((), ("I5", "I9")))
    return work_precision(scene, SPAN, Here(), measures=measures, methods=methods, models=models, repeats=1)


@pytest.fixture(scope="module")
def small(diagram) -> Diagram:
    """One measure, one model."""
    few = tuple(point for point in diagram.points if point.model == FULL.label)
    return replace(diagram, measures=diagram.measures[:1], points=few)


def line(found: Diagram, method: str, model: str) -> list[Point]:
    return [point for point in found.points if (point.series, point.model) == (method, model)]


# ---- what a diagram shows -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("ros2", 2), ("ros3", 3)])
def test_errors_fall_with_the_order_of_the_method(diagram, method, order):
    errors = [point.errors["position:rod.b"] for point in line(diagram, method, FULL.label)]
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(order, abs=0.35)


def test_a_cheaper_model_has_an_error_that_no_step_removes(diagram):
    for method in ("rk4", "ros3"):
        full, few = line(diagram, method, FULL.label)[-1], line(diagram, method, "3 modes")[-1]
        assert few.errors["deflection:rod"] > 100 * full.errors["deflection:rod"]
        finest = [point.errors["deflection:rod"] for point in line(diagram, method, "3 modes")[-2:]]
        assert finest[0] == pytest.approx(finest[1], rel=0.05)


def test_dropped_terms_are_an_error_too(diagram):
    dropped = line(diagram, "ros3", "without I5 I9")[-1]
    assert dropped.errors["position:rod.b"] > 10 * line(diagram, "ros3", FULL.label)[-1].errors["position:rod.b"]


def test_the_reference_is_better_than_its_variants_and_says_how_good_it_is(diagram):
    found = diagram.reference
    assert found.variant.method != found.check.method
    for name in ("position:rod.b", "deflection:rod", "energy"):
        assert 0 < found.floors[name] < 1e-5 * found.scales[name]
        assert f"{name}: reference right to about {found.floors[name]:.1e}" in " ".join(found.story)
    assert (found.values["constraint"] == 0).all()
    assert found.floors["constraint"] == 0


def test_a_chosen_ladder_halves_from_the_output_step_or_from_stability():
    scene = swinging()
    steps = [v.number for v in grid(scene, [FULL], {"ros2": None}, 0.05)]
    np.testing.assert_allclose(steps, 0.05 / 2.0 ** np.arange(7))
    explicit = [v.number for v in grid(scene, [FULL], {"rk4": None}, 0.05)]
    assert explicit[0] * 20.0 * 5 <= 1.5
    np.testing.assert_allclose(np.divide(0.05, explicit), np.round(np.divide(0.05, explicit)))
    few = [v.number for v in grid(scene, [Model("2", 2)], {"rk4": None}, 0.05)]
    assert few[0] > explicit[0]


def test_times_are_medians_within_their_spread_and_evaluations_are_counted(diagram):
    for point in diagram.points:
        for median, least, most in (point.cpu, point.wall):
            assert 0 < least <= median <= most
    ros2 = line(diagram, "ros2", FULL.label)
    assert ros2[1].evaluations == pytest.approx(2 * ros2[0].evaluations, rel=0.1)


def test_the_stopwatch_changes_nothing():
    plain = integrate(swinging(), end=0.1, output_step=0.05, method=ROS2(0.01))
    watch = Stopwatch()
    found = integrate(swinging(), end=0.1, output_step=0.05, method=ROS2(0.01), stopwatch=watch)
    np.testing.assert_array_equal(found["rod.q"], plain["rod.q"])
    assert watch.wall >= watch.last > 0
    assert watch.cpu > 0


# ---- the front ------------------------------------------------------------------------------------------------------


def test_the_front_is_what_nothing_beats():
    rng = np.random.default_rng(5)
    costs, errors = rng.integers(0, 12, 60).astype(float), rng.integers(0, 12, 60).astype(float)
    front = pareto_front(costs, errors)
    beaten = {
        k for k in range(60) for j in range(60)
        if costs[j] <= costs[k] and errors[j] <= errors[k] and (costs[j], errors[j]) != (costs[k], errors[k])
    }  # fmt: skip
    assert {(costs[k], errors[k]) for k in front} == {(costs[k], errors[k]) for k in range(60) if k not in beaten}
    assert list(costs[list(front)]) == sorted(set(costs[list(front)]))


def test_a_front_leaves_out_what_is_no_number():
    assert pareto_front([1.0, float("nan"), 2.0], [3.0, 0.0, float("nan")]) == (0,)
    assert pareto_front([], []) == ()


def test_errors_below_the_floor_are_equal(diagram):
    name = "position:rod.b"
    point = diagram.points[0]
    floor = diagram.reference.floors[name]
    two = [
        replace(point, label=label, cpu=(cost,) * 3, errors={**point.errors, name: error})
        for label, cost, error in (("cheap", 1.0, 0.9 * floor), ("dear", 2.0, 0.1 * floor))
    ]
    assert [p.label for p in replace(diagram, points=tuple(two)).front(name, "cpu")] == ["cheap"]


# ---- measures -------------------------------------------------------------------------------------------------------


def test_every_measure_reads_its_history():
    scene = swinging()
    result = integrate(scene, end=0.1, output_step=0.05, method=RK4(0.005), outputs=("*",))
    quantities = quantities_of(scene)

    def values(text: str) -> np.ndarray:
        return measure_of(text, scene, quantities).values(result)

    np.testing.assert_array_equal(values("position:rod.b"), result["rod.b.position"])
    np.testing.assert_array_equal(values("reaction:hinge"), result["hinge.force"])
    np.testing.assert_array_equal(values("moment:hinge"), result["hinge.moment"])
    for part in ("velocity.x", "velocity.y", "position.z"):
        np.testing.assert_array_equal(values(f"rod.b.{part}"), result[f"rod.b.{part}"][:, None])
    np.testing.assert_array_equal(values("deflection:rod.b"), result["rod.b.displacement"])
    u = np.einsum("pcj,tj->tpc", scene.bodies[0].model.surface.Phi, result["rod.q"])
    whole = np.sqrt((values("deflection:rod") ** 2).sum(1))
    np.testing.assert_allclose(whole, np.sqrt((u**2).sum((1, 2)) / u.shape[1]), rtol=1e-12)


def test_a_rigid_rotation_of_the_deflection_is_no_deflection_from_the_chord():
    """u = theta x r at all three points: the chord turns along."""
    at = {"a": np.zeros(3), "m": np.array([0.4, 0, 0]), "b": np.array([1.0, 0, 0])}
    turn = np.array([0, 0, 1e-3])
    result = {f"rod.{k}.displacement": np.cross(turn, r)[None] for k, r in at.items()}
    fake = type(
        "Histories", (), {"quantities": result, "__getitem__": lambda self, k: result[k], "time": np.zeros(1)}
    )()
    assert np.abs(Deflection("d", "rod.m", ("rod.a", "rod.b"), 0.4).values(fake)).max() < 1e-18
    scene = swinging()
    ends = [scene.bodies[0].model.interface(name).position for name in "abc"]
    share = (ends[1] - ends[0]) @ (ends[2] - ends[0]) / ((ends[2] - ends[0]) @ (ends[2] - ends[0]))
    assert measure_of("deflection:rod.b/a,c", scene, {}).share == pytest.approx(share)


def test_a_body_that_became_rigid_has_no_deflection():
    scene = swinging()
    measures = measures_of(scene, ["deflection:rod", "deflection:rod.b"])
    outcome = perform(Job(scene, Variant("ros2", 0.0125, Model("rigid", 0)), SPAN, measures, repeats=1))
    assert isinstance(outcome, Outcome)
    assert all((values == 0).all() for values in outcome.values.values())


def test_a_quantity_that_a_rigid_body_does_not_have_is_zero():
    scene = swinging()
    measures = measures_of(scene, ["rod.b.displacement.y"])
    outcome = perform(Job(scene, Variant("ros2", 0.0125, Model("rigid", 0)), SPAN, measures, repeats=1))
    assert isinstance(outcome, Outcome)
    assert (outcome.values["rod.b.displacement.y"] == 0).all()


@pytest.mark.parametrize("part", ["", ".2"])
@pytest.mark.parametrize("model", [Model("rigid", 0), Model("1 mode", 1), Model("3 modes", 3)])
def test_elastic_coordinates_of_other_models_are_not_compared(part, model):
    scene = swinging()
    measures = measures_of(scene, [f"rod.q{part}"])
    with pytest.raises(InputError, match=f"'{model.label}' has others; measure what they do, as by deflection:rod"):
        work_precision(scene, SPAN, Here(), measures=measures, models=(FULL, model))
    check_meaning(scene, measures, (FULL, Model("without I5", drop=("I5",))))


@pytest.mark.parametrize("text", ["deflection:rod", "deflection:rod.b", "rod.b.displacement.x", "rod.R"])
def test_what_is_seen_from_other_frames_is_not_compared(text):
    """A body in a frame at its point a, and the same in its mean-axis frame."""
    scene, own = swinging(), {"reference": {"type": "Fixed", "at": "a"}}
    fixed, mean = (
        replace(scene.bodies[0].model, provenance=kind) for kind in (own, {"reference": {"type": "MeanAxis"}})
    )
    scene = replace(scene, bodies=(replace(scene.bodies[0], model=fixed),))
    models = (FULL, Model("2 modes", 2), Model("rigid", 0))
    check_meaning(scene, measures_of(scene, [text]), models)
    with pytest.raises(InputError, match="seen from the frame of body 'rod', and 'mean' has another frame"):
        check_meaning(scene, measures_of(scene, [text]), (*models, Model("mean", bodies={"rod": mean})))
    others = measures_of(scene, ["position:rod.b", "deflection:rod.b/a,c", "energy"])
    check_meaning(scene, others, (*models, Model("mean", bodies={"rod": mean})))


@pytest.mark.parametrize("text", ["deflection:rod", "deflection:rod.b/a,c", "rod.b.displacement", "rod.R", "rod.q"])
def test_what_is_of_a_body_is_not_compared_with_its_parts(text):
    """Parts have frames and coordinates of their own; a deflection of the whole would be taken for zero."""
    scene = swinging()
    whole = scene.bodies[0].model
    a, b, c = whole.interfaces
    first = replace(whole, interfaces=(a, replace(c, name="cut_1_a")))
    second = replace(whole, interfaces=(replace(c, name="cut_1_b"), b, c))
    both = replace(whole, mass=2 * whole.mass, parts=(first, second))
    models = (FULL, Model("parts", bodies={"rod": both}))
    check_meaning(scene, measures_of(scene, ["position:rod.b", "reaction:hinge", "rod.b.velocity.x"]), models)
    with pytest.raises(InputError, match="in 'parts' the body is in parts"):
        check_meaning(scene, measures_of(scene, [text]), models)


def test_models_of_one_label_are_refused():
    scene = swinging()
    with pytest.raises(InputError, match="2 models with the label 'full model'"):
        work_precision(scene, SPAN, Here(), models=(FULL, Model(modes=2)))


def test_runs_that_an_event_ends_are_compared_up_to_there():
    scene = rigid()
    low = Event("low", "arm.b.position.y", -0.6, direction="falling", stop=True)
    told: list[str] = []
    how = {"methods": {"rk4": (0.01,)}, "measures": measures_of(scene, ["position:arm.b"]), "repeats": 1}
    found = work_precision(scene, Span(1.0, 0.05), Here(), events=(low,), tell=told.append, **how)
    heights = found.reference.values["position:arm.b"][:, 1]
    assert len(heights) == 1 + int(forward(scene, end=1.0, output_step=0.05, events=(low,)).time[-1] / 0.05)
    assert heights.min() > -0.6
    assert told[0].startswith("an event ends the run")
    late = replace(low, value=-2.0)
    assert (
        len(work_precision(scene, Span(1.0, 0.05), Here(), events=(late,), **how).reference.values["position:arm.b"])
        == 21
    )


def test_a_step_that_is_named_twice_is_run_once():
    assert [v.number for v in grid(swinging(), [FULL], {"ros2": (0.1, 0.05, 0.1)}, 0.1)] == [0.1, 0.05]


@pytest.mark.parametrize("text", ["position:arm.a", "arm.v"])
def test_what_moves_by_rounding_alone_is_no_reason_for_finer_steps(text):
    """The end of an arm on its hinge stays where it is, but for rounding."""
    scene = replace(rigid(), plane="none")
    texts = ["position:arm.b", text]
    found = reference(scene, SPAN, measures_of(scene, texts), Projection(), Here(), limit=1.0, wanted=1e-5)
    assert len([line for line in found.story if "from twice the step" in line]) < 12
    assert all(found.floors[name] <= 1e-5 * found.scales[name] for name in found.floors)


def test_the_scale_of_what_hardly_moves_is_a_thousandth_of_its_kind():
    scene = swinging()
    measures = measures_of(scene, ["rod.a.velocity", "rod.b.velocity", "rod.b.velocity.x", "constraint"])
    outcome = perform(Job(scene, Variant("ros2", 0.0125), SPAN, measures, repeats=1))
    still, moves, part, violation = outcome.scales.values()
    assert 0.5e-3 < still / moves < 2e-3
    assert 1e-2 < part / moves <= 1
    assert violation == 0


def test_default_measures_follow_the_scene():
    assert [m.name for m in measures_of(swinging(), ())] == ["position:rod.c", "deflection:rod"]
    assert [m.name for m in measures_of(rigid(), ())] == ["position:arm.b"]


# ---- failures -------------------------------------------------------------------------------------------------------


def test_a_variant_that_fails_is_kept_with_its_reason_and_stops_nothing(tmp_path):
    scene = swinging()
    measures = measures_of(scene, ["position:rod.b"])
    methods = {"rk4": (0.05, 0.0125), "ros2": (0.03, 0.0125)}
    found = work_precision(scene, SPAN, Here(), measures=measures, methods=methods, repeats=1)
    assert [point.label for point in found.points] == [
        "rk4, step 0.0125 s, full model",
        "ros2, step 0.0125 s, full model",
    ]
    assert [lost.number for lost in found.lost] == [0.05, 0.03]
    assert "unstable" in found.lost[0].reason
    assert "not a multiple of the step" in found.lost[1].reason
    rows = list(csv.DictReader(write_table(found, tmp_path / "t.csv").open(encoding="utf-8")))
    assert [row["status"] for row in rows] == ["done", "done", "failed", "failed"]
    assert rows[2]["reason"] == found.lost[0].reason


def test_a_run_that_takes_too_long_says_how_far_it_got():
    scene = swinging()
    job = Job(scene, Variant("rk4", 1e-4), SPAN, measures_of(scene, ()), repeats=1, limit=1e-9)
    outcome = perform(job)
    assert isinstance(outcome, Failure)
    assert re.search(r"took longer than 1e-09 s; it had reached t = 0\.4 s", outcome.reason)


def flaky(marker: str) -> str:
    """Fails once."""
    path = Path(marker)
    if not path.exists():
        path.touch()
        raise MemoryError("no memory for the moment")
    return "done"


def hopeless(_: str) -> str:
    raise MemoryError("never enough")


def test_what_fails_unforeseen_is_tried_again(tmp_path):
    assert list(Here().results(flaky, [str(tmp_path / "m")])) == [(0, "done")]
    assert list(Here().results(hopeless, ["x"])) == [(0, Failure("MemoryError: never enough"))]


def test_no_reference_without_agreement():
    """Not a single run is finished within the limit."""
    scene = swinging()
    with pytest.raises(ComputationError, match=r"no reference: .* took longer than"):
        reference(scene, SPAN, measures_of(scene, ()), Projection(), Here(), limit=1e-9)


def test_a_reference_of_methods_that_disagree_has_a_wide_band():
    """Stand-ins for the runs of two methods, converged each, but apart."""
    scene = swinging()
    measures = measures_of(scene, ["position:rod.b"])

    class Apart:
        def results(self, function, items):
            for k, job in enumerate(items):
                value = 1.0 if job.variant.method == "rk4" else 1.5
                yield k, Outcome({"position:rod.b": np.full((9, 3), value)}, {"position:rod.b": 1.0}, (0.1,), (0.1,), 1)

    found = reference(scene, SPAN, measures, Projection(), Apart())
    assert found.floors["position:rod.b"] == pytest.approx(0.5 * 3**0.5)
    assert any("a poor reference" in line for line in found.story)


def test_a_reference_that_no_other_method_verifies_is_one_and_says_so():
    """Stand-ins of which one method fails, and of which the other has time for a single run."""
    scene = swinging()
    measures = measures_of(scene, ["position:rod.b"])

    class Alone:
        def results(self, function, items):
            for k, job in enumerate(items):
                found = Outcome({"position:rod.b": np.ones((9, 3))}, {"position:rod.b": 2.0}, (50.0,), (50.0,), 1)
                yield k, Failure("diverges") if job.variant.method == "rk4" else found

    found = reference(scene, SPAN, measures, Projection(), Alone())
    assert found.floors["position:rod.b"] == 2.0
    assert any("not verified by another method: ros3 alone" in line for line in found.story)


def test_a_reference_costs_no_more_than_its_wanted_error_asks_for():
    """The verifying method stops where it agrees with the first, though its own last two runs differ by more."""
    scene = swinging()
    measures = measures_of(scene, ["position:rod.b"])
    ran = []

    class Counted:
        def results(self, function, items):
            for k, job in enumerate(items):
                ran.append(job.variant)
                off = job.variant.number ** (3 if job.variant.method == "ros3" else 1)
                yield k, Outcome({"position:rod.b": np.full((9, 3), off)}, {"position:rod.b": 1.0}, (0.1,), (0.1,), 1)

    runs = []
    for wanted in (1e-2, 1e-6):
        ran.clear()
        found = reference(scene, SPAN, measures, Projection(), Counted(), wanted=wanted)
        assert found.floors["position:rod.b"] < 2 * wanted
        runs.append(len(ran))
    assert runs[0] < runs[1]


# ---- Dask -----------------------------------------------------------------------------------------------------------


def dies(marker: str) -> str:
    """Takes its process along, the first time."""
    path = Path(marker)
    if not path.exists():
        path.touch()
        os._exit(1)
    return "done"


def dies_always(_: str) -> str:
    os._exit(1)


@pytest.mark.slow
def test_local_processes_give_the_same_and_survive_a_lost_worker(tmp_path):
    pytest.importorskip("dask.distributed")
    scene = swinging()
    measures = measures_of(scene, ["position:rod.b"])
    jobs = [Job(scene, Variant("ros2", step), SPAN, measures, repeats=2) for step in (0.0125, 0.03, 0.00625)]
    here = run_variants(jobs, Here())
    with pool(1) as where:
        there = run_variants(jobs, where)
        assert list(where.results(dies, [str(tmp_path / "m")])) == [(0, "done")]
        ((_, lost),) = where.results(dies_always, ["x"])
        ((_, hopeless_too),) = where.results(hopeless, ["x"])
    assert isinstance(there[1], Failure)
    for one, other in ((here[0], there[0]), (here[2], there[2])):
        np.testing.assert_array_equal(one.values["position:rod.b"], other.values["position:rod.b"])
    assert lost == Failure("its worker died 3 times: out of memory, or killed from outside")
    assert hopeless_too == Failure("MemoryError: never enough")


@pytest.mark.slow
def test_a_cluster_is_reached_by_its_address(tmp_path):
    distributed = pytest.importorskip("dask.distributed")
    scene = swinging()
    jobs = [Job(scene, Variant("ros2", 0.0125), SPAN, measures_of(scene, ()), repeats=1)]
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        pool(cluster=cluster.scheduler_address) as where,
    ):
        (outcome,) = run_variants(jobs, where)
    assert isinstance(outcome, Outcome)


def test_an_address_where_nothing_answers_is_refused(monkeypatch):
    pytest.importorskip("dask.distributed")
    monkeypatch.setattr("ffr_dyn.chart.runner._CONNECT", 0.5)
    for address, said in (
        ("tcp://127.0.0.1:9", "no scheduler answers at"),
        ("nonsense://x", "is no address of a scheduler"),
    ):
        with pytest.raises(InputError, match=said), pool(cluster=address):
            pass


def test_missing_dask_is_told_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "dask", None)
    with pytest.raises(InputError, match=r'pip install "ffr\[chart\]"'), pool(2):
        pass


def test_local_workers_leave_processors_free():
    assert 1 <= default_workers() <= max(1, (os.cpu_count() or 2) // 2)


# ---- pictures, page, table ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("against", COSTS)
def test_pictures_show_something(small, tmp_path, against):
    chosen = replace(small, chosen=(small.points[3].label,), lost=(Lost("rk4", "m", "l", "step", 1.0, "why"),))
    picture = np.asarray(Image.open(draw_chart(chosen, tmp_path / "c.png", against=against)).convert("RGB")).astype(int)
    assert (np.ptp(picture, axis=-1) > 60).sum() > 1500
    text = draw_chart([small, chosen], tmp_path / "c.svg", against=against, title="two").read_text(encoding="utf-8")
    assert text.count("<svg") == 1


@pytest.mark.slow
def test_the_same_diagram_gives_the_same_bytes(diagram, small, tmp_path):
    for suffix in (".png", ".svg"):
        once, again = (draw_chart(small, tmp_path / f"{k}{suffix}").read_bytes() for k in (1, 2))
        assert once == again
    assert page(diagram) == page(diagram)


def test_the_page_holds_all_and_fetches_nothing(diagram, tmp_path):
    text = write_page(diagram, tmp_path / "c.html").read_text(encoding="utf-8")
    assert not re.search(r'<(script|link|img)[^>]*\b(src|href)\s*=\s*["\']?\s*(https?:)?//', text)
    for point in diagram.points:
        assert point.label in text
    for line_of_story in diagram.reference.story:
        assert line_of_story in text


def test_the_table_has_all_digits(diagram, tmp_path):
    path = write_table(diagram, tmp_path / "c.csv")
    rows = list(csv.DictReader(path.open(encoding="utf-8")))
    assert list(rows[0]) == headings(diagram)
    assert len(rows) == len(diagram.points)
    for row, point in zip(rows, diagram.points, strict=True):
        assert float(row["error of position:rod.b [m]"]) == point.errors["position:rod.b"]
        assert float(row["cpu median [s]"]) == point.cpu[0]
    marked = [row["on the front: energy against cpu"] for row in rows].count("yes")
    assert marked == len(diagram.front("energy", "cpu"))


@pytest.mark.parametrize(
    ("low", "high"), [(1.05e-3, 9.5e-2), (1.1e-3, 9e-3), (2.1e-3, 8e-3), (1.1e-3, 2.1e-3), (0.9e-3, 2)]
)
def test_labels_along_the_cost_do_not_overlap(low, high):
    """On a panel as wide as those of a chart, with the ticks and the labels that it has."""
    figure = Figure(figsize=(4.5, 4))
    axes = figure.add_axes((0, 0.2, 1, 0.8))
    axes.loglog([low, high], [1, 2])
    axes.set_xlim(low, high)
    axes.xaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=FEW))
    ticks_between_powers(axes)
    axes.tick_params(which="minor", labelsize="small")
    FigureCanvasAgg(figure).draw()
    shown = [label for label in axes.get_xticklabels(which="both") if label.get_text()]
    shown = [label for label in shown if low <= label.get_position()[0] <= high]
    spans = sorted((box.x0, box.x1) for box in (label.get_window_extent() for label in shown))
    assert len(spans) >= 2
    assert all(before[1] < after[0] for before, after in pairwise(spans))


BROWSER = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chrome")
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--window-size=1200,900", "--virtual-time-budget=8000",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome on this machine")
def test_a_browser_draws_the_page_and_its_menu_changes_it(diagram, tmp_path):
    path = write_page(diagram, tmp_path / "c.html")
    pictures = []
    for view in (0, 3):
        choose = f"document.getElementById('diagram').layout.updatemenus[0].buttons[{view}].args"
        script = f"<script>window.addEventListener('load', () => Plotly.update('diagram', ...{choose}))</script></body>"
        copy, picture = tmp_path / f"v{view}.html", tmp_path / f"v{view}.png"
        copy.write_text(path.read_text("utf-8").replace("</body>", script), encoding="utf-8")
        own = [f"--user-data-dir={tmp_path / 'browser'}", f"--screenshot={picture}", copy.as_uri()]
        subprocess.run([BROWSER, *FLAGS, *own], check=True, capture_output=True, timeout=180)
        pictures.append(np.asarray(Image.open(picture).convert("RGB")).astype(int))
    for picture in pictures:
        assert (np.ptp(picture, axis=-1) > 60).sum() > 1500
    assert (np.abs(pictures[0] - pictures[1]).max(axis=-1) > 60).sum() > 1000


# ---- the command and what it refuses --------------------------------------------------------------------------------


@pytest.fixture
def scene_file(tmp_path):
    scene = replace(swinging(), plane="auto")
    return save_scene(
        scene,
        Settings(start=0.0, end=0.2, output_step=0.05, method=ROS2(0.0125), stabilisation=Projection()),
        tmp_path / "swing.toml",
    )


def run(*arguments: object):
    return CliRunner().invoke(cli, ["chart", *map(str, arguments)])


@pytest.mark.slow
def test_the_command_writes_pictures_page_and_table(scene_file, tmp_path):
    done = run(
        scene_file, "-m", "position:rod.b", "--method", "ros2=0.0125,0.00625", "--method", "rk4=0.00625", "--modes", "2,all",
        "--drop", "I5,I9", "--workers", 0, "--repeats", 1, "-o", tmp_path / "out" / "chart",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert {path.name for path in (tmp_path / "out").iterdir()} == {f"chart.{k}" for k in ("png", "svg", "html", "csv")}
    assert "the front, cheapest first" in done.output
    rows = list(csv.DictReader((tmp_path / "out" / "chart.csv").open(encoding="utf-8")))
    assert {row["model"] for row in rows} == {"full model", "2 modes", "without I5 I9", "2 modes, without I5 I9"}


CHART = """
[chart]
measures = ["position:rod.b"]
methods = {ros2 = [0.0125, "6.25 ms"], rk4 = [0.00625]}
modes = [2, "all"]
drop = [["I5", "I9"]]
"""


def compared(table) -> tuple[set[str], set[str], list[str]]:
    """Models, methods with their numbers, and measures of a chart."""
    rows = list(csv.DictReader(table.open(encoding="utf-8")))
    measured = [key for key in rows[0] if key.startswith("relative error of")]
    return {row["model"] for row in rows}, {f"{row['method']} {float(row['number'])}" for row in rows}, measured


@pytest.mark.slow
def test_a_scene_file_says_what_its_chart_compares(scene_file, tmp_path):
    scene_file.write_text(scene_file.read_text() + CHART)
    done = run(scene_file, "--workers", 0, "--repeats", 1, "-o", tmp_path / "c")
    assert done.exit_code == 0, done.output
    models, variants, measured = compared(tmp_path / "c.csv")
    assert models == {"full model", "2 modes", "without I5 I9", "2 modes, without I5 I9"}
    assert variants == {"ros2 0.0125", "ros2 0.00625", "rk4 0.00625"}
    assert measured == ["relative error of position:rod.b"]


@pytest.mark.slow
def test_options_go_before_the_chart_of_the_file(scene_file, tmp_path):
    scene_file.write_text(scene_file.read_text() + CHART)
    options = ("-m", "deflection:rod", "--method", "ros2=0.0125", "--modes", "all", "--drop", "I8")
    done = run(scene_file, *options, "--workers", 0, "--repeats", 1, "-o", tmp_path / "c")
    assert done.exit_code == 0, done.output
    found = compared(tmp_path / "c.csv")
    assert found == ({"full model", "without I8"}, {"ros2 0.0125"}, ["relative error of deflection:rod"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[0.00625]", "[-1]", r"chart\.methods\.rk4\.1: must be greater than 0 \(it is -1\)"),
        ("rk4", "rk5", r"chart\.methods.*'rk4'"),
        ("[2,", "[-2,", r"chart\.modes.*greater than or equal to 0"),
        ("I9", "I7", r"chart\.drop.*'I9'"),
        ("measures", "measure", "'measure' is not a known entry here; did you mean 'measures'"),
    ],
)
def test_a_chart_of_a_scene_file_that_cannot_be_drawn(scene_file, old, new, words):
    scene_file.write_text(scene_file.read_text() + CHART.replace(old, new))
    with pytest.raises(InputError, match=words):
        load_scene(scene_file)


def test_only_forward_dynamics_is_charted(scene_file):
    text = scene_file.read_text().replace('kind = "forward"', 'kind = "kinematic"')
    text = "\n".join(
        line for line in text.splitlines() if not line.startswith(("method", "step", "stabilisation", "events"))
    )
    scene_file.write_text(text + CHART)
    with pytest.raises(InputError, match="chart: it compares runs of forward dynamics"):
        load_scene(scene_file)


@pytest.mark.slow
def test_another_body_file_is_a_model(scene_file, tmp_path):
    other = next(tmp_path.glob("swing.rod.ffr"))
    finer = shutil.copy(other, tmp_path / "finer.ffr")
    done = run(
        scene_file, "--method", "ros2=0.0125", "--body", f"rod={finer}", "--workers", 0, "--repeats", 1,
        "-o", tmp_path / "c", "--against", "evaluations",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    rows = list(csv.DictReader((tmp_path / "c.csv").open(encoding="utf-8")))
    assert [row["model"] for row in rows] == ["rod of the scene", "rod of finer"]
    assert rows[0]["relative error of deflection:rod"] == rows[1]["relative error of deflection:rod"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-m", "rod.b.positon.x"], "no quantity of the scene and no kind of measure; did you mean rod.b.position"),
        (["-m", "place:rod.b"], "there is no kind 'place'; there are: position, deflection"),
        (["-m", "position:rod.z"], "has no interface 'z'"),
        (["-m", "position:ground.O"], "a point of the ground, which does not move"),
        (["-m", "reaction:hing"], "no joint 'hing'; there are: hinge"),
        (["-m", "deflection:arm"], "no flexible body 'arm'; there are: rod"),
        (["-m", "deflection:rod.b/a"], "write the ends of the chord as two interfaces"),
        (["-m", "deflection:rod.b/a,a"], "has no length"),
        (["-m", "stress:rod@0,0,0"], "has no stress modes"),
        (["--method", "ros5"], "no method 'ros5'; did you mean 'ros3'"),
        (["--method", "ros2=fast"], "write it as NAME=NUMBER"),
        (["--method", "ros2=-1e-3"], "must be positive"),
        (["--method", "ros2=0.0125", "--method", "ros2"], "--method ros2 is given twice"),
        (["--body", "rod=swing.rod.ffr", "--body", "rod=x.ffr"], "--body rod is given twice"),
        (["-m", "rod.b.position.up"], "did you mean rod.b.position"),
        (["-m", "rod.q", "--modes", "2,all"], "'2 modes' has others; measure what they do"),
        (["--modes", "2,some"], "write it as 2,4,8,all"),
        (["--modes=-2"], "cannot keep -2 modes"),
        (["--drop", "I7"], "no term 'I7' to drop"),
        (["--body", "arm=x.ffr"], "write BODY=FILE"),
        (["--body", "rod=missing.ffr"], "missing.ffr does not exist"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(scene_file, arguments, message):
    done = run(scene_file, *arguments, "--workers", 0)
    assert done.exit_code != 0
    assert message in str(done.exception)


@pytest.mark.slow
def test_the_example_of_the_documentation_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "chart.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.S)
    code = code.replace("workers=2", "workers=0").replace("end=0.5, output_step=0.01", "end=0.1, output_step=0.05")
    exec(compile(code, "chart.md", "exec"), {"scene": swinging()})
    assert (tmp_path / "chart.png").stat().st_size > 1000
    assert "full model" in capsys.readouterr().out


def test_modes_of_rigid_bodies_cannot_vary():
    with pytest.raises(InputError, match="no flexible body: there are no modes and no inertia terms to vary"):
        models_of(rigid(), (2, None))
    with pytest.raises(InputError, match="no flexible body"):
        models_of(rigid(), (None,), (("I5",),))


def test_numbers_beyond_what_a_body_has_are_what_it_has_and_run_once():
    scene = swinging()
    n = scene.bodies[0].model.n

    def labels(*numbers: int | None) -> list[str]:
        return [model.label for model in models_of(scene, numbers)]

    assert labels(2, 99, n, None) == ["2 modes", "full model"]
    assert labels(99, 2, 100) == [f"{n} modes", "2 modes"]
    assert [m.label for m in models_of(scene, (None,), ((), ("I5",), ("I5",)))] == ["full model", "without I5"]
    fewer = truncated(scene.bodies[0].model, 2)
    meshes = {"rod": [("own", scene.bodies[0].model), ("coarse", fewer)]}
    found = models_of(scene, (3, 99), ((),), meshes)
    assert [model.label for model in found] == ["3 modes, own", f"{n} modes, own", "2 modes, coarse"]


def test_another_analysis_cannot_be_charted(tmp_path):
    settings = Settings(
        start=0.0, end=0.2, output_step=0.05, method=ROS2(0.0125), stabilisation=Projection(), analysis=Kinematic()
    )
    done = run(save_scene(rigid(), settings, tmp_path / "k.toml"))
    assert "a chart compares runs of forward dynamics" in str(done.exception)


def test_a_body_without_surface_has_no_shape():
    scene = swinging()
    bare = replace(scene, bodies=(Body("rod", replace(scene.bodies[0].model, surface=None)),))
    with pytest.raises(InputError, match="has no surface; name an interface"):
        measures_of(bare, ["deflection:rod"])


def test_the_name_of_a_scene_is_no_formula(small, tmp_path):
    """matplotlib takes text between two "$" for one: a chart of such a scene ended in a traceback."""
    priced = draw_chart(replace(small, title="5 $ _{ 6 $"), tmp_path / "c.svg").read_text(encoding="utf-8")
    assert "5 $ _{ 6 $: work and precision" in priced


def test_nothing_to_draw_is_said(diagram, tmp_path):
    empty = replace(diagram, points=(), lost=(Lost("rk4", "m", "the label", "step", 1.0, "the reason"),))
    with pytest.raises(InputError, match=r"no variant ran .the label: the reason"):
        draw_chart(empty, tmp_path / "c.png")
    for path, against, message in (("c.pdf", "cpu", "drawn as"), ("c.png", "money", "cost 'money'")):
        with pytest.raises(InputError, match=message):
            draw_chart(diagram, tmp_path / path, against=against)
    with pytest.raises(InputError, match="no measure 'x'"):
        diagram.measure("x")
    with pytest.raises(InputError, match="cannot be -1 workers"), pool(-1):
        pass
