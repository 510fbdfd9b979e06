"""From a mesh to a reduced flexible body: the method from end to end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from threadpoolctl import threadpool_limits

from ffr_prep.body import FlexibleBody
from ffr_prep.common.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.pipelines.reduce import reduce_model
from ffr_prep.reduction.basis import Reduction
from ffr_prep.reduction.selection import Band
from ffr_prep.solids.assembly import Materials
from ffr_prep.solids.model import solid_model
from ffr_prep.solvers.factor import CHOLESKY, Solver


def reduce_mesh(
    mesh: Mesh,
    *,
    name: str,
    material: Materials,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    stiffening: bool = False,
    stress: bool = False,
    quality: Band | None = None,
    solver: Solver = CHOLESKY,
    progress: Stages = no_stages,
    advance: Advance = no_advance,
    provenance: Mapping[str, Any] | None = None,
) -> FlexibleBody:
    """The reduced flexible body of a meshed solid, in the coordinates of the mesh.

    material   : one, or one for each volume group
    stiffening : also compute the geometric stiffness by load, which a simulation then uses
    stress     : also keep the stress at the nodes of the surface per elastic coordinate
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    solver     : what factorises the stiffness and finds the modes
    progress   : called with the name of each stage as it begins
    advance    : called within long stages with the share that is done and with how far that is in words
    provenance : JSON values kept with the body, beside what is recorded anyway

    Raises InputError for input that cannot be used and ComputationError for a computation that failed.
    """
    with threadpool_limits(1):  # small dense blocks: waiting threads are slower than one, and one is reproducible
        return reduce_model(
            solid_model(mesh, material, interfaces, progress),
            name=name,
            reference=reference,
            reduction=reduction,
            stiffening=stiffening,
            stress=stress,
            quality=quality,
            solver=solver,
            progress=progress,
            advance=advance,
            provenance=provenance,
        )
