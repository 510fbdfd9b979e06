"""An implicit method on index-3 equations, its matrix and itself, against the step, with and without scaling.

Newton's method on positions and multipliers has [[M / (beta h^2) + ..., Phi_q^T], [Phi_q, 0]]: its condition number grows as
h^-4, and rounding in the multipliers as h^-2. With the multipliers and the dynamic equations scaled by beta h^2 the step
vanishes from the leading terms (Bottasso, Dopico & Trainelli, Multibody System Dynamics 19 (2008) 3-20). Generalised-alpha is
run in both ways, and compared with an explicit method on index-1 equations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluate, evaluated_mass_matrix, evaluator
from ffr_dyn.integrators import RK4, GeneralisedAlpha
from ffr_dyn.scene.scene import Scene
from ffr_gallery.bodies import beam, pendulum, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_prep.common.arrays import Array

BETA = 0.25
SMALL = 1e-6  # s
STEPS = 50
SLOPE = -0.7  # rad, of the links at the start: no coordinate is a round number
BROKEN = 1.0  # m, what stands for a run that fails


def matrices(scaled: bool, h: float, M: Array, K: Array, J: Array) -> Array:
    """The iteration matrix of a step h."""
    lead, rows = M + BETA * h**2 * K, J.shape[0]
    upper = lead if scaled else lead / (BETA * h**2)
    return np.block([[upper, J.T], [J, np.zeros((rows, rows))]])


def links(bending: float) -> Scene:
    """Two flexible links in a row, sloping."""
    scene = pendulum(*(beam(f"link{k}", 1.0, 1.0, bending, 3) for k in range(2)))
    along = np.array([np.cos(SLOPE), np.sin(SLOPE), 0.0])
    bodies = (replace(b, position=tuple(b.position[0] * along), rotation=(0, 0, SLOPE)) for b in scene.bodies)
    return replace(scene, bodies=tuple(bodies))


def error(scene: Scene, h: float, scaled: bool) -> tuple[float, float]:
    """Of the tip [m] and of the reaction of the first hinge (relative), after some steps of generalised-alpha."""
    outputs, end = ("link1.b.position", "hinge0.force"), STEPS * h
    true = integrate(scene, end=end, output_step=end, method=RK4(h / 10), outputs=outputs)
    found = tried(scene, end=end, output_step=end, method=GeneralisedAlpha(h, scaled=scaled), outputs=outputs)
    if found is None:
        return BROKEN, BROKEN
    tip, reaction = (np.abs(found[name][-1] - true[name][-1]).max() for name in outputs)
    return float(tip), float(reaction / np.abs(true["hinge0.force"][-1]).max())


def index3_conditioning() -> Exhibit:
    """Two flexible links."""
    scene = links(0.01)
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
    small, stiff = np.geomspace(1e-7, 1e-3, 9), links(100.0)
    run = {s: np.array([error(stiff, h, s) for h in small]) for s in (False, True)}
    own = {s: error(stiff, SMALL, s) for s in (False, True)}
    return Exhibit(
        "Conditioning of index-3 equations at small steps",
        "unscaled, the iteration matrix is singular to rounding at small steps: Newton stalls, multipliers are noise",
        "multipliers and dynamic equations scaled by beta h^2: the condition does not depend on the step",
        (Claim("power of h with which the condition number grows", -4.0, float(slope), 1.1),),
        (
            Proof(f"condition number unscaled at h = {SMALL:g} s", at_small[False], 1e16, True),
            Proof(f"condition number scaled at h = {SMALL:g} s", at_small[True], 1e6, False),
            Proof(f"generalised-alpha unscaled, h = {SMALL:g} s: tip off by (1: it stops)", own[False][0], 0.1, True, "m"),
            Proof(f"generalised-alpha scaled, h = {SMALL:g} s: tip off by", own[True][0], 1e-12, False, "m"),
            Proof(f"generalised-alpha scaled, h = {SMALL:g} s: a reaction off by (relative)", own[True][1], 1e-8, False),
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
            Panel(
                f"generalised-alpha, {STEPS} steps", "step [s]", "error (1: the run stops)",
                (
                    Curve("tip [m], unscaled", small, np.maximum(run[False][:, 0], 1e-16), points=True),
                    Curve("tip [m], scaled", small, np.maximum(run[True][:, 0], 1e-16)),
                    Curve("reaction, relative, scaled", small, np.maximum(run[True][:, 1], 1e-16)),
                ),
                log=(True, True),
            ),
        ),
    )  # fmt: skip
