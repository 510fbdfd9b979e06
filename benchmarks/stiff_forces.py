"""The cost of implicit forces: processor time of a step of ROS2, with and without them, for chains of 32 links.

A damper on every joint shares the block of its joint: goal, at most a quarter of a step (half a stage of two). Springs
between the middles of neighbouring links and bushings in place of joints have blocks of their own. Beside them the same
forces with RK4, where they are explicit, by its four evaluations as two.
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import replace

from benchmarks.courses import FIXED_INTERFACE_MODES, LINKS
from benchmarks.scenes import chain, pendulum_rod, with_middle
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.scene.forces import Bushing, JointSpring, SpringDamper
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import ComputationError

GOAL = 1.25
STEP, STEPS = 5e-5, 400


def time_of_step(scene: Scene, method: Integrator) -> float:
    """Processor time [us]."""
    watch = Stopwatch()
    integrate(scene, end=STEP * STEPS, output_step=STEP * STEPS, method=method, outputs=["*.R"], stopwatch=watch)
    return 1e6 * watch.cpu / STEPS


def explicit(scene: Scene) -> float:
    """Time of two evaluations of RK4 [us], with a step that everything bears; the motion does not matter."""
    try:
        return 0.5 * time_of_step(scene, RK4(STEP))
    except ComputationError:
        return float("nan")


def scenes(modes: int) -> dict[str, Scene]:
    """The chain, and what is added to it."""
    link = with_middle(pendulum_rod("rigid", modes).body)
    plain = replace(chain(link, LINKS, "revolute"), plane="none")
    joints = [joint.name for joint in plain.joints]
    dampers = tuple(JointSpring(f"damper{k}", joint, damping=0.05) for k, joint in enumerate(joints))
    ends = [(f"link{k}.middle", f"link{k + 1}.middle") for k in range(LINKS - 1)]
    springs = tuple(SpringDamper(f"spring{k}", i, j, 100.0, 0.1, 1.2) for k, (i, j) in enumerate(ends))
    stiff = (1e5, 1e5, 1e5, 1e2, 1e2, 1e2)
    bushings = tuple(Bushing(f"bushing{k}", joint.i, joint.j, stiff) for k, joint in enumerate(plain.joints))
    return {
        "no forces": plain,
        "dampers at the joints": replace(plain, forces=dampers),
        "springs beside them": replace(plain, springs=springs),
        "bushings in their place": replace(plain, joints=(), forces=bushings),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repeats", nargs="?", type=int, default=5, help="runs of each, of which the median counts")
    repeats = parser.parse_args().repeats
    print(f"processor time of a step of ROS2, chain of {LINKS} [us]")
    for modes in FIXED_INTERFACE_MODES.values():
        made = scenes(modes)
        runs = [{name: time_of_step(scene, ROS2(STEP)) for name, scene in made.items()} for _ in range(repeats)]
        taken = {name: statistics.median(run[name] for run in runs) for name in made}
        for name, scene in made.items():
            ratio, stages = taken[name] / taken["no forces"], explicit(scene)
            met = "" if name != "dampers at the joints" else ("met" if ratio <= GOAL else "not met")
            print(f"{modes + 6:4} coordinates, {name:24}{taken[name]:9.1f}{ratio:7.2f}  {met:8} explicit {stages:9.1f}")


if __name__ == "__main__":
    main()
