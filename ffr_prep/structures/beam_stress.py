"""Section forces of beams and the stress at the outlines of their sections, per elastic coordinate.

The section forces are those of the elements' stiffness: the forces K e at the ends of an element follow from its nodal
coordinates e, and between the ends they vary as in an element without loads of its own: tension, shear forces and torque
are constant, bending moments linear. Static solutions of loads at the nodes are exact. Loads along the elements (inertia,
weight) act through the nodes: they would add K e - f, so with elements of length l under a load p per length the tension
at an end is off by p l / 2, the moment by p l^2 / 12, and both vanish as the mesh is refined; the values in the middle of
an element are off by p l^2 / 24 only, and tension and shear there are exact to second order.

Stress on the outline of a section, at (y, z) from its centroid:

    sigma_xx = N / A + My z / Iy - Mz y / Iz,    (tau_xy, tau_xz) = shear . (Qy, Qz, Mx),

with the shear stress that the shape of the section knows at its outline (`ffr_prep.structures.sections`). A section given by
its constants has the outline of the rectangle with the same second moments, and no shear but that of the torque where it is
round, J = Iy + Iz: tau_xy = -Mx z / J, tau_xz = Mx y / J.

Source: S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. (1970), articles 102 and 109.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.body import TENSOR, BeamForces, Surface
from ffr_prep.common.arrays import Array
from ffr_prep.structures.beam_surface import Moved, prisms, stations, swept_surface
from ffr_prep.structures.beams import Beams, element_coordinates, stiffness, undeformed
from ffr_prep.structures.frame import Frame
from ffr_prep.structures.sections import Section

SECTION_STRESS = "section forces K e of the elements; tension, bending, shear of transverse forces and torque"
_ROWS, _COLUMNS = np.array(TENSOR).T
_MIDDLE = np.array([0.0, 0.5, 1.0])


def stressed_sweep(frame: Frame, elements: Beams, moved: Moved, modes: Array) -> Surface:
    """The swept surface of the frame with the stress at its points of the section forces modes (E, 3, 6, n)."""
    stress, moduli = [], []
    for own, outline, shear in prisms(frame):
        member = frame.members[frame.member_of[own[0]]]
        xi, across = stations(outline, len(own))
        at_stations = section_forces_at(modes[own], xi)
        tau = np.tile(shear, (len(xi) // len(shear), 1, 1))
        of_own = _outline_stress(member.section, elements.C[own], across, tau, at_stations)
        stress.append(of_own.reshape(len(own) * len(xi), 6, modes.shape[3]))
        moduli.append(np.tile([member.material.E, member.material.nu], (len(stress[-1]), 1)))
    return replace(
        swept_surface(frame, elements, moved),
        stress=np.concatenate(stress),
        moduli=np.concatenate(moduli),
        beams=BeamForces(positions=_places(elements), axes=elements.C, modes=modes),
    )


def _places(elements: Beams) -> Array:
    """(E, 3, 3) both ends and the middle of the centroid line of every element, in the body frame [m]."""
    return undeformed(elements, _MIDDLE, np.zeros((len(elements.length), len(_MIDDLE), 2)))


def section_forces(elements: Beams, nodal: Array) -> Array:
    """(E, 3, 6, n) N, Qy, Qz, Mx, My, Mz at the first end, the middle and the last end, in element axes.

    They are what the part of the beam towards the last end exerts on the other part; N is tension.
    """
    return at_places(end_forces(elements, nodal))


def at_places(ends: Array) -> Array:
    """(E, 3, 6, n) section forces at the first end, the middle and the last end, of the forces on the ends (E, 12, n)."""
    first, last = -ends[:, :6], ends[:, 6:]
    return np.stack([first, (first + last) / 2, last], axis=1)


def end_forces(elements: Beams, nodal: Array) -> Array:
    """(E, 12, n) forces and moments on the ends of the centroid line, in element axes, that hold the element bent."""
    return stiffness_of_ends(elements) @ element_coordinates(elements) @ nodal


def stiffness_of_ends(elements: Beams) -> Array:
    """(E, 12, 12) stiffness of the coordinates of the centroid line in element axes."""
    to_nodes = np.linalg.inv(element_coordinates(elements))
    return to_nodes.transpose(0, 2, 1) @ stiffness(elements) @ to_nodes


def section_forces_at(modes: Array, xi: Array) -> Array:
    """(E, Q, 6, n) section forces at xi (Q,) in [0, 1] along the elements, from those at the ends (E, 3, 6, n)."""
    first, last = modes[:, 0, None], modes[:, 2, None]
    xi = xi[:, None, None]
    return (1 - xi) * first + xi * last


def _outline_stress(section: Section, C: Array, across: Array, shear: Array, forces: Array) -> Array:
    """(E, Q, 6, n) stress in body axes at (y, z) = across (E, Q, 2) of sections with the forces (E, Q, 6, n).

    shear : (Q, 3, 2) tau_xy and tau_xz of unit Qy, Qz and Mx
    """
    N, _, _, _, My, Mz = np.moveaxis(forces, 2, 0)
    y, z = across[..., 0, None], across[..., 1, None]
    in_element_axes = np.zeros((*N.shape[:2], 3, 3, N.shape[2]))
    in_element_axes[:, :, 0, 0] = N / section.A + My * z / section.Iy - Mz * y / section.Iz
    tau = np.einsum("qfs,eqfj->eqsj", shear, forces[:, :, 1:4])
    in_element_axes[:, :, 0, 1:] = in_element_axes[:, :, 1:, 0] = tau
    tensor = np.einsum("eik,eqklj,eml->eqimj", C, in_element_axes, C, optimize=True)
    return tensor[:, :, _ROWS, _COLUMNS]
