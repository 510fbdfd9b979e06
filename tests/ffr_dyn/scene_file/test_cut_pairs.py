"""A number of modes of a scene that cuts a pair of equal frequency is told, where the other plane counts."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

STEEL = fp.material("steel")


def rod(section: fp.Section) -> fp.FlexibleBody:
    line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(section, STEEL, (0, 1, 0)), elements=8)
    model = fp.from_frame(fp.named(line, a=(0, 0, 0)), [fp.InterfaceRegion("a")])
    return fp.reduce(model, fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.Eigenmodes(6)))


ROUND, FLAT = rod(fp.circle(0.02)), rod(fp.rectangle(0.02, 0.03))


def told(body: fp.FlexibleBody, kind: str = "spherical", **more: object) -> list[str]:
    axis = {} if kind == "spherical" else {"axis": (0, 0, 1)}
    hinge = fd.Joint("hinge", kind, "ground.wall", "rod.a", **axis)
    scene = fd.Scene(bodies=[fd.Body("rod", body)], joints=[hinge], ground={"wall": (0, 0, 0)}, **more)
    return [note for note in fd.assemble(scene).notes if "cuts a pair" in note]


@pytest.mark.parametrize(("modes", "remedy"), [(1, "ask for 2"), (3, "ask for 4, or for 2"), (2, ""), (6, "")])
def test_a_number_of_modes_that_cuts_a_pair_is_told(modes, remedy):
    notes = told(fp.truncated(ROUND, modes))
    assert len(notes) == bool(remedy)
    assert all(
        note.startswith(f"body 'rod': the number of modes that are kept, {modes}, cuts a pair") for note in notes
    )
    assert all(note.endswith(remedy) for note in notes)
    assert told(fp.truncated(FLAT, modes)) == []


def test_what_is_cut_again_or_moves_in_a_plane_is_not_told():
    assert told(fp.truncated(fp.truncated(ROUND, 3), 2)) == []
    assert told(fp.truncated(ROUND, 3), "revolute", plane="z") == []


def test_a_scene_file_tells(tmp_path):
    fp.save_body(ROUND, tmp_path / "rod.ffr")
    text = """
        gravity = [0, 0, -9.81]
        [ground]
        wall = [0, 0, 0]
        [bodies.rod]
        file = "rod.ffr"
        modes = 3
        [joints.hinge]
        kind = "spherical"
        i = "ground.wall"
        j = "rod.a"
        [analysis]
        kind = "static"
        """
    (tmp_path / "scene.toml").write_text(text)
    scene, _ = fd.load_scene(tmp_path / "scene.toml")
    assert any("modes that are kept, 3, cuts a pair" in note for note in fd.assemble(scene).notes)


LINE = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), STEEL, (0, 1, 0)), elements=8)
CLAMPED = fp.reduce(
    fp.from_frame(fp.named(LINE, a=(0, 0, 0), b=(1, 0, 0)), [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")]),
    fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.CraigBampton(modes=6)),
)


def varied(modes: int, loads: str) -> fd.Scene:
    """The rod clamped at a, under its weight or a force at one end."""
    pull = fd.Load("pull", f"rod.{loads}", force=(0, 3, 4))
    weld = fd.Joint("weld", "fixed", "ground.wall", "rod.a")
    scene = fd.Scene(bodies=[fd.Body("rod", CLAMPED)], joints=[weld], loads=[pull], ground={"wall": (0, 0, 0)})
    return fd.vary(scene, modes=modes)


def across(body: fp.FlexibleBody, frequency: float = 300.0) -> np.ndarray:
    """(2, 2) turn and deflection of the tip in two planes under forces and moments of 300 Hz there."""
    tip, at = body.interfaces[1], 1 / (body.omega2 - (2 * np.pi * frequency) ** 2)
    return np.array([np.einsum("in,n,in->i", of, at, of)[1:] for of in (tip.phi_t, tip.phi_r)])


@pytest.mark.parametrize("modes", range(1, 12))
@pytest.mark.parametrize("loads", ["a", "b"])
def test_a_variant_tells_the_pair_that_it_cuts(modes, loads):
    """Where the tip moves otherwise in two planes, and nowhere else. Of a force at the tip the statics come first, and
    torsion and tension among them."""
    scene = varied(modes, loads)
    differ = (np.ptp(across(scene.bodies[0].model), axis=1) > 1e-6 * np.abs(across(CLAMPED)).max(axis=1)).any()
    notes = [note for note in fd.assemble(scene).notes if "cuts a pair" in note]
    assert len(notes) == differ


@pytest.mark.parametrize("modes", range(1, 9))
def test_a_clamp_has_no_statics_to_keep(modes):
    """Its motion is rounding, of which the shapes of a variant were made: one mode had 18.4 Hz where the rod has 14.47 Hz."""
    (body,) = varied(modes, "a").bodies
    np.testing.assert_allclose(body.model.frequencies, CLAMPED.frequencies[:modes], rtol=1e-9)
