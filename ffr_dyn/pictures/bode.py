"""Transfer functions as pictures: gain and phase (Bode), and the locus in the plane of complex numbers (Nyquist)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ffr_dyn.pictures.histories import PALETTE, drawing
from ffr_dyn.results.result import Result


def draw_bode(result: Result, path: str | Path) -> Path:
    """Draw gain and phase over the frequency of what `response` returns: .png, .svg or .pdf.

        fd.draw_bode(fd.response(scene, input="hinge.moment", outputs=["arm.tip.acceleration"]), "bode.png")

    Raises InputError for another kind of file.

    >>> fd.draw_bode(result, "bode.png")
    """
    f = result["frequency"]
    with drawing(path, (10.0, 7.0)) as figure:
        gain, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        for k, name in enumerate(labelled(result)):
            color = PALETTE[k % len(PALETTE)]
            gain.loglog(f, np.maximum(result["gain"][:, k], 1e-300), color=color, label=name)
            phase.semilogx(f, result["phase"][:, k], color=color)
        gain.set_ylabel(f"gain to {result.attributes['input']}, per {result.attributes.get('input_unit', '1')}")
        gain.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02))
        phase.set_ylabel("phase [°]")
        phase.set_xlabel("frequency [Hz]")
    return Path(path)


def draw_nyquist(result: Result, path: str | Path) -> Path:
    """Draw the locus of the transfer functions that `response` returns: .png, .svg or .pdf.

        fd.draw_nyquist(fd.response(scene, input="hinge.moment", outputs=["arm.tip.acceleration.y"]), "locus.png")

    Raises InputError for another kind of file.

    >>> fd.draw_nyquist(result, "nyquist.png")
    """
    transfer = result["transfer"]
    with drawing(path, (8.0, 7.0)) as figure:
        axes = figure.subplots()
        for k, name in enumerate(labelled(result)):
            H = transfer[:, k]
            axes.plot(H[:, 0], H[:, 1], color=PALETTE[k % len(PALETTE)], label=name)
            axes.plot(*H[0], "o", color=PALETTE[k % len(PALETTE)], markersize=6)
        axes.set_xlabel("real part")
        axes.set_ylabel("imaginary part")
        axes.set_aspect("equal", adjustable="datalim")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02))
    return Path(path)


def labelled(result: Result) -> list[str]:
    """The outputs of a response with their units, as far as these are known."""
    names = result.attributes["outputs"]
    units = result.attributes.get("output_units", [""] * len(names))
    return [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
