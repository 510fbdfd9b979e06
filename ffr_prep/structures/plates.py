"""Thin flat plates and shells with infinitesimal nodal rotations, in Shabana's intermediate element coordinate system.

Triangles and quadrilaterals with three translations [m] and three rotations [rad] at each of their k nodes. As for beams
(`ffr_prep.structures.beams`), the intermediate element frame has axes parallel to the undeformed element and the origin of
the body frame, and the displacement of the point (x, y) at the height z above the middle plane is, in body axes,

    u = C S(x, y, z) W C_bar B_1 q_n,

S : (3, 6k) shape functions in element axes; C_bar : (6k, 6k) block-diagonal, turns nodal coordinates into element axes;
W : (6k, 6k) carries them from nodes slightly off the plane of a quadrilateral onto it; B_1 : Boolean connectivity. The
undeformed element has the coordinates e_0 = (its corners, no rotations), and S e_0 is exactly flat.

With N_i the linear or bilinear functions of the corners, P_m the quadratic ones of the middles of the sides and B that
of the centre, a the slope along a side of length l with normal n, and d = (w_j - w_i)/l along it, the fields are

* rotation of the fibres across the plate: theta = sum N_i theta_i + sum P_m n_m 3/2 (d - (a_i + a_j)/2). The part of the
  middles makes the fibres normal to the side in its mean: DKT, and DKQ (discrete Kirchhoff, no transverse shear);
* deflection, for the mass and for geometric stiffening: cubic along each side with the slopes of its ends,
  w = sum N_i w_i + sum P_m l/8 ((a_i - a_j) + g_m (a_i + a_j - 2 d)), g_m linear from 1 at i to -1 at j. On triangles this is
  Zienkiewicz's cubic, on rectangles the field of Adini, Clough and Melosh; it is continuous between elements;
* displacement in the plane: u = sum N_i u_i + sum P_m n_m l/8 (psi_j - psi_i) + B phi z' x (r - r_c), psi the rotation
  about the normal (drilling). The second part is Allman's; in the third the inside of the element follows the mean of psi
  where that is not the mean rotation of its contour, phi = (mean psi - mean rotation)/10. So no motion is without energy
  but the six rigid ones and none without mass; both parts vanish where the strain is constant. The tenth costs less
  stiffness in bending than the whole, and any factor tells the two rotations apart.

The in-plane displacement at the height z is u + z theta x (0, 0, 1); rotary inertia of the thickness is part of S. All
fields hold rigid motions and constant strains and curvatures exactly; deflection and displacement in the plane
are conforming, so the mass is consistent.

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 6.1-6.3; J.-L. Batoz, K.-J. Bathe, L.-W. Ho, Int. J.
Numer. Meth. Engng 15 (1980) 1771-1812 (DKT); J.-L. Batoz, M. Ben Tahar, ibid. 18 (1982) 1655-1677 (DKQ); G. P. Bazeley,
Y. K. Cheung, B. M. Irons, O. C. Zienkiewicz, Proc. 1st Conf. Matrix Meth. Struct. Mech. (1965) 547-576 (deflection);
D. J. Allman, Computers & Structures 19 (1984) 1-8 and R. D. Cook, ibid. 22 (1986) 1065-1067 (drilling rotations).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.structures.frame import Shell
from ffr_prep.structures.plate_functions import Reference, reference, rule

# Exact for products of two fields, and of two strains, of triangles and parallelograms.
_MASS_ORDER = {3: 8, 4: 7}
STIFFNESS_ORDER = {3: 6, 4: 7}

_FOLLOWING = 0.1
_FLAT = 0.01
_DEGENERATE = 1e-6


@dataclass(frozen=True)
class Plates:
    """E flat elements of k = 3 or 4 nodes; every array has them along its first axis.

    C         : (E, 3, 3) rotation from element to body axes
    corners   : (E, k, 2) in the intermediate element frame [m], counter-clockwise about z'
    level     : (E,) height of the middle plane in that frame [m]
    lift      : (E, k) height of the nodes above the middle plane [m]; zero but for warped quadrilaterals
    thickness : (E,) [m]
    membrane  : (E, 3, 3) forces per length of the strains xx, yy and 2 xy [N/m]
    bending   : (E, 3, 3) moments per length of the curvatures xx, yy and 2 xy [N m]
    area_mass : (E,) [kg/m^2]
    gyration  : (E,) root mean square of z over the mass [m]
    E, nu     : (E,) Young's modulus [Pa] and Poisson's ratio
    """

    C: Array
    corners: Array
    level: Array
    lift: Array
    thickness: Array
    membrane: Array
    bending: Array
    area_mass: Array
    gyration: Array
    E: Array
    nu: Array


def plates(nodes: Array, shells: Sequence[Shell]) -> Plates:
    """The elements with nodes at (E, k, 3) [m], k = 3 or 4, of one shell each.

    Raises InputError for elements without area, warped or concave ones.
    """
    C = element_axes(nodes)
    place = np.einsum("ecd,ekc->ekd", C, nodes)
    level = place[..., 2].mean(axis=1)
    lift = place[..., 2] - level[:, None]
    _check_shape(nodes, place[..., :2], lift)
    thickness, E, nu, rho, gyration = np.array(
        [(s.thickness, s.material.E, s.material.nu, s.material.rho, s.gyration) for s in shells], float
    ).T
    elastic = _plane_stress(E, nu)
    return Plates(
        C=C,
        corners=place[..., :2],
        level=level,
        lift=lift,
        thickness=thickness,
        membrane=thickness[:, None, None] * elastic,
        bending=(thickness**3 / 12)[:, None, None] * elastic,
        area_mass=rho * thickness,
        gyration=gyration,
        E=E,
        nu=nu,
    )


def _plane_stress(E: Array, nu: Array) -> Array:
    """(E, 3, 3) stress xx, yy, xy of the strains xx, yy, 2 xy, with no stress across the plate [Pa]."""
    elastic = np.zeros((len(E), 3, 3))
    elastic[:, 0, 0] = elastic[:, 1, 1] = 1.0
    elastic[:, 0, 1] = elastic[:, 1, 0] = nu
    elastic[:, 2, 2] = (1 - nu) / 2
    return (E / (1 - nu**2))[:, None, None] * elastic


# ---- the intermediate element frame -------------------------------------------------------------------------------


def element_axes(nodes: Array) -> Array:
    """C (E, 3, 3): columns x' along the first side, in the plane of the element, y', and z' normal to both diagonals."""
    normal = np.cross(nodes[:, 2] - nodes[:, 0], nodes[:, -1] - nodes[:, 1])
    size = np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    length = np.linalg.norm(normal, axis=1)
    first = nodes[:, 1] - nodes[:, 0]
    thin = np.flatnonzero(~(np.minimum(length, np.linalg.norm(first, axis=1) * size) > _DEGENERATE * size**2))
    if thin.size:
        raise InputError(
            f"plate element {thin[0]} with corners {nodes[thin[0]].tolist()} m has no area: remove it or repair the mesh"
        )
    z = normal / length[:, None]
    x = first - np.einsum("ec,ec->e", first, z)[:, None] * z
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _check_shape(nodes: Array, corners: Array, lift: Array) -> None:
    size = np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    warped = np.abs(lift).max(axis=1) / size
    worst = int(np.argmax(warped))
    if warped[worst] > _FLAT:
        raise InputError(
            f"quadrilateral {worst} with corners {nodes[worst].tolist()} m is warped: its corners are "
            f"{100 * warped[worst]:.2g} % of its size off their mean plane ({100 * _FLAT:g} % are allowed); refine the mesh "
            "there, or split it into triangles with triangulated(...)"
        )
    before, after = np.roll(corners, 1, axis=1) - corners, np.roll(corners, -1, axis=1) - corners
    turn = (after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]).min(axis=1) / size**2
    worst = int(np.argmin(turn))
    if not turn[worst] > _DEGENERATE:
        raise InputError(
            f"plate element {worst} with corners {nodes[worst].tolist()} m is concave or turned inside out (Jacobian "
            f"{turn[worst]:.2g} of its size squared): repair the mesh there, or check its node order"
        )


def element_coordinates(elements: Plates) -> Array:
    """W C_bar (E, 6k, 6k): nodal coordinates in body axes -> of the corners of the middle plane in element axes."""
    count, k = elements.lift.shape
    C_bar, W = np.zeros((count, 6 * k, 6 * k)), np.tile(np.eye(6 * k), (count, 1, 1))
    for first in range(0, 6 * k, 3):
        C_bar[:, first : first + 3, first : first + 3] = elements.C.transpose(0, 2, 1)
    for i in range(k):  # theta x (0, 0, -lift)
        W[:, 6 * i, 6 * i + 4], W[:, 6 * i + 1, 6 * i + 3] = -elements.lift[:, i], elements.lift[:, i]
    return W @ C_bar


def undeformed_coordinates(elements: Plates) -> Array:
    """e_0 (E, 6k): the corners of the undeformed middle plane in the intermediate element frame [m], no rotations."""
    count, k = elements.lift.shape
    e_0 = np.zeros((count, k, 6))
    e_0[..., :2], e_0[..., 2] = elements.corners, elements.level[:, None]
    return e_0.reshape(count, 6 * k)


# ---- gradients in element axes ------------------------------------------------------------------------------------


def jacobian(elements: Plates, of: Reference) -> tuple[Array, Array]:
    """(E, Q, 2, 2) dx/dX and its determinant (E, Q) [m^2]."""
    J = np.einsum("ekc,qkd->eqcd", elements.corners, of.dN)
    return J, J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]


def _in_element_axes(elements: Plates, of: Reference) -> Reference:
    """The functions with gradients (E, Q, ..., 2) in x, y."""
    J, _ = jacobian(elements, of)
    inverse = np.linalg.inv(J)
    dN, dP, dgP = (np.matmul(d, inverse) for d in (of.dN, of.dP, of.dgP))
    dB = np.einsum("qd,eqdc->eqc", of.dB, inverse)
    return Reference(of.N, of.P, of.gP, of.B, dN, dP, dgP, dB)


# ---- what the sides do --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Sides:
    """Quantities of the k sides, linear in the element coordinates: (E, k, 6k), and of the contour (E, 6k).

    normal (E, k, 2); kirchhoff: theta at the middle beyond the mean of the ends; even, odd: the two parts of the
    deflection; bulge: in-plane displacement of the middle; phi: turn of the inside beyond the contour
    """

    normal: Array
    kirchhoff: Array
    even: Array
    odd: Array
    bulge: Array
    phi: Array


def _sides(elements: Plates) -> _Sides:
    count, k = elements.lift.shape
    i, j = np.arange(k), np.roll(np.arange(k), -1)
    along = elements.corners[:, j] - elements.corners[:, i]
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    normal = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length
    rise, first, last, turn = np.zeros((4, count, k, 6 * k))
    rise[:, i, 6 * i + 2], rise[:, i, 6 * j + 2] = -1 / length[..., 0], 1 / length[..., 0]
    for c in range(2):  # slope along the side: theta . n
        first[:, i, 6 * i + 3 + c] = normal[:, i, c]
        last[:, i, 6 * j + 3 + c] = normal[:, i, c]
    turn[:, i, 6 * i + 5], turn[:, i, 6 * j + 5] = -1.0, 1.0
    return _Sides(
        normal=normal,
        kirchhoff=1.5 * (rise - (first + last) / 2),
        even=length / 8 * (first - last),
        odd=length / 8 * (first + last - 2 * rise),
        bulge=length / 8 * turn,
        phi=_FOLLOWING * (_mean_drilling(elements) - _mean_rotation(elements, along)),
    )


def _mean_drilling(elements: Plates) -> Array:
    """(E, 6k) mean of the rotation about the normal over the area."""
    count, k = elements.lift.shape
    at, weights = rule(k, 2)
    of = reference(k, at)
    area = jacobian(elements, of)[1] * weights
    mean = np.zeros((count, 6 * k))
    mean[:, 5::6] = area @ of.N / area.sum(axis=1, keepdims=True)
    return mean


def _mean_rotation(elements: Plates, along: Array) -> Array:
    """(E, 6k) mean rotation in the plane: half the circulation of the displacement (Stokes), by the area."""
    x, y = elements.corners[..., 0], elements.corners[..., 1]
    area = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) / 2
    mean = np.zeros((len(x), 6 * x.shape[1]))
    around = (along + np.roll(along, 1, axis=1)) / (4 * area[:, None, None])
    mean[:, 0::6], mean[:, 1::6] = around[..., 0], around[..., 1]
    return mean


# ---- fields and their gradients -----------------------------------------------------------------------------------


def shape_functions(elements: Plates, at: Array, z: Array) -> Array:
    """S (E, Q, 3, 6k) in element axes at points `at` (Q, 2) of the reference element and heights z (E, Q) [m]."""
    k = elements.lift.shape[1]
    of, sides = reference(k, at), _sides(elements)
    N, P = of.N[None], of.P[None]
    turn = _rotation(sides, N, P)
    S = np.empty((*z.shape, 3, 6 * k))
    S[:, :, :2] = _in_plane(sides, N, P) + _bubble(elements, sides, of)
    S[:, :, 2] = _deflection(sides, N, P, of.gP[None])
    S[:, :, 0] += z[..., None] * turn[:, :, 1]
    S[:, :, 1] -= z[..., None] * turn[:, :, 0]
    return S


def displacement_gradient(elements: Plates, at: Array) -> Array:
    """(E, Q, 2, 3, 6k) d u_m / d x_a of the middle plane at [.., a, m] in element axes, deflection included [1/m]."""
    count, k = elements.lift.shape
    of, sides = _in_element_axes(elements, reference(k, at)), _sides(elements)
    dN, dP, dgP = (np.moveaxis(d, -1, 2).reshape(count, -1, k) for d in (of.dN, of.dP, of.dgP))
    gradient = np.empty((count, len(at), 2, 3, 6 * k))
    gradient[..., :2, :] = _in_plane(sides, dN, dP).reshape(count, len(at), 2, 2, 6 * k)
    gradient[..., :2, :] += _bubble_gradient(elements, sides, of)
    gradient[..., 2, :] = _deflection(sides, dN, dP, dgP).reshape(count, len(at), 2, 6 * k)
    return gradient


def fibre_rotation(elements: Plates, at: Array) -> Array:
    """(E, Q, 3, 6k) rotation of the fibres about x and y and of the nodes about the normal, in element axes."""
    of, sides = reference(elements.lift.shape[1], at), _sides(elements)
    tilt = _rotation(sides, of.N[None], of.P[None])
    drilling = np.broadcast_to(_nodal(of.N, 5)[:, None], (*tilt.shape[:2], 1, tilt.shape[3]))
    return np.concatenate([tilt, drilling], axis=2)


def membrane_strain(elements: Plates, at: Array) -> Array:
    """(E, Q, 3, 6k) strains xx, yy, 2 xy of the middle plane of the element coordinates W C_bar B_1 q_n, element axes [1/m].

    at : (Q, 2) in the unit triangle or square; multiply by `Plates.membrane` for the forces per length
    """
    gradient = displacement_gradient(elements, at)
    shear = gradient[:, :, 0, 1] + gradient[:, :, 1, 0]
    return np.stack([gradient[:, :, 0, 0], gradient[:, :, 1, 1], shear], axis=2)


def bending_strain(elements: Plates, at: Array) -> Array:
    """(E, Q, 3, 6k) curvatures xx, yy, 2 xy of the element coordinates W C_bar B_1 q_n, element axes [1/m^2 and 1/m].

    The strain at the height z is that of the middle plane plus z times the curvature. Multiply by `Plates.bending` for the
    moments per length; at : (Q, 2) in the unit triangle or square
    """
    count, k = elements.lift.shape
    of, sides = _in_element_axes(elements, reference(k, at)), _sides(elements)
    dN, dP = (np.moveaxis(d, -1, 2).reshape(count, -1, k) for d in (of.dN, of.dP))
    turn = _rotation(sides, dN, dP).reshape(count, len(at), 2, 2, 6 * k)  # [.., a, c] d theta_c / d x_a
    return np.stack([turn[:, :, 0, 1], -turn[:, :, 1, 0], turn[:, :, 1, 1] - turn[:, :, 0, 0]], axis=2)


def _nodal(N: Array, component: int) -> Array:
    """(., S, 6k) the functions N (., S, k) on one coordinate of the nodes."""
    out = np.zeros((*N.shape[:-1], 6 * N.shape[-1]))
    out[..., component::6] = N
    return out


def _rotation(sides: _Sides, N: Array, P: Array) -> Array:
    """(E, S, 2, 6k) rotation of the fibres about x and y."""
    of_nodes = np.stack([_nodal(N, 3), _nodal(N, 4)], axis=-2)
    return of_nodes + (P[..., None, :] * np.swapaxes(sides.normal, 1, 2)[:, None]) @ sides.kirchhoff[:, None]


def _in_plane(sides: _Sides, N: Array, P: Array) -> Array:
    """(E, S, 2, 6k) displacement in the plane, without that of the centre."""
    of_nodes = np.stack([_nodal(N, 0), _nodal(N, 1)], axis=-2)
    return of_nodes + (P[..., None, :] * np.swapaxes(sides.normal, 1, 2)[:, None]) @ sides.bulge[:, None]


def _deflection(sides: _Sides, N: Array, P: Array, gP: Array) -> Array:
    """(E, S, 6k)."""
    return _nodal(N, 2) + P @ sides.even + gP @ sides.odd


def _bubble(elements: Plates, sides: _Sides, of: Reference) -> Array:
    """(E, Q, 2, 6k) displacement of the inside about its centre."""
    turned = of.B[:, None] * _turned(elements, of)
    return turned[..., None] * sides.phi[:, None, None]


def _bubble_gradient(elements: Plates, sides: _Sides, of: Reference) -> Array:
    """(E, Q, 2, 2, 6k) at [.., a, c]."""
    turned = of.dB[..., None] * _turned(elements, of)[:, :, None]
    turned = turned + of.B[:, None, None] * np.array([(0.0, 1.0), (-1.0, 0.0)])
    return turned[..., None] * sides.phi[:, None, None, None]


def _turned(elements: Plates, of: Reference) -> Array:
    """(E, Q, 2) z' x (r - r_c)."""
    r = of.N @ elements.corners - elements.corners.mean(axis=1, keepdims=True)
    return np.stack([-r[..., 1], r[..., 0]], axis=-1)


# ---- field, mass and stiffness ------------------------------------------------------------------------------------


def field(elements: Plates, at: Array, z: Array) -> Array:
    """C S W C_bar (E, Q, 3, 6k): displacement in body axes of the element's nodal coordinates in body axes."""
    in_element_axes = shape_functions(elements, at, z) @ element_coordinates(elements)[:, None]
    return np.einsum("ecd,eqdi->eqci", elements.C, in_element_axes, optimize=True)


def undeformed(elements: Plates, at: Array, z: Array) -> Array:
    """C (S e_0 + (0, 0, z)) (E, Q, 3): undeformed positions in the body frame [m]."""
    place = np.einsum("eqdi,ei->eqd", shape_functions(elements, at, np.zeros_like(z)), undeformed_coordinates(elements))
    place[..., 2] += z
    return np.einsum("ecd,eqd->eqc", elements.C, place)


def mass_points(elements: Plates) -> tuple[Array, Array, Array]:
    """Points that integrate exactly, over the mass, every product of two fields of a triangle or parallelogram.

    at (Q, 2), z (E, Q) [m] and the mass of each point (E, Q) [kg]: Gauss points of the plane, each on both sides of it.
    """
    k = elements.lift.shape[1]
    at, weights = rule(k, _MASS_ORDER[k])
    _, area = jacobian(elements, reference(k, at))
    mass = elements.area_mass[:, None] * area * weights / 2
    z = np.broadcast_to(elements.gyration[:, None], mass.shape)
    return np.tile(at, (2, 1)), np.hstack([z, -z]), np.hstack([mass, mass])


def stiffness(elements: Plates) -> Array:
    """(E, 6k, 6k) stiffness of the nodal coordinates in body axes: membrane and bending."""
    k = elements.lift.shape[1]
    at, weights = rule(k, STIFFNESS_ORDER[k])
    area = jacobian(elements, reference(k, at))[1] * weights
    K = _energy(membrane_strain(elements, at), elements.membrane, area)
    K += _energy(bending_strain(elements, at), elements.bending, area)
    to_element = element_coordinates(elements)
    return to_element.transpose(0, 2, 1) @ K @ to_element


def _energy(strain: Array, rigidity: Array, area: Array) -> Array:
    """(E, n, n) integral of strain^T rigidity strain over the area (E, Q)."""
    count, _, _, n = strain.shape
    forces = (rigidity[:, None] @ strain) * area[..., None, None]
    return strain.reshape(count, -1, n).transpose(0, 2, 1) @ forces.reshape(count, -1, n)
