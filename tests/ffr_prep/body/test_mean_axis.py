"""The mean-axis form: what vanishes, the same motions as before, one form for all conditions, guards."""

from __future__ import annotations

from dataclasses import replace
from inspect import unwrap

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_turned_stiffening import BOTH_ENDS, CHORD, FIXED, MEAN, block, differences, rod

import ffr_prep as fp
from ffr_prep.body import FlexibleBody, mean_axis_form
from ffr_prep.body.mean_axis import _check
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.reference import FixedTo, Support, Supports
from ffr_prep.structures.sections import rectangle

ODD = Supports(
    (
        Support("left", "translation", (1.0, 0.0, 0.0)),
        Support("left", "translation", (0.0, 1.0, 0.0)),
        Support("right", "translation", (0.0, 1.0, 0.2)),
        Support("right", "translation", (0.0, 0.0, 1.0)),
        Support("left", "translation", (0.0, 0.3, 1.0)),
        Support("right", "rotation", (1.0, 0.1, 0.0)),
    )
)
CONDITIONS = (FIXED, FixedTo("right"), CHORD, MEAN, ODD, BOTH_ENDS)
MAKERS = {"solid": block, "beam": rod}


@pytest.fixture(scope="module")
def made():
    return {(kind, c): make(c) for kind, make in MAKERS.items() for c in CONDITIONS}


def place(pivot, phi_t, phi_r, K, q) -> tuple[np.ndarray, Rotation]:
    """Point and rotation of a marker to second order."""
    second = -0.5 * np.einsum("eij,i,j->e", K, q, q)
    return pivot + phi_t @ q + second[:3], Rotation.from_rotvec(phi_r @ q + second[3:])


def interface_places(body: FlexibleBody, q) -> list[tuple[np.ndarray, Rotation]]:
    K = body.stiffening[12:].reshape(-1, 6, body.n, body.n)
    return [place(i.position, i.phi_t, i.phi_r, k, q) for i, k in zip(body.interfaces, K, strict=True)]


def mismatch(body: FlexibleBody, q: np.ndarray) -> float:
    """By how much the interfaces, seen from the frame of the mean-axis form, differ from where the body has them."""
    form = mean_axis_form(body)
    frame = form.frame
    at, axes = place(frame.pivot, frame.phi_t, frame.phi_r, frame.K, q)
    worst = 0.0
    pairs = zip(interface_places(body, form.C @ q), interface_places(form.body, q), strict=True)
    for (point, turn), (mean_point, mean_turn) in pairs:
        expected = at + axes.apply(point - frame.pivot)
        worst = max(worst, np.abs(expected - mean_point).max(), np.abs((axes * turn * mean_turn.inv()).magnitude()))
    return worst


@pytest.mark.parametrize("conditions", CONDITIONS, ids=str)
@pytest.mark.parametrize("kind", MAKERS)
def test_nothing_moves_in_the_mean(made, kind, conditions):
    body = mean_axis_form(made[kind, conditions]).body
    assert not body.P_dm.any()
    assert not body.I4.any()
    assert not body.stiffening[:6].any()
    assert body.stiffening[6:].any()


@pytest.mark.parametrize("conditions", CONDITIONS, ids=str)
@pytest.mark.parametrize("kind", MAKERS)
def test_the_motions_are_those_of_the_body_to_second_order(made, kind, conditions):
    """Under any conditions, more than six among them: what is left is of third order in the deformation."""
    body = made[kind, conditions]
    q = np.random.default_rng(1).normal(size=body.n) / np.sqrt(body.omega2)
    q *= 0.02 / np.abs(np.vstack([i.phi_t for i in mean_axis_form(body).body.interfaces]) @ q).max()
    left = np.array([mismatch(body, q / by) for by in (1, 2, 4)])
    assert left.max() < 1e-9 or (np.log2(left[:2] / left[1:]) > 2.9).all()


def test_the_form_does_not_depend_on_the_conditions(made):
    for kind in MAKERS:
        direct = mean_axis_form(made[kind, MEAN]).body
        for conditions in (FIXED, FixedTo("right"), CHORD, ODD):
            body = mean_axis_form(made[kind, conditions]).body
            np.testing.assert_allclose(body.omega2, direct.omega2, rtol=1e-9 if kind == "beam" else 2e-9)
            off, size = differences(body, direct)
            assert off.max() < 1e-8 * size.max()


def test_a_frame_fixed_to_an_interface_is_that_interface(made):
    for kind in MAKERS:
        form = mean_axis_form(made[kind, FIXED])
        left, K = form.body.interfaces[0], form.body.stiffening[12:18]
        np.testing.assert_array_equal(form.frame.pivot, left.position)
        for got, expected in ((form.frame.phi_t, left.phi_t), (form.frame.phi_r, left.phi_r), (form.frame.K, K)):
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_a_frame_on_the_chord_moves_with_its_pin(made):
    form = mean_axis_form(made["beam", CHORD])
    left = form.body.interfaces[0]
    np.testing.assert_allclose(form.frame.phi_t, left.phi_t, rtol=0, atol=1e-9 * np.abs(left.phi_t).max())
    K = form.body.stiffening[12:15]
    np.testing.assert_allclose(form.frame.K[:3], K, rtol=0, atol=1e-8 * np.abs(K).max())


def test_a_mean_axis_frame_stays_where_it_is(made):
    form = mean_axis_form(made["solid", MEAN])
    np.testing.assert_allclose(form.C, np.eye(form.body.n), atol=1e-9)
    assert np.abs(form.frame.phi_t).max() < 1e-9 * np.abs(form.body.interfaces[0].phi_t).max()


def test_a_body_has_one_form_which_is_its_own(made):
    body = made["beam", FIXED]
    form = mean_axis_form(body)
    assert mean_axis_form(body) is form
    own = mean_axis_form(form.body)
    assert own.body is form.body
    assert not own.frame.phi_r.any()


def test_modes_of_equal_frequency_keep_to_the_planes_of_the_axes():
    body = mean_axis_form(rod(FIXED, section=rectangle(0.05, 0.05))).body
    in_y, in_z = (np.einsum("jj->j", body.PP_dm[k, k]) for k in (1, 2))
    neither = np.abs(in_y - in_z) < 1e-9  # torsion, and tension
    assert (np.minimum(in_y, in_z) < 1e-12)[~neither].all()
    assert neither.sum() == 2


def test_what_has_no_form_is_told(made):
    body = made["beam", FIXED]
    with pytest.raises(InputError, match="no load matrices"):
        mean_axis_form(replace(body, stiffening=None))
    form = mean_axis_form(body).body
    with pytest.raises(ComputationError, match="a momentum of the modes of"):
        _check(body, replace(form, P_dm=form.P_dm + 1e-3))
    assert unwrap(fp.mean_axis_form) is mean_axis_form
