"""Loads that a model knows by name, and the reactions to them under reference conditions.

The known loads are the twelve inertial ones (`ffr_prep.body.accelerations`), then forces and moments at the interfaces. The
conditions that hold a body frame react by the same: supports at interfaces by forces and moments there, the mean axis by
inertia. So every static problem under unit loads has an equilibrium of known loads.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ffr_prep.body.accelerations import INERTIAL
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reference import ReferenceConditions, UserConditions


def known_loads(model: CoupledModel) -> Array:
    """(Z, 12 + 6 I) the loads."""
    return np.hstack([inertial_loads(model), model.C.toarray().T])


def inertial_loads(model: CoupledModel) -> Array:
    """(Z, 12) loads of unit accelerations, which only the model of a reduced body does not know; nobody loads that one."""
    assert model.inertial_loads is not None
    return model.inertial_loads


def supports(model: CoupledModel, conditions: ReferenceConditions) -> Array:
    """(r, 12 + 6 I) the reactions of the conditions as combinations of the known loads.

    Conditions on interface coordinates react by the loads on them, and those on the mean motion T^T M u = 0 by inertia:
    written for a model whose coordinates are the amplitudes of the loads, their rows are the combinations. Those on nodes
    react at nodes, by none of the known loads.
    """
    count = model.C.shape[0]
    if isinstance(conditions, UserConditions):
        return np.zeros((0, INERTIAL + count))
    unit = np.eye(INERTIAL + count)
    of_loads = replace(
        model,
        K=sp.csr_array(unit),
        M=sp.csr_array(np.diag(-unit[:6].sum(axis=0))),
        T=unit[:, :6],
        C=sp.csr_array(unit[INERTIAL:]),
    )
    return conditions.rows(of_loads)


def in_equilibrium(model: CoupledModel, conditions: ReferenceConditions, static: Array) -> Array:
    """(12 + 6 I, 12 + 6 I) each known load with its reactions, as columns of amplitudes.

    static : (Z, 12 + 6 I) the displacements of the unit loads under the conditions
    """
    loads = known_loads(model)
    held = supports(model, conditions)
    reactions = np.linalg.lstsq(loads @ held.T, model.K @ static - loads, rcond=None)[0]
    return np.eye(loads.shape[1]) + held.T @ reactions
