"""Materials: constants of linear elasticity, a small library, and the text form of the command line.

The order of stress and strain components is xx, yy, zz, xy, xz, yz, that of the stress of bodies and of Abaqus (many books
have yz, xz, xy), with engineering shear strains, twice the tensor's.

Source: T. C. T. Ting, Anisotropic Elasticity (1996), chapter 2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from ffr_prep.body import TENSOR
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError, require_kind
from ffr_prep.common.reading import read_toml
from ffr_prep.common.units import si_number

Rows = tuple[tuple[float, ...], ...]

_LIGHTEST = 1e-3  # kg/m^3; aerogels have about 1
_FOAM, _HEAVIEST = 10.0, 2.3e4  # kg/m^3
_FASTEST = 3e4  # m/s, sqrt(E/rho); diamond has 18000
_SLOWEST, _SLOWEST_DENSE = 1.0, 30.0  # of gels and foams, and of what is denser than _DENSE
_DENSE = 2000.0  # kg/m^3, of which no gel is
_ASYMMETRY = 1e-6  # of a matrix that was typed or printed with six digits


@dataclass(frozen=True)
class Material:
    """An isotropic linear elastic solid.

    E : Young's modulus [Pa];  nu : Poisson's ratio [1];  rho : density [kg/m^3]

    Raises InputError for values no solid can have: E and rho must be positive, nu between -1 and 0.5.

    >>> steel = fp.Material("steel", E=210e9, nu=0.3, rho=7850.0)
    """

    name: str
    E: float
    nu: float
    rho: float

    def __post_init__(self) -> None:
        if not 0 < self.E < math.inf:
            raise InputError(f"material {self.name!r}: Young's modulus E is {self.E:g} Pa; it must be positive")
        if not -1 < self.nu < 0.5:
            raise InputError(f"material {self.name!r}: Poisson's ratio nu is {self.nu:g}; it must be in (-1, 0.5)")
        _check_density(self.name, self.rho)

    def elasticity_tensor(self) -> Array:
        """C (3, 3, 3, 3) [Pa], stress_ij = C_ijkl strain_kl."""
        lam = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        mu = self.E / (2 * (1 + self.nu))
        one = np.eye(3)
        symmetric = np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)
        return np.asarray(lam * np.einsum("ij,kl->ijkl", one, one) + mu * symmetric)

    def engineering_constants(self) -> tuple[float, float]:
        """Young's modulus [Pa] and Poisson's ratio, which give the strain of a stress."""
        return self.E, self.nu


@dataclass(frozen=True)
class AnisotropicMaterial:
    """A linear elastic solid whose stiffness depends on the direction, such as wood, a ply or a single crystal.

    elasticity : (6, 6) [Pa], stress from strain, components xx, yy, zz, xy, xz, yz, engineering shear strains; in the axes
                 of the material
    rho        : density [kg/m^3]
    axes       : (3, 3) rotation, whose columns are the axes of the material in those of the body; or (2, 3), the first axis
                 of the material and another direction in its first plane, of any length

    Raises InputError for a matrix that is not symmetric and positive definite, and for axes that are no rotation.

    >>> ply = fp.AnisotropicMaterial("ply", elasticity=C, rho=1600.0)  # C (6, 6) [Pa]
    """

    name: str
    elasticity: Rows
    rho: float
    axes: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        C, axes = (_matrix(self.name, what, getattr(self, what)) for what in ("elasticity", "axes"))
        _check_elasticity(self.name, C)
        _check_density(self.name, self.rho)
        object.__setattr__(self, "elasticity", _rows((C + C.T) / 2))
        object.__setattr__(self, "axes", _rows(_rotation(self.name, axes)))

    def elasticity_tensor(self) -> Array:
        """C (3, 3, 3, 3) [Pa] in the axes of the body, stress_ij = C_ijkl strain_kl."""
        place = np.zeros((3, 3), int)
        for k, (i, j) in enumerate(TENSOR):
            place[i, j] = place[j, i] = k
        R, C = np.array(self.axes), np.array(self.elasticity)[place[:, :, None, None], place]
        return np.asarray(np.einsum("ia,jb,kc,ld,abcd->ijkl", R, R, R, R, C, optimize=True))

    def engineering_constants(self) -> tuple[float, float]:
        """Zeros: the strain of a stress takes more than two constants."""
        return 0.0, 0.0


Solid = Material | AnisotropicMaterial


def check_isotropic(material: Solid, owner: str) -> None:
    """InputError where beams and plates are given an anisotropic material, or none."""
    require_kind(material, Material | AnisotropicMaterial, f"{owner}: material", "one such as material('steel')")
    if not isinstance(material, Material):
        raise InputError(
            f"{owner}: material {material.name!r} is not isotropic, as beams and plates must be: mesh the part as a solid"
        )


def orthotropic(
    name: str,
    *,
    E: tuple[float, float, float],
    nu: tuple[float, float, float],
    G: tuple[float, float, float],
    rho: float,
    axes: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
) -> AnisotropicMaterial:
    """A material with three planes of symmetry.

    E  : (E1, E2, E3) Young's moduli [Pa];  G : (G12, G13, G23) shear moduli [Pa];  rho : density [kg/m^3]
    nu : [1] (nu12, nu13, nu23), where nu12 is the contraction along 2 under tension along 1, so nu21 = nu12 E2 / E1

    Raises InputError for constants that no solid can have.

    >>> wood = fp.orthotropic("pine", E=(11e9, 0.9e9, 0.5e9), nu=(0.4, 0.4, 0.4), G=(0.7e9, 0.6e9, 0.1e9), rho=500.0)
    """
    if not (np.array([*E, *G]) > 0).all():
        raise InputError(f"material {name!r}: E {E} and G {G} must be positive [Pa]")
    compliance = np.diag([1 / E[0], 1 / E[1], 1 / E[2], 1 / G[0], 1 / G[1], 1 / G[2]])
    for (i, j), ratio in zip(((0, 1), (0, 2), (1, 2)), nu, strict=True):
        compliance[i, j] = compliance[j, i] = -ratio / E[i]
    if not np.isfinite(_scaled(compliance)).all() or not np.linalg.eigvalsh(_scaled(compliance)).min() > 0:
        raise InputError(
            f"material {name!r}: Poisson's ratios nu12, nu13, nu23 = {nu} are impossible with the moduli {E} Pa (the "
            "elastic energy would be negative): is nu21 meant where nu12 = nu21 E1 / E2 stands?"
        )
    return AnisotropicMaterial(name, _rows(np.linalg.inv(compliance)), rho, axes)


def _matrix(name: str, what: str, rows: Rows) -> Array:
    try:
        return np.array(rows, float)
    except (ValueError, TypeError):
        raise InputError(f"material {name!r}: {what} must be rows of numbers of equal length, not {rows!r}") from None


def _rows(A: Array) -> Rows:
    return tuple(tuple(row) for row in A.tolist())


def _scaled(A: Array) -> Array:
    """The matrix with ones on its diagonal, which must be positive."""
    root = np.sqrt(A.diagonal())
    return A / np.outer(root, root)


def _check_density(name: str, rho: float) -> None:
    if not 0 < rho < math.inf:
        raise InputError(f"material {name!r}: density rho is {rho:g} kg/m^3; it must be positive")
    if rho < _LIGHTEST:
        raise InputError(
            f"material {name!r}: density rho is {rho:g} kg/m^3, less than any solid's, as in tonnes and "
            "millimetres; give SI units (steel: E=2.1e11,nu=0.3,rho=7850)"
        )


def density_doubts(rho: float) -> list[str]:
    """What is doubtful about a density [kg/m^3], in words: it may be in other units."""
    if rho < _FOAM:
        return [f"its density is {rho:g} kg/m^3, that of the lightest foams: is it in g/cm^3? Steel has 7850 kg/m^3"]
    if rho > _HEAVIEST:
        return [
            f"its density is {rho:g} kg/m^3, more than that of any solid: is it in another unit? Steel has 7850 kg/m^3"
        ]
    return []


def material_doubts(material: Material | AnisotropicMaterial) -> list[str]:
    """What is doubtful about a material, in words: its density, and its stiffness against that."""
    E, rho = material.engineering_constants()[0], material.rho
    slowest = _SLOWEST if rho < _DENSE else _SLOWEST_DENSE
    speed = math.sqrt(E / rho)
    off = not slowest <= speed <= _FASTEST and E > 0
    said = [
        f"sqrt(E/rho) is {speed:.2g} m/s with E = {E:.3g} Pa and rho = {rho:.3g} kg/m^3, of solids some 10 to 18000 m/s: are "
        "both in SI units? Steel has E=2.1e11,rho=7850"
    ]
    return [f"material {material.name!r}: {doubt}" for doubt in [*density_doubts(rho), *(said if off else [])]]


def _check_elasticity(name: str, C: Array) -> None:
    if C.shape != (6, 6) or not np.isfinite(C).all():
        raise InputError(f"material {name!r}: elasticity has the shape {C.shape}; it must be 6 x 6 finite numbers [Pa]")
    skew = np.abs(C - C.T)
    if skew.max() > _ASYMMETRY * np.abs(C).max():
        i, j = np.unravel_index(np.argmax(skew), skew.shape)
        raise InputError(
            f"material {name!r}: elasticity is not symmetric: [{i}, {j}] is {C[i, j]:g} and [{j}, {i}] is {C[j, i]:g} Pa"
        )
    if not C.diagonal().min() > 0 or not np.linalg.eigvalsh(_scaled((C + C.T) / 2)).min() > 0:
        raise InputError(
            f"material {name!r}: elasticity is not positive definite, so some strain would cost no energy: check its "
            "entries and the order of its components, xx, yy, zz, xy, xz, yz"
        )


def _rotation(name: str, axes: Array) -> Array:
    """(3, 3) the rotation that is given, or the one of two axes."""
    if axes.shape == (2, 3) and np.linalg.norm(np.cross(*axes)) > 1e-6 * np.prod(np.linalg.norm(axes, axis=1)):
        third = np.cross(*axes)
        columns = np.stack([axes[0], np.cross(third, axes[0]), third], axis=1)
        return np.asarray(columns / np.linalg.norm(columns, axis=0))
    if axes.shape != (3, 3) or not np.allclose(axes.T @ axes, np.eye(3), atol=1e-6) or np.linalg.det(axes) < 0:
        raise InputError(
            f"material {name!r}: axes {axes.tolist()} are neither a 3 x 3 rotation matrix nor two directions that differ"
        )
    return axes


# Typical values at room temperature, rounded, as tabulated in W. D. Callister, D. G. Rethwisch, Materials Science and
# Engineering (2014), appendix B (metals), and M. F. Ashby, Materials Selection in Mechanical Design (2011), appendix A
# (plastics). Alloys and heats differ by several per cent, plastics by more: give measured values where it matters.
_LIBRARY = {
    "steel": (2.1e11, 0.30, 7850.0),
    "stainless steel": (1.93e11, 0.30, 8000.0),
    "aluminium": (7.0e10, 0.33, 2700.0),
    "titanium": (1.14e11, 0.34, 4430.0),
    "magnesium": (4.5e10, 0.35, 1770.0),
    "copper": (1.15e11, 0.33, 8940.0),
    "brass": (1.10e11, 0.35, 8530.0),
    "grey cast iron": (1.1e11, 0.26, 7200.0),
    "ductile cast iron": (1.69e11, 0.275, 7100.0),
    "nylon": (2.7e9, 0.39, 1140.0),
    "pom": (3.0e9, 0.35, 1410.0),
    "abs": (2.3e9, 0.37, 1050.0),
    "pmma": (2.8e9, 0.38, 1190.0),
}
_ALIASES = {
    "aluminum": "aluminium",
    "cast iron": "grey cast iron",
    "pa66": "nylon",
    "acetal": "pom",
    "ti-6al-4v": "titanium",
    "az31": "magnesium",
    "304": "stainless steel",
}


def material(name: str) -> Material:
    """The material of that name in the library; InputError lists the nearest names.

    >>> steel = fp.material("steel")
    """
    key = name.strip().lower().replace("_", " ")
    key = _ALIASES.get(key, key)
    if key not in _LIBRARY:
        near = get_close_matches(key, [*_LIBRARY, *_ALIASES], n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}?" if near else f"there are: {', '.join(library_names())}"
        raise InputError(f"no material {name!r} in the library; {hint} Or give E=...,nu=...,rho=... in SI units")
    return Material(key, *_LIBRARY[key])


def library_names() -> tuple[str, ...]:
    """The names in the library."""
    return tuple(_LIBRARY)


def parse_material(text: str) -> Solid:
    """A library name, "E=7e10,nu=0.3,rho=5540" in SI units, optionally with "name=...", or the name of a .toml file.

    Of an orthotropic material the constants are E1, E2, E3, nu12, nu13, nu23, G12, G13, G23 and rho, in the axes of the mesh.
    A file has the same keys, or `elasticity`, six rows of six, with `rho`; and `axes`, three rows of a rotation matrix or two
    directions, where those of the material are turned.

    Raises InputError for a missing, unknown or unreadable value.
    """
    if text.endswith(".toml"):
        return _of_values(text, _file(Path(text)), "")
    if "=" not in text:
        return material(text)
    given = _assignments(text)
    numbers = {key: _number(text, key, value) for key, value in given.items() if key in _NUMBERS}
    return _of_values(text, given | numbers, "; write E=2.1e11,nu=0.3,rho=7850 in SI units")


def _isotropic(name: str, of: Mapping[str, Any]) -> Material:
    return Material(name, of["E"], of["nu"], of["rho"])


def _orthotropic(name: str, of: Mapping[str, Any]) -> AnisotropicMaterial:
    E, nu, G = (tuple(of[key] for key in keys) for keys in _ORTHOTROPIC)
    return orthotropic(name, E=E, nu=nu, G=G, rho=of["rho"], **_axes(of))


def _anisotropic(name: str, of: Mapping[str, Any]) -> AnisotropicMaterial:
    return AnisotropicMaterial(name, of["elasticity"], of["rho"], **_axes(of))


def _axes(of: Mapping[str, Any]) -> dict[str, Any]:
    return {"axes": of["axes"]} if "axes" in of else {}


_ORTHOTROPIC = (("E1", "E2", "E3"), ("nu12", "nu13", "nu23"), ("G12", "G13", "G23"))
# What is given: the key that tells, the keys there must be, those there may be, and what it makes.
_FORMS: tuple[tuple[str, set[str], set[str], Callable[[str, Mapping[str, Any]], Solid]], ...] = (
    ("elasticity", {"elasticity", "rho"}, {"axes"}, _anisotropic),
    ("E1", {*sum(_ORTHOTROPIC, ()), "rho"}, {"axes"}, _orthotropic),
    ("", {"E", "nu", "rho"}, set(), _isotropic),
)
_NUMBERS = set().union(*(needed for _, needed, _, _ in _FORMS)) - {"elasticity"}
_UNIT = re.compile(r"\[([^\]]+)\]")  # of a key, in brackets
KEYS = {
    "name": "of the material; without it that of the file",
    "E": "Young's modulus [Pa]",
    "nu": "Poisson's ratio [1]",
    "rho": "density [kg/m^3]",
    **{f"E{i}": f"Young's modulus along axis {i} [Pa]" for i in (1, 2, 3)},
    **{f"nu{ij}": f"contraction along {ij[1]} under tension along {ij[0]} [1]" for ij in ("12", "13", "23")},
    **{f"G{ij}": f"shear modulus of axes {ij[0]} and {ij[1]} [Pa]" for ij in ("12", "13", "23")},
    "elasticity": "stress from strain, components xx, yy, zz, xy, xz, yz, engineering shear strains [Pa]",
    "axes": "rotation matrix whose columns are the axes of the material in those of the mesh; or two directions [1]",
}


def material_keys() -> dict[str, tuple[set[str], set[str]]]:
    """The keys of a material file: for each kind of material the required ones and the optional ones."""
    kinds = ("Anisotropic", "Orthotropic", "Isotropic")
    return {kind: (form[1], form[2] | {"name"}) for kind, form in zip(kinds, _FORMS, strict=True)}


def _of_values(text: str, given: Mapping[str, Any], such: str) -> Solid:
    """The material of these values; InputError names those that are missing or unknown."""
    _, needed, allowed, made = next(form for form in _FORMS if form[0] in given or not form[0])
    unknown, missing = given.keys() - needed - allowed - {"name"}, needed - given.keys()
    if unknown or missing:
        lacking = (f"{key!r} missing ({KEYS[key]})" for key in sorted(missing))
        wrong = [*(f"unknown {key!r}" for key in sorted(unknown)), *lacking]
        raise InputError(f"material {text!r}: {', '.join(wrong)}{such}")
    return made(str(given.get("name", text)), given)


def _file(path: Path) -> dict[str, Any]:
    try:
        given = read_toml(path, "a material file")
        return given | {key: _in_file(path, key, given[key]) for key in given.keys() & _NUMBERS}
    except InputError:
        raise
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(f"material file {str(path)!r} cannot be read: {error}") from None


def _in_file(path: Path, key: str, value: Any) -> float:
    return _number(str(path), key, value) if isinstance(value, str) else float(value)


def _assignments(text: str) -> dict[str, str]:
    parts = [part.partition("=") for part in text.split(",")]
    pairs = [(key.strip(), value.strip()) for key, _, value in parts]
    keys = [key for key, _ in pairs]
    if len(set(keys)) < len(keys):
        raise InputError(f"material {text!r}: a value is given twice")
    return dict(pairs)


def _number(text: str, key: str, value: str) -> float:
    """In SI units; the text may have a unit of its own, such as 210 GPa."""
    try:
        return si_number(value, _UNIT.findall(KEYS[key])[-1])
    except InputError as error:
        raise InputError(f"material {text!r}: {key}: {error}") from None
    except ValueError:
        raise InputError(f"material {text!r}: {key} is {value!r}, which is not a number") from None
