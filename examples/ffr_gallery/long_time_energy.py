"""The energy of a motion that goes on for a hundred thousand turns."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import RK4, Variational
from ffr_dyn.scene.forces import SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_prep.body import rigid_body

ROWS = 50


def orbit() -> Scene:
    """A ball of 1 kg that circles on a spring of 2 N/m stretched to 1 m from a free length of 0.5 m: a turn takes 2 pi s."""
    ball = rigid_body("ball", mass=1.0, inertia=np.ones(3), points={"c": np.zeros(3)})
    spring = SpringDamper("spring", "ground.O", "ball.c", 2.0, free_length=0.5)
    held = Joint("table", "planar", "ground.O", "ball.c", axis=(0, 0, 1))
    return Scene(
        (Body("ball", ball, position=(1, 0, 0), velocity=(0, 1, 0)),),
        (held,),
        springs=(spring,),
        ground={"O": (0, 0, 0)},
    )


def long_time_energy(turns: int = 100_000) -> Exhibit:
    """RK4 takes energy from a circular orbit at a rate that follows from its stability function."""
    scene = orbit()

    def lost(kind: type[RK4] | type[Variational], steps: int, turns: int) -> tuple[np.ndarray, np.ndarray]:
        step = 2 * np.pi / steps
        every = turns * 2 * np.pi / ROWS
        result = integrate(scene, end=turns * 2 * np.pi, output_step=every, method=kind(step), outputs=("energy.*",))
        total = result["energy.total"] + result["energy.springs"]
        return result.time / (2 * np.pi), np.abs(total / total[0] - 1)

    coarse, middle = (float(lost(RK4, steps, turns // 100)[1][-1]) for steps in (20, 40))
    turned, bad = lost(RK4, 40, turns)
    _, good = lost(Variational, 40, turns)
    return Exhibit(
        f"Energy over {turns:.0e} turns".replace("e+0", "e"),
        "RK4 with 40 steps a turn loses energy steadily, as the sixth power of the step each step: the orbit shrinks",
        "a variational method: its error of the energy is of the order of the step squared, and does not grow",
        (Claim("loss with 20 steps a turn over that with 40 (order 5 in a turn: 2^5)", 32.0, coarse / middle, 1.6),),
        (
            Proof("share of the energy that RK4 loses with 40 steps a turn", float(bad[-1]), 0.01 * turns / 100_000, True),
            Proof("largest error of the energy with the variational method", float(good.max()), 1e-4, False),
        ),
        (
            Panel(
                "a circular orbit on a spring, 40 steps a turn", "turns", "error of the energy, relative",
                (
                    Curve("RK4", turned[1:], np.maximum(bad[1:], 1e-17)),
                    Curve("variational", turned[1:], np.maximum(good[1:], 1e-17)),
                ),
                log=(True, True),
            ),
        ),
    )  # fmt: skip
