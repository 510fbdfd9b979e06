"""Whether runs know their error, on the benchmark set and variants of it.

    python -m benchmarks.accuracy [--method ros2] [--variants plain,undamped,...] [--unseen | --all] [case ...]

For every scene, with the step that is found for an accuracy of 1e-3 and with steps given around it:

    pairs    the error that a run tells of every default output over the true one, where the true one is 1e-6 to 0.5 of the
             range and more than rounding: share within 0.3 to 5, share below 0.1, least and largest
    places   the true error of positions and angles, in thousandths of their ranges, with the step that was found
    forces   the same of forces, moments and deflections that are not told to ring
    silent   true error over three times the told one, the worst of all outputs
    cost     evaluations of all runs over those of the final one: of a default run, search and check included, and what the
             check of a given step adds

and at the end a table, a line for each method and variant, and one for all variants of a method. The truth is RK4 with a
step that resolves the fastest vibration (h omega <= 0.3), no longer than a sixteenth of the run's or a 256th of a row, and is
kept in `out/references`; true errors below its own distance from the same with twice the step are left out, and so are scenes
where it takes more than LONGEST steps. Variants: "plain", "undamped", "shock" (bodies set off with a deflection), "soft" and
"stiff" (frequencies a third and four times as high). `--unseen` takes the scenes of `benchmarks.unseen`, on which nothing was
chosen, `--all` both.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ffr_gallery.scene_set import CASES, Case

from benchmarks.unseen import UNSEEN
from ffr_dyn.analyses.checkpoint import fingerprint
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.trials.search import DRIVING
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.step_error import PLACES, largest_difference, ranges, roundings
from ffr_dyn.consistency.unresolved import vibrations
from ffr_dyn.integrators import RK4, Within, method_named
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError

LONGEST = 1_500_000  # steps of a reference
RESOLVED, FINER, ROW = 0.3, 16, 256
KEPT = Path("out") / "references"
STEPS = (4, 16)  # to a row, given
ACCURACY = 1e-3
LEAST, MOST = 1e-6, 0.5  # true errors over range that are looked at
LOW, HIGH, FALSE = 0.3, 5.0, 0.1


def undamped(body: Body) -> Body:
    return replace(body, damping=0.0)


def set_off(body: Body) -> Body:
    """With rates of its elastic coordinates that a deflection of a thousandth of its size in its first mode would have."""
    if not body.model.n or body.part_of:
        return body
    rate = np.zeros(body.model.n)
    rate[0] = 1e-3 * body.model.size * np.sqrt(body.model.mass * body.model.omega2[0])
    return replace(body, q_dot=tuple(rate))


def with_frequencies(factor: float) -> Callable[[Body], Body]:
    return lambda body: replace(body, model=replace(body.model, omega2=factor**2 * body.model.omega2))


VARIANTS: dict[str, Callable[[Body], Body]] = {
    "plain": lambda body: body,
    "undamped": undamped,
    "shock": set_off,
    "soft": with_frequencies(1 / 3),
    "stiff": with_frequencies(4.0),
}


@dataclass(frozen=True)
class Found:
    """Of a scene: pairs of told over true errors, true errors of what is to be kept, costs."""

    pairs: list[float]
    places: float
    forces: float
    silent: float
    cost: float
    extra: float


@dataclass(frozen=True)
class Truth:
    """A reference, and its own error, an output each."""

    run: Result
    own: dict[str, float]


def examined(name: str, scene: Scene, case: Case, method: str) -> Found:
    """Raises InputError where the reference is too long."""
    span = {"end": case.end, "output_step": case.output_step}
    found = forward(scene, **span, method=Within(ACCURACY, method))
    true = reference(name, scene, span, found.attributes["step"])
    pairs, silent = compared(found, true)
    extras = []
    for count in STEPS:
        checked = given(scene, span, method, count)
        more, worst = compared(checked, true)
        pairs, silent = [*pairs, *more], max(silent, worst)
        extras += [] if checked is None else [checked.attributes["effort"] - 1.0]
    if not pairs:
        raise InputError("its reference is no sharper than the runs")
    return Found(pairs, *kept(found, true), silent, found.attributes["effort"], statistics.fmean(extras or [0.0]))


def given(scene: Scene, span: dict[str, float], method: str, count: int) -> Result | None:
    try:
        return forward(scene, **span, method=method_named(method)(span["output_step"] / count), check=True)
    except ComputationError:
        return None


def reference(name: str, scene: Scene, span: dict[str, float], step: float) -> Truth:
    """One that is kept and as fine, or a new one."""
    fastest = vibrations(assemble(scene), 0.0).omega.max(initial=0.0)
    finest = min(step / FINER, span["output_step"] / ROW, RESOLVED / fastest if fastest > 0 else np.inf)
    count = 2 * int(np.ceil(span["output_step"] / finest / 2))
    rows = span["end"] / span["output_step"]
    if count * rows > LONGEST:
        raise InputError(f"its reference would take {count * rows:.1e} steps")
    fine, coarse = (resolved(name, scene, span, steps) for steps in (count, count // 2))
    return Truth(fine, {one: largest_difference(fine[one], coarse[one]) for one in ranges(fine)})


def resolved(name: str, scene: Scene, span: dict[str, float], count: int) -> Result:
    """With so many steps of RK4 to a row, kept for another time by what the scene compiles to."""
    made = assemble(scene)
    mark = fingerprint(made.system.model, made.x.tobytes(), made.v.tobytes(), *span.values())[:12]
    path = KEPT / f"{name.replace(' ', '.')}.{count}.{mark}.nc"
    if path.exists():
        return load_result(path)
    found = integrate(scene, **span, method=RK4(span["output_step"] / count), stabilisation=Projection(1e-12))
    path.parent.mkdir(parents=True, exist_ok=True)
    save_result(found, path)
    return found


def compared(found: Result | None, true: Truth) -> tuple[list[float], float]:
    """Told over true errors, and the worst of the true error over three times the told one."""
    if found is None:
        return [], 0.0
    pairs, silent, scales, rounding = [], 0.0, ranges(true.run), roundings(true.run)
    for name, (told, _) in found.attributes["errors"].items():
        off = largest_difference(found[name], true.run[name])
        if max(LEAST * scales[name], rounding[name], true.own[name]) < off < MOST * scales[name]:
            pairs.append(told / off)
            silent = max(silent, off / (3.0 * told))
    return pairs, silent


def kept(found: Result, true: Truth) -> tuple[float, float]:
    """True errors over range: of positions and angles, and of forces and deflections told to be within the accuracy."""
    scales, errors = ranges(true.run), found.attributes["errors"]
    off = {name: largest_difference(found[name], true.run[name]) / scales[name] for name in errors if scales[name] > 0}
    places = max((off[name] for name in off if PLACES.search(name)), default=0.0)
    told = [name for name in off if DRIVING.search(name) and errors[name][1] <= ACCURACY]
    return places, max((off[name] for name in told), default=0.0)


def scenes(cases: Sequence[Case], variant: str) -> Iterator[tuple[str, Case, Scene]]:
    for case in cases:
        scene = case.scene()
        yield f"{case.name} {variant}", case, replace(scene, bodies=tuple(map(VARIANTS[variant], scene.bodies)))


def line(name: str, found: Found) -> str:
    pairs = np.array(found.pairs)
    inside, below = np.mean((pairs >= LOW) & (pairs <= HIGH)), np.mean(pairs < FALSE)
    return (
        f"{name:26}{pairs.size:6}{100 * inside:8.1f}{100 * below:7.1f}{pairs.min():8.2f}{pairs.max():8.1f}"
        f"{1e3 * found.places:9.3f}{1e3 * found.forces:9.3f}{found.silent:8.2f}{found.cost:7.1f}{found.extra:7.1f}"
    )


def report(method: str, cases: Sequence[Case], variant: str) -> list[Found]:
    """Print the outcome for each scene, and return it."""
    print(f"\n{method}: told over true errors; true errors in thousandths of ranges; costs in final runs\n"
          f"{'scene':26}{'pairs':>6}{'in %':>8}{'low %':>7}{'least':>8}{'most':>8}{'places':>9}{'forces':>9}{'silent':>8}"
          f"{'cost':>7}{'extra':>7}")  # fmt: skip
    every: list[Found] = []
    for name, case, scene in scenes(cases, variant):
        try:
            found = examined(name, scene, case, method)
        except (ComputationError, InputError) as error:
            print(f"{name:26}left out: {str(error)[:120]}", flush=True)
            continue
        every.append(found)
        print(line(name, found), flush=True)
    return every


WORDS = ("scenes", "pairs", "in %", "low %", "places %", "forces", "silent", "cost", "extra")
HEAD = "\n".join(
    f"{name:15}" + "".join(f"{word:>9}" for word in words)
    for name, words in (("", WORDS), ("wanted", ("", "", "95", "0", "95", f"{ACCURACY:g}", "1", "3", "2")))
)


def summary(name: str, every: list[Found]) -> str:
    """Shares of pairs and of scenes whose places are kept, worst forces and silence, medians of costs."""
    pairs = np.array([pair for found in every for pair in found.pairs])
    inside, below = np.mean((pairs >= LOW) & (pairs <= HIGH)), np.mean(pairs < FALSE)
    reached = np.mean([found.places <= ACCURACY for found in every])
    forces, silent = (max(getattr(found, of) for found in every) for of in ("forces", "silent"))
    cost, extra = (statistics.median(getattr(found, of) for found in every) for of in ("cost", "extra"))
    return (
        f"{name:15}{len(every):9d}{pairs.size:9d}{100 * inside:9.1f}{100 * below:9.2f}{100 * reached:9.0f}{forces:9.1g}"
        f"{silent:9.2f}{cost:9.2f}{extra:9.2f}"
    )


def main() -> None:
    """Print the tables."""
    every = [*CASES, *UNSEEN]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="case", help=", ".join(case.name for case in every))
    parser.add_argument("--method", default="ros2,ros3", help="names with commas between them")
    parser.add_argument("--variants", default=",".join(VARIANTS), help="names with commas between them")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--unseen", action="store_true", help="the scenes on which nothing was chosen")
    which.add_argument("--all", action="store_true", help="these and the benchmark set")
    given = parser.parse_args()
    listed = every if given.all else (UNSEEN if given.unseen else CASES)
    cases = [case for case in listed if not given.cases or case.name in given.cases]
    if strange := {*given.cases} - {case.name for case in listed}:
        parser.error(f"no case {sorted(strange)[0]!r}; there are {', '.join(case.name for case in listed)}")
    methods, variants = given.method.split(","), given.variants.split(",")
    found = {(method, variant): report(method, cases, variant) for method in methods for variant in variants}
    together = {method: [one for variant in variants for one in found[method, variant]] for method in methods}
    lines = [summary(" ".join(of), every) for of, every in found.items() if every]
    lines += [summary(f"{method} all", every) for method, every in together.items() if every]
    print("\n" + "\n".join([HEAD, *lines]))


if __name__ == "__main__":
    main()
