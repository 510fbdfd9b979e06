"""What charts, the search for the cheapest model and variants of a scene say."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from ffr_gallery.bodies import beam
from ffr_gallery.scene_set import pendulum
from remedy import CLOUD, DOUBLE, HINGED, run, stressed
from said import Case
from synthetic import cloud

from ffr_dyn.analyses.events import Event
from ffr_dyn.chart.diagram import Diagram, Lost, measures_of, work_precision
from ffr_dyn.chart.draw import draw_chart
from ffr_dyn.chart.meaning import check_meaning
from ffr_dyn.chart.reference import reference
from ffr_dyn.chart.runner import Failure, Here, Job, Span, _started, perform, pool
from ffr_dyn.chart.variants import FULL, Model, Variant, models_of
from ffr_dyn.economy.model_choice import applied, full
from ffr_dyn.economy.policy import Policy
from ffr_dyn.economy.report import write_report
from ffr_dyn.economy.result import Economy
from ffr_dyn.economy.search import economise
from ffr_dyn.functions.formula import parse
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.forces import JointStop, Load, SpringDamper
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.state_formula import StateFormula
from ffr_dyn.variants.variant import basis_of, stiffening_by, vary, with_model, with_modes
from ffr_prep.common.errors import ComputationError

p = partial
SWING = replace(CLOUD, gravity=(0, -9.81, 0), plane="none", bodies=(Body("cloud", stressed(cloud(2))),))
CORNER = ",".join(str(x) for x in SWING.bodies[0].model.surface.points[0])
BARE = replace(SWING, bodies=(Body("cloud", replace(cloud(2), surface=None)),))
TIP = "cloud.b.position.y"


def fallen(stiffness: float) -> Economy:
    """A bar that falls on a stop."""
    stop = JointStop("stop", "hinge", stiffness=stiffness, entry=1e-6, lower=-0.1)
    scene = replace(HINGED, gravity=(0, -9.81, 0), forces=(stop,))
    return economise(scene, ["bar.b.position"], end=0.3, output_step=0.1, tolerance=0.1, verify=False)


# ---- charts -------------------------------------------------------------------------------------------------------------


def lost(scene: Scene, *texts: str, step: float = 1e-3, end: float = 0.02, **more: object) -> object:
    """A run of a chart. Raises what it was lost for."""
    job = Job(scene, Variant("ros2", step), Span(end, 0.01), measures_of(scene, texts), repeats=1, **more)
    outcome = perform(job)
    if isinstance(outcome, Failure):
        raise ComputationError(outcome.reason)
    return outcome


def measured(wrong: str, right: str, scene: Scene = SWING, other: Scene = SWING) -> Case:
    return Case(p(lost, scene, wrong), p(lost, other, right))


def compared(models: tuple[Model, ...], text: str = "position:cloud.b") -> None:
    check_meaning(SWING, measures_of(SWING, [text]), models)


OTHER_FRAME = Model("other", bodies={"cloud": replace(cloud(2), provenance={"reference": {"type": "MeanAxis"}})})


def in_parts() -> Model:
    """A model of the body in two parts, one upon the other."""
    whole = cloud(2)
    a, b, c = whole.interfaces
    parts = ((a, replace(c, name="cut_1_a")), (replace(c, name="cut_1_b"), b, c))
    both = replace(whole, mass=2 * whole.mass, parts=tuple(replace(whole, interfaces=of) for of in parts))
    return Model("parts", bodies={"cloud": both})


def referred(limit: float) -> object:
    span, measures = Span(0.04, 0.01), measures_of(HINGED, ["position:bar.b"])
    return reference(HINGED, span, measures, Projection(), Here(), limit=limit)


def broken(**_: object) -> object:
    raise RuntimeError("Nanny failed to start.")


@cache
def diagram() -> Diagram:
    span, measures = Span(0.04, 0.01), measures_of(SWING, ["position:cloud.b"])
    methods = {"ros2": (5e-3, 2.5e-3)}
    return work_precision(SWING, span, Here(), measures=measures, methods=methods, repeats=1, wanted=1e-3)


def drawn(of: Diagram, name: str = "chart.png", **more: str) -> None:
    with TemporaryDirectory() as folder:
        draw_chart(of, Path(folder) / name, **more)


def opened(**where: object) -> object:
    with pool(**where) as found:
        return found


def without_dask(workers: int) -> object:
    with patch.dict(sys.modules, {"dask": None}):
        return opened(workers=workers)


GONE = Lost("ros2", FULL.label, "ros2, step 1 s", "step", 1.0, "took longer than 1 s")
CHARTS = [
    Case(lambda: _started(broken), lambda: _started(lambda **_: "cluster")),
    measured("speed:cloud.b", "position:cloud.b"),
    measured("cloud.b.positon", "cloud.b.position"),
    measured("reaction:hing", "reaction:hinge"),
    Case(p(compared, (FULL, Model(modes=1))), p(compared, (FULL, Model("1 mode", modes=1)))),
    Case(
        p(compared, (FULL, Model("1 mode", modes=1)), "cloud.q"),
        p(compared, (Model("1 mode", modes=1),), "deflection:cloud"),
    ),
    Case(p(compared, (in_parts(),), "deflection:cloud"), p(compared, (in_parts(),), "position:cloud.b")),
    Case(p(compared, (OTHER_FRAME,), "deflection:cloud"), p(compared, (OTHER_FRAME,), "deflection:cloud.b/a,c")),
    measured("deflection:cloud.b/a", "deflection:cloud.b/a,c"),
    measured("deflection:cloud.b/a,a", "deflection:cloud.b/a,c"),
    measured("deflection:cloud", "deflection:cloud.b", BARE, BARE),
    measured("deflection:cloud", "deflection:cloud", BARE),
    measured(f"stress:cloud@{CORNER}", f"stress:cloud@{CORNER}", CLOUD),
    measured("stress:cloud@1", f"stress:cloud@{CORNER}"),
    measured("deflection:clod", "deflection:cloud"),
    measured("position:ground.O", "position:cloud.b"),
    measured("position:cloud.d", "position:cloud.b"),
    Case(p(lost, SWING, step=1e-5, end=2.0, limit=1e-9), p(lost, SWING, step=1e-3, limit=10.0)),
    Case(p(referred, 1e-9), p(referred, 10.0)),
    Case(p(opened, workers=-1), p(opened, workers=0)),
    Case(p(without_dask, 1), p(without_dask, 0)),
    Case(p(opened, cluster="tcp://localhost"), p(opened, workers=0)),
    Case(p(opened, cluster="tcp://localhost:9"), p(opened, workers=0)),
    Case(p(models_of, DOUBLE, modes=(2, 4)), p(models_of, DOUBLE)),
    Case(lambda: diagram().measure("energy"), lambda: diagram().measure("position:cloud.b")),
    Case(lambda: drawn(diagram(), "chart.bmp"), lambda: drawn(diagram())),
    Case(lambda: drawn(diagram(), against="money"), lambda: drawn(diagram(), against="wall")),
    Case(lambda: drawn(replace(diagram(), points=(), lost=(GONE,))), lambda: drawn(diagram())),
]

# ---- the cheapest model -------------------------------------------------------------------------------------------------


def economised(*outputs: object, scene: Scene = SWING, **more: object) -> Economy:
    return economise(scene, outputs, **{"end": 0.2, "output_step": 0.02, "tolerance": 1e-2, "verify": False, **more})


def asked(wrong: tuple[object, ...], right: tuple[object, ...], scene: Scene = SWING) -> Case:
    return Case(p(economised, *wrong), p(economised, *right, scene=scene))


def held(stiffness: float) -> Scene:
    return replace(SWING, springs=(SpringDamper("rope", "ground.P", "cloud.b", stiffness, free_length=2.0),))


def reported(name: str) -> None:
    with TemporaryDirectory() as folder:
        write_report(economised(TIP), Path(folder) / name)


def read(name: str) -> Scene:
    """The pendulum with a force that depends on something."""
    formula = parse(f"0 * {name}", {}, "")
    return replace(SWUNG, loads=(Load("push", "rod.b", function=StateFormula((formula, formula, formula))),))


SWUNG = pendulum(7e10)
HELD = "cloud.a.position.y"
SOON = (Event("end", lambda t, state: t - 0.03, stop=True),)
LOUD = replace(SWING, bodies=(Body("cloud", stressed(cloud(2), 1e300)),))
ECONOMY = [
    Case(p(fallen, 1e16), p(fallen, 1e3)),
    asked((), (TIP,)),
    asked((f"{TIP}=little",), (f"{TIP}=1%",)),
    asked((TIP, TIP), (TIP,)),
    asked((f"{TIP}=1e-12%",), (f"{TIP}=1%",)),
    asked(("cloud.d.position.y",), (TIP,)),
    asked(("clod.stress",), ("cloud.stress=5%",)),
    Case(p(economised, "cloud.stress", scene=CLOUD), p(economised, "cloud.stress=5%")),
    asked((HELD,), (f"{HELD}=1e-3",)),
    asked(("cloud.q",), (TIP,)),
    Case(p(economised, "rod.b.displacement.y", scene=SWUNG), p(economised, "rod.b.position.y", scene=SWUNG)),
    Case(
        p(economised, "rod.b.position.y", scene=read("rod.q[1]")),
        p(economised, "rod.b.position.y", scene=read("rod.b.velocity.y")),
    ),
    Case(p(reported, "report.pdf"), p(reported, "report.txt")),
    Case(lambda: applied(HINGED, full(DOUBLE, "ros2", 1)), lambda: applied(HINGED, full(HINGED, "ros2", 1))),
    Case(p(economised, TIP, scene=held(1e20)), p(economised, TIP, scene=held(10.0))),
    Case(p(economised, TIP, tolerance=1e-9, policy=Policy(most_divisions=2)),
         p(economised, TIP, tolerance=1e-2, policy=Policy(most_divisions=64))),
    Case(p(economised, TIP, verify=True, policy=Policy(most_divisions=2)),
         p(economised, TIP, verify=True, output_step=0.01)),
    Case(p(economised, TIP, events=SOON), p(economised, TIP, events=SOON, output_step=0.005)),
    Case(p(economised, "cloud.stress", scene=LOUD), p(economised, "cloud.stress")),
]  # fmt: skip

# ---- variants -----------------------------------------------------------------------------------------------------------

STRIP = Body("strip", beam("strip", 1.0, 1.0, 10.0, 2))
LESS = replace(cloud(2), interfaces=cloud(2).interfaces[:2])
VARIANTS = [
    Case(p(basis_of, cloud(2), -1), p(basis_of, cloud(2), 1)),
    Case(lambda: run(vary(SWING, drop=("I6",))), lambda: run(vary(SWING, drop=("I5", "I9")))),
    Case(p(stiffening_by, STRIP, (99,)), p(stiffening_by, STRIP, (0,))),
    Case(p(with_model, Body("cloud", cloud(2)), LESS), p(with_model, Body("cloud", LESS), cloud(2))),
    Case(p(with_model, Body("c", cloud(2), damping=(0.1, 0.2)), cloud(3)),
         p(with_model, Body("c", cloud(2), damping=0.1), cloud(3))),
    Case(p(with_modes, SWING, 1), p(vary, SWING, modes=1)),
    Case(lambda: with_modes(Body("cloud", in_parts().bodies["cloud"]), 1), lambda: replace(in_parts(), modes=1).of(SWING)),
    Case(lambda: vary(SWING, modes={"clod": 1}), lambda: vary(SWING, modes={"cloud": 1})),
]  # fmt: skip
CASES = CHARTS + ECONOMY + VARIANTS
