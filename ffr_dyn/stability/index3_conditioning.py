"""The matrix of an implicit method on index-3 equations, against the step, with and without scaling.

Newton's method on positions and multipliers has [[M / (beta h^2) + ..., Phi_q^T], [Phi_q, 0]]: its condition number grows as
h^-4, and rounding in the multipliers as h^-2. With the multipliers and the dynamic equations scaled by beta h^2 the step
vanishes from the leading terms (Bottasso, Dopico & Trainelli, Multibody System Dynamics 19 (2008) 3-20).
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.assemble import assemble
from ffr_dyn.analyses.evaluation import evaluate, evaluated_mass_matrix, evaluator
from ffr_dyn.stability.bodies import beam, pendulum
from ffr_dyn.stability.exhibit import Claim, Curve, Exhibit, Panel, Proof

Array = np.ndarray

BETA = 0.25
SMALL = 1e-6  # s


def matrices(scaled: bool, h: float, M: Array, K: Array, J: Array) -> Array:
    """The iteration matrix of a step h."""
    lead, rows = M + BETA * h**2 * K, J.shape[0]
    upper = lead if scaled else lead / (BETA * h**2)
    return np.block([[upper, J.T], [J, np.zeros((rows, rows))]])


def index3_conditioning() -> Exhibit:
    """Two flexible links."""
    scene = pendulum(*(beam(f"link{k}", 1.0, 1.0, 0.01, 3) for k in range(2)))
    assembled = assemble(scene)
    at, place = evaluator(assembled.system), assembled.system.layout
    J = evaluate(at, 0.0, assembled.x, assembled.v).jacobian
    M, K = evaluated_mass_matrix(at), np.zeros((place.v_size, place.v_size))
    for b, body in enumerate(assembled.system.scene.bodies):
        K[place.q_dot(b), place.q_dot(b)] = np.diag(body.model.omega2)
    steps = np.geomspace(1e-7, 1e-2, 30)
    found = {s: np.array([np.linalg.cond(matrices(s, h, M, K, J)) for h in steps]) for s in (False, True)}
    middle = found[False] < 1e14  # beyond that rounding is in the number itself
    slope = np.polyfit(np.log(steps[middle]), np.log(found[False][middle]), 1)[0]
    at_small = {s: float(np.linalg.cond(matrices(s, SMALL, M, K, J))) for s in (False, True)}
    return Exhibit(
        "Conditioning of index-3 equations at small steps",
        "unscaled, the iteration matrix is singular to rounding at small steps: Newton stalls, multipliers are noise",
        "multipliers and dynamic equations scaled by beta h^2: the condition does not depend on the step",
        (Claim("power of h with which the condition number grows", -4.0, float(slope), 1.1),),
        (
            Proof(f"condition number unscaled at h = {SMALL:g} s", at_small[False], 1e16, True),
            Proof(f"condition number scaled at h = {SMALL:g} s", at_small[True], 1e6, False),
        ),
        (
            Panel(
                "two flexible links", "step [s]", "condition number",
                (
                    Curve("unscaled", steps, found[False], points=True),
                    Curve("h^-4", steps, found[False][-1] * (steps / steps[-1]) ** -4),
                    Curve("scaled", steps, found[True], points=True),
                ),
                log=(True, True), bounds=(1, 1e26),
            ),
        ),
    )  # fmt: skip
