"""How much stiffer a body is in parts than in one piece, by what its cuts hold rigid."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL, box_mesh

from ffr_prep.body import FlexibleBody, cut_errors_of, free_vibrations, truncated
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.cuts import CutPlane
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.selection import UpTo
from ffr_prep.report.text import body_lines
from ffr_prep.solids.model import from_mesh
from ffr_prep.structures.frame import Frame, Member, Shell, joined, named, panel, polyline
from ffr_prep.structures.model import from_frame
from ffr_prep.structures.sections import rectangle

BAR = Member(rectangle(0.02, 0.03), STEEL, (0.0, 0.0, 1.0))
ACROSS = [CutPlane((0.95, 0.0, 0.0), (1.0, 0.0, 0.0))]


def in_parts(frame: Frame, parts: object, reduction: object = CraigBampton(8), **settings: object):
    model = from_frame(frame, [InterfaceRegion(name) for name in frame.node_groups if name != "seam"])
    given = {"reference": MeanAxis(), "reduction": reduction, "linear": True, **settings}
    return reduce(model, Request(name="frame", parts=parts, **given))


def von_mises(stress: np.ndarray) -> np.ndarray:
    xx, yy, zz, xy, xz, yz = stress.T
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * (xy**2 + xz**2 + yz**2))


def rails() -> Frame:
    """Two rails of two metres that their ends hold together, and the two nodes between which the middle cuts them."""
    corners = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 0.4, 0.0), (0.0, 0.4, 0.0)]
    frame = joined(
        *(polyline([a, b], BAR, elements=8) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))
    )
    frame = named(frame, left=(0, 0, 0), right=(2, 0.4, 0))
    return replace(frame, node_groups={**frame.node_groups, "seam": np.flatnonzero(frame.points[:, 0] == 1.0)})


def rod() -> Frame:
    return named(polyline([(0, 0, 0), (2, 0, 0)], BAR, elements=16), left=(0, 0, 0), right=(2, 0, 0))


def about_cuts(body: FlexibleBody) -> list[str]:
    """Warnings about cuts; the square bar's number of modes cuts pairs of equal frequency, which is another matter."""
    return [text for text in body.provenance["warnings"] if "cut" in text and "pair of equal frequency" not in text]


def test_a_beam_in_parts_is_as_stiff_as_in_one_piece():
    body = in_parts(rod(), 4)
    assert max(cut_errors_of(body.provenance)) < 1e-4
    assert not about_cuts(body)
    assert "cut error   frequencies of the free body too high by less than 0.01 %" in "\n".join(body_lines(body))


def test_parts_vibrate_as_the_model_whose_cut_is_one_rigid_region():
    frame = rails()
    model = from_frame(frame, [InterfaceRegion(name) for name in ("left", "right", "seam")])
    tied = reduce(model, Request(name="tied", reference=MeanAxis(), reduction=CraigBampton(40), linear=True))
    cut = in_parts(frame, 2, CraigBampton(20))
    found, expected = (free_vibrations(of, 6).omega for of in (cut.parts, [tied]))
    np.testing.assert_allclose(found, expected, rtol=2e-4)


def test_a_cut_through_two_members_is_told():
    body = in_parts(rails(), 2)
    assert max(cut_errors_of(body.provenance)) > 0.5
    [warning] = body.provenance["warnings"]
    assert "too high). A cut moves as one rigid piece: cut into fewer parts, or where a single member passes" in warning


def test_a_sheet_whose_sections_may_not_warp_is_told():
    sheet = panel([(0, 0, 0), (1, 0, 0), (1, 0.2, 0), (0, 0.2, 0)], Shell(0.003, STEEL), elements=(12, 2))
    edge = {"left": np.flatnonzero(sheet.points[:, 0] == 0)}
    [warning] = in_parts(replace(sheet, node_groups=edge), 3).provenance["warnings"]
    assert "free vibration 3" in warning


def test_parts_whose_shapes_know_no_loads_at_their_cuts_are_told():
    [warning] = in_parts(rod(), 4, Eigenmodes(8)).provenance["warnings"]
    assert "take craig-bampton, whose shapes let cuts move" in warning


def test_stress_beside_a_cut_is_told_of_solids_alone():
    """A bar under one pascal of tension has a von Mises stress of one everywhere, but beside its cut."""
    mesh = box_mesh("hex20", (1.0, 0.06, 0.04), (12, 2, 1))
    model = from_mesh(mesh, STEEL, [InterfaceRegion("left"), InterfaceRegion("right")])
    request = Request(name="bar", reference=FixedTo("left"), reduction=CraigBampton(0), stress=True, linear=True)
    body = reduce(model, replace(request, parts=2))
    assert "up to a half off" in body.provenance["warnings"][-1]
    first = body.parts[0]
    tension = first.surface.stress @ (first.interface("cut_1_a").phi_t[0] * 0.0024 / first.omega2)
    cut = np.isclose(first.surface.points[:, 0], 0.5)
    assert 0.67 < von_mises(tension[cut]).min() < 0.8
    middle = np.isclose(first.surface.points[:, 0], 0.25)
    np.testing.assert_allclose(von_mises(tension[middle]), 1.0, atol=0.02)
    assert not about_cuts(in_parts(rod(), 2, stress=True))


@pytest.mark.parametrize(("normal", "stepped"), [((1.0, 0.0, 0.0), False), ((1.0, 2.0, 0.0), True)])
def test_stress_at_a_cut_without_a_plane_of_faces_is_told_to_be_none(normal, stepped):
    """Under one pascal of tension the elements that a stepped cut holds as a whole have none; a plane one leaves half. The
    plane that is asked for goes through 0.12 m of the length."""
    mesh = box_mesh("tet10", (0.24, 0.06, 0.04), (10, 3, 1))
    model = from_mesh(mesh, STEEL, [InterfaceRegion("left"), InterfaceRegion("right")])
    request = Request(name="bar", reference=FixedTo("left"), reduction=CraigBampton(0), stress=True, linear=True)
    body = reduce(model, replace(request, parts=[CutPlane((0.121, 0.02, 0.02), normal)]))
    first, warning = body.parts[0], body.provenance["warnings"][-1]
    tension = von_mises(first.surface.stress @ (first.interface("cut_1_a").phi_t[0] * 0.0024 / first.omega2))
    found = re.search(r"and next to none .* deep are the cuts 1 \(([\d.]+) m\)", warning)
    assert bool(found) == stepped
    if found:
        assert 0.06 < float(found[1]) < 0.12 + 2 * 0.024
        assert tension.min() < 1e-9
    else:
        assert "up to a half off" in warning
        assert tension.min() > 0.5


def test_bodies_of_hardly_any_shapes():
    body = in_parts(rod(), ACROSS, Eigenmodes(1))
    assert len(body.provenance["cut_error"]["parts"]) == 1
    assert not free_vibrations([truncated(body, 0)], 6).omega.size


def test_a_frame_that_no_mode_is_slow_enough_for_is_a_rigid_body():
    sheet = panel([(2, 0, 0), (2.2, 0, 0), (2.2, 0.1, 0), (2, 0.1, 0)], Shell(0.003, STEEL), elements=(2, 2))
    frame = named(joined(polyline([(0, 0, 0), (2, 0, 0)], BAR, elements=8), sheet), left=(0, 0, 0))
    body = in_parts(frame, 2, Eigenmodes(UpTo(0.1)), stress=True)
    assert (body.n, body.parts[0].n, body.parts[1].n) == (0, 0, 0)
    assert body.mass == pytest.approx(STEEL.rho * (2 * 0.02 * 0.03 + 0.2 * 0.1 * 0.003))
