"""The linearised equations of a machine that turns, between inputs and outputs that do not turn with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_dyn.analyses.efforts import Effort
from ffr_dyn.analyses.linearise import Linearisation, inputs_and_outputs, steady_about
from ffr_dyn.linear.hill import harmonics
from ffr_dyn.linear.matrices import over_turn
from ffr_dyn.linear.steady_state import PHASES, carried
from ffr_dyn.linear.transfer import transfer
from ffr_dyn.linear.turned import OverTurn, Turned, turned
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

LEAST = 1e-6  # of an answer, relative: no rounding
SEVERAL = (
    "bodies turn at several speeds: inputs and outputs that do not turn with them are taken as they are at this moment, and "
    "resonances are where the turning axes have them"
)


def seen_from_ground(
    linear: Linearisation, scene: Scene, inputs: tuple[Effort | str, ...], outputs: tuple[str, ...]
) -> tuple[Linearisation, Turned | None]:
    """The same machine between inputs and outputs as they are over a turn, and the system of its envelopes; as it is, and
    None, where they turn with it, or nothing does."""
    near = linear.near
    steady = steady_about(near, inputs)
    if steady is None or not steady.machine.screws.fastest:
        return linear, None
    screws = steady.machine.screws
    times = 2 * np.pi / screws.fastest * np.arange(PHASES) / PHASES
    at = [replace(near, time=near.time + t, x=carried(near.at.system.layout, screws, near.x, t)) for t in times]
    found = [inputs_and_outputs(one, scene, inputs, outputs) for one in at]
    B, C, D = (harmonics(np.array(one)) for one in zip(*found, strict=True))
    of = OverTurn(over_turn(replace(steady, Z=near.Z), len(B) - 1), B, C, D, screws.fastest)
    if not of.varies:
        return linear, None
    if not screws.rate:
        return replace(linear, notes=(*linear.notes, SEVERAL)), None
    system = turned(of)
    values = np.concatenate([linear.eigenvalues[linear.free :] + 1j * n * of.rate for n in system.numbers])
    names = linear.leading[linear.free :] * len(system.numbers)
    A, B, C, D = system.A, system.B, system.C, system.D
    return replace(linear, A=A, B=B, C=C, D=D, eigenvalues=values, leading=names), system


def beside(of: Turned, frequencies: Array, outputs: Sequence[str]) -> list[str]:
    """Notes on outputs that answer at other frequencies than that of the input."""
    C, D = of.beside
    H = transfer(of.A, of.B, C, D, frequencies, 0).H.reshape(frequencies.size, -1, 2, len(outputs))
    own = np.abs(transfer(of.A, of.B, of.C, of.D, frequencies, 0).H).max(axis=0)
    sides = np.maximum(*(np.abs(H[:, :, 0] + sign * H[:, :, 1]) for sign in (1j, -1j))).max(axis=(0, 1))
    return [
        f"{name} also answers at the frequency of the input plus and minus multiples of {of.rate / (2 * np.pi):.5g} Hz, the "
        f"speed of what turns, {'and not at its own' if o < LEAST * s else f'up to {s / o:.2g} times as much'}"
        for name, o, s in zip(outputs, own, sides, strict=True)
        if s > LEAST * max(o, sides.max())
    ]
