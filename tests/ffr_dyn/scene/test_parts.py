"""Bodies in parts: a scene moves the parts, and speaks of one body."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from boxes import STEEL, box_mesh
from scipy.integrate import solve_bvp

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.mobility import mobility
from ffr_dyn.consistency.validity import parts_needed
from ffr_dyn.integrators import ROS2
from ffr_dyn.pictures.film import displaced, drawn_points, film
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.result import Result
from ffr_dyn.results.stress import hot_spots, section_forces, stress_histories
from ffr_dyn.scene.forces import Load, ModalForce, NodalForces, Pressure
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import SectionMeasurement, StressMeasurement
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import save_scene
from ffr_dyn.variants.variant import vary
from ffr_prep.body import FlexibleBody, cut_doubt, damped, mesh_doubt
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.model import from_mesh
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.model import from_frame
from ffr_prep.structures.sections import rectangle

CLAMP = Joint("clamp", "fixed", "ground.wall", "beam.root")
HALF = (0.5, 0.0, 0.0)


@cache
def beam(parts: int | None, modes: int = 8, *, stiffening: bool = False) -> FlexibleBody:
    """One metre along x, 10 mm by 20 mm."""
    member = Member(rectangle(0.02, 0.01), STEEL, (0.0, 1.0, 0.0))
    frame = named(polyline([(0, 0, 0), (1, 0, 0)], member, elements=16), root=(0, 0, 0), tip=(1, 0, 0))
    model = from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")])
    kept = {"reduction": CraigBampton(modes), "stress": True, "linear": not stiffening, "parts": parts}
    return reduce(model, Request(name="b", reference=FixedTo("root"), **kept))


@cache
def bar(parts: int | None) -> FlexibleBody:
    """One metre along x, 60 mm by 40 mm, of solids."""
    mesh = box_mesh("hex20", (1.0, 0.06, 0.04), (8, 1, 1))
    model = from_mesh(mesh, STEEL, [InterfaceRegion("root", "left"), InterfaceRegion("tip", "right")])
    return reduce(
        model,
        Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(4), stress=True, linear=True, parts=parts),
    )


def clamped(model: FlexibleBody, **more: object) -> Scene:
    return Scene((Body("beam", model),), (CLAMP,), ground={"wall": (0, 0, 0)}, **more)


def pushed(model: FlexibleBody, **more: object) -> Scene:
    return clamped(model, loads=(Load("push", "beam.tip", force=(0.0, 1.0, 0.5)),), **more)


def whole() -> Scene:
    return pushed(beam(None))


# ---- variants ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("modes", [0, 3])
def test_a_body_file_in_parts_has_as_many_modes_as_are_asked_for(modes):
    """Of each part, as where the scene has the parts; a damped body has one ratio still."""
    scene = replace(whole(), bodies=(replace(whole().bodies[0], damping=0.02),))
    varied = vary(scene, modes=modes, drop=("I5",), models={"beam": beam(3)})
    assert [body.name for body in varied.bodies] == ["beam_1", "beam_2", "beam_3"]
    assert [body.model.n for body in varied.bodies] == [modes] * 3
    assert all(body.dropped == ("I5",) for body in varied.bodies)
    parted = replace(whole(), bodies=(Body("beam", beam(3), damping=0.02),))
    for one, other in zip(varied.bodies, vary(parted, modes={"beam": modes}).bodies, strict=True):
        np.testing.assert_array_equal(one.model.omega2, other.model.omega2)
        np.testing.assert_array_equal(one.damping, other.damping)


# ---- the scene ----------------------------------------------------------------------------------------------------


def test_parts_take_the_place_of_their_whole():
    scene = pushed(beam(4))
    assert [body.name for body in scene.bodies] == ["beam_1", "beam_2", "beam_3", "beam_4"]
    assert [joint.name for joint in scene.joints] == ["clamp", "beam_cut_1", "beam_cut_2", "beam_cut_3"]
    assert replace(scene, name="again").bodies == scene.bodies
    assert len(replace(scene, joints=()).joints) == 3
    assert mobility(scene).redundant == ()


def test_pose_and_motion_of_the_whole_are_those_of_its_parts():
    motion = {"position": (1, 2, 3), "rotation": (0, 0, 0.5), "velocity": (3, 0, 1), "omega_bar": (1, -2, 0.5)}
    results = [
        integrate(
            Scene((Body("beam", beam(count), damping=0.02, **motion),)), end=0.05, output_step=0.05, method=ROS2(1e-4)
        )
        for count in (None, 4)
    ]
    for row in (0, 1):
        one, four = (result["beam.tip.position"][row] for result in results)
        np.testing.assert_allclose(four, one, atol=1e-5)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (lambda: Body("beam", beam(2), q=np.ones(14)), "start undeformed; leave out q"),
        (lambda: Body("beam", beam(2), damping=np.arange(14.0)), "give one damping ratio for all"),
    ],
)
def test_what_parts_cannot_take_from_the_whole(body, words):
    with pytest.raises(InputError, match=words):
        Scene((body(),))


def test_what_needs_a_part_says_so():
    with pytest.raises(InputError, match="body 'beam' is in parts; name one: beam_1, beam_2"):
        clamped(beam(2), forces=(ModalForce("f", "beam", np.ones(14)),))
    with pytest.raises(InputError, match=r"body 'beam' has no interface 'top'.*'tip'"):
        clamped(beam(2), loads=(Load("push", "beam.top", force=(0, 1, 0)),))


# ---- mechanics ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [2, 4])
def test_small_deflections_are_those_of_the_whole(count):
    """A parts' frame turns truly, so the tip comes in by 3/5 of the square of its deflection: 5e-7 of 1e-3."""
    one, several = (static(scene)["beam.tip.position"][-1] for scene in (whole(), pushed(beam(count))))
    np.testing.assert_allclose(several, one, atol=1e-6)
    assert several[1] - 0 == pytest.approx(one[1], rel=1e-5)


@pytest.mark.parametrize("count", [2, 4])
def test_frequencies_are_those_of_the_whole(count):
    one, several = (linearise(clamped(beam(n))).frequencies for n in (None, count))
    np.testing.assert_allclose(np.sort(several)[:8], np.sort(one)[:8], rtol=1e-3)


def elastica(load: float) -> np.ndarray:
    """(2,) tip of a clamped inextensible rod of length and bending stiffness one, under a dead force across it.

    theta'' = -load cos(theta), theta(0) = theta'(1) = 0 (Timoshenko & Gere, Theory of Elastic Stability, 1961, article 2.7).
    """
    s = np.linspace(0.0, 1.0, 101)
    found = solve_bvp(
        lambda s, y: np.array([y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]),
        lambda root, tip: np.array([root[0], tip[1], root[2], root[3]]),
        s,
        np.array([load * (s - s**2 / 2), load * (1 - s), s, load * s**2 / 3]),
        tol=1e-10,
    )
    assert found.success
    return found.y[2:, -1]


@pytest.mark.parametrize(("count", "goal"), [(None, 0.015), (2, 0.0015), (4, 0.0002)])
def test_a_cantilever_bent_to_two_fifths_of_its_length_is_the_elastica(count, goal):
    """The load that deflects the tip by 0.4 of the length; goals as shares of this."""
    load = 1.4430432465
    exact = elastica(load)
    assert exact[1] == pytest.approx(0.4, abs=1e-8)
    force = load * STEEL.E * 0.02 * 0.01**3 / 12
    scene = clamped(beam(count, stiffening=True), loads=(Load("push", "beam.tip", force=(0.0, force, 0.0)),))
    tip = static(scene)["beam.tip.position"][-1]
    assert tip[2] == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(tip[:2] - exact) < goal * exact[1]


def test_stress_and_section_forces_are_those_of_the_whole():
    sensors = (
        StressMeasurement("stress", "beam", (0.3, 0, 0), what="stress"),
        SectionMeasurement("m", "beam", (0.7, 0, 0)),
    )
    one, four = (static(pushed(beam(n), measurements=sensors)) for n in (None, 4))
    for name in ("measured.stress", "measured.m"):
        np.testing.assert_allclose(four[name], one[name], atol=2e-4 * np.abs(one[name]).max())


def test_the_order_in_which_a_scene_has_parts_changes_nothing():
    """Bodies in another order, with another one between them: each part is still found by the name of the whole."""
    sensors = (SectionMeasurement("root", "beam", (0.1, 0, 0)), SectionMeasurement("m", "beam", (0.7, 0, 0)))
    scene = pushed(beam(4), measurements=sensors)
    scene = replace(scene, bodies=tuple(replace(body, damping=0.01) for body in scene.bodies))
    mixed = replace(scene, bodies=tuple(scene.bodies[k] for k in (2, 0, 3, 1)))
    one, other = static(scene), static(mixed)
    assert sorted(other.attributes["notes"]) == sorted(one.attributes["notes"])
    for name in ("measured.root", "measured.m", "beam.tip.position", "clamp.force"):
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=1e-9 * np.abs(one[name]).max())


# ---- forces on surfaces -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "force",
    [
        lambda: Pressure("load", "beam", 100.0),
        lambda: Pressure("load", "beam", 100.0, triangles=lambda centres: centres[:, 2] > 0.0399),
        lambda: Pressure("load", "beam", np.linspace(0, 100, len(bar(None).surface.points)), triangles=np.arange(20)),
        lambda: NodalForces("load", "beam", np.arange(40), np.full((40, 3), 0.1)),
    ],
    ids=["all", "above", "some", "nodes"],
)
def test_loads_on_the_surface_of_a_whole_act_on_its_parts(force):
    one, several = (static(clamped(bar(n), forces=(force(),))) for n in (None, 4))
    for name in ("clamp.force", "clamp.moment"):
        np.testing.assert_allclose(several[name], one[name], atol=1e-3)
    tips = [result["beam.tip.position"][-1] - bar(None).interface("tip").position for result in (one, several)]
    np.testing.assert_allclose(tips[1], tips[0], atol=1e-3 * np.abs(tips[0]).max() + 1e-12)


# ---- results ------------------------------------------------------------------------------------------------------


def run(model: FlexibleBody) -> Result:
    scene = clamped(model, gravity=(0.0, 0.0, -50.0))
    return integrate(scene, end=0.02, output_step=0.005, method=ROS2(1e-4))


@pytest.mark.slow
def test_a_result_speaks_of_one_body(tmp_path):
    one, two = run(bar(None)), load_result(save_result(run(bar(2)), tmp_path / "run.nc"))
    assert two.attributes["parts"] == {"beam": ["beam_1", "beam_2"]}
    assert "beam.tip.position" in two.quantities
    spots = [hot_spots(result, count=1)[0] for result in (one, two)]
    assert spots[1].body == "beam"
    histories = [stress_histories(result, "beam", {"p": np.array((0.2, 0.0, 0.0))}) for result in (one, two)]
    np.testing.assert_allclose(*(h["beam.p.stress"] for h in histories), atol=0.03 * spots[0].value)


def test_beam_elements_of_parts_are_numbered_through():
    one, four = (static(pushed(beam(n))) for n in (None, 4))
    for element in (0, 6, 15):
        expected = section_forces(one, "beam", element)
        np.testing.assert_allclose(section_forces(four, "beam", element), expected, atol=2e-3)


@pytest.mark.slow
def test_pictures_join():
    """At any scale: the points that two parts share are drawn at one place, but for the square of the elastic rotation."""
    two, one = (film(run(bar(n)), 4, scale=5.0) for n in (2, None))
    (solid,), (whole,) = two.solids, one.solids
    points = drawn_points(solid, 3, two.scale)
    _, first, again = np.unique(solid.surface.points.round(9), axis=0, return_index=True, return_inverse=True)
    assert len(first) < len(points)
    np.testing.assert_allclose(points, points[first][again.ravel()], atol=1e-6)
    assert np.abs(displaced(solid, 3)).max() == pytest.approx(np.abs(displaced(whole, 3)).max(), rel=0.03)


# ---- files --------------------------------------------------------------------------------------------------------


def test_a_scene_file_names_the_whole(tmp_path):
    settings = Settings(start=0.0, end=0.1, output_step=0.1, method=ROS2(1e-3))
    path = save_scene(pushed(beam(2)), settings, tmp_path / "beam.toml")
    assert "[bodies.beam]" in path.read_text()
    assert "cut" not in path.read_text()
    scene, _ = load_scene(path)
    assert [body.name for body in scene.bodies] == ["beam_1", "beam_2"]
    np.testing.assert_array_equal(scene.bodies[1].model.PP_dm, beam(2).parts[1].PP_dm)


def test_a_formula_knows_markers_of_the_whole_and_coordinates_of_the_parts(tmp_path):
    settings = Settings(start=0.0, end=0.1, output_step=0.1, method=ROS2(1e-3))
    path = save_scene(clamped(beam(2)), settings, tmp_path / "beam.toml")
    formula = '"-100 * beam.tip.position.y + beam_2.q[1]"'
    path.write_text(path.read_text() + f'\n[loads.spring]\nmarker = "beam.tip"\nforce = [0, {formula}, 0]\n')
    assert static(load_scene(path)[0])["beam.tip.position"][-1, 1] == pytest.approx(0.0, abs=1e-9)


def test_deformed_parts_are_no_file(tmp_path):
    scene = pushed(beam(2))
    settings = Settings(start=0.0, end=0.1, output_step=0.1, method=ROS2(1e-3))
    with pytest.raises(InputError, match="parts of body 'beam' differ in pose or treatment, or are deformed"):
        save_scene(scene_at(scene, static(scene)), settings, tmp_path / "beam.toml")


# ---- how many -----------------------------------------------------------------------------------------------------


def bent(count: int | None) -> Scene:
    """To 0.39 of its length, by the force 1.4 EI / L^2 at the tip."""
    force = 1.4 * STEEL.E * 0.02 * 0.01**3 / 12
    return clamped(beam(count, stiffening=True), loads=(Load("push", "beam.tip", force=(0.0, force, 0.0)),))


def test_a_result_tells_how_many_parts_would_do():
    scene = bent(None)
    result = static(scene)
    (note,) = result.attributes["notes"]
    assert "body 'beam' deforms by up to 0.41 of its size and turns within itself by up to 0.6 rad" in note
    assert "7 parts would do (ffr-prep reduce --parts)" in note
    assert parts_needed(scene, result) == {"beam": 7}
    assert parts_needed(scene, result, angle=0.05) == {"beam": 25}
    small = static(whole())
    assert small.attributes["notes"] == []
    assert parts_needed(whole(), small) == {"beam": 1}
    with pytest.raises(InputError, match="must be positive"):
        parts_needed(whole(), small, angle=0.0)


@pytest.mark.slow
def test_parts_know_better_where_a_body_bends():
    """A part of two bends by more than half of the whole: the note is of the worst, and of all."""
    scene = bent(2)
    result = static(scene)
    (note,) = result.attributes["notes"]
    assert "body 'beam_1' deforms" in note
    assert f"{parts_needed(scene, result)['beam']} parts would do" in note
    assert parts_needed(scene, result)["beam"] > 5


def test_a_bent_body_in_parts_stays_as_it_is_where_a_result_has_left_it():
    """The joints between its parts hold them as they are drawn, not as they are turned then: statics ends where it begins."""
    still = clamped(beam(2), loads=(Load("push", "beam.tip", force=(0.0, 50.0, 0.0)),))
    bent = static(still)
    again = static(scene_at(still, bent))
    there = "beam.tip.position"
    np.testing.assert_allclose(again[there][-1], bent[there][-1], atol=1e-9)
    assert not [
        note for note in linearise(scene_at(still, bent)).notes if "assembly" in note or "no equilibrium" in note
    ]


def test_notes_on_the_mesh_and_on_cuts_are_those_of_the_whole():
    """The frequencies of a short part say nothing of the mesh of a long body."""
    model = bar(4)
    assert mesh_doubt(model.provenance) is None
    assert all(mesh_doubt(part.provenance) for part in model.parts)
    notes = assemble(clamped(model)).notes
    assert not any("mesh is too coarse" in note for note in notes)
    assert f"body 'beam': {cut_doubt(model.provenance)}" in notes


@pytest.mark.parametrize("stiffening", [False, True])
def test_damping_that_parts_do_not_keep_is_told_with_its_ratios(stiffening):
    model = beam(4, 4, stiffening=stiffening)
    free = linearise(Scene((Body("beam", model, damping=0.01),)))
    slowest = np.flatnonzero(free.frequencies > 1.0)[0]
    [note] = [note for note in assemble(Scene((Body("beam", model, damping=0.01),))).notes if "its parts damp" in note]
    assert (
        f"of {free.frequencies[slowest]:.4g} Hz by a ratio of {free.damping_ratios[slowest]:.2g}, and one piece by"
        in note
    )
    for kept in (
        Body("beam", damped(model, beta=1e-5)),
        Body("beam", model),
        Body("beam", beam(None, 4), damping=0.01),
    ):
        assert not any("its parts damp" in note for note in assemble(Scene((kept,))).notes)
    assert any("its parts damp" in note for note in assemble(Scene((Body("beam", damped(model, alpha=2.0)),))).notes)


def test_stress_beside_a_cut_is_told_by_runs_that_measure_it_and_kept_for_reports():
    measured = (StressMeasurement("a", "beam", (0.1, 0, 0.02)), StressMeasurement("b", "beam", (0.6, 0, 0.02)))
    result = static(pushed(bar(4), measurements=measured))
    told = "its stress within about a section's width of a cut is that of a section which is held rigid"
    assert len([note for note in result.attributes["notes"] if told in note]) == 1
    assert told in result.attributes["stress_lacks"]["beam_1"]
