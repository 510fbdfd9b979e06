"""Reference conditions against joints: the frequency that a body has where it is held, and the one it should have."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.mobility import mobility, undeformed
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.variant import vary
from ffr_prep.body import TRUNCATION_ERROR, errors_of_modes, load_body, rigid_body, save_body

LENGTH, DIAMETER, E, RHO = 0.3, 0.006, 2e11, 7870.0
UNIT = np.sqrt(E / RHO) * DIAMETER / 4 / LENGTH**2 / (2 * np.pi)  # Hz of a beam of unit constants
PINNED = np.pi**2 * UNIT
FIXED, SUPPORTED = fp.FixedTo("a"), fp.SimplySupported("a", "b")


def rod(reference, reduction) -> fp.FlexibleBody:
    member = fp.Member(fp.circle(DIAMETER), fp.Material("steel", E=E, nu=0.3, rho=RHO))
    frame = fp.named(fp.polyline([(0, 0, 0), (LENGTH, 0, 0)], member, elements=12), a=(0, 0, 0), b=(LENGTH, 0, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")])
    return fp.reduce(model, fp.Request(name="rod", reference=reference, reduction=reduction))


def on_two_hinges(body: fp.FlexibleBody, kind: str = "revolute") -> Scene:
    """A rod on a hinge, with a sliding hinge at its end."""
    carriage = rigid_body("carriage", mass=0.1, inertia=(1e-4, 1e-4, 1e-4), points={"c": (0, 0, 0)})
    return Scene(
        (Body("rod", body), Body("carriage", carriage, position=(LENGTH, 0, 0))),
        (
            Joint("left", "revolute", "ground.O", "rod.a"),
            Joint("right", kind, "rod.b", "carriage.c"),
            Joint("rail", "translational", "ground.O", "carriage.c", axis=(1, 0, 0)),
        ),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )


def told(scene: Scene) -> list[tuple[float, float]]:
    """(has, should) of every body that is told of [Hz]."""
    said = [
        re.search(r"vibrates at ([\d.e+]+) Hz, and should at ([\d.e+]+) Hz", note) for note in assemble(scene).notes
    ]
    return [(float(match[1]), float(match[2])) for match in said if match]


def test_one_end_fixed_on_two_hinges():
    """The example of the gallery: one mode of a clamped beam bends 48 % too stiff between hinges."""
    scene = on_two_hinges(rod(FIXED, fp.Eigenmodes(2)))
    ((has, should),) = told(scene)
    assert should == pytest.approx(PINNED, rel=2e-3)
    assert has / should == pytest.approx(1.48, abs=0.01)
    (note,) = (note for note in assemble(scene).notes if "vibrates" in note)
    assert "body 'rod': held by left, right" in note
    assert "(FixedTo interface a); reduce it with craig-bampton" in note
    assert any("vibrates" in line for line in mobility(scene).lines())
    assert not any("vibrates" in note for note in assemble(undeformed(scene)).notes)


@pytest.mark.parametrize(
    ("reference", "reduction"),
    [
        (FIXED, fp.CraigBampton(2)),
        (SUPPORTED, fp.Eigenmodes(2)),
        (FIXED, fp.Union((fp.Eigenmodes(2), fp.AttachmentModes()))),
    ],
)
def test_conditions_that_the_joints_keep_or_static_shapes_are_not_told(reference, reduction):
    assert told(on_two_hinges(rod(reference, reduction))) == []


def test_clamped_at_both_ends():
    """Eigenmodes of a pinned rod, welded at both ends: 22.373 for 9.870 of the unit."""
    body = rod(SUPPORTED, fp.Eigenmodes(8))
    scene = on_two_hinges(body, "fixed")
    scene = replace(scene, joints=(replace(scene.joints[0], kind="fixed"), *scene.joints[1:]))
    ((has, should),) = told(scene)
    assert should == pytest.approx(22.3733 * UNIT, rel=2e-3)
    assert has > 1.03 * should


def test_a_driven_hinge_clamps():
    """Modes fixed at the hub suit a driven hinge with a free end, and not one without driver."""
    hub = Scene(
        (Body("rod", rod(FIXED, fp.Eigenmodes(4))),),
        (Joint("left", "revolute", "ground.O", "rod.a"),),
        (Driver("motor", "left", 0.0),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    assert told(hub) == []


def test_fewer_modes_are_told_too_and_files_keep_what_it_takes(tmp_path):
    body = load_body(save_body(rod(FIXED, fp.Eigenmodes(8)), tmp_path / "rod.ffr"))
    assert told(on_two_hinges(body)) == []
    assert told(vary(on_two_hinges(body), modes={"rod": range(2)}))
    assert "held_body" not in rod(FIXED, fp.CraigBampton(2)).provenance


def test_vibrations_beyond_the_modes_of_a_body_are_told():
    """Of a clamped bar 0.4 m long, 20 x 30 mm: its second bending in the stiff plane is at 953 Hz by a finer basis, and with
    the static shapes of its ends and one mode at 1520 Hz."""
    member = fp.Member(fp.rectangle(0.02, 0.03), fp.material("steel"), (0, 1, 0))
    frame = fp.named(fp.polyline([(0, 0, 0), (0.4, 0, 0)], member, elements=16), root=(0, 0, 0), end=(0.4, 0, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion("root"), fp.InterfaceRegion("end")])

    def clamped(modes: int) -> Scene:
        request = fp.Request(name="bar", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(modes))
        joints = (Joint("clamp", "fixed", "ground.O", "bar.root"),)
        return Scene((Body("bar", fp.reduce(model, request), damping=0.01),), joints, ground={"O": (0, 0, 0)})

    def beyond(notes) -> list[tuple[float, str, float, float]]:
        said = re.compile(r"from about ([\d.]+) Hz .* mode (\d+) of 'bar', of ([\d.]+) Hz, by ([\d.]+) %")
        found = [said.search(note) for note in notes]
        return [(float(m[1]), int(m[2]), float(m[3]), float(m[4])) for m in found if m]

    few, push = clamped(1), fd.MarkerEffort("push", "bar.end", direction=(0, 0, 1))
    above = [(pytest.approx(953, abs=1), 4, 1520.0, 60.0)]
    asked = {"input": push, "outputs": ["bar.end.position.z"]}
    assert beyond(fd.linearise(few).notes) == above
    assert beyond(fd.response(few, band_of=(10, 1000), **asked).attributes["notes"]) == above
    assert beyond(fd.response(few, band_of=(10, 900), **asked).attributes["notes"]) == []
    assert beyond(fd.response(clamped(6), band_of=(10, 1000), **asked).attributes["notes"]) == []
    forced = fd.forced(few, amplitude=1.0, band_of=(990, 1000), **asked)
    assert beyond(forced.attributes["notes"]) == above
    lacking = fd.response(fd.vary(few, modes=2), band_of=(10, 900), **asked).attributes["notes"]
    (note,) = (one for one in lacking if "no mode" in one)
    assert note == "vibrations that no mode has are missing, those of 'bar' above 156.8 Hz; keep more modes"


def test_in_fewer_shapes_the_error_grows_by_what_the_frequency_does():
    """Static shapes and two modes of a rod, of which few are kept: the first, or those that hinges use."""
    body = rod(FIXED, fp.CraigBampton(2))
    whole = rod(FIXED, fp.Eigenmodes(20)).frequencies
    scene = on_two_hinges(body)
    for modes in (2, 5, 8, range(4)):
        model = vary(scene, modes={"rod": modes}).bodies[0].model
        for k, error in errors_of_modes(model.provenance, TRUNCATION_ERROR).items():
            true = model.frequencies[k - 1] / whole[k - 1] - 1
            assert error == pytest.approx(true, rel=0.03, abs=1e-6) or 0.1 < error < true
