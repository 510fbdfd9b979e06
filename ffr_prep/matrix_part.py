"""Matrices from outside as a part of a body that is tied to others (`ffr_prep.tied`).

What matrices give is stiffness, mass and the places of the nodes: inertia integrals and triangles to draw, if there are any.
They know no stress, so a body with such a part has no geometric stiffening.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.errors import InputError
from ffr_prep.interface import InterfaceRegion
from ffr_prep.invariants import InertiaIntegrals
from ffr_prep.matrices import integrals_of, surface_of_nodes
from ffr_prep.matrix_checks import check_connected, check_matrices, mass_is_singular, precision_warnings
from ffr_prep.matrix_coupling import couple_matrices, tie_matrices
from ffr_prep.matrix_model import MatrixModel, model_hash, without_empty_rows
from ffr_prep.model import Model
from ffr_prep.progress import Stages, no_stages
from ffr_prep.provenance import described

Array = np.ndarray


def matrix_part(given: MatrixModel, interfaces: Sequence[InterfaceRegion], progress: Stages = no_stages) -> Model:
    """The matrices with their interfaces, ready to be tied to other models or reduced with `ffr_prep.model.reduce_model`.

    Raises InputError for matrices that are not those of a free body, and for coordinates without mass, which only a body of
    matrices alone may have (`ffr_prep.matrices.reduce_matrices`).
    """
    progress("check the matrices")
    model = without_empty_rows(given)
    check_matrices(model)
    if mass_is_singular(model):
        raise InputError(
            "some coordinates of the matrices have no mass: give them a little rotary inertia, or reduce the matrices alone"
        )
    progress("tie the interfaces")
    ties = tie_matrices(model, interfaces)
    coupled = couple_matrices(model, interfaces, ties)
    check_connected(model, coupled, ties)

    def inertia(basis: Array) -> InertiaIntegrals:
        return integrals_of(model, ties @ basis)[0]

    def surface(basis: Array) -> Surface:
        return surface_of_nodes(model, ties @ basis) or _nothing(basis.shape[1])

    return Model(
        coupled=coupled,
        inertia=inertia,
        surface=surface,
        stressed=lambda basis: _nothing(basis.shape[1]),
        stiffening=_unstressed,
        recovery="none of matrices from outside",
        record={
            "matrices": {
                **model.source,
                "hash": model_hash(model),
                "nodes": len(model.points),
                "degrees_of_freedom": coupled.K.shape[0],
            },
            "interfaces": [described(interface) for interface in interfaces],
            "warnings": precision_warnings(model),
        },
        packages=("ffr", "numpy", "scipy"),
    )


def _nothing(modes: int) -> Surface:
    """A surface without points, to which the stress of other parts can be joined."""
    return Surface(
        np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros((0, 3, modes)), np.zeros((0, 6, modes)), np.zeros((0, 2))
    )


def _unstressed(static: Array, loads: Array, basis: Array) -> Array:
    raise InputError(
        "geometric stiffening needs stresses, which matrices from outside do not give: reduce the body without it"
    )
