"""Materials: values, library, text form, guards."""

import math

import pytest

from ffr_prep.common.errors import InputError
from ffr_prep.model.material import Material, library_names, material, parse_material


@pytest.mark.parametrize("name", library_names())
def test_library_holds_solids(name):
    """Wave speeds of bars in metals and plastics lie between 1 and 6 km/s."""
    one = material(name)
    assert 1e3 < math.sqrt(one.E / one.rho) < 6e3
    assert 0.2 < one.nu < 0.45


def test_steel():
    assert material("Steel") == Material("steel", 2.1e11, 0.3, 7850.0)


def test_other_names_lead_to_the_same_material():
    assert material("aluminum") == material("aluminium")
    assert material("PA66") == material("nylon")
    assert material("grey_cast_iron") == material("cast iron")


def test_unknown_name_suggests_near_ones():
    with pytest.raises(InputError, match=r"no material 'aluminim'.*aluminium"):
        material("aluminim")


def test_unknown_name_without_near_ones_lists_the_library():
    with pytest.raises(InputError, match=r"there are: steel, .*titanium"):
        material("xyzzy")


def test_text_form():
    assert parse_material("E=7e10, nu=0.3, rho=5540, name=strip") == Material("strip", 7e10, 0.3, 5540.0)
    assert parse_material("steel") == material("steel")
    assert parse_material("E=70 GPa,nu=0.3,rho=5.54 g/cm^3,name=strip").E == 7e10


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("E=7e10,nu=0.3", "'rho' missing"),
        ("E=7e10,nu=0.3,rho=1,G=1", "unknown 'G'"),
        ("E=soft,nu=0.3,rho=1000", "E is 'soft'"),
        ("E=70 mm,nu=0.3,rho=1000", "E: the unit 'mm' does not fit: this is given in Pa"),
        ("E=70 GPo,nu=0.3,rho=1000", "E: unknown unit 'GPo'"),
        ("E=7e10,E=8e10,nu=0.3,rho=1000", "twice"),
        ("E=7e10,nu=0.3,rho=-1", "density rho is -1"),
    ],
)
def test_text_that_is_no_material(text, message):
    with pytest.raises(InputError, match=message):
        parse_material(text)


@pytest.mark.parametrize("E", [0.0, -1.0, math.nan, math.inf])
def test_modulus_must_be_positive(E):
    with pytest.raises(InputError, match="Young's modulus"):
        Material("m", E, 0.3, 1000.0)


@pytest.mark.parametrize("nu", [-1.0, 0.5, math.nan])
def test_poisson_ratio_must_be_possible(nu):
    with pytest.raises(InputError, match="Poisson"):
        Material("m", 1e9, nu, 1000.0)


@pytest.mark.parametrize("rho", [0.0, -7850.0, math.nan, math.inf])
def test_density_must_be_positive(rho):
    with pytest.raises(InputError, match="density"):
        Material("m", 1e9, 0.3, rho)


def test_density_in_tonnes_per_cubic_millimetre_is_recognised():
    with pytest.raises(InputError, match="tonnes"):
        Material("m", 2.1e5, 0.3, 7.85e-9)
