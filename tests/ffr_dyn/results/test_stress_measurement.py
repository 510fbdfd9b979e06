"""Stress at places and section forces as measurements of a scene: equal to recovery afterwards, saved, in files, guarded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.rotating.response import response
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble, flattened
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.integrators import ROS2
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.stress import section_histories, stress_histories
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement, SectionMeasurement, StressMeasurement
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import to_toml
from ffr_prep.body import rigid_body, save_body
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

EDGE, MIDDLE = (0.0, 0.01, 0.0065), (0.5, 0.0, 0.0)
MEASUREMENTS = (
    StressMeasurement("notch", "boom", EDGE),
    StressMeasurement("tensor", "boom", EDGE, what="stress"),
    StressMeasurement("strains", "boom", EDGE, what="strain"),
    StressMeasurement("stretch", "boom", EDGE, what="strain-max-principal"),
    SectionMeasurement("bending", "boom", MIDDLE),
    SectionMeasurement("shear", "boom", (0.0, 0.0, 0.0), what="force", place="first"),
)


@pytest.fixture(scope="module")
def boom():
    member = Member(rectangle(0.013, 0.02), Material("aluminium", 7e10, 0.3, 2700.0), orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=8), root=(0, 0, 0), tip=(1.0, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")]),
        fp.Request(name="boom", reference=FixedTo("root"), reduction=CraigBampton(2), stress=True),
    )


def swinging(boom, **changes) -> Scene:
    scene = Scene(
        (Body("boom", boom),),
        (Joint("bearing", "revolute", "ground.O", "boom.root"),),
        (Driver("motor", "bearing", harmonic(amplitude=0.3, frequency=2.0)),),
        measurements=(*MEASUREMENTS, Measurement("reach", "ground.O", "boom.tip", "distance")),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    return replace(scene, **changes)


@pytest.fixture(scope="module")
def run(boom):
    return integrate(swinging(boom), end=0.2, output_step=0.01, method=ROS2(1e-4))


def test_measured_stress_is_that_recovered_afterwards(run):
    place = {"notch": np.array(EDGE)}
    for measure, ours in (("von-mises", "notch"), ("strain-max-principal", "stretch")):
        later = stress_histories(run, "boom", place, measure)
        expected = later[f"boom.notch.{measure}"]
        np.testing.assert_allclose(run[f"measured.{ours}"], expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    for ours, what in (("tensor", "stress"), ("strains", "strain")):
        expected = later[f"boom.notch.{what}"]
        np.testing.assert_allclose(run[f"measured.{ours}"], expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert run["measured.notch"].max() > 1e6


def test_measured_section_forces_are_those_recovered_afterwards(run):
    bending = section_histories(run, "boom", 3)["boom.element_3.middle.moment"]
    shear = section_histories(run, "boom", 0)["boom.element_0.first.force"]
    for name, expected in (("bending", bending), ("shear", shear)):
        np.testing.assert_allclose(run[f"measured.{name}"], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("measurement", [MEASUREMENTS[0], SectionMeasurement("pull", "boom", MIDDLE, what="force")])
def test_what_shapes_leave_out_of_them_is_told(boom, measurement):
    """Two modes hold no tension that grows towards the hub."""
    notes = assemble(swinging(boom, measurements=(measurement,))).notes
    assert any("'boom': its shapes leave out stress of its own inertia" in note for note in notes)
    assert not any("leave out" in note for note in assemble(swinging(boom, measurements=())).notes)


@pytest.mark.parametrize("parts", [None, 2])
@pytest.mark.parametrize("relief", [False, True])
def test_of_what_shapes_leave_out_a_run_tells_what_its_motion_can_load(parts, relief):
    """In the plane nothing weighs or turns across it; of a body in parts the one that is measured tells."""
    member = Member(rectangle(0.013, 0.02), Material("aluminium", 7e10, 0.3, 2700.0), orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=8), root=(0, 0, 0), tip=(1.0, 0, 0))
    model = fp.from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")])
    shapes = fp.Union((CraigBampton(2), fp.InertiaRelief())) if relief else CraigBampton(2)
    request = fp.Request(name="boom", reference=FixedTo("root"), reduction=shapes, stress=True, parts=parts)
    pull = SectionMeasurement("pull", "boom", (0.4, 0, 0), what="force")
    scene = swinging(fp.reduce(model, request), measurements=(pull,), plane="z")
    told = "".join(note for note in assemble(scene).notes if "leave out stress" in note)
    assert ("under spin about z" in told) is not relief
    assert "along z" not in told
    assert "spin about y" not in told


def clamped(boom, what, weight):
    """Shaken up and down, its stress at the clamp told as `what`."""
    notch = StressMeasurement("notch", "boom", EDGE, what=what)
    clamp = (Joint("clamp", "fixed", "ground.O", "boom.root"),)
    scene = swinging(boom, joints=clamp, drivers=(), measurements=(notch,), gravity=(0, -weight, 0))
    found = response(scene, input="base.y", outputs=["measured.notch"], frequencies=[5.0], about="equilibrium")
    return found["gain"][0, 0]


@pytest.mark.parametrize("what", ["von-mises", "tresca", "max-principal", "min-principal"])
def test_sizes_of_stress_have_slopes_where_there_is_some(boom, what):
    """Where there is none, as where nothing weighs, they go up both ways, and the mean of both slopes is nothing."""
    with pytest.raises(InputError, match=r"'measured\.notch' is 0 here and has no slope"):
        clamped(boom, what, weight=0.0)
    gain = 0.0 if what == "min-principal" else clamped(boom, "xx", weight=9.81)
    assert clamped(boom, what, weight=9.81) == pytest.approx(gain, rel=1e-4)


@pytest.mark.parametrize("beyond", [1e-4, 0.01])
def test_just_beyond_a_cut_sections_are_those_of_the_element_there(beyond):
    """The nearest points of the surface are those of the cut, which both parts have."""
    member = Member(rectangle(0.013, 0.02), Material("aluminium", 7e10, 0.3, 2700.0), orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=8), root=(0, 0, 0), tip=(1.0, 0, 0))
    model = fp.from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")])
    request = fp.Request(name="boom", reference=FixedTo("root"), reduction=CraigBampton(2), stress=True, parts=2)
    section = SectionMeasurement("bending", "boom", (0.5 + beyond, 0, 0), place="first")
    scene = Scene(
        (Body("boom", fp.reduce(model, request)),),
        (Joint("clamp", "fixed", "ground.O", "boom.root"),),
        loads=(Load("push", "boom.tip", force=(0, 1.0, 0)),),
        measurements=(section,),
        ground={"O": (0, 0, 0)},
    )
    assert static(scene)["measured.bending"][0, 2] == pytest.approx(0.5, rel=1e-6)


def test_they_have_units_and_are_saved(run, tmp_path):
    units = {"notch": "Pa", "tensor": "Pa", "strains": "1", "stretch": "1", "bending": "N m", "shear": "N"}
    saved = load_result(save_result(run, tmp_path / "run.nc"))
    for name, unit in units.items():
        assert run.quantity(f"measured.{name}").unit == unit
        np.testing.assert_array_equal(saved[f"measured.{name}"], run[f"measured.{name}"])
    assert saved.quantity("measured.tensor").axes[0].labels == ("xx", "yy", "zz", "xy", "xz", "yz")
    assert saved.quantity("measured.bending").axes[0].labels == ("Mx", "My", "Mz")
    assert "at [0.0, 0.01, 0.0065] m" in saved.quantity("measured.notch").description


def test_a_planar_scene_stays_planar_and_measures_the_same(boom, run):
    """Measurements do not push anything across the plane."""
    assert flattened(swinging(boom), 0.0)[0].plane == "z"
    spatial = integrate(swinging(boom, plane="none"), end=0.2, output_step=0.01, method=ROS2(1e-4))
    for name in ("notch", "bending", "reach"):
        expected = spatial[f"measured.{name}"]
        np.testing.assert_allclose(run[f"measured.{name}"], expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_only_what_is_wanted_is_kept(boom):
    kept = integrate(swinging(boom), end=0.01, output_step=0.01, method=ROS2(1e-4), outputs=("measured.notch",))
    assert list(kept.quantities) == ["measured.notch"]


def test_they_survive_a_scene_file(boom, tmp_path):
    path = save_body(boom, tmp_path / "boom.ffr")
    settings = Settings(start=0.0, end=0.1, output_step=0.01, method=ROS2(1e-4), stabilisation=Projection())
    (tmp_path / "scene.toml").write_text(to_toml(swinging(boom), settings, {"boom": str(path)}))
    scene, _ = load_scene(tmp_path / "scene.toml")
    assert repr(scene.measurements) == repr(swinging(boom).measurements)


@pytest.mark.parametrize(
    ("measurement", "message"),
    [
        (StressMeasurement("m", "bom", EDGE), "measurement 'm': there is no body 'bom'; did you mean 'boom'"),
        (StressMeasurement("m", "ball", EDGE), "body 'ball' has no stress modes; reduce it again"),
        (StressMeasurement("m", "boom", EDGE, what="mises"), "'mises' is not known; there are: von-mises"),
        (StressMeasurement("m", "boom", (0.0, 500.0, 0.0)), "m from body 'boom'.*give it in metres"),
        (SectionMeasurement("m", "ball", EDGE), "body 'ball' has no section forces"),
        (SectionMeasurement("m", "boom", (0.0, 500.0, 0.0)), "m from body 'boom'.*give it in metres"),
    ],
)
def test_measurements_that_cannot_be_made(boom, measurement, message):
    ball = rigid_body("ball", mass=1.0, inertia=(1, 1, 1))
    scene = swinging(boom)
    with pytest.raises(InputError, match=message):
        replace(scene, bodies=(*scene.bodies, Body("ball", ball)), measurements=(measurement,))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"what": "bending"}, "what is 'bending'"),
        ({"place": "end"}, "first, middle, last"),
        ({"point": (1.0, 2.0)}, "three coordinates"),
    ],
)
def test_section_measurements_name_what_there_is(changes, message):
    with pytest.raises(InputError, match=message):
        SectionMeasurement("m", "boom", **({"point": EDGE} | changes))
