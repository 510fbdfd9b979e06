"""The fields by which a page can colour bodies, and their ranges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ffr_dyn.pictures.film import Film, Solid, displaced, largest_value
from ffr_dyn.scene.stress_sensors import MEASURES, TENSOR, Measure
from ffr_prep.common.arrays import Array

PLAIN, DISPLACEMENT, SPEED, STRESS, STRAIN = range(5)  # kinds, as in web/shaders.js
_ORDER = ("von-mises", "tresca", "signed-max-principal", "max-principal", "min-principal", *TENSOR)
_OFFERED = ("von-mises", "signed-max-principal")
_LOOKS = 48  # rows that are looked at for the range of what is offered beside what was asked for


@dataclass(frozen=True, eq=False)
class Shade:
    """A field, as web/shaders.js makes it of what moves.

    kind, measure : what it is, and which measure of stress or strain
    low, high     : of the colour bar, in `unit`; low is 0, or less for a measure with a sign
    colour_map    : by its name in matplotlib, "" where every body has a colour of its own
    bodies        : those that have it; all have a speed
    """

    words: str
    kind: int
    unit: str = ""
    measure: int = 0
    low: float = 0.0
    high: float = 1.0
    colour_map: str = ""
    bodies: frozenset[str] = frozenset()


def shades(film: Film, colour: str) -> list[Shade]:
    """All that the bodies of a film may be coloured by; the one that is asked for first."""
    found = dict(_offered(film))
    asked = film.colouring
    if asked is not None and colour in MEASURES:
        found[colour] = _of_measure(MEASURES[colour], colour, asked.high, asked.bodies)
    elif asked is not None:
        high = asked.high
        found["deformation"] = Shade("elastic displacement", DISPLACEMENT, "m", 0, 0.0, high, "viridis", asked.bodies)
    first = colour if colour in found else "body"
    return [found[first], *(shade for name, shade in found.items() if name != first)]


def _offered(film: Film) -> Iterator[tuple[str, Shade]]:
    yield "body", Shade("body", PLAIN)
    flexible = [solid for solid in film.solids if solid.is_flexible]
    if film.deflection > 0:
        names = frozenset(solid.name for solid in flexible)
        yield (
            "deformation",
            Shade("elastic displacement", DISPLACEMENT, "m", 0, 0.0, film.deflection, "viridis", names),
        )
    if largest := max((_fastest(solid, film.times) for solid in film.solids), default=0.0):
        yield "speed", Shade("speed", SPEED, "m/s", 0, 0.0, largest, "plasma")
    stressed = [solid for solid in flexible if solid.surface.stress is not None]
    for name in _OFFERED if stressed else ():
        of = MEASURES[name]
        if high := max(largest_value(solid, of, _some(len(solid.q))) for solid in stressed):
            yield name, _of_measure(of, name, high, frozenset(solid.name for solid in stressed))


def _of_measure(of: Measure, name: str, high: float, bodies: frozenset[str]) -> Shade:
    kind, number = (STRAIN if of.strain else STRESS), _ORDER.index(name.removeprefix("strain-"))
    low, colours = (-high, "coolwarm") if of.signed else (0.0, "turbo")
    return Shade(of.words, kind, "" if of.strain else of.unit, number, low, high, colours, bodies)


def _some(count: int) -> Array:
    return np.unique(np.linspace(0, count - 1, min(count, _LOOKS)).astype(int))


def _fastest(solid: Solid, times: Array) -> float:
    """The largest speed [m/s] of points between rows that follow each other."""
    found = 0.0
    for k in _some(len(times) - 1) if len(times) > 1 else ():
        here, there = (
            solid.R[f] + (solid.surface.points + displaced(solid, f)) @ solid.A[f].T for f in (int(k), int(k) + 1)
        )
        if times[k + 1] > times[k]:
            speed = np.linalg.norm(there - here, axis=1).max() / (times[k + 1] - times[k])
            found = max(found, float(speed))
    return found
