"""The exhibit of the gallery: a method that fails where theory says it does, and a remedy that holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap

import numpy as np

from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Claim:
    """A number that theory predicts, and its measurement; `within`: the factor by which they may differ."""

    text: str
    predicted: float
    measured: float
    within: float
    unit: str = ""

    @property
    def holds(self) -> bool:
        return bool(1 / self.within <= self.measured / self.predicted <= self.within)


@dataclass(frozen=True)
class Proof:
    """A failure is a value beyond `limit`, a remedy one that stays below it; NaN is beyond every limit."""

    text: str
    value: float
    limit: float
    fails: bool
    unit: str = ""

    @property
    def holds(self) -> bool:
        return bool(self.fails != (self.value <= self.limit))


@dataclass(frozen=True, eq=False)
class Curve:
    """y over x; `points`: marks instead of a line."""

    label: str
    x: Array
    y: Array
    points: bool = False


@dataclass(frozen=True)
class Mark:
    """A vertical line."""

    label: str
    at: float
    measured: bool = False


@dataclass(frozen=True)
class Panel:
    """A diagram; log: logarithmic axes x, y;  bounds: of y."""

    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    marks: tuple[Mark, ...] = ()
    log: tuple[bool, bool] = (False, False)
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True)
class Exhibit:
    """A failure, its remedy, and what shows both."""

    title: str
    failure: str
    remedy: str
    claims: tuple[Claim, ...]
    proofs: tuple[Proof, ...]
    panels: tuple[Panel, ...]

    @property
    def holds(self) -> bool:
        """Whether it fails and holds as claimed."""
        return all(claim.holds for claim in self.claims) and all(proof.holds for proof in self.proofs)


def lines(exhibit: Exhibit) -> list[str]:
    """The exhibit in words and numbers."""
    said = [f"{exhibit.title}", f"  fails   {exhibit.failure}", f"  remedy  {exhibit.remedy}"]
    said += [f"  {_tick(c.holds)} {_claimed(c)}" for c in exhibit.claims]
    return said + [f"  {_tick(p.holds)} {_proved(p)}" for p in exhibit.proofs]


def _claimed(claim: Claim) -> str:
    return f"{claim.text}: predicted {claim.predicted:.4g}, measured {claim.measured:.4g} {claim.unit}".rstrip()


def _proved(proof: Proof) -> str:
    kind, side = ("fails", "above") if proof.fails else ("holds", "at most")
    unit = f" {proof.unit}" if proof.unit else ""
    return f"{kind}: {proof.text}: {proof.value:.3g}{unit} ({side} {proof.limit:.3g})"


def _tick(holds: bool) -> str:
    return "ok     " if holds else "NOT SO "


def draw(exhibit: Exhibit, path: str | Path) -> Path:
    """The panels side by side over what fails and what holds, as .png, .svg or .pdf."""
    from ffr_dyn.pictures.histories import PALETTE, drawing

    count = len(exhibit.panels)
    with drawing(path, (0.5 + 6.0 * count, 5.6)) as figure:
        for axes, panel in zip(figure.subplots(1, count, squeeze=False)[0], exhibit.panels, strict=True):
            for k, curve in enumerate(panel.curves):
                style = {"marker": "o", "linestyle": ""} if curve.points else {}
                axes.plot(curve.x, curve.y, color=PALETTE[k], label=curve.label, **style)
            for mark in panel.marks:
                style = {"color": PALETTE[6 if mark.measured else 3], "linestyle": "--" if mark.measured else "-"}
                axes.axvline(mark.at, label=mark.label, lw=1.4, **style)
            for of, scale in zip("xy", panel.log, strict=True):
                getattr(axes, f"set_{of}scale")("log" if scale else "linear")
                if not scale:
                    axes.locator_params(axis=of, nbins=6)
            if panel.bounds is not None:
                axes.set_ylim(*panel.bounds)
            axes.set(title=panel.title, xlabel=panel.x, ylabel=panel.y)
            axes.legend(fontsize=8.5)
        figure.suptitle("\n".join(wrap(exhibit.title, 48 * count)), fontweight="bold")
        figure.supxlabel("\n".join(_said(exhibit, 78 * count)), fontsize=8.5, x=0.02, ha="left")
    return Path(path)


def _said(exhibit: Exhibit, width: int) -> list[str]:
    """The words under a picture, in lines no longer than `width`."""
    numbers = [f"{c.text}: predicted {c.predicted:.4g}, measured {c.measured:.4g} {c.unit}" for c in exhibit.claims]
    said = [f"Fails: {exhibit.failure}.", f"Holds: {exhibit.remedy}.", *numbers]
    return [line for text in said for line in wrap(text, width)]


def boundary(stable: Callable[[float], bool], low: float, high: float, count: int = 12) -> float:
    """Where `stable` changes from true (at low) to false (at high), by bisection of the logarithm; NaN if it does not."""
    if not stable(low) or stable(high):
        return np.nan
    for _ in range(count):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return float(np.sqrt(low * high))
