"""Matrix models whose answers are known: exported from the project's own frames and solids."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from boxes import STEEL, box_mesh

from ffr_prep.matrices.model import MatrixModel
from ffr_prep.mesh.mesh import Mesh, region_nodes
from ffr_prep.solids.assembly import assemble, vector_mass
from ffr_prep.structures.element_families import families
from ffr_prep.structures.frame import Frame, Member, joined, named, polyline
from ffr_prep.structures.model import assemble_frame
from ffr_prep.structures.sections import Section, rectangle, shifted, tube


def rod(section: Section, length: float, elements: int) -> Frame:
    """A steel beam along x from "root" to "tip"."""
    frame = polyline([(0, 0, 0), (length, 0, 0)], Member(section, STEEL, (0, 1, 0)), elements=elements)
    return named(frame, root=(0, 0, 0), tip=(length, 0, 0))


def space_frame(turned: np.ndarray | None = None) -> Frame:
    """Three members of different sections, one off its nodes, in no particular direction; 9 nodes."""
    R = np.eye(3) if turned is None else turned
    a, b, c, d = (tuple(R @ at) for at in np.array([(0.1, 0, 0), (1, 0.2, 0.3), (1.1, 0.9, -0.2), (0.2, 1, 1)]))
    up = tuple(R @ (0.3, -0.4, 0.8))
    first = polyline([a, b, c], Member(rectangle(0.02, 0.05), STEEL, up), elements=3)
    second = polyline([b, d], Member(tube(0.04, 0.004), STEEL), elements=2)
    third = polyline([c, d], Member(shifted(rectangle(0.03, 0.01), 0.02, -0.015), STEEL, up))
    return named(joined(first, second, third), a=a, b=c, c=d)


def of_frame(frame: Frame) -> MatrixModel:
    """Six rows to a node, consistent mass."""
    matrices, count = assemble_frame(frame, families(frame)), len(frame.points)
    return MatrixModel(
        points=frame.points,
        K=matrices.K,
        M=matrices.M,
        nodes=np.repeat(np.arange(count), 6),
        components=np.tile(np.arange(6), count),
        groups=frame.node_groups,
        source={"format": "frame"},
    )


def of_solid(mesh: Mesh) -> MatrixModel:
    """Three rows to a node, M = m (x) I_3; the faces as groups of nodes."""
    matrices, count = assemble(mesh, STEEL), len(mesh.points)
    return MatrixModel(
        points=mesh.points,
        K=matrices.K,
        M=vector_mass(matrices.m),
        nodes=np.repeat(np.arange(count), 3),
        components=np.tile(np.arange(3), count),
        groups={name: region_nodes(mesh, name) for name in mesh.face_groups},
        source={"format": "solid"},
    )


def bar(kind: str = "hex20", cells: tuple[int, int, int] = (4, 1, 1)) -> MatrixModel:
    """A steel bar of 1 m x 0.1 m x 0.06 m."""
    return of_solid(box_mesh(kind, (1.0, 0.1, 0.06), cells))


def lumped(model: MatrixModel) -> sp.csr_array:
    """A mass for the translations of each node, from 1 to 2 kg, and none for its rotations."""
    masses = np.random.default_rng(0).uniform(1, 2, len(model.points))
    return sp.csr_array(sp.diags_array(np.where(model.components < 3, masses[model.nodes], 0.0)))
