"""Descriptions of a mesh or a reduced body, in words and numbers, for the terminal."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ffr_prep.body import (
    CONVERTED_FROM,
    CUT_ERROR,
    MESH_ERROR,
    STEADY_STRESS,
    TRUNCATION_ERROR,
    FlexibleBody,
    cut_errors_of,
    errors_of_modes,
    made_of_plates,
)
from ffr_prep.body.interface_freedom import interface_freedom
from ffr_prep.common.arrays import Array
from ffr_prep.common.in_words import percent_in_words, settings_in_words, vector_in_words
from ffr_prep.reduction.quality import Quality, quality_of
from ffr_prep.report.integrals import integral_lines

if TYPE_CHECKING:
    from ffr_prep.mesh.mesh import Mesh

_MOST_MODES = 40
_MOST_NAMES = 20
_MOST_INTERFACES = 24
_CLOSE = 0.01
_NOISE = 1e-6
_UNFELT, _NONE = 1e-4, 1e-9  # of a frequency: what is not told, and what is rounding
_DRAWN = ("outline", "shear")


def mesh_lines(mesh: Mesh) -> Iterator[str]:
    """Size, elements and groups of a mesh."""
    counts: dict[str, int] = {}
    for block in mesh.blocks:
        counts[block.kind] = counts.get(block.kind, 0) + len(block.nodes)
    elements = ", ".join(f"{count} {kind}" for kind, count in counts.items())
    yield f"mesh        {elements}; {len(mesh.points)} nodes, {3 * len(mesh.points)} degrees of freedom"
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    yield f"extent      {vector_in_words(high - low)} m, from {vector_in_words(low)} to {vector_in_words(high)}"
    yield f"surfaces    {_names(mesh.face_groups)}"
    if mesh.node_groups:
        yield f"node sets   {_names(mesh.node_groups)}"
    yield f"volumes     {_names(mesh.volume_groups)}"
    for note in mesh.notes:
        yield f"note        {note}"


def body_lines(body: FlexibleBody) -> Iterator[str]:
    """Everything worth knowing of a body before it is used."""
    yield f"body        {body.name}, {body.n} elastic coordinates"
    yield from _mass_lines(body)
    yield from _interface_lines(body)
    yield from _region_lines(body.provenance)
    yield from _choice_lines(body.provenance)
    yield from mode_lines(body)
    yield from frequency_error_lines(body.provenance)
    yield from damping_lines(body)
    yield from verification_lines(body.provenance)
    yield from integral_lines(body)
    yield from ability_lines(body)
    yield from part_lines(body)
    yield from quality_lines(body)
    yield from _origin_lines(body.provenance)


def short_lines(body: FlexibleBody) -> Iterator[str]:
    """A body in a few lines."""
    yield f"mass        {body.mass:.6g} kg, centre of mass {vector_in_words(body.centre_of_mass, _size(body))} m"
    yield from _interface_lines(body)
    yield from _region_lines(body.provenance)
    if body.n:
        shown = ", ".join(f"{f:.4g}" for f in body.frequencies[:6])
        yield f"modes       {body.n}: {shown}{', ...' if body.n > 6 else ''} Hz"
    yield from frequency_error_lines(body.provenance)
    yield from damping_lines(body)
    yield from part_lines(body)
    yield from quality_lines(body)
    for warning in body.provenance.get("warnings", []):
        yield f"warning     {warning}"


# ---- parts --------------------------------------------------------------------------------------------------------


def _mass_lines(body: FlexibleBody) -> Iterator[str]:
    principal, axes = np.linalg.eigh(body.central_inertia)
    axes = axes * np.sign(axes[np.argmax(np.abs(axes), axis=0), range(3)])
    yield f"mass        {body.mass:.6g} kg"
    yield f"centre      {vector_in_words(body.centre_of_mass)} m"
    yield from _tensor_lines("inertia     about origin  ", body.inertia)
    yield from _tensor_lines(f"{'':12}about centre  ", body.central_inertia)
    for moment, axis in zip(principal, axes.T, strict=True):
        yield f"{'':12}principal     {moment:12.5g} kg m^2 about {vector_in_words(axis)}"


def _tensor_lines(label: str, tensor: Array) -> Iterator[str]:
    shown = np.where(np.abs(tensor) < _NOISE * np.abs(tensor).max(), 0.0, tensor) + 0.0
    for k, row in enumerate(shown):
        yield f"{label if k == 0 else '':26}" + " ".join(f"{x:12.5g}" for x in row) + (" kg m^2" if k == 0 else "")


def _interface_lines(body: FlexibleBody) -> Iterator[str]:
    width = max((len(i.name) for i in body.interfaces[:_MOST_INTERFACES]), default=0)
    size = _size(body)
    for k, interface in enumerate(body.interfaces[:_MOST_INTERFACES]):
        label = "interfaces" if k == 0 else ""
        where = (
            f"{label:12}{interface.name:{width}}  {interface.kind:5}  at {vector_in_words(interface.position, size)} m"
        )
        yield where + _region_in_words(body.provenance, interface.name)
    if len(body.interfaces) > _MOST_INTERFACES:
        yield f"{'':12}{len(body.interfaces) - _MOST_INTERFACES} more"


def _size(body: FlexibleBody) -> float:
    """The root of the mean square of the distances of its mass from the origin [m]."""
    return float(np.sqrt(np.trace(body.rr_dm) / body.mass)) if body.mass > 0 else 0.0


def _region_in_words(provenance: Mapping[str, Any], name: str) -> str:
    """The region of an interface as it was asked for, with the faces that were found; empty where it is called like it."""
    for entry in provenance.get("interfaces", ()):
        if isinstance(entry, Mapping) and entry.get("name") == name and entry.get("region") not in (None, name):
            faces = "+".join(entry.get("faces", ()))
            return f": {entry['region']}" + (f" ({faces})" if faces not in ("", entry["region"]) else "")
    return ""


def _region_lines(provenance: Mapping[str, Any]) -> Iterator[str]:
    """The regions of the surface that a body keeps for pressures."""
    for k, (name, triangles) in enumerate(provenance.get("regions", {}).items()):
        yield f"{'regions' if k == 0 else '':12}{name}: {len(triangles)} triangles of the surface"


def part_lines(body: FlexibleBody) -> Iterator[str]:
    """The parts that a body is cut into: of each its mass, coordinates and interfaces; and how much its cuts stiffen it."""
    for k, part in enumerate(body.parts):
        names = ", ".join(interface.name for interface in part.interfaces)
        yield f"{'' if k else 'parts':12}{part.name}  {part.mass:.5g} kg, {part.n} elastic coordinates, {names}"
    errors = cut_errors_of(body.provenance)
    if body.parts and errors:
        felt = [f"{percent_in_words(error)} ({mode})" for mode, error in enumerate(errors, 1) if error >= _UNFELT]
        each = f"{', '.join(felt)}; in brackets the mode" if felt else f"less than {percent_in_words(_UNFELT)}"
        yield f"cut error   frequencies of the free body too high by {each}"


def mode_lines(body: FlexibleBody) -> Iterator[str]:
    """A table of frequencies, effective masses P_dm^2 and effective inertias I4^2 about the origin."""
    if not body.n:
        return
    yield "modes       frequency   effective mass along x, y, z, in % of the mass; effective inertia about them, in %"
    whole = np.array([body.mass] * 3 + list(np.diag(body.inertia)))
    shares = 100 * np.vstack([body.P_dm, body.I4]).T ** 2 / whole
    for k in range(min(body.n, _MOST_MODES)):
        yield f"{k + 1:7d}  {body.frequencies[k]:12.6g} Hz  " + " ".join(f"{share:7.2f}" for share in shares[k])
    if body.n > _MOST_MODES:
        yield f"{'':9}{body.n - _MOST_MODES} more up to {body.frequencies[-1]:.6g} Hz"
    yield f"{'sum':>7}  {'':15}  " + " ".join(f"{total:7.2f}" for total in shares.sum(axis=0))


def frequency_error_lines(provenance: Mapping[str, Any]) -> Iterator[str]:
    """How much too high frequencies are by the size of the elements and by the shapes left out, as far as that is known."""
    before = " under the reference conditions of its reduction" if CONVERTED_FROM in provenance else ""
    alone = "; of plates without their bending" if made_of_plates(provenance) else ""
    for kind, label, limits in ((MESH_ERROR, "mesh error", alone), (TRUNCATION_ERROR, "modes error", "")):
        errors = errors_of_modes(provenance, kind)
        if any(error > _NONE for error in errors.values()):
            each = ", ".join(f"{percent_in_words(error)} ({mode})" for mode, error in errors.items())
            yield f"{label:12}frequencies too high by about {each}; in brackets the mode{before}{limits}"


def damping_lines(body: FlexibleBody) -> Iterator[str]:
    """The damping ratios that the matrix of a body gives its modes, and whether it couples them."""
    if body.damping is None:
        return
    rates, omega = np.diag(body.damping), np.sqrt(body.omega2)
    ratios = rates / np.where(omega > 0, 2 * omega, np.inf)
    beside = np.abs(body.damping - np.diag(rates)).max(initial=0.0)
    coupled = ", coupled with each other" if beside > _NOISE * rates.max() else ""
    yield f"damping     ratios {ratios.min():.3g} to {ratios.max():.3g} of the modes{coupled}"


def verification_lines(provenance: Mapping[str, Any]) -> Iterator[str]:
    """The result of the verification of the normal modes, where it was asked for (`Solver.verify`)."""
    if found := provenance.get("normal_modes"):
        below = np.sqrt(found["below"]) / (2 * np.pi)
        yield (
            f"verified    {len(found['residuals'])} normal modes, residuals up to {max(found['residuals']):.1e}; by a Sturm "
            f"count {found['counted']:.0f} lie below {below:.6g} Hz: none is missing"
        )


def ability_lines(body: FlexibleBody) -> Iterator[str]:
    """Motions that the elastic coordinates can represent, and those that they cannot."""
    if not body.n:
        yield "ability     a rigid body: it does not deform"
        return
    yield f"ability     {_range_in_words(body)}"
    if body.interfaces:
        yield f"{'':12}{_interfaces_in_words(body)}"
    yield f"{'':12}small strains and small elastic rotations; the motion of the body itself may be large"


def _range_in_words(body: FlexibleBody) -> str:
    """Modal truncation leaves little error up to about half the highest normal mode kept.

    The rule of practice for component modes is to keep those up to 1.5 to 2 times the range of interest: R. R. Craig,
    A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed. (2006), chapter 17.
    """
    kept = _kept(body.provenance.get("reduction", {}), body.n)
    if isinstance(kept, Mapping):
        top = kept["frequency"] / 2 if kept["type"] == "UpTo" else kept["band"]["high"]
        return f"vibration up to about {top:.3g} Hz, as its modes were chosen"
    if not 0 < kept <= body.n:
        return "slow deformation only: no normal mode was kept"
    return f"vibration up to about {body.frequencies[kept - 1] / 2:.3g} Hz, half the frequency of mode {kept}"


def _kept(reduction: Mapping[str, Any], n: int) -> Any:
    """The number of normal modes that was asked for: by a reduction, or by the first part of a union that has any."""
    parts = [part for part in reduction.get("parts", [reduction]) if "modes" in part]
    return parts[0]["modes"] if parts else 0 if "type" in reduction else n


def _interfaces_in_words(body: FlexibleBody) -> str:
    possible, wanted = interface_freedom(body)
    if possible == wanted:
        return f"every motion of the interfaces: all {wanted} coordinates can move independently"
    return (
        f"only {possible} independent motions of the {wanted} interface coordinates: where joints or forces act, keep "
        "more modes or use craig-bampton"
    )


def quality_lines(body: FlexibleBody) -> Iterator[str]:
    """How far the body is from the full model, where that was found out."""
    quality = quality_of(body.provenance)
    if quality is None:
        return
    low, high = quality.band
    yield f"quality     against the full model, {low:.4g} to {high:.4g} Hz"
    yield f"{'':12}frequencies under the reference conditions: {_frequencies_in_words(quality)}"
    if quality.points:
        off = percent_in_words(quality.flexibility_error)
        yield f"{'':12}static flexibility of the free body at the interfaces: {off} off"
        yield f"{'':12}receptances there: {_receptances_in_words(quality)}"
    yield from _steady_lines(quality)


def _frequencies_in_words(quality: Quality) -> str:
    inside = quality.mode_frequencies[: quality.frequency_errors.size] <= quality.band[1]
    missing = int(np.sum(quality.mode_frequencies <= quality.band[1])) - int(inside.sum())
    lost = f"; {missing} of the full model are missing" if missing else ""
    errors = quality.frequency_errors[inside]
    if not errors.size:
        return f"none within the band{lost}"
    worst = int(np.argmax(errors))
    return (
        f"{errors.size} within the band, off by up to {percent_in_words(errors[worst])} "
        f"(at {quality.mode_frequencies[worst]:.4g} Hz){lost}"
    )


def _receptances_in_words(quality: Quality) -> str:
    wrong = quality.receptance_errors > _CLOSE
    worst = int(np.argmax(quality.receptance_errors))
    off = f"off by up to {percent_in_words(quality.receptance_errors[worst])} (at {quality.frequencies[worst]:.4g} Hz)"
    if not wrong.any():
        return off
    first = int(np.argmax(wrong))
    return f"within {_CLOSE:.0%} up to {quality.frequencies[first - 1]:.4g} Hz, {off}" if first else off


def _steady_lines(quality: Quality) -> Iterator[str]:
    yield f"{'':12}{'steady deformation by':24}{'displacement':>18}  {'stress, largest error':>21}"
    parts = zip(("gravity", "angular acceleration", "spin"), (slice(0, 3), slice(3, 6), slice(6, 12)), strict=True)
    for name, part in parts:
        both = [_largest(errors[part]) for errors in (quality.displacement_errors, quality.stress_errors)]
        yield f"{'':14}{name:22}{both[0]:>18}  {both[1]:>21}"


def _largest(errors: Array) -> str:
    return "no deformation" if np.isnan(errors).all() else percent_in_words(float(np.nanmax(errors)))


def _choice_lines(provenance: Mapping[str, Any]) -> Iterator[str]:
    for key in ("reduction", "reference", "material"):
        if key in provenance:
            yield f"{key:12}{settings_in_words(provenance[key])}"


def _origin_lines(provenance: Mapping[str, Any]) -> Iterator[str]:
    for key, value in provenance.items():
        if value and key not in (
            "reduction",
            "reference",
            "material",
            "interfaces",
            "warnings",
            "quality",
            "normal_modes",
            "held_body",
            MESH_ERROR,
            TRUNCATION_ERROR,
            STEADY_STRESS,
            CUT_ERROR,
            "regions",
            "command",
        ):
            yield from _entry_lines(key.replace("_", " "), value)
    if provenance.get("command"):
        yield f"command     ffr-prep {shlex.join(map(str, provenance['command']))}"
    for warning in provenance.get("warnings", []):
        yield f"warning     {warning}"


def _entry_lines(label: str, value: Any) -> Iterator[str]:
    """A line of an entry, and of several like it (members, parts by name) one of each."""
    several: list[Any] = [value]
    if isinstance(value, list) and all(isinstance(one, Mapping) for one in value):
        several = value
    elif isinstance(value, Mapping) and all(isinstance(one, Mapping) for one in value.values()):
        several = [{name: one} for name, one in value.items()]
    for k, one in enumerate(several):
        yield f"{label if k == 0 else '':11} {settings_in_words(_undrawn(one))}"


def _undrawn(value: Any) -> Any:
    """Without the points that are drawn of a section and the shear there, long tables that its shape implies."""
    if isinstance(value, list):
        return [_undrawn(one) for one in value]
    if not isinstance(value, Mapping):
        return value
    left_out = _DRAWN if value.get("type") == "Section" else ()
    return {key: _undrawn(one) for key, one in value.items() if key not in left_out}


def _names(groups: Mapping[str, object]) -> str:
    names = list(groups)
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return ", ".join(names[:_MOST_NAMES]) + more if names else "none named"
