"""Conversion of reference conditions: equal to reducing under them, and back again; motion; losses; guards."""

from __future__ import annotations

import numpy as np
import pytest
from boxes import STEEL, box_mesh, moved, rotation
from test_docs import ROOT, code
from test_prep_cli import assert_fails, run
from test_structural import regions, space_frame

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import axial, load_body, save_body
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports, UserConditions
from ffr_prep.reduction.conversion import with_reference
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.inertia_relief import InertiaRelief
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.methods.union import Union

SIZE = (1.0, 0.12, 0.07)
BOTH = (InterfaceRegion("left"), InterfaceRegion("right", kind="mean"))
REFERENCES = (FixedTo("left"), FixedTo("right"), SimplySupported("left", "right"), MeanAxis())
INTEGRALS = ("P_dm", "rP_dm", "PP_dm")


def reduced(reference, reduction=None, **options):
    mesh = moved(box_mesh("hex20", SIZE, (5, 1, 1)), rotation(8), np.array([0.1, 0.2, -0.3]))
    return fp.reduce(
        fp.from_mesh(mesh, STEEL, BOTH),
        fp.Request(name="b", reference=reference, reduction=reduction or CraigBampton(5), **options),
    )


@pytest.fixture(scope="module")
def bodies():
    return {reference: reduced(reference, stress=True) for reference in REFERENCES}


def signs(one, other):
    """(n,) by which the modes of one are those of the other."""
    return np.sign(np.einsum("pkn,pkn->n", one.surface.Phi, other.surface.Phi))


def assert_same(one, other, rtol=1e-9):
    """Frequencies, integrals, interfaces and surface, up to the signs of the modes."""
    np.testing.assert_allclose(one.omega2, other.omega2, rtol=rtol)
    s = signs(one, other)
    sizes = {"P_dm": np.sqrt(one.mass), "rP_dm": np.sqrt(np.trace(one.rr_dm)), "PP_dm": 1.0}
    for key in INTEGRALS:
        value = getattr(one, key) * s
        value = value * s[:, None] if key == "PP_dm" else value
        expected = getattr(other, key)
        np.testing.assert_allclose(value, expected, rtol=0, atol=1e-6 * sizes[key], err_msg=key)
    for a, b in zip(one.interfaces, other.interfaces, strict=True):
        scale = max(np.abs(i.phi_t).max() for i in other.interfaces)
        np.testing.assert_allclose(a.phi_t * s, b.phi_t, rtol=0, atol=1e-6 * scale)
        scale = max(np.abs(i.phi_r).max() for i in other.interfaces)
        np.testing.assert_allclose(a.phi_r * s, b.phi_r, rtol=0, atol=1e-6 * scale)
    np.testing.assert_allclose(one.surface.Phi * s, other.surface.Phi, atol=1e-6 * np.abs(other.surface.Phi).max())


# ---- laws -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("new", REFERENCES, ids=str)
@pytest.mark.parametrize("old", REFERENCES, ids=str)
def test_converting_is_reducing_under_the_other_conditions(bodies, old, new):
    converted = with_reference(bodies[old], new)
    direct = bodies[new]
    assert_same(converted, direct, rtol=1e-7)
    np.testing.assert_allclose(converted.frequencies[:8], direct.frequencies[:8], rtol=1e-9)
    s = signs(converted, direct)
    stress = direct.surface.stress
    np.testing.assert_allclose(converted.surface.stress * s, stress, atol=1e-6 * np.abs(stress).max())
    assert converted.provenance["reference"] == direct.provenance["reference"]
    assert [warning for warning in converted.provenance["warnings"] if "stress of its own inertia" not in warning] == []


@pytest.mark.parametrize("new", REFERENCES[1:], ids=str)
def test_back_and_forth_is_the_identity(bodies, new):
    body = bodies[REFERENCES[0]]
    assert_same(with_reference(with_reference(body, new), REFERENCES[0]), body)


@pytest.mark.parametrize(
    "reduction", [Rubin(4), Union((CraigBampton(3), InertiaRelief()))], ids=lambda r: type(r).__name__
)
def test_other_reductions_convert_as_well(reduction):
    converted = with_reference(reduced(FixedTo("left"), reduction), MeanAxis())
    direct = reduced(MeanAxis(), reduction)
    np.testing.assert_allclose(converted.frequencies, direct.frequencies, rtol=1e-6)
    np.testing.assert_allclose(converted.frequencies[:6], direct.frequencies[:6], rtol=1e-8)


@pytest.mark.slow
def test_frames_of_beams_convert_with_their_section_forces():
    def made(reference):
        return fp.reduce(
            fp.from_frame(space_frame(), regions("a", "b")),
            fp.Request(name="f", reference=reference, reduction=CraigBampton(4), stress=True),
        )

    converted, direct = with_reference(made(FixedTo("a")), SimplySupported("a", "b")), made(SimplySupported("a", "b"))
    np.testing.assert_allclose(converted.frequencies, direct.frequencies, rtol=1e-8)
    s = signs(converted, direct)
    forces = direct.surface.beams.modes
    np.testing.assert_allclose(converted.surface.beams.modes * s, forces, atol=1e-6 * np.abs(forces).max())


def test_models_of_every_kind_find_interfaces_where_they_are():
    frame = fp.from_frame(space_frame(), regions("a", "b", "c"))
    request = fp.Request(
        name="f", reference=SimplySupported("nearest 0.1,0,0", "plane x=1.1"), reduction=CraigBampton(2)
    )
    assert fp.reduce(frame, request).provenance["reference"] == {"type": "SimplySupported", "pin": "a", "roller": "b"}


def test_the_mean_axis_leaves_no_momentum(bodies):
    converted = with_reference(bodies[FixedTo("left")], MeanAxis())
    assert np.abs(converted.P_dm).max() < 1e-10
    assert np.abs(axial(converted.rP_dm)).max() < 1e-10


def test_more_than_six_conditions_leave_fewer_modes(bodies):
    both = Supports(
        tuple(
            Support(end, motion, tuple(axis))
            for end in ("left", "right")
            for motion in ("translation", "rotation")
            for axis in np.eye(3)
        )
    )
    converted = with_reference(bodies[MeanAxis()], both)
    np.testing.assert_allclose(converted.frequencies, reduced(both).frequencies, rtol=1e-8)
    assert converted.n == 5
    back = with_reference(converted, FixedTo("left"))
    assert "12 conditions" in back.provenance["warnings"][0]
    assert "only 6 independent motions of its 12" in back.provenance["warnings"][1]


def test_eigenmodes_say_what_they_lose():
    converted = with_reference(reduced(FixedTo("left"), Eigenmodes(4)), MeanAxis())
    assert "only 10 independent motions of its 12 interface coordinates" in converted.provenance["warnings"][0]
    assert converted.provenance["converted_from"] == {"type": "FixedTo", "interface": "left"}


def test_the_motion_is_the_same(bodies):
    """A soft pendulum in three frames: the hinge point falls on the same path to second order in the strain."""
    rod = fp.reduce(
        fp.from_mesh(
            box_mesh("hex20", (1.0, 0.02, 0.02), (6, 1, 1)),
            Material("soft", 7e10, 0.3, 2700.0),
            [InterfaceRegion("left", kind="mean"), InterfaceRegion("right", kind="mean")],
        ),
        fp.Request(name="rod", reference=FixedTo("left"), reduction=CraigBampton(2)),
    )

    def tip(body):
        hinge = Joint("hinge", "revolute", "ground.O", "rod.left")
        scene = Scene((Body("rod", body),), (hinge,), ground={"O": (0, 0.01, 0.01)}, gravity=(0, -9.81, 0))
        return integrate(scene, end=0.3, output_step=0.1, method=ROS2(1e-4))["rod.right.position"]

    paths = [
        tip(body)
        for body in (rod, with_reference(rod, MeanAxis()), with_reference(rod, SimplySupported("left", "right")))
    ]
    sag = 1e-3  # the rod bends by about this
    for path in paths[1:]:
        np.testing.assert_allclose(path, paths[0], atol=0.02 * sag)


def test_the_body_file_holds_a_converted_body(bodies, tmp_path):
    converted = with_reference(bodies[FixedTo("left")], MeanAxis())
    again = load_body(save_body(converted, tmp_path / "b.ffr"))
    np.testing.assert_array_equal(again.PP_dm, converted.PP_dm)
    assert again.provenance["converted_from"]["type"] == "FixedTo"


def test_the_command_line_converts(bodies, tmp_path, capsys):
    save_body(bodies[FixedTo("left")], tmp_path / "b.ffr")
    run("convert", tmp_path / "b.ffr", "--reference", "simply-supported:left,right", "-o", tmp_path / "c.ffr")
    assert_same(load_body(tmp_path / "c.ffr"), bodies[SimplySupported("left", "right")], rtol=1e-7)
    assert "modes       11" in capsys.readouterr().out
    assert_fails(
        capsys, "no interface 'x'", "convert", tmp_path / "b.ffr", "--reference", "fixed:x", "-o", tmp_path / "d"
    )
    assert not (tmp_path / "d").exists()


@pytest.mark.slow
def test_the_examples_of_the_documentation_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    space: dict = {}
    for text in code("docs/reduction.md", "python"):
        exec(compile(text, "reduction", "exec"), space)
    assert (tmp_path / "quality" / "receptances.png").exists()
    assert space["floating"].n == space["rod"].n
    assert np.abs(space["floating"].P_dm).max() < 1e-9


# ---- guards -----------------------------------------------------------------------------------------------------------


def test_interfaces_are_found_where_they_are(bodies):
    body = bodies[next(iter(bodies))]
    near, far = body.interfaces[:2]
    place = "nearest " + ",".join(f"{x:.17g}" for x in far.position)
    np.testing.assert_array_equal(
        with_reference(body, FixedTo(place)).omega2, with_reference(body, FixedTo(far.name)).omega2
    )
    told = with_reference(body, SimplySupported(near.name, place)).provenance["reference"]
    assert told == with_reference(body, SimplySupported(near.name, far.name)).provenance["reference"]
    with pytest.raises(InputError, match=r"name the one that is meant|finds no node"):
        with_reference(body, FixedTo("plane z=0"))


def test_conditions_that_cannot_be(bodies):
    body = bodies[FixedTo("left")]
    with pytest.raises(InputError, match="need the mesh"):
        with_reference(body, UserConditions(np.zeros((6, 4, 3))))
    with pytest.raises(InputError, match="no interface 'middle'"):
        with_reference(body, FixedTo("middle"))
    with pytest.raises(InputError, match="do not prevent"):
        with_reference(body, Supports((Support("left", "translation", (1.0, 0.0, 0.0)),)))
