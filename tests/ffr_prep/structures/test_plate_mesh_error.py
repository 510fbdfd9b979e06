"""The error that a mesh of plates tells: exact fields, independence of the frame, and the truth by finer meshes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from boxes import rotation

import ffr_prep as fp
from ffr_prep.body import mesh_doubt, mesh_errors_of
from ffr_prep.report.text import body_lines, short_lines
from ffr_prep.structures.plate_mesh_error import added_energy

METAL = fp.Material("metal", 7e10, 0.3, 2700.0)
SHEET = fp.Shell(0.002, METAL)
LENGTH, WIDTH, HEIGHT = 1.0, 0.05, 0.1
CUT = pytest.mark.parametrize("cut", [fp.triangulated, lambda frame: frame], ids=["triangles", "quadrilaterals"])


def strips(corners, elements, shell=SHEET) -> fp.Frame:
    """Sheets along x over the sides of a polygon in the plane x = 0."""
    sides = pairwise(corners)
    return fp.joined(
        *(
            fp.panel([(0, *a), (LENGTH, *a), (LENGTH, *b), (0, *b)], shell, elements=(elements[0], n))
            for (a, b), n in zip(sides, elements[1], strict=True)
        )
    )


def channel(across: int) -> fp.Frame:
    corners = [(WIDTH, 0), (0, 0), (0, HEIGHT), (WIDTH, HEIGHT)]
    return strips(corners, (8 * across, (across,) * 3))


def polygon_tube(sides: int) -> fp.Frame:
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    return strips([(0.1 * np.cos(a), 0.1 * np.sin(a)) for a in angle], (4, (1,) * sides))


def ends_of(frame: fp.Frame) -> np.ndarray:
    return np.flatnonzero(np.isclose(frame.points[:, 0], 0) | np.isclose(frame.points[:, 0], LENGTH))


def reduced(frame: fp.Frame, modes: int = 2) -> fp.FlexibleBody:
    frame = replace(frame, node_groups={"root": np.flatnonzero(frame.points[:, 0] == 0)})
    model = fp.from_frame(frame, [fp.InterfaceRegion("root")])
    request = fp.Request(name="b", reference=fp.FixedTo("root"), reduction=fp.Eigenmodes(modes), linear=True)
    return fp.reduce(model, request)


def told(body: fp.FlexibleBody) -> np.ndarray:
    return np.array(list(mesh_errors_of(body.provenance).values()))


def tension(frame: fp.Frame, R=None) -> np.ndarray:
    """(6N, 1) a stretch along x with Poisson's contraction, and no rotation."""
    at = frame.points if R is None else frame.points @ R
    u = at * [1e-3, -0.3e-3, -0.3e-3]
    return np.hstack([u if R is None else u @ R.T, np.zeros_like(u)]).reshape(-1, 1)


def test_a_strip_of_triangles_that_bends_in_its_plane_tells_how_much_too_stiff_it_is():
    """Against Euler and Bernoulli's cantilever, of which shear takes less than a per cent."""
    body = reduced(fp.triangulated(strips([(0, 0), (0, HEIGHT)], (10, (2,)), fp.Shell(0.2, METAL))), modes=1)
    exact = 3.5160 / (2 * np.pi) * np.sqrt(METAL.E * HEIGHT**2 / (12 * METAL.rho)) / LENGTH**2
    true = body.frequencies[0] / exact - 1
    assert told(body)[0] == pytest.approx(true, rel=0.3)
    assert true > 0.1


@pytest.mark.slow
@CUT
def test_told_is_the_truth_within_a_small_factor(cut):
    """A channel that twists and bends; the truth is that of five times as many elements."""
    true = reduced(cut(channel(2))).frequencies / reduced(channel(6)).frequencies - 1
    found = told(reduced(cut(channel(2))))
    assert (found > 0.5 * true).all()
    assert (found < 1.5 * true).all()
    assert true[0] > (0.08 if cut is fp.triangulated else 0.005)


@CUT
@pytest.mark.parametrize("make", [lambda: channel(1), lambda: polygon_tube(12)], ids=["channel", "tube"])
def test_tension_is_exact_over_folds_and_round_tubes_and_is_none_at_free_ends(cut, make):
    frame = cut(make())
    stretched = tension(frame)
    assert added_energy(frame, ends_of(frame), stretched)[0] < 1e-12
    assert added_energy(frame, np.zeros(0, int), stretched)[0] > 1e-3  # N m, of 1e-6 E A L = 28 and 88: nothing pulls


@CUT
def test_no_frame_is_preferred(cut):
    frame, R = cut(channel(1)), rotation(4)
    turned = replace(frame, points=frame.points @ R.T + [1.0, -2.0, 0.5])
    q = np.random.default_rng(1).normal(size=(len(frame.points), 2, 3))
    here, there = (added_energy(of, ends_of(frame), v.reshape(-1, 1)) for of, v in ((frame, q), (turned, q @ R.T)))
    assert there == pytest.approx(here, rel=1e-9)


def test_the_order_of_an_elements_nodes_does_not_count():
    frame = channel(1)
    upside_down = frame.quadrilaterals.copy()
    upside_down[::3] = upside_down[::3, ::-1]
    q = np.random.default_rng(2).normal(size=(6 * len(frame.points), 1))
    turned = replace(frame, quadrilaterals=upside_down)
    assert added_energy(turned, ends_of(frame), q) == pytest.approx(added_energy(frame, ends_of(frame), q), rel=1e-9)


def test_sheets_of_other_thickness_keep_their_own_forces():
    thick = fp.Shell(0.02, METAL)
    halves = [(0, 0), (0, HEIGHT)], [(0, HEIGHT), (0, 2 * HEIGHT)]
    frame = fp.joined(strips(halves[0], (4, (1,))), strips(halves[1], (4, (1,)), thick))
    assert added_energy(frame, ends_of(frame), tension(frame))[0] < 1e-12


def test_triangles_and_quadrilaterals_of_one_sheet_are_averaged_together():
    left, right = (channel(1) for _ in range(2))
    right = fp.triangulated(replace(right, points=right.points + np.array([LENGTH, 0, 0])))
    both = fp.joined(left, right)
    outside = np.flatnonzero(np.isclose(both.points[:, 0] % (2 * LENGTH), 0))
    assert added_energy(both, outside, tension(both))[0] < 1e-12


def test_a_beam_along_an_edge_takes_up_what_the_sheet_gives_it():
    """A shear panel in a frame: its edges are not free where beams are."""
    sheet = strips([(0, 0), (0, HEIGHT)], (4, (2,)))
    rim = fp.polyline(
        [(0, 0, 0), (LENGTH, 0, 0), (LENGTH, 0, HEIGHT), (0, 0, HEIGHT), (0, 0, 0)],
        fp.Member(fp.circle(0.01), METAL),
        elements=4,
    )
    framed = fp.joined(sheet, rim)
    shear = np.zeros((len(framed.points), 6))
    shear[:, 0], shear[:, 4] = 1e-3 * framed.points[:, 2], 0.5e-3
    request = fp.Request(name="b", reference=fp.MeanAxis(), reduction=fp.Eigenmodes(2), linear=True)
    assert told(fp.reduce(fp.from_frame(framed), request)).size == 2
    beams = np.unique(framed.elements)
    assert (
        added_energy(framed, beams, shear.reshape(-1, 1))[0]
        < 1e-3 * added_energy(framed, np.zeros(0, int), shear.reshape(-1, 1))[0]
    )


def test_a_body_of_plates_tells_it_and_a_coarse_one_warns_with_what_helps():
    coarse, fine = reduced(fp.triangulated(channel(2))), reduced(channel(2))
    assert "quadrilaterals in place of triangles" in mesh_doubt(coarse.provenance)
    assert "--order" not in mesh_doubt(coarse.provenance)
    assert mesh_doubt(coarse.provenance) in coarse.provenance["warnings"]
    assert mesh_doubt(fine.provenance) is None
    for lines in (body_lines, short_lines):
        (line,) = [line for line in lines(coarse) if line.startswith("mesh error")]
        assert line.endswith("in brackets the mode; of plates without their bending")


@pytest.mark.parametrize(("elements", "told"), [(4, True), (8, False)])
def test_a_clamped_plate_of_few_elements_says_that_its_bending_may_be_off(elements, told):
    """35.99 sqrt(D / (rho t a^4)): Leissa, Vibration of Plates (1969), section 4.3.1."""
    shell = fp.Shell(0.01, METAL)
    plate = fp.panel([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], shell, elements=(elements, elements))
    rim = np.flatnonzero((np.abs(plate.points[:, :2] - 0.5) > 0.4999).any(axis=1))
    model = fp.from_frame(replace(plate, node_groups={"rim": rim}), [fp.InterfaceRegion("rim")])
    request = fp.Request(name="b", reference=fp.FixedTo("rim"), reduction=fp.Eigenmodes(1), linear=True)
    body = fp.reduce(model, request)
    D = METAL.E * shell.thickness**3 / (12 * (1 - METAL.nu**2))
    off = body.frequencies[0] / (35.99 / (2 * np.pi) * np.sqrt(D / (METAL.rho * shell.thickness))) - 1
    assert any("elements per wavelength" in warning for warning in body.provenance["warnings"]) is told
    assert bool(abs(off) > 0.03) is told


def test_both_remedies_are_told_of_solids_with_plates():
    record = {"mesh_error": {"modes": [1], "too_high": [0.1]}, "parts": {"a": {"shells": [1]}, "b": {"mesh": {"k": 1}}}}
    assert "smaller elements" in mesh_doubt(record)
    assert "more elements across their width" in mesh_doubt(record)
