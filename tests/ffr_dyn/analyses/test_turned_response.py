"""Frequency response of what turns, between inputs and outputs that do not: against equations in axes at rest."""

from __future__ import annotations

import numpy as np
import pytest
from test_hill import ACROSS, ALONG, ENDS, MASS, rotor

import ffr_dyn as fd

SPEED, DAMPING = 200.0, 300.0
F = np.array([5.0, SPEED / (2 * np.pi), 40.0, 60.0, 90.0, 130.0])  # Hz, one of them that of the speed


def receptance(at: float, seen: tuple[float, ...], stiff: tuple[float, float] = (1e6, 1.5e6)) -> np.ndarray:
    """(F,) of seen . (x, y, turns about x and y) to a force along x at a distance from the centre."""
    M, C, K = np.diag([MASS, MASS, ACROSS, ACROSS]), np.zeros((4, 4)), np.zeros((4, 4))
    C[2, 3], C[3, 2] = ALONG * SPEED, -ALONG * SPEED
    for z in ENDS:
        B = np.array([[1, 0, 0, z], [0, 1, -z, 0]])
        K += B.T @ np.diag(stiff) @ B
        C += DAMPING * B.T @ B
    s = 2j * np.pi * F
    return np.array([np.linalg.solve(K + one**2 * M + one * C, (1, 0, 0, at)) @ np.array(seen) for one in s])


def test_a_force_that_does_not_turn_with_the_rotor_excites_whirls_seen_from_the_ground():
    outputs = ["disc.right.position.x", "disc.left.acceleration.y"]
    how = {"input": "disc.right.force.x", "about": "steady", "frequencies": F}
    found = fd.response(rotor(SPEED, DAMPING), outputs=outputs, **how)
    H = found["transfer"] @ np.array([1, 1j])
    np.testing.assert_allclose(H[:, 0], receptance(ENDS[1], (1, 0, 0, ENDS[1])), rtol=1e-9)
    acceleration = (2j * np.pi * F) ** 2 * receptance(ENDS[1], (0, 1, -ENDS[0], 0))
    np.testing.assert_allclose(H[:, 1], acceleration, rtol=1e-7)
    assert not any("also answers" in note for note in found.attributes["notes"])
    np.testing.assert_allclose(found["parts"].sum(axis=2)[:, 0], found["transfer"][:, 0], rtol=1e-6)


def test_the_ground_that_shakes_carries_along_what_turns():
    found = fd.response(
        rotor(SPEED, DAMPING),
        input="base.x.displacement",
        outputs=["disc.left.position.x"],
        about="steady",
        frequencies=[1e-3],
    )
    assert found["gain"][0, 0] == pytest.approx(1.0, abs=1e-6)


def test_what_is_seen_in_turning_axes_has_other_frequencies_which_is_told():
    scene = rotor(SPEED, DAMPING)
    found = fd.response(scene, input="disc.right.force.x", outputs=["disc.omega_bar.x"], about="steady", frequencies=F)
    (note,) = (note for note in found.attributes["notes"] if "also answers" in note)
    assert note.startswith(
        "disc.omega_bar.x also answers at the frequency of the input plus and minus multiples of 31.831 Hz"
    )
    assert note.endswith("not at its own")
