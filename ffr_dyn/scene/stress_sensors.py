"""Measures of stress and strain, and what sensors take from the stress modes of a body.

Tensors have the six components xx, yy, zz, xy, xz, yz in body axes along their last axis; shear strains are those of the
tensor, half the engineering ones.

Source: Timoshenko & Goodier, Theory of Elasticity (1970), articles 6 and 77 (Hooke's law, principal stresses).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.scene.sensors import SectionMeasurement, StressMeasurement
from ffr_prep.body import SECTION_FORCES, BeamForces, QuadraticField, Surface, at_places, values
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

TENSOR = ("xx", "yy", "zz", "xy", "xz", "yz")
PLACES = ("first", "middle", "last")


FORCE_AXIS, MOMENT_AXIS = ("section_force", SECTION_FORCES[:3]), ("section_moment", SECTION_FORCES[3:])

_FAR = 1.0  # of the body's size, from its surface


def von_mises(tensor: Array) -> Array:
    """(..., 6) -> (...,): the tension that distorts as much, sqrt(3/2 s:s) of the deviator s."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(tensor, -1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    stress: Array = np.sqrt(0.5 * normal + 3.0 * (xy**2 + xz**2 + yz**2))
    return stress


def principal_values(tensor: Array) -> Array:
    """(..., 6) -> (..., 3) eigenvalues, descending."""
    full = np.empty((*tensor.shape[:-1], 3, 3))
    for part, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        full[..., row, column] = full[..., column, row] = tensor[..., part]
    return np.linalg.eigvalsh(full)[..., ::-1]


def signed_max_principal(tensor: Array) -> Array:
    """(..., 6) -> (...,): the principal value of the largest size, with its sign: tension or compression."""
    principal = principal_values(tensor)
    first, last = principal[..., 0], principal[..., 2]
    return np.where(np.abs(first) >= np.abs(last), first, last)


@dataclass(frozen=True)
class Measure:
    """A number made of a tensor: of (..., 6) -> (...,), its words, and whether of strain and whether it has a sign."""

    words: str
    of: Callable[[Array], Array]
    strain: bool = False
    signed: bool = True

    @property
    def unit(self) -> str:
        """ "Pa", or "1" of a strain."""
        return "1" if self.strain else "Pa"


def _component(k: int) -> Callable[[Array], Array]:
    return lambda tensor: tensor[..., k]


def _measures() -> Iterator[tuple[str, Measure]]:
    yield "von-mises", Measure("von Mises stress", von_mises, signed=False)
    yield "tresca", Measure("Tresca stress", lambda t: np.ptp(principal_values(t), axis=-1), signed=False)
    for strain, kind in ((False, "stress"), (True, "strain")):
        prefix = "strain-" if strain else ""
        yield prefix + "signed-max-principal", Measure(f"signed max principal {kind}", signed_max_principal, strain)
        yield prefix + "max-principal", Measure(f"max principal {kind}", lambda t: principal_values(t)[..., 0], strain)
        yield prefix + "min-principal", Measure(f"min principal {kind}", lambda t: principal_values(t)[..., 2], strain)
        for k, label in enumerate(TENSOR):
            yield prefix + label, Measure(f"{kind} {label}", _component(k), strain)


MEASURES: Mapping[str, Measure] = dict(_measures())


def measure(name: str) -> Measure:
    """The measure of that name; InputError lists them."""
    if name not in MEASURES:
        raise InputError(f"quantity {name!r} is not known; there are: {', '.join(MEASURES)}")
    return MEASURES[name]


def strain_of(stress: Array, moduli: Array) -> Array:
    """(..., 6) strain of the stress (..., 6) [Pa] in a material of moduli (..., 2): E [Pa] and nu.

    Raises InputError where the moduli are zeros, as bodies have them at anisotropic materials.
    """
    _check_isotropic(moduli)
    E, nu = moduli[..., 0, None], moduli[..., 1, None]
    volume = np.zeros_like(stress)
    volume[..., :3] = stress[..., :3].sum(axis=-1, keepdims=True)
    strain: Array = ((1 + nu) * stress - nu * volume) / E
    return strain


def _check_isotropic(moduli: Array) -> None:
    if not moduli[..., 0].all():
        raise InputError(
            "strain is recovered of isotropic materials only, and the material here is anisotropic: take the stress"
        )


def nearest_point(surface: Surface, position: Array, body: str) -> int:
    """The surface point nearest to a position (3,) [m] in the body frame; InputError when it is far from the body."""
    distance = np.linalg.norm(surface.points - np.asarray(position, float), axis=1)
    point = int(np.argmin(distance))
    size = _size(surface)
    if not distance[point] <= _FAR * size:
        low, high = surface.points.min(axis=0), surface.points.max(axis=0)
        raise InputError(
            f"the point {np.asarray(position).tolist()} is {distance[point]:.3g} m from body {body!r}, which lies between "
            f"{np.round(low, 6).tolist()} and {np.round(high, 6).tolist()} m; give it in metres, in the body frame"
        )
    return point


def nearest_surface(measurement: StressMeasurement | SectionMeasurement, surfaces: Sequence[Surface | None]) -> int:
    """The number of the surface that is nearest to what is measured, of a section that with the nearest beam element; zero of
    none."""
    position, section = np.asarray(measurement.point, float), isinstance(measurement, SectionMeasurement)
    distances = [_from_surface(surface, position, section) for surface in surfaces]
    return int(np.argmin(distances)) if distances else 0


def _from_surface(surface: Surface | None, position: Array, section: bool) -> float:
    """[m] from a position (3,) to the points of a surface, or to the beam elements under it; infinite where it has none."""
    if surface is None:
        return np.inf
    if not section:
        return float(np.linalg.norm(surface.points - position, axis=1).min())
    return np.inf if surface.beams is None else float(_from_elements(surface.beams, position).min())


def _size(surface: Surface) -> float:
    return float(np.linalg.norm(np.ptp(surface.points, axis=0)))


@dataclass(frozen=True)
class MeasuredModes:
    """The parts of a measurement of stress or section forces: modes (k, n) per elastic coordinate, what is quadratic in
    the coordinates besides, and how.

    of   : (T, k) -> (T, k) or (T,)
    axis : name and labels of the k components, None for a scalar
    text : what and where
    """

    modes: Array
    second: QuadraticField | None
    of: Callable[[Array], Array]
    unit: str
    axis: tuple[str, tuple[str, ...]] | None
    text: str

    def values(self, q: Array) -> Array:
        """(T, k) of elastic coordinates q (T, n)."""
        return in_all(self.modes, self.second, q)


def in_all(modes: Array, second: QuadraticField | None, q: Array) -> Array:
    """(T, ...) of modes (..., n) and what is quadratic beside them, for elastic coordinates q (T, n)."""
    linear = np.tensordot(q, modes, (-1, -1))
    return linear if second is None else linear + values(second, q)


def measured_modes(measurement: StressMeasurement | SectionMeasurement, surface: Surface | None) -> MeasuredModes:
    """Where and from what a measurement takes its values on the surface of its body.

    Raises InputError for a body without stress modes or section forces, an unknown measure, and a place far from the body.
    """
    if isinstance(measurement, SectionMeasurement):
        return _measured_section(measurement, surface)
    if surface is None or surface.stress is None or surface.moduli is None:
        raise InputError(
            f"body {measurement.body!r} has no stress modes; reduce it again with them (ffr-prep reduce --stress, "
            "fp.Request(..., stress=True))"
        )
    point = nearest_point(surface, np.array(measurement.point), measurement.body)
    at, moduli = f"at {np.round(surface.points[point], 6).tolist()} m", surface.moduli[point]
    modes, second = surface.stress[point], surface.second_stress and at_places(surface.second_stress, point)
    if measurement.what == "stress":
        return MeasuredModes(modes, second, lambda tensor: tensor, "Pa", ("tensor", TENSOR), f"stress {at}, body axes")
    if measurement.what.startswith("strain"):
        _check_isotropic(moduli)
    if measurement.what == "strain":
        return MeasuredModes(
            modes, second, lambda t: strain_of(t, moduli), "1", ("tensor", TENSOR), f"strain {at}, body axes"
        )
    of = measure(measurement.what)
    measured = (lambda t: of.of(strain_of(t, moduli))) if of.strain else of.of
    return MeasuredModes(modes, second, measured, of.unit, None, f"{of.words} {at}")


def _measured_section(measurement: SectionMeasurement, surface: Surface | None) -> MeasuredModes:
    if surface is None or surface.beams is None:
        raise InputError(
            f"body {measurement.body!r} has no section forces; they belong to beams that are reduced with stress"
        )
    point = np.array(measurement.point, float)
    nearest_point(surface, point, measurement.body)
    element, first = nearest_element(surface.beams, point), 3 * (measurement.what == "moment")
    at = element, PLACES.index(measurement.place), slice(first, first + 3)
    second = surface.beams.second and at_places(surface.beams.second, at)
    axis, unit = (MOMENT_AXIS, "N m") if first else (FORCE_AXIS, "N")
    text = f"section {measurement.what} of element {element}, {measurement.place}, element axes"
    return MeasuredModes(surface.beams.modes[at], second, lambda forces: forces, unit, axis, text)


def nearest_element(beams: BeamForces, position: Array) -> int:
    """The beam element whose centroid line is nearest to a position (3,) [m] in the body frame."""
    return int(np.argmin(_from_elements(beams, position)))


def _from_elements(beams: BeamForces, position: Array) -> Array:
    """(E,) [m] from the centroid line of each element to a position (3,)."""
    start, along = beams.positions[:, 0], beams.positions[:, 2] - beams.positions[:, 0]
    from_start = np.asarray(position, float) - start
    xi = np.clip(np.einsum("ec,ec->e", from_start, along) / np.einsum("ec,ec->e", along, along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(from_start - xi[:, None] * along, axis=1))
