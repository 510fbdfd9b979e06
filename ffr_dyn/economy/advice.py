"""Which interface shapes, which band of frequencies and which mesh a scene needs, as the command that makes the bodies.

The band reaches to the highest mode whose absence would take more than a share of a tolerance. A mesh resolves it with four
elements of second order to the shortest bending wave, whose length follows from the frequency as of a slender body.
"""

from __future__ import annotations

from itertools import pairwise
from shlex import quote
from typing import Any

import numpy as np

from ffr_dyn.economy.result import Economy
from ffr_dyn.scene.scene import Body

_OWN = (
    "--unit",
    "--units",
    "--set",
    "--solid",
    "--material",
    "--interface",
    "--group",
    "--surface",
    "--reference",
)  # options that stay what they are


def advice(found: Economy) -> list[str]:
    """A line for each flexible body: the command that gives what the scene needs of it, and why."""
    return [_line(found, b, body) for b, body in enumerate(found.original.bodies) if body.model.n]


def _line(found: Economy, b: int, body: Body) -> str:
    if not found.choice.parts[b].count:
        return f"{body.name}: rigid is enough; mass, inertia and interfaces do: {_command(body, 'guyan')}"
    highest = _highest(found, b)
    linear = not found.choice.parts[b].stiffened or body.model.stiffening is None
    stress = any(output.name == f"{body.name}.stress" for output in found.probe.outputs)
    size = _mesh_size(body, highest, found.policy.elements_per_wave)
    mesh = f"; {_elements(body)} of at most {size:.2g} m along it" if size else ""
    command = _command(body, "craig-bampton", _rounded(found.policy.band * highest), linear=linear, stress=stress)
    return f"{body.name}: matters up to {highest:.4g} Hz: {command}{mesh}"


def _command(body: Body, method: str, frequency: str = "", *, linear: bool = False, stress: bool = False) -> str:
    """How a body is made, by the command that made it: of a structure file by its entries; in words where none did."""
    maker, flags = _words(body)[:1], [key for key, given in (("linear", linear), ("stress", stress)) if given]
    if maker == ["reduce-structure"]:
        asked = f'reduction = {{method = "{method}"{f", frequency = {frequency}" if frequency else ""}}}'
        entries = "".join(f", {key} = true" for key in flags)
        return f"{asked}{entries} in its structure FILE, and ffr-prep reduce-structure FILE -o {body.name}.ffr"
    if maker in (["reduce"], ["reduce-matrices"]):
        band = f" --frequency {frequency}" if frequency else ""
        options = "".join(f" --{key}" for key in flags if maker == ["reduce"])
        return f"ffr-prep {maker[0]} FILE{_own_options(body)} --method {method}{band}{options} -o {body.name}.ffr"
    band = f" with modes up to {frequency} Hz" if frequency else ""
    return " and ".join([f"reduce it again, where it was made, by {method}{band}", *(f"{key} = true" for key in flags)])


def _words(body: Body) -> list[str]:
    """The command that made a body; none of one made in Python or by another program."""
    return [str(word) for word in body.model.provenance.get("command", ())]


def _own_options(body: Body) -> str:
    """What the geometry, the material and the interfaces of a body were told with."""
    words = _words(body)
    own = [(word, value) for word, value in pairwise(words) if word in _OWN and words[0] != "reduce-structure"]
    made = own or [("--interface", interface.name) for interface in body.model.interfaces]
    return "".join(f" {word} {quote(value)}" for word, value in made)


def _elements(body: Body) -> str:
    return "elements" if _words(body)[:1] == ["reduce-structure"] else "elements of second order"


def _highest(found: Economy, b: int) -> float:
    """[Hz] of the highest mode of a body that the model has, or that would do more than a small share of a tolerance, where
    that can be told."""
    part, model = found.choice.parts[b], found.original.bodies[b].model
    V = part.basis(model.n)
    frequencies = list(np.sqrt(np.einsum("ia,i,ia->a", V, model.omega2, V)) / (2 * np.pi))
    shares = (found.effects.effect / found.limits).max(axis=1, initial=0.0)
    counts = (found.effects.body == b) & (shares > found.policy.advised_effect) & tells_apart(found)
    omitted = np.flatnonzero(counts)
    frequencies += [float(model.frequencies[found.effects.mode[k]]) for k in omitted]
    return float(max(frequencies))


def tells_apart(found: Economy) -> bool:
    """Whether what is said of each omitted mode fits what is known of all of them.

    Where joints hold bodies more than once, modes move only with one another, and one alone would do far more.
    """
    most = found.effects.effect.max(axis=0, initial=0.0)
    return bool((most <= found.policy.alone * np.maximum(found.limits, found.model_error)).all())


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
