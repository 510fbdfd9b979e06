"""Geometric stiffening of plates: buckling, rotating strips, agreement with beams."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from boxes import rotation

import ffr_prep as fp
from ffr_prep.body import FlexibleBody
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.element_families import families
from ffr_prep.structures.frame import Frame, Shell, panel, triangulated
from ffr_prep.structures.model import assemble_frame, element_values
from ffr_prep.structures.plate_stiffening import of_membrane_forces, shape_gradient
from ffr_prep.structures.plates import element_coordinates, plates

STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
CUT = pytest.mark.parametrize("cut", [triangulated, lambda frame: frame], ids=["triangles", "quadrilaterals"])
TENSION = 12 + 6  # a force along x at the second interface
ACROSS = 3 + 3 + 2  # the product of the angular velocity about z with itself


@CUT
@pytest.mark.parametrize(
    ("forces", "factor", "elements"),
    [((-1.0, 0, 0), 4.0, (6, 12)), ((-1.0, -1.0, 0), 2.0, (6, 12)), ((0, 0, 1.0), 9.324, (8, 16))],
    ids=["along one side", "along both", "shear"],
)
def test_buckling_of_a_simply_supported_square_plate(forces, factor, elements, cut):
    """N = k pi^2 D/b^2 with k = 4, 2 and, in shear, 9.34 by Ritz, 9.324 by more terms.

    S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability (1961), sections 9.2 and 9.7.
    """

    def critical(count):
        frame = cut(panel([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], Shell(0.004, STEEL), elements=(count, count)))
        free = np.flatnonzero(~simply_supported(frame).ravel())
        part = families(frame)[0]
        made = plates(frame.points[part.nodes], [frame.shells[0]] * len(part.nodes))
        q = np.eye(6 * len(frame.points))[:, free]
        e = element_coordinates(made) @ element_values(part, q)
        tensor = np.array([(forces[0], forces[2]), (forces[2], forces[1])])
        in_element_axes = made.C[:, :2, :2].transpose(0, 2, 1) @ tensor @ made.C[:, :2, :2]
        K_sigma = of_membrane_forces(*shape_gradient(made, e), in_element_axes[:, None, [0, 1, 0], [0, 1, 1]])
        K = assemble_frame(frame, [part]).K[free][:, free].toarray()
        return 1 / scipy.linalg.eigvalsh(-K_sigma, K).max()

    D = STEEL.E * 0.004**3 / 12 / (1 - STEEL.nu**2)
    coarse, fine = (critical(count) / (np.pi**2 * D) for count in elements)
    assert fine == pytest.approx(factor, rel=0.035)
    assert (4 * fine - coarse) / 3 == pytest.approx(factor, rel=0.005)


def simply_supported(frame: Frame) -> np.ndarray:
    """(N, 6) held coordinates: everything in the plane, deflection and slope along the edges of the unit square."""
    x, y, _ = frame.points.T
    on_x, on_y = (x < 1e-9) | (x > 1 - 1e-9), (y < 1e-9) | (y > 1 - 1e-9)
    held = np.zeros((len(x), 6), bool)
    held[:, [0, 1, 5]] = True
    held[on_x, 3], held[on_y, 4], held[on_x | on_y, 2] = True, True, True
    return held


def strip(cut, modes: int, *, turned=None, elements=(24, 1), material=None, width=0.02) -> FlexibleBody:
    """A cantilever strip along x, 1 m long and 4 mm thick, with interfaces over its end edges; no lateral contraction."""
    R = np.eye(3) if turned is None else turned
    material = material or Material("strip", 2.1e11, 0.0, 7850.0)
    corners = np.array([(0, -width / 2, 0), (1, -width / 2, 0), (1, width / 2, 0), (0, width / 2, 0)]) @ R.T
    frame = cut(panel(corners, Shell(0.004, material, gyration=0.0), elements=elements))
    x = frame.points @ R[:, 0]
    frame = replace(frame, node_groups={"root": np.flatnonzero(x < 1e-9), "tip": np.flatnonzero(x > 1 - 1e-9)})
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")]),
        fp.Request(name="strip", reference=FixedTo("root"), reduction=CraigBampton(modes)),
    )


@CUT
@pytest.mark.parametrize("turned", [None, rotation(2)], ids=["along-x", "turned"])
def test_buckling_of_a_strip(turned, cut):
    """Euler's cantilever: P = pi^2 E I/(4 L^2)."""
    R = np.eye(3) if turned is None else turned
    body = strip(cut, 6, turned=turned)
    tension = np.tensordot(R[:, 0], body.stiffening[TENSION : TENSION + 3], 1)
    critical = 1 / scipy.linalg.eigvalsh(tension, np.diag(body.omega2)).max()
    assert critical == pytest.approx(np.pi**2 / 4 * 2.1e11 * 0.02 * 0.004**3 / 12, rel=2e-3)


@CUT
@pytest.mark.parametrize(
    ("eta", "mu"), [(0, 3.5160152685), (1, 3.6816468140), (3, 4.7972785324), (6, 7.3603730193), (10, 11.202327762)]
)
def test_rotating_strip(eta, mu, cut):
    """First flap frequency in sqrt(E I/(rho A L^4)) of a strip that turns about z at the speed eta.

    Rotating beam, independent series solution, agrees with Wright, Smith, Thresher & Wang, J. Appl. Mech. 49 (1982)
    197-202.
    """
    body = strip(cut, 20)
    unit = 2.1e11 * 0.004**2 / 12 / 7850
    centrifugal = body.stiffening[ACROSS] - body.PP_dm[0, 0] - body.PP_dm[1, 1]
    values, vectors = scipy.linalg.eigh(np.diag(body.omega2) + eta**2 * unit * centrifugal)
    flap = np.einsum("im,ij,jm->m", vectors, body.PP_dm[2, 2], vectors) > 0.5
    assert np.sqrt(values[flap][0] / unit) == pytest.approx(mu, rel=2e-3)


@pytest.mark.slow
@CUT
def test_rotating_strip_in_its_plane(cut):
    """A strip that turns about the normal of its plane lags: mu_lag^2 = mu_flap^2 - eta^2 of the beam (see above)."""
    body = strip(cut, 12, elements=(100, 4), width=0.02)
    unit, eta, mu = 2.1e11 * 0.02**2 / 12 / 7850, 3.0, 4.7972785324
    centrifugal = body.stiffening[ACROSS] - body.PP_dm[0, 0] - body.PP_dm[1, 1]
    values, vectors = scipy.linalg.eigh(np.diag(body.omega2) + eta**2 * unit * centrifugal)
    lag = np.einsum("im,ij,jm->m", vectors, body.PP_dm[1, 1], vectors) > 0.5
    at_rest = body.omega2[body.PP_dm[1, 1].diagonal() > 0.5][0]
    growth = (mu**2 - eta**2 - 3.5160152685**2) * unit
    assert values[lag][0] - at_rest == pytest.approx(growth, rel=0.02)
