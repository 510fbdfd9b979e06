"""Every method at its order down to the floor of the reference, on published and independently computed cases."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from test_analyses_references import END, andrews
from test_dyn_references import GRAVITY, mass_point

import ffr_prep as fp
from ffr_dyn.chart.diagram import Diagram, measures_of, work_precision
from ffr_dyn.chart.orders import observed_order, order_words, orders
from ffr_dyn.chart.runner import Here, Span
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import METHODS
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import circle, rectangle


def top() -> Scene:
    """Dzhanibekov: I = (1, 2, 3), omega(0) = (0.001, 1, 0.001)."""
    body = rigid_body("top", mass=1.0, inertia=(1, 2, 3), points={"nose": (1, 0, 0)})
    return Scene((Body("top", body, omega_bar=(0.001, 1, 0.001)),))


def pendulum() -> Scene:
    """IFToMM benchmark A01."""
    bob = mass_point("bob", c=(0, 0, 0), pivot=(1, 0, 0))
    hinge = Joint("hinge", "revolute", "ground.O", "bob.pivot")
    return Scene((Body("bob", bob, position=(-1, 0, 0)),), (hinge,), ground={"O": (0, 0, 0)}, gravity=GRAVITY)


def double_pendulum() -> Scene:
    """Two point masses of 1 kg on massless links of 1 m, both released horizontally."""
    first, second = (mass_point(name, c=(0, 0, 0), pivot=(-1, 0, 0)) for name in ("first", "second"))
    bodies = (Body("first", first, position=(1, 0, 0)), Body("second", second, position=(2, 0, 0)))
    joints = (Joint("A", "revolute", "ground.O", "first.pivot"), Joint("B", "revolute", "first.c", "second.pivot"))
    return Scene(bodies, joints, ground={"O": (0, 0, 0)}, gravity=GRAVITY)


def beam(length: float, section, material: Material):
    """Four elastic coordinates in the plane at most, so that steps resolve all of them."""
    member = Member(section, material, orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (length, 0, 0)], member, elements=8), a=(0, 0, 0), b=(length, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(name="rod", reference=SimplySupported("a", "b"), reduction=CraigBampton(0)),
    )


def flexible_pendulum() -> Scene:
    """A plate strip of 1.2 m and E = 7e10 Pa, released from the horizontal."""
    rod = beam(1.2, rectangle(0.009, 0.2), Material("metal", 7e10, 0.3, 5540.0))
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a")
    return Scene((Body("rod", rod),), (hinge,), ground={"O": (0, 0, 0)}, gravity=GRAVITY)


def slider_crank() -> Scene:
    """Rigid crank of 0.15 m at 150 rad/s, round rod of 0.3 m, slider of half its mass."""
    rod = beam(0.3, circle(0.006), Material("steel", 2e11, 0.3, 7870.0))
    crank = rigid_body(
        "crank", mass=0.1, inertia=np.full(3, 1e-4), points={"hub": np.zeros(3), "pin": np.array([0.15, 0, 0])}
    )
    slider = rigid_body("slider", mass=rod.mass / 2, inertia=np.full(3, 1e-5), points={"pin": np.zeros(3)})
    joints = (
        Joint("bearing", "revolute", "ground.O", "crank.hub"),
        Joint("crankpin", "revolute", "crank.pin", "rod.a"),
        Joint("wrist", "revolute", "rod.b", "slider.pin"),
        Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
    )
    bodies = (
        Body("crank", crank),
        Body("rod", rod, position=(0.15, 0, 0)),
        Body("slider", slider, position=(0.45, 0, 0)),
    )
    return Scene(bodies, joints, (Driver("motor", "bearing", polynomial(0.0, 150.0)),), ground={"O": (0, 0, 0)})


CASES: dict[str, tuple[Callable[[], Scene], Span, str, float]] = {
    "Dzhanibekov's top": (top, Span(10.0, 0.5), "top.omega_bar", 0.1),
    "pendulum A01": (
        pendulum,
        Span(10.0, 0.4),
        "position:bob.c",
        0.04,
    ),  # its 1e-9 kg m^2 of inertia make rounding felt at 1e-10 m
    "double pendulum": (double_pendulum, Span(1.0, 0.1), "position:second.c", 0.01),
    "Andrews' squeezer": (andrews, Span(0.03, 2.5e-4), "position:k1.b", 6.25e-5),
    "flexible pendulum": (flexible_pendulum, Span(0.5, 0.01), "position:rod.b", 2.5e-5),
    "flexible slider-crank": (slider_crank, Span(0.02, 2e-4), "deflection:rod", 4e-6),
}
LEVELS = 4


def study(name: str) -> Diagram:
    """All methods with steps halved from the one of the case."""
    make, span, measure, coarsest = CASES[name]
    scene = make()
    steps = tuple(coarsest / 2**k for k in range(LEVELS))
    return work_precision(
        scene, span, Here(), measures=measures_of(scene, [measure]), methods=dict.fromkeys(METHODS, steps),
        stabilisation=Projection(1e-13), repeats=1, wanted=1e-12, limit=20.0,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_every_method_shows_its_order(name):
    found = study(name)
    measure = found.measures[0].name
    floor = found.reference.floors[measure]
    seen = {method: order for (method, _), order in orders(found, measure).items()}
    for method in METHODS:
        line = ", ".join(f"{p.number:.3g}: {p.errors[measure]:.1e}" for p in found.points if p.series == method)
        print(f"{name:24}{method:6} order {seen[method]:5.2f}  floor {floor:.1e}  {line}")
    assert not found.lost
    assert set(seen) == set(METHODS)
    for method, order in seen.items():
        assert order > METHODS[method](1.0).order - 0.4, f"{method}: {order}"


@pytest.mark.slow
def test_the_references_are_those_of_others():
    """Closed form, published and independently integrated values at the end of the run."""
    expected = {
        "Dzhanibekov's top": ((-0.117326383719773, 0.993093912821562, 0.0677433399352767), 1e-10),
        "pendulum A01": ((-0.275087462576117, -0.961419205099125), 2e-8),  # 1e-9 kg m^2 of inertia is in it
        "double pendulum": (
            (np.sin(-0.62508769980639) + np.sin(-1.03458508568), -np.cos(-0.62508769980639) - np.cos(-1.03458508568)),
            1e-7,
        ),
        "Andrews' squeezer": ((0.007 * np.cos(END["beta"]), 0.007 * np.sin(END["beta"])), 1e-10),
    }
    for name, (values, close) in expected.items():
        found = study(name)
        np.testing.assert_allclose(
            found.reference.values[found.measures[0].name][-1][: len(values)], values, atol=close
        )


def test_an_observed_order_is_the_slope_above_the_floor():
    steps = [0.1 / 2**k for k in range(6)]
    errors = [max(3 * h**3, 1e-6) for h in steps]
    assert observed_order(steps, errors, floor=1e-6) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("steps", "errors", "words"),
    [
        ([0.1, 0.05, 0.025], [1e-3, 9e-4, 9e-4], "level"),
        ([0.1, 0.05], [1e-6, 1e-6], "not to be seen"),  # all as good as the reference
        ([0.1, 0.05], [1.0, 1e-6], "not to be seen"),
        ([0.1], [1.0], "not to be seen"),
        ([0.1, 0.1], [1.0, 1.0], "not to be seen"),
        ([0.1, 0.05, 0.05], [1.0, 0.25, 0.25], "2.0"),
    ],
)
def test_where_errors_do_not_fall_is_not_where_they_are_not_seen(steps, errors, words):
    assert order_words(observed_order(steps, errors, floor=1e-6)) == words
