"""Matrices from outside as a part of a body: equal to the model they came from, and what they cannot do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matrix_models import STEEL, lumped, of_frame, rod

import ffr_prep as fp
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo
from ffr_prep.pipelines.tied import tied
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, Shell, named, panel, polyline
from ffr_prep.structures.sections import rectangle

SECTION = rectangle(0.02, 0.05)
END = {"reference": FixedTo("root"), "reduction": CraigBampton(6)}
ENDS = (InterfaceRegion("root"), InterfaceRegion("joint", "tip"))


def beam(x: float, length: float, elements: int, left: str, right: str):
    """Along x, as the rod of which the matrices are."""
    a, b = (x, 0.0, 0.0), (x + length, 0.0, 0.0)
    member = rod(SECTION, 1.0, 2).members[0]
    frame = named(
        polyline([a, b], Member(SECTION, STEEL, member.orientation), elements=elements), **{left: a, right: b}
    )
    return fp.from_frame(frame, [InterfaceRegion(left), InterfaceRegion(right)])


@pytest.fixture(scope="module")
def matrices():
    return of_frame(rod(SECTION, 0.5, 6))


def test_half_of_matrices_and_half_a_beam_is_the_whole_beam(matrices):
    """A consistent mass: frequencies, inertia and interfaces to rounding, integrals of the modes to the waves' length."""
    parts = {"matrices": fp.from_matrices(matrices, ENDS), "beam": beam(0.5, 0.5, 6, "joint", "tip")}
    body = fp.reduce(tied(parts, [("matrices.joint", "beam.joint")]), fp.Request(name="b", **END))
    whole = fp.reduce(beam(0.0, 1.0, 12, "root", "tip"), fp.Request(name="b", **END))
    np.testing.assert_allclose(body.omega2, whole.omega2, rtol=1e-7)
    np.testing.assert_allclose(body.rr_dm[0, 0], whole.rr_dm[0, 0], rtol=1e-9)
    np.testing.assert_allclose(body.r_dm, whole.r_dm, atol=1e-9 * whole.r_dm[0])
    np.testing.assert_allclose(np.abs(body.P_dm), np.abs(whole.P_dm), atol=1e-6)
    np.testing.assert_allclose(np.abs(body.interface("tip").phi_t), np.abs(whole.interface("tip").phi_t), atol=1e-5)
    assert set(body.provenance["parts"]) == {"matrices", "beam"}
    assert [i.name for i in body.interfaces] == ["root", "tip"]


def test_alone_it_is_the_body_of_its_matrices(matrices):
    body = fp.reduce(tied({"matrices": fp.from_matrices(matrices, ENDS)}, []), fp.Request(name="b", **END))
    alone = fp.reduce(fp.from_matrices(matrices, ENDS), fp.Request(name="b", **END))
    for key in ("omega2", "rr_dm", "P_dm", "rP_dm", "PP_dm"):
        np.testing.assert_array_equal(getattr(body, key), getattr(alone, key))


def test_doubts_of_its_mass_are_kept(matrices):
    parts = {"matrices": fp.from_matrices(matrices, ENDS), "beam": beam(0.5, 0.5, 6, "joint", "tip")}
    model = tied(parts, [("matrices.joint", "beam.joint")])
    body = fp.reduce(model, fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(40)))
    (warning,) = body.provenance["warnings"]
    assert warning.startswith("matrices: the mass matrix does not say how these coordinates change the inertia")


@pytest.mark.parametrize("point", [(0.4, 0.0, 0.0), (0.5, 0.2, -0.1)])
def test_a_mean_interface_is_that_of_the_frame(point):
    """The edge of a sheet: its translations, and rotations about it."""
    sheet = panel([(0, 0, 0), (0.4, 0, 0), (0.4, 0.1, 0), (0, 0.1, 0)], Shell(0.005, STEEL), elements=(4, 2))
    sheet = replace(sheet, node_groups={"edge": np.flatnonzero(sheet.points[:, 0] > 0.39)})
    edge = [InterfaceRegion("edge", kind="mean", point=point)]
    of_matrices, of_sheet = fp.from_matrices(of_frame(sheet), edge).coupled, fp.from_frame(sheet, edge).coupled
    np.testing.assert_allclose(of_matrices.C.toarray(), of_sheet.C.toarray(), atol=1e-12)


def test_the_others_keep_their_stress(matrices):
    parts = {"matrices": fp.from_matrices(matrices, ENDS), "beam": beam(0.5, 0.5, 6, "joint", "tip")}
    body = fp.reduce(tied(parts, [("matrices.joint", "beam.joint")]), fp.Request(name="b", stress=True, **END))
    own = fp.reduce(beam(0.5, 0.5, 6, "root", "tip"), fp.Request(name="b", stress=True, **END))
    assert body.surface.stress.shape[0] == own.surface.stress.shape[0]
    assert len(body.surface.beams.modes) == 6


def test_what_matrices_cannot_do(matrices):
    body = fp.reduce(fp.from_matrices(matrices, ENDS), fp.Request(name="b", **END))
    assert body.stiffening is None
    with pytest.raises(InputError, match="need stresses"):
        fp.from_matrices(matrices, ENDS).stiffening()
    with pytest.raises(InputError, match="have no mass"):
        tied({"matrices": fp.from_matrices(replace(matrices, M=lumped(matrices)), ENDS)}, [])
