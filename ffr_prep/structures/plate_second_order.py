"""The second-order displacement of plates at the points of their faces, and the stress that comes with it.

The middle plane moves by the second-order coordinates of the nodes; a fibre of the height z turns by phi, which adds
phi x (phi x z e_z) / 2. The strain of products of gradients in the plane is that of `ffr_prep.structures.plate_stiffening`.
"""

from __future__ import annotations

from dataclasses import replace

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.structures.plate_surface import plate_faces, stressed_faces, turned_faces
from ffr_prep.structures.plates import Plates


def second_faces(elements: Plates, nodes: Array, nodal: Array, one: Array, others: Array) -> Surface:
    """The faces with the displacements of pairs, of one (E, 6k, 1) and others (E, 6k, m).

    nodal : (E, 6k, m) second-order coordinates of the pairs; all in body axes
    """
    faces = plate_faces(elements, nodes, nodal)
    return replace(faces, Phi=faces.Phi + turned_faces(elements, nodes, one, others))


def second_stressed_faces(elements: Plates, nodes: Array, nodal: Array, one: Array, others: Array) -> Surface:
    """As `second_faces`, with the stress of the pairs."""
    faces = stressed_faces(elements, nodes, nodal, (one, others))
    return replace(faces, Phi=faces.Phi + turned_faces(elements, nodes, one, others))
