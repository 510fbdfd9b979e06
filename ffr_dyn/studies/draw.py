"""Pictures of a study: outputs over parameters, response surfaces, tornado, pairs, convergence of means."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.studies.measures import TIME
from ffr_dyn.studies.table import Table
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import made_folder
from ffr_prep.common.units import bracketed, pretty

LEVELS = 20
LIKELY = 0.95  # probability that a mean lies in its band
MANY = 10.0  # histories, beyond which they are drawn fainter
TICKS = 5  # of an axis, at most: numbers such as 0.0075 need their place
SHORT = 12  # letters of a word under its box, which stands up if it is longer
FIRST = 9  # means of a study, before which their bands need not be seen
BINS, MOST_BINS = 20, 100  # of a histogram beside others, and of one alone, whose widths an outlier would make too many
FEW = 12  # values of a parameter, up to which they are thought to be chosen, and drawn as lines


def plot_study(table: Table, folder: str | Path, outputs: Sequence[str] = ()) -> list[Path]:
    """Draw outputs (default: all) of a study as PNG files in a folder; returns their paths.

        <output>.png           over every parameter
        <output>-surface.png   over the two parameters that it changes with most, where there are two and it changes
        <output>-tornado.png   by how much every parameter changes it, from its least to its greatest value
        <output>-mean.png      its mean over the first runs with 95 % confidence, and its distribution
        pairs.png              all parameters and outputs against each other

    Of a history <output>.png has the rows of all runs, in the colour of the parameter that changes their mean most.

    The tornado is that of a linear fit; R^2 in its title says how linear the output is. Parameters that are texts have boxes
    in <output>.png alone. Raises InputError for unknown names, and where no parameter has several values.

    >>> fd.plot_study(fd.load_table("study.nc"), "pictures")
    """
    names = list(outputs) or list(table.outputs)
    for name in names:
        if name not in table.outputs:
            raise InputError(f"the table has no output {name!r}; there are {', '.join(table.outputs)}")
    several = {name: values for name, values in table.parameters.items() if len(set(values)) > 1}
    if not several:
        raise InputError("no parameter of the study has several values: there is nothing to draw over")
    return list(_drawn(table, names, several, made_folder("the folder of pictures", folder)))


def _drawn(table: Table, names: list[str], several: dict[str, Any], folder: Path) -> Iterator[Path]:
    from ffr_dyn.pictures.histories import plain

    numbers = [name for name in names if table.outputs[name].ndim == 1]
    label = {name: plain(bracketed(name, pretty(table.units.get(name, "")))) for name in (*several, *table.outputs)}
    varied = {label[name]: values for name, values in several.items() if isinstance(values, np.ndarray)}
    texts = {label[name]: np.array(values) for name, values in several.items() if label[name] not in varied}
    for name in names:
        if name not in numbers and name != TIME and np.isfinite(table.outputs[name]).any():
            yield _histories(folder / f"{name}.png", label[name], table.outputs[TIME], table.outputs[name], varied)
    for name in numbers:
        done = np.isfinite(table.outputs[name])
        y, x = table.outputs[name][done], {key: values[done] for key, values in varied.items()}
        if y.size < 2:
            continue
        words = {key: values[done] for key, values in texts.items()}
        yield _over_parameters(folder / f"{name}.png", label[name], x, words, y)
        yield _mean(folder / f"{name}-mean.png", label[name], table.outputs[name])
        if x:
            yield _tornado(folder / f"{name}-tornado.png", label[name], x, y)
        if len(x) > 1:
            first, second = changing_most(x, y)[:2]
            if np.ptp(y) and _spans(x[first], x[second]):
                yield _surface(folder / f"{name}-surface.png", label[name], (first, x[first]), (second, x[second]), y)
    columns = {**varied, **{label[name]: table.outputs[name] for name in numbers}}
    if len(columns) > 1:
        yield _pairs(folder / "pairs.png", columns)


def tornado(parameters: dict[str, Array], y: Array) -> tuple[dict[str, float], float]:
    """(by how much a linear fit changes from the least to the greatest value of every parameter, R^2 of the fit)."""
    centred = y - y.mean() if np.ptp(y) else np.zeros(y.size)  # the mean of equal numbers may be another, by rounding
    A = _fitted(parameters)
    fit = np.linalg.lstsq(A, centred, rcond=None)[0]
    spread = float((centred**2).sum())
    share = 1.0 - float(((centred - A @ fit) ** 2).sum()) / spread if spread > 0 else 1.0
    return dict(zip(parameters, fit[1:].tolist(), strict=True)), share


def _fitted(parameters: dict[str, Array]) -> Array:
    """(runs, 1 + parameters) matrix of a linear fit, of parameters that go from 0 to 1."""
    columns = [(values - values.mean()) / (float(np.ptp(values)) or 1.0) for values in parameters.values()]
    return np.column_stack([np.ones(columns[0].size), *columns])


def changing_most(parameters: dict[str, Array], y: Array) -> list[str]:
    """The parameters, those first that change the linear fit of `tornado` most."""
    changes, _ = tornado(parameters, y)
    return sorted(changes, key=lambda key: -abs(changes[key]))


def _spans(x: Array, y: Array) -> bool:
    """Whether points are no line, so that they can be triangulated."""
    at = (
        np.unique(np.column_stack([x / np.ptp(x), y / np.ptp(y)]), axis=0)
        if np.ptp(x) and np.ptp(y)
        else np.zeros((0, 2))
    )
    return len(at) > 3 and np.linalg.svd(at - at.mean(axis=0), compute_uv=False)[1] > 1e-6


# ---- one picture ----------------------------------------------------------------------------------------------------


def _histories(path: Path, name: str, time: Array, y: Array, varied: dict[str, Array]) -> Path:
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection

    from ffr_dyn.pictures.histories import drawing

    done = np.isfinite(y).any(axis=1)
    time, y, x = time[done], y[done], {key: values[done] for key, values in varied.items()}
    key = changing_most(x, np.nanmean(y, axis=1))[0] if x else ""
    along, of = (time, "time [s]") if np.nanmax(time) > np.nanmin(time) else (_row_numbers(y), "row")
    with drawing(path, (8.0, 4.0)) as figure:
        axes = figure.subplots()
        lines = LineCollection(
            list(np.stack([along, y], axis=-1)), array=x.get(key), lw=0.8, alpha=min(1.0, MANY / max(len(y), 1))
        )
        axes.add_collection(lines)
        axes.autoscale()
        if key:
            figure.colorbar(ScalarMappable(lines.norm, lines.cmap), ax=axes, label=key)  # not as faint as the lines
        axes.set(xlabel=of, ylabel=name)
    return path


def _row_numbers(y: Array) -> Array:
    """Of analyses that are of one moment, such as one over speeds or frequencies."""
    found: Array = np.broadcast_to(np.arange(1.0, y.shape[1] + 1.0), y.shape)
    return found


def _over_parameters(path: Path, name: str, x: dict[str, Array], words: dict[str, Any], y: Array) -> Path:
    from ffr_dyn.pictures.histories import PALETTE, drawing, plain

    with drawing(path, (4.4 * len(x | words), 3.8)) as figure:
        all_axes = figure.subplots(1, len(x | words), squeeze=False, sharey=True)[0]
        for axes, (key, values) in zip(all_axes, (x | words).items(), strict=True):
            chosen = np.unique(values)
            if chosen.size <= FEW or key in words:
                at = chosen if key in x else np.arange(float(chosen.size))
                boxes = [y[values == one] for one in chosen]
                axes.boxplot(boxes, positions=at, widths=0.06 * (np.ptp(at) or 1.0), manage_ticks=False)
            else:
                axes.plot(values, y, ".", color=PALETTE[0], markersize=3)
            axes.set_xlabel(key)
            if key in x:
                axes.locator_params(axis="x", nbins=TICKS)
            else:
                axes.set_xticks(at, map(plain, chosen), rotation=0 if max(map(len, chosen)) < SHORT else 90)
        figure.supylabel(name)
    return path


def _tornado(path: Path, name: str, x: dict[str, Array], y: Array) -> Path:
    from ffr_dyn.pictures.histories import PALETTE, drawing

    changes, share = tornado(x, y)
    keys = sorted(changes, key=lambda key: abs(changes[key]))
    shared = np.linalg.matrix_rank(_fitted(x)) < 1 + len(x)
    title = f"linear fit of {y.size} runs, R² = {share:.3f}" if np.ptp(y) else f"{name} is equal in all {y.size} runs"
    with drawing(path, (6.4, 1.6 + 0.4 * len(keys))) as figure:
        axes = figure.subplots()
        axes.barh(keys, [changes[key] for key in keys], color=[PALETTE[changes[key] < 0] for key in keys])
        axes.axvline(0.0, color="0.3", lw=0.8)
        axes.set(title=title, xlabel=f"change of {name}, least to greatest value")
        axes.locator_params(axis="x", nbins=TICKS)
        if shared:
            axes.set_title(f"{title}\nparameters vary together: the fit cannot tell them apart")
    return path


def _surface(path: Path, name: str, first: tuple[str, Array], second: tuple[str, Array], y: Array) -> Path:
    from ffr_dyn.pictures.histories import drawing

    at, number = np.unique(np.column_stack([first[1], second[1]]), axis=0, return_inverse=True)
    mean = np.bincount(number.ravel(), weights=y) / np.bincount(number.ravel())
    with drawing(path, (6.4, 4.8)) as figure:
        axes = figure.subplots()
        filled = axes.tricontourf(triangulated(at), mean, levels=LEVELS)
        figure.colorbar(filled, ax=axes, label=name)
        axes.plot(at[:, 0], at[:, 1], "k.", markersize=4, clip_on=False)
        axes.set(xlabel=first[0], ylabel=second[0])
        axes.locator_params(nbins=TICKS)
    return path


def triangulated(at: Array) -> Any:
    """The triangles between points (N, 2), as `matplotlib.tri.Triangulation`. Neighbours are found in shares of the ranges:
    those of a modulus in Pa and a diameter in m would be neighbours in the modulus alone."""
    from matplotlib.tri import Triangulation

    shares = (at - at.min(axis=0)) / np.ptp(at, axis=0)
    return Triangulation(at[:, 0], at[:, 1], Triangulation(shares[:, 0], shares[:, 1]).triangles)


def _mean(path: Path, name: str, y: Array) -> Path:
    from ffr_dyn.pictures.histories import PALETTE, drawing

    number, mean, error = running_mean(y)
    half = error * likely_errors(number)
    with drawing(path, (9.6, 3.8)) as figure:
        left, right = figure.subplots(1, 2)
        left.plot(number, mean, color=PALETTE[0], label="mean")
        left.fill_between(number, mean - half, mean + half, color=PALETTE[0], alpha=0.25, label="95 %")
        shown = slice(min(FIRST, number.size) - 1, None)  # the band of the first few is wide
        left.set_ylim(*_widened((mean - half)[shown].min(), (mean + half)[shown].max()))
        left.set(xlabel="runs", ylabel=name)
        left.legend()
        done = y[np.isfinite(y)]
        right.hist(done, min(math.isqrt(done.size), MOST_BINS), range=_range_of_bins(done), color=PALETTE[1])
        right.set(xlabel=name, ylabel="runs")
        right.locator_params(axis="x", nbins=TICKS)
    return path


def _widened(least: float, most: float) -> tuple[float, float]:
    """A range somewhat wider, of one value, too."""
    more = 0.05 * ((most - least) or abs(least) or 1.0)
    return least - more, most + more


def _range_of_bins(values: Array) -> tuple[float, float] | None:
    """A range of a histogram where that of the values is too narrow for bins; None where it is not, or there are none."""
    if not values.size or np.ptp(values) > BINS**2 * np.spacing(np.abs(values).max()):
        return None
    return _widened(values[0], values[0])


def likely_errors(number: Array) -> Array:
    """Standard errors that hold the mean of so many normal numbers with the probability `LIKELY` (Student): 12.7 of two, 1.96
    of many."""
    from scipy.special import stdtrit

    found: Array = stdtrit(number - 1.0, 0.5 + 0.5 * LIKELY)
    return found


def running_mean(y: Array) -> tuple[Array, Array, Array]:
    """(number of runs, mean of the first so many, its standard error), from two runs on; failed runs are left out."""
    y = y[np.isfinite(y)]
    number = np.arange(1, y.size + 1)
    mean = np.cumsum(y) / number
    squares = np.cumsum((y - y.mean()) ** 2) - number * (mean - y.mean()) ** 2
    error = np.sqrt(np.maximum(squares, 0.0) / np.maximum(number - 1, 1) / number)
    return number[1:], mean[1:], error[1:]


def _pairs(path: Path, columns: dict[str, Array]) -> Path:
    from ffr_dyn.pictures.histories import PALETTE, drawing

    names, count = list(columns), len(columns)
    with drawing(path, (1.8 * count + 1, 1.8 * count + 1)) as figure:
        grid: Any = figure.subplots(count, count, squeeze=False)
        for i, below in enumerate(names):
            for j, along in enumerate(names):
                axes = grid[i][j]
                if i == j:
                    done = columns[along][np.isfinite(columns[along])]
                    axes.hist(done, bins=BINS, range=_range_of_bins(done), color=PALETTE[1])
                else:
                    axes.plot(columns[along], columns[below], ".", color=PALETTE[0], markersize=2)
                axes.tick_params(labelsize=6)
                axes.locator_params(nbins=TICKS)
                axes.set_xlabel(along if i == count - 1 else "", fontsize=8)
                axes.set_ylabel(below if j == 0 else "", fontsize=8)
    return path
