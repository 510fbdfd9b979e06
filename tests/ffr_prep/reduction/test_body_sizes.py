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


# ---- frames, and bodies far from the origin -------------------------------------------------------------------------------

OF_FRAMES = {
    "eigenmodes": fp.Eigenmodes(8),
    "rubin": fp.Rubin(6),
    "inertia-relief": fp.Union((fp.Guyan(), fp.InertiaRelief())),
}


@cache
def frame(kind: str, size: float, away: float) -> fp.FlexibleBody:
    """Three beams that meet in space, some metres long times the size, and so many sizes away from the origin."""
    corners = size * (np.array([(0, 0, 0), (1.1, 0.2, -0.3), (0.9, 1.0, 0.4), (0.1, 1.2, 1.0)]) + away)
    section = fp.shifted(fp.rectangle(0.02 * size, 0.03 * size), 0.01 * size, -0.005 * size)
    line = fp.polyline(corners, fp.Member(section, fp.material("steel"), (0.3, 0.1, 1.0)), elements=3)
    ends = {"a": tuple(line.points[0]), "b": tuple(line.points[-1])}
    model = fp.from_frame(fp.named(line, **ends), [fp.InterfaceRegion(name) for name in ends])
    request = fp.Request(name="frame", reference=fp.MeanAxis(), reduction=OF_FRAMES[kind], linear=True)
    return fp.reduce(model, request)


@pytest.mark.parametrize(("size", "away"), [(1e-3, 0.0), (1e-5, 0.0), (1e-3, 1000.0)])
@pytest.mark.parametrize("kind", OF_FRAMES)
def test_a_frame_scales_with_its_size_wherever_it_lies(kind: str, size: float, away: float):
    """Before, the upper shapes of small frames were wrong by up to a half, or no basis was accurate, as combinations of
    translations and rotations lost the inertia of the latter; and far from the origin shapes of turning and spinning were
    lost among those of translations."""
    small, usual = frame(kind, size, away), frame(kind, 1.0, 0.0)
    np.testing.assert_allclose(small.omega2 * size**2, usual.omega2, rtol=1e-6)
    assert small.provenance.get("dropped_vectors") == usual.provenance.get("dropped_vectors")
