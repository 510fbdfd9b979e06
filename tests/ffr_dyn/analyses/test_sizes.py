"""The same machine as small as a chip, as long as a bridge, and far from the origin: numbers scale with its size."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

SPEED = 20.0  # rad/s, of a crank of 0.1 m; times scale with lengths, so that stress does not change
SIZES = (1e-4, 1e4)


@cache
def rod(size: float) -> fp.FlexibleBody:
    """A beam of 0.5 m times the size."""
    member = fp.Member(fp.rectangle(0.02 * size, 0.03 * size), fp.material("steel"), (0, 1, 0))
    line = fp.named(fp.polyline([(0, 0, 0), (0.5 * size, 0, 0)], member, elements=2), a=(0, 0, 0), b=(0.5 * size, 0, 0))
    model = fp.from_frame(line, [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")])
    return fp.reduce(
        model, fp.Request(name="rod", reference=fp.SimplySupported("a", "b"), reduction=fp.CraigBampton(2))
    )


def slider_crank(size: float) -> fd.Scene:
    inertia = np.array([1e-3, 1e-3, 2e-3]) * size**5
    crank = fd.rigid_body("crank", mass=size**3, inertia=inertia, points={"a": (0, 0, 0), "b": (0.1 * size, 0, 0)})
    block = fd.rigid_body("slider", mass=0.8 * size**3, inertia=inertia, points={"c": (0, 0, 0)})
    return fd.Scene(
        bodies=[
            fd.Body("crank", crank),
            fd.Body("rod", rod(size), position=(0.1 * size, 0, 0)),
            fd.Body("slider", block, position=(0.6 * size, 0, 0)),
        ],
        joints=[
            fd.Joint("bearing", "revolute", "ground.o", "crank.a"),
            fd.Joint("pin", "revolute", "crank.b", "rod.a"),
            fd.Joint("eye", "revolute", "rod.b", "slider.c"),
            fd.Joint("guide", "translational", "ground.o", "slider.c", axis=(1, 0, 0)),
        ],
        drivers=[fd.Driver("motor", "bearing", fd.polynomial(0, SPEED / size))],
        ground={"o": (0, 0, 0)},
    )


@cache
def driven(analysis: str, size: float) -> dict[str, np.ndarray]:
    """Quantities without a dimension of the machine over a third of a turn."""
    scene, span = slider_crank(size), {"end": 0.1 * size, "output_step": 0.02 * size}
    if analysis == "kinematic":
        result = fd.kinematic(scene, **span, outputs=("default", "energy.*"))
    else:
        result = fd.inverse(scene, elastic=fd.QuasiStatic(), **span)
    return {
        "rate": result["crank.omega_bar"][:, 2] * size / SPEED,
        "stroke": result["guide.stroke"] / size,
        "torque": result["motor.moment"] / size**3,
        "bent": result["energy.strain"] / size**3,
    }


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("analysis", ["kinematic", "inverse"])
def test_a_driven_machine_scales_with_its_size(analysis: str, size: float):
    """Before, at 10 km the crank turned a thousand times too fast in a kinematic analysis, without a word."""
    for name, value in driven(analysis, 1.0).items():
        np.testing.assert_allclose(
            driven(analysis, size)[name], value, rtol=1e-6, atol=1e-6 * np.abs(value).max(), err_msg=name
        )


def test_joints_are_closed_to_rounding_far_from_the_origin():
    """A position of 1e7 m is rounded by 2e-9 m; such a scene was refused, as a joint stayed open by 1e-10."""
    orbit, turned = np.array([5.1e6, -3.3e6, 2.7e6]), (0.3, -0.2, 0.5)
    one = fd.rigid_body("one", mass=10.0, inertia=(1, 2, 3), points={"p": (0.5, 0.1, 0.2)})
    other = fd.rigid_body("other", mass=5.0, inertia=(1, 1, 1), points={"p": (-0.5, 0.1, 0.0)})
    for k in range(6):
        scene = fd.Scene(
            bodies=[
                fd.Body("one", one, position=orbit * (1 + k / 7), rotation=turned),
                fd.Body("other", other, position=orbit * (1 + k / 7) + [1, 0, 0], rotation=turned),
            ],
            joints=[fd.Joint("j", "revolute", "one.p", "other.p", axis=(1, k, 3))],
        )
        x = fd.assemble(scene).x
        assert np.linalg.norm(x[7:10] - x[:3]) < 2.0
