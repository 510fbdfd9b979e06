"""Joints that two rigid bodies have several of, a hair off their line: they turn as exact ones do, to the size of the hair.

The exact motion: a shaft of inertia J about its line under a constant moment M turns by M t^2 / (2 J), in any number of
bearings; a slide of mass m under a force F goes F t^2 / (2 m) along any number of rails.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_dyn_plane import rod, slider_crank

import ffr_dyn as fd
from ffr_dyn.variants.in_line import TOLD, in_line
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

M, J, MASS, END = 0.02, 1e-3, 2.0, 0.2
LINE = {"a": (0.1, 0.2, 0.3), "b": (0.6, 0.2, 0.3), "c": (0.9, 0.2, 0.3)}
KINDS = [
    ("revolute", "cylindrical"),
    ("revolute", "revolute"),
    ("spherical", "revolute"),
    ("cylindrical", "spherical"),
    ("translational", "translational"),
]


def shaft(off: float) -> fd.FlexibleBody:
    """With its centre of mass on its line, its places off this by so much."""
    rng = np.random.default_rng(1)
    places = {name: np.array(place) - LINE["a"] + off * rng.uniform(-1, 1, 3) for name, place in LINE.items()}
    return rigid_body("shaft", mass=MASS, inertia=[J, 1e-2, 1e-2], points={**places, "com": np.zeros(3)})


def scene_of(off: float, kinds: tuple[str, ...]) -> fd.Scene:
    """On bearings, of which every other is written the other way round."""
    joints = []
    for k, (kind, name) in enumerate(zip(kinds, LINE, strict=False)):
        ends = [f"ground.{name}", f"shaft.{name}"][:: 1 - 2 * (k % 2)]
        joints.append(fd.Joint(f"bearing_{name}", kind, *ends, axis=(1 - 2 * (k % 2), 0, 0)))
    return fd.Scene(
        bodies=(fd.Body("shaft", shaft(off), position=LINE["a"]),),
        joints=tuple(joints),
        loads=(fd.Load("push", "shaft.com", force=(3.0, 0, 0), moment=(M, 0, 0)),),
        ground=LINE,
    )


@pytest.mark.parametrize("off", [1e-9, 1e-7, 1e-6])
@pytest.mark.parametrize("kinds", KINDS)
def test_bodies_move_as_in_exact_bearings(kinds, off):
    result = fd.forward(scene_of(off, kinds), end=END, output_step=0.02)
    t = result.time
    if "translational" in kinds:
        exact = np.outer(3.0 * t**2 / 2 / MASS, [1.0, 0, 0])
        moved = result["shaft.com.position"] - result["shaft.com.position"][0]
        np.testing.assert_allclose(moved, exact, atol=20 * off)
    else:
        speed = result["shaft.omega_bar"]
        np.testing.assert_allclose(speed, np.outer(M / J * t, [1.0, 0, 0]), atol=20 * off * M / J)


def test_forces_of_both_bearings_carry_the_load():
    exact, off = (fd.forward(scene_of(by, ("revolute", "revolute")), end=END, output_step=0.02) for by in (0.0, 1e-7))
    for name in ("bearing_a.force", "bearing_b.force"):
        np.testing.assert_allclose(off[name], exact[name], atol=1e-4)
    np.testing.assert_allclose(exact["bearing_a.force"][:, 0] - exact["bearing_b.force"][:, 0], -3.0, atol=1e-9)


def test_three_bearings_on_an_oblique_line_with_six_digits():
    along = np.array([2.0, -1.0, 2.0]) / 3.0
    turn = np.cross([1.0, 0, 0], along)
    angle = np.arcsin(np.linalg.norm(turn))
    ground = {name: np.round(np.array(LINE["a"]) + (LINE[name][0] - 0.1) * along, 6) for name in LINE}
    joints = [
        fd.Joint(
            f"bearing_{name}", "revolute", f"ground.{name}", f"shaft.{name}", axis=np.round(along, 6), axis_j=(1, 0, 0)
        )
        for name in LINE
    ]
    body = fd.Body("shaft", shaft(0.0), position=ground["a"], rotation=turn / np.linalg.norm(turn) * angle)
    scene = fd.Scene(
        bodies=(body,), joints=joints, ground=ground, loads=(fd.Load("m", "shaft.com", moment=M * along),), plane="none"
    )
    result = fd.forward(scene, end=END, output_step=0.1)
    np.testing.assert_allclose(result["shaft.omega_bar"], np.outer(M / J * result.time, [1.0, 0, 0]), atol=1e-5)


def test_what_is_moved_by_more_than_a_micrometre_is_told():
    notes = [fd.assemble(scene_of(off, ("revolute", "revolute"))).notes for off in (1e-9, 2e-6)]
    assert [any("of the same rigid bodies" in note for note in those) for those in notes] == [False, True]
    assert TOLD == 1e-6


def test_farther_off_is_refused_with_a_remedy():
    with pytest.raises(InputError, match=r"fix the same twice .* spherical joint and a point-on-line"):
        fd.assemble(scene_of(1e-4, ("revolute", "revolute")))


def test_scenes_without_hairs_stay_what_they_are():
    for off, kinds in ((0.0, KINDS[0][:1]), (1e-4, ("revolute", "revolute")), (1e-7, ("spherical", "spherical"))):
        scene = scene_of(off, kinds)
        assert in_line(scene)[0] is scene


def test_flexible_bodies_are_left_to_deform():
    model = rod("shaft", 1.0)
    moved = (replace(i, position=i.position + np.array([0, 1e-8, 0])) if i.name == "b" else i for i in model.interfaces)
    bearings = (
        fd.Joint("a", "revolute", "ground.O", "shaft.a", axis=(1, 0, 0)),
        fd.Joint("b", "cylindrical", "ground.E", "shaft.b", axis=(1, 0, 0)),
    )
    body = fd.Body("shaft", replace(model, interfaces=tuple(moved)))
    scene = fd.Scene((body,), bearings, ground={"O": (0, 0, 0), "E": (1, 0, 0)})
    assert in_line(scene)[0] is scene


@pytest.mark.parametrize("off", [3e-10, 1e-8])
def test_rigid_bodies_in_space_are_put_into_the_plane_of_their_joints(off):
    """As `economise` begins with them where a mesh is not symmetric enough for a plane; 1e-10 m were refused."""
    crank, whole, block = slider_crank().bodies
    ends = (replace(i, position=i.position + np.array([0, 0, off * k])) for k, i in enumerate(whole.model.interfaces))
    stiff = fd.truncated(replace(whole.model, interfaces=tuple(ends)), 0)
    scene = replace(slider_crank(), bodies=(crank, fd.Body("rod", stiff, position=whole.position), block), plane="none")
    assert len(fd.assemble(scene).redundant) == 3
    at_once = fd.forward(scene, end=0.01, output_step=1e-3)
    level = replace(scene, bodies=(crank, fd.Body("rod", fd.truncated(whole.model, 0), position=whole.position), block))
    exact = fd.forward(level, end=0.01, output_step=1e-3)
    np.testing.assert_allclose(at_once["big.force"], exact["big.force"], atol=1e-6 * np.abs(exact["big.force"]).max())
