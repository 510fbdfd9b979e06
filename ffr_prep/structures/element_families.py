"""The families of structural elements, each in the same few arrays.

A family delivers, for its elements, the stiffness of their nodal coordinates and *mass points*: points inside the
elements that integrate every product of two displacement fields exactly, with the undeformed position, the mass and
the field C S W C_bar there. Beams are one family, plates of three and of four nodes are two others; another family is one
function here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.structures import beams, plates
from ffr_prep.structures.beam_mesh_error import inertia_energy
from ffr_prep.structures.beam_second_order import second_stressed_sweep, second_sweep
from ffr_prep.structures.beam_stiffening import beam_forces_of_products, beam_stiffening
from ffr_prep.structures.beam_stress import SECTION_STRESS, section_forces, stressed_sweep
from ffr_prep.structures.beam_surface import moved_linearly, swept_surface
from ffr_prep.structures.frame import Frame, ends, orientations
from ffr_prep.structures.plate_stiffening import plate_forces_of_products, plate_stiffening
from ffr_prep.structures.plate_surface import (
    FACE_STRESS,
    plate_faces,
    second_faces,
    second_stressed_faces,
    stressed_faces,
)


@dataclass(frozen=True)
class Family:
    """E elements of one kind with k nodes, whose coordinates are in body axes.

    name       : "beam", "triangle" or "quadrilateral"
    nodes      : (E, k) nodes of the frame
    stiffness  : (E, 6k, 6k)
    positions  : (E, Q, 3) mass points of the undeformed elements [m]
    mass       : (E, Q) their masses [kg]
    field      : (E, Q, 3, 6k) their displacements
    surface    : what is drawn, of the coordinates (E, 6k, n) per elastic coordinate
    stressed   : the same with stress modes, and section forces of beams
    recovery   : how the stress is recovered, in words
    stiffening : (r, n, n) geometric stiffness, of the static coordinates (E, 6k, r) of r loads, their accelerations (12, r),
                 which act inside the elements, and the basis (E, 6k, n)
    forces_of_products : (E, 6k, m) its linear form in the static coordinates, of one (E, 6k, 1) and others (E, 6k, m)
    second     : what is drawn, with the displacements of pairs: of their coordinates (E, 6k, m), one and others
    second_stressed : the same with their stress, and section forces of beams
    mesh_energy : (r,) twice the strain energy that their size adds to the coordinates (E, 6k, r) of vibrations of omega^2
                  (r,); None where all families are looked at together (`ffr_prep.structures.plate_mesh_error`)
    """

    name: str
    nodes: Array
    stiffness: Array
    positions: Array
    mass: Array
    field: Array
    surface: Callable[[Array], Surface]
    stressed: Callable[[Array], Surface]
    recovery: str
    stiffening: Callable[[Array, Array, Array], Array]
    forces_of_products: Callable[[Array, Array], Array]
    second: Callable[[Array, Array, Array], Surface]
    second_stressed: Callable[[Array, Array, Array], Surface]
    mesh_energy: Callable[[Array, Array], Array] | None = None


def families(frame: Frame) -> tuple[Family, ...]:
    """Those of the frame that have elements; InputError for an element of a shape that cannot be used."""
    made = []
    if len(frame.elements):
        made.append(beam_family(frame))
    of_triangles, of_quadrilaterals = np.split(frame.shell_of, [len(frame.triangles)])
    if len(frame.triangles):
        made.append(plate_family("triangle", frame, frame.triangles, of_triangles))
    if len(frame.quadrilaterals):
        made.append(plate_family("quadrilateral", frame, frame.quadrilaterals, of_quadrilaterals))
    return tuple(made)


def beam_family(frame: Frame) -> Family:
    """The beams of the frame."""
    elements = beam_elements(frame)
    xi, across, mass = beams.mass_points(elements)
    return Family(
        name="beam",
        nodes=frame.elements,
        stiffness=beams.stiffness(elements),
        positions=beams.undeformed(elements, xi, across),
        mass=mass,
        field=beams.field(elements, xi, across),
        surface=lambda nodal: swept_surface(frame, elements, moved_linearly(elements, nodal)),
        stressed=lambda nodal: stressed_sweep(
            frame, elements, moved_linearly(elements, nodal), section_forces(elements, nodal)
        ),
        recovery=SECTION_STRESS,
        stiffening=partial(beam_stiffening, elements),
        forces_of_products=partial(beam_forces_of_products, elements),
        second=partial(second_sweep, frame, elements),
        second_stressed=partial(second_stressed_sweep, frame, elements),
        mesh_energy=partial(inertia_energy, elements),
    )


def beam_elements(frame: Frame) -> beams.Beams:
    """The beam elements of the frame; InputError for one without length or a needed orientation."""
    members = [frame.members[k] for k in frame.member_of]
    return beams.beams(ends(frame), [m.section for m in members], [m.material for m in members], orientations(frame))


def plate_family(name: str, frame: Frame, nodes: Array, shell_of: Array) -> Family:
    """Plates of the same number of nodes (E, k), with the number of the shell of each."""
    elements = plates.plates(frame.points[nodes], [frame.shells[k] for k in shell_of])
    at, z, mass = plates.mass_points(elements)
    return Family(
        name=name,
        nodes=nodes,
        stiffness=plates.stiffness(elements),
        positions=plates.undeformed(elements, at, z),
        mass=mass,
        field=plates.field(elements, at, z),
        surface=partial(plate_faces, elements, nodes),
        stressed=partial(stressed_faces, elements, nodes),
        recovery=FACE_STRESS,
        stiffening=partial(plate_stiffening, elements),
        forces_of_products=partial(plate_forces_of_products, elements),
        second=partial(second_faces, elements, nodes),
        second_stressed=partial(second_stressed_faces, elements, nodes),
    )


# ---- nodal coordinates ---------------------------------------------------------------------------------------------


def connectivity(nodes: Array, count: int) -> sp.csr_array:
    """B_1 (6kE, 6N) Boolean: the coordinates of elements with the nodes (E, k) among those of all `count` nodes."""
    columns = (6 * nodes[:, :, None] + np.arange(6)).ravel()
    return sp.csr_array((np.ones(columns.size), columns, np.arange(columns.size + 1)), shape=(columns.size, 6 * count))


def element_values(part: Family, q_n: Array) -> Array:
    """(E, 6k, n) the coordinates of each element, B_1 q_n, of the nodal coordinates (6N, n)."""
    by_node = q_n.reshape(len(q_n) // 6, 6, q_n.shape[1])
    return by_node[part.nodes].reshape(len(part.nodes), 6 * part.nodes.shape[1], q_n.shape[1])
