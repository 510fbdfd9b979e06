"""From a frame of beams and plates to a reduced flexible body: the method from end to end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from threadpoolctl import threadpool_limits

from ffr_prep.body import FlexibleBody
from ffr_prep.common.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.pipelines.reduce import reduce_model
from ffr_prep.reduction.basis import Reduction
from ffr_prep.reduction.selection import Band
from ffr_prep.solvers.factor import CHOLESKY, Solver
from ffr_prep.structures.frame import Frame
from ffr_prep.structures.model import frame_model


def reduce_frame(
    frame: Frame,
    *,
    name: str,
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
    """The reduced flexible body of a frame of beams and plates, in the coordinates of its nodes.

    interfaces : at groups of nodes. Rigid ones: one node gives its six coordinates, several follow the interface. Mean
                 ones leave their nodes free and move with them in the mean
    stiffening : also compute the geometric stiffness by load, which a simulation then uses
    stress     : also keep section forces of beams and the stress on outlines and faces per elastic coordinate
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    solver     : what factorises the stiffness and finds the modes
    progress   : called with the name of each stage as it begins
    advance    : called within long stages with the share that is done and with how far that is in words
    provenance : JSON values kept with the body, beside what is recorded anyway

    Raises InputError for input that cannot be used and ComputationError for a computation that failed.
    """
    with threadpool_limits(1):  # as for solids: small dense blocks, and reproducible
        return reduce_model(
            frame_model(frame, interfaces, progress),
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
