"""Loads over a surface work on the second-order displacement, too: they buckle a column as forces at its end do.

Columns of length L, clamped, under an axial force P = k^2 EI at the end and a small force F across (Timoshenko and Gere,
Theory of Elastic Stability, art. 1.11): of a force that keeps its direction the end deflects by F (tan kL - kL) / (k P), of
one that turns with the end by F (sin kL - kL cos kL) / (k P).
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.variants.mean_axis import with_mean_axis_bodies

LENGTH, WIDTH, HEIGHT = 1.0, 0.03, 0.02
STEEL = fp.Material("steel", 2.1e11, 0.3, 7850.0)
EI = STEEL.E * WIDTH * HEIGHT**3 / 12
CRITICAL = np.pi**2 * EI / (4 * LENGTH**2)
ACROSS = 1.0


@cache
def column(parts: int | None = None) -> fp.FlexibleBody:
    """It bends most easily along y."""
    line = fp.polyline(
        [(0, 0, 0), (LENGTH, 0, 0)], fp.Member(fp.rectangle(WIDTH, HEIGHT), STEEL, (0, 1, 0)), elements=6
    )
    model = fp.from_frame(
        fp.named(line, root=(0, 0, 0), tip=(LENGTH, 0, 0)), [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
    )
    return fp.reduce(
        model, fp.Request(name="column", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(4), parts=parts)
    )


def at_end(places: np.ndarray) -> np.ndarray:
    return places[:, 0] > LENGTH - 1e-9


def nodal(body: fp.FlexibleBody, force, axes: str = "global") -> dict:
    points = np.flatnonzero(at_end(body.surface.points))
    return {
        "forces": (fd.NodalForces("push", "column", points, [np.divide(force, points.size)] * points.size, axes=axes),)
    }


def pressed(force: float, follower: bool) -> dict:
    pressure = force / (WIDTH * HEIGHT)
    return {"forces": (fd.Pressure("push", "column", pressure, triangles=at_end, follower=follower),)}


def clamped(body: fp.FlexibleBody, across: float = ACROSS, stiffening: bool = True, **loads) -> fd.Scene:
    given = {"forces": (), "loads": (), **loads}
    given["loads"] = (*given["loads"], fd.Load("across", "column.tip", (0, across, 0)))
    weld = fd.Joint("weld", "fixed", "ground.wall", "column.root")
    return fd.Scene((fd.Body("column", body, stiffening=stiffening),), (weld,), ground={"wall": (0, 0, 0)}, **given)


def deflection(scene: fd.Scene) -> float:
    return fd.static(scene)["column.tip.position"][0, 1]


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_nodal_forces_buckle_a_column(share):
    force = share * CRITICAL
    k = np.sqrt(force / EI)
    exact = ACROSS * (np.tan(k * LENGTH) - k * LENGTH) / (k * force)
    assert deflection(clamped(column(), **nodal(column(), (-force, 0, 0)))) == pytest.approx(exact, rel=3e-3)


def test_a_column_under_more_than_its_critical_load_is_not_stable_straight():
    scene = clamped(column(), across=0.0, **nodal(column(), (-1.05 * CRITICAL, 0, 0)))
    assert not fd.static(scene).attributes["stable"]


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_pressure_that_follows_the_end_does_not_buckle_a_column(share):
    force = share * CRITICAL
    k = np.sqrt(force / EI)
    exact = ACROSS * (np.sin(k * LENGTH) - k * LENGTH * np.cos(k * LENGTH)) / (k * force)
    assert deflection(clamped(column(), **pressed(force, follower=True))) == pytest.approx(exact, rel=3e-3)


@pytest.mark.parametrize("axes", ["global", "body"])
def test_nodal_forces_at_the_end_are_a_load_there(axes):
    force = (-0.7 * CRITICAL, 0.0, 2.0)
    load = {"loads": (fd.Load("push", "column.tip", force, axes=axes),)}
    one, other = (fd.static(clamped(column(), 20.0, **of)) for of in (nodal(column(), force, axes), load))
    for name in ("column.tip.position", "weld.force", "weld.moment"):
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=1e-5 * np.abs(other[name]).max())


def test_in_motion_as_well():
    """In the compiled equations, of both kinds of axes."""
    force = (-0.7 * CRITICAL, 0.0, 2.0)
    for axes in ("global", "body"):
        load = {"loads": (fd.Load("push", "column.tip", force, axes=axes),)}
        one, other = (
            fd.forward(clamped(column(), 200.0, **of), end=0.02, output_step=0.01, method=fd.ROS2(1e-3), check=False)
            for of in (nodal(column(), force, axes), load)
        )
        moved = other["column.tip.position"]
        np.testing.assert_allclose(one["column.tip.position"], moved, rtol=0, atol=1e-5 * np.ptp(moved[:, 1]))


def test_a_linear_body_is_not_buckled():
    scene = clamped(column(), stiffening=False, **nodal(column(), (-0.9 * CRITICAL, 0, 0)))
    assert deflection(scene) == pytest.approx(ACROSS * LENGTH**3 / (3 * EI), rel=3e-3)


def test_a_body_in_its_mean_axis_form_keeps_the_second_order_of_its_loads():
    scene = clamped(column(), **nodal(column(), (-0.9 * CRITICAL, 0, 0)))
    assert deflection(with_mean_axis_bodies(scene)) == pytest.approx(deflection(scene), rel=1e-9)


@pytest.mark.slow
def test_pressure_on_parts_is_that_on_the_whole():
    one, two = (deflection(clamped(body, **pressed(0.5 * CRITICAL, True))) for body in (column(), column(2)))
    assert two == pytest.approx(one, rel=1e-3)


def test_the_integrals_of_a_load_are_found_once(monkeypatch):
    counted, whole = [], fd.Pressure.integrals
    monkeypatch.setattr(fd.Pressure, "integrals", lambda self, body: counted.append(body) or whole(self, body))
    fd.static(clamped(column(), **pressed(0.5 * CRITICAL, follower=True)))
    assert 1 <= len(counted) < 10  # of forms of the body, and not of the differences of every tangent


def told(body: fp.FlexibleBody, force) -> list[str]:
    scene = fd.Scene((fd.Body(body.name, body),), forces=(force,))
    return [note for note in fd.assemble(scene).notes if repr(force.name) in note]


@cache
def plate() -> fp.FlexibleBody:
    shell = fp.Shell(0.002, STEEL)
    model = fp.from_frame(
        fp.named(
            fp.panel([(0, 0, 0), (0.4, 0, 0), (0.4, 0.3, 0), (0, 0.3, 0)], shell, elements=(3, 2)), root=(0, 0, 0)
        ),
        [fp.InterfaceRegion("root")],
    )
    return fp.reduce(model, fp.Request(name="plate", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(6)))


@pytest.mark.parametrize("follower", [False, True])
def test_a_pressure_on_both_faces_of_a_plate_is_told_to_do_nothing(follower):
    wind = fd.Pressure("wind", "plate", 2e3, follower=follower)
    [note] = told(plate(), wind)
    assert "does next to nothing" in note

    def above(places):
        return places[:, 2] > 0

    mended = fd.Pressure("wind", "plate", 2e3, triangles=above, follower=follower)
    assert not told(plate(), mended)
    assert np.abs(mended.integrals(plate()).constant[6:]).max() > 1.0


def test_a_load_over_modes_without_second_order_is_told():
    line = fp.polyline([(0, 0, 0), (LENGTH, 0, 0)], fp.Member(fp.circle(0.02), STEEL), elements=3)
    model = fp.from_frame(fp.named(line, root=(0, 0, 0)), [fp.InterfaceRegion("root")])
    request = fp.Request(name="column", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(4))
    push = fd.NodalForces("push", "column", [3], [(1.0, 0, 0)])
    [note] = told(fp.reduce(model, replace(request, drawn_modes=2)), push)
    assert "stiffens or buckles the first 2 of 4 modes" in note
    assert not told(fp.reduce(model, request), push)
    assert not told(fp.reduce(model, replace(request, linear=True)), push)
