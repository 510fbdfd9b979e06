"""Mechanisms that are let go far from where they rest: cables hang as their weights say, and turns are counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import fsolve

from ffr_dyn.analyses.equilibria.relaxation import relaxed
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble, seen_in_space
from ffr_dyn.consistency.evaluation import evaluator
from ffr_dyn.consistency.tangent import sizes
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.scene.forces import JointSpring, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

LINK, G = 0.1, 9.81
ENDS = {"a": (-LINK / 2, 0, 0), "b": (LINK / 2, 0, 0)}


def cable(count: int, span: float, heights: list[float]) -> Scene:
    """Links of 0.1 m between two points on one level, drawn so that each goes up by a height."""
    angles = np.arcsin(np.array(heights) / LINK)
    corners = np.concatenate([np.zeros((1, 2)), np.cumsum(LINK * np.array([np.cos(angles), np.sin(angles)]).T, axis=0)])
    model = rigid_body("link", mass=1.0, inertia=(1e-4, 1e-3, 1e-3), points=ENDS)
    middles = (corners[1:] + corners[:-1]) / 2
    bodies = [
        Body(f"link{k}", model, position=(*middle, 0), rotation=(0, 0, angle))
        for k, (middle, angle) in enumerate(zip(middles, angles, strict=True))
    ]
    ends = ["ground.left", *(f"link{k}.{end}" for k in range(count) for end in "ab"), "ground.right"]
    joints = [Joint(f"hinge{k}", "revolute", ends[2 * k], ends[2 * k + 1]) for k in range(count + 1)]
    return Scene(tuple(bodies), tuple(joints), ground={"left": (0, 0, 0), "right": (span, 0, 0)}, gravity=(0, -G, 0))


def arch(count: int) -> Scene:
    """Links that stand upright like an arch, slack by a fifth."""
    slope = 0.6 * LINK
    return cable(count, 0.8 * LINK * count, [slope] * (count // 2) + [-slope] * (count // 2))


def hanging(count: int) -> np.ndarray:
    """(count,) slopes of such links when they hang, by equilibrium alone: each carries the same force H along, and at its
    middle H tan(slope) is the weight between it and the middle of the cable."""
    weights = np.arange(count) - (count - 1) / 2

    def left(H: np.ndarray) -> float:
        return float((LINK * np.cos(np.arctan(weights * G / H))).sum() - 0.8 * LINK * count)

    return np.arctan(weights * G / fsolve(left, 0.5 * count * G)[0])


def slopes(x: np.ndarray, count: int) -> np.ndarray:
    p = x.reshape(count, 7)[:, 3:]
    return 2 * np.arctan2(p[:, 3], p[:, 0])


def let_go(scene: Scene):
    assembled = assemble(seen_in_space(scene))
    system, x = assembled.system, assembled.x
    return relaxed(system, 0.0, x, sizes(evaluator(system)))


def test_an_arch_of_links_comes_down_and_hangs():
    rest = let_go(arch(20))
    np.testing.assert_allclose(np.sin(slopes(rest.way[-1], 20) - hanging(20)), 0.0, atol=1e-3)


@pytest.mark.parametrize("count", [30, pytest.param(100, marks=pytest.mark.slow)])
def test_statics_find_where_it_hangs(count):
    result = static(arch(count))
    assert result.attributes["stable"] == 1
    assert "is let go" in result.attributes["method"]
    angles = [2 * np.arctan2(*result[f"link{k}.p"][0, [3, 0]]) for k in range(count)]
    np.testing.assert_allclose(np.sin(np.array(angles) - hanging(count)), 0.0, atol=1e-8)


def wheel(moment: object, stiffness: float = 1.0) -> Scene:
    model = rigid_body("wheel", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"hub": (0, 0, 0)})
    spring = JointSpring("spring", "axle", stiffness=stiffness)
    return Scene(
        (Body("wheel", model),),
        (Joint("axle", "revolute", "ground.o", "wheel.hub"),),
        forces=(spring,),
        loads=(Load("push", "wheel.hub", moment=(0, 0, moment)),),
        ground={"o": (0, 0, 0)},
    )


def test_whole_turns_are_counted_on_the_way():
    rest = let_go(wheel(20.0))
    assert rest.angles["spring"] == pytest.approx(20.0, rel=1e-3)


def test_what_never_rests_is_not_waited_for():
    stone = Body("stone", rigid_body("stone", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)}))
    assert let_go(Scene((stone,), gravity=(0, 0, -G))) is None
    assert let_go(replace(wheel(0.0), gravity=(0, 0, 0))) is None  # rests already
    assert let_go(wheel(polynomial(0.0, 1.0))) is None  # a load that grows
