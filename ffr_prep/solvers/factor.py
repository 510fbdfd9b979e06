"""The one door to sparse factorisations, and the constrained static problem that everything else is made of.

The stiffness K of a free body is singular: its null space is the six rigid motions T. Six coordinates that hold the
body without redundancy are clamped, and the remaining matrix is factorised once. Every other support follows from it
with a small dense system: the displacement u that minimises  1/2 u^T K u - f^T u  subject to  C u = c  is

    u = S (f - C^T mu) + T alpha,    T^T (f - C^T mu) = 0,    C u = c,

with S the inverse of the clamped stiffness and mu the multipliers (constraint forces). The loads that S sees are in
equilibrium, so the clamped coordinates carry no reaction and their choice does not matter.

Source: C. Farhat, F.-X. Roux, Int. J. Numer. Meth. Eng. 32 (1991) 1205-1227 (generalised inverse of a floating body).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.process_memory import check_memory
from ffr_prep.common.progress import Advance, no_advance
from ffr_prep.solvers.cholesky import LESS, cholesky, solve_cholesky
from ffr_prep.solvers.inertia import modes_below
from ffr_prep.solvers.lanczos import lowest_modes
from ffr_prep.solvers.nested_dissection import NOTHING
from ffr_prep.solvers.slepc import SlepcProcess, mpi_count, mpi_modes, mpi_solve, pencil, started
from ffr_prep.solvers.threads import finish, pieces, product, product_of_sizes, threads
from ffr_prep.solvers.verification import Verification, verified

Solve = Callable[[Array], Array]
Factorisation = Callable[[sp.csr_array, Array, Array, Advance], Solve]

_SINGULAR = 1e13
_SCALING_SWEEPS = 10
_BLOCK = 4  # vectors of a block in a search: the fewer, the fewer are needed in all
_WIDE, _MANY = 8, 100  # and of one for more modes than these, where passes over all vectors take most of the time
_VECTORS, _BLOCKS = 3, 12  # that a search has for each mode, about, and beside these
_REMEDY = (
    "look for parts joined by a single node or edge, materials of extremely different stiffness, or a sheet so thin that it "
    "wants plates (`ffr-prep reduce-structure`)"
)


# ---- the choice of a solver ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Solver:
    """The method that factorises the stiffness and finds the modes.

    name  : "cholesky" (this package's own), "superlu" (SciPy's, slow but with no compiled code of ours), "pardiso" (Intel
            MKL, if pypardiso is installed) or "slepc" (SLEPc and MUMPS in processes of their own, under MPI)
    ranks : processes of "slepc"
    verify: also find the residual of every normal mode, and count by another factorisation that none is missing; both are
            kept with the body

    Raises InputError for another name or number of processes.

    >>> request = fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Rubin(8), solver=fp.Solver("pardiso"))
    """

    name: str = "cholesky"
    ranks: int = 1
    verify: bool = False

    def __post_init__(self) -> None:
        if self.name not in (*_FACTORISATIONS, "slepc"):
            known = ", ".join((*_FACTORISATIONS, "slepc"))
            raise InputError(f"there is no solver {self.name!r}; the solvers are {known}")
        if self.ranks < 1 or (self.ranks > 1 and self.name != "slepc"):
            raise InputError(
                f"solver {self.name!r} with {self.ranks} ranks cannot be run: the ranks are a positive number, and only "
                "'slepc' runs on more than one"
            )


def _cholesky(A: sp.csr_array, positions: Array, held: Array, advance: Advance) -> Solve:
    return partial(solve_cholesky, cholesky(A, positions, advance, held))


def _without(factorised: Callable[[sp.csr_array], Solve]) -> Factorisation:
    """The factorisation of what is left without the unknowns that are held, of a whole matrix."""

    def of_rest(A: sp.csr_array, positions: Array, held: Array, advance: Advance) -> Solve:
        free = np.delete(np.arange(A.shape[0]), held)
        return partial(_extended, factorised(A[free][:, free]), free)

    return of_rest


def _superlu(A: sp.csr_array) -> Solve:
    """Without pivoting, so that the signs of the pivots show whether A is positive definite."""
    try:
        lu = splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise np.linalg.LinAlgError(str(error)) from None
    if (lu.perm_r != lu.perm_c).any() or not (lu.U.diagonal() > 0).all():
        raise np.linalg.LinAlgError("a pivot is not positive")
    return lu.solve


def _pardiso(A: sp.csr_array) -> Solve:
    """Matrix type 2, positive definite: with it Pardiso fails at a pivot that is not."""
    try:
        import pypardiso
    except ImportError:
        raise InputError("solver 'pardiso' needs pypardiso: pip install ffr[pardiso]") from None
    upper = sp.csr_matrix(sp.triu(A, format="csr"))
    pardiso = pypardiso.PyPardisoSolver(mtype=2)
    try:
        pardiso.factorize(upper)
    except (pypardiso.pardiso_wrapper.PyPardisoError, ValueError) as error:
        raise np.linalg.LinAlgError(str(error)) from None
    return lambda b: pardiso.solve(upper, np.asfortranarray(b))


_FACTORISATIONS: dict[str, Factorisation] = {
    "cholesky": _cholesky,
    "superlu": _without(_superlu),
    "pardiso": _without(_pardiso),
}
CHOLESKY = Solver()


# ---- factorisation ------------------------------------------------------------------------------------------------


def factorise(
    A: sp.csr_array,
    positions: Array,
    solver: Solver = CHOLESKY,
    advance: Advance = no_advance,
    held: Array = NOTHING,
) -> Solve:
    """The solver of a sparse symmetric positive definite matrix A (n, n): b (n, r) -> A^-1 b.

    positions : (n, 3) where each unknown is; rows of NaN for unknowns that touch many others
    advance   : told how far the factorisation is, where the solver knows (cholesky)
    held      : numbers of unknowns that are zero in every solution; A needs be definite without them alone

    Raises ComputationError when A is singular to working precision, InputError when the solver is not installed.
    """
    try:
        solve = _FACTORISATIONS[solver.name](A, positions, held, advance)
    except np.linalg.LinAlgError as error:
        raise ComputationError(f"the stiffness matrix is not positive definite ({error}); {_REMEDY}") from None
    _check_regular(A, solve)
    return solve


def _check_regular(A: sp.csr_array, solve: Solve) -> None:
    # Scaled to a unit diagonal, so that neither units nor the size of the body matter.
    scale = np.sqrt(A.diagonal())[:, None]
    probe = np.random.default_rng(0).standard_normal((A.shape[0], 1))
    growth = np.abs(scale * solve(scale * probe)).max() / np.abs(probe).max()
    if not growth < _SINGULAR:
        raise ComputationError(f"the stiffness matrix is singular (condition above {growth:.1e}); {_REMEDY}")


Verify = Callable[["SupportedBody", sp.csr_array, Array, Array], Verification | None]


@dataclass(frozen=True)
class FreeBody:
    """A free body, ready to be solved under any support.

    K : (Z, Z) stiffness; T : (Z, 6) orthonormal rigid motions; solve : clamped inverse S, (Z, r) -> (Z, r)
    lowest : (supports, mass, count) -> omega2 (count,) and mass-orthonormal modes (Z, count)
    verify : (supports, mass, omega2, modes) -> what was found of them; None where nobody asked
    """

    K: sp.csr_array
    T: Array
    solve: Solve
    lowest: Callable[[SupportedBody, sp.csr_array, int], tuple[Array, Array]]
    verify: Verify


def free_body(
    K: sp.csr_array, T: Array, positions: Array, solver: Solver = CHOLESKY, advance: Advance = no_advance
) -> FreeBody:
    """Clamp six coordinates, chosen so that the rigid motions T (Z, 6) are best held, and factorise once.

    positions : (Z, 3) where each coordinate is; rows of NaN for those of rigid interfaces
    advance   : told how far the factorisation is, and later the search for modes

    Raises as `factorise`.
    """
    rigid, _ = np.linalg.qr(T)
    _, order = scipy.linalg.qr(rigid.T, mode="r", pivoting=True)
    if solver.name != "slepc":
        solve = factorise(K, positions, solver, advance, order[:6])
        count = partial(_counted, positions, advance)
        return FreeBody(K, rigid, solve, partial(_by_lanczos, advance), _look(solver, count))
    free = np.delete(np.arange(K.shape[0]), order[:6])
    clamped = K[free][:, free]
    process = started(clamped, solver.ranks)
    solve = partial(mpi_solve, process)
    _check_regular(clamped, solve)
    return FreeBody(
        K,
        rigid,
        partial(_extended, solve, free),
        partial(_by_slepc, process),
        _look(solver, partial(_mpi_counted, process)),
    )


def _extended(solve_free: Solve, free: Array, load: Array) -> Array:
    """The displacement (Z, r) of loads (Z, r) with all but the free coordinates clamped."""
    displacement = np.zeros_like(load)
    displacement[free] = solve_free(load[free])
    return displacement


def _flexibility(held: SupportedBody) -> Solve:
    return lambda loads: solve_supported(held, loads, np.zeros((held.C.shape[0], loads.shape[1])))[0]


def _by_lanczos(advance: Advance, held: SupportedBody, M: sp.csr_array, count: int) -> tuple[Array, Array]:
    block = _BLOCK if count <= _MANY else _WIDE
    space = 8 * M.shape[0] * (_VECTORS * count + _BLOCKS * block)
    check_memory(
        space, f"the search for {count} normal modes of {M.shape[0]} unknowns", f"ask for fewer modes; or {LESS}"
    )
    start = np.random.default_rng(0).standard_normal((M.shape[0], block))
    return lowest_modes(_flexibility(held), M, start, count, most=20 * count + 300, advance=advance)


def _by_slepc(process: SlepcProcess, held: SupportedBody, M: sp.csr_array, count: int) -> tuple[Array, Array]:
    made = pencil(process, held.body.K, M, held.C.toarray(), held.body.T)
    return mpi_modes(process, made, M, count, _about_the_lowest(held, M))


def _about_the_lowest(held: SupportedBody, M: sp.csr_array) -> float:
    """omega2 of about the lowest mode, by inverse iteration."""
    x = np.random.default_rng(0).standard_normal((M.shape[0], 1))
    for _ in range(2):
        momenta = M @ x
        x = _flexibility(held)(momenta)
    return float(np.vdot(x, momenta) / np.vdot(x, M @ x))


def _look(solver: Solver, count: Callable[[SupportedBody, sp.csr_array, float], int]) -> Verify:
    """Verifies modes, with this count of those below a squared frequency, where the solver says so."""

    def look(held: SupportedBody, M: sp.csr_array, omega2: Array, vectors: Array) -> Verification:
        return verified(_flexibility(held), M, partial(count, held, M), omega2, vectors)

    return look if solver.verify else lambda *_: None


def _counted(positions: Array, advance: Advance, held: SupportedBody, M: sp.csr_array, sigma: float) -> int:
    def told(share: float, words: str) -> None:
        advance(share, f"{words} for the count of modes")

    return modes_below(held.body.K, M, held.C.toarray(), positions, sigma, told)


def _mpi_counted(process: SlepcProcess, held: SupportedBody, M: sp.csr_array, sigma: float) -> int:
    return mpi_count(process, pencil(process, held.body.K, M, held.C.toarray(), held.body.T), sigma)


# ---- supports -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SupportedBody:
    """A free body under the supports C u = c; C : (r, Z) independent functionals that hold all rigid motions."""

    body: FreeBody
    C: sp.csr_array
    flexibility: Array
    scale: Array
    bordered: tuple[Array, Array]


def supported(body: FreeBody, C: sp.csr_array | Array) -> SupportedBody:
    """Prepare the small system of the supports C (r, Z), r >= 6.

    Raises ComputationError when the supports depend on one another or leave a rigid motion.
    """
    C = sp.csr_array(C)
    flexibility = body.solve(C.T.toarray())
    held = C @ body.T
    bordered = np.block([[-C @ flexibility, held], [held.T, np.zeros((6, 6))]])
    scale = _of_equal_size(bordered, C.shape[0])
    scaled = scale[:, None] * bordered * scale
    condition = np.linalg.cond(scaled)
    if not condition < 1e13:
        raise ComputationError(
            f"the {C.shape[0]} supports depend on one another or leave a rigid motion free (condition {condition:.1e}): "
            "choose other reference conditions or interfaces"
        )
    return SupportedBody(body, C, flexibility, scale, scipy.linalg.lu_factor(scaled))


def solve_supported(problem: SupportedBody, f: Array, c: Array) -> tuple[Array, Array]:
    """Displacement u (Z, r) and multipliers mu of the loads f (Z, r) and the prescribed values c (supports, r)."""
    particular = problem.body.solve(f)
    right = np.vstack([c - problem.C @ particular, problem.body.T.T @ f])
    solution = scipy.linalg.lu_solve(problem.bordered, problem.scale[:, None] * right) * problem.scale[:, None]
    mu, alpha = solution[: len(c)], solution[len(c) :]

    def complete(part: slice) -> None:  # in place, as fresh memory takes longer than filling it
        particular[part] += problem.body.T[part] @ alpha - problem.flexibility[part] @ mu

    with threads() as each:
        finish(each(complete, pieces(len(particular))))
    return particular, mu


def solve_refined(problem: SupportedBody, f: Array, c: Array) -> tuple[Array, Array]:
    """As `solve_supported`, with one step of iterative refinement; ComputationError when the residual stays large."""
    u, mu = solve_supported(problem, f, c)
    residual = f - product(problem.body.K, u) - problem.C.T @ mu
    du, dmu = solve_supported(problem, residual, c - problem.C @ u)
    u, mu = u + du, mu + dmu
    _check_residual(problem, f, u, mu)
    return u, mu


def _check_residual(problem: SupportedBody, f: Array, u: Array, mu: Array) -> None:
    reaction = problem.C.T @ mu
    residual = np.linalg.norm(f - product(problem.body.K, u) - reaction)
    noise = np.linalg.norm(product_of_sizes(problem.body.K, u))
    allowed = 1e-6 * (np.linalg.norm(f) + np.linalg.norm(reaction)) + 1e-11 * noise
    if not residual <= allowed:
        raise ComputationError(
            f"a static solution misses equilibrium by {residual:.1e} N (allowed {allowed:.1e} N): the stiffness is "
            f"nearly singular; {_REMEDY}"
        )


def _of_equal_size(bordered: Array, count: int) -> Array:
    """(n,) factors that make the largest entries of its rows and those of the flexibility of its first `count` near one.

    The flexibility of a long body is small beside its rigid motions in one unit and large in another. Factors of supports
    may grow as those of rigid motions shrink, which leaves what these do at supports as it is.
    """
    d = _equilibration(bordered)
    flexible = np.abs(d[:count, None] * bordered[:count, :count] * d[:count]).max()
    share = np.sqrt(flexible) if flexible > 0 else 1.0
    return np.concatenate([d[:count] / share, d[count:] * share])


def _equilibration(A: Array) -> Array:
    """(n,) factors d for which the rows of d A d have largest entries near one (D. Ruiz, RAL-TR-2001-034)."""
    d = np.ones(len(A))
    for _ in range(_SCALING_SWEEPS):
        largest = np.abs(d[:, None] * A * d).max(axis=1)
        d /= np.sqrt(np.where(largest > 0, largest, 1.0))
    return d
