"""The error that the length of beam elements leaves in a vibration.

Between their nodes elements deform as without loads, and so statics are exact there. In a vibration the inertia of an element
deforms it between its nodes, too, as if these were clamped: by b, with a(b, b) = omega^2 m(z, b) and a(z, b) = 0 of a shape z
of unit mass. With m(b, b) >= m(z, b)^2 Rayleigh's quotient of z + b is at most omega^2 / (1 + g), g = a(b, b) / omega^2, so
that the mesh adds omega^2 g / (1 + g) at least to twice the energy of the shape. a(b, b) is found from the section forces
that are in equilibrium with the inertia, as those of least complementary energy. Rotary inertia is left out of them.

Sources: K. J. Bathe, Finite Element Procedures (1996), section 10.4 (Rayleigh's quotient); J. S. Przemieniecki, Theory of
Matrix Structural Analysis (1968), section 5.6 and chapter 8 (complementary energy).
"""

from __future__ import annotations

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.structures.beams import _SIGN, _XY, _XZ, Beams, bending_functions, element_coordinates

_AT, _WEIGHT = np.polynomial.legendre.leggauss(6)  # squares of moments are of degree ten
_XI, _W = (1 + _AT) / 2, _WEIGHT / 2
_CUBIC = np.linspace(0.0, 1.0, 4)
_POWERS = np.arange(4)
_COEFFICIENTS = np.linalg.inv(_CUBIC[:, None] ** _POWERS)


def inertia_energy(elements: Beams, nodal: Array, omega2: Array) -> Array:
    """(r,) twice the strain energy [J] that the length of elements adds to vibrations.

    nodal : (E, 12, r) coordinates of the nodes, body axes;  omega2 : (r,) [1/s^2]
    """
    e, line = element_coordinates(elements) @ nodal, elements.line_mass
    turning = line * (elements.gyration**2).sum(axis=1)
    deflections = (
        (e[:, _XY], elements.EIz, elements.shear_y),
        (_SIGN[:, None] * e[:, _XZ], elements.EIy, elements.shear_z),
    )
    found = _along(e[:, [0, 6]], line, elements.EA, elements.length)
    found = found + _along(e[:, [3, 9]], turning, elements.GJ, elements.length)
    for ends, EI, shear in deflections:
        found = found + _across(ends, line, EI, shear, elements.length)
    share = found.sum(axis=0) * omega2
    total: Array = omega2 * share / (1.0 + share)
    return total


def _along(ends: Array, inertia: Array, stiffness: Array, length: Array) -> Array:
    """(E, r) of stretch or twist, from its values at both ends (E, 2, r), for omega^2 of one: the section force is known but
    for its mean, which is zero."""
    first, growth = ends[:, 0, None], (ends[:, 1] - ends[:, 0])[:, None]
    force = first * _XI[:, None] + growth * _XI[:, None] ** 2 / 2
    apart = force - np.tensordot(force, _W, (1, 0))[:, None]
    of_one: Array = np.tensordot(apart**2, _W, (1, 0))
    return (inertia**2 * length**3 / stiffness)[:, None] * of_one


def _across(ends: Array, inertia: Array, EI: Array, shear: Array, length: Array) -> Array:
    """(E, r) of bending in a plane, from deflections and rotations at both ends (E, 4, r), for omega^2 of one: moment and
    shear force are known but for a constant and a linear moment, which make their energy least."""
    w = _COEFFICIENTS @ (bending_functions(length, shear, _CUBIC)[0] @ ends)
    k = _POWERS
    force = -np.einsum("qk,ekr->eqr", _XI[:, None] ** (k + 1) / (k + 1), w)
    moment = -np.einsum("qk,ekr->eqr", _XI[:, None] ** (k + 2) / ((k + 1) * (k + 2)), w)  # over the length
    soft = (shear / 12)[:, None]
    mean, linear = (np.tensordot(moment, _W * of, (1, 0)) for of in (np.ones(_XI.size), _XI - 0.5))
    linear = linear + soft * np.tensordot(force, _W, (1, 0))
    squares = np.tensordot(moment**2, _W, (1, 0)) + soft * np.tensordot(force**2, _W, (1, 0))
    return (inertia**2 * length**5 / EI)[:, None] * (squares - mean**2 - linear**2 / (1 / 12 + soft))
