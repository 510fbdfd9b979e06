"""The same part as small as a chip and as long as a bridge: frequencies go with one over its size."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from boxes import box_mesh

import ffr_prep as fp

KINDS = {
    "eigenmodes": fp.Eigenmodes(4),
    "characteristic": fp.CharacteristicModes(3, 5),
}


@cache
def frequencies(kind: str, size: float) -> np.ndarray:
    """[Hz] of a bar of 0.5 m times the size, held at one end, over what its size makes of them."""
    mesh = box_mesh("hex20", (0.5 * size, 0.03 * size, 0.02 * size), (5, 1, 1))
    ends = [fp.InterfaceRegion("left"), fp.InterfaceRegion("right", kind="mean")]
    model = fp.from_mesh(mesh, fp.material("steel"), ends)
    request = fp.Request(name="bar", reference=fp.FixedTo("left"), reduction=KINDS[kind], linear=True)
    return fp.reduce(model, request).frequencies * size


@pytest.mark.parametrize("size", [1e-3, 1e4])
@pytest.mark.parametrize("kind", KINDS)
def test_a_body_scales_with_its_size(kind: str, size: float):
    """Before, supports of a bar of 5 km were told to depend on one another, and one of 0.5 mm had no accurate basis."""
    np.testing.assert_allclose(frequencies(kind, size), frequencies(kind, 1.0), rtol=1e-7)
