"""The quasi-static start: what begins in it does not ring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_beam import planar_beam
from test_dyn_plane import rod, slider_crank

import ffr_dyn as fd
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.trials import begin
from ffr_dyn.chart.runner import Job, perform
from ffr_dyn.chart.variants import Model, Variant
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import total_mass_matrix
from ffr_dyn.consistency.quasi_static import quasi_static
from ffr_dyn.equations.layout import to_body_axes
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError


def rotor(speed: float, *, stiffening: bool, **changes) -> fd.Scene:
    """A rod that a motor turns about one end."""
    parts = {
        "bodies": (fd.Body("rod", rod("rod", 0.8, stiffening=stiffening), omega_bar=(0, 0, speed), damping=0.0),),
        "joints": (fd.Joint("hinge", "revolute", "ground.O", "rod.a"),),
        "drivers": (fd.Driver("motor", "hinge", fd.polynomial(0, speed)),),
        "ground": {"O": (0, 0, 0)},
    }
    return fd.Scene(**parts | changes)


@pytest.mark.parametrize("stiffening", [False, True], ids=["linear", "second order"])
@pytest.mark.parametrize("speed", [10.0, 200.0])
def test_a_rotor_starts_in_its_steady_deflection(speed, stiffening):
    """Also beyond its first frequency, 105 rad/s."""
    scene = rotor(speed, stiffening=stiffening)
    how = {"end": 0.02, "output_step": 1e-4, "method": fd.RK4(5e-6), "stabilisation": fd.Projection(1e-13)}
    q = fd.forward(scene, begin="quasi-static", check=False, **how)["rod.q"]
    assert np.ptp(q, axis=0).max() < 1e-6 * np.abs(q).max()
    steady = fd.inverse(scene, end=0.02, output_step=0.02, elastic=fd.QuasiStatic())["rod.q"][0]
    np.testing.assert_allclose(q[0], steady, atol=1e-6 * np.abs(q).max())


@pytest.mark.parametrize("stiffening", [False, True], ids=["linear", "second order"])
@pytest.mark.parametrize("plane", ["auto", "none"])
def test_a_crank_that_starts_so_hardly_rings(plane, stiffening):
    """In space three rows of its joints are redundant for rigid bodies. The motion is periodic, its loads are not quite."""
    scene = slider_crank(rod={"stiffening": stiffening}, plane=plane, loads=())
    turn = 2 * np.pi / 40
    start = assemble(scene)
    runs = [
        integrate(scene, end=turn, output_step=turn / 300, method=fd.RK4(turn / 30000), assembled=state)["big.force"]
        for state in (start, quasi_static(start, 0.0))
    ]
    shock, quiet = (np.abs(np.diff(force, 3, axis=0)).max() for force in runs)
    assert quiet < 0.01 * shock
    assert np.abs(runs[1][-1] - runs[1][0]).max() < 1e-3 * np.abs(runs[1]).max()


def test_deflections_follow_a_free_motion():
    """A pendulum that is let go: the force at its hinge is that of the rigid one, which shortens the rod by nothing."""
    scene = rotor(0.0, stiffening=True, drivers=(), gravity=(0, -9.81, 0))
    how = {"end": 0.1, "output_step": 1e-3, "method": fd.RK4(1e-5), "check": False}
    rigid = fd.forward(fd.vary(scene, rigid=["rod"]), **how)["hinge.force"]
    ringing, quiet = (fd.forward(scene, begin=word, **how)["hinge.force"] for word in ("as-given", "quasi-static"))
    assert np.abs(ringing - rigid).max() > 0.1 * np.abs(rigid).max()
    assert np.abs(quiet - rigid).max() < 1e-3 * np.abs(rigid).max()


def test_a_free_body_keeps_its_momentum_and_ends_up_turning_steadily():
    body = replace(rotor(0.0, stiffening=True).bodies[0], omega_bar=(0, 0, 100.0), velocity=(1.0, 2.0, 3.0))
    start = assemble(fd.Scene((body,)))
    settled = quasi_static(start, 0.0)
    place, scene = start.system.layout, start.system.scene
    momenta = [(total_mass_matrix(scene, place, s.x) @ to_body_axes(place, s.x, s.v))[:6] for s in (start, settled)]
    np.testing.assert_allclose(*momenta, atol=1e-4 * np.abs(momenta[0]).max())
    q = fd.forward(scene, end=0.01, output_step=1e-4, method=fd.RK4(5e-6), assembled=settled, check=False)["rod.q"]
    assert np.ptp(q, axis=0).max() < 1e-3 * np.abs(q).max()


@pytest.mark.parametrize(("frequency", "slow"), [(100.0, False), (20.0, False), (1.0, True)])
def test_a_motion_as_fast_as_the_vibration_is_told(frequency, slow):
    """A rod of 26 Hz that is shaken, an eighth of an oscillation after the start."""
    motor, time = fd.Driver("m", "hinge", fd.harmonic(amplitude=1e-3, frequency=frequency)), 0.125 / frequency
    shaken = rotor(0.0, stiffening=False, drivers=(motor,))
    notes = quasi_static(assemble(shaken, time=time), time).notes
    assert any("not slow" in note for note in notes) != slow


def test_rigid_bodies_and_other_words():
    scene = fd.vary(rotor(3.0, stiffening=False), rigid=["rod"])
    start = assemble(scene)
    assert quasi_static(start, 0.0) is start
    with pytest.raises(InputError, match="begin is 'still'"):
        fd.forward(scene, end=1.0, output_step=0.1, begin="still")


def test_the_solvers_of_others_begin_so_too():
    scene, how = rotor(30.0, stiffening=False), {"end": 0.01, "output_step": 1e-3, "begin": "quasi-static"}
    run = fd.forward(scene, **how, method=fd.RK4(1e-5), check=False)
    exact = fd.reference(scene, **how)
    np.testing.assert_allclose(exact["rod.q"], run["rod.q"], rtol=0, atol=1e-8 * np.abs(run["rod.q"]).max())
    with pytest.raises(InputError, match="begin is 'still'"):
        fd.reference(scene, end=1.0, output_step=0.1, begin="still")


def test_runs_of_a_chart_begin_so_each_in_its_own_deflections():
    """Started straight all of them would swing by twice the steady deflection; now none swings."""
    scene, span = rotor(200.0, stiffening=False), fd.Span(0.02, 1e-3, begin="quasi-static")
    measures = fd.measures_of(scene, ["deflection:rod.b"])
    models = [Model(), Model("without I9", drop=("I9",))]
    with fd.pool(workers=0) as here:
        jobs = [Job(scene, Variant("ros3", 1e-4, model), span, measures, repeats=1) for model in models]
        for job in jobs:
            (values,) = perform(job).values.values()
            assert np.ptp(values, axis=0).max() < 1e-3 * np.abs(values).max()
        made = fd.work_precision(scene, span, here, measures=measures, methods={"ros3": [1e-4]}, repeats=1)
    found = made.reference.values["deflection:rod.b"]
    assert np.ptp(found, axis=0).max() < 1e-6 * np.abs(found).max()


def test_the_economiser_takes_a_model_for_runs_that_begin_so():
    scene, how = rotor(200.0, stiffening=False), {"end": 0.02, "output_step": 1e-3, "begin": "quasi-static"}
    found = fd.economise(scene, ["rod.b.position.x=1e-8"], **how)
    assert found.settings.analysis.begin == "quasi-static"
    exact = fd.reference(scene, **how)["rod.b.position.x"]
    np.testing.assert_allclose(fd.run(found.scene, found.settings)["rod.b.position.x"], exact, rtol=0, atol=1e-8)


def arm_in_a_plane(speed, gravity, plane):
    """A slender beam whose root turns evenly; in a plane its inertia across it is not kept up."""
    beam = planar_beam("arm", 1.0, 0.5, 50.0, 3)
    hinge = Joint("hinge", "revolute", "ground.O", "arm.root")
    motor = Driver("motor", "hinge", polynomial(0.0, speed))
    body = Body("arm", beam, omega_bar=(0, 0, speed))
    return Scene((body,), (hinge,), (motor,), ground={"O": (0, 0, 0)}, gravity=(0, -gravity, 0), plane=plane)


def test_a_plane_has_the_deflections_of_space():
    found = [quasi_static(assemble(arm_in_a_plane(10.0, 9.81, plane)), 0.0) for plane in ("auto", "none")]
    flat, spatial = (one.x[one.system.layout.q(0)] for one in found)
    np.testing.assert_allclose(flat, spatial, rtol=1e-6, atol=1e-9)
    assert np.abs(flat).max() > 4e-3


@pytest.mark.parametrize("speed", [0.0, 5.0, 20.0])
def test_what_nothing_bends_is_slow(speed):
    notes = quasi_static(assemble(arm_in_a_plane(speed, 0.0, "auto")), 0.0).notes
    assert not any("not slow" in note for note in notes)


def test_a_motion_that_is_too_fast_is_told_what_else_there_is():
    notes = quasi_static(assemble(arm_in_a_plane(20.0, 9.81, "auto")), 0.0).notes
    assert any(
        "not slow" in note and 'begin = "steady" starts a scene that rests in its equilibrium' in note for note in notes
    )


@pytest.mark.parametrize("driven", [True, False])
def test_where_the_start_leads_nowhere_the_search_begins_from_where_the_driven_scene_rests(driven, monkeypatch):
    def failing(assembled, time):
        if not assembled.x[7:].any():  # undeformed
            raise ComputationError("no quasi-static deflections were found")
        return quasi_static(assembled, time)

    scene = rotor(10.0, stiffening=False, gravity=(0, -9.81, 0), **({} if driven else {"drivers": ()}))
    start = assemble(scene)
    monkeypatch.setattr(begin, "quasi_static", failing)
    if driven:
        found = begin.begun(start, 0.0, "quasi-static")
        np.testing.assert_allclose(found.x, quasi_static(start, 0.0).x, atol=1e-9 * np.abs(found.x[7:]).max())
    else:
        with pytest.raises(ComputationError, match="no quasi-static"):
            begin.begun(start, 0.0, "quasi-static")
