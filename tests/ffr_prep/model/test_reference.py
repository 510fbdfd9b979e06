"""Reference conditions: what each prevents, that a free motion is named, and that the choice is one of bookkeeping."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL, box_mesh, moved, rigid_motions, rotation

from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import (
    FixedTo,
    MeanAxis,
    SimplySupported,
    Support,
    Supports,
    UserConditions,
    free_rigid_motions,
    functionals,
    motion_in_words,
)
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple

SIZE = (1.0, 0.3, 0.2)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.fixture(scope="module")
def model():
    mesh = box_mesh("tet10", SIZE, (2, 1, 1), origin=(0.0, -0.15, -0.1))
    return couple(mesh, assemble(mesh, STEEL), [InterfaceRegion("left"), InterfaceRegion("right", kind="mean")])


def supports(*rows):
    return Supports(tuple(Support(*row) for row in rows))


# ---- laws ---------------------------------------------------------------------------------------------------------

DETERMINATE = (
    FixedTo("left"),
    FixedTo("right"),
    SimplySupported("left", "right"),
    SimplySupported("right", "left"),
    MeanAxis(),
    supports(
        *(("left", "translation", axis) for axis in AXES),
        *(("right", "translation", axis) for axis in AXES[1:]),
        ("right", "rotation", AXES[0]),
    ),
)


@pytest.mark.parametrize("conditions", DETERMINATE, ids=lambda c: f"{type(c).__name__}-{getattr(c, 'pin', '')}")
def test_determinate_conditions_hold_exactly_the_rigid_motions(model, conditions):
    L = functionals(conditions, model)
    assert L.shape == (6, model.K.shape[0])
    np.testing.assert_allclose(np.linalg.norm(L, axis=1), 1, rtol=1e-14)
    assert np.linalg.matrix_rank(L @ model.T) == 6


def test_fixed_means_that_the_interface_does_not_move(model):
    L = functionals(FixedTo("right"), model)
    z = random_field_satisfying(L)
    assert np.abs(model.C[6:] @ z).max() < 1e-12
    assert np.abs(model.C[:6] @ z).max() > 1e-3


def test_simply_supported_keeps_the_chord_on_the_axis():
    R = rotation(3)
    mesh = moved(box_mesh("tet10", SIZE, (2, 1, 1)), R, np.array([1.0, 2.0, 3.0]))
    model = couple(mesh, assemble(mesh, STEEL), [InterfaceRegion("left"), InterfaceRegion("right")])
    z = random_field_satisfying(functionals(SimplySupported("left", "right"), model))
    pin_t, pin_r, roller_t, _ = (model.C @ z).reshape(4, 3) @ R
    assert np.abs(pin_t).max() < 1e-12
    assert abs(pin_r[0]) < 1e-12
    assert np.abs(roller_t[1:]).max() < 1e-12
    assert min(abs(roller_t[0]), abs(pin_r[1]), abs(pin_r[2])) > 1e-4


def test_mean_axis_leaves_no_momentum(model):
    z = random_field_satisfying(functionals(MeanAxis(), model))
    u = (model.B @ z).reshape(-1, 3)
    mesh_mass = couple_free_mass()
    momenta = mesh_mass @ u
    assert np.abs(momenta.sum(axis=0)).max() < 1e-10
    assert np.abs(np.cross(model.points, momenta).sum(axis=0)).max() < 1e-10


def couple_free_mass():
    return assemble(box_mesh("tet10", SIZE, (2, 1, 1), origin=(0.0, -0.15, -0.1)), STEEL).m


def random_field_satisfying(L):
    z = np.random.default_rng(4).normal(size=L.shape[1])
    return z - np.linalg.pinv(L) @ (L @ z)


def test_user_conditions_by_array_and_by_function(model):
    count = len(model.points)
    mean = np.zeros((6, count, 3))
    mean[:3] = np.eye(3)[:, None, :]
    mean[3:] = rigid_motions(model.points)[:, :, 3:].transpose(2, 0, 1)
    by_array = functionals(UserConditions(mean), model)
    by_function = functionals(UserConditions(lambda points: rigid_motions(points).transpose(2, 0, 1)), model)
    np.testing.assert_allclose(by_array, by_function, atol=1e-14)
    z = random_field_satisfying(by_array)
    assert np.abs((model.B @ z).reshape(-1, 3).sum(axis=0)).max() < 1e-11


def test_more_than_six_conditions_are_kept_and_repeated_ones_are_not(model):
    both = supports(
        *((end, motion, axis) for end in ("left", "right") for motion in ("translation", "rotation") for axis in AXES)
    )
    assert len(functionals(both, model)) == 12
    twice = Supports(both.supports + both.supports[:4])
    assert len(functionals(twice, model)) == 12


# ---- a free motion is named ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("conditions", "words"),
    [
        (
            supports(*((end, "translation", axis) for end in ("left", "right") for axis in AXES)),
            r"do not prevent rotation about the axis through \(0.5, 0, 0\) m along \(1, 0, 0\): add",
        ),
        (
            supports(*(("left", motion, axis) for motion in ("translation", "rotation") for axis in AXES[:2])),
            r"do not prevent rotation about the axis through \(0, 0, 0\) m along \(0, 0, 1\) "
            r"and translation along \(0, 0, 1\)",
        ),
        (
            supports(
                *(("left", "rotation", axis) for axis in AXES), *(("left", "translation", axis) for axis in AXES[:2])
            ),
            r"do not prevent translation along \(0, 0, 1\): add",
        ),
        (Supports(()), "rotation about the axis .* and translation along"),
    ],
)
def test_free_rigid_motions_are_named(model, conditions, words):
    with pytest.raises(InputError, match=words):
        functionals(conditions, model)


def test_a_screw_motion_is_named():
    # Translation along x is tied to rotation about x: u_x = 0.1 m/rad * theta_x stays free.
    held = np.delete(np.eye(6), 3, axis=0)
    held[0, 3] = -0.1
    (motion,) = free_rigid_motions(held, 1.0).T
    words = motion_in_words(motion, np.zeros(3), 1.0)
    assert words == "screw motion about the axis through (0, 0, 0) m along (1, 0, 0) with pitch 0.1 m/rad"


@pytest.mark.parametrize("length", [1e-4, 1.0, 1e4])
def test_rank_does_not_depend_on_the_size_of_the_body(length):
    mesh = box_mesh("tet10", tuple(length * np.array(SIZE)), (2, 1, 1))
    model = couple(mesh, assemble(mesh, STEEL), [InterfaceRegion("left"), InterfaceRegion("right", kind="mean")])
    for conditions in DETERMINATE:
        assert len(functionals(conditions, model)) == 6
    with pytest.raises(InputError, match=r"rotation about the axis .* along \(1, 0, 0\): add"):
        functionals(supports(*((end, "translation", axis) for end in ("left", "right") for axis in AXES)), model)


# ---- guards -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "conditions", [FixedTo("top"), SimplySupported("left", "top"), supports(("top", "rotation", AXES[0]))]
)
def test_an_unknown_interface_is_named_with_the_known_ones(model, conditions):
    with pytest.raises(InputError, match="no interface 'top'; the interfaces are: 'left', 'right'"):
        functionals(conditions, model)


def test_a_chord_of_no_length_is_refused(model):
    with pytest.raises(InputError, match="same point"):
        functionals(SimplySupported("left", "left"), replace(model))


def test_supports_and_user_conditions_are_checked(model):
    with pytest.raises(InputError, match="motion is 'slide'"):
        Support("left", "slide", AXES[0])
    with pytest.raises(InputError, match="is not a direction"):
        Support("left", "rotation", (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"shape \(6, 2, 3\); they must be \(r, \d+, 3\)"):
        functionals(UserConditions(np.ones((6, 2, 3))), model)
    with pytest.raises(InputError, match="not finite"):
        functionals(UserConditions(np.full((6, len(model.points), 3), np.inf)), model)
