"""Equal four-bars (IFToMM A02): all links align in every half turn, and constraints become dependent there."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.assemble import assemble
from ffr_dyn.analyses.evaluation import (
    Evaluator,
    evaluate,
    evaluated_mass_matrix,
    evaluator,
    moved,
    to_body_axes,
    to_global_axes,
)
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.reference import position_rates
from ffr_dyn.integrators import RK4
from ffr_dyn.joints import Joint
from ffr_dyn.scene import Body, Scene
from ffr_dyn.stability.bodies import GRAVITY, bar
from ffr_dyn.stability.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof

Array = np.ndarray

END, STEP = 1.5, 1e-3  # s
COUNT = 2


def four_bars(count: int) -> Scene:
    """`count` parallelograms side by side, upright, their tops moving at 1 m/s."""
    up = (0.0, 0.0, np.pi / 2)
    standing = [Body(f"s{k}", bar(f"s{k}"), (k, 0, 0), up, omega_bar=(0, 0, -1.0)) for k in range(count + 1)]
    lying = [Body(f"c{k}", bar(f"c{k}"), (k, 1, 0), velocity=(1.0, 0, 0)) for k in range(count)]
    feet = [Joint(f"foot{k}", "revolute", f"ground.f{k}", f"s{k}.a") for k in range(count + 1)]
    left = [Joint(f"left{k}", "revolute", f"s{k}.b", f"c{k}.a") for k in range(count)]
    right = [Joint(f"right{k}", "revolute", f"c{k}.b", f"s{k + 1}.b") for k in range(count)]
    ground = {f"f{k}": (k, 0, 0) for k in range(count + 1)}
    return Scene((*standing, *lying), (*feet, *left, *right), ground=ground, gravity=GRAVITY)


def singular_four_bar() -> Exhibit:
    """The energy of the mechanism through its first singular position, by a plain factorisation and by ours."""
    scene = four_bars(COUNT)
    time, total, pivot = _plainly(scene)
    result = forward(scene, end=END, output_step=5e-3, method=RK4(STEP))
    energy = result["energy.total"]
    when = time[int(np.argmin(pivot))]
    return Exhibit(
        f"Singular positions: {COUNT} equal four-bars",
        "a plain factorisation of Phi_q M^-1 Phi_q^T divides by what vanishes where the links align, and leaves the branch",
        "nearly dependent rows are recognised, constraints held tighter before, and left alone at the position itself",
        (Claim("time of the singular position", _time_of_alignment(COUNT), float(when), 1.01, "s"),),
        (
            Proof("change of energy, plain", float(np.nanmax(np.abs(total - total[0]), initial=0.0)), 1e-2, True, "J"),
            Proof("change of energy, ours", float(np.abs(energy - energy[0]).max()), 1e-5, False, "J"),
        ),
        (
            Panel(
                "least singular value of the rows", "time [s]", "over the largest", (Curve("plain run", time, pivot),),
                (Mark("links align (exact)", _time_of_alignment(COUNT)),), log=(False, True),
            ),
            Panel(
                "energy", "time [s]", "change of energy [J]",
                (
                    Curve("plain factorisation", time, np.maximum(np.abs(total - total[0]), 1e-16)),
                    Curve("ours", result.time, np.maximum(np.abs(energy - energy[0]), 1e-16)),
                ),
                log=(False, True), bounds=(1e-12, 1e6),
            ),
        ),
    )  # fmt: skip


def _time_of_alignment(count: int) -> float:
    """From theta_ddot = c sin(theta) / J, which is the mechanism's motion, by the energy integral; theta from upright."""
    J, c = (count + 1) / 3 + count, 9.81 * ((count + 1) / 2 + count)
    at, weight = np.polynomial.legendre.leggauss(60)
    theta = 0.25 * np.pi * (at + 1)
    return float(0.25 * np.pi * weight @ (1 + 2 * c / J * (1 - np.cos(theta))) ** -0.5)


def _plainly(scene: Scene) -> tuple[Array, Array, Array]:
    """(time, energy, least relative singular value) of RK4 with a solution of the multiplier system as it stands."""
    assembled = assemble(scene)
    at, place = evaluator(assembled.system), assembled.system.layout
    x, v = assembled.x.copy(), assembled.v.copy()
    kept = []

    def slopes(t: float, x: Array, v: Array) -> tuple[Array, Array, float, float]:
        now, M = evaluate(at, t, x, v), evaluated_mass_matrix(at)
        inverse = np.linalg.solve(M, np.column_stack([now.jacobian.T, now.force]))
        S = now.jacobian @ inverse[:, :-1]
        values = np.linalg.svd(S, compute_uv=False)
        lam = np.linalg.solve(S, now.jacobian @ inverse[:, -1] - now.gamma)
        acceleration = inverse[:, -1] - inverse[:, :-1] @ lam
        energy = float(at.record.energy[0].sum())
        return position_rates(place, x, v), to_global_axes(place, x, acceleration), energy, values[-1] / values[0]

    for k in range(round(END / STEP)):
        t = k * STEP
        try:
            a = slopes(t, x, v)
            b = slopes(t + STEP / 2, x + STEP / 2 * a[0], v + STEP / 2 * a[1])
            c = slopes(t + STEP / 2, x + STEP / 2 * b[0], v + STEP / 2 * b[1])
            d = slopes(t + STEP, x + STEP * c[0], v + STEP * c[1])
        except np.linalg.LinAlgError:
            break
        kept.append((t, a[2], a[3]))
        x = x + STEP / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        v = v + STEP / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
        x, v = _projected(at, t + STEP, x, v)
        if not np.isfinite(x).all() or np.abs(v).max() > 1e6:
            break
    time, energy, least = np.array(kept).T
    return time, energy, least


def _projected(at: Evaluator, t: float, x: Array, v: Array) -> tuple[Array, Array]:
    """Two plain Newton steps back onto the constraints, and one of the velocities."""
    place = at.system.layout
    x = moved(place, x, np.zeros(place.v_size))
    for _ in range(2):
        now, M = evaluate(at, t, x, v), evaluated_mass_matrix(at)
        inverse = np.linalg.solve(M, now.jacobian.T)
        S = now.jacobian @ inverse
        x = moved(place, x, -inverse @ np.linalg.solve(S, now.Phi))
    now = evaluate(at, t, x, v)
    u = to_body_axes(place, x, v) - inverse @ np.linalg.solve(S, now.nu)
    return x, to_global_axes(place, x, u)
