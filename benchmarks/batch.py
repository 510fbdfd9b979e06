"""Many slider-cranks at once: evaluations per second of a batch over the processors, beside single runs one after another.

    python -m benchmarks.batch [SCENES [SECONDS]]     # by default 4096 scenes of 0.25 s

A crank at a speed of its own turns a rod with eight elastic coordinates, with steps of 0.1 ms; two forces are kept. Single
runs are `fd.forward`, the batch is `fd.forward_many` with a thread for every processor; whole calls are timed, with what
Python does around the compiled loop. Both take turns in shares of the scenes, so that what else the machine does weighs on
both. Every result of the batch is compared with that of its single run, bit by bit. The goal speaks of two processors with
nothing else to do.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace

import ffr_dyn as fd
from benchmarks.race_stiffening import stiffened
from benchmarks.scenes import slider_crank
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.functions.together import processors
from ffr_prep.model.material import Material

GOAL, SHARE = 1.8, 256
HOW = {"output_step": 1e-2, "method": fd.ROS2(1e-4), "outputs": ("crankpin.force", "wrist.force")}


def scenes(count: int) -> list[fd.Scene]:
    """Of one structure, each with a speed of its own, 50 to 150 rad/s."""
    rod = stiffened("slidercrank_rod.geo", Material("steel", 2e11, 0.3, 7870.0), ("crankpin", "slider"), 2)
    whole = slider_crank(rod)
    motors = [fd.Driver("motor", "bearing", fd.polynomial(0.0, 50.0 + 100.0 * k / count)) for k in range(count)]
    return [replace(whole, drivers=(motor,)) for motor in motors]


def equal(one: fd.Result, other: fd.Result) -> bool:
    """To the bit, all quantities."""
    return list(one.quantities) == list(other.quantities) and all(
        one[name].tobytes() == other[name].tobytes() for name in one.quantities
    )


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="?", type=int, default=4096)
    parser.add_argument("seconds", nargs="?", type=float, default=0.25, help="of each scene")
    given = parser.parse_args()
    count, end = given.scenes, given.seconds
    whole, stopwatch = scenes(count), Stopwatch()
    fd.forward(whole[0], end=end, check=False, **HOW)
    single = batch = 0.0
    evaluations = same = 0
    for first in range(0, count, SHARE):
        some = whole[first : first + SHARE]
        began = time.perf_counter()
        alone = [fd.forward(scene, end=end, check=False, stopwatch=stopwatch, **HOW) for scene in some]
        middle = time.perf_counter()
        beside = fd.forward_many(some, end=end, **HOW)
        single, batch = single + middle - began, batch + time.perf_counter() - middle
        evaluations += sum(one.attributes["evaluations"] for one in alone)
        same += sum(isinstance(one, fd.Result) and equal(one, other) for one, other in zip(beside, alone, strict=True))
    print(f"{count} slider-cranks, {evaluations // count} evaluations each, {processors()} processors")
    print(f"single runs  {evaluations / single:12.0f} evaluations/s, {1e3 * single / count:.1f} ms a run, "
          f"{1e3 * stopwatch.wall / count:.1f} ms of it compiled")  # fmt: skip
    print(f"batch        {evaluations / batch:12.0f} evaluations/s, ratio {single / batch:.2f} (goal {GOAL})")
    print(f"equal to the bit: {same} of {count}")
    return 0 if same == count and single >= GOAL * batch else 1


if __name__ == "__main__":
    sys.exit(main())
