"""PETSc and SLEPc in MPI processes of their own: factorise a matrix, solve with it, find modes.

Run as  mpirun -n RANKS python3 slepc_process.py FILE  with a line of JSON per command on the standard input of the first
rank, which passes it on to the others in the file. Each is answered by a line on its standard output: "done", or what
went wrong. The end of the input is the end. The system's Python runs this file, which imports nothing of the package.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

_NEGATIVE_PIVOTS = 12  # INFOG(12) of MUMPS


def main() -> int:
    """Answer commands until the input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever the libraries print is no answer
    try:
        import slepc4py

        slepc4py.init(["ffr"])
        from petsc4py import PETSc
        from slepc4py import SLEPc
    except Exception as error:  # a library that is broken raises anything
        print(error, file=sys.stderr)
        _answer(answers, "missing")
        return 1
    solver = None
    while line := _next_line(PETSc.COMM_WORLD, Path(sys.argv[1])):
        command = json.loads(line)
        said = "done"
        try:
            if command["do"] == "factorise":
                solver = _factorised(PETSc, _matrix(PETSc, command["matrix"]))
            elif command["do"] == "solve":
                _solve(PETSc, solver, command)
            elif command["do"] == "count":
                _count(PETSc, command)
            else:
                _modes(PETSc, SLEPc, command)
        except (PETSc.Error, ArithmeticError) as error:
            said = " ".join(str(error).split())
        if PETSc.COMM_WORLD.rank == 0:
            _answer(answers, said)
    return 0


def _next_line(comm: Any, file: Path) -> str:
    """The next command, which the first rank reads and the others find in a file."""
    comm.barrier()
    if comm.rank == 0:
        file.write_text(sys.stdin.readline())
    comm.barrier()
    return file.read_text()


def _answer(answers: Any, text: str) -> None:
    try:
        print(text, file=answers, flush=True)
    except BrokenPipeError:
        sys.exit(0)


def _matrix(PETSc: Any, stem: str) -> Any:
    """The rows of this rank of a symmetric positive definite matrix."""
    indptr, indices, data = (np.load(f"{stem}.{part}.npy", mmap_mode="r") for part in ("indptr", "indices", "data"))
    size = len(indptr) - 1
    A = PETSc.Mat().create()
    A.setSizes(size)
    A.setType("aij")
    A.setUp()
    first, last = A.getOwnershipRange()
    own = slice(int(indptr[first]), int(indptr[last]))
    rows = (np.array(indptr[first : last + 1]) - indptr[first]).astype(np.int32)
    A = PETSc.Mat().createAIJ(
        ((last - first, size), (last - first, size)), csr=(rows, np.array(indices[own]), np.array(data[own]))
    )
    A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    A.setOption(PETSc.Mat.Option.SPD, True)
    return A


def _factorised(PETSc: Any, A: Any) -> Any:
    solver = PETSc.KSP().create()
    solver.setOperators(A)
    _directly(solver)
    solver.setUp()
    x, b = A.createVecs()
    b.set(1.0)
    solver.solve(b, x)
    if solver.getConvergedReason() < 0 or solver.getPC().getFactorMatrix().getMumpsInfog(_NEGATIVE_PIVOTS):
        raise ArithmeticError("the stiffness matrix is not positive definite: a pivot is not positive")
    return solver


def _directly(solver: Any) -> None:
    """One application of a Cholesky factorisation by MUMPS; a failure is an error."""
    solver.setType("preonly")
    solver.getPC().setType("cholesky")
    solver.getPC().setFactorSolverType("mumps")
    solver.setErrorIfNotConverged(False)


def _solve(PETSc: Any, solver: Any, command: dict[str, Any]) -> None:
    A, _ = solver.getOperators()
    x, b = A.createVecs()
    first, last = b.getOwnershipRange()
    loads = np.load(command["loads"], mmap_mode="r")
    found = []
    for load in loads:
        b.setArray(np.array(load[first:last]))
        solver.solve(b, x)
        if solver.getConvergedReason() < 0:
            raise ArithmeticError("a solution with the factorised stiffness failed")
        found.append(_gathered(PETSc, x))
    if PETSc.COMM_WORLD.rank == 0:
        np.save(command["answer"], np.array(found).reshape(loads.shape))


def _gathered(PETSc: Any, x: Any) -> Any:
    """The whole vector on the first rank, nothing on the others."""
    scatter, whole = PETSc.Scatter.toZero(x)
    scatter.scatter(x, whole, False, PETSc.Scatter.Mode.FORWARD)
    return whole.getArray().copy()


def _modes(PETSc: Any, SLEPc: Any, command: dict[str, Any]) -> None:
    K, M = _matrix(PETSc, command["K"]), _matrix(PETSc, command["M"])
    x = K.createVecRight()
    problem = SLEPc.EPS().create()
    problem.setOperators(K, M)
    problem.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    problem.setDimensions(command["count"])
    problem.setTolerances(1e-12, 1000)
    problem.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    problem.setTarget(command["target"])
    problem.setDeflationSpace(_vectors(x, command["hidden"]))
    transformation = problem.getST()
    transformation.setType("sinvert")
    _directly(transformation.getKSP())
    problem.solve()
    count = command["count"]
    if problem.getConverged() < count:
        raise ArithmeticError(f"only {problem.getConverged()} of {count} normal modes converged: ask for fewer modes")
    omega2, vectors = [], []
    for i in range(count):
        omega2.append(problem.getEigenpair(i, x).real)
        vectors.append(_gathered(PETSc, x))
    if PETSc.COMM_WORLD.rank == 0:
        order = np.argsort(omega2)
        np.savez(command["answer"], omega2=np.array(omega2)[order], vectors=np.array(vectors)[order])


def _vectors(like: Any, file: str) -> list[Any]:
    """The rows of a file as vectors that are divided like this one."""
    first, last = like.getOwnershipRange()
    made = []
    for row in np.load(file, mmap_mode="r"):
        vector = like.duplicate()
        vector.setArray(np.array(row[first:last]))
        made.append(vector)
    return made


def _count(PETSc: Any, command: dict[str, Any]) -> None:
    """The negative pivots of K - sigma M, which MUMPS takes symmetrically."""
    K = _matrix(PETSc, command["K"])
    K.setOption(PETSc.Mat.Option.SPD, False)
    K.axpy(-command["sigma"], _matrix(PETSc, command["M"]), structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    K.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    solver = PETSc.KSP().create()
    solver.setOperators(K)
    _directly(solver)
    solver.setUp()
    negative = solver.getPC().getFactorMatrix().getMumpsInfog(_NEGATIVE_PIVOTS)
    if PETSc.COMM_WORLD.rank == 0:
        np.save(command["answer"], negative)


if __name__ == "__main__":
    sys.exit(main())
