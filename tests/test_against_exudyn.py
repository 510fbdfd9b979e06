"""The same reduced bodies in an independent code: equal inertia terms, and equal motion as the step goes to zero.

Exudyn: J. Gerstmayr, International Journal of Mechanical System Dynamics 3 (2023).
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from benchmarks.against_exudyn import (  # noqa: E402
    Case,
    distance,
    extrapolated,
    integral_differences,
    mass_proportional,
    pendulum_case,
    resolving,
    slidercrank_case,
)
from ffr_dyn.integrators import RK4  # noqa: E402

AGREEMENT = 1e-6  # [m]


def in_the_limit(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Our run with every mode resolved, and Exudyn's run extrapolated to step zero."""
    return case.ours(resolving(case)), extrapolated([case.theirs(step) for step in case.steps])


@pytest.fixture(scope="module", params=["rigid", "mean"])
def pendulum(request: pytest.FixtureRequest) -> Case:
    return pendulum_case(request.param, 2, (5e-5, 2.5e-5))


@pytest.mark.slow
def test_inertia_terms_are_those_exudyn_forms_from_the_mesh(pendulum: Case) -> None:
    differences = integral_differences(pendulum.pair)
    assert differences.pop("stiffness") < 1e-10
    assert max(differences.values()) < 1e-12


@pytest.mark.slow
def test_pendulum_agrees_to_a_micrometre_over_half_a_second(pendulum: Case) -> None:
    ours, theirs = in_the_limit(pendulum)
    assert np.ptp(ours, axis=0).max() > 1.0  # [m]: the rod has swung
    assert distance(ours, theirs) < AGREEMENT


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rigid", "mean"])
def test_slidercrank_agrees_to_a_micrometre(kind: str) -> None:
    case = slidercrank_case(kind, 2, (4e-6, 2e-6), 0.084)
    ours, theirs = in_the_limit(case)
    assert np.ptp(ours, axis=0).max() > 0.25  # [m]: the crank has turned
    assert distance(ours, theirs) < AGREEMENT
