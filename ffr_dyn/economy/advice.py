"""Which interface shapes, which band of frequencies and which mesh a scene needs, as the command that makes the bodies.

The band reaches to the highest mode whose absence would take more than a share of a tolerance. A mesh resolves it with four
elements of second order to the shortest bending wave, whose length follows from the frequency as of a slender body.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ffr_dyn.economy.result import Economy
from ffr_dyn.scene.scene import Body


def advice(found: Economy) -> list[str]:
    """A line for each flexible body: the command `ffr-prep reduce` that gives what the scene needs of it, and why."""
    return [_line(found, b, body) for b, body in enumerate(found.original.bodies) if body.model.n]


def _line(found: Economy, b: int, body: Body) -> str:
    if not found.choice.parts[b].count:
        return (
            f"{body.name}: rigid is enough; mass, inertia and interfaces do: "
            f"ffr-prep reduce FILE{_interfaces(body)} --method guyan -o {body.name}.ffr"
        )
    highest = _highest(found, b)
    options = f"--method craig-bampton --frequency {_rounded(found.policy.band * highest)}"
    linear = "" if found.choice.parts[b].stiffened and body.model.stiffening is not None else " --linear"
    stress = " --stress" if any(output.name == f"{body.name}.stress" for output in found.probe.outputs) else ""
    size = _mesh_size(body, highest, found.policy.elements_per_wave)
    mesh = f"; elements of second order of at most {size:.2g} m along it" if size else ""
    return (
        f"{body.name}: matters up to {highest:.4g} Hz: ffr-prep reduce FILE{_interfaces(body)} {options}{linear}{stress} "
        f"-o {body.name}.ffr{mesh}"
    )


def _interfaces(body: Body) -> str:
    return "".join(f" --interface {interface.name}" for interface in body.model.interfaces)


def _highest(found: Economy, b: int) -> float:
    """[Hz] of the highest mode of a body that the model has, or that would do more than a small share of a tolerance."""
    part, model = found.choice.parts[b], found.original.bodies[b].model
    V = part.basis(model.n)
    frequencies = list(np.sqrt(np.einsum("ia,i,ia->a", V, model.omega2, V)) / (2 * np.pi))
    shares = (found.effects.effect / found.limits).max(axis=1, initial=0.0)
    omitted = np.flatnonzero((found.effects.body == b) & (shares > found.policy.advised_effect))
    frequencies += [float(model.frequencies[found.effects.mode[k]]) for k in omitted]
    return float(max(frequencies))


def _mesh_size(body: Body, highest: float, per_wave: int) -> float | None:
    """[m] along the longest way between interfaces, taking the lowest mode for a half wave between them: bending waves
    shorten as the root of the frequency."""
    places = np.array([interface.position for interface in body.model.interfaces])
    if len(places) < 2:
        return None
    length = float(np.linalg.norm(places[:, None] - places, axis=2).max())
    lowest = float(body.model.frequencies.min())
    return length * 2 * float(np.sqrt(lowest / max(highest, lowest))) / per_wave if lowest > 0 and length > 0 else None


def _rounded(value: float) -> str:
    digits = 2 - int(np.floor(np.log10(value)))
    text: Any = round(value, digits)
    return f"{text:g}"
