"""Numerical damping of a linearly implicit method: from modes that the step resolves to those far beyond it."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2, ROS3, Integrator
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof

GAMMA = 1 - np.sqrt(0.5)  # of ROS2


def of_theory(z: float) -> float:
    """|R(i z)| of ROS2, R(z) = (1 + (1 - 2 gamma) z) / (1 - gamma z)^2 (Hairer & Wanner 1996, IV.7)."""
    return float(abs((1 + (1 - 2 * GAMMA) * 1j * z) / (1 - GAMMA * 1j * z) ** 2))


def factor(method: type[ROS2] | type[ROS3], z: float) -> float:
    """By what a step multiplies the amplitude of a mode with step times circular frequency z."""
    rod = beam("rod", 1.0, 1.0, 1.0, 1)
    omega = float(np.sqrt(rod.omega2[0]))
    made: Integrator = method(z / omega)
    mode = Body("rod", rod, q=(1e-3,), stiffening=False)  # of linear theory, as the formula
    clamped = Scene((mode,), (Joint("clamp", "fixed", "ground.O", "rod.a"),), ground={"O": (0, 0, 0)}, plane="z")
    steps = 8 if z < 10 else 2  # before rounding is all that is left
    result = integrate(clamped, end=steps * made.step, output_step=steps * made.step, method=made)
    energy = result["energy.kinetic"] + result["energy.strain"]
    return float((energy[-1] / energy[0]) ** (0.5 / steps))


def numerical_damping() -> Exhibit:
    """One mode of a clamped beam, with steps from a hundredth to thousands of its period."""
    z = np.geomspace(0.03, 1000.0, 40)
    theory = np.array([of_theory(each) for each in z])
    second, third = (np.array([factor(method, each) for each in z]) for method in (ROS2, ROS3))
    return Exhibit(
        "Damping of high modes, accuracy of low ones",
        "modes that the step does not resolve (h Omega > 1) lose their amplitude: what they do is not seen",
        "that is the remedy for parasitic modes; those that matter want h Omega < 0.3, where a step takes next to nothing",
        (
            Claim("amplitude that ROS2 leaves at h Omega = 1000", of_theory(1000.0), factor(ROS2, 1000.0), 1.05),
            Claim("amplitude that ROS2 leaves at h Omega = 3", of_theory(3.0), factor(ROS2, 3.0), 1.05),
            Claim("loss of ROS2 at h Omega = 0.3", 1 - of_theory(0.3), 1 - factor(ROS2, 0.3), 1.1),
        ),
        (
            Proof("loss of amplitude in a step of ROS2 at h Omega = 10", 1 - factor(ROS2, 10.0), 0.5, True),
            Proof("loss of amplitude in a step of ROS2 at h Omega = 0.1", 1 - factor(ROS2, 0.1), 1e-4, False),
            Proof("loss of amplitude in a step of ROS3 at h Omega = 0.1", 1 - factor(ROS3, 0.1), 1e-4, False),
        ),
        (
            Panel(
                "amplitude left after a step", "h Omega", "factor",
                (
                    Curve("ROS2, |R(i h Omega)|", z, theory),
                    Curve("ROS2, measured", z, second, points=True),
                    Curve("ROS3, measured", z, third, points=True),
                ),
                (Mark("h Omega = 1", 1.0),), log=(True, True), bounds=(1e-4, 2.0),
            ),
        ),
    )  # fmt: skip
