"""Inertia terms left out: where the mass matrix stays positive, what they do to a pendulum, and refusals that name them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.dropped_terms import check_dropped, deflection
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError

LENGTH = 1.2
IN_SPACE = range(6)
CONDITIONS = {
    "mean axis": fp.MeanAxis(),
    "simply supported": fp.SimplySupported("hinge", "tip"),
    "fixed": fp.FixedTo("hinge"),
}


def rod(reference: fp.model.reference.ReferenceConditions, E: float = 7e10) -> fp.FlexibleBody:
    """The flexible pendulum of docs/economy.md with linear elasticity."""
    member = fp.Member(fp.rectangle(b=0.2, h=9e-3), fp.Material("m", E=E, nu=0.3, rho=5540.0), orientation=(0, 1, 0))
    frame = fp.named(fp.polyline([(0, 0, 0), (LENGTH, 0, 0)], member, elements=12), hinge=(0, 0, 0), tip=(LENGTH, 0, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion("hinge"), fp.InterfaceRegion("tip")])
    return fp.reduce(model, fp.Request(name="rod", reference=reference, reduction=fp.CraigBampton(2)))


def pendulum(body: fp.FlexibleBody, *dropped: str) -> Scene:
    return Scene(
        (Body("rod", replace(body, stiffening=None), dropped=dropped),),
        (Joint("hinge", "revolute", "ground.O", "rod.hinge"),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )


def tip(body: fp.FlexibleBody, *dropped: str) -> np.ndarray:
    return integrate(
        pendulum(body, *dropped), end=1.0, output_step=0.01, method=ROS2(2e-4), outputs=("rod.tip.position",)
    )["rod.tip.position"]


def rigid_part(body: Body, q: np.ndarray) -> np.ndarray:
    M = mass_matrix(kept_integrals(body), q)
    return M[:6, :6] - M[:6, 6:] @ M[6:, :6]


@pytest.mark.parametrize("conditions", CONDITIONS)
@pytest.mark.parametrize("dropped", [("I5",), ("I8",), ("I9",), ("I5", "I9")])
def test_below_the_deflection_that_is_told_the_mass_matrix_is_positive_and_beyond_it_is_not(conditions, dropped):
    """Along every mode, either way; and one of the directions looked at loses it there."""
    body = Body("rod", rod(CONDITIONS[conditions]), dropped=dropped)
    amplitude, whole = deflection(body, IN_SPACE), np.sqrt(body.model.mass)
    static = [row / body.model.omega2 for i in body.model.interfaces for row in (*i.phi_t, *i.phi_r) if row.any()]
    directions = [*np.eye(body.model.n), *(d / np.linalg.norm(d) for d in static)]

    def least(share: float) -> float:
        sizes = (share * whole, -share * whole)
        return min(np.linalg.eigvalsh(rigid_part(body, r * d))[0] for d in directions for r in sizes)

    assert least(min(0.999 * amplitude, LENGTH)) > 0
    if amplitude < LENGTH:
        assert least(1.001 * amplitude) < 0


def test_five_and_nine_may_be_left_out_of_the_pendulum_in_its_mean_axis_frame():
    """Rantalainen's advice. In the plane I5 does nothing at all, I9 a hundredth of what the elasticity does."""
    body = rod(fp.MeanAxis())
    whole = tip(body)
    elastic = np.abs(whole - tip(rod(fp.MeanAxis(), 7e12))).max()
    assert np.abs(tip(body, "I5") - whole).max() < 1e-10
    assert np.abs(tip(body, "I5", "I9") - whole).max() < 2e-2 * elastic
    assert not check_dropped(pendulum(body, "I5", "I9").bodies[0], IN_SPACE)


def test_held_at_both_ends_it_is_told_how_far_the_body_may_deform():
    scene = pendulum(rod(fp.SimplySupported("hinge", "tip")), "I5", "I9")
    notes = [note for note in assemble(scene).notes if "without I5, I9" in note]
    assert len(notes) == 1
    assert "mostly for want of I5" in notes[0]
    assert "mean-axis" in notes[0]


@pytest.mark.parametrize("dropped", [("I5",), ("I8",), ("I5", "I9")])
def test_fixed_at_the_hinge_the_term_is_named_and_refused(dropped):
    with pytest.raises(
        InputError, match=rf"without {', '.join(dropped)} .*mostly for want of {dropped[0]}; .*mean-axis"
    ):
        assemble(pendulum(rod(fp.FixedTo("hinge")), *dropped))


def test_a_run_that_deforms_further_names_the_term():
    with pytest.raises(ComputationError, match=r"mass matrix of body 'rod' is not positive without I9: .*mean-axis"):
        tip(rod(fp.FixedTo("hinge"), 7e9), "I9")


@pytest.mark.parametrize(("dropped", "other"), [("I3", "I4"), ("I4", "I3")])
def test_half_of_the_coupling_to_rigid_motion_is_no_mass_matrix(dropped, other):
    with pytest.raises(InputError, match=f"without {dropped} its mass matrix .* drop {other} with it, or keep it"):
        assemble(pendulum(rod(fp.FixedTo("hinge")), dropped))
