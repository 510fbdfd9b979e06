"""Loops of joints in a plane, a hair off it: they move as exact ones do, to the size of the hair, wherever their plane goes.

The exact motion is that of the same loop in the plane z = 0 with all digits, which is computed in the plane.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_dyn_plane import slider_crank

import ffr_dyn as fd
from ffr_dyn.functions.rotation import from_vector, rotation_matrix
from ffr_dyn.scene.joints import frames
from ffr_dyn.variants.planar_loops import loops_in_plane
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

TURN = np.linalg.qr(np.array([[2.0, -1.0, 0.5], [0.3, 1.5, 1.0], [-1.0, 0.2, 2.0]]))[0]
OBLIQUE = TURN * np.linalg.det(TURN)
FLAT = np.eye(3)
ENDS = {"crank": ("O", "A"), "first": ("A", "M"), "second": ("M", "B"), "rocker": ("B", "C")}
AT = {"O": (0.0, 0.0), "A": (0.3, 0.4), "M": (0.9, 0.6), "B": (1.2, 0.9), "C": (1.4, 0.0)}
SPEED, END, STEP = 2.0, 0.4, 0.1
FRAMES = {"z": np.eye(3), "y": np.eye(3)[:, [2, 0, 1]], "x": np.eye(3)[:, [1, 2, 0]]}
WELD = {"M": ("fixed", "y")}
LOOPS = {
    "hinges": {},
    "cylinder": {"B": ("cylindrical", "z")},
    "ball": {"B": ("spherical", None)},
    "rail": {"C": ("translational", "x")},
    "rod": {"C": ("cylindrical", "x")},
}


def link(name: str, off: float, rng: np.random.Generator) -> fd.FlexibleBody:
    """From its first end along its own x; its places off by so much across the plane."""
    a, b = (np.array(AT[end]) for end in ENDS[name])
    length = float(np.hypot(*(b - a)))
    places = {ENDS[name][0]: np.zeros(3), ENDS[name][1]: np.array([length, 0, 0])}
    places = {end: (*place[:2], off * rng.uniform(-1, 1)) for end, place in places.items()}
    return rigid_body(name, mass=1.0, inertia=(0.01, 0.02, 0.02), points=places, centre_of_mass=(length / 2, 0, 0))


def nearly(frame: np.ndarray, off: float, rng: np.random.Generator) -> np.ndarray:
    """(3, 3) a frame that is turned by so much [rad]."""
    return rotation_matrix(from_vector(off * rng.uniform(-1, 1, 3))) @ frame


def in_space(vector, way) -> np.ndarray:
    return way @ np.array([*vector, 0.0][:3])


def loop(kinds: dict, off: float, way: np.ndarray = FLAT) -> fd.Scene:
    """O A B C with a driven crank, turned into space, places and axes off the plane by so much."""
    rng = np.random.default_rng(5)
    bodies, turns = [], {"ground": np.eye(3)}
    for name, (start, end) in ENDS.items():
        d = np.array(AT[end]) - AT[start]
        c, s = d / np.hypot(*d)
        turns[name] = way @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        where = in_space(AT[start], way)
        bodies.append(fd.Body(name, link(name, off, rng), position=where, rotation=turns[name]))
    joints = []
    chain = ["ground", *ENDS, "ground"]
    for at, i, j in zip(AT, chain[:-1], chain[1:], strict=True):
        kind, along = (kinds | WELD).get(at, ("revolute", "z"))
        axes = [nearly(turns[b].T @ way @ FRAMES[along], off, rng) if along else None for b in (i, j)]
        joints.append(fd.Joint(at, kind, f"{i}.{at}", f"{j}.{at}", axis=axes[0], axis_j=axes[1]))
    ground = {at: in_space(AT[at], way) for at in "OC"}
    motor = fd.Driver("motor", "O", fd.polynomial(0.0, SPEED))
    return fd.Scene(bodies=bodies, joints=joints, drivers=[motor], ground=ground, gravity=(0, 0, 0))


@pytest.mark.parametrize("kinds", LOOPS)
def test_loops_move_as_exact_ones_do(kinds):
    exact = fd.kinematic(loop(LOOPS[kinds], 0.0), end=END, output_step=STEP)
    found = fd.kinematic(loop(LOOPS[kinds], 1e-6, OBLIQUE), end=END, output_step=STEP)
    for body in ENDS:
        np.testing.assert_allclose(found[f"{body}.R"] @ OBLIQUE, exact[f"{body}.R"], atol=1e-4)


@pytest.mark.parametrize("kinds", LOOPS)
def test_exact_loops_stay_as_they_are(kinds):
    scene = loop(LOOPS[kinds], 0.0)
    assert loops_in_plane(scene) == (scene, [])
    assert loops_in_plane(scene)[0] is scene


def test_a_loop_on_a_table_that_turns_carries_what_the_exact_one_does():
    def on_table(off: float) -> fd.Scene:
        """Turned about x, in the plane of the loop, by a motor of its own."""
        scene = loop({}, off)
        places = {name: np.array(place) for name, place in scene.ground.items()}
        table = fd.Body("table", rigid_body("table", mass=5.0, inertia=(1.0, 1.0, 1.0), points=places))
        joints = [
            replace(joint, **{end: getattr(joint, end).replace("ground", "table") for end in ("i", "j")})
            for joint in scene.joints
        ]
        shaft = fd.Joint("shaft", "revolute", "ground.O", "table.O", axis=(1, 0, 0))
        swing = fd.Driver("swing", "shaft", fd.polynomial(0.0, 0.0, 3.0))
        return replace(scene, bodies=(table, *scene.bodies), joints=(shaft, *joints), drivers=(*scene.drivers, swing))

    found, exact = (fd.inverse(on_table(off), end=END, output_step=STEP) for off in (1e-6, 0.0))
    for name in ("motor.effort", "swing.effort", "A.force", "M.moment", "B.force"):
        np.testing.assert_allclose(found[name], exact[name], atol=1e-4 * np.abs(exact[name]).max())


def test_axes_lie_along_the_plane_and_across_it_afterwards():
    scene, notes = loops_in_plane(loop(LOOPS["rail"], 1e-7, OBLIQUE))
    axes = {joint.name: [frame[:, 2] for frame in frames(joint)] for joint in scene.joints}
    np.testing.assert_allclose(axes["O"][1], axes["A"][0], atol=1e-15)
    assert abs(axes["B"][1] @ axes["C"][0]) < 1e-15
    assert abs(axes["C"][1] @ axes["O"][0]) < 1e-15
    assert notes == []


def test_what_is_moved_by_more_than_a_hair_of_a_mesh_is_told():
    notes = fd.assemble(loop({}, 5e-6, OBLIQUE)).notes
    assert any("is put into the plane of its loop, which it was" in note for note in notes)


def test_loops_that_are_off_by_more_do_not_close():
    with pytest.raises(InputError, match=r"cannot be assembled: joint '.' stays open by"):
        fd.assemble(loop({}, 1e-4, OBLIQUE))


@pytest.mark.parametrize(("off", "moved"), [(1e-7, True), (4e-6, False)])
def test_flexible_bodies_are_strained_by_what_is_more_than_a_hair(off, moved):
    """A rod of 0.3 m in a loop with rails, of which the last is too high."""
    scene = slider_crank(plane="none", rod={}, ground={"O": (0, 0, 0), "P": (1.0, 0, 0), "Q": (0, 0, off)})
    guide = next(joint for joint in scene.joints if joint.name == "guide")
    scene = replace(
        scene, joints=(*(joint for joint in scene.joints if joint is not guide), replace(guide, i="ground.Q"))
    )
    assert (loops_in_plane(scene)[0] is not scene) == moved
