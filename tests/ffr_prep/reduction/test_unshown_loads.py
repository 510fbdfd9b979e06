"""Loads at interfaces that the shapes of a body do not show the stress of: what is missing, and that a reduction tells it."""

from __future__ import annotations

import pytest
from boxes import STEEL, box_mesh

import ffr_dyn as fd
import ffr_prep as fp

SIZE = (0.4, 0.04, 0.02)
MODEL = fp.from_mesh(
    box_mesh("hex20", SIZE, (8, 1, 1)), STEEL, [fp.InterfaceRegion("left"), fp.InterfaceRegion("right")]
)


def rod(reduction: fp.Reduction, stress: bool = True) -> fp.FlexibleBody:
    request = fp.Request(name="rod", reference=fp.FixedTo("left"), reduction=reduction, stress=stress, linear=True)
    return fp.reduce(MODEL, request)


def told(body: fp.FlexibleBody) -> list[str]:
    return [warning for warning in body.provenance["warnings"] if "hardly deform under loads and joints" in warning]


def pulled(body: fp.FlexibleBody) -> float:
    """The stress in the middle of a side under tension, of what it should be."""
    clamp = fd.Joint("clamp", "fixed", "ground.wall", "rod.left")
    pull = fd.Load("pull", "rod.right", force=(1e3, 0, 0))
    scene = fd.Scene([fd.Body("rod", body)], [clamp], loads=[pull], ground={"wall": body.interface("left").position})
    found = fd.stress_histories(fd.static(scene), "rod", {"side": (0.2, 0.04, 0.01)})
    return found["rod.side.stress"][-1][0] * SIZE[1] * SIZE[2] / 1e3


def test_bending_modes_show_no_tension_and_say_so():
    body = rod(fp.Eigenmodes(6))
    (warning,) = told(body)
    assert "0 % under a force along x at 'right'" in warning
    assert "a force along z at 'right'" not in warning  # which the modes show to some per cent
    assert abs(pulled(body)) < 1e-9


@pytest.mark.parametrize(
    "reduction",
    [fp.Union((fp.Eigenmodes(6), fp.AttachmentModes())), fp.CraigBampton(0), fp.Rubin(2)],
    ids=["attachment modes", "craig-bampton", "rubin"],
)
def test_static_shapes_show_it(reduction):
    body = rod(reduction)
    assert not told(body)
    assert pulled(body) == pytest.approx(1.0, rel=1e-3)


def test_a_body_whose_stress_nobody_asks_for_says_nothing():
    assert not told(rod(fp.Eigenmodes(6), stress=False))
