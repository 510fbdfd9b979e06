"""Assembly where the vector between two points has no length: right for points that are held together, else refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_analyses_kinematic import bar
from test_dyn_plane import rod

from ffr_dyn.analyses.forward import forward
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.mobility import mobility
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.rotation import euler_parameters, rotation_matrix
from ffr_dyn.functions.time_functions import table
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError


def tied(kind: str, place: float = 0.0, **more) -> Scene:
    """A bar whose end is tied to the origin, at a distance from it."""
    return Scene(
        (Body("a", bar("a", 1.0), position=(place, 0, 0)),),
        (Joint("tie", kind, "ground.O", "a.a", **more),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )


@pytest.mark.parametrize(
    ("kind", "held"), [("point-on-line", [0, 1]), ("point-on-plane", [2]), ("cylindrical", [0, 1]), ("planar", [2])]
)
def test_points_that_coincide_may_be_held_on_a_line_or_a_plane(kind, held):
    """A dot-2 row keeps its direction, the axis, where the vector between the points is zero."""
    scene = tied(kind)
    assert not mobility(scene).redundant
    result = forward(scene, end=0.2, output_step=0.1, method=RK4(1e-3))
    np.testing.assert_allclose(result["a.a.position"][:, held], 0, atol=1e-12)


def test_a_distance_of_points_that_coincide_has_no_direction():
    with pytest.raises(InputError, match=r"the points of joint 'tie' coincide.* no length, has no direction; place"):
        forward(tied("distance", length=0.5), end=0.1, output_step=0.1)


@pytest.mark.parametrize("analysis", [mobility, lambda scene: forward(scene, end=0.1, output_step=0.1)])
@pytest.mark.parametrize("length", ["t", "t - 0.5"])
def test_a_distance_that_starts_at_zero_or_below_is_refused(analysis, length):
    with pytest.raises(InputError, match=r"joint 'tie': length is -?0(\.5)? m at t = 0 s; it must be positive"):
        analysis(tied("distance", 0.5, length=formula(length)))


def test_a_distance_that_shrinks_to_zero_stops_the_run_there():
    with pytest.raises(ComputationError, match=r"at t = 0\.49\d* s the row 'distance of the points' of 'tie'"):
        forward(tied("distance", 0.5, length=formula("0.5 - t")), end=0.6, output_step=0.1, method=RK4(1e-3))


def test_a_spring_without_a_free_length_is_told():
    def told(**given):
        springs = (SpringDamper("s", "ground.O", "a.b", **given),)
        return [note for note in assemble(replace(tied("revolute"), springs=springs)).notes if "free_length" in note]

    assert told(stiffness=10.0)[0].startswith("spring 's' has no free_length, so it pulls with its stiffness times all")
    assert not told(stiffness=10.0, free_length=0.0)
    assert not told(stiffness=0.0, damping=1.0)


def test_a_force_on_the_ground_alone_is_told():
    idle = (Load("push", "ground.O", (0, 1, 0)), Load("pull", "a.b", (0, 1, 0)))
    notes = assemble(replace(tied("revolute"), loads=idle)).notes
    assert [note[:40] for note in notes if "does nothing" in note] == ["'push' acts on ground.O alone, and the g"]


def test_a_driver_without_a_value_at_the_start_is_named():
    with pytest.raises(InputError, match="driver 'motor': the function of time has no value at t = 0 s"):
        assemble(replace(tied("revolute"), drivers=(Driver("motor", "tie", formula("log(t)")),)))


def welded(**axes) -> Scene:
    """A bar clamped at a slant, with another at right angles to it at its end, drawn a bit off."""
    slant, across = (0.0, 0.3, 0.5), np.array([0.0, 0.3, 0.5 + np.pi / 2])
    tip = rotation_matrix(euler_parameters(slant, "slant")) @ [1.0, 0, 0]
    return Scene(
        (
            Body("a", bar("a", 1.0), rotation=slant),
            Body("b", bar("b", 1.0), position=tip + np.array([0.0, 0.01, 0.0]), rotation=across),
        ),
        (Joint("clamp", "fixed", "ground.O", "a.a", **axes), Joint("weld", "fixed", "a.b", "b.a", **axes)),
        ground={"O": (0, 0, 0)},
    )


def test_a_fixed_joint_keeps_attitudes_as_they_are_drawn_and_brings_points_together():
    scene = welded()
    assembled = assemble(scene)
    place = assembled.system.layout
    for b, body in enumerate(scene.bodies):
        np.testing.assert_allclose(assembled.x[place.p(b)], body.rotation, rtol=0, atol=1e-12)
    assert assembled.degrees_of_freedom == 0
    assert any("assembly moved body 'b' by 0.01 m" in note for note in assembled.notes)
    again = replace(scene, bodies=tuple(replace(body, rotation=(0, 0, 0)) for body in scene.bodies))
    assert again.joints == scene.joints  # the scene has decided


def test_a_fixed_joint_with_an_axis_brings_both_frames_together():
    assembled = assemble(welded(axis=(0, 0, 1)))
    for b in range(2):
        np.testing.assert_allclose(np.abs(assembled.x[assembled.system.layout.p(b)]), (1, 0, 0, 0), rtol=0, atol=1e-10)


def test_a_velocity_that_joints_do_not_allow_is_told():
    """It began with half of it, or with none, without a word."""
    scene = tied("spherical")
    thrown = replace(scene, bodies=(replace(scene.bodies[0], velocity=(2.0, 0, 0), omega_bar=(0, 0, 3.0)),))
    (told,) = [note for note in assemble(thrown).notes if "as the scene says" in note]
    assert told.startswith(
        "body 'a' begins with velocity (0, 0, 0) m/s, not (2, 0, 0) as the scene says: joints and drivers"
    )
    for rounding in ((0, 0, 0), (1e-16, -3e-16, 0)):
        turning = replace(scene, bodies=(replace(scene.bodies[0], velocity=rounding, omega_bar=(0, 0, 3.0)),))
        assert not any("as the scene says" in note for note in assemble(turning).notes)


def test_a_shaft_whose_bores_are_a_hair_off_their_line_is_not_turned_about_it():
    """As of an unstructured mesh. It was turned by up to half a radian to close the hair, and had no rigid freedom."""
    model = rod("shaft", 1.0)
    off = {"a": (-5.4e-10, 5.8e-10, 3.6e-10), "b": (2.9e-10, 2.8e-11, 5.5e-10)}
    model = replace(model, interfaces=tuple(replace(i, position=i.position + off[i.name]) for i in model.interfaces))
    bearings = (
        Joint("a", "revolute", "ground.O", "shaft.a", axis=(1, 0, 0)),
        Joint("b", "cylindrical", "ground.E", "shaft.b", axis=(1, 0, 0)),
    )
    ground = {"O": (0, 0, 0), "E": (1, 0, 0)}
    scene = Scene((Body("shaft", model, omega_bar=(10, 0, 0)),), bearings, ground=ground)
    assembled = assemble(scene)
    assert not any("turned" in note for note in assembled.notes)
    np.testing.assert_allclose(assembled.x[assembled.system.layout.p(0)], (1, 0, 0, 0), rtol=0, atol=1e-7)
    assert mobility(scene).rigid == 1


def test_a_table_whose_spline_swings_far_beyond_its_rows_is_told():
    """As of a cam that dwells and rises at corners; with more rows beside the corners it does not."""
    corners = np.array([[0, 0.05, 0.051, 0.12, 0.121, 0.2], [0, 0, 0.002, 0.03, 0.03, 0]])
    beside = np.unique(
        np.concatenate([corners[0], *(corners[0] + by for by in (-1e-3, -5e-4, 5e-4, 1e-3))]).clip(0, 0.2)
    )
    told = []
    for times in (corners[0], beside):
        cam = Driver("cam", "tie", table(times, np.interp(times, *corners)))
        notes = assemble(replace(tied("revolute"), drivers=(cam,))).notes
        told.append([note for note in notes if "spline" in note])
    assert told[1] == []
    assert told[0] == [
        "driver 'cam': the cubic spline through its table goes to -0.05154 at t = 0.01978 s, where its rows hold 0 to 0.03; "
        "give more rows beside its corners, or a piecewise function"
    ]
