"""Reference conditions that name regions of the mesh instead of interfaces."""

from __future__ import annotations

import pytest
from places import REFERENCE

from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports
from ffr_prep.solids.reference_regions import at_regions

LEFT = InterfaceRegion("left", "plane x=-60")


@pytest.fixture(scope="module")
def mesh():
    return read_mesh(REFERENCE / "plate.step", size=20.0, order=1)


def test_the_interface_that_lies_there_is_meant(mesh):
    for region in ("plane x=-60", "plane x=-60mm", "surface_1", "left"):
        assert at_regions(mesh, [LEFT], FixedTo(region)) == ([LEFT], FixedTo("left"))


def test_where_none_lies_a_mean_one_is_made(mesh):
    right = InterfaceRegion("support", "plane x=60", "mean")
    assert at_regions(mesh, [LEFT], FixedTo("plane x=60")) == ([LEFT, right], FixedTo("support"))
    chord = SimplySupported("plane x=-60", "plane x=60")
    assert at_regions(mesh, [LEFT], chord) == ([LEFT, right], SimplySupported("left", "support"))
    second = InterfaceRegion("support_2", "plane y=40", "mean")
    supports = Supports(tuple(Support(at, "translation", (1.0, 0.0, 0.0)) for at in ("plane x=60", "plane y=40")))
    every, meant = at_regions(mesh, [], supports)
    assert every == [right, second]
    assert [support.interface for support in meant.supports] == ["support", "support_2"]


def test_two_texts_for_one_region_make_one_interface(mesh):
    supports = Supports(tuple(Support(at, "rotation", (0.0, 1.0, 0.0)) for at in ("plane x=60", "plane x=60mm")))
    every, meant = at_regions(mesh, [], supports)
    assert len(every) == 1
    assert {support.interface for support in meant.supports} == {"support"}


def test_other_conditions_stay(mesh):
    assert at_regions(mesh, [LEFT], MeanAxis()) == ([LEFT], MeanAxis())


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("lef", "there is no interface 'lef'; did you mean 'left'"),
        ("plane x=7", "no interface 'plane x=7'.* As a region: .* finds no face"),
    ],
)
def test_what_is_neither_is_told(mesh, name, message):
    with pytest.raises(InputError, match=message):
        at_regions(mesh, [LEFT], FixedTo(name))
