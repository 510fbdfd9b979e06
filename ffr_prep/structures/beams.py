"""Beam elements with infinitesimal nodal rotations, in Shabana's intermediate element coordinate system.

Such elements describe any translation but no finite rotation, so their shape functions hold only in axes parallel to
the undeformed element. The *intermediate element frame* has these axes, but its origin is that of the body frame. With
the constant rotation C from element to body axes, the displacement of the point (xi, y, z) in body axes is

    u = C S(xi, y, z) W C_bar B_1 q_n,

S : (3, 12) shape functions in element axes; C_bar : (12, 12) block-diagonal, turns the nodal coordinates into element
axes; W : (12, 12) carries them from the nodes to the ends of the centroid line; B_1 : (12, 6N) Boolean, picks the
coordinates of the element among those of all nodes q_n: three translations [m] and three rotations [rad] each. The
undeformed element has the coordinates e_0 = (ends of the centroid line, no rotation), and S e_0 is exactly straight.

S holds the bending of a Timoshenko beam with the shape functions of translation and rotation made from one another, so
that the shear strain is constant in an element and no locking occurs; with rigid shear they are Hermite's. The section
turns about its centroid as a rigid plate: rotary and polar inertia are part of S.

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 6.1-6.3 (intermediate element frame);
J. S. Przemieniecki, Theory of Matrix Structural Analysis (1968), sections 5.6 and 11.6; Z. Friedman, J. B. Kosmatka,
Computers & Structures 47 (1993) 473-481 (shape functions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.material import Material
from ffr_prep.structures.sections import Section

_GAUSS = 4  # points; products of the cubic shape functions are of degree six
_PARALLEL = 1e-6
_XY, _XZ = [1, 5, 7, 11], [2, 4, 8, 10]
_SIGN = np.array([1.0, -1.0, 1.0, -1.0])  # a positive rotation about y' is a negative slope dw/dx


@dataclass(frozen=True)
class Beams:
    """E straight beam elements; every array has them along its first axis.

    ends         : (E, 2, 3) ends of the line through the nodes, in body axes [m]
    length       : (E,) [m]
    C            : (E, 3, 3) rotation from element to body axes
    offset       : (E, 3) centroid from the line through the nodes, element axes [m]
    EA, GJ       : (E,) axial [N] and torsional [N m^2] stiffness
    EIy, EIz     : (E,) bending stiffness [N m^2]
    shear_y, shear_z : (E,) 12 E I / (k G A l^2) of bending in the x'y' and the x'z' plane [1]; 0 with rigid shear
    line_mass    : (E,) [kg/m]
    gyration     : (E, 2) root mean squares of y and z over the mass of the section [m]
    """

    ends: Array
    length: Array
    C: Array
    offset: Array
    EA: Array
    GJ: Array
    EIy: Array
    EIz: Array
    shear_y: Array
    shear_z: Array
    line_mass: Array
    gyration: Array


def beams(ends: Array, sections: Sequence[Section], materials: Sequence[Material], orientations: Array) -> Beams:
    """The elements between `ends` (E, 2, 3) [m], with a section and a material each.

    orientations : (E, 3) vectors in the x'y' plane of the elements, not along x'; NaN where a round section needs none

    Raises InputError for an element without length, or without the orientation that its section needs.
    """
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    constants = np.array([_constants(*pair) for pair in zip(sections, materials, strict=True)]).reshape(-1, 11).T
    EA, GJ, EIy, EIz, GAky, GAkz, line_mass, r_y, r_z, y, z = constants
    return Beams(
        ends=ends,
        length=length,
        C=element_axes(ends, sections, orientations),
        offset=np.stack([np.zeros_like(y), y, z], axis=-1),
        EA=EA,
        GJ=GJ,
        EIy=EIy,
        EIz=EIz,
        shear_y=12 * EIz / (GAky * length**2),
        shear_z=12 * EIy / (GAkz * length**2),
        line_mass=line_mass,
        gyration=np.stack([r_y, r_z], axis=-1),
    )


def _constants(section: Section, material: Material) -> tuple[float, ...]:
    E, G = material.E, material.E / (2 + 2 * material.nu)
    stiffness = (E * section.A, G * section.J, E * section.Iy, E * section.Iz)
    shear = (section.ky * G * section.A, section.kz * G * section.A)
    of_z, of_y = section.mass_moments or (section.Iy, section.Iz)
    radii = (float(np.sqrt(of_y / section.A)), float(np.sqrt(of_z / section.A)))
    return (*stiffness, *shear, material.rho * section.A, *radii, *section.offset)


def picked(elements: Beams, index: Array) -> Beams:
    """Some of the elements."""
    return Beams(**{field.name: getattr(elements, field.name)[index] for field in fields(elements)})


# ---- the intermediate element frame -------------------------------------------------------------------------------


def element_axes(ends: Array, sections: Sequence[Section], orientations: Array) -> Array:
    """C (E, 3, 3): columns x' along the element, y' the part of the orientation across it, z' = x' x y'."""
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    size = np.abs(ends).max(initial=0.0)
    short = np.flatnonzero(~(length > 1e-12 * size))
    if short.size:
        raise InputError(
            f"element {short[0]} from {ends[short[0], 0]} to {ends[short[0], 1]} m has no length: remove it, or merge "
            "its nodes"
        )
    x = along / length[:, None]
    hint = np.where(np.isnan(orientations), _any_across(x), orientations)
    y = hint - np.einsum("ec,ec->e", hint, x)[:, None] * x
    across = np.linalg.norm(y, axis=1)
    _check_orientations(x, sections, orientations, across > _PARALLEL * np.linalg.norm(hint, axis=1))
    y = y / across[:, None]
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _any_across(x: Array) -> Array:
    """(E, 3) the axis of the body frame that is most across x."""
    return np.eye(3)[np.argmin(np.abs(x), axis=1)]


def _check_orientations(x: Array, sections: Sequence[Section], given: Array, across: Array) -> None:
    needed = np.array([not section.is_round for section in sections])
    missing = np.flatnonzero(needed & np.isnan(given).any(axis=1))
    if missing.size:
        raise InputError(
            f"element {missing[0]} has the section {sections[missing[0]].name!r}, which is not round, and no "
            "orientation: give a vector in the plane of its x' and y' axes (y' is the direction of its height)"
        )
    wrong = np.flatnonzero(~across)
    if wrong.size:
        raise InputError(
            f"element {wrong[0]} runs along {np.round(x[wrong[0]], 6).tolist()}, and its orientation "
            f"{given[wrong[0]].tolist()} points the same way: give a vector across the element"
        )


def nodal_rotation(elements: Beams) -> Array:
    """C_bar (E, 12, 12): nodal coordinates in body axes -> in element axes."""
    C_bar = np.zeros((len(elements.C), 12, 12))
    for k in range(0, 12, 3):
        C_bar[:, k : k + 3, k : k + 3] = elements.C.transpose(0, 2, 1)
    return C_bar


def centroid_shift(elements: Beams) -> Array:
    """W (E, 12, 12): coordinates of the nodes -> of the ends of the centroid line, which follow the nodes rigidly."""
    W = np.tile(np.eye(12), (len(elements.C), 1, 1))
    arm = np.cross(np.eye(3), elements.offset[:, None, :])  # theta -> theta x offset
    for k in (0, 6):
        W[:, k : k + 3, k + 3 : k + 6] = -arm
    return W


def element_coordinates(elements: Beams) -> Array:
    """W C_bar (E, 12, 12): nodal coordinates in body axes -> of the centroid line in element axes."""
    return centroid_shift(elements) @ nodal_rotation(elements)


def undeformed_coordinates(elements: Beams) -> Array:
    """e_0 (E, 12): the ends of the undeformed centroid line in the intermediate element frame [m], no rotations."""
    in_element_axes = np.einsum("ecd,enc->end", elements.C, elements.ends) + elements.offset[:, None]
    e_0 = np.zeros((len(elements.C), 12))
    e_0[:, :3], e_0[:, 6:9] = in_element_axes[:, 0], in_element_axes[:, 1]
    return e_0


# ---- shape functions ----------------------------------------------------------------------------------------------


def shape_functions(elements: Beams, xi: Array, across: Array) -> Array:
    """S (E, Q, 3, 12) in element axes at xi (Q,) in [0, 1] along the element and (y, z) = across (E, Q, 2) [m]."""
    S, rotation = axis_functions(elements, xi)
    y, z = across[..., 0, None], across[..., 1, None]
    # the section turns as a rigid plate: theta x (0, y, z)
    S[:, :, 0] += rotation[:, :, 1] * z - rotation[:, :, 2] * y
    S[:, :, 1] -= rotation[:, :, 0] * z
    S[:, :, 2] += rotation[:, :, 0] * y
    return S


def axis_functions(elements: Beams, xi: Array) -> tuple[Array, Array]:
    """(E, Q, 3, 12) translation of the axis and rotation of the section, in element axes."""
    shape = (len(elements.length), len(xi), 3, 12)
    S, rotation = np.zeros(shape), np.zeros(shape)
    S[:, :, 0, 0], S[:, :, 0, 6] = 1 - xi, xi
    rotation[:, :, 0, 3], rotation[:, :, 0, 9] = 1 - xi, xi
    S[:, :, 1, _XY], rotation[:, :, 2, _XY] = bending_functions(elements.length, elements.shear_y, xi)
    deflection, slope = bending_functions(elements.length, elements.shear_z, xi)
    S[:, :, 2, _XZ], rotation[:, :, 1, _XZ] = _SIGN * deflection, -_SIGN * slope
    return S, rotation


def bending_functions(length: Array, shear: Array, xi: Array) -> tuple[Array, Array]:
    """(E, Q, 4) deflection and rotation of the section of (v_1, theta_1, v_2, theta_2) in one plane.

    Friedman & Kosmatka (1993), eqs. 14-17. They solve the static equations of the beam free of loads, so nodal
    values of static solutions are exact.
    """
    length, shear = length[:, None], shear[:, None]
    square, cube, half = xi**2, xi**3, shear / 2
    deflection = [
        1 - 3 * square + 2 * cube + shear * (1 - xi),
        length * (xi - 2 * square + cube + half * (xi - square)),
        3 * square - 2 * cube + shear * xi,
        length * (cube - square - half * (xi - square)),
    ]
    rotation = [
        6 / length * (square - xi),
        1 - 4 * xi + 3 * square + shear * (1 - xi),
        6 / length * (xi - square),
        3 * square - 2 * xi + shear * xi,
    ]
    scale = 1 / (1 + shear)[..., None]
    return scale * np.stack(deflection, axis=-1), scale * np.stack(rotation, axis=-1)


def axis_gradients(elements: Beams, xi: Array) -> tuple[Array, Array]:
    """(E, Q, 2, 12) dv/dx and dw/dx of the axis, and (E, Q, 1, 12) the twist, in element axes [1/m]."""
    _, rotation = axis_functions(elements, xi)
    slopes = np.stack([rotation[:, :, 2], -rotation[:, :, 1]], axis=2)
    slopes[:, :, 0, _XY] += shear_strain(elements.length, elements.shear_y)[:, None]
    slopes[:, :, 1, _XZ] += _SIGN * shear_strain(elements.length, elements.shear_z)[:, None]
    twist = np.zeros((*slopes.shape[:2], 1, 12))
    twist[..., 3], twist[..., 9] = -1 / elements.length[:, None, None], 1 / elements.length[:, None, None]
    return slopes, twist


def rotation_gradients(elements: Beams, xi: Array) -> Array:
    """(E, Q, 3, 12) the derivative along the beam of the rotation of the section, in element axes [1/m]."""
    gradient = np.zeros((len(elements.length), len(xi), 3, 12))
    gradient[:, :, 0, 3], gradient[:, :, 0, 9] = -1 / elements.length[:, None], 1 / elements.length[:, None]
    gradient[:, :, 2, _XY] = curvature_functions(elements.length, elements.shear_y, xi)
    gradient[:, :, 1, _XZ] = -_SIGN * curvature_functions(elements.length, elements.shear_z, xi)
    return gradient


def curvature_functions(length: Array, shear: Array, xi: Array) -> Array:
    """(E, Q, 4) derivative of the rotation of `bending_functions`."""
    length, shear = length[:, None], shear[:, None]
    steep = 6 / length * (2 * xi - 1)
    curvature = [steep, 6 * xi - 4 - shear, -steep, 6 * xi - 2 + shear]
    return np.stack(curvature, axis=-1) / (length * (1 + shear))[..., None]


def shear_strain(length: Array, shear: Array) -> Array:
    """(E, 4) the constant shear strain, slope less rotation, of (v_1, theta_1, v_2, theta_2) in one plane."""
    half = np.full_like(length, 0.5)
    return (shear / (1 + shear))[:, None] * np.stack([-1 / length, -half, 1 / length, -half], axis=-1)


# ---- field, mass and stiffness ------------------------------------------------------------------------------------


def field(elements: Beams, xi: Array, across: Array) -> Array:
    """C S W C_bar (E, Q, 3, 12): displacement in body axes of the element's nodal coordinates in body axes."""
    in_element_axes = (
        shape_functions(elements, xi, across) @ (centroid_shift(elements) @ nodal_rotation(elements))[:, None]
    )
    return np.einsum("ecd,eqdi->eqci", elements.C, in_element_axes)


def undeformed(elements: Beams, xi: Array, across: Array) -> Array:
    """C (S e_0 + (0, y, z)) (E, Q, 3): undeformed positions in the body frame [m]."""
    axis = np.einsum("eqdi,ei->eqd", axis_functions(elements, xi)[0], undeformed_coordinates(elements))
    axis[..., 1:] += across
    return np.einsum("ecd,eqd->eqc", elements.C, axis)


def mass_points(elements: Beams) -> tuple[Array, Array, Array]:
    """Points that integrate exactly, over the mass, every product of two fields of an element.

    xi (Q,), across (E, Q, 2) [m] and the mass of each point (E, Q) [kg]: Gauss points along the element, and at each
    four points of the section that have its zeroth, first and second moments.
    """
    at, weight = np.polynomial.legendre.leggauss(_GAUSS)
    spread = np.sqrt(2.0) * np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    across = np.tile(spread, (_GAUSS, 1)) * elements.gyration[:, None, :]
    mass = (elements.line_mass * elements.length)[:, None] * np.repeat(weight / 2, 4) / 4
    return np.repeat((1 + at) / 2, 4), across, mass


def stiffness(elements: Beams) -> Array:
    """(E, 12, 12) stiffness of the nodal coordinates in body axes (Przemieniecki 1968, eq. 5.116)."""
    K = np.zeros((len(elements.length), 12, 12))
    for pair, k in (([0, 6], elements.EA), ([3, 9], elements.GJ)):
        K[np.ix_(range(len(K)), pair, pair)] = (k / elements.length)[:, None, None] * np.array([[1, -1], [-1, 1]])
    in_plane = _bending_stiffness(elements.EIz, elements.length, elements.shear_y)
    K[np.ix_(range(len(K)), _XY, _XY)] = in_plane
    in_plane = _bending_stiffness(elements.EIy, elements.length, elements.shear_z)
    K[np.ix_(range(len(K)), _XZ, _XZ)] = in_plane * np.outer(_SIGN, _SIGN)
    to_element = element_coordinates(elements)
    return to_element.transpose(0, 2, 1) @ K @ to_element


def _bending_stiffness(EI: Array, length: Array, shear: Array) -> Array:
    """(E, 4, 4) of (v_1, theta_1, v_2, theta_2)."""
    one = EI / (length**3 * (1 + shear))
    side, near, far = 6 * length, (4 + shear) * length**2, (2 - shear) * length**2
    twelve = np.full_like(one, 12.0)
    rows = [
        [twelve, side, -twelve, side],
        [side, near, -side, far],
        [-twelve, -side, twelve, -side],
        [side, far, -side, near],
    ]
    return one[:, None, None] * np.array(rows).transpose(2, 0, 1)
