"""Materials: constants of isotropic linear elasticity, a small library, and the text form of the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from difflib import get_close_matches

from ffr_prep.common.errors import InputError

_LIGHTEST = 1e-3  # kg/m^3; aerogels have about 1


@dataclass(frozen=True)
class Material:
    """An isotropic linear elastic solid.

    E : Young's modulus [Pa]; nu : Poisson's ratio [-]; rho : density [kg/m^3]

    Raises InputError for values no solid can have: E and rho must be positive, nu between -1 and 0.5.
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
        if not 0 < self.rho < math.inf:
            raise InputError(f"material {self.name!r}: density rho is {self.rho:g} kg/m^3; it must be positive")
        if self.rho < _LIGHTEST:
            raise InputError(
                f"material {self.name!r}: density rho is {self.rho:g} kg/m^3, less than any solid's, as in tonnes and "
                "millimetres; give SI units (steel: E=2.1e11,nu=0.3,rho=7850)"
            )


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
    """The material of that name in the library; InputError lists the nearest names."""
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


def parse_material(text: str) -> Material:
    """A library name, or "E=7e10,nu=0.3,rho=5540" in SI units, optionally with "name=...".

    Raises InputError for a missing, unknown or unreadable value.
    """
    if "=" not in text:
        return material(text)
    given = _assignments(text)
    unknown, missing = given.keys() - {"name", "E", "nu", "rho"}, {"E", "nu", "rho"} - given.keys()
    if unknown or missing:
        wrong = [*(f"unknown {key!r}" for key in sorted(unknown)), *(f"{key!r} missing" for key in sorted(missing))]
        raise InputError(f"material {text!r}: {', '.join(wrong)}; write E=2.1e11,nu=0.3,rho=7850 in SI units")
    return Material(given.get("name", text), *(_number(text, key, given[key]) for key in ("E", "nu", "rho")))


def _assignments(text: str) -> dict[str, str]:
    parts = [part.partition("=") for part in text.split(",")]
    pairs = [(key.strip(), value.strip()) for key, _, value in parts]
    keys = [key for key, _ in pairs]
    if len(set(keys)) < len(keys):
        raise InputError(f"material {text!r}: a value is given twice")
    return dict(pairs)


def _number(text: str, key: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise InputError(f"material {text!r}: {key} is {value!r}, which is not a number") from None
