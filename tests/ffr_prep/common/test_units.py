"""Units as people write them: each against its definition, with its dimension; prefixes; what is not a unit."""

from __future__ import annotations

import math

import pytest

from ffr_prep.common import units
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import listed_units, quotient, square, to_si, unit_of_label

# The International System of Units (BIPM, 9th edition 2019): base and derived units, tables 2 to 4; min, h, deg: table 8;
# bar: 10^5 Pa exactly (8th edition, table 8); inch: 25.4 mm exactly (agreement of 1959); rpm: a turn of 2 pi rad in 60 s.
DEFINED = {
    "kg": (1.0, "kg"),
    "g": (0.001, "kg"),
    "m": (1.0, "m"),
    "s": (1.0, "s"),
    "min": (60.0, "s"),
    "h": (3600.0, "s"),
    "N": (1.0, "kg m s^-2"),
    "J": (1.0, "kg m^2 s^-2"),
    "W": (1.0, "kg m^2 s^-3"),
    "Pa": (1.0, "kg m^-1 s^-2"),
    "bar": (100_000.0, "kg m^-1 s^-2"),
    "Hz": (1.0, "s^-1"),
    "rad": (1.0, "rad"),
    "deg": (math.pi / 180.0, "rad"),
    "rev": (2.0 * math.pi, "rad"),
    "rpm": (2.0 * math.pi / 60.0, "rad s^-1"),
    "in": (0.0254, "m"),
    "1": (1.0, "1"),
}
PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6, "G": 1e9}  # table 7


@pytest.mark.parametrize("unit", units._UNITS)
def test_a_unit_is_what_it_is_defined_to_be(unit):
    size, base = DEFINED[unit]
    assert to_si(3.0, unit, expected=base) == pytest.approx(3.0 * size, rel=1e-15)


def test_no_unit_is_left_out_and_the_base_units_are_apart():
    assert DEFINED.keys() == units._UNITS.keys()
    base = ("kg", "m", "s", "rad", "1")
    for unit, (_, of) in DEFINED.items():
        for other in base:
            if of in base and other != of:
                with pytest.raises(InputError, match="does not fit"):
                    to_si(1.0, unit, expected=other)


@pytest.mark.parametrize("prefix", units._SCALES)
@pytest.mark.parametrize("unit", units._TAKES_SCALE)
def test_a_prefix_multiplies_by_a_power_of_ten(prefix, unit):
    if prefix + unit in DEFINED:  # min, kg, cd and the like are words of their own
        return
    assert to_si(1.0, prefix + unit) == pytest.approx(PREFIXES[prefix] * DEFINED[unit][0], rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("N/mm", 1e3),
        ("kg m^2", 1.0),
        ("kN m / deg", 1e3 * 180 / math.pi),
        ("g/cm^3", 1e3),
        ("mm^2", 1e-6),
        ("bar/s", 1e5),
    ],
)
def test_products_powers_and_quotients(unit, size):
    assert to_si(1.0, unit) == pytest.approx(size, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "by", "found"),
    [("m", "N", "m/N"), ("m", "N m", "m/(N m)"), ("m", "1", "m"), ("1", "N", "1/N"), ("m/s^2", "m/s^2", "1")],
)
def test_units_of_quotients(unit, by, found):
    assert quotient(unit, by) == found


def test_units_of_labels_are_told_once_where_they_are_alike():
    assert listed_units(["m", "m"]) == "m"
    assert [unit_of_label(listed_units(["m", "N m", "1"]), k) for k in range(3)] == ["m", "N m", "1"]
    assert [square(unit) for unit in ("m", "m/s", "1")] == ["m^2", "(m/s)^2", "1"]
