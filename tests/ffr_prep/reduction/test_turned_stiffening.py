"""Geometric stiffening in another frame: laws, equality with direct reductions, motions, guards."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from boxes import STEEL, box_mesh, moved, rotation
from test_beam_stiffening import thin
from test_dyn_references import slider_crank
from test_prep_cli import run

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_prep.body import FlexibleBody, load_body, save_body, with_point
from ffr_prep.body.planar import in_plane
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports
from ffr_prep.pipelines.tied import tied
from ffr_prep.reduction.conversion import with_reference
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, Shell, joined, named, panel, polyline
from ffr_prep.structures.sections import circle, rectangle

FIXED, CHORD, MEAN = FixedTo("left"), SimplySupported("left", "right"), MeanAxis()
REFERENCES = (FIXED, CHORD, MEAN)
BOTH_ENDS = Supports(
    tuple(
        Support(end, motion, tuple(axis))
        for end in ("left", "right")
        for motion in ("translation", "rotation")
        for axis in np.eye(3)
    )
)


def block(reference, kind="mean") -> FlexibleBody:
    """A solid bar in oblique axes."""
    return fp.reduce(
        fp.from_mesh(
            moved(box_mesh("hex20", (1.0, 0.12, 0.16), (4, 1, 1)), rotation(5), np.array([0.2, -0.1, 0.4])),
            STEEL,
            [InterfaceRegion("left", kind=kind), InterfaceRegion("right", kind=kind)],
        ),
        fp.Request(name="b", reference=reference, reduction=CraigBampton(4)),
    )


def rod(reference, modes=6, section=None, length=1.0) -> FlexibleBody:
    """A straight beam along x."""
    member = Member(section or rectangle(0.05, 0.065), STEEL, (0, 1.0, 0))
    return fp.reduce(
        fp.from_frame(
            named(
                polyline([(0, 0, 0), (length, 0, 0)], member, elements=16),
                left=(0, 0, 0),
                right=(length, 0, 0),
                crankpin=(0, 0, 0),
                slider=(length, 0, 0),
            ),
            [InterfaceRegion("left"), InterfaceRegion("right")],
        ),
        fp.Request(name="rod", reference=reference, reduction=CraigBampton(modes)),
    )


def tied_pair(reference, kind) -> FlexibleBody:
    """A solid bar in oblique axes and a beam that goes on beside it, tied by an arm."""
    R, at = rotation(5), np.array([0.2, -0.1, 0.4])
    bar = moved(box_mesh("hex20", (0.6, 0.12, 0.16), (3, 1, 1)), R, at)
    ends = [tuple(R @ point + at) for point in ((0.7, 0.05, 0.1), (1.2, 0.05, 0.1))]
    beam = polyline(ends, Member(rectangle(0.05, 0.065), STEEL, tuple(R[:, 1])), elements=4)
    parts = {
        "bar": fp.from_mesh(bar, STEEL, [InterfaceRegion("left"), InterfaceRegion("face", "right", kind)]),
        "beam": fp.from_frame(
            named(beam, start=ends[0], right=ends[1]), [InterfaceRegion("start"), InterfaceRegion("right")]
        ),
    }
    model = tied(parts, [("bar.face", "beam.start")])
    return fp.reduce(model, fp.Request(name="b", reference=reference, reduction=CraigBampton(4)))


def comb(reference) -> FlexibleBody:
    """A beam with a tooth; its last nodes and the tooth, which are nearly on a line, move an interface in the mean."""
    section, points = rectangle(0.05, 0.065), [(0, 0, 0), (0.7, 0, 0), (0.85, 0, 0), (1, 0, 0)]
    beam = joined(
        polyline(points, Member(section, STEEL, (0, 1.0, 0)), elements=3),
        polyline([(0.85, 0, 0), (0.85, 0.1, 0.05)], Member(section, STEEL, (1.0, 0, 0)), elements=1),
    )
    last = [node for node, x in enumerate(beam.points) if x[0] > 0.69]
    beam = replace(named(beam, left=(0, 0, 0)), node_groups={"left": np.array([0]), "right": np.array(last)})
    return fp.reduce(
        fp.from_frame(beam, [InterfaceRegion("left"), InterfaceRegion("right", kind="mean")]),
        fp.Request(name="comb", reference=reference, reduction=CraigBampton(6)),
    )


def plate(reference) -> FlexibleBody:
    """A strip of quadrilaterals in the plane of x and y."""
    strip = panel([(0, 0, 0), (1, 0, 0), (1, 0.1, 0), (0, 0.1, 0)], Shell(0.005, STEEL), elements=(32, 4))
    x = strip.points[:, 0]
    strip = replace(strip, node_groups={"left": np.flatnonzero(x < 1e-9), "right": np.flatnonzero(x > 1 - 1e-9)})
    return fp.reduce(
        fp.from_frame(strip, [InterfaceRegion("left"), InterfaceRegion("right")]),
        fp.Request(name="b", reference=reference, reduction=CraigBampton(6)),
    )


BODIES = {
    "solid, mean": lambda reference: block(reference, "mean"),
    "solid, rigid": lambda reference: block(reference, "rigid"),
    "beams": lambda reference: rod(reference),
    "beams, mean": comb,
    "solid and beam": lambda reference: tied_pair(reference, "rigid"),
    "solid and beam, mean": lambda reference: tied_pair(reference, "mean"),
}


@pytest.fixture(scope="module")
def made():
    """The body of a kind under some conditions, made when it is first asked for."""
    return cache(lambda kind, reference: BODIES[kind](reference))


@pytest.fixture(scope="module")
def rods():
    return {reference: in_plane(rod(reference)) for reference in REFERENCES}


def differences(body: FlexibleBody, expected: FlexibleBody) -> tuple[np.ndarray, np.ndarray]:
    """(r,) largest difference of each matrix in the modes of `expected`, and their sizes, both times 1/(omega_i omega_j)."""
    X = np.linalg.lstsq(body.surface.Phi.reshape(-1, body.n), expected.surface.Phi.reshape(-1, expected.n), rcond=None)[
        0
    ]
    np.testing.assert_allclose(X.T @ X, np.eye(body.n), atol=1e-8)  # the same motions in the same frame
    scale = np.sqrt(np.outer(expected.omega2, expected.omega2))
    off = (X.T @ body.stiffening @ X - expected.stiffening) / scale
    return np.abs(off).max(axis=(1, 2)), np.abs(expected.stiffening / scale).max(axis=(1, 2))


def assert_equal(body, expected, loads, rtol):
    off, size = (value[loads] for value in differences(body, expected))
    assert size.max() > 0
    assert off.max() < rtol * size.max()


# ---- laws ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("old", "new"), [(FIXED, CHORD), (MEAN, CHORD), (FIXED, MEAN), (CHORD, MEAN)], ids=str)
@pytest.mark.parametrize("kind", BODIES)
def test_converting_is_reducing_in_the_new_frame(made, kind, old, new):
    """For every load, forces and moments, solids, beams and both, on rigid and mean interfaces: to rounding."""
    assert_equal(with_reference(made(kind, old), new), made(kind, new), slice(None), 1e-9)


@pytest.mark.slow
def test_converting_plates_is_nearly_reducing_in_the_new_frame():
    """Loads in their plane, to the square of the element size; bending moments of plates stiffen nothing."""
    plates = {reference: plate(reference) for reference in REFERENCES}
    in_plane_loads = [0, 1, 5, 6, 7, 8, 9, 12, 13, 17, 18, 19, 23]
    for old, new in ((FIXED, CHORD), (CHORD, MEAN)):
        assert_equal(with_reference(plates[old], new), plates[new], in_plane_loads, 0.015)


@pytest.mark.parametrize("new", REFERENCES[1:], ids=str)
def test_back_and_forth_is_the_identity(made, new):
    body = made("solid, rigid", FIXED)
    assert_equal(with_reference(with_reference(body, new), FIXED), body, slice(None), 1e-8)


def test_the_way_to_a_frame_does_not_matter(made):
    body = made("solid, rigid", FIXED)
    assert_equal(with_reference(with_reference(body, CHORD), MEAN), with_reference(body, MEAN), slice(None), 1e-8)


def test_a_uniform_acceleration_stresses_nothing_in_the_mean_axis_frame(made):
    converted = with_reference(made("solid, rigid", FIXED), MEAN)
    scale = np.sqrt(np.outer(converted.omega2, converted.omega2))
    size = np.abs(converted.stiffening / scale).max(axis=(1, 2))
    assert size[:6].max() < 1e-9 * size[6:12].max()


def test_more_conditions_than_six_share_the_loads(rods):
    """Clamped at both ends, half of an axial acceleration is carried by each: as pressed as pulled."""
    converted = with_reference(rods[FIXED], BOTH_ENDS)
    direct = in_plane(rod(BOTH_ENDS))
    assert_equal(converted, direct, [0, 6, 7, 8], 0.02)
    assert np.abs(np.trace(converted.stiffening[0])) < 1e-3 * np.abs(converted.stiffening[0]).max()


# ---- motions ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_motion_of_a_slider_crank_is_the_same():
    """The rod of the stiffened slider-crank, reduced in one frame and converted, against reduced there: the deflection
    of its middle from the chord, which is 4.3 mm at most."""

    def deflection(body):
        names = ("crankpin", "slider")
        body = replace(
            body, interfaces=tuple(replace(i, name=name) for i, name in zip(body.interfaces, names, strict=True))
        )
        result = integrate(slider_crank(body), end=0.05, output_step=1e-3, method=ROS2(2e-5))
        Phi = body.surface.Phi[[np.argmin(np.abs(body.surface.points[:, 0] - x)) for x in (0.0, 0.15, 0.3)]]
        ends = np.array([i.phi_t[1] for i in body.interfaces])
        return result["rod.q"] @ (Phi[1, 1] - ends.mean(axis=0))

    made = {reference: rod(reference, 6, thin(circle(0.006)), 0.3) for reference in REFERENCES}
    direct = {reference: deflection(made[reference]) for reference in (CHORD, MEAN)}
    peak = np.abs(direct[CHORD]).max()
    assert peak == pytest.approx(4.3e-3, rel=0.01)
    for old, new in ((FIXED, CHORD), (FIXED, MEAN), (MEAN, CHORD)):
        converted = deflection(with_reference(made[old], new))
        assert np.abs(converted - direct[new]).max() < 1e-3 * peak
    without = deflection(replace(made[CHORD], stiffening=None))
    assert np.abs(without - direct[CHORD]).max() > 0.1 * peak


# ---- guards -------------------------------------------------------------------------------------------------------------


def test_the_command_line_leaves_the_load_matrices_out(rods, tmp_path):
    given = ["convert", save_body(rods[FIXED], tmp_path / "b.ffr"), "--reference", "mean-axis"]
    run(*given, "--linear", "-o", tmp_path / "c.ffr")
    assert load_body(tmp_path / "c.ffr").stiffening is None


def test_points_that_were_added_turn_like_others(made):
    """As far as the surface, which is kept in fewer numbers, knows their second order."""
    at = made("solid, rigid", FIXED).centre_of_mass
    converted = with_reference(with_point(made("solid, rigid", FIXED), "middle", at), MEAN)
    direct = with_point(with_reference(made("solid, rigid", FIXED), MEAN), "middle", at)
    scale = np.sqrt(np.outer(direct.omega2, direct.omega2))
    off, size = ((K / scale)[-6:] for K in (converted.stiffening - direct.stiffening, direct.stiffening))
    assert np.abs(off).max() < 1e-3 * np.abs(size).max()
    np.testing.assert_array_equal(
        converted.stiffening[:-6], with_reference(made("solid, rigid", FIXED), MEAN).stiffening
    )


def test_points_without_matrices_hold_nothing(made):
    """As bodies of earlier versions have them."""
    body = with_point(made("solid, rigid", FIXED), "middle", made("solid, rigid", FIXED).centre_of_mass)
    stiffening = np.array(body.stiffening)
    stiffening[-6:] = 0.0
    body = replace(body, stiffening=stiffening)
    assert not with_reference(body, MEAN).stiffening[-6:].any()
    with pytest.raises(InputError, match="loads at interface 'middle' have no load matrices"):
        with_reference(body, FixedTo("middle"))
