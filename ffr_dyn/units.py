"""Units as people read them: 0.0032 m is shown as 3.2 mm, 4500 N as 4.5 kN."""

from __future__ import annotations

import re

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 3: "k", 6: "M", 9: "G"}
_TAKES_PREFIX = re.compile(r"(m|s|N|J|W|Pa|Hz)(?![\w^²³])")


def readable(unit: str, largest: float) -> tuple[float, str]:
    """Factor and unit in which values up to ``largest`` (in ``unit``) are read easily: values * factor in that unit.

    The unit stays when the values lie between 0.1 and 10000, when it takes no prefix (such as rad, kg, m^2), or when
    the values are zero or not finite.
    """
    if not (0.0 < abs(largest) < float("inf")) or 0.1 <= abs(largest) < 1e4 or not _TAKES_PREFIX.match(unit):
        return 1.0, pretty(unit)
    fitting = [power for power in _PREFIXES if 10.0**power <= abs(largest)]
    power = max(fitting, default=-9)
    return 10.0**-power, _PREFIXES[power] + pretty(unit)


def pretty(unit: str) -> str:
    """The unit as it is printed: "m/s^2" as m/s², "m sqrt(kg)" as m √kg, "1" as nothing."""
    text = re.sub(r"sqrt\((\w+)\)", r"√\1", unit).replace("^2", "²").replace("^3", "³")
    return "" if text == "1" else text


def bracketed(name: str, unit: str) -> str:
    """A label such as "position [mm]"; without brackets for a number."""
    return f"{name} [{unit}]".strip() if unit else name
