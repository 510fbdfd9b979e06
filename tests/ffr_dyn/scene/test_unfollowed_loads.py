"""Loads over a surface that the shapes of a body do not follow: what is missing then, and that it is told."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

METAL = fp.Material("metal", 7e10, 0.3, 2700.0)
RADIUS, LENGTH, WALL, SIDES = 0.05, 0.3, 0.002, 16
PRESSURE = 1e5
RELIEVED = fp.Union((fp.CraigBampton(4), fp.InertiaRelief()))


def panel(one, other) -> fp.Frame:
    """A sheet along x between two places in the plane x = 0."""
    corners = [(0, *one), (LENGTH, *one), (LENGTH, *other), (0, *other)]
    return fp.panel(corners, fp.Shell(WALL, METAL), elements=(8, 1))


@cache
def model(sides: int) -> fp.Model:
    """A tube of flat sheets, or of one side a strip."""
    angle = np.linspace(0, 2 * np.pi, SIDES + 1)[: sides + 1]
    at = np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle)], axis=1)
    frame = fp.joined(*(panel(a, b) for a, b in pairwise(at)))
    ends = {"root": frame.points[:, 0] == 0, "tip": np.isclose(frame.points[:, 0], LENGTH)}
    frame = replace(frame, node_groups={name: np.flatnonzero(at) for name, at in ends.items()})
    return fp.from_frame(frame, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])


@cache
def body(sides: int, reduction, stress: bool = True) -> fp.FlexibleBody:
    request = fp.Request(name="b", reference=fp.FixedTo("root"), reduction=reduction, stress=stress, linear=True)
    return fp.reduce(model(sides), request)


def inner(centres: np.ndarray) -> np.ndarray:
    apart = np.hypot(centres[:, 1], centres[:, 2]) < RADIUS * np.cos(np.pi / SIDES) - WALL / 4
    return apart & (centres[:, 0] > 0) & (centres[:, 0] < LENGTH)


def scene(of: fp.FlexibleBody, force) -> fd.Scene:
    clamp = fd.Joint("clamp", "fixed", "ground.wall", "b.root")
    return fd.Scene([fd.Body("b", of)], [clamp], forces=[force], ground={"wall": of.interface("root").position})


def notes(result: fd.Result) -> list[str]:
    return [note for note in result.attributes["notes"] if "hardly move as it pushes" in note]


def hoop(result: fd.Result) -> float:
    """Of what p R / t gives, in the middle of the wall."""
    places = {name: (LENGTH / 2, RADIUS + z * WALL / 2, 0) for name, z in (("outer", 1), ("inner", -1))}
    found = fd.stress_histories(result, "b", places)
    return sum(found[f"b.{name}.stress"][-1][2] for name in places) / 2 / (PRESSURE * RADIUS / WALL)


def test_a_tube_whose_modes_do_not_widen_it_has_no_hoop_stress_and_says_so():
    result = fd.static(scene(body(SIDES, fp.CraigBampton(8)), fd.Pressure("gas", "b", PRESSURE, triangles=inner)))
    assert abs(hoop(result)) < 1e-3
    (note,) = notes(result)
    assert note.startswith("force 'gas': the shapes of 'b' hardly move as it pushes (they follow ")


@pytest.mark.slow
def test_shapes_that_widen_it_have_the_hoop_stress_and_nothing_is_told():
    result = fd.static(scene(body(SIDES, RELIEVED), fd.Pressure("gas", "b", PRESSURE, triangles=inner)))
    assert hoop(result) == pytest.approx(1.0, abs=0.06)
    assert not notes(result)


@pytest.mark.slow
def test_forces_on_its_points_are_looked_at_likewise():
    of = body(SIDES, fp.CraigBampton(8))
    x, y, z = of.surface.points.T
    points = np.flatnonzero((x > 0) & (x < LENGTH) & (np.hypot(y, z) < RADIUS))
    outward = of.surface.points[points] * [0, 1, 1]
    told = [
        bool(notes(fd.static(scene(of, fd.NodalForces("gas", "b", points, forces, axes="body")))))
        for forces in (outward, np.tile([0, 0, 1.0], (len(points), 1)))
    ]
    assert told == [True, False]


@pytest.mark.parametrize(
    ("sides", "stress"), [(1, True), (SIDES, False)], ids=["a strip that bends", "a body whose stress nobody asks for"]
)
def test_nothing_is_told_of(sides, stress):
    force = fd.Pressure("gas", "b", PRESSURE / 100, triangles=inner)
    assert not notes(fd.static(scene(body(sides, fp.CraigBampton(8), stress), force)))
