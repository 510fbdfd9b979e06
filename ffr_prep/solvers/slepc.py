"""Beyond one machine: factorisation and modes by PETSc, MUMPS and SLEPc, in MPI processes that this one talks to.

The processes run the system's Python, since these libraries come from the system's package manager and cannot share a
process with every version of NumPy. Matrices and vectors go through files, commands through a pipe: a line of JSON each,
answered by a line. When this process ends, however it ends, the pipe closes and they end too.

Sources: V. Hernandez, J. E. Roman, V. Vidal, ACM Trans. Math. Softw. 31 (2005) 351-362 (SLEPc); P. R. Amestoy et al.,
SIAM J. Matrix Anal. Appl. 23 (2001) 15-41 (MUMPS).
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.children import ending_with_us
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.solvers import slepc_process

_PYTHON = "/usr/bin/python3"
_HOMES = {"SLEPC_DIR": "/usr/lib/slepcdir", "PETSC_DIR": "/usr/lib/petscdir"}
_EXPORTED = (*_HOMES, "PYTHONPATH", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
_INSTALL = "apt-get install python3-slepc4py-real libopenblas0-pthread openmpi-bin"
_PATIENCE = 60.0
_GRACE = 3.0
_ROUNDING = 1e-9
_LOCAL = 20_000  # unknowns that supports may touch: eliminating one of them couples all others


@dataclass(frozen=True, eq=False)
class SlepcProcess:
    """Running processes that hold a factorised matrix, and the folder (path, its owner) for what is exchanged."""

    child: subprocess.Popen[str]
    folder: Path
    owner: tempfile.TemporaryDirectory[str]


def started(A: sp.csr_array, ranks: int) -> SlepcProcess:
    """Processes that have factorised the symmetric positive definite A (n, n).

    Raises InputError when they cannot be started, ComputationError when A is not positive definite.
    """
    owner = tempfile.TemporaryDirectory(prefix="ffr-slepc-")
    folder = Path(owner.name)
    with open(folder / "errors.txt", "w") as errors:
        child = subprocess.Popen(
            ending_with_us([*_command(ranks), str(folder / "command.json")]),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=_environment(),
            start_new_session=True,  # an interrupt at the terminal is ours to handle
        )
    process = SlepcProcess(child, folder, owner)
    weakref.finalize(process, _end, child)
    _write_matrix(folder / "A", A)
    _ask(process, do="factorise", matrix=str(folder / "A"))
    return process


def mpi_solve(process: SlepcProcess, b: Array) -> Array:
    """A^-1 b for b (n, r)."""
    np.save(process.folder / "b.npy", np.ascontiguousarray(b.T))
    _ask(process, do="solve", loads=str(process.folder / "b.npy"), answer=str(process.folder / "x.npy"))
    return np.load(process.folder / "x.npy").T.copy()


@dataclass(frozen=True)
class Pencil:
    """Stiffness and mass as the processes find them in their folder.

    vectors : (Z, z) displacements of their coordinates
    hidden  : (Z, h) motions without stiffness, of which no mode has a part
    """

    vectors: sp.csr_array
    hidden: Array


def pencil(process: SlepcProcess, K: sp.csr_array, M: sp.csr_array, C: Array, T: Array) -> Pencil:
    """K and M under the supports C u = 0 (r, Z) for the processes; T (Z, 6) rigid motions.

    Few unknowns that are supported follow the others. The mean axis, T^T M u = 0, supports all: there K and M are those of
    the free body, whose modes have no part of T. Raises InputError for others that touch most of the body.
    """
    size = C.shape[1]
    touched = np.flatnonzero((C != 0).any(axis=0))
    if touched.size <= _LOCAL:
        made = Pencil(_admissible(C), np.zeros((size, 0)))
    elif _is_mean_motion(C, M @ T):
        made = Pencil(sp.csr_array(sp.eye_array(size)), T)
    else:
        raise InputError(
            f"solver 'slepc' cannot find modes under supports that touch {touched.size} unknowns (at most {_LOCAL}) and are "
            "not the mean axis: choose other reference conditions, or another solver"
        )
    N = made.vectors
    _write_matrix(process.folder / "K", sp.csr_array(N.T @ K @ N))
    _write_matrix(process.folder / "M", sp.csr_array(N.T @ M @ N))
    np.save(process.folder / "hidden.npy", np.ascontiguousarray(made.hidden.T))
    return made


def _is_mean_motion(C: Array, momenta: Array) -> bool:
    """Whether the supports C (r, Z) are combinations of the momenta (Z, 6) of rigid motions."""
    combined = np.linalg.lstsq(momenta, C.T, rcond=None)[0]
    return bool(np.abs(momenta @ combined - C.T).max() <= _ROUNDING * np.abs(C).max())


def mpi_modes(process: SlepcProcess, made: Pencil, M: sp.csr_array, count: int, near: float) -> tuple[Array, Array]:
    """omega2 (count,), ascending, and M-orthonormal vectors (Z, count) of the modes of the pencil.

    near : about the lowest omega2, which a shift below zero is where motions have no stiffness

    Raises ComputationError without convergence.
    """
    answer = process.folder / "modes.npz"
    target = -near if made.hidden.size else 0.0
    _ask(process, do="modes", count=count, target=target, answer=str(answer), **_files(process))
    with np.load(answer) as found:
        vectors = made.vectors @ found["vectors"].T
        omega2 = found["omega2"]
    return omega2, vectors / np.sqrt(np.einsum("zi,zi->i", vectors, M @ vectors))


def mpi_count(process: SlepcProcess, made: Pencil, sigma: float) -> int:
    """How many modes of the pencil have omega2 below sigma; ComputationError where that is one of theirs."""
    answer = process.folder / "count.npy"
    _ask(process, do="count", sigma=sigma, answer=str(answer), **_files(process))
    return int(np.load(answer)) - made.hidden.shape[1]


def _files(process: SlepcProcess) -> dict[str, str]:
    return {name: str(process.folder / file) for name, file in (("K", "K"), ("M", "M"), ("hidden", "hidden.npy"))}


def _admissible(C: Array) -> sp.csr_array:
    """N (Z, Z - r), sparse: the displacements that satisfy C u = 0 for the independent supports C (r, Z)."""
    touched = np.flatnonzero((C != 0).any(axis=0))
    _, order = scipy.linalg.qr(C[:, touched], mode="r", pivoting=True)
    pivots, others = touched[order[: len(C)]], touched[order[len(C) :]]
    following = -scipy.linalg.solve(C[:, pivots], C[:, others])
    kept = np.delete(np.arange(C.shape[1]), pivots)
    rows, columns = np.nonzero(following)
    triplets = (
        np.concatenate([np.ones(kept.size), following[rows, columns]]),
        (
            np.concatenate([kept, pivots[rows]]),
            np.concatenate([np.arange(kept.size), np.searchsorted(kept, others[columns])]),
        ),
    )
    return sp.csr_array(sp.coo_array(triplets, shape=(C.shape[1], kept.size)))


# ---- the processes ------------------------------------------------------------------------------------------------


def _command(ranks: int) -> list[str]:
    mpirun = shutil.which("mpirun")
    if mpirun is None or not Path(_PYTHON).is_file() or not all(_home(name) for name in _HOMES):
        raise InputError(f"solver 'slepc' needs SLEPc, PETSc and MPI of the system; on Debian: {_INSTALL}")
    # By its path, so that it also runs where the package is not installed; -P keeps its folder off sys.path.
    exported = [word for name in _EXPORTED for word in ("-x", name)]  # to ranks on other machines
    return [mpirun, "-n", str(ranks), *exported, _PYTHON, "-P", slepc_process.__file__]


def _environment() -> dict[str, str]:
    """More ranks than cores are allowed, and root, as in containers; every rank computes on one thread."""
    on = (
        "OMPI_ALLOW_RUN_AS_ROOT",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
        "OMPI_MCA_rmaps_base_oversubscribe",
        "OMPI_MCA_mpi_yield_when_idle",
        "OPENBLAS_NUM_THREADS",
        "OMP_NUM_THREADS",
    )
    own = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "OMPI_"))}
    homes = {name: _home(name) for name in _HOMES}
    modules = os.pathsep.join(f"{home}/lib/python3/dist-packages" for home in homes.values())
    return own | homes | {"PYTHONPATH": modules} | dict.fromkeys(on, "1")


def _home(name: str) -> str:
    """The folder of a library: as the environment says, or where Debian has it; empty without one."""
    found = sorted(str(path) for path in Path(_HOMES[name]).glob("*/*-real"))
    return os.environ.get(name, found[-1] if found else "")


def _ask(process: SlepcProcess, **command: Any) -> None:
    """Send a command and wait for its answer.

    Raises ComputationError with the message of the processes, or their last words if they have ended.
    """
    assert process.child.stdin is not None
    assert process.child.stdout is not None
    try:
        process.child.stdin.write(json.dumps(command) + "\n")
        process.child.stdin.flush()
        answer = process.child.stdout.readline().strip()
    except BrokenPipeError:
        answer = ""
    if answer == "missing":
        raise InputError(f"{_PYTHON} cannot load petsc4py and slepc4py ({_said(process)}); on Debian: {_INSTALL}")
    if not answer:
        code = process.child.wait(_PATIENCE)
        raise ComputationError(f"the SLEPc processes ended with code {code}; their last words: {_said(process)}")
    if answer != "done":
        raise ComputationError(f"SLEPc: {answer}")


def _said(process: SlepcProcess) -> str:
    """The last words of the processes, without what mpirun adds between rules."""
    text = (process.folder / "errors.txt").read_text(errors="replace")
    lines = [line.strip() for line in text.partition("\n-----")[0].splitlines() if line.strip("- ")]
    return " | ".join(lines[-3:]) or "none"


def _end(child: subprocess.Popen[str]) -> None:
    """Close the pipe, upon which the processes end by themselves; end those that do not."""
    for pipe in (child.stdin, child.stdout):
        if pipe:
            pipe.close()
    for insist in (child.terminate, child.kill):  # mpirun ends its processes when it is told to
        try:
            child.wait(_GRACE)
            return
        except subprocess.TimeoutExpired:
            insist()


def _write_matrix(stem: Path, A: sp.csr_array) -> None:
    np.save(f"{stem}.indptr.npy", A.indptr.astype(np.int32))
    np.save(f"{stem}.indices.npy", A.indices.astype(np.int32))
    np.save(f"{stem}.data.npy", A.data)
