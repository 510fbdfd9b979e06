"""The second-order displacement of frames (`ffr_prep.model.second_order`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.model.model import merged
from ffr_prep.model.region_rotations import MeanRegion, RigidRegion, second_order_forces, turned_nodes
from ffr_prep.model.second_order import SecondOrder
from ffr_prep.structures.element_families import Family, connectivity, element_values


def frame_second_order(
    parts: Sequence[Family],
    ties: sp.csr_array,
    regions: Sequence[RigidRegion | MeanRegion],
    known: Array,
    basis: Array,
) -> SecondOrder:
    """That of the basis (Z, n) of families of elements; ties (6N, Z), known (12 + 6 I, n, n)."""
    q, count = ties @ basis, ties.shape[0] // 6

    def products(part: Family, i: int) -> tuple[Array, Array]:
        return element_values(part, q[:, i : i + 1]), element_values(part, q[:, i:])

    def forces(some: range) -> Array:
        return np.hstack([of_one(i) for i in some])

    def of_one(i: int) -> Array:
        total = second_order_forces(regions, basis[:, i], basis[:, i:])
        for part in parts:
            inside = part.forces_of_products(*products(part, i))
            total = total + ties.T @ (connectivity(part.nodes, count).T @ inside.reshape(-1, inside.shape[2]))
        return np.asarray(total)

    def shown(of_part: Callable[[Family], Callable[..., Surface]], i: int, z: Array) -> Surface | None:
        nodal = (ties @ z).reshape(count, 6, -1)
        nodal[:, :3] += turned_nodes(regions, count, basis[:, i], basis[:, i:])
        q_n = nodal.reshape(6 * count, -1)
        return merged([of_part(part)(element_values(part, q_n), *products(part, i)) for part in parts])

    return SecondOrder(
        known=known,
        forces=forces,
        surface=lambda i, z: shown(lambda part: part.second, i, z),
        stressed=lambda i, z: shown(lambda part: part.second_stressed, i, z),
    )
