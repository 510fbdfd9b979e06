"""The same reduced bodies in Exudyn, an independent code: equal mass terms, equal motion as the step goes to zero."""

import numpy as np
import pytest

pytest.importorskip("exudyn", reason="the extra 'bench' is not installed")

from benchmarks import against_exudyn as compared
from benchmarks.scenes import connecting_rod, pendulum_rod
from ffr_dyn.integrators import RK4

AGREEMENT = 1e-6  # m
KINDS = ("rigid", "mean")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [pendulum_rod, connecting_rod])
def test_mass_terms_from_the_mesh_are_equal(make, kind):
    found = compared.mass_term_differences(make(kind, 8))
    assert found.pop("stiffnessMatrixReduced") < 1e-8  # rounding of the stiffest motion of the mesh
    assert max(found.values()) < 1e-12, found


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_pendulum_over_half_a_second(kind):
    case = compared.pendulum_case(kind, (4e-5,))
    best = compared.ours(case, RK4(2e-5))
    found = compared.theirs(case, *case.steps)
    assert np.linalg.norm(best[-1] - best[0], axis=1).min() > 0.5  # both points have moved far
    assert compared.distance(found, best).max() < AGREEMENT


@pytest.mark.slow
def test_gravity_on_the_undeformed_body_is_seen():
    """Exudyn's own load for gravity leaves out the moment (I3 q) x g; the comparison notices a term of this size."""
    case = compared.pendulum_case("rigid", (2e-4,))
    best = compared.ours(case, RK4(2e-5))
    found = compared.theirs(case, *case.steps, gravity_on=compared.UNDEFORMED_BODY)
    assert compared.distance(found, best).max() > 100 * AGREEMENT


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_slider_crank(kind):
    case = compared.slider_crank_case(kind, 0.084, (2.5e-6, 1.25e-6))
    best = compared.ours(case, RK4(case.our_step))
    coarse, fine = (compared.theirs(case, step) for step in case.steps)
    assert compared.distance(fine, best).max() < 0.3 * compared.distance(coarse, best).max()  # order two
    assert compared.distance(compared.extrapolated(coarse, fine), best).max() < AGREEMENT
