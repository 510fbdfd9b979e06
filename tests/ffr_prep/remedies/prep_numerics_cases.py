"""What is said where numbers fail: factors, modes, supports, bases, receptances.

Failures that no sound model has are provoked by a wrong part.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import scipy.sparse as sp
from boxes import STEEL
from prep_remedy import box, raising, reduced, with_files, with_part
from said import Case

import ffr_prep as fp
from ffr_prep.common import process_memory
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import functionals
from ffr_prep.reduction import basis as bases
from ffr_prep.reduction import modes as of_models
from ffr_prep.reduction import receptance, selected_modes
from ffr_prep.reduction.methods.krylov import dynamic_solver
from ffr_prep.reduction.modes import modes_up_to, normal_modes
from ffr_prep.solvers import slepc
from ffr_prep.solvers.cholesky import cholesky
from ffr_prep.solvers.factor import Solver, factorise, free_body, solve_refined, supported
from ffr_prep.solvers.lanczos import lowest_modes
from ffr_prep.solvers.verification import verified

p = partial
LEFT, RIGHT = InterfaceRegion("left"), InterfaceRegion("right")


# ---- solvers ---------------------------------------------------------------------------------------------------------

MODEL = fp.from_mesh(box(), STEEL, [LEFT, RIGHT])
COUPLED = MODEL.coupled
C = COUPLED.C.toarray()


@cache
def free() -> object:
    return free_body(COUPLED.K, COUPLED.T, COUPLED.places, Solver(verify=True))


def held(rows: np.ndarray = C[:6]) -> object:
    return supported(free(), rows)


def factored(*entries: float) -> object:
    return factorise(sp.csr_array(np.reshape(entries, (2, 2))), np.eye(3)[:2])


SOUND = p(factored, 2.0, 1.0, 1.0, 2.0)


def loaded(stiffer: float) -> object:
    """Supports moved, of a body whose stiffness is not the one that was factorised."""
    K = sp.csr_array(
        COUPLED.K + stiffer * sp.diags_array(np.linspace(0, 1, len(COUPLED.places)) * COUPLED.K.diagonal())
    )
    problem = held()
    problem = replace(problem, body=replace(problem.body, K=K))
    return solve_refined(problem, np.zeros((len(COUPLED.places), 6)), np.eye(6))


def searched(omega2: np.ndarray, count: int, most: int) -> object:
    random = np.random.default_rng(0)
    modes = np.linalg.qr(random.normal(size=(omega2.size, omega2.size)))[0]
    flexibility = modes @ np.diag(1 / omega2) @ modes.T
    identity = sp.csr_array(sp.eye_array(omega2.size))
    return lowest_modes(lambda load: flexibility @ load, identity, random.normal(size=(omega2.size, 4)), count, most)


def looked_at(missing: bool = False, mixed: float = 0.0) -> object:
    """Eight modes, one missing or mixed with another."""
    problem = held()
    omega2, modes = normal_modes(COUPLED, problem, 8)
    modes[:, 2] += mixed * modes[:, 5]
    kept = np.delete(np.arange(8), 3) if missing else np.arange(8)
    return problem.body.verify(problem, COUPLED.M, omega2[kept], modes[:, kept])


def counted(count: object) -> object:
    """Two modes, counted so."""
    flexibility, identity = np.diag([1.0, 0.25]), sp.csr_array(np.eye(2))
    return verified(lambda loads: flexibility @ loads, identity, count, np.array([1.0, 4.0]), np.eye(2))


def on_machine(kilobytes: int) -> object:
    def act() -> object:
        Path("meminfo").write_text(f"MemAvailable: {kilobytes} kB\n")
        with patch.object(process_memory, "_MACHINE", Path("meminfo")):
            return cholesky(sp.csr_array(np.eye(30) + 0.01), np.arange(90.0).reshape(30, 3))

    return with_files(act, {})


def asked(answer: str) -> object:
    """What is said of the answer of processes that are not there."""
    words = SimpleNamespace(write=lambda _: None, flush=lambda: None)
    child = SimpleNamespace(stdin=words, stdout=SimpleNamespace(readline=lambda: answer), wait=lambda _: -9)

    def act() -> object:
        Path("errors.txt").write_text("killed")
        process = SimpleNamespace(child=child, folder=Path("."))
        return slepc._ask(process, do="factorise")

    return with_files(act, {})


def penciled(most: int) -> object:
    def act() -> object:
        process = SimpleNamespace(folder=Path("."))
        with patch.object(slepc, "_LOCAL", most):
            return slepc.pencil(process, COUPLED.K, COUPLED.M, C[:6] + C[6:], free().T)

    return with_files(act, {})


CHOLESKY = p(reduced, LEFT, solver=Solver("superlu"))
SOLVERS = [
    Case(p(factored, 1.0, 1.0, 1.0, 1.0 + 1e-15), SOUND),
    Case(p(factored, 1.0, 0.0, 0.0, 0.0), SOUND),
    Case(lambda: held(np.vstack([C, C[:1]])), held),
    Case(p(loaded, 1.0), p(loaded, 0.0)),
    Case(p(searched, np.arange(1.0, 301.0), 40, 50), p(searched, np.arange(1.0, 301.0), 2, 250)),
    Case(p(looked_at, missing=True), looked_at),
    Case(p(looked_at, mixed=1e-4), looked_at),
    Case(p(counted, raising(np.linalg.LinAlgError())), p(counted, lambda below: 1)),
    Case(p(on_machine, 1), p(on_machine, 10**6)),
    Case(lambda: with_part(shutil, "which", lambda _: None, lambda: slepc._command(1)), CHOLESKY),
    Case(p(asked, "missing"), p(asked, "done")),
    Case(p(asked, ""), p(asked, "done")),
    Case(p(penciled, 5), p(penciled, 20_000)),
]

# ---- bases -----------------------------------------------------------------------------------------------------------


def basis(**changes: object) -> object:
    L = functionals(fp.FixedTo("left"), COUPLED)
    made = fp.Eigenmodes(2).basis(COUPLED, free(), L)
    return bases.check_basis(
        COUPLED, L, replace(made, **{k: change(getattr(made, k)) for k, change in changes.items()})
    )


def rigid(omega2: float) -> object:
    motion = COUPLED.T[:, :1] / np.sqrt(COUPLED.T[:, 0] @ (COUPLED.M @ COUPLED.T[:, 0]))
    return bases.check_basis(COUPLED, np.zeros((0, len(motion))), bases.Basis(motion, np.array([omega2])))


def at_frequency(frequency: float) -> object:
    return dynamic_solver(COUPLED, frequency)(np.asarray(COUPLED.C.toarray().T))


@cache
def natural() -> float:
    """A natural frequency of the free body [Hz]."""
    made = fp.Eigenmodes(1).basis(COUPLED, free(), functionals(fp.MeanAxis(), COUPLED))
    return float(np.sqrt(made.omega2[0])) / (2 * np.pi)


SPRINGS = replace(
    COUPLED, K=sp.csr_array((2 * np.pi) ** 2 * np.eye(2)), M=sp.csr_array(np.eye(2)), C=sp.csr_array(np.eye(2))
)


def of_springs(frequency: float) -> object:
    return dynamic_solver(SPRINGS, frequency)(np.eye(2))


def failing_eigenproblem(failing: bool) -> object:
    act = p(reduced, LEFT, reduction=fp.Eigenmodes(2))
    error = raising(np.linalg.LinAlgError("the leading minor of order 3 is not positive definite"))
    return with_part(fp.Eigenmodes, "basis", error, act) if failing else act()


def by_accuracy(reduction: object, band: fp.Band, tolerance: float = 0.1) -> object:
    return reduced(LEFT, RIGHT, reduction=reduction(fp.Accuracy(band, tolerance)))


LOW = fp.Band(1.0, 500.0)
BASES = [
    Case(p(basis, Z=lambda Z: 1.01 * Z), basis),
    Case(p(rigid, 0.0), basis),
    Case(p(rigid, 1e-3), basis),
    Case(lambda: at_frequency(natural()), lambda: at_frequency(1.1 * natural())),
    Case(p(of_springs, 1.0), p(of_springs, 2.0)),
    Case(p(failing_eigenproblem, True), p(failing_eigenproblem, False)),
    Case(
        lambda: with_part(receptance, "_ACCURATE", 0.0, lambda: by_accuracy(fp.CraigBampton, LOW)),
        lambda: by_accuracy(fp.CraigBampton, LOW),
    ),
    Case(
        lambda: with_part(selected_modes, "_RICHER", (0.01,), lambda: by_accuracy(fp.Eigenmodes, LOW, 1e-6)),
        lambda: by_accuracy(fp.Rubin, LOW, 1e-2),
    ),
    Case(
        lambda: with_part(of_models, "_WHOLE", 1, lambda: modes_up_to(COUPLED, held(), 1e9)),
        lambda: modes_up_to(COUPLED, held(), 1.0),
    ),
]
CASES = SOLVERS + BASES
