"""Vibrations of a scene: those that a step does not resolve, how long they last, and by which ratio bodies damp them.

By the modes of the scene as it stands at its start, its bodies coupled by the joints and driven as they are: with Z the free
motions, Z^T M Z = 1, those of Z^T Omega^2 Z. What else holds the scene, such as springs and gravity, is slow beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import evaluate, evaluator, free_motions, total_mass_matrix
from ffr_dyn.equations.inertia import damping_matrix
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Body
from ffr_prep.common.arrays import Array

UNRESOLVED = 2.0  # h omega
_LESS = 0.25  # of a damping ratio that a scene gives, below which the one that comes of it is told; between hinges it is 0.43


@dataclass(frozen=True, eq=False)
class Vibrations:
    """Of a scene at its start: omega (k,) [rad/s], ascending, damping ratios (k,), and motions (V, k) of unit mass."""

    assembled: Assembled
    omega: Array
    ratio: Array
    motions: Array


def vibrations(assembled: Assembled, time: float) -> Vibrations:
    """Raises ComputationError as an evaluation does."""
    system = assembled.system
    scene, place = system.scene, system.layout
    if not any(place.n):
        return Vibrations(assembled, np.zeros(0), np.zeros(0), np.zeros((place.v_size, 0)))
    now = evaluate(evaluator(system), time, assembled.x, assembled.v)
    Z = free_motions(now.jacobian, total_mass_matrix(scene, place, assembled.x))
    square = np.zeros(place.v_size)
    for b, body in enumerate(scene.bodies):
        square[place.q_dot(b)] = body.model.omega2
    omega2, vectors = scipy.linalg.eigh(Z.T @ (square[:, None] * Z))
    bent = omega2 > 1e-9 * omega2.max(initial=0.0)
    omega, motions = np.sqrt(omega2[bent]), Z @ vectors[:, bent]
    lost = np.zeros(omega.size)
    for b, body in enumerate(scene.bodies):  # one by one, as damping does not couple them
        own = motions[place.q_dot(b)]
        lost += np.sum(own * (damping_matrix(body.model, body.damping) @ own), axis=0)
    return Vibrations(assembled, omega, lost / (2.0 * omega), motions)


def lasting(of: Vibrations, step: float) -> float:
    """The share that damping leaves, after a step of h [s], of the slowest vibration that such steps do not resolve:
    exp(-zeta h omega), with the smallest damping ratio of them. 1 where there is none."""
    beyond = of.omega * step > UNRESOLVED
    if not beyond.any():
        return 1.0
    return float(np.exp(-of.ratio[beyond].min() * of.omega[beyond].min() * step))


def damped_less(of: Vibrations) -> list[str]:
    """Notes on bodies whose ratios, those of the modes of the free body, damp their slowest vibration here by far less.

    A vibration that joints hold is slow beside the free modes that it is made of, which lose sum 2 zeta omega_i q_i'^2 of
    power: of unit mass it has the ratio zeta sum omega_i q_i^2 / omega, 0.07 zeta of a clamped beam.
    """
    place, told = of.assembled.system.layout, []
    for b, body in enumerate(of.assembled.system.scene.bodies):
        if body.frame is None or body.part_of or not body.damping.any():
            continue
        asked, found = float(body.damping[np.argmin(body.model.omega2)]), _slowest(of, body, place.q_dot(b))
        if found and found[1] < _LESS * asked:
            told.append(
                f"body {body.name!r}: its damping ratio {asked:.3g} belongs to the modes of the free body; its slowest "
                f"vibration here, {found[0] / (2 * np.pi):.4g} Hz, has {found[1]:.2g}. For {asked:.3g} as its reference "
                f"conditions hold it, give damping_bands = [[1000, {asked:.3g}]] in its place, or "
                f"fp.damped(body, ratios=[{asked:.3g}])"
            )
    return told


def _slowest(of: Vibrations, body: Body, rows: slice) -> tuple[float, float] | None:
    """[rad/s] and damping ratio, by the ratios of the scene, of the slowest vibration that strains a body most; None where
    others lead in all."""
    own, rates = of.motions[rows], np.sqrt(body.model.omega2)
    strained = (rates**2) @ own**2
    leads = np.flatnonzero(strained > 0.5 * of.omega**2)
    if not leads.size:
        return None
    k = leads[0]
    return float(of.omega[k]), float((body.damping * rates) @ own[:, k] ** 2 * of.omega[k] / strained[k])


def leading(of: Vibrations, run: Result, twin: Result) -> float:
    """[rad/s] of the vibration in which two runs differ most, by its velocity; 0 where they do not keep all "*.q"."""
    place, bodies = of.assembled.system.layout, of.assembled.system.scene.bodies
    flexible = [b for b in range(len(bodies)) if place.n[b]]
    if not of.omega.size or any(f"{bodies[b].name}.q" not in run.quantities for b in flexible):
        return 0.0
    shapes, differences = [], []
    for b in flexible:
        body, own = bodies[b], of.motions[place.q_dot(b)]
        q, other = run[f"{body.name}.q"], twin[f"{body.name}.q"]
        rows = min(len(q), len(other))  # an event may have ended one of them
        off = q[:rows] - other[:rows]
        shapes.append(body.frame.C @ own if body.frame else own)
        differences.append(off if body.frame or not body.kept else off[:, list(body.kept[0])])
    amounts = np.linalg.lstsq(np.concatenate(shapes), np.concatenate(differences, axis=1).T, rcond=None)[0]
    return float(of.omega[int(np.argmax(of.omega * np.abs(amounts).max(axis=1)))])
