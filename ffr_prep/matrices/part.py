"""Bodies from outside matrices: stiffness and mass of another finite-element program, with its nodes.

A `MatrixModel` is nodes, K, M and the map that says which row is which of the six coordinates of which node; nodes of
solids have three coordinates, those of shells and beams five or six. From there the way is the one of meshes:
interfaces, reference conditions, reduction, inertia integrals (see `ffr_prep.matrices.nodal_inertia` for what M alone can
say). Matrices know no stress, so a body with such a part has no geometric stiffening.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import Surface
from ffr_prep.body.provenance import described
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.matrices.checks import (
    check_connected,
    check_matrices,
    check_mechanisms,
    mass_is_singular,
    precision_warnings,
)
from ffr_prep.matrices.interfaces import couple_matrices, tie_matrices
from ffr_prep.matrices.model import MatrixModel, model_hash, without_empty_rows
from ffr_prep.matrices.nodal_inertia import nodal_integrals, rigid_motions, scalar_integrals, scalar_mass
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.model import Model
from ffr_prep.solvers.threads import on_one_thread

_DOUBTFUL = 0.1


@on_one_thread
def from_matrices(
    given: MatrixModel, interfaces: Sequence[InterfaceRegion] = (), *, progress: Stages = no_stages
) -> Model:
    """The model of matrices from outside, to be reduced or tied. Raises InputError if they are not those of a free body.

    interfaces : at groups of nodes; one node gives its six coordinates, several follow rigidly or in the mean
    progress   : called with the name of each stage as it begins

    Consistent and lumped masses are both fine; coordinates without mass only in a body of matrices alone.

    >>> model = fp.from_matrices(fp.read_matrices(["part.npz"]), [fp.InterfaceRegion("tip")])
    """
    progress("check the matrices")
    model = without_empty_rows(given)
    check_matrices(model)
    progress("tie the interfaces")
    ties = tie_matrices(model, interfaces)
    coupled = couple_matrices(model, interfaces, ties)
    check_connected(model, coupled, ties)
    m = scalar_mass(model.M, model.dofs)

    def inertia(basis: Array) -> InertiaIntegrals:
        if m is not None:
            return scalar_integrals(model.points, model.dofs, m, ties @ basis)
        return nodal_integrals(model.points, model.dofs, model.M, ties @ basis)[0]

    return Model(
        coupled=coupled,
        inertia=inertia,
        surface=lambda basis: surface_of_nodes(model, ties @ basis),
        stressed=lambda basis: None,
        stiffening=_unstressed,
        second=_unstressed,
        recovery="none of matrices from outside",
        record={
            "matrices": {
                **model.source,
                "hash": model_hash(model),
                "nodes": len(model.points),
                "degrees_of_freedom": coupled.K.shape[0],
                "mass": "general, by rigid motions of the nodes" if m is None else "one scalar mass for x, y and z",
            },
            "interfaces": [described(interface) for interface in interfaces],
            "notes": [
                *model.notes,
                "matrices from outside do not tell their stresses: the body is linear",
                *_damping_notes(model),
            ],
            "warnings": precision_warnings(model),
        },
        packages=("ffr", "numpy", "scipy"),
        doubts=lambda basis: _doubts(model, m, ties @ basis),
        damping=lambda basis: _damping(model, ties @ basis),
        massless=mass_is_singular(model),
        unstressed=True,
        diagnose=lambda: check_mechanisms(model, coupled, ties),
    )


def surface_of_nodes(model: MatrixModel, Phi: Array) -> Surface | None:
    """The triangles with the translations of their nodes; None where there are none."""
    if model.triangles is None:
        return None
    used, triangles = np.unique(model.triangles, return_inverse=True)
    return Surface(model.points[used], triangles.reshape(-1, 3), model.dofs.on_nodes(Phi)[used, :3])


def _damping(model: MatrixModel, Phi: Array) -> Array | None:
    if model.C is None:
        return None
    D = Phi.T @ (model.C @ Phi)
    return np.asarray(0.5 * (D + D.T))


def _damping_notes(model: MatrixModel) -> list[str]:
    """Where C damps rigid motion, which no body does: its frame is moved by joints and forces alone."""
    if model.C is None:
        return []
    rigid = rigid_motions(model.points, model.dofs)
    of_rigid, of_all = abs(model.C @ rigid).max(), abs(model.C).max() * abs(rigid).max()
    return ["C damps rigid motions too; of a body what deforms it is damped"] if of_rigid > 1e-9 * of_all else []


def _doubts(model: MatrixModel, m: sp.csr_array | None, Phi: Array) -> list[str]:
    """Of the modes Phi (D, n): those whose integrals a mass that is not one scalar m for x, y and z does not give."""
    if m is not None:
        return []
    defect = nodal_integrals(model.points, model.dofs, model.M, Phi)[1]
    doubtful = np.flatnonzero(defect > _DOUBTFUL)
    if not doubtful.size:
        return []
    listed = ", ".join(f"{k + 1} ({defect[k]:.2g})" for k in doubtful[:10])
    return [
        f"the mass matrix does not say how these coordinates change the inertia: {listed}{', ...' * (doubtful.size > 10)} "
        "(terms projected away beside 1); such as torsion of thin bars and waves as short as the elements. Mass, inertia "
        "and momenta are exact"
    ]


def _unstressed(*fields: Array) -> NoReturn:
    raise InputError("load matrices need stresses, which matrices from outside do not give: reduce with linear=True")
