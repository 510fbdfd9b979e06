"""Baumgarte's gains: too large ones make an explicit method unstable, small ones hold little."""

from __future__ import annotations

import numpy as np

from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Baumgarte, Projection, Stabilisation
from ffr_gallery.bodies import bar, pendulum, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary

RK4_REAL = 2.785293563405282  # where the stability function of RK4 is 1 on the negative real axis
STEP, END = 5e-3, 5.0  # s
BROKEN = 1e-2  # m


def baumgarte() -> Exhibit:
    """Critically damped, Phi_ddot + 2 alpha Phi_dot + alpha^2 Phi = 0 has the double root -alpha."""
    scene = pendulum(bar("upper"), bar("lower"))

    def violation(keep: Stabilisation) -> float:
        result = tried(
            scene, end=END, output_step=0.05, method=RK4(STEP), stabilisation=keep, outputs=("constraint.*",)
        )
        return np.inf if result is None else float(np.nan_to_num(result["constraint.position"], nan=np.inf).max())

    predicted = RK4_REAL / STEP
    measured = boundary(lambda alpha: violation(Baumgarte(alpha, alpha)) < BROKEN, 0.1 * predicted, 3 * predicted)
    gains = np.geomspace(0.1, 1.3 * predicted, 30)
    found = np.array([min(violation(Baumgarte(a, a)), 1e3) for a in gains])
    projected = violation(Projection())
    best = float(found.min())
    return Exhibit(
        "Baumgarte's gains",
        "gains beyond 2.785 / h (RK4) blow up; small ones let the constraints be left",
        "projection has no gains to choose; or alpha = beta about 0.1 / h",
        (Claim("largest alpha = beta", predicted, measured, 1.08, "1/s"),),
        (
            Proof("violation with a gain 10 % beyond the limit", violation(Baumgarte(*[1.1 * predicted] * 2)), BROKEN, True),
            Proof("violation with a gain of 0.1 1/s", float(found[0]), 1e-6, True, "m"),
            Proof("violation with alpha = beta = 0.1 / h", violation(Baumgarte(0.1 / STEP, 0.1 / STEP)), 1e-6, False, "m"),
            Proof("violation with projection", projected, 1e-6, False, "m"),
        ),
        (
            Panel(
                f"double pendulum, RK4, h = {STEP:g} s, best gain leaves {best:.0e} m",
                "alpha = beta [1/s]", "largest violation [m]",
                (Curve("Baumgarte", gains, found, points=True), Curve("projection", gains, np.full(30, projected))),
                (Mark("predicted 2.785 / h", predicted), Mark("measured", measured, measured=True)),
                log=(True, True), bounds=(1e-12, 10),
            ),
        ),
    )  # fmt: skip
