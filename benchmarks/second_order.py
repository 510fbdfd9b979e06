"""Accuracy of second-order bodies: against geometrically exact beams, and the laws that they must hold.

    python -m benchmarks.second_order [case ...]

prints a line for every figure with its goal, and ends with code 1 if one is missed. References are exact beams
(`benchmarks.exact_beam`, checked and computed again by its own `main`), published tables and closed forms; each stands with
its case. Bodies are reduced under three reference conditions: fixed at an end, simply supported at both, mean axis. What
stops with an error is a line too.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator

from benchmarks import second_order_laws as laws
from benchmarks import second_order_motions as motions
from benchmarks import second_order_statics as statics
from benchmarks.preparation import Figure, buckling, rotating_beams

CASES: dict[str, Callable[[], Iterator[Figure]]] = {
    **motions.CASES,
    **statics.CASES,
    "blades": rotating_beams,
    "buckling": buckling,
    **laws.CASES,
}


def main() -> None:
    """Print the figures of the cases that are named, or of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="case", help=", ".join(CASES))
    wanted, missed = parser.parse_args().cases or list(CASES), 0
    if strange := [name for name in wanted if name not in CASES]:
        parser.error(f"no case {strange[0]!r}; there are {', '.join(CASES)}")
    for name in wanted:
        began = time.perf_counter()
        for figure in CASES[name]():
            missed += not figure.met
            bound = f"{'>=' if figure.above else '<='} {figure.goal:.3g}"
            print(f"{figure.what:72}{figure.found:12.4g}  {bound:12}{'ok' if figure.met else 'MISSED'}", flush=True)
        print(f"    {name}: {time.perf_counter() - began:.1f} s", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
