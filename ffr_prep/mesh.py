"""Meshes: read, generate, check, convert units once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Block:
    """Volume elements of one kind: "tet4", "tet10", "hex8", "hex20" or "hex27".

    nodes : (E, k) indices into Mesh.points, in the node order of meshio (VTK).
    """

    kind: str
    nodes: Array


@dataclass(frozen=True)
class Mesh:
    """A volume mesh with named regions; frozen, SI units.

    points        : (N, 3) [m]
    blocks        : volume elements; element numbers count through the blocks in order
    volume_groups : name -> (m,) element numbers
    face_groups   : name -> tuple of (F, k) face connectivities, k = 3, 6 (triangles), 4, 8, 9 (quadrilaterals), meshio order
    node_groups   : name -> (m,) node indices
    """

    points: Array
    blocks: tuple[Block, ...]
    volume_groups: Mapping[str, Array]
    face_groups: Mapping[str, tuple[Array, ...]]
    node_groups: Mapping[str, Array]
