"""Which constraint rows are redundant, by mechanisms whose mobility is known, drawn in any position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_dyn_singular import n_four_bar, rod

from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.mobility import mobility
from ffr_dyn.functions.formula import formula
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError


def locomotive(count: int, angle: float, rate: float = 0.0, plane: str = "auto", **more) -> Scene:
    """Equal parallel cranks on one coupler, at an angle [rad] from the line of their pivots."""
    c, s = np.cos(angle), np.sin(angle)
    feet = 0.7 * np.arange(count)
    holes = {f"p{k}": np.array([x, 0, 0]) for k, x in enumerate(feet)}
    coupler = rigid_body("rod", mass=2.0, inertia=(0.01, 0.3, 0.3), centre_of_mass=(feet.mean(), 0, 0), points=holes)
    cranks = [
        Body(f"s{k}", rod(f"s{k}"), position=(x, 0, 0), rotation=(0, 0, angle), omega_bar=(0, 0, rate))
        for k, x in enumerate(feet)
    ]
    joints = [Joint(f"foot{k}", "revolute", f"ground.f{k}", f"s{k}.a") for k in range(count)]
    joints += [Joint(f"top{k}", "revolute", f"s{k}.b", f"rod.p{k}") for k in range(count)]
    carried = Body("rod", coupler, position=(c, s, 0), velocity=(-rate * s, rate * c, 0))
    ground = {f"f{k}": (x, 0, 0) for k, x in enumerate(feet)}
    return Scene((*cranks, carried), tuple(joints), ground=ground, plane=plane, **more)


ANGLES = [0.0, np.pi, 1e-9, 1e-6, 1e-4, 0.7, np.pi / 2, -np.pi / 2]


@pytest.mark.parametrize("plane", ["auto", "none"])
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_a_locomotive_has_one_degree_of_freedom_wherever_it_is_drawn(count, plane):
    """In the plane each crank beyond two adds a redundant row, in space each loop three more."""
    in_plane = count - 2
    for number, angle in enumerate(ANGLES):
        assembled = assemble(locomotive(count, angle, 3.0 * (number % 2), plane))
        assert assembled.degrees_of_freedom == 1
        assert len(assembled.redundant) == in_plane + 3 * (count - 1) * (plane == "none")


@pytest.mark.parametrize("angle", ANGLES[::3])
def test_run_and_check_count_the_same(angle):
    seen = mobility(locomotive(4, angle))
    assert (seen.degrees_of_freedom, len(seen.redundant)) == (1, 11)


@pytest.mark.parametrize("lean", [0.0, 1.0, -np.pi / 2, np.pi / 2])
def test_the_n_four_bar_has_one_degree_of_freedom_upright_leaning_and_aligned(lean):
    """All links along the ground are its singular position; its rows are independent elsewhere."""
    drawn = n_four_bar(3)
    c, s = np.cos(np.pi / 2 - lean), np.sin(np.pi / 2 - lean)
    bodies = [
        replace(b, rotation=(0, 0, np.pi / 2 - lean), velocity=(0, 0, 0), omega_bar=(0, 0, 0))
        if b.name.startswith("s") else replace(b, position=(int(b.name[1:]) + c, s, 0), velocity=(0, 0, 0))
        for b in drawn.bodies
    ]  # fmt: skip
    for plane, redundant in (("auto", 0), ("none", 9)):
        scene = replace(drawn, bodies=tuple(bodies), plane=plane)
        assembled = assemble(scene)
        assert (assembled.degrees_of_freedom, len(assembled.redundant)) == (1, redundant)


def test_a_frame_that_is_held_twice_says_so():
    """Nothing can move, so there are no neighbours: three rows of the second weld follow from the first, or all six."""
    scene = Scene(
        (Body("a", rod("a")),),
        (Joint("left", "fixed", "ground.P", "a.a"), Joint("right", "fixed", "ground.Q", "a.b")),
        ground={"P": (0, 0, 0), "Q": (1, 0, 0)},
    )
    assembled = assemble(scene)
    assert assembled.degrees_of_freedom == 0
    assert len(assembled.redundant) == 6 - 3 * (assembled.system.scene.plane != "none")


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2])
def test_a_driver_too_many_is_found_in_singular_positions_too(angle):
    """One crank may be driven. Where all are aligned, two could be for the moment."""
    scene = locomotive(3, angle)
    drivers = tuple(Driver(f"d{k}", f"foot{k}", formula(f"{angle} + 0.1*t")) for k in range(2))
    assert mobility(replace(scene, drivers=drivers)).overdriven == ("d0", "d1")
    with pytest.raises(
        InputError,
        match="driver 'd0' prescribes a motion that the joints and other drivers already fix; leave out 'd0' or 'd1'",
    ):
        assemble(replace(scene, drivers=drivers))
    assert assemble(replace(scene, drivers=drivers[:1])).degrees_of_freedom == 0
