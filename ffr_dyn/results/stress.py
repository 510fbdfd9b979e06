"""Stress, strain and section forces of a result: sums of the bodies' stress modes with the elastic coordinates.

    sigma(u_0, t) = sum_j sigma_j(u_0) q_j(t) + sigma_2,    epsilon = ((1 + nu) sigma - nu tr(sigma) 1) / E.

With sigma_2 what is quadratic in q of bodies with a second order: sigma is then the second Piola-Kirchhoff stress of
Green's strain, in axes that follow the material. The modes come with the surface that a result keeps of each body
(`ffr_prep.body.Surface`); a body in parts is one body here. Tensors have the six components xx, yy, zz, xy, xz, yz in body
axes along their last axis; shear strains are those of the tensor, half the engineering ones. Stress is found where the basis
can show it: loads along the body, its own inertia among them, need shapes made for them (inertia relief) or many modes.

Source: Timoshenko & Goodier, Theory of Elasticity (1970), articles 6 and 77 (Hooke's law, principal stresses).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.results.wholes import with_wholes
from ffr_dyn.scene.stress_sensors import (
    FORCE_AXIS,
    MOMENT_AXIS,
    PLACES,
    TENSOR,
    Measure,
    _size,
    in_all,
    measure,
    nearest_point,
    strain_of,
)
from ffr_prep.body import SECTION_FORCES, BeamForces, Surface, at_places
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

TENSOR_AXIS = Axis("tensor", TENSOR)
_FORCE_AXIS, _MOMENT_AXIS = Axis(*FORCE_AXIS), Axis(*MOMENT_AXIS)

_CHUNK = 4_000_000  # components of stress held at once: 32 MB
_APART = 0.1  # of the body's size, between two hot spots
_ROUNDING = 1e-12  # of the body's size: a coordinate of a hot spot below it is zero


# ---- tensors ------------------------------------------------------------------------------------------------------


def stressed_bodies(result: Result) -> tuple[str, ...]:
    """The bodies of the result that have stress modes; InputError when none has."""
    modes = {name: surface.stress for name, surface in with_wholes(result).geometry.items()}
    names = tuple(name for name, stress in modes.items() if stress is not None and stress.shape[2] > 0)
    if not names and result.attributes.get("analysis") == "kinematic":
        raise InputError("a kinematic analysis takes bodies as undeformed, without stress; `inverse` deforms them")
    if not names:
        raise InputError(
            "no body of the result has stress modes; reduce it again with them (ffr-prep reduce --stress, "
            "fp.Request(..., stress=True)) and run again"
        )
    return names


def stressed_surface(result: Result, body: str) -> Surface:
    """The surface of a body that has stress modes; InputError for one that is unknown or has none."""
    known = stressed_bodies(result)
    if body not in known:
        raise InputError(f"body {body!r} has no stress modes in the result; those that have: {', '.join(known)}")
    return with_wholes(result).geometry[body]


def _coordinates(result: Result, body: str) -> Array:
    """(T, n) elastic coordinates of a body; InputError without rows and for values that are not finite."""
    q = with_wholes(result)[f"{body}.q"]
    if not len(q) or not np.isfinite(q).all():
        raise InputError(
            f"body {body!r} has {len(q)} rows of elastic coordinates, not all finite; run the analysis again"
        )
    return q


def tensors(surface: Surface, q: Array, points: Array | slice = slice(None), *, strain: bool = False) -> Array:
    """(k, T, 6) stress [Pa], or strain, at surface points (k,) for elastic coordinates q (T, n) [m sqrt(kg)].

    Raises InputError for a surface without stress modes.
    """
    if surface.stress is None or surface.moduli is None:
        raise InputError("the surface has no stress modes; reduce the body with stress=True (ffr-prep reduce --stress)")
    second = surface.second_stress and at_places(surface.second_stress, points)
    stress = np.moveaxis(in_all(surface.stress[points], second, q), 0, 1)
    return strain_of(stress, surface.moduli[points][:, None]) if strain else stress


def values_at(surface: Surface, q: Array, of: Measure, points: Array | slice = slice(None)) -> Array:
    """(k, T) the measure at surface points (k,) for elastic coordinates q (T, n)."""
    return of.of(tensors(surface, q, points, strain=of.strain))


# ---- over the surface and over time -------------------------------------------------------------------------------


@dataclass(frozen=True)
class HotSpot:
    """Where and when a measure is largest: a point of a body's surface with its position (3,) [m], the row and time [s]."""

    body: str
    point: int
    position: tuple[float, float, float]
    row: int
    time: float
    value: float


def peaks(result: Result, body: str, quantity: str = "von-mises") -> tuple[Array, Array]:
    """(P,) the value of largest size that the measure takes at each surface point, with its sign, and (P,) its row.

    Raises InputError for an unknown measure, and for a body without stress modes.

    >>> values, rows = fd.peaks(result, "rod")
    """
    surface, q, of = stressed_surface(result, body), _coordinates(result, body), measure(quantity)
    count = len(surface.points)
    values, rows = np.zeros(count), np.zeros(count, np.int64)
    step = max(1, _CHUNK // (6 * len(q)))
    for start in range(0, count, step):
        here = slice(start, min(start + step, count))
        of_points = values_at(surface, q, of, here)
        rows[here] = np.argmax(np.abs(of_points), axis=1)
        values[here] = np.take_along_axis(of_points, rows[here][:, None], axis=1)[:, 0]
    return values, rows


def hot_spots(
    result: Result, quantity: str = "von-mises", *, bodies: tuple[str, ...] | None = None, count: int = 5
) -> tuple[HotSpot, ...]:
    """The places where the measure is largest in size over surface and time, the largest first.

    bodies : where to look; all with stress modes when not given
    count  : at most; two on one body are apart by a tenth of its size

    Raises InputError for an unknown measure or body and for bodies without stress modes.

    >>> spots = fd.hot_spots(result, "von-mises", count=3)
    """
    if count < 1:
        raise InputError(f"asked for {count} hot spots; ask for one or more")
    found = [spot for body in bodies or stressed_bodies(result) for spot in _spots(result, body, quantity, count)]
    return tuple(sorted(found, key=lambda spot: -abs(spot.value))[:count])


def _spots(result: Result, body: str, quantity: str, count: int) -> Iterator[HotSpot]:
    surface = stressed_surface(result, body)
    values, rows = peaks(result, body, quantity)
    size = _size(surface)
    free = np.ones(len(values), bool)
    for _ in range(count):
        if not free.any():
            return
        point = int(np.argmax(np.where(free, np.abs(values), -1.0)))
        position, row = surface.points[point], int(rows[point])
        place = np.where(np.abs(position) < _ROUNDING * size, 0.0, position)
        yield HotSpot(body, point, tuple(place.tolist()), row, float(result.time[row]), float(values[point]))
        free &= np.linalg.norm(surface.points - position, axis=1) > _APART * size


def stress_histories(result: Result, body: str, places: Mapping[str, Array], quantity: str = "von-mises") -> Result:
    """Histories at named places (3,) [m] in the body frame, each at the nearest point of the surface.

    For each place: <body>.<place>.stress and .strain (tensors in body axes; no strain of anisotropic materials) and
    .<quantity>. Raises InputError for an unknown body or measure, and a place far from the body.

    >>> notch = fd.stress_histories(result, "rod", {"notch": np.array([0.15, 0, 0.012])})
    """
    surface, q, of = stressed_surface(result, body), _coordinates(result, body), measure(quantity)
    found: dict[str, Quantity] = {}
    for name, position in places.items():
        point = nearest_point(surface, position, body)
        at = f"at {np.round(surface.points[point], 6).tolist()} m"
        tensor = tensors(surface, q, slice(point, point + 1))[0]
        found[f"{body}.{name}.stress"] = Quantity(tensor, "Pa", (TENSOR_AXIS,), f"stress {at}, body axes")
        if of.strain or (surface.moduli is not None and surface.moduli[point].any()):
            strain = tensors(surface, q, slice(point, point + 1), strain=True)[0]
            found[f"{body}.{name}.strain"] = Quantity(strain, "1", (TENSOR_AXIS,), f"strain {at}, body axes")
            tensor = strain if of.strain else tensor
        found[f"{body}.{name}.{quantity}"] = Quantity(of.of(tensor), of.unit, (), f"{of.words} {at}")
    return Result(result.time, found, {}, {"title": result.attributes.get("title", "")})


# ---- section forces of beams --------------------------------------------------------------------------------------


def beams_of(result: Result, body: str) -> BeamForces:
    """The section forces of a body of beams; InputError for one that has none."""
    geometry = with_wholes(result).geometry
    surface = geometry.get(body)
    if surface is None or surface.beams is None:
        known = [name for name, other in geometry.items() if other.beams is not None]
        raise InputError(
            f"body {body!r} has no section forces in the result; those that have: {', '.join(known) or 'none'}"
        )
    return surface.beams


def section_forces(result: Result, body: str, element: int) -> Array:
    """(T, 3, 6) N, Qy, Qz [N], Mx, My, Mz [N m] at the first end, middle and last end of a beam element, its axes.

    Raises InputError for a body without beams or an element that does not exist.

    >>> fd.section_forces(result, "arm", 0)[:, 0, 0]  # N at the first end of the first element
    """
    beams = beams_of(result, body)
    if not 0 <= element < len(beams.modes):
        raise InputError(f"body {body!r} has no beam element {element}; it has {len(beams.modes)}, counted from 0")
    return _in_element(beams, element, _coordinates(result, body))


def _in_element(beams: BeamForces, element: int, q: Array) -> Array:
    """(T, 3, 6) section forces of an element at elastic coordinates q (T, n)."""
    return in_all(beams.modes[element], beams.second and at_places(beams.second, element), q)


def section_histories(result: Result, body: str, element: int) -> Result:
    """Section forces of an element as named histories: <body>.element_3.middle.force and .moment (first, middle, last).

    Raises InputError for a body without section forces, and for an element that it has not.

    >>> fd.plot(fd.section_histories(result, "arm", 0), "*")
    """
    values = section_forces(result, body, element)
    found: dict[str, Quantity] = {}
    for k, place in enumerate(PLACES):
        name = f"{body}.element_{element}.{place}"
        found[f"{name}.force"] = Quantity(values[:, k, :3], "N", (_FORCE_AXIS,), "section force, element axes")
        found[f"{name}.moment"] = Quantity(values[:, k, 3:], "N m", (_MOMENT_AXIS,), "section moment, element axes")
    return Result(result.time, found, {}, {"title": result.attributes.get("title", "")})


@dataclass(frozen=True)
class SectionPeak:
    """The largest value of a section force ("N", "My", ...) [N or N m]: element, place ("first", ...), row, time [s]."""

    force: str
    element: int
    place: str
    row: int
    time: float
    value: float


def section_peaks(result: Result, body: str) -> tuple[SectionPeak, ...]:
    """For each section force its value of largest size over elements, their places and time.

    Raises InputError for a body without section forces.

    >>> worst = fd.section_peaks(result, "arm")
    """
    beams, q = beams_of(result, body), _coordinates(result, body)
    best: list[SectionPeak | None] = [None] * 6
    for element in range(len(beams.modes)):
        values = np.moveaxis(_in_element(beams, element, q), 0, 2).swapaxes(0, 1)
        for k, of_force in enumerate(values):
            place, row = np.unravel_index(np.argmax(np.abs(of_force)), of_force.shape)
            value, known = float(of_force[place, row]), best[k]
            if known is None or abs(value) > abs(known.value):
                time = float(result.time[row])
                best[k] = SectionPeak(SECTION_FORCES[k], element, PLACES[place], int(row), time, value)
    return tuple(peak for peak in best if peak is not None)
