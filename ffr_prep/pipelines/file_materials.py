"""Materials that mesh files of other programs carry, in SI units: Abaqus and CalculiX (.inp), Nastran (.bdf).

Such files have no units. Lengths are known to the user; stress and density follow from the system of units, which is one of
those with that length in which every material of the file is a solid.

Source: Abaqus Keywords Reference Guide (*MATERIAL, *ELASTIC, *DENSITY, *SOLID SECTION); MSC Nastran Quick Reference Guide
(MAT1, PSOLID).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isnan, nan
from pathlib import Path

from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS, UnitSystem
from ffr_prep.mesh.abaqus import keyword_sections
from ffr_prep.mesh.bulk_data import Card, cards
from ffr_prep.mesh.geometry.face import METRES
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.model.material import Material, Solid, orthotropic

_ABAQUS, _NASTRAN = (".inp",), (".bdf", ".nas", ".fem", ".dat")
CARRIERS = (*_ABAQUS, *_NASTRAN)
_STIFFEST, _SOFTEST = (
    3e12,
    1e6,
)  # Pa; what is softer is more often N/mm^2 beside kg/m^3 than a foam, which --material gives
_LIGHTEST, _HEAVIEST = 20.0, 3e4  # kg/m^3
_SAME_SHEAR = 0.01  # of G: from here on Nastran, too, warns of a MAT1
_SYSTEMS: Mapping[str, UnitSystem] = {**UNIT_SYSTEMS, "mm-g-ms": UnitSystem(1e-3, 1e-3, 1e-3)}


# What materials of Abaqus have beside elasticity that a linear body has not.
_BEYOND = ("CREEP", "DAMPING", "PLASTIC", "VISCOELASTIC")


@dataclass
class _Constants:
    """Of a material in the units of its file: E, nu, or nine of an orthotropic one; rho; and words on what is not taken."""

    name: str
    elastic: tuple[float, ...] = ()
    rho: float | None = None
    kind: str = "ISOTROPIC"
    words: str = ""

    @property
    def told(self) -> str:
        """The name with the words."""
        return self.name + self.words


def file_materials(path: str | Path, mesh: Mesh, *, unit: str | None = None) -> Mapping[str, Solid]:
    """The materials of a mesh file by volume group of its mesh, in SI units.

    unit : of the lengths in the file, as in `read_mesh`; without it metres

    Raises InputError for a file without materials, with others than elastic ones, or in units that do not fit.

    >>> mesh = fp.read_mesh("part.inp", unit="mm")
    >>> model = fp.from_mesh(mesh, fp.file_materials("part.inp", mesh, unit="mm"), [...])
    """
    path = Path(path)
    with reading(path, "a mesh with materials"):
        try:
            return _materials(path, mesh, unit)
        except InputError as error:
            raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from None


def _materials(path: Path, mesh: Mesh, unit: str | None) -> dict[str, Solid]:
    found, of_group = _read(path)
    groups = {name.upper(): name for name in mesh.volume_groups}
    used = {groups[key]: found[name] for key, name in of_group.items() if key in groups and name in found}
    if not used:
        raise InputError(
            f"{path} has no material for its elements; give --material (in Python the material of from_mesh)"
        )
    system = _SYSTEMS[unit_system(path, list(used.values()), unit)]
    return {group: _solid(path, one, system) for group, one in used.items()}


def names_of_materials(path: Path) -> list[str]:
    """Names of the materials in a mesh file; none in files that carry none."""
    if path.suffix.lower() not in CARRIERS:
        return []
    with reading(path, "a mesh with materials"):
        return sorted(one.told for one in _read(path)[0].values())


def unit_system(path: Path, materials: list[_Constants], unit: str | None) -> str:
    """The name of the system of units with that length in which these are solids. Raises InputError for none or several."""
    length = METRES[unit or "m"]
    fitting = [name for name, system in _SYSTEMS.items() if all(_is_solid(one, system) for one in materials)]
    of_length = [name for name in fitting if _SYSTEMS[name].length == length]
    if len(of_length) == 1:
        return of_length[0]
    first = materials[0]
    other = sorted({name.split("-")[0] for name in fitting} & set(METRES))
    hint = (
        f"they are a solid's in {' or '.join(fitting)}: give --unit {other[0]}"
        if other
        else "give --material in SI units"
    )
    raise InputError(
        f"{path}: material {first.name!r} has E = {first.elastic[0]:g} and density {first.rho:g}, with lengths in "
        f"{unit or 'm'} {'no solid in any system of units' if not of_length else 'a solid in several'}; {hint}"
    )


def _is_solid(one: _Constants, system: UnitSystem) -> bool:
    if not one.elastic or one.rho is None:
        raise InputError(
            f"material {one.name!r} lacks {'its density' if one.elastic else 'constants of linear elasticity'}; give "
            "--material"
        )
    E, rho = one.elastic[0] * _pressure(system), one.rho * system.mass / system.length**3
    return _SOFTEST < E < _STIFFEST and _LIGHTEST < rho < _HEAVIEST


def _pressure(system: UnitSystem) -> float:
    return system.mass / (system.length * system.time**2)


def _solid(path: Path, one: _Constants, system: UnitSystem) -> Solid:
    p, e = _pressure(system), one.elastic
    rho = (one.rho or 0.0) * system.mass / system.length**3
    if one.kind == "ISOTROPIC":
        return Material(one.told, e[0] * p, e[1], rho)
    moduli, shear = (e[0] * p, e[1] * p, e[2] * p), (e[6] * p, e[7] * p, e[8] * p)
    return orthotropic(one.told, E=moduli, nu=(e[3], e[4], e[5]), G=shear, rho=rho)


# ---- files --------------------------------------------------------------------------------------------------------


def _read(path: Path) -> tuple[dict[str, _Constants], dict[str, str]]:
    """Materials by name, and the name of the material of each group (in capitals)."""
    if path.suffix.lower() in _ABAQUS:
        return _of_abaqus(path)
    if path.suffix.lower() in _NASTRAN:
        return _of_nastran(path)
    raise InputError(f"{path}: materials are read from {', '.join(CARRIERS)}; give --material")


def _of_abaqus(path: Path) -> tuple[dict[str, _Constants], dict[str, str]]:
    found: dict[str, _Constants] = {}
    of_group: dict[str, str] = {}
    oriented: set[str] = set()  # materials, which are alike in all directions or have axes that are not read
    turned = False  # the one part by its instance, and its material with it
    current = _Constants("")
    for keyword, parameters, rows in keyword_sections(path):
        if keyword == "MATERIAL":
            current = found.setdefault(parameters.get("NAME", "").upper(), _Constants(parameters.get("NAME", "")))
        elif keyword == "ELASTIC" and rows:
            kind, elastic = _elastic(current, parameters, rows)
            _once(f"material {current.name!r}", "*ELASTIC", current.elastic, elastic)
            current.kind, current.elastic = kind, elastic
            current.words += _temperature(rows, *((1, 2) if kind == "ISOTROPIC" else (2, 1)))
        elif keyword in _BEYOND:
            current.words += f", without its *{keyword}"
        elif keyword == "DENSITY" and rows:
            rho = _numbers(rows[:1])[0]
            _once(f"material {current.name!r}", "*DENSITY", current.rho, rho)
            current.rho = rho
            at = _temperature(rows, 1, 1)
            current.words += f" with its density{at}" if at else ""
        elif keyword == "SOLID SECTION":
            group, name = (parameters.get(key, "").upper() for key in ("ELSET", "MATERIAL"))
            _once(f"element set {group!r}", "material", of_group.get(group), name)
            of_group[group] = name
            oriented |= {name} if "ORIENTATION" in parameters else set()
        elif keyword == "INSTANCE":
            turned = len(rows) > 1
    if any(found[name].kind != "ISOTROPIC" for name in (set(found) if turned else oriented & set(found))):
        why = "an instance turns its part" if turned else "a section has an ORIENTATION, which is not read"
        raise InputError(f"{path}: {why}; give --material with axes")
    return found, of_group


def _once(what: str, given: str, before: object, now: object) -> None:
    """InputError for a second value beside another."""
    if before and before != now:
        raise InputError(f"{what} is given its {given} twice, and not the same: take one out, or give --material")


def _elastic(
    material: _Constants, parameters: Mapping[str, str], rows: list[list[str]]
) -> tuple[str, tuple[float, ...]]:
    """The kind, and the constants at the first temperature."""
    kind = parameters.get("TYPE", "ISOTROPIC").upper()
    if kind in ("ISOTROPIC", "ISO"):
        values = _numbers(rows[:1])
        if len(values) >= 2:
            return "ISOTROPIC", tuple(values[:2])
    elif kind == "ENGINEERING CONSTANTS":
        values = _numbers(rows)
        if len(values) >= 9:
            return kind, tuple(values[:9])
    raise InputError(
        f"material {material.name!r}: *ELASTIC of TYPE {kind} with {len(rows)} lines is not read; isotropic constants and "
        "ENGINEERING CONSTANTS are. Give --material"
    )


def _temperature(rows: list[list[str]], each: int, at: int) -> str:
    """Words for the temperature to which the first constants belong, where there are some for several.

    each : rows of the constants at one temperature, which stands in column `at` of the last of them
    """
    columns = [*rows[each - 1], *[""] * at]
    return f" at {columns[at] or 0}, the first of {len(rows) // each} temperatures" if len(rows) > each else ""


def _numbers(rows: list[list[str]]) -> list[float]:
    try:
        return [float(re.sub("[dD]", "e", word)) for row in rows for word in row if word]
    except ValueError as error:
        raise InputError(
            f"a material has a constant that is no number ({error}); correct it, or give --material"
        ) from None


def _of_nastran(path: Path) -> tuple[dict[str, _Constants], dict[str, str]]:
    found: dict[str, _Constants] = {}
    of_group: dict[str, str] = {}
    mass = 1.0  # of a unit of density: decks whose densities are weights say so
    for card in cards(path):
        if card.name == "MAT1":
            number, one = str(card.integer(1)), _of_mat1(card)
            _once(f"material {number}", "MAT1", found.get(number), one)
            found[number] = one
        elif card.name == "PSOLID":
            group, number = f"PROPERTY_{card.integer(1)}", str(card.integer(2))
            _once(f"property {card.integer(1)}", "PSOLID", of_group.get(group), number)
            of_group[group] = number
        elif card.name in ("MAT9", "MAT2", "MAT8"):
            found[str(card.integer(1))] = _Constants(f"{card.name} {card.integer(1)}")
        elif card.name == "PARAM" and card.text(1).upper() == "WTMASS":
            mass = card.real(2)
    return {number: replace(of, rho=of.rho and mass * of.rho) for number, of in found.items()}, of_group


def _of_mat1(card: Card) -> _Constants:
    """E and nu, which solids take whatever G stands beside them; of a blank one from G."""
    E, G, nu = (card.real(k, nan) for k in (2, 3, 4))
    shear = 0.0 if isnan(G) else G
    if isnan(nu):
        nu = E / (2 * shear) - 1 if shear and not isnan(E) else 0.0
    if isnan(E):
        E = 2 * shear * (1 + nu) if card.text(4) else 0.0
    off = bool(shear) and nu > -1 and abs(E / (2 * (1 + nu) * shear) - 1) > _SAME_SHEAR
    words = (
        f" by its E and nu, which make a shear modulus of {E / (2 * (1 + nu)):.6g} and not its G, {G:g}" if off else ""
    )
    return _Constants(f"MAT1 {card.integer(1)}", (E, nu), card.real(5, 0.0) or None, words=words)
