"""Quality of a reduction: what the reduced body gets wrong, measured against the full model.

* Frequencies under the reference conditions of the body, against those of the full model under the same.
* Static flexibility and receptances at the interfaces of the free body (see `ffr_prep.reduction.receptance`).
* Steady deformation under the twelve unit accelerations: gravity or translation, angular acceleration, and the products
  of the angular velocity. The body is held by its reference conditions; where these are its mean motion, which gravity
  does not deform, by each of its interfaces alone, and the largest error counts. The error of the displacement is its
  root mean square over the mass; that of the stress is measured by the strain energy.

Everything uses the one factorisation of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reactions import inertial_loads
from ffr_prep.reduction.basis import Basis
from ffr_prep.reduction.mesh_resolution import resolution_warnings
from ffr_prep.reduction.modes import modes_up_to
from ffr_prep.reduction.receptance import (
    FreeModes,
    free_modes,
    receptance_error,
    receptances,
    reference_modes,
    static_flexibility,
)
from ffr_prep.reduction.responses import mean_motion, static_solver
from ffr_prep.reduction.selection import Band
from ffr_prep.reduction.steady_stress import steady_responses
from ffr_prep.solvers.factor import FreeBody, supported

ACCELERATIONS = (
    *(f"gravity or acceleration along {axis}" for axis in "xyz"),
    *(f"angular acceleration about {axis}" for axis in "xyz"),
    *(f"spin product {a}{b}" for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")),
)
_RICHER = 2.0
_DRAWN = 4
_NOTHING = 1e-9
_SMALL = 0.01
_TINY = np.finfo(float).tiny
_KINDS = (3, 6)  # translation, angular acceleration, spin
_DIGITS = 6


@dataclass(frozen=True)
class Quality:
    """Errors of a reduced body; relative ones as fractions. Arrays are empty where there is nothing to compare.

    band             : low and high end [Hz]
    mode_frequencies : (m,) of the full model under the reference conditions, up to twice the band [Hz]
    frequency_errors : (k,) of the reduced body's first k frequencies, k = min(m, n)
    frequencies      : (F,) of the receptances [Hz]
    receptance_errors: (F,) largest over all pairs of interface coordinates
    points           : names of what is drawn: translation and rotation of the first interfaces
    full, reduced    : (F, points) largest driving-point receptance of each [m/N or rad/(N m)]
    reference_error  : [1] bound on the error of the receptances taken as those of the full model
    flexibility_error: [1] largest of the static flexibility of the free body; NaN without interfaces
    displacement_errors, stress_errors : (12,) under the unit accelerations; NaN where nothing deforms

    >>> fp.quality_of(body.provenance).receptance_errors
    """

    band: tuple[float, float]
    mode_frequencies: Array
    frequency_errors: Array
    frequencies: Array
    receptance_errors: Array
    points: tuple[str, ...]
    full: Array
    reduced: Array
    reference_error: float
    flexibility_error: float
    displacement_errors: Array
    stress_errors: Array
    warnings: tuple[str, ...] = field(default=())


def assess(model: CoupledModel, body: FreeBody, L: Array, basis: Basis, band: Band) -> Quality:
    """Compare the basis with the full model up to the upper end of the band.

    Raises ComputationError when the full model's receptances cannot be found accurately.
    """
    exact, omega2, shapes = _frequencies(model, body, L, band)
    errors = _frequency_errors(exact, basis)
    displacement, stress = steady_errors(model, body, L, basis)
    at_interfaces = _interface_errors(model, body, basis, band) if model.names else _without_interfaces()
    return Quality(
        band=(band.low, band.high),
        mode_frequencies=exact,
        frequency_errors=errors,
        displacement_errors=displacement,
        stress_errors=stress,
        warnings=(*_steady_warnings(displacement), *resolution_warnings(model, omega2, shapes, band.high)),
        **at_interfaces,
    )


# ---- frequencies --------------------------------------------------------------------------------------------------


def _frequencies(model: CoupledModel, body: FreeBody, L: Array, band: Band) -> tuple[Array, Array, Array]:
    omega2, shapes = modes_up_to(model, supported(body, L), _RICHER * band.high)
    return np.sqrt(omega2) / (2 * np.pi), omega2, shapes


def _frequency_errors(exact: Array, basis: Basis) -> Array:
    """(k,) of the k-th frequency; none is lower than that of the full model (Rayleigh-Ritz)."""
    count = min(exact.size, basis.omega2.size)
    return np.sqrt(basis.omega2[:count]) / (2 * np.pi * exact[:count]) - 1


# ---- interfaces ---------------------------------------------------------------------------------------------------


def _interface_errors(model: CoupledModel, body: FreeBody, basis: Basis, band: Band) -> dict[str, Any]:
    frequencies = band.frequencies()
    reference, own_error = reference_modes(model, body, band)
    found = free_modes(model, basis)
    return {
        "frequencies": frequencies,
        "receptance_errors": receptance_error(found, reference, frequencies),
        "points": tuple(f"{name} {motion}" for name in model.names[:_DRAWN] for motion in ("translation", "rotation")),
        "full": _driving_points(reference, frequencies),
        "reduced": _driving_points(found, frequencies),
        "reference_error": own_error,
        "flexibility_error": _flexibility_error(model, body, found),
    }


def _without_interfaces() -> dict[str, Any]:
    none = np.zeros(0)
    return {
        "frequencies": none,
        "receptance_errors": none,
        "points": (),
        "full": none,
        "reduced": none,
        "reference_error": 0.0,
        "flexibility_error": float("nan"),
    }


def _driving_points(modes: FreeModes, frequencies: Array) -> Array:
    """(F, 2 or more) largest singular value of each 3 x 3 block of the first interfaces' receptances."""
    H = receptances(modes, frequencies)
    starts = range(0, min(6 * _DRAWN, H.shape[1]), 3)
    blocks = np.stack([H[:, k : k + 3, k : k + 3] for k in starts], axis=1)
    return np.linalg.norm(blocks, ord=2, axis=(2, 3))


def _flexibility_error(model: CoupledModel, body: FreeBody, found: FreeModes) -> float:
    exact = model.C @ static_solver(model, body, mean_motion(model))(model.C.toarray().T)
    size = np.sqrt(np.diag(exact))
    return float((np.abs(static_flexibility(found) - exact) / np.outer(size, size)).max())


# ---- steady deformation -------------------------------------------------------------------------------------------


def steady_errors(model: CoupledModel, body: FreeBody, L: Array, basis: Basis) -> tuple[Array, Array]:
    """(12,) errors of displacement and stress under the unit accelerations; NaN where nothing deforms."""
    errors = _steady_errors_under(model, body, L, basis)
    if np.isnan(errors[:, :3]).all():  # the mean motion carries gravity: something else will
        held = [model.C[6 * k : 6 * k + 6].toarray() for k in range(len(model.names))]
        every = np.array([errors, *(_steady_errors_under(model, body, at, basis) for at in held)])
        errors = np.where(np.isnan(every).all(axis=0), np.nan, np.nan_to_num(every).max(axis=0))
    return errors[0], errors[1]


def _steady_errors_under(model: CoupledModel, body: FreeBody, supports: Array, basis: Basis) -> Array:
    """(2, 12) errors with the body held by the supports (s, Z)."""
    loads = inertial_loads(model)
    exact, left_out = steady_responses(model, body, supports, basis)
    energy = np.einsum("zi,zi->i", exact, loads)
    missing = np.einsum("zi,zi->i", left_out, loads)
    noise = _NOTHING * np.einsum("zi,zi->i", np.abs(exact), np.abs(loads))
    displacement = _norms(model, left_out) / _sizes(_norms(model, exact))
    stress = np.sqrt(np.maximum(missing, 0.0)) / _sizes(np.sqrt(np.maximum(energy, 0.0)))
    return np.where(energy > noise, [displacement, stress], np.nan)


def _sizes(responses: Array) -> Array:
    """(12,) what errors are relative to: the response, or a hundredth of the largest of its kind where that is more."""
    return np.concatenate([np.maximum(part, _SMALL * part.max()) for part in np.split(responses, _KINDS)]) + _TINY


def _norms(model: CoupledModel, u: Array) -> Array:
    return np.sqrt(np.maximum(np.einsum("zi,zi->i", u, model.M @ u), 0.0))


def _steady_warnings(displacement: Array) -> tuple[str, ...]:
    wrong = np.nan_to_num(displacement) > _SMALL
    if not wrong.any():
        return ()
    parts = zip(("gravity", "angular acceleration", "spin"), np.split(wrong, _KINDS), strict=True)
    names = [name for name, part in parts if part.any()]
    worst = int(np.nanargmax(displacement))
    return (
        f"the basis cannot represent the steady deformation under {' and '.join(names)}: the displacement is up to "
        f"{displacement[worst]:.0%} off ({ACCELERATIONS[worst]}); add inertia relief, and static shapes of the interfaces",
    )


# ---- in the body --------------------------------------------------------------------------------------------------


def completed(provenance: Mapping[str, Any], basis: Basis, quality: Quality | None) -> dict[str, Any]:
    """The provenance with what the reduction found: dropped vectors, warnings, verification, quality; JSON values."""
    found = dict(provenance)
    warnings = [*found.get("warnings", []), *basis.warnings, *(quality.warnings if quality else ())]
    found["warnings"] = list(dict.fromkeys(warnings))
    if basis.dropped:
        found["dropped_vectors"] = basis.dropped
    if basis.verification is not None:
        found["normal_modes"] = {key: _plain(value) for key, value in vars(basis.verification).items()}
    if quality is not None:
        found["quality"] = {key: _plain(value) for key, value in vars(quality).items() if key != "warnings"}
    return found


def quality_of(provenance: Mapping[str, Any]) -> Quality | None:
    """The quality kept in the provenance of a body; None where it was not assessed.

    >>> quality = fp.quality_of(body.provenance)
    """
    kept = provenance.get("quality")
    if kept is None:
        return None
    values = {
        key: np.array(_numbers(value), float) if isinstance(value, list) else value for key, value in kept.items()
    }
    names, band = tuple(kept["points"]), tuple(kept["band"])
    flexibility = np.nan if kept["flexibility_error"] is None else kept["flexibility_error"]
    return Quality(**values | {"points": names, "band": band, "flexibility_error": flexibility})


def _plain(value: Any) -> Any:
    """JSON values, rounded to six digits; NaN becomes null."""
    if isinstance(value, str):
        return value
    if isinstance(value, (tuple, list, np.ndarray)):
        return [_plain(entry) for entry in value]
    return None if np.isnan(value) else float(f"{value:.{_DIGITS - 1}e}")


def _numbers(value: Any) -> Any:
    if isinstance(value, list):
        return [_numbers(entry) for entry in value]
    return np.nan if value is None or isinstance(value, str) else value
