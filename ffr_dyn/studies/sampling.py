"""The points of a study: grids, lists, and samples of distributions, by SciPy.

A grid has every combination of its axes, the last one fastest. Samples of distributions are drawn at the quantiles of points
in the unit cube: at random (Monte Carlo), or spread by a Latin hypercube or a Sobol sequence (scipy.stats.qmc); beside
a grid every sample goes with every point of it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import stats
from scipy.stats import qmc

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

MOST = 10_000_000  # points of a study: some GB of a table
DIGITS = 15  # of numbers between two others: those that are written

Sampling = Literal["monte-carlo", "latin-hypercube", "sobol"]
Value = float | str


@dataclass(frozen=True)
class Axis:
    """Values that a parameter takes one after another."""

    values: tuple[Value, ...]


@dataclass(frozen=True)
class Spread:
    """A parameter with a distribution: its name in scipy.stats and what that takes, loc and scale last.

    "normal" (mean, deviation), "uniform" (least, most), "triangular" (least, likeliest, most) and "lognormal" (median,
    deviation of the logarithm) are written as people say them. With a unit, that of SI, its values are texts.
    """

    kind: str
    numbers: tuple[float, ...]
    unit: str = ""

    def at(self, share: Array) -> Array:
        """Quantiles. Raises InputError for a distribution that there is not, or numbers that it does not take."""
        try:
            with np.errstate(all="ignore"):
                found: Array = np.asarray(self._frozen().ppf(share), dtype=float)
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.kind} {list(self.numbers)}: {error}") from None
        if not np.isfinite(found).all():
            raise InputError(f"{self.kind} {list(self.numbers)} has no finite quantiles: check its numbers")
        return found

    def _frozen(self) -> Any:
        n = self.numbers
        if self.kind in USUAL and len(n) != len(USUAL[self.kind]):
            raise InputError(f"{self.kind} takes [{', '.join(USUAL[self.kind])}], and {len(n)} numbers are given")
        if self.kind == "normal":
            return stats.norm(n[0], n[1])
        if self.kind == "uniform":
            return stats.uniform(n[0], n[1] - n[0])
        if self.kind == "triangular":
            return stats.triang((n[1] - n[0]) / (n[2] - n[0]) if n[2] > n[0] else math.nan, n[0], n[2] - n[0])
        if self.kind == "lognormal":
            return stats.lognorm(n[1], 0.0, n[0])
        made = getattr(stats, self.kind, None)
        if not isinstance(made, stats.rv_continuous):
            raise InputError(
                f"there is no distribution {self.kind!r}; there are {', '.join(USUAL)} and those of scipy.stats"
            )
        shapes = _shapes(self.kind)
        if not len(shapes) <= len(n) <= len(shapes) + 2:
            takes = ", ".join([*shapes, "loc", "scale"])
            raise InputError(f"{self.kind} takes [{takes}], and {len(n)} numbers are given")
        return made(*n)


USUAL = {
    "normal": ("mean", "deviation"),
    "uniform": ("least", "most"),
    "triangular": ("least", "likeliest", "most"),
    "lognormal": ("median", "deviation of the logarithm"),
}


SHAPING = {"lognormal": "the deviation of the logarithm"}  # what else than shape parameters has no unit


def pure_numbers(kind: str) -> slice:
    """Which numbers of a distribution have no unit, whatever it is of: those that give its shape."""
    return slice(1, None) if kind in SHAPING else slice(0 if kind in USUAL else len(_shapes(kind)))


def _shapes(kind: str) -> list[str]:
    """The shape parameters of a distribution of scipy.stats; none of what is no such."""
    said = getattr(getattr(stats, kind, None), "shapes", None)
    return said.split(", ") if isinstance(said, str) else []


def with_unit(values: Sequence[Value], unit: str) -> list[Value]:
    """Numbers in SI as texts with their unit, each a word of a line that makes a body; as they are without one."""
    return [f"{value!r}{unit}" for value in values] if unit else list(values)


def spaced(start: float, end: float, count: int, *, logarithmic: bool = False) -> Axis:
    """So many values from start to end. Raises InputError where there are none."""
    if count < 1 or count > MOST:
        raise InputError(f"there cannot be {count} values on an axis; give 1 to {MOST}")
    if not math.isfinite(end - start):
        raise InputError(f"there are no finite values from {start:g} to {end:g}")
    if logarithmic and not (start > 0 and end > 0):
        raise InputError(f"spacing by logarithms wants values above zero, not from {start:g} to {end:g}")
    values = np.geomspace(start, end, count) if logarithmic else np.linspace(start, end, count)
    between = [float(f"{value:.{DIGITS}g}") for value in values[1:-1]]  # 0.3, and not 0.30000000000000004
    return Axis((*values[:1].tolist(), *between, *values[1:][-1:].tolist()))


def points(
    given: Mapping[str, Axis | Spread], *, samples: int = 0, sampling: Sampling = "monte-carlo", seed: int = 0,
    paired: bool = False,
) -> tuple[dict[str, Value], ...]:  # fmt: skip
    """The values of all parameters, point after point.

    samples : how many of the distributions; paired: the axes are one list of points, not a grid

    Raises InputError for too many points, distributions without samples, paired axes of unequal length.
    """
    axes = {name: axis.values for name, axis in given.items() if isinstance(axis, Axis)}
    spreads = {name: spread for name, spread in given.items() if isinstance(spread, Spread)}
    _check(axes, spreads, samples, paired)
    rows = list(zip(*axes.values(), strict=True)) if paired else list(itertools.product(*axes.values()))
    grid = [dict(zip(axes, row, strict=True)) for row in rows] if axes else [{}]
    drawn = _drawn(spreads, samples, sampling, seed) if spreads else [{}]
    return tuple({name: (one | other)[name] for name in given} for one in grid for other in drawn)


def _check(axes: Mapping[str, Sequence[Value]], spreads: Mapping[str, Spread], samples: int, paired: bool) -> None:
    lengths = {name: len(values) for name, values in axes.items()}
    if paired and len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} has {count}" for name, count in lengths.items())
        raise InputError(f"a list of points wants as many values of every parameter: {told}")
    if spreads and samples < 1:
        raise InputError(f"{', '.join(spreads)}: give samples = N, how many points of the distribution")
    of_grid = max(lengths.values(), default=1) if paired else math.prod(lengths.values())
    count = of_grid * (samples if spreads else 1)
    if not 0 < count <= MOST:
        product = " x ".join([*map(str, lengths.values()), *([f"{samples} samples"] if spreads else [])])
        raise InputError(
            f"a study of {count:.3g} runs ({product}): "
            f"at most {MOST:.0e}; take fewer values, or samples of distributions in place of a grid"
        )


def _drawn(spreads: Mapping[str, Spread], samples: int, sampling: Sampling, seed: int) -> list[dict[str, Value]]:
    shares = _cube(len(spreads), samples, sampling, seed)
    columns = list[list[Value]]()
    for (name, spread), share in zip(spreads.items(), shares.T, strict=True):
        try:
            columns.append(with_unit(spread.at(share).tolist(), spread.unit))
        except InputError as error:
            raise InputError(f"parameters.{name}: {error}") from None
    return [dict(zip(spreads, row, strict=True)) for row in zip(*columns, strict=True)]


def _cube(dimensions: int, samples: int, sampling: Sampling, seed: int) -> Array:
    """(samples, dimensions) in the open unit cube."""
    random = np.random.default_rng(seed)
    if sampling == "latin-hypercube":
        found = qmc.LatinHypercube(dimensions, seed=random).random(samples)
    elif sampling == "sobol":
        found = qmc.Sobol(dimensions, seed=random).random_base2(max(0, (samples - 1).bit_length()))[:samples]
    elif sampling == "monte-carlo":
        found = random.random((samples, dimensions))
    else:
        raise InputError(f"sampling is {sampling!r}; give monte-carlo, latin-hypercube or sobol")
    return np.clip(found, 1e-15, 1.0 - 1e-15)
