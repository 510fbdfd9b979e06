"""Matrices from outside as a part of a body that is tied to others (`ffr_prep.pipelines.tied`).

What matrices give is stiffness, mass and the places of the nodes: inertia integrals and triangles to draw, if there are any.
They know no stress, so a body with such a part has no geometric stiffening.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.body.provenance import described
from ffr_prep.common.errors import InputError
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.matrices.checks import check_connected, check_matrices, mass_is_singular, precision_warnings
from ffr_prep.matrices.interfaces import couple_matrices, tie_matrices
from ffr_prep.matrices.model import MatrixModel, model_hash, without_empty_rows
from ffr_prep.matrices.nodal_inertia import nodal_integrals, scalar_integrals, scalar_mass
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.model import Model

Array = np.ndarray

_DOUBTFUL = 0.1


def matrix_part(given: MatrixModel, interfaces: Sequence[InterfaceRegion], progress: Stages = no_stages) -> Model:
    """The matrices with their interfaces, ready to be tied to other models or reduced with
    `ffr_prep.pipelines.reduce.reduce_model`.

    Raises InputError for matrices that are not those of a free body, and for coordinates without mass, which only a body of
    matrices alone may have (`ffr_prep.pipelines.matrices.reduce_matrices`).
    """
    model = checked(given, progress)
    if mass_is_singular(model):
        raise InputError(
            "some coordinates of the matrices have no mass: give them a little rotary inertia, or reduce the matrices alone"
        )
    return part_of(model, interfaces, progress)


def checked(given: MatrixModel, progress: Stages) -> MatrixModel:
    """The model without empty rows; InputError where its matrices are not those of a free body."""
    progress("check the matrices")
    model = without_empty_rows(given)
    check_matrices(model)
    return model


def part_of(model: MatrixModel, interfaces: Sequence[InterfaceRegion], progress: Stages) -> Model:
    """The `checked` matrices with their interfaces."""
    progress("tie the interfaces")
    ties = tie_matrices(model, interfaces)
    coupled = couple_matrices(model, interfaces, ties)
    check_connected(model, coupled, ties)
    m = scalar_mass(model.M, model.dofs)

    def inertia(basis: Array) -> InertiaIntegrals:
        if m is not None:
            return scalar_integrals(model.points, model.dofs, m, ties @ basis)
        return nodal_integrals(model.points, model.dofs, model.M, ties @ basis)[0]

    def doubts(basis: Array) -> list[str]:
        return [] if m is not None else _doubts(nodal_integrals(model.points, model.dofs, model.M, ties @ basis)[1])

    return Model(
        coupled=coupled,
        inertia=inertia,
        surface=lambda basis: surface_of_nodes(model, ties @ basis),
        stressed=lambda basis: _nothing(basis.shape[1]),
        stiffening=_unstressed,
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
            "notes": [*model.notes, "geometric stiffening is not available for matrices from outside"],
            "warnings": precision_warnings(model),
        },
        packages=("ffr", "numpy", "scipy"),
        doubts=doubts,
    )


def surface_of_nodes(model: MatrixModel, Phi: Array) -> Surface:
    """The triangles with the translations of their nodes."""
    if model.triangles is None:
        return _nothing(Phi.shape[1])
    used, triangles = np.unique(model.triangles, return_inverse=True)
    return Surface(model.points[used], triangles.reshape(-1, 3), model.dofs.on_nodes(Phi)[used, :3])


def _doubts(defect: Array) -> list[str]:
    doubtful = np.flatnonzero(defect > _DOUBTFUL)
    if not doubtful.size:
        return []
    listed = ", ".join(f"{k + 1} ({defect[k]:.2g})" for k in doubtful[:10])
    return [
        f"the mass matrix does not say how these coordinates change the inertia: {listed}{', ...' * (doubtful.size > 10)} "
        "(terms projected away beside 1); such as torsion of thin bars and waves as short as the elements. Mass, inertia "
        "and momenta are exact"
    ]


def _nothing(modes: int) -> Surface:
    """A surface without points, to which the stress of other parts can be joined."""
    return Surface(
        np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros((0, 3, modes)), np.zeros((0, 6, modes)), np.zeros((0, 2))
    )


def _unstressed(static: Array, loads: Array, basis: Array) -> Array:
    raise InputError(
        "geometric stiffening needs stresses, which matrices from outside do not give: reduce the body without it"
    )
