"""Bodies whose numbers do not fit each other, as where lengths, masses or inertia are off by a factor of a thousand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ffr_prep.body.constructors import MOVED_POINTS
from ffr_prep.body.reduced import FlexibleBody, remembered
from ffr_prep.common.arrays import Array

_LONG = 100.0  # m
_HEAVIEST = 2.3e4  # kg/m^3, of osmium
_FILLED = 0.2  # largest share of the cube over its diagonal that a solid fills: a cube 1 / sqrt(27)
_LIGHTEST = (
    1e-6  # kg/m^3 over the cube of the diagonal: a rod of foam that is a thousand times as long as thick has 1e-5
)
_FAR = 20.0  # diagonals of the body between it and a point that is attached to it
_SPREAD = 100.0  # of the farthest point of a body without a shape, which its radius of gyration is not beyond
_BALL = 9.02  # volume of a ball over the cube of its radius of gyration, 4 pi / 3 (5 / 3)^1.5: no solid has more
_MOST_DAMPED = 0.2  # of critical damping, the least damped mode of a structure
_THIN = 1e-2  # kg/m^3 over the cube of the radius of gyration, below which an inertia in kg mm^2 is, and no rotor


def units_doubts(body: FlexibleBody) -> list[str]:
    """What cannot be meant of a body, in words: its size, its mass for its size, points far away from it, its inertia, its
    damping.

    >>> fp.units_doubts(body)
    """
    return [
        *remembered(
            body, "units doubts", lambda: (*_of_shape(body), *_of_points(body), *_of_places(body), *_of_damping(body))
        )
    ]


def _of_shape(body: FlexibleBody) -> Iterator[str]:
    if body.surface is None or not len(body.surface.points):
        return
    low, high = body.surface.points.min(axis=0), body.surface.points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    if size > _LONG:
        yield f"it is {size:.3g} m long: are its lengths millimetres?"
    if size > 0 and body.mass > _HEAVIEST * _FILLED * size**3:
        yield (
            f"it has a mass of {body.mass:.3g} kg and is {size:.3g} m long, heavier than any solid: are its lengths metres, "
            "or its masses in tonnes or grams?"
        )
    if size > 0 and body.mass < _LIGHTEST * size**3:
        yield f"it has a mass of {body.mass:.3g} kg and is {size:.3g} m long, lighter than any solid: is its mass in tonnes?"
    for interface in body.interfaces:
        away = float(np.linalg.norm(np.maximum(0, np.maximum(low - interface.position, interface.position - high))))
        if size > 0 and away > _FAR * size:
            yield (
                f"its point {interface.name!r} is {away:.3g} m away from the body, which is {size:.3g} m long: is the place "
                "in millimetres? It is in metres"
            )


def _of_points(body: FlexibleBody) -> Iterator[str]:
    """Of a body without a shape: its mass against its inertia, and its inertia against the places of its points."""
    if body.surface is not None:
        return
    gyration = _gyration(body)
    if body.n and body.mass > _HEAVIEST * _BALL * gyration**3:  # rigid ones are often points of mass
        yield (
            f"it has a mass of {body.mass:.3g} kg and a radius of gyration of {gyration:.3g} m, heavier than any solid: are "
            "its lengths metres, or its masses in tonnes or grams?"
        )
    centre = body.r_dm / body.mass
    reach = max((float(np.linalg.norm(interface.position - centre)) for interface in body.interfaces), default=0.0)
    if reach > 0 and gyration > _SPREAD * reach and body.mass < _THIN * gyration**3:
        yield (
            f"its radius of gyration is {gyration:.3g} m and its farthest point {reach:.3g} m from its centre: is the "
            "inertia in kg mm^2? It is in kg m^2"
        )


def _gyration(body: FlexibleBody) -> float:
    """[m] root of the mean square of the distance of the mass from its centre."""
    centre = body.r_dm / body.mass
    return float(np.sqrt(max(float(np.trace(body.rr_dm)) / body.mass - float(centre @ centre), 0.0)))


def _of_places(body: FlexibleBody) -> Iterator[str]:
    """Of points that were asked for where the body has no surface near."""
    asked_for = body.provenance.get(MOVED_POINTS, {})
    for name, asked, at in ((i.name, asked_for[i.name], i.position) for i in body.interfaces if i.name in asked_for):
        away = float(np.linalg.norm(np.array(asked) - at))
        yield (
            f"its point {name!r} was asked for at {_place(asked)} m and is where the surface is nearest, at {_place(at)} m, "
            f"{away:.3g} m away: is that meant? Within a body, as on the axis of a beam, interfaces of its reduction can be"
        )


def _of_damping(body: FlexibleBody) -> Iterator[str]:
    if body.damping is not None and body.n:
        ratios = body.damping.diagonal() / (2 * np.sqrt(np.maximum(body.omega2, np.finfo(float).tiny)))
        yield from ratio_doubts(ratios)


def ratio_doubts(ratios: Array) -> list[str]:
    """What cannot be meant of the damping ratios (n,) of modes, in words."""
    least = float(ratios.min(initial=np.inf))
    if not _MOST_DAMPED <= least < np.inf:
        return []
    return [
        f"its damping damps every mode by {least:.3g} of its critical damping or more"
        f"{', so that none vibrates' * (least > 1)}: are ratios in per cent (1 % is 0.01)? Or is a matrix C in other units "
        "than K and M, and is their order K, M, C?"
    ]


def _place(at: Iterable[float]) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in at) + ")"
