"""Equilibria behind a fold or a pole are told: the pull-in of a plate capacitor, a truss of two bars that snaps through."""

from __future__ import annotations

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
