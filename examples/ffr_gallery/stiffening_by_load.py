"""Geometric stiffening by load is a fixed point between accelerations and stiffness, and diverges where it should help."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof, boundary
from ffr_prep.common.arrays import Array

LENGTH, MODES = 1.0, 8
SWEEPS = 60  # of which the last ten show whether they grow
ROD = beam("rod", LENGTH, 1.0, 100.0, MODES)
LINEAR = Body("rod", ROD, stiffening=False)


def bent(deflection: float) -> Array:
    """(n,) a bend in the first mode, by the deflection of the tip [m]."""
    q = np.zeros(MODES)
    q[0] = deflection / ROD.interface("b").phi_t[1, 0]
    return q


def feedback(deflection: float) -> Array:
    """(6 + n, 6 + n) what a sweep does to accelerations (R, alpha, q) of the free beam, its frame at the root:
    -M^-1 K_sigma(acceleration along x) q."""
    q = bent(deflection)
    assert ROD.stiffening is not None
    Q = np.zeros((6 + MODES, 6 + MODES))
    Q[6:, 0] = -ROD.stiffening[0] @ q
    return np.linalg.solve(mass_matrix(kept_integrals(LINEAR), q), Q)


def changes(deflection: float) -> Array:
    """(SWEEPS,) by how much a sweep changes the accelerations, over the first change."""
    B, a = feedback(deflection), np.zeros(6 + MODES)
    first = np.linalg.solve(
        mass_matrix(kept_integrals(LINEAR), bent(deflection)), np.append(np.zeros(6), -ROD.omega2 * bent(deflection))
    )
    sizes = []
    for _ in range(SWEEPS):
        before, a = a, first + B @ a
        sizes.append(float(np.linalg.norm(a - before)))
    return np.array(sizes) / sizes[0]


def stiffening_by_load() -> Exhibit:
    """The deflection from which sweeps diverge, and the beam that moves by one Lagrangian beyond it."""
    predicted = float(brentq(lambda w: np.abs(np.linalg.eigvals(feedback(w))).max() - 1.0, 1e-3, 0.3))
    measured = boundary(lambda w: changes(w)[-1] <= changes(w)[-10], 0.2 * predicted, 5 * predicted, 20)
    free = Scene((Body("rod", ROD, q=bent(3 * predicted)),), plane="z")
    result = tried(free, end=1.0, output_step=1e-2, method=RK4(1e-5))
    total = np.full(2, np.inf) if result is None else result["energy.total"]
    return Exhibit(
        "Geometric stiffening by load",
        "stiffness by the load of accelerations that depend on it: sweeps diverge, the sooner the more the body is bent",
        "a displacement of second order in one Lagrangian: a symmetric mass matrix, no sweeps, energy that is kept",
        (Claim("deflection from which the sweeps diverge", predicted, measured, 1.01, "m"),),
        (
            Proof(
                f"change in the last of {SWEEPS} sweeps over the first, at three times that",
                float(changes(3 * predicted)[-1]),
                100.0,
                True,
            ),
            Proof(
                "energy of the beam of second order, change in 1 s at three times that",
                float(np.ptp(total) / total[0]),
                1e-2,
                False,
            ),
        ),
        (
            Panel(
                f"a free beam, frame at its end, {MODES} modes",
                "sweep",
                "change of accelerations over the first",
                tuple(
                    Curve(f"deflection {share:g} of the limit", np.arange(1, SWEEPS + 1), changes(share * predicted))
                    for share in (0.3, 0.8, 1.2, 3.0)
                ),
                log=(False, True),
                bounds=(1e-16, 1e20),
            ),
        ),
    )
