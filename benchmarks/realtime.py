"""Real time: the slider-crank with a flexible rod of 8 modes at 1 kHz, over 60 s of simulated time.

    python -m benchmarks.realtime [--duration 60] [--paced] [--plot out/realtime.png]

Goal: mean at most 30 us, 99.9 % at most 150 us for a step with its inputs and outputs. An input pushes the slider; outputs
are its position, the angle of the crank pin and the force in the wrist pin. The load of the machine is printed: it counts.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import replace
from pathlib import Path

from benchmarks.scenes import connecting_rod, slider_crank
from ffr_dyn.functions.time_functions import signal
from ffr_dyn.integrators import ROS2
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.realtime.deadline import SOFT, lines, measure_steps, plot_times
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.scene import Scene

STEP = 1e-3  # s
KEPT = Projection(1e-6)  # m
MEAN, MOST = 30e-6, 150e-6  # s, goals
OUTPUTS = ("slider.pin.position", "crankpin.angle", "wrist.force")


def pushed() -> Scene:
    """The slider-crank with six static shapes and two fixed-interface modes, and a force on its slider."""
    scene = slider_crank(connecting_rod("rigid", 2).body)
    return replace(scene, loads=(Load("gas", "slider.pin", force=(signal("gas"), 0, 0)),), name="slider-crank")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--duration", type=float, default=60.0, help="simulated time [s]")
    parser.add_argument("--paced", action="store_true", help="start the steps when the clock says so")
    parser.add_argument("--plot", type=Path, help="picture of the times")
    options = parser.parse_args()
    timing = measure_steps(
        pushed(), ROS2(STEP), duration=options.duration, outputs=OUTPUTS, stabilisation=KEPT, paced=options.paced
    )
    print(*lines(timing), sep="\n")
    for name, found, goal in (("mean", timing.mean, MEAN), ("99.9 %", timing.quantile(SOFT), MOST)):
        print(f"goal         {name} at most {1e6 * goal:.0f} us: {'met' if found <= goal else 'not met'}")
    print(f"load         {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    if options.plot is not None:
        plot_times(timing, options.plot)


if __name__ == "__main__":
    main()
