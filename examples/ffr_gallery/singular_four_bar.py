"""Equal four-bars (IFToMM A02): all links align in every half turn, and constraints become dependent there."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Drifting, Projection, Stabilisation
from ffr_dyn.results.result import Result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import GRAVITY, bar, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof

COUNT = 2
STEPS = (400, 450, 500, 550)  # to the first singular position, so that one ends in it
OFF = np.array([0.0, *np.geomspace(1e-9, 1e-3, 13)])  # by what the steps are too long for that
BROKEN = 10.0  # J, what stands for a run that fails


def four_bars(count: int) -> Scene:
    """`count` parallelograms side by side, upright, their tops moving at 1 m/s."""
    up = (0.0, 0.0, np.pi / 2)
    standing = [
        Body(f"s{k}", bar(f"s{k}"), position=(k, 0, 0), rotation=up, omega_bar=(0, 0, -1.0)) for k in range(count + 1)
    ]
    lying = [Body(f"c{k}", bar(f"c{k}"), position=(k, 1, 0), velocity=(1.0, 0, 0)) for k in range(count)]
    feet = [Joint(f"foot{k}", "revolute", f"ground.f{k}", f"s{k}.a") for k in range(count + 1)]
    left = [Joint(f"left{k}", "revolute", f"s{k}.b", f"c{k}.a") for k in range(count)]
    right = [Joint(f"right{k}", "revolute", f"c{k}.b", f"s{k + 1}.b") for k in range(count)]
    ground = {f"f{k}": (k, 0, 0) for k in range(count + 1)}
    return Scene((*standing, *lying), (*feet, *left, *right), ground=ground, gravity=GRAVITY)


def singular_four_bar() -> Exhibit:
    """Runs whose steps end in the singular position, or beside it."""
    scene, aligned = four_bars(COUNT), time_of_alignment(COUNT)

    def run(steps: int, off: float, keep: Stabilisation) -> Result | None:
        step = aligned / steps * (1 + off)
        return tried(
            scene, end=2 * steps * step, output_step=step, method=RK4(step), stabilisation=keep, outputs=("energy.*",)
        )

    def change(steps: int, off: float, keep: Stabilisation) -> float:
        result = run(steps, off, keep)
        energy = np.array([0, np.inf]) if result is None else result["energy.total"]
        return min(float(np.nan_to_num(np.abs(energy - energy[0]), nan=np.inf).max()), BROKEN)

    plain = [max(change(steps, off, Drifting()) for off in (0.0, 1e-6)) for steps in STEPS]
    ours = [max(change(steps, off, Projection()) for off in (0.0, 1e-6)) for steps in STEPS]
    free, held = (np.array([change(STEPS[2], off, keep) for off in OFF]) for keep in (Drifting(), Projection()))
    falling = Event("down", "s0.b.position.y", 0.0, direction="falling")
    passed = integrate(scene, end=1.0, output_step=0.1, method=RK4(1e-3), events=(falling,)).attributes["events"][0][
        "time"
    ]
    through = run(STEPS[2], 0.0, Projection())
    assert through is not None
    energy = np.abs(through["energy.total"] - through["energy.total"][0])
    return Exhibit(
        f"Singular positions: {COUNT} equal four-bars",
        "where the links align, constraints depend on one another: what a step divides by vanishes, the motion is thrown off",
        "projection: constraints are held far tighter on the approach, and no stage of a step lies beside the position",
        (Claim("time when the links align", aligned, float(passed), 1 + 1e-6, "s"),),
        (
            Proof("change of energy without stabilisation (10: the run stops)", min(plain), 1e-4, True, "J"),
            Proof("change of energy with projection", max(ours), 1e-6, False, "J"),
        ),
        (
            Panel(
                "steps that end beside the singular position",
                "relative distance of the step from it", "change of energy [J]",
                (
                    Curve("no stabilisation", OFF + 1e-10, np.maximum(free, 1e-12), points=True),
                    Curve("projection", OFF + 1e-10, np.maximum(held, 1e-12), points=True),
                ),
                log=(True, True),
            ),
            Panel(
                "through it, with projection", "time [s]", "change of energy [J]",
                (Curve("a step ends in it", through.time, np.maximum(energy, 1e-14)),),
                (Mark("links align", aligned),), log=(False, True),
            ),
        ),
    )  # fmt: skip


def time_of_alignment(count: int) -> float:
    """From theta_ddot = c sin(theta) / J, which is the mechanism's motion, by the energy integral; theta from upright."""
    J, c = (count + 1) / 3 + count, 9.81 * ((count + 1) / 2 + count)
    at, weight = np.polynomial.legendre.leggauss(60)
    theta = 0.25 * np.pi * (at + 1)
    return float(0.25 * np.pi * weight @ (1 + 2 * c / J * (1 - np.cos(theta))) ** -0.5)
