"""Every solver behind the one door gives the same body, and none solves with a matrix that is singular or indefinite."""

import re
import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from boxes import STEEL, box_mesh
from places import MESHES

import ffr_prep as fp
from ffr_prep import cli
from ffr_prep.body import load_body
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.solvers import slepc
from ffr_prep.solvers.factor import Solver, factorise
from ffr_prep.solvers.slepc import mpi_solve, started

MESH = box_mesh("tet10", (1.0, 0.2, 0.13), (8, 2, 2))
KEPT, CLAMPED = CraigBampton(8), FixedTo("left")
ENDS = [InterfaceRegion("left"), InterfaceRegion("right", kind="mean")]


def has_slepc():
    if shutil.which("mpirun") is None or not all(slepc._home(name) for name in slepc._HOMES):
        return False
    test = [slepc._PYTHON, "-c", "import petsc4py, slepc4py"]
    return subprocess.run(test, env=slepc._environment(), capture_output=True).returncode == 0


def has_pardiso():
    try:
        import pypardiso  # noqa: F401
    except ImportError:
        return False
    return True


with_slepc = pytest.mark.skipif(not has_slepc(), reason="SLEPc for the system's Python is not installed")
with_pardiso = pytest.mark.skipif(not has_pardiso(), reason="pypardiso is not installed")
LOCAL = ["cholesky", "superlu", pytest.param("pardiso", marks=with_pardiso)]
OTHERS = [
    Solver("superlu"),
    pytest.param(Solver("pardiso"), marks=with_pardiso),
    pytest.param(Solver("slepc", 1), marks=with_slepc),
    pytest.param(Solver("slepc", 2), marks=with_slepc),
]


def reduced(solver, reduction=KEPT, reference=CLAMPED):
    return fp.reduce(
        fp.from_mesh(MESH, STEEL, ENDS),
        fp.Request(name="bar", reference=reference, reduction=reduction, solver=solver),
    )


@pytest.fixture(scope="module")
def own():
    return reduced(Solver())


@pytest.mark.parametrize("solver", OTHERS)
def test_every_solver_gives_the_same_body(own, solver):
    other = reduced(solver)
    np.testing.assert_allclose(other.omega2, own.omega2, rtol=1e-9)
    for name in ("P_dm", "rP_dm", "PP_dm", "stiffening"):
        expected = getattr(own, name)
        np.testing.assert_allclose(getattr(other, name), expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(other.surface.Phi, own.surface.Phi, rtol=0, atol=1e-9 * np.abs(own.surface.Phi).max())
    assert other.provenance["solver"] == {"type": "Solver", "name": solver.name, "ranks": solver.ranks}


@pytest.mark.parametrize("name", LOCAL)
@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.diag([1.0, 0.0, 2.0]), "not positive definite|singular"),
        (np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "not positive definite"),
        (np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + 1e-15, 0.0], [0.0, 0.0, 1.0]]), "not positive definite|singular"),
        (np.diag([1.0, -1.0, 2.0]), "not positive definite"),
    ],
)
def test_a_matrix_that_is_not_positive_definite_is_never_solved_with(name, matrix, message):
    with pytest.raises(ComputationError, match=message):
        factorise(sp.csr_array(matrix), np.arange(9.0).reshape(3, 3), Solver(name))


@with_slepc
def test_slepc_refuses_an_indefinite_matrix():
    with pytest.raises(ComputationError, match="not positive definite"):
        started(sp.csr_array(np.array([[1.0, 2.0], [2.0, 1.0]])), 2)


@with_slepc
def test_processes_that_were_killed_are_named():
    process = started(sp.csr_array(np.diag([1.0, 2.0, 4.0])), 1)
    np.testing.assert_allclose(mpi_solve(process, np.ones((3, 1)))[:, 0], [1, 0.5, 0.25], rtol=1e-14)
    process.child.kill()
    process.child.wait()
    with pytest.raises(ComputationError, match="the SLEPc processes ended with code -9; their last words"):
        mpi_solve(process, np.ones((3, 1)))


@with_slepc
def test_the_processes_end_with_what_holds_them():
    process = started(sp.csr_array(np.eye(3)), 1)
    child, folder = process.child, process.folder
    del process
    assert child.wait(30) == 0
    assert not Path(folder).exists()


@with_slepc
def test_slepc_refuses_supports_that_touch_most_of_a_body(monkeypatch):
    monkeypatch.setattr(slepc, "_LOCAL", 5)
    with pytest.raises(InputError, match=r"supports that touch \d+ unknowns \(at most 5\) and are not the mean axis"):
        reduced(Solver("slepc"), Eigenmodes(30), CLAMPED)


@with_slepc
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("reference", [MeanAxis(), CLAMPED])
def test_slepc_finds_and_counts_modes_about_the_mean_axis(monkeypatch, ranks, reference):
    monkeypatch.setattr(slepc, "_LOCAL", 100)
    ours = reduced(Solver(verify=True), Eigenmodes(30), reference)
    theirs = reduced(Solver("slepc", ranks, verify=True), Eigenmodes(30), reference)
    np.testing.assert_allclose(theirs.omega2, ours.omega2, rtol=1e-9)
    np.testing.assert_allclose(theirs.PP_dm, ours.PP_dm, rtol=0, atol=1e-7 * np.abs(ours.PP_dm).max())
    found = [body.provenance["normal_modes"] for body in (ours, theirs)]
    assert found[0]["counted"] == found[1]["counted"] >= 27
    assert max(found[1]["residuals"]) < 1e-8


@with_slepc
def test_processes_that_are_busy_end_when_nothing_waits_for_them(monkeypatch):
    monkeypatch.setattr(slepc, "_GRACE", 0.2)
    process = started(sp.csr_array(np.eye(3)), 2)
    child = process.child
    child.send_signal(signal.SIGSTOP)  # mpirun hears neither the end of the pipe nor the request to end
    del process
    assert child.wait(10) == -signal.SIGKILL


def test_slepc_that_is_not_installed_is_an_error_with_a_remedy(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(InputError, match="apt-get install python3-slepc4py-real"):
        started(sp.csr_array(np.eye(3)), 1)


def test_supports_are_eliminated_exactly():
    rng = np.random.default_rng(0)
    C = np.zeros((3, 20))
    C[:, [2, 5, 7, 11, 13]] = rng.normal(size=(3, 5))
    N = slepc._admissible(C)
    assert N.shape == (20, 17)
    np.testing.assert_allclose(C @ N.toarray(), 0, atol=1e-14)
    assert np.linalg.matrix_rank(N.toarray()) == 17


@pytest.mark.skipif(has_pardiso(), reason="pypardiso is installed")
def test_pardiso_that_is_not_installed_is_an_error_with_a_remedy():
    with pytest.raises(InputError, match=r"pip install ffr\[pardiso\]"):
        factorise(sp.csr_array(np.eye(3)), np.zeros((3, 3)), Solver("pardiso"))


@pytest.mark.parametrize(("name", "ranks"), [("slepc", 0), ("slepc", -2), ("cholesky", 2), ("superlu", 4)])
def test_ranks_that_cannot_be_are_refused(name, ranks):
    with pytest.raises(InputError, match=f"solver '{name}' with {ranks} ranks cannot be run"):
        Solver(name, ranks)


def test_a_solver_that_does_not_exist_is_refused():
    with pytest.raises(InputError, match="no solver 'umfpack'; the solvers are cholesky, superlu, pardiso, slepc"):
        Solver("umfpack")


# ---- the command line ---------------------------------------------------------------------------------------------

BAR = [str(MESHES / "box.geo"), "--set", "nx=6", "--set", "ny=1", "--set", "nz=1", "--material", "steel"]


def test_the_command_line_chooses_a_solver_and_tells_time_and_memory(tmp_path, capsys):
    cli.main(
        ["reduce", *BAR, "--interface", "left", "--modes", "2", "--solver", "superlu", "-o", str(tmp_path / "bar.ffr")]
    )
    said = capsys.readouterr().out
    assert re.search(r"time +\d+\.\d s; the longest steps: [a-z ]+ \d+\.\d s, ", said)
    assert re.search(r"memory +\d\.\d\d GiB at most \([a-z ]+\)", said)
    assert load_body(tmp_path / "bar.ffr").provenance["solver"]["name"] == "superlu"


def test_the_command_line_refuses_bad_ranks(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(["reduce", *BAR, "--solver", "slepc", "--ranks", "0", "-o", str(tmp_path / "bar.ffr")])
    assert left.value.code == 2
    assert "solver 'slepc' with 0 ranks cannot be run" in capsys.readouterr().err


def test_a_sheet_too_thin_for_solids_is_told_to_want_plates():
    """It is in one piece, of one material: of what was told to look for there was nothing."""
    sheet = fp.from_mesh(box_mesh("hex20", (0.5, 0.03, 1e-5), (4, 1, 1)), STEEL, [InterfaceRegion("left")])
    with pytest.raises(ComputationError, match=r"a sheet so thin that it wants plates \(`ffr-prep reduce-structure`\)"):
        fp.reduce(sheet, fp.Request(name="sheet", reference=FixedTo("left"), reduction=Eigenmodes(2)))
