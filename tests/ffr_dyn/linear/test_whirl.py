"""Whirls: what is integrated over a body is its kinetic energy, direction by direction."""

from __future__ import annotations

import numpy as np
import pytest
from test_quasi_static import rotor

import ffr_dyn as fd
from ffr_dyn.consistency.assemble import assemble, in_space
from ffr_dyn.consistency.evaluation import total_mass_matrix
from ffr_dyn.linear.steady_state import screws_of
from ffr_dyn.linear.whirl import _integral, damping_ratios, ways_of, whirls
from ffr_prep.body import FlexibleBody


def test_the_integrals_in_three_directions_are_those_of_the_mass_matrix():
    """|u|^2 dm of complex motions, with the body undeformed."""
    assembled = assemble(in_space(rotor(0.0, stiffening=True)))
    scene, place = assembled.system.scene, assembled.system.layout
    M = total_mass_matrix(scene, place, assembled.x)
    random = np.random.default_rng(0)
    modes = random.normal(size=(place.v_size, 4)) + 1j * random.normal(size=(place.v_size, 4))
    total = np.zeros(4)
    for b, body in enumerate(scene.bodies):
        shift, turn, q = modes[place.R_dot(b)], modes[place.omega(b)], modes[place.q_dot(b)]
        total += sum(_integral(body.model, along, shift, turn, q) for along in np.eye(3))
    np.testing.assert_allclose(total, np.einsum("vm,vw,wm->m", modes.conj(), M, modes).real, rtol=1e-10)


def disc_in_bearings(speed: float, across: float = 0.1, along: float = 0.2, damping: float = 0.0) -> fd.Scene:
    """A rigid rotor of 2 kg that spins about z between two bearings: K = 2 k u, and 2 k a^2 of its tilting."""
    points = {"l": (0, 0, -0.3), "r": (0, 0, 0.3)}
    disc = fd.rigid_body("disc", mass=2.0, inertia=(across, across, along), points=points)
    K, C = np.diag([2e4, 2e4, 1e4, 0, 0, 0]), damping * np.diag([1.0, 1, 0, 0, 0, 0])
    bearings = tuple(fd.Bushing(f"at_{side}", f"ground.{side}", f"disc.{side}", K, C) for side in "lr")
    return fd.Scene((fd.Body("disc", disc, omega_bar=(0, 0, speed)),), forces=bearings, ground=points)


@pytest.mark.parametrize("along", [0.05, 0.15, 0.2, 0.1999999])
@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_whirls_have_the_names_of_their_ways(along, damping):
    """I_d s^2 + (c - i w I_p) s + k = 0 from the ground: also of the disc without thickness, of which both whirls have one
    frequency in the turning axes."""
    speed, k = 50.0, 2 * 2e4 * 0.3**2
    found = fd.linearise(disc_in_bearings(speed, along=along, damping=damping))
    tilts = np.roots([0.1, 2 * damping * 0.3**2 - 1j * speed * along, k])
    shifts = np.roots([2.0, 2 * damping, 4e4])[:1]
    exact = {"forward": [*tilts[tilts.imag > 0], *shifts], "backward": [*tilts[tilts.imag < 0], *shifts.conj()]}
    ratios = damping_ratios(found.eigenvalues, 2 * np.pi * found.seen, found.whirl)
    for way, values in exact.items():
        here = [i for i, name in enumerate(found.leading) if name.endswith(way)]
        for value in values:
            m = min(here, key=lambda i: abs(2 * np.pi * found.seen[i] - value.imag))
            assert 2 * np.pi * found.seen[m] == pytest.approx(value.imag, rel=1e-7)
            assert ratios[m] == pytest.approx(-value.real / abs(value), abs=1e-9)
            assert found.whirl[m] == pytest.approx(1.0)
    turning = {name.split(",")[0] for name in found.leading if name.endswith(("forward", "backward"))}
    assert turning <= {"disc shift x", "disc shift y", "disc turn x", "disc turn y"}


def test_what_moves_along_the_axis_or_along_a_line_whirls_neither_way():
    found = fd.linearise(disc_in_bearings(50.0))
    (along,) = {name for name in found.leading if "shift z" in name}
    assert along == "disc shift z"
    assert ways_of(np.array([3.0, -3.0, 3.0, 3.0]), np.array([1.0, 0.9, 0.5, np.nan])) == [
        "forward",
        "backward",
        "",
        "",
    ]


def test_a_thin_disc_is_followed_by_its_whirls_over_the_speed():
    """And named by them in a Campbell diagram, whose picture has the names."""
    speeds = np.linspace(10.0, 60.0, 6)
    found = fd.campbell(disc_in_bearings(1.0), speeds=speeds, modes=8)
    tilting = [m for m, name in enumerate(found.attributes["names"]) if "turn" in name]
    seen = np.sort(2 * np.pi * found["seen"][:, tilting], axis=1)
    exact = [np.sort(np.roots([0.1, -0.2 * speed, -2 * 2e4 * 0.3**2])) for speed in speeds]
    np.testing.assert_allclose(seen, exact, rtol=1e-8)


def ring(*shapes: np.ndarray) -> FlexibleBody:
    """24 points of 1 kg about x, with elastic coordinates of these shapes (24, 3), on a hub that they do not move."""
    m, Phi = np.full(24, 1 / 24), np.stack(shapes, axis=2)
    Phi = Phi / np.sqrt(np.einsum("p,pkj,pkj->j", m, Phi, Phi))
    return FlexibleBody(
        name="disc",
        mass=3.0,
        r_dm=m @ POINTS,
        rr_dm=np.einsum("p,pk,pl->kl", m, POINTS, POINTS) + 0.01 * np.eye(3),
        P_dm=np.einsum("p,pkj->kj", m, Phi),
        rP_dm=np.einsum("p,pk,plj->klj", m, POINTS, Phi),
        PP_dm=np.einsum("p,pki,plj->klij", m, Phi, Phi),
        omega2=np.full(Phi.shape[2], 1e4),
    )


ANGLES = 2 * np.pi * np.arange(24) / 24
POINTS = 0.2 * np.array([0 * ANGLES, np.cos(ANGLES), np.sin(ANGLES)]).T
ONES = np.ones((24, 1))


def seen_at_50(body: FlexibleBody, shape: tuple[complex, complex]) -> tuple[float, float]:
    """[rad/s] frequency from the ground, and whirling share, of a mode of 300 rad/s in the axes of the turning body."""
    assembled = assemble(in_space(fd.Scene([fd.Body("disc", body, omega_bar=(50.0, 0, 0))])))
    place, parts = assembled.system.layout, np.zeros((1, assembled.system.layout.v_size, 1), complex)
    parts[0, place.q_dot(0), 0] = shape
    screws = screws_of(place, assembled.x, assembled.v)
    found, share, _ = whirls(assembled.system.scene, place, screws, assembled.x, np.array([[300.0]]), parts)
    return float(found[0]), float(share[0])


@pytest.mark.parametrize(
    ("shape", "seen"), [((1, -1j), 350.0), ((1, 1j), -250.0), ((1, -0.96j), 350.0), ((1, 0), 300.0)]
)
def test_a_disc_that_tilts_within_its_body_whirls(shape, seen):
    """It moves more along the axis than it and its shaft, by a tenth, do across it. Both go around, so that from the ground
    it is seen at the speed and its frequency, w + nu; a blade, which tilts along a line, at nu."""
    tilting = [np.outer(POINTS[:, k] / 0.2, [1, 0, 0]) + 0.1 * ONES * np.eye(3)[k] for k in (1, 2)]
    found, share = seen_at_50(ring(*tilting), shape)
    assert found == pytest.approx(seen)
    assert np.isnan(share) == (seen == 300.0)


def test_a_disc_that_moves_along_its_axis_does_not_whirl():
    """Also where its shaft goes around a little."""
    along = ONES * np.array([1.0, 1e-3, 0]), ONES * np.array([0, 0, 1.0])
    found, share = seen_at_50(ring(*along), (1, -1e-3j))
    assert found == 300.0
    assert np.isnan(share)
