"""The linearised equations of a machine that turns, between inputs and outputs that do not turn with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.analyses.efforts import Effort
from ffr_dyn.analyses.linearise import Linearisation, inputs_and_outputs, steady_about
from ffr_dyn.linear.hill import harmonics
from ffr_dyn.linear.matrices import over_turn
from ffr_dyn.linear.steady_state import PHASES, carried
from ffr_dyn.linear.transfer import receptances
from ffr_dyn.linear.turned import OverTurn, turned
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

TOLD = 1e-4  # of answers that more harmonics would change, relative
CUT = (
    "what turns and its supports change so much with the angle that more harmonics than there is room for change the "
    "answers, by {:.2g} of the largest: take bodies with fewer modes"
)
LEAST = 1e-6  # of an answer, relative: no rounding
MOMENT = "inputs or supports change with the angle of what turns: they are taken as they are at this moment"
SEVERAL = (
    "bodies turn at several speeds: inputs and outputs that do not turn with them are taken as they are at this moment, and "
    "resonances are where the turning axes have them"
)


@dataclass(frozen=True)
class Sides:
    """What outputs answer at the frequency of the input plus and minus 1 ... H times the rate [rad/s] of what turns: rows
    C (2 H O, S), D (2 H O, P), of each multiple the real parts of all outputs, then the imaginary ones."""

    C: Array
    D: Array
    rate: float


def seen_from_ground(
    linear: Linearisation, scene: Scene, inputs: tuple[Effort | str, ...], outputs: tuple[str, ...]
) -> tuple[Linearisation, Sides | None]:
    """The same machine between inputs and outputs as they are over a turn, and what they answer beside; as it is, and None,
    where they turn with it, or nothing does."""
    of, one_speed = _over_turn(linear, scene, inputs, outputs)
    if of is None:
        return linear, None
    if not one_speed:
        return replace(linear, notes=(*linear.notes, SEVERAL)), None
    system = turned(of)
    values = np.concatenate([linear.eigenvalues[linear.free :] + 1j * n * of.rate for n in system.numbers])
    names = linear.leading[linear.free :] * len(system.numbers)
    A, B, C, D = system.A, system.B, system.C, system.D
    if system.left > TOLD:
        linear = replace(linear, notes=(*linear.notes, CUT.format(system.left)))
    return replace(linear, A=A, B=B, C=C, D=D, eigenvalues=values, leading=names), Sides(*system.beside, of.rate)


def outputs_over_turn(
    linear: Linearisation, scene: Scene, inputs: tuple[Effort | str, ...], outputs: tuple[str, ...]
) -> tuple[Linearisation, Sides | None]:
    """The same machine under an input that turns with it, its outputs as they are over a turn, and what they answer
    beside."""
    of, one_speed = _over_turn(linear, scene, inputs, outputs)
    if of is None:
        return linear, None
    if not one_speed or not of.input_turns:
        return replace(linear, notes=(*linear.notes, MOMENT)), None
    sides, through = (np.concatenate([part for k in one[1:] for part in (k.real, k.imag)]) for one in (of.C, of.D))
    return replace(linear, C=of.C[0].real, D=of.D[0].real), Sides(sides, through, of.rate)


def _over_turn(
    linear: Linearisation, scene: Scene, inputs: tuple[Effort | str, ...], outputs: tuple[str, ...]
) -> tuple[OverTurn | None, bool]:
    """A, B, C, D by their harmonics, None where they do not vary; and whether all that turns has one speed."""
    near = linear.near
    steady = steady_about(near, inputs)
    if steady is None or not steady.machine.screws.fastest:
        return None, True
    screws = steady.machine.screws
    times = 2 * np.pi / screws.fastest * np.arange(PHASES) / PHASES
    at = [replace(near, time=near.time + t, x=carried(near.at.system.layout, screws, near.x, t)) for t in times]
    found = [inputs_and_outputs(one, scene, inputs, outputs) for one in at]
    B, C, D = (harmonics(np.array(one)) for one in zip(*found, strict=True))
    of = OverTurn(over_turn(replace(steady, Z=near.Z), len(B) - 1), B, C, D, screws.fastest)
    return (of if of.varies else None), bool(screws.rate)


def poles(linear: Linearisation, sides: Sides | None) -> Array:
    """Eigenvalues without rounding, with those of free motions, which the ground sees at multiples of the speed."""
    if sides is None or not linear.free:
        return linear.eigenvalues
    most = len(sides.C) // (2 * len(linear.outputs))
    return np.concatenate([linear.eigenvalues, 1j * sides.rate * np.arange(-most, most + 1)])


def beside(linear: Linearisation, sides: Sides, frequencies: Array, outputs: Sequence[str], order: int) -> list[str]:
    """Notes on outputs that answer at other frequencies than that of the input."""
    C, D, count = np.concatenate([linear.C, sides.C]), np.concatenate([linear.D, sides.D]), len(outputs)
    every = receptances(linear.A, linear.B, C, D, frequencies, order, poles(linear, sides), count)
    every = np.where(np.isfinite(every), every, 0.0)  # what has no bound is told elsewhere
    own, H = np.abs(every[:, :count]).max(axis=0), every[:, count:].reshape(frequencies.size, -1, 2, count)
    most = np.maximum(*(np.abs(H[:, :, 0] + sign * H[:, :, 1]) for sign in (1j, -1j))).max(axis=(0, 1))
    return [
        f"{name} also answers at the frequency of the input plus and minus multiples of {sides.rate / (2 * np.pi):.5g} Hz, "
        f"the speed of what turns, {'and not at its own' if o < LEAST * s else f'up to {s / o:.2g} times as much'}"
        for name, o, s in zip(outputs, own, most, strict=True)
        if s > LEAST * max(o, most.max())
    ]
