"""The effect of a deformation on vibrations beyond the second order of a body: told, since no body has it.

A body that is bent by q, with the strain energy E, and turned within itself by theta in a vibration, keeps of E what lies in
planes that do not turn along: an energy of E theta^2, which is of fourth order, and of w^2 of a vibration with |y| = 1 the
share 2 E theta^2 / w^2. Much of it is missing where a body is much stiffer one way than the other: a swept blade of 25 mm by
2 mm whose turning bends it by 0.01 rad the stiff way is off by 3e-3 of its second frequency. In N parts it is a part N^-1.3
of that, or less, as measured on that blade. (Hodges & Dowell, NASA TN D-7818, 1974: flap and twist of bent blades.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.consistency.validity import deflections, stiffened
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

TOLD, SLOWEST = 1e-3, 12  # of a frequency, of so many vibrations
BY_PARTS = 1.3  # power of the number of parts by which it falls, at least


@dataclass(frozen=True)
class Prestrained:
    """The share of the frequency of a mode that may be missing, with the body and how many parts it has now."""

    share: float = 0.0
    mode: int = 0
    body: str = ""
    parts: int = 1


def prestrained(scene: Scene, place: Layout, x: Array, values: Array, modes: Array) -> Prestrained:
    """The worst of the slowest vibrations among modes (V, m) with |y|_M = 1 and eigenvalues (m,) about positions x (X,)."""
    rates = np.abs(values)
    slow = rates <= np.sort(rates[values.imag > 0])[:SLOWEST].max(initial=0.0)
    missing, strain, counts = dict[str, Array](), np.zeros(values.size), dict[str, int]()
    for b, body in enumerate(scene.bodies):
        q, motion = x[place.q(b)], modes[place.q_dot(b)]
        strain += body.model.omega2 @ np.abs(motion) ** 2
        if stiffened(body):
            energy = 0.5 * q @ (body.model.omega2 * q)
            turned = np.array([deflections(body.model, np.array([one.real, one.imag]))[0] for one in motion.T])
            name = owner(body)
            missing[name] = missing.get(name, 0.0) + energy * turned**2
            counts[name] = len(body.part_of.model.parts) if body.part_of else 1
    worst = Prestrained()
    for name, energies in missing.items():
        shares = slow * energies / np.maximum(np.maximum(rates**2, strain), 1e-300)
        if shares.max(initial=0.0) > worst.share:
            worst = Prestrained(float(shares.max()), int(np.argmax(shares)), name, counts[name])
    return worst


def told(found: Prestrained, mode: str) -> list[str]:
    """A note, with the name of the mode, where so much is missing."""
    if found.share <= TOLD:
        return []
    enough = int(np.ceil(found.parts * (found.share / TOLD) ** (1 / BY_PARTS)))
    return [
        f"body {found.body!r} is deformed so that vibrations turn its bent shape along; of the frequency of {mode!r} up to "
        f"{found.share:.1g} may be missing, which is beyond second order; {enough} parts would do (ffr-prep reduce --parts)"
    ]
