"""Normal modes that are verified: residuals, the Sturm count, what is said where one is missing."""

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse.linalg as spl

import ffr_prep as fp
from ffr_prep.common.errors import ComputationError
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import material
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.modes import normal_modes
from ffr_prep.report.text import body_lines
from ffr_prep.solvers.factor import Solver, free_body, supported

BOX = Path(__file__).resolve().parents[3] / "meshes" / "box.geo"
VERIFIED = Solver(verify=True)


@pytest.fixture(scope="module")
def model():
    numbers = {"x": 1.0, "y": 0.1, "z": 0.1, "nx": 12.0, "ny": 2.0, "nz": 2.0}
    return fp.from_mesh(read_mesh(BOX, numbers=numbers), material("steel"), [InterfaceRegion("left")])


def searched(model, count):
    coupled = model.coupled
    body = free_body(coupled.K, coupled.T, coupled.places, VERIFIED)
    held = supported(body, coupled.C.toarray())
    return held, coupled.M, *normal_modes(coupled, held, count)


@pytest.mark.slow
def test_hundreds_of_modes_are_those_of_eigsh(model):
    held, M, omega2, modes = searched(model, 200)
    found = held.body.verify(held, M, omega2, modes)
    inner = model.coupled.K.shape[0] - 6
    K, inside = model.coupled.K[:inner][:, :inner].tocsc(), M[:inner][:, :inner].tocsc()
    exact = np.sort(spl.eigsh(K, 200, inside, sigma=0.0, return_eigenvectors=False))
    np.testing.assert_allclose(omega2, exact, rtol=1e-10)
    assert found.counted == np.sum(exact < found.below) >= 198
    assert found.residuals.shape == (200,)
    assert found.residuals.max() < 1e-8


def test_square_beams_may_be_cut_between_two_modes_of_equal_frequency(model):
    for count in (1, 2, 3):
        held, M, omega2, modes = searched(model, count)
        assert held.body.verify(held, M, omega2, modes).counted in (count - 1, count, count - 2)


def test_a_missing_mode_is_noticed(model):
    held, M, omega2, modes = searched(model, 30)
    kept = np.delete(np.arange(30), 7)
    with pytest.raises(
        ComputationError, match=r"normal modes lie below .* Hz and the search has found .* of them: ask for"
    ):
        held.body.verify(held, M, omega2[kept], modes[:, kept])


def test_a_wrong_mode_is_noticed(model):
    held, M, omega2, modes = searched(model, 12)
    modes[:, 4] += 1e-4 * modes[:, 9]
    with pytest.raises(ComputationError, match=r"normal mode 5 .* misses its equation"):
        held.body.verify(held, M, omega2, modes)


@pytest.mark.parametrize("reduction", [CraigBampton(20), Eigenmodes(20)])
def test_the_body_keeps_what_was_found(model, reduction):
    body = fp.reduce(
        model, fp.Request(name="b", reference=MeanAxis(), reduction=reduction, linear=True, solver=VERIFIED)
    )
    kept = body.provenance["normal_modes"]
    assert len(kept["residuals"]) == 20
    assert 18 <= kept["counted"] <= 20
    assert any(line.startswith("verified    20 normal modes") for line in body_lines(body))


def test_nothing_is_kept_where_nobody_asked(model):
    body = fp.reduce(model, fp.Request(name="b", reference=FixedTo("left"), reduction=Eigenmodes(4), linear=True))
    assert "normal_modes" not in body.provenance
    assert not any(line.startswith("verified") for line in body_lines(body))
