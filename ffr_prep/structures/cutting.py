"""A frame of beams and plates cut into parts at its nodes (`ffr_prep.model.cuts`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.cuts import Cuts, Division, divided, groups_at_cuts, interfaces_of_parts
from ffr_prep.structures.frame import Frame, group_nodes


def cut_frame(
    frame: Frame, interfaces: Sequence[InterfaceRegion], cuts: Cuts
) -> list[tuple[Frame, tuple[InterfaceRegion, ...]]]:
    """Frame and interfaces of each part.

    Raises InputError for cuts that cannot be made, and for an interface that reaches into two parts.
    """
    blocks = [frame.elements, frame.triangles, frame.quadrilaterals]
    division = divided(cuts, frame.points, blocks, _bonds(blocks, len(frame.points)), interfaces)
    regions = interfaces_of_parts(division, interfaces, lambda i: group_nodes(frame, i.region or i.name))
    return [(_part(frame, division, k), of_part) for k, of_part in enumerate(regions)]


def _bonds(blocks: Sequence[Array], count: int) -> Array:
    """(P, 2) pairs of elements that share one of the `count` nodes."""
    sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for nodes in blocks])
    nodes = np.concatenate([of.ravel() for of in blocks])
    ends = np.concatenate([[0], np.cumsum(sizes)])
    incidence = sp.csr_array((np.ones(nodes.size), nodes, ends), shape=(sizes.size, count))
    return np.stack(sp.triu(incidence @ incidence.T, 1).nonzero(), axis=1)


def _part(frame: Frame, division: Division, k: int) -> Frame:
    """The frame of part k; groups without nodes in it are left out."""
    nodes = division.nodes[k]
    new = np.full(len(frame.points), -1)
    new[nodes] = np.arange(nodes.size)
    sizes = [len(frame.elements), len(frame.triangles), len(frame.quadrilaterals)]
    beams, triangles, quadrilaterals = np.split(division.part == k, np.cumsum(sizes)[:-1])
    groups = {name: new[of] for name, of in {**frame.node_groups, **groups_at_cuts(division, k)}.items()}
    return replace(
        frame,
        points=frame.points[nodes],
        elements=new[frame.elements[beams]],
        member_of=frame.member_of[beams],
        triangles=new[frame.triangles[triangles]],
        quadrilaterals=new[frame.quadrilaterals[quadrilaterals]],
        shell_of=frame.shell_of[np.concatenate([triangles, quadrilaterals])],
        node_groups={name: of[of >= 0] for name, of in groups.items() if (of >= 0).any()},
    )
