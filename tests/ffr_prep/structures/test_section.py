"""Sections: closed forms against published tables and against their own outlines, limits, and every guard."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ffr_prep.common.errors import InputError
from ffr_prep.structures.sections import (
    Section,
    box,
    circle,
    general,
    i_section,
    rectangle,
    shear_rigid,
    shifted,
    tube,
    with_mass_moments,
)


def moments(polygon) -> np.ndarray:
    """(area, integral of y^2, integral of z^2) of a polygon by Green's theorem."""
    y, z = np.array(polygon).T
    y2, z2 = np.roll(y, -1), np.roll(z, -1)
    cross = y * z2 - y2 * z
    return np.array([cross.sum() / 2, cross @ (y * y + y * y2 + y2 * y2) / 12, cross @ (z * z + z * z2 + z2 * z2) / 12])


@pytest.mark.parametrize(
    "section",
    [rectangle(0.02, 0.05), i_section(0.2, 0.1, 0.006, 0.009), box(0.08, 0.12, 0.005)],
    ids=["rectangle", "I", "box"],
)
def test_constants_are_those_of_the_outline(section):
    np.testing.assert_allclose(
        sum(moments(polygon) for polygon in section.outline), [section.A, section.Iz, section.Iy], rtol=1e-12
    )


@pytest.mark.parametrize("section", [circle(0.03), tube(0.03, 0.002)])
def test_round_outlines_are_drawn_counter_clockwise(section):
    area = moments(section.outline[0])[0]
    assert 0.97 * math.pi * 0.015**2 < area < math.pi * 0.015**2


def test_drawn_rectangle_of_general_constants():
    section = general("profile", A=3e-3, Iy=2e-6, Iz=7e-6, J=1e-7)
    area, of_y, of_z = moments(section.outline[0])
    np.testing.assert_allclose([of_y / area, of_z / area], [section.Iz / section.A, section.Iy / section.A], rtol=1e-12)


@pytest.mark.parametrize(
    ("ratio", "k"), [(1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)]
)
def test_torsion_of_rectangles(ratio, k):
    """Timoshenko & Goodier, Theory of Elasticity, art. 109, table of k_1."""
    assert rectangle(0.01, 0.01 * ratio).J / (0.01**4 * ratio) == pytest.approx(k, abs=6e-4)
    assert rectangle(0.01 * ratio, 0.01).J == rectangle(0.01, 0.01 * ratio).J


def test_tube_tends_to_the_circle_and_to_the_thin_ring():
    thick = tube(0.05, 0.025 * (1 - 1e-9))
    np.testing.assert_allclose(
        [thick.A, thick.Iy, thick.J, thick.ky], [circle(0.05).A, circle(0.05).Iy, circle(0.05).J, 6 / 7], rtol=1e-8
    )
    thin = tube(0.05, 1e-7)
    np.testing.assert_allclose([thin.A, thin.ky], [math.pi * 0.05e-7, 0.5], rtol=1e-5)
    assert thin.Iz == pytest.approx(math.pi / 8 * 0.05**3 * 1e-7, rel=1e-5)


def test_i_section_tends_to_the_rectangle():
    full = i_section(0.05, 0.02, 0.02 * (1 - 1e-12), 0.01)
    np.testing.assert_allclose([full.A, full.Iy, full.Iz], [1e-3, 0.05 * 0.02**3 / 12, 0.02 * 0.05**3 / 12], rtol=1e-9)


def test_torsion_of_a_box_is_that_of_the_standard():
    """EN 10210-2, annex A, with corners without radius: h = 0.38 m, A_h = 0.008625 m^2, K = 2 A_h t / h."""
    K = 2 * 0.075 * 0.115 * 0.005 / 0.38
    assert pytest.approx(0.005**3 * 0.38 / 3 + 2 * K * 0.075 * 0.115, rel=1e-12) == box(0.08, 0.12, 0.005).J
    thin = box(0.08, 0.12, 1e-6)
    assert pytest.approx(2 * 1e-6 * (0.08 * 0.12) ** 2 / 0.2, rel=1e-4) == thin.J  # Bredt


@pytest.mark.parametrize(("b", "h"), [(1.0, 1.0), (1.0, 2.0), (2.0, 1.0)])
def test_shear_of_thin_boxes_is_that_of_cowper(b, h):
    """Cowper (1966), thin-walled box, nu = 0, m = b / h and n = b / h for walls of one thickness."""
    m = n = b / h
    k = 10 * (1 + 3 * m) ** 2 / (12 + 72 * m + 150 * m**2 + 90 * m**3 + 30 * n**2 * (m + m**2))
    assert box(b, h, 1e-5).ky == pytest.approx(k, rel=1e-4)
    assert box(h, b, 1e-5).kz == pytest.approx(k, rel=1e-4)


@pytest.mark.parametrize("ratio", [1.0, 1.5, 2.0, 5.0])
def test_a_box_without_bore_tends_to_the_rectangle(ratio):
    full, solid = box(1.0, ratio, 0.5 * (1 - 1e-9)), rectangle(1.0, ratio)
    np.testing.assert_allclose([full.A, full.Iy, full.Iz, full.ky], [solid.A, solid.Iy, solid.Iz, 5 / 6], rtol=1e-8)
    assert pytest.approx(solid.J, rel=0.04) == full.J
    if ratio == 1.0:
        assert full.kz == pytest.approx(5 / 6, rel=1e-8)


def test_shear_in_a_box_balances_its_force():
    """The webs by Simpson's rule, exact for Q S / (I b), and what crosses the flanges, (h^2 / 4 - y^2) / 2 I."""
    b, h, t = 0.08, 0.12, 0.015
    section = box(b, h, t)
    web = {y: tau[0][0] for (y, _), tau in zip(section.outline[0], section.shear[0], strict=True) if abs(y) < h / 2}
    ends, [middle] = {tau for y, tau in web.items() if y}, {tau for y, tau in web.items() if not y}
    [end] = ends
    inner, edge = h / 2 - t, h / 2
    of_webs = 2 * t * 2 * inner * (end + 4 * middle + end) / 6
    of_flanges = b * (2 / 3 * edge**3 - edge**2 * inner + inner**3 / 3) / section.Iz
    assert of_webs + of_flanges == pytest.approx(1.0, rel=1e-12)


def test_changed_sections():
    section = rectangle(0.02, 0.05)
    assert (shear_rigid(section).ky, shear_rigid(section).kz) == (math.inf, math.inf)
    assert shifted(section, 0.1, -0.2).offset == (0.1, -0.2)
    assert section.mass_moments == (section.Iy, section.Iz)
    assert with_mass_moments(section, 1e-12, 0.0).mass_moments == (1e-12, 0.0)


def test_which_sections_are_round():
    ring = circle(0.02)
    assert ring.is_round
    assert tube(0.02, 0.001).is_round
    assert not rectangle(0.02, 0.03).is_round
    assert not box(0.02, 0.03, 0.001).is_round
    assert not shifted(ring, 0.01, 0.0).is_round
    assert not with_mass_moments(ring, ring.Iy, 0.0).is_round
    assert not replace(ring, ky=1.0).is_round


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: rectangle(-0.02, 0.05), "b is -0.02 m; it must be positive"),
        (lambda: rectangle(0.02, math.inf), "h is inf m"),
        (lambda: circle(0.0), "d is 0 m"),
        (lambda: tube(0.02, -0.001), "t is -0.001 m"),
        (lambda: tube(0.02, 0.01), "leaves no bore"),
        (lambda: box(0.08, 0.12, 0.04), r"leave no bore; t must be below 0.04 m, or use rectangle"),
        (lambda: box(0.12, 0.08, 0.05), "leave no bore; t must be below 0.04 m"),
        (lambda: box(0.12, 0.08, -0.005), "t is -0.005 m; it must be positive"),
        (lambda: box(0.0, 0.08, 0.005), "b is 0 m; it must be positive"),
        (lambda: i_section(0.1, 0.05, 0.005, 0.05), "2 flange < h"),
        (lambda: i_section(0.1, 0.05, 0.0, 0.005), "web is 0 m"),
        (lambda: general("g", A=-1.0, Iy=1.0, Iz=1.0, J=1.0), "A is -1 m"),
        (lambda: general("g", A=1.0, Iy=1.0, Iz=1.0, J=0.0), "J is 0 m"),
        (lambda: general("g", A=1.0, Iy=1.0, Iz=1.0, J=2.1), "no section has more than"),
        (lambda: general("g", A=1.0, Iy=1.0, Iz=1.0, J=1.0, ky=0.0), "shear factor ky is 0"),
        (lambda: shifted(circle(0.1), math.nan, 0.0), "offset is"),
        (lambda: with_mass_moments(circle(0.1), -1e-9, 0.0), "mass moments are"),
        (lambda: with_mass_moments(circle(0.1), 0.0, 0.0), "not both zero"),
        (lambda: Section("s", 1.0, math.nan, 1.0, 1.0), "Iy is nan"),
    ],
)
def test_impossible_sections(make, says):
    with pytest.raises(InputError, match=says):
        make()
