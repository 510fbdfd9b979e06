"""Equilibria behind a fold or a pole are told: the pull-in of a plate capacitor, a truss of two bars that snaps through."""

from __future__ import annotations

import re

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

MASS = fp.rigid_body("m", mass=0.1, inertia=(1.0, 1.0, 1.0), points={"a": np.zeros(3)})
GAP, STIFFNESS = 0.01, 100.0
PULL_IN = 4 / 27 * STIFFNESS * GAP**3  # of c in the force c / (gap - x)^2: there x = gap / 3


def guided(axis: tuple[float, float, float], y: float = 0.0, **more) -> fd.Scene:
    ground = {"o": (0, 0, 0), "left": (-1, 0, 0), "right": (1, 0, 0)}
    joint = fd.Joint("guide", "translational", "ground.o", "m.a", axis=axis)
    return fd.Scene((fd.Body("m", MASS, position=(0, y, 0)),), (joint,), ground=ground, **more)


def plate(c: float) -> fd.Scene:
    load = fd.Load("field", "m.a", function=lambda t, state: (c / (GAP - state.position("m.a")[0]) ** 2, 0, 0))
    spring = fd.JointSpring("spring", "guide", coordinate="stroke", stiffness=STIFFNESS)
    return guided((1, 0, 0), loads=(load,), forces=(spring,))


def told(result: fd.Result) -> list[str]:
    return [note for note in result.attributes["notes"] if "loads that grow" in note]


@pytest.mark.parametrize("share", [0.3, 0.9, 0.99])
def test_below_the_pull_in_nothing_is_told(share):
    result = fd.static(plate(share * PULL_IN))
    x = result["guide.stroke"][0] / GAP
    assert 0 < x < 1 / 3
    assert x * (1 - x) ** 2 == pytest.approx(share * 4 / 27, rel=1e-6)
    assert not told(result)


@pytest.mark.parametrize("share", [1.01, 1.5, 30.0, 1e4])
def test_beyond_the_pull_in_it_is_told_at_which_share_of_the_load_that_is(share):
    (note,) = told(fd.static(plate(share * PULL_IN)))
    assert float(note.split("beyond ")[1].split(" of their size")[0]) == pytest.approx(1 / share, rel=0.01)
    assert "another branch" in note


HEIGHT = 0.2


def truss(force: float) -> fd.Scene:
    free = float(np.hypot(1, HEIGHT))
    bars = [
        fd.SpringDamper(side, f"ground.{side}", "m.a", stiffness=1e4, free_length=free) for side in ("left", "right")
    ]
    return guided((0, 1, 0), HEIGHT, springs=tuple(bars), loads=(fd.Load("weight", "m.a", force=(0, -force, 0)),))


def snap() -> float:
    """Load at which the truss snaps through."""
    h = np.linspace(0, HEIGHT, 20001)
    return float((2e4 * (np.hypot(1, HEIGHT) - np.hypot(1, h)) * h / np.hypot(1, h)).max())


@pytest.mark.parametrize("share", [-1e3, -3.0, 0.5, 0.98, 1.02, 4.0, 1463.0, 1e5])
def test_a_truss_that_has_snapped_through_says_so(share):
    result = fd.static(truss(share * snap()))
    through = result["m.a.position"][0, 1] < 0
    assert through == (share > 1)
    assert bool(told(result)) == through
    if through:
        assert float(told(result)[0].split("beyond ")[1].split(" of their size")[0]) == pytest.approx(
            1 / share, rel=0.01
        )


def test_a_pendulum_that_swings_to_where_it_hangs_is_on_no_other_branch():
    arm = fp.rigid_body(
        "arm", mass=1.0, inertia=(0.01, 0.1, 0.1), centre_of_mass=(0.5, 0, 0), points={"a": np.zeros(3)}
    )
    for angle in (0.0, 1.0, 3.0):
        body = fd.Body("arm", arm, rotation=(0, 0, angle))
        hinge = fd.Joint("hinge", "revolute", "ground.o", "arm.a")
        spring = fd.JointSpring("spring", "hinge", stiffness=0.1)
        scene = fd.Scene((body,), (hinge,), ground={"o": (0, 0, 0)}, gravity=(0, -9.81, 0), forces=(spring,))
        assert not told(fd.static(scene))


def test_a_chain_bends_by_more_than_its_links_in_few_steps():
    """Forty links on springs, level at the start: steps are short beside the chain, not beside a link."""
    link = fp.rigid_body("link", mass=0.1, inertia=(1e-5, 1e-4, 1e-4), points={"a": (-0.05, 0, 0), "b": (0.05, 0, 0)})
    bodies = [fd.Body(f"l{k}", link, position=(0.05 + 0.1 * k, 0, 0)) for k in range(40)]
    ends = ["ground.o", *(f"l{k}.b" for k in range(39))]
    joints = [fd.Joint(f"r{k}", "revolute", end, f"l{k}.a") for k, end in enumerate(ends)]
    springs = [fd.JointSpring(f"s{k}", f"r{k}", stiffness=1000.0) for k in range(40)]
    scene = fd.Scene(bodies, joints, forces=springs, ground={"o": (0, 0, 0)}, gravity=(0, -9.81, 0))
    found = fd.static(scene)
    assert int(re.search(r"(\d+) steps", found.attributes["method"])[1]) <= 12
    weight, places = 0.1 * 9.81, np.array([found[f"l{k}.R"][0, 0] for k in range(40)])
    hinges = np.array([found[f"{end}.position"][0, 0] for end in ["l0.a", *ends[1:]]])
    moments = [weight * (places[k:] - hinge).sum() for k, hinge in enumerate(hinges)]
    np.testing.assert_allclose([found[f"r{k}.angle"][0] for k in range(40)], -np.array(moments) / 1000.0, rtol=1e-8)
    assert found["l39.b.position"][0, 1] < -1.0


@pytest.mark.slow
def test_a_strut_of_many_links_falls_to_a_stable_equilibrium():
    """Thirty links on springs, too tall to stand, a milliradian off: steps to the rows do not keep it from falling."""
    link = fp.rigid_body("link", mass=0.1, inertia=(1e-5, 1e-4, 1e-4), points={"a": (-0.05, 0, 0), "b": (0.05, 0, 0)})
    lean = np.pi / 2 + 1e-3
    along = np.array([np.cos(lean), np.sin(lean), 0.0])
    bodies = [fd.Body(f"l{k}", link, position=(0.05 + 0.1 * k) * along, rotation=(0, 0, lean)) for k in range(30)]
    ends = ["ground.o", *(f"l{k}.b" for k in range(29))]
    joints = [fd.Joint(f"r{k}", "revolute", end, f"l{k}.a") for k, end in enumerate(ends)]
    free = [np.pi / 2, *[0.0] * 29]
    springs = [fd.JointSpring(f"s{k}", f"r{k}", stiffness=60.0, free=free[k]) for k in range(30)]
    found = fd.static(fd.Scene(bodies, joints, forces=springs, ground={"o": (0, 0, 0)}, gravity=(0, -9.81, 0)))
    assert found.attributes["stable"]
    places = np.array([found[f"l{k}.R"][0, 0] for k in range(30)])
    moments = [0.981 * (places[k:] - found[f"l{k}.a.position"][0, 0]).sum() for k in range(30)]
    bent = np.array([found[f"r{k}.angle"][0] for k in range(30)]) - free
    np.testing.assert_allclose(60.0 * bent, -np.array(moments), rtol=1e-7)
    assert found["l29.b.position"][0, 1] < -2.0
