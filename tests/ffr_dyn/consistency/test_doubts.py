"""The table of doubts: every cell of it, and for each doubt a small scene that raises it and one mended as its text says."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from ffr_gallery.bodies import bar, pendulum
from places import ROOT
from synthetic import cloud

from ffr_dyn.analyses.assemble import assembly
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.inverse import Dynamic, inverse
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.consistency import doubts
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.doubts import ANALYSES, ERROR, NOTE, TABLE, checked, ended, nothing_seen
from ffr_dyn.consistency.evaluation import evaluator, record_states
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.integrators import RK4, ROS2, ROS3
from ffr_dyn.integrators.stabilisation import Drifting
from ffr_dyn.realtime.stepper import Stepper
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator, Bushing, JointFriction, JointSpring, JointStop
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body
from ffr_prep.common.errors import ComputationError

GROUND = {"O": (0, 0, 0), "P": (0.9, 0, 0)}
HINGED = Scene((Body("bar", bar("bar")),), (Joint("hinge", "revolute", "ground.O", "bar.a"),), ground=GROUND)
TURNING = replace(HINGED, bodies=(replace(HINGED.bodies[0], omega_bar=(0, 0, 1.0)),))
SPRUNG = replace(TURNING, forces=(JointSpring("spring", "hinge", stiffness=1e4),))  # 173 rad/s
RUBBED = replace(TURNING, forces=(JointFriction("rub", "hinge", coulomb=100.0, creep=1e-3),))
DOUBLE = replace(pendulum(bar("upper"), bar("lower")), gravity=(0, -9.81, 0))
PERIOD = 2 * np.pi


def stopped(lower: float) -> Scene:
    stop = JointStop("stop", "hinge", stiffness=1e4, entry=1e-3, lower=lower)
    return replace(HINGED, forces=(stop, JointSpring("spring", "hinge", stiffness=1e3)))


def driven(amplitude: float, omega: float) -> Scene:
    return replace(HINGED, drivers=(Driver("drive", "hinge", harmonic(amplitude=amplitude, frequency=omega / PERIOD)),))


def forward(scene: Scene, h: float, rows: int = 10, each: int = 1, kind: type = ROS2, **more: object) -> list[str]:
    return integrate(scene, end=rows * each * h, output_step=each * h, method=kind(h), **more).attributes["notes"]


def stepped(scene: Scene, h: float, rows: int = 10, each: int = 1, kind: type = ROS2) -> list[str]:
    stepper, found = Stepper(scene, kind(h)), set[str]()
    for _ in range(rows):
        stepper.step(each)
        found = {*stepper.doubts()}
    return sorted(found)


def inverted(scene: Scene, h: float, rows: int = 10, each: int = 1) -> list[str]:
    method = Dynamic(ROS2(h))
    return inverse(scene, end=rows * each * h, output_step=each * h, elastic=method).attributes["notes"]


def at_once(analysis: Callable, scene: Scene) -> list[str]:
    found = analysis(scene)
    return list(found.notes if analysis is linearise else found.attributes["notes"])


# ---- the table ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("doubt", TABLE)
def test_every_cell_does_what_it_says(doubt, analysis):
    seen, found = nothing_seen(assemble(HINGED)), {doubt: ["a doubt"]}
    if TABLE[doubt][analysis] == ERROR:
        with pytest.raises(ComputationError, match="a doubt"):
            ended(analysis, seen, found)
    else:
        assert ended(analysis, seen, found) == ["a doubt"] * (TABLE[doubt][analysis] == NOTE)


def test_the_page_shows_the_table():
    page = (ROOT / "docs" / "analyses.md").read_text(encoding="utf-8")
    rows = [f"| {doubt} | {' | '.join(row[analysis] for analysis in ANALYSES)} |" for doubt, row in TABLE.items()]
    assert f"| doubt | {' | '.join(ANALYSES)} |" in page
    assert [row for row in rows if row not in page] == []


def test_a_driver_that_stands_still_does_not_choose_another_plane():
    """A bar along x, held on a hinge about z, lies in x-z as well, where the driver would have no effort."""
    held = replace(HINGED, drivers=(Driver("drive", "hinge", 0.0),), gravity=(0, -9.81, 0))
    result = kinematic(held, end=0.1, output_step=0.1)
    mass, arm = bar("bar").mass, bar("bar").r_dm[0] / bar("bar").mass
    np.testing.assert_allclose(result["drive.effort"], 9.81 * mass * arm, rtol=1e-9)


def test_the_table_is_complete():
    assert all(set(row) == set(ANALYSES) for row in TABLE.values())


def test_what_goes_by_the_same_loop_has_the_same_doubts():
    assert all(len({row[analysis] for analysis in doubts.INTEGRATED}) == 1 for row in TABLE.values())


# ---- a scene for every doubt ------------------------------------------------------------------------------------------


def bent(turn: float) -> Scene:
    model = cloud(2)
    q = turn / np.abs(model.interfaces[0].phi_r).max()
    return Scene((Body("bent", model, q=(q, q)),), ground=GROUND)


def spinning(spin: float) -> Scene:
    return Scene((Body("disc", cloud(2), omega_bar=(0, 0, spin)),), plane="none")


def heavy(share: float) -> Scene:
    """A body whose only mode moves all of its mass along x, but for a share."""
    model = cloud(1)
    P_dm = np.array([[np.sqrt(model.mass * (1 - share))], [0.0], [0.0]])
    rP_dm = model.r_dm[:, None, None] * P_dm / model.mass
    return Scene((Body("body", replace(model, P_dm=P_dm, rP_dm=rP_dm)),), plane="none")


def held(*rotation: float, **joint_spring: float) -> Scene:
    """The turning bar in a bushing, or with a spring on its angle."""
    mount = Bushing("mount", "ground.O", "bar.a", stiffness=(0, 0, 0, *rotation))
    wind = [JointSpring("wind", "hinge", **joint_spring)] if joint_spring else []
    return replace(TURNING, forces=(mount, *wind))


STOP = JointStop("stop", "hinge", upper=0.1, stiffness=1e5, damping=100.0, entry=1e-3)
OF_ITS_OWN = Actuator("own", "hinge", function=lambda t, state: -30.0 * state.omega_bar("bar")[2])

# doubt, words of it, a scene that raises it, the same mended as the words say
RAISED = [
    (
        doubts.APART,
        r"driver 'drive' moves by 1\.91 rad within the step .* more than the method follows; .* use steps below",
        partial(forward, driven(2.0, 100.0), 1e-2),
        partial(forward, driven(2.0, 100.0), 2e-4, 10, 50),
    ),
    (
        doubts.APART,
        "is not followed",
        partial(stepped, driven(2.0, 100.0), 1e-2),
        partial(stepped, driven(2.0, 100.0), 2e-4, 10, 50),
    ),
    (
        doubts.OPEN,
        "is open by .* use a smaller step",
        partial(forward, driven(2.0, 100.0), 1e-3, 10, 10),
        partial(forward, driven(2.0, 100.0), 2e-4, 10, 50),
    ),
    (
        doubts.OPEN,
        "is open by .* use projection",
        partial(forward, DOUBLE, 0.02, 100, stabilisation=Drifting()),
        partial(forward, DOUBLE, 0.002, 100, 10),
    ),
    (
        doubts.QUICK,
        r"'drive' is faster than the step.*one below 0\.0022 s",
        partial(forward, driven(2.0, 100.0), 2.3e-3, 8),
        partial(forward, driven(2.0, 100.0), 2e-3, 8),
    ),
    (
        doubts.QUICK,
        "'drive' is faster than the step",
        partial(stepped, driven(2.0, 100.0), 2.3e-3, 8),
        partial(stepped, driven(2.0, 100.0), 2e-3, 8),
    ),
    (
        doubts.QUICK,
        "'drive' is faster than the step",
        partial(inverted, driven(2.0, 100.0), 2.3e-3, 8),
        partial(inverted, driven(2.0, 100.0), 2e-3, 8),
    ),
    (
        doubts.BALANCE,
        r"energy of 0\.167 J has gone that no force or driver has taken out, 1 of .*RK4, 0\.012 s\); use a smaller step",
        partial(forward, SPRUNG, 0.012, 100, 3, RK4),
        partial(forward, SPRUNG, 0.001, 100, 36, RK4),
    ),
    (
        doubts.BALANCE,
        "has come that no force or driver has put in",
        partial(forward, RUBBED, 0.01, 100, 1, RK4),
        partial(forward, RUBBED, 0.01, 100, 1, ROS2),
    ),
    (
        doubts.STIFF,
        r"force 'rub' is too stiff for steps of 0\.01 s, in which RK4 takes it.* a rate of 29.* 1/s.*0\.009. s; .*ROS2",
        partial(forward, replace(RUBBED, forces=(replace(RUBBED.forces[0], creep=1.0),)), 0.01, 100, 1, RK4),
        partial(forward, replace(RUBBED, forces=(replace(RUBBED.forces[0], creep=1.0),)), 0.005, 100, 2, RK4),
    ),
    (
        doubts.STIFF,
        "'own' is too stiff .*which ROS2 takes it explicitly.*; use that$",
        partial(forward, replace(TURNING, forces=(OF_ITS_OWN,)), 0.03, 1),
        partial(forward, replace(TURNING, forces=(OF_ITS_OWN,)), 0.01, 3),
    ),
    (
        doubts.STIFF,
        "'own' is too stiff",
        partial(stepped, replace(TURNING, forces=(OF_ITS_OWN,)), 0.03, 1),
        partial(stepped, replace(TURNING, forces=(OF_ITS_OWN,)), 0.01, 3),
    ),
    *(
        (doubts.WOUND, r"'mount': its ends are turned by 3\.\d* rad .* reverses", partial(analyse, held(0, 0, 1e-3)), mended)
        for analyse, mended in (
            (partial(forward, h=0.05, rows=80), partial(forward, held(0, 0, 0), 0.05, 80)),
            (partial(forward, h=0.05, rows=80), partial(forward, held(0, 0, 0, stiffness=1e-3), 0.05, 80)),
            (partial(stepped, h=0.05, rows=80), partial(stepped, held(0, 0, 0), 0.05, 80)),
        )
    ),
    *(
        (doubts.STRAINED, "turns within itself", partial(analyse, bent(0.5)), partial(analyse, bent(0.01)))
        for analyse in (
            partial(at_once, assembly),
            partial(at_once, linearise),
            partial(forward, h=1e-4, rows=1),
            partial(stepped, h=1e-4, rows=1),
        )
    ),
    (
        doubts.MEANINGLESS,
        "linear elasticity says nothing about",
        partial(stepped, bent(200.0), 1e-4, 1),
        partial(stepped, bent(0.01), 1e-4, 1),
    ),
    *(
        (doubts.MEANINGLESS, "linear elasticity says nothing", partial(analyse, bent(200.0)), partial(analyse, bent(0.01)))
        for analyse in (partial(at_once, assembly), partial(at_once, linearise), partial(forward, h=1e-4, rows=1))
    ),
    *(
        (doubts.SPUN, "without geometric stiffening", partial(analyse, spinning(8.0)), partial(analyse, spinning(1.0)))
        for analyse in (
            partial(at_once, assembly),
            partial(at_once, linearise),
            partial(forward, h=1e-4, rows=1),
            partial(stepped, h=1e-4, rows=1),
        )
    ),
    (
        doubts.KINK,
        "'stop' has a kink just at this state",
        partial(at_once, linearise, stopped(lower=0.0)),
        partial(at_once, linearise, stopped(lower=-0.01)),
    ),
    *(
        (doubts.MASS, "'body' is nearly singular", partial(analyse, heavy(2e-9)), partial(analyse, heavy(0.1)))
        for analyse in (partial(at_once, assembly), partial(forward, h=1e-4, rows=1), partial(stepped, h=1e-4, rows=1))
    ),
]  # fmt: skip


@pytest.mark.parametrize(("doubt", "words", "raised", "mended"), RAISED)
def test_a_doubt_is_told_and_its_remedy_works(doubt, words, raised, mended):
    try:
        notes = raised()
    except ComputationError as error:
        assert ERROR in TABLE[doubt].values()
        notes = [str(error)]
    else:
        assert NOTE in TABLE[doubt].values()
    assert [note for note in notes if _matches(words, note)], notes
    assert not [note for note in mended() if _matches(words.partition(".*")[0], note)]


def _matches(words: str, note: str) -> bool:
    return re.search(words, note) is not None


@pytest.mark.parametrize("analysis", [a for a in ANALYSES if TABLE[doubts.ASTRAY][a] == ERROR])
def test_a_driver_half_a_turn_off_is_an_error_everywhere(analysis):
    """Its row is closed there as well."""
    assembled = assemble(replace(HINGED, drivers=(Driver("drive", "hinge", 0.3),)))
    rows = record_states(evaluator(assembled.system), np.zeros(1), assembled.x[None], assembled.v[None])
    assert doubts.ASTRAY not in checked(analysis, assembled, rows)
    with pytest.raises(ComputationError, match=r"'drive' is not followed: its joint is 3\.14 rad from"):
        checked(analysis, assembled, rows._replace(functions=rows.functions + np.array([np.pi, 0, 0])))


def test_redundant_rows_are_looked_at_too():
    scene = replace(
        HINGED,
        joints=(*HINGED.joints, Joint("again", "revolute", "ground.O", "bar.a")),
        gravity=(0, -9.81, 0),
        plane="none",
    )
    result = integrate(scene, end=0.5, output_step=0.05, method=ROS2(0.01), outputs=("constraint.position",))
    assembled = assemble(scene)
    assert assembled.all_rows is not None
    rows = record_states(evaluator(assembled.system), np.zeros(1), assembled.x[None], assembled.v[None])
    x = rows.x.copy()
    x[0, 0] += 0.5  # all of it, which the rows of the record do not say
    opened = rows._replace(x=x, violation=np.full((1, 2), 0.5))
    with pytest.raises(ComputationError, match=r"'same x' of .* is open by 0\.5: the mechanism has come apart"):
        checked("static", assembled, opened)
    assert not [note for note in result.attributes["notes"] if "open" in note]


# ---- what is no doubt -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "quiet",
    [
        partial(forward, RUBBED, 0.01, 100),  # the wheel stops within the first row
        partial(forward, replace(RUBBED, bodies=(replace(TURNING.bodies[0], omega_bar=(0, 0, 100.0)),)), 1e-3, 10, 10, RK4),
        partial(forward, replace(TURNING, forces=(replace(OF_ITS_OWN, damping=30.0),)), 0.03, 10),
        partial(forward, replace(TURNING, forces=(STOP,)), 1e-3, 5, 100),
        partial(forward, driven(0.5, 6.0), 1e-3, 20, 50),
    ],
    ids=["stuck", "sliding", "slopes", "impact", "driven"],
)  # fmt: skip
def test_what_a_run_does_right_is_no_doubt(quiet):
    assert [note for note in quiet() if "planar" not in note] == []


# ---- before anything moves --------------------------------------------------------------------------------------------


def sliding(model: FlexibleBody, kind: str, axis: tuple[float, float, float]) -> Scene:
    guide, slider = Body("guide", model), Body("slider", bar("slider"), position=model.interface("a").position)
    joints = (Joint("clamp", "fixed", "ground.O", "guide.a"), Joint("slide", kind, "guide.a", "slider.a", axis=axis))
    return Scene((guide, slider), joints, ground={"O": model.interface("a").position})


def test_a_joint_that_slides_along_a_flexible_body_is_named():
    model = cloud(3)
    away = model.interface("b").position - model.interface("a").position
    along = away / np.linalg.norm(away)
    (note,) = [n for n in assemble(sliding(model, "cylindrical", tuple(along))).notes if "slides along" in n]
    assert "joint 'slide' slides along body 'guide' by the straight axis of its interface 'a'" in note
    for scene in (sliding(model, "revolute", tuple(along)), sliding(bar("stiff"), "cylindrical", (1, 0, 0))):
        assert not [n for n in assemble(scene).notes if "slides along" in n]


@pytest.mark.parametrize(("markers", "told"), [(("guide.a", "slider.a"), 1), (("slider.a", "guide.a"), 0)])
def test_the_line_of_a_point_on_it_is_that_of_the_first_body(markers, told):
    """The end of a bar that rolls along the ground slides along no bar, however this lies."""
    model = cloud(3)
    along = model.interface("b").position - model.interface("a").position
    scene = sliding(model, "revolute", (0, 0, 1))
    i, j = markers
    roller = Joint("roller", "point-on-line", i, j, axis=tuple(along / np.linalg.norm(along)))
    notes = assemble(replace(scene, joints=(scene.joints[0], roller))).notes
    assert len([note for note in notes if "slides along" in note]) == told


def swinging(length: float) -> list[str]:
    """Notes on open joints of two bars that swing from the horizontal, by forty steps to the root of length over gravity."""
    mass, time = 1.0, float(np.sqrt(length / 9.81))
    inertia = mass * length**2 / 12 * np.array([1e-3, 1.0, 1.0])
    rod = rigid_body("rod", mass=mass, inertia=inertia, points={"a": (-length / 2, 0, 0), "b": (length / 2, 0, 0)})
    joints = (Joint("upper", "revolute", "ground.O", "p.a"), Joint("lower", "revolute", "p.b", "q.a"))
    bodies = (Body("p", rod, position=(length / 2, 0, 0)), Body("q", rod, position=(1.5 * length, 0, 0)))
    scene = Scene(bodies, joints, ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))
    notes = integrate(scene, end=4 * time, output_step=time / 4, method=ROS3(time / 40)).attributes["notes"]
    return [re.sub(r"[\d.e+-]+", "#", note) for note in notes if "is open by" in note]


def test_joints_of_large_machines_are_doubted_as_those_of_small_ones():
    """What a step leaves open goes with the length; from 100 m on it was told of sound steps, and torn of coarse ones."""
    assert swinging(1.0) == swinging(100.0) == swinging(1e4) == []
