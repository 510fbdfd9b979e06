"""The step beyond which RK4 fails: 2.83 over the highest circular frequency of the assembled system."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary

RK4_LIMIT = 2 * np.sqrt(2)  # on the imaginary axis; Hairer & Wanner 1996, IV.2
STEPS = 400
GROWN = 10.0  # energy, relative to the start
STOPPED = 100.0  # what stands for a run that stops


def explicit_limit() -> Exhibit:
    """A free beam whose frame is clamped at one end: free, it vibrates faster than held by its frame."""
    rod = beam("rod", 1.0, 1.0, 100.0, 8)
    scene = Scene((Body("rod", rod, q=1e-5 * np.ones(rod.n)),), plane="z")
    assembled = float(np.abs(linearise(scene).eigenvalues.imag).max())
    of_body = float(np.sqrt(rod.omega2.max()))
    predicted = RK4_LIMIT / assembled

    def growth(step: float, method: type[RK4] | type[ROS2] = RK4) -> float:
        result = tried(scene, end=STEPS * step, output_step=STEPS * step, method=method(step))
        if result is None:
            return np.inf
        energy = result["energy.kinetic"] + result["energy.strain"]
        return float(energy[-1] / energy[0])

    measured = boundary(lambda h: growth(h) < GROWN, 0.5 * predicted, min(2 * predicted, 0.99 * RK4_LIMIT / of_body))
    steps = predicted * np.array([0.5, 0.7, 0.85, 0.95, 0.99, 1.01, 1.03, 1.06, 1.1])
    found = np.array([min(growth(h), STOPPED) for h in steps])
    return Exhibit(
        "Explicit steps beyond the highest frequency of the assembled system",
        "RK4 grows without bound beyond 2.83 / omega_max; the modes of a body alone promise a larger step than there is",
        "linearly implicit methods (ROS2, ROS3): no elastic frequency limits their step",
        (Claim("largest stable step of RK4", predicted, measured, 1.02, "s"),),
        (
            Proof("limit from the modes of the body alone, over the true one", RK4_LIMIT / of_body / predicted, 1.2, True),
            Proof(f"RK4, energy after {STEPS} steps 3 % beyond the limit", growth(1.03 * predicted), GROWN, True),
            Proof("ROS2, energy with a hundred times that step", growth(100 * predicted, ROS2), 1.0, False),
        ),
        (
            Panel(
                f"a free beam, {rod.n} modes: energy after {STEPS} steps",
                "step [s]", f"energy over that at the start ({STOPPED:g}: stopped)",
                (Curve("RK4", steps, found, points=True),),
                (
                    Mark(f"predicted {predicted:.3g} s", predicted),
                    Mark(f"measured {measured:.3g} s", measured, measured=True),
                ),
                log=(False, True),
            ),
        ),
    )  # fmt: skip
