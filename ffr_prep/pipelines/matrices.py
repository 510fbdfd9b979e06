"""Bodies from outside matrices: stiffness and mass of another finite-element program, with its nodes.

A `MatrixModel` is nodes, K, M and the map that says which row is which of the six coordinates of which node; nodes of
solids have three coordinates, those of shells and beams five or six. From there the way is the one of meshes:
interfaces, reference conditions, reduction, inertia integrals (see `ffr_prep.matrices.nodal_inertia` for what M alone can
say). Geometric stiffening needs stresses, which matrices do not give, so bodies made here have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from ffr_prep.body import FlexibleBody
from ffr_prep.body.provenance import described
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.matrices.checks import check_mechanisms, mass_is_singular
from ffr_prep.matrices.interfaces import tie_matrices
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.matrices.part import checked, part_of
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.pipelines.reduce import reduce_model
from ffr_prep.reduction.basis import Basis, Reduction
from ffr_prep.reduction.selection import Band
from ffr_prep.solvers.factor import CHOLESKY, FreeBody, Solver

Array = np.ndarray

_MASSLESS = 1e-9


def reduce_matrices(
    model: MatrixModel,
    *,
    name: str,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    quality: Band | None = None,
    solver: Solver = CHOLESKY,
    progress: Stages = no_stages,
    advance: Advance = no_advance,
    provenance: Mapping[str, Any] | None = None,
) -> FlexibleBody:
    """The reduced flexible body of outside matrices, in the coordinates of their nodes.

    interfaces : at groups of nodes; one node gives its six coordinates, several follow rigidly or in the mean
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    solver     : what factorises the stiffness and finds the modes
    progress   : called with the name of each stage as it begins
    advance    : called within long stages with the share that is done and with how far that is in words
    provenance : JSON values kept with the body, beside what is recorded anyway

    Consistent and lumped masses are both fine, also with coordinates that have none. The body has no geometric
    stiffening.

    Raises InputError for matrices that are not those of a free body, and for settings that cannot be used;
    ComputationError for a computation that failed.
    """
    with threadpool_limits(1):  # as for solids: small dense blocks, and reproducible
        free = checked(model, progress)
        singular = mass_is_singular(free)
        if singular and quality:
            raise InputError(
                "the quality of a reduction needs a mass for every coordinate, and some have none: leave out the quality "
                "report"
            )
        part = part_of(free, interfaces, progress)
        try:
            body = reduce_model(
                part,
                name=name,
                reference=reference,
                reduction=_OfMatrices(reduction, singular),
                quality=quality,
                solver=solver,
                progress=progress,
                advance=advance,
                provenance={"reduction": described(reduction)} | dict(provenance or {}),
            )
        except ComputationError:
            check_mechanisms(free, part.coupled, tie_matrices(free, interfaces))
            raise
    return body if free.triangles is not None else replace(body, surface=None)


# ---- basis --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _OfMatrices:
    """A reduction of matrices that others made: of a mass that may be singular, and with words for what fails."""

    reduction: Reduction
    singular: bool

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """As those of `ffr_prep.reduction.methods`."""
        return (_shifted if self.singular else _basis)(self.reduction, model, body, L)


def _basis(reduction: Reduction, coupled: CoupledModel, body: FreeBody, L: Array) -> Basis:
    try:
        return reduction.basis(coupled, body, L)
    except np.linalg.LinAlgError as error:
        raise ComputationError(f"the eigenproblem of K and M failed ({error}): is M nearly singular?") from None


def _shifted(reduction: Reduction, coupled: CoupledModel, body: FreeBody, L: Array) -> Basis:
    """The basis where M is singular, found with the definite M + epsilon K in its place, which changes no shape.

    K v = lam M v and K v = mu (M + epsilon K) v have the same vectors, with lam = mu / (1 - epsilon mu); rigid motions and
    static shapes do not depend on M; and of massless motions lam is infinite, but mu = 1 / epsilon.
    """
    epsilon = _epsilon(coupled)
    found = _basis(reduction, replace(coupled, M=sp.csr_array(coupled.M + epsilon * coupled.K)), body, L)
    share = 1 - epsilon * found.omega2
    massless = int(np.sum(share < _MASSLESS))
    if massless:
        raise InputError(
            f"{massless} of the {len(share)} shapes move no mass: M is zero for rotations or nodes that they consist of; ask "
            "for fewer modes, or give the interface nodes a mass"
        )
    return replace(found, Z=found.Z / np.sqrt(share), omega2=found.omega2 / share)


def _epsilon(coupled: CoupledModel) -> float:
    """A time squared [s^2] in the upper middle of the spectrum: the median ratio of the diagonals."""
    mass, stiffness = coupled.M.diagonal(), coupled.K.diagonal()
    massive = mass > 1e-12 * mass.max()
    return float(np.median(mass[massive] / stiffness[massive]))
