"""Where a motion strains the theory it was computed with: linear elasticity, and no geometric stiffening.

Both are looked at along the run and told at its end; a run stops for a deformation that means nothing any more.
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.kernels.tables import Record
from ffr_dyn.results.recorded_motion import shaped
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array

MEANINGLESS = 100.0  # elastic rotation [rad]
STRAINED = 0.1  # elastic rotation [rad] beyond which linear elasticity in the moving frame is doubtful
STRETCHED = 0.1  # elastic displacement of an interface over the size of its body, beyond which the same holds
# Share of the first frequency that a body may spin at without geometric stiffening. The frequencies of a blade are then off
# by about half its square; a pendulum and a slider-crank with 0.08 and 0.09 were off by 1 mm in 1.2 m after 0.5 s and by
# 21 % of the deflection.
SPINNING = 0.03


def extremes(system: System, record: Record) -> Array:
    """(3, B) of each body: the largest elastic rotation [rad] at an interface, the largest angular velocity [rad/s], the
    largest elastic displacement of an interface over the size of the body."""
    turns, spins, stretches = [], [], []
    for b, body in enumerate(system.scene.bodies):
        q, omega = record.x[:, system.layout.q(b)], record.v[:, system.layout.omega(b)]
        turns.append(max((np.abs(shaped(i.phi_r, q)).max(initial=0.0) for i in body.model.interfaces), default=0.0))
        spins.append(np.sqrt((omega**2).sum(axis=1)).max(initial=0.0))
        stretches.append(stretch(body.model, q))
    return np.array([turns, spins, stretches])


def stretch(model: FlexibleBody, q: Array) -> float:
    """The largest elastic displacement of an interface, q (T, n), over the size of the body; zero for a point."""
    if not model.size > 0:
        return 0.0
    moved = (np.linalg.norm(shaped(i.phi_t, q), axis=-1).max(initial=0.0) for i in model.interfaces)
    return float(max(moved, default=0.0) / model.size)


def meaningless(scene: Scene, found: Array) -> str:
    """Why a run with these extremes (3, B) tells nothing any more; empty where it does."""
    b = int(np.argmax(found[0]))
    if not found[0, b] > MEANINGLESS:
        return ""
    doubt = " ".join(unstiffened(scene, found[1])[:1]) or "A load or a spring may be far too large, or negative."
    return (
        f"body {scene.bodies[b].name!r} has turned within itself by {found[0, b]:.3g} rad, which linear elasticity says "
        f"nothing about: its motion diverges. {doubt}"
    )


def doubts(scene: Scene, found: Array) -> list[str]:
    """Notes on bodies that a run with these extremes (3, B) takes beyond its theory."""
    turned, spun, stretched = found
    return [*strained(scene, turned, stretched), *unstiffened(scene, spun)]


def strained(scene: Scene, turned: Array, stretched: Array) -> list[str]:
    """Bodies that deform too much for linear elasticity; turned (B,) [rad], stretched (B,) of the body's size."""
    notes = [
        f"body {body.name!r} turns within itself by up to {turn:.2g} rad: linear elasticity in its moving frame is "
        "strained beyond about 0.1 rad; split the body into several or expect errors of that order squared"
        for body, turn in zip(scene.bodies, turned, strict=True)
        if turn > STRAINED
    ]
    return notes + [
        f"body {body.name!r} deforms by up to {share:.2g} of its size: linear elasticity is strained beyond about "
        f"{STRETCHED:g}; check its material and its loads, or split it into several"
        for body, turn, share in zip(scene.bodies, turned, stretched, strict=True)
        if share > STRETCHED and not turn > STRAINED
    ]


def unstiffened(scene: Scene, spun: Array) -> list[str]:
    """Bodies without geometric stiffening that spin near their first frequency; spun (B,) [rad/s]."""
    notes = []
    for body, spin in zip(scene.bodies, spun, strict=True):
        share = spin / _first(body) if body.model.n and not _stiffened(body) else 0.0
        if share > SPINNING:
            notes.append(
                f"body {body.name!r} spins at up to {spin:.4g} rad/s, {share:.2g} of its first frequency, without geometric "
                f"stiffening: its frequencies are off by up to {50 * share**2:.2g} %"
                f"{', and its computed motion may diverge' if share > 1 else ''}; reduce it with --stiffening"
            )
    return notes


def _first(body: Body) -> float:
    return float(np.sqrt(body.model.omega2.min())) or np.inf


def _stiffened(body: Body) -> bool:
    return body.model.stiffening is not None and body.stiffening
