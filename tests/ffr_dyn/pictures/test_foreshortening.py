"""Bodies of second order in pictures, stress and result files: bent beams keep their length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.pictures.film import drawn_points, film
from ffr_dyn.pictures.page import decimated
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Quantity, Result, mode_axis
from ffr_dyn.results.stress import section_forces, tensors
from ffr_prep.body import displacements, linear_surface, values
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

LENGTH, ELEMENTS = 1.2, 12
METAL = Material("metal", 7e10, 0.3, 5540.0)


def beam(reference, modes=6):
    """A strip along x that bends most easily in y."""
    line = polyline([(0, 0, 0), (LENGTH, 0, 0)], Member(rectangle(0.01, 0.05), METAL, (0, 0, 1.0)), elements=ELEMENTS)
    ends = [InterfaceRegion("root"), InterfaceRegion("tip")]
    model = fp.from_frame(named(line, root=(0, 0, 0), tip=(LENGTH, 0, 0)), ends)
    return fp.reduce(model, fp.Request(name="rod", reference=reference, reduction=fp.CraigBampton(modes), stress=True))


@pytest.fixture(scope="module")
def body():
    return beam(fp.FixedTo("root"))


def bent(body, share=0.3):
    """(n,) static coordinates of a force across the tip that deflects it by this share of the length."""
    q = body.interface("tip").phi_t[1] / body.omega2
    return q * share * LENGTH / (body.interface("tip").phi_t[1] @ q)


def still(surface, q):
    """A result of one row: the body in the axes of the ground."""
    quantities = {
        "rod.R": Quantity(np.zeros((1, 3)), "m", (XYZ,)),
        "rod.p": Quantity(np.eye(4)[:1], "1", (EULER_PARAMETERS,)),
        "rod.q": Quantity(q[None], "m sqrt(kg)", (mode_axis("rod", q.size),)),
    }
    return Result(np.zeros(1), quantities, {"rod": surface})


def axis_of(surface, points):
    """(S, 3) the middle of the points at each station along x."""
    stations, at = np.unique(surface.points[:, 0].round(9), return_inverse=True)
    return np.array([points[at == k].mean(axis=0) for k in range(len(stations))])


def drawn_axis(surface, q, scale=1.0):
    shown = film(still(surface, q), 1, scale=scale)
    return axis_of(surface, drawn_points(shown.solids[0], 0, shown.scale))


def arc(axis):
    return np.linalg.norm(np.diff(axis, axis=0), axis=1).sum()


def test_a_beam_bent_by_a_third_keeps_its_length(body):
    """What is left is the fourth power of the slope, up to 0.45; to first order it is longer by half the square of it."""
    q = bent(body)
    assert arc(drawn_axis(body.surface, q)) == pytest.approx(LENGTH, rel=4e-3)
    assert arc(drawn_axis(linear_surface(body.surface), q)) > 1.045 * LENGTH
    axis = drawn_axis(body.surface, q)
    assert axis[-1, 1] == pytest.approx(0.3 * LENGTH, rel=1e-3)
    assert LENGTH - axis[-1, 0] == pytest.approx(0.6 * 0.3**2 * LENGTH, rel=0.01)  # half the integral of v'^2


def test_the_length_errs_with_the_fourth_power_of_the_slope(body):
    errors = [arc(drawn_axis(body.surface, bent(body, share))) - LENGTH for share in (0.1, 0.2)]
    assert errors[1] / errors[0] == pytest.approx(16, rel=0.1)


def test_an_exaggerated_picture_keeps_the_length_too(body):
    assert arc(drawn_axis(body.surface, bent(body, 0.03), scale=10.0)) == pytest.approx(LENGTH, rel=4e-3)


def test_simplified_surfaces_are_drawn_alike(body):
    q = bent(body)
    coarse, nearest = decimated(body.surface, 0.5)
    assert len(nearest) < len(body.surface.points)
    np.testing.assert_allclose(displacements(coarse, q), displacements(body.surface, q)[nearest], rtol=0, atol=1e-12)
    field, stress = coarse.second_stress, tensors(coarse, q[None])
    assert stress.shape == (len(coarse.points), 1, 6)
    assert field is not None


def test_result_files_hold_it(body, tmp_path):
    result = still(body.surface, bent(body))
    again = load_result(save_result(result, tmp_path / "r.nc"))
    q = result["rod.q"]
    found, expected = again.geometry["rod"], body.surface
    np.testing.assert_array_equal(displacements(found, q), displacements(expected, q))
    np.testing.assert_array_equal(tensors(found, q), tensors(expected, q))
    np.testing.assert_array_equal(section_forces(again, "rod", 3), section_forces(result, "rod", 3))


def pulled(body, force):
    """In equilibrium under a force across the tip: the drawn middle line, and where the marker at the tip is."""
    scene = fd.Scene(
        (fd.Body("rod", body),),
        (fd.Joint("clamp", "fixed", "ground.O", "rod.root"),),
        ground={"O": (0, 0, 0)},
        loads=(fd.Load("pull", "rod.tip", force=(0.0, force, 0.0)),),
    )
    result = fd.static(scene)
    return axis_of(result.geometry["rod"], drawn_points(film(result, 1).solids[0], 0, 1.0)), result["rod.tip.position"][
        0
    ]


def test_the_drawn_end_is_where_its_marker_is():
    axis, tip = pulled(beam(fp.MeanAxis()), 160.0)
    assert tip[1] > 0.2 * LENGTH
    np.testing.assert_allclose(axis[-1], tip, atol=2e-4)
    assert arc(axis) == pytest.approx(LENGTH, rel=4e-3)


def test_a_picture_in_the_frame_of_an_end_is_of_second_order(body):
    """Markers are those of the mean-axis form; the surface seen from the clamped end is off by the third power."""
    off = []
    for force in (40.0, 80.0):
        axis, tip = pulled(body, force)
        off.append(np.linalg.norm(axis[-1] - tip))
    assert off[1] / off[0] == pytest.approx(8, rel=0.1)
    assert off[1] < 1e-3


def test_bodies_computed_linearly_are_drawn_so(body):
    scene = fd.Scene(
        (fd.Body("rod", body, stiffening=False),),
        (fd.Joint("clamp", "fixed", "ground.O", "rod.root"),),
        ground={"O": (0, 0, 0)},
    )
    surface = fd.static(scene).geometry["rod"]
    assert surface.second is None
    assert surface.second_stress is None


def test_stress_holds_what_is_quadratic(body):
    """sigma is that of the modes and of the field beside them, at every point and time."""
    field = body.surface.second_stress
    shapes, weights = np.ones((len(body.surface.points), 6, 1)), np.eye(body.n)[None]
    surface = replace(body.surface, second_stress=type(field)(shapes, weights))
    q = np.stack([bent(body), 2 * bent(body)])
    linear = np.einsum("pcj,tj->ptc", surface.stress, q)
    expected = linear + (q * q).sum(axis=1)[:, None] / 2
    np.testing.assert_allclose(tensors(surface, q), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert values(surface.second_stress, q).shape == (2, len(surface.points), 6)
