"""Two arms on one line that carry a bucket on another: with numbers a hair off they move as exact ones do.

The exact loader has arms of one length, and is held by the moment of the weights about the line on the ground: the arms'
and the bucket's, whose hinge is driven so that it is not turned.
"""

import numpy as np
import pytest

import ffr_dyn as fd
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

L, WIDTH, ARM, BUCKET, G, START, RATE = 2.0, 0.6, 80.0, 300.0, 9.81, 0.3, 0.2
OVER = 0.4  # m, of the centre of mass of the bucket beyond its line


def loader(off: float) -> fd.Scene:
    """Arms from z = -WIDTH and z = WIDTH, all places of them off by so much."""
    rng = np.random.default_rng(7)
    c, s = np.cos(START), np.sin(START)
    tip = L * np.array([c, s, 0])
    bodies, joints, ground = [], [], {}
    places = {side: tip * 0 + [0, 0, z] for side, z in (("left", WIDTH), ("right", -WIDTH))}
    bucket = rigid_body("bucket", mass=BUCKET, inertia=(9.0, 9.0, 9.0), centre_of_mass=(OVER, 0, 0), points=places)
    for side, z in (("left", WIDTH), ("right", -WIDTH)):
        ends = {"foot": np.zeros(3), "tip": np.array([L, 0, 0])}
        ends = {name: end + off * rng.uniform(-1, 1, 3) for name, end in ends.items()}
        arm = rigid_body(side, mass=ARM, inertia=(1.0, 9.0, 9.0), centre_of_mass=(L / 2, 0, 0), points=ends)
        bodies.append(fd.Body(side, arm, position=(0, 0, z), rotation=(0, 0, START)))
        ground[side] = np.array([0, 0, z]) + off * rng.uniform(-1, 1, 3)
        joints += [
            fd.Joint(f"{side}_foot", "revolute", f"ground.{side}", f"{side}.foot"),
            fd.Joint(f"{side}_tip", "revolute", f"{side}.tip", f"bucket.{side}"),
        ]
    bodies.append(fd.Body("bucket", bucket, position=tip))
    lift = fd.Driver("lift", "left_foot", fd.polynomial(START, RATE))
    level = fd.Driver("level", "left_tip", fd.polynomial(-START, -RATE))
    return fd.Scene(bodies=bodies, joints=joints, drivers=(lift, level), ground=ground, gravity=(0, -G, 0))


@pytest.mark.parametrize("off", [1e-10, 1e-8, 3e-7])
def test_both_arms_are_lifted_by_the_moment_of_the_weights(off):
    result = fd.inverse(loader(off), end=1.0, output_step=0.1)
    across = np.cos(START + RATE * result.time)
    # What the bucket's driver does to it, it does to the arm, which the other driver holds against it.
    weights = G * (2 * ARM * L / 2 + BUCKET * L) * across
    np.testing.assert_allclose(result["lift.effort"] - result["level.effort"], weights, rtol=1e-5)
    falls = G - L * RATE**2 * np.sin(START + RATE * result.time)
    np.testing.assert_allclose(result["level.effort"], BUCKET * OVER * falls, rtol=1e-5)
    both = result["left_foot.force"] + result["right_foot.force"]
    np.testing.assert_allclose(np.abs(both[:, 1]), (2 * ARM + BUCKET) * G, rtol=1e-2)


def test_what_is_moved_farther_is_told():
    notes = fd.assemble(loader(1e-6)).notes
    assert any("where the others have it that turn about the same lines" in note for note in notes)


def test_arms_that_are_farther_off_do_not_close():
    with pytest.raises(InputError, match="stays open by"):
        fd.kinematic(loader(1e-4), end=1.0, output_step=0.1)
