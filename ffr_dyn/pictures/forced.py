"""Amplitudes of forced vibrations over the frequency."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ffr_dyn.pictures.bode import labelled
from ffr_dyn.pictures.histories import PALETTE, drawing
from ffr_dyn.results.result import Result


def draw_forced(result: Result, path: str | Path) -> Path:
    """Draw the amplitudes over the frequency of what `forced` returns, unstable motions dotted: .png, .svg or .pdf.

    Raises InputError for another kind of file.

    >>> fd.draw_forced(found, "forced.png")  # of what fd.forced returned
    """
    f, stable = result["frequency"], result["stable"] > 0
    beside = ~stable  # with the neighbours, so that no gap is left
    beside[1:] |= ~stable[:-1]
    beside[:-1] |= ~stable[1:]
    with drawing(path, (10.0, 6.0)) as figure:
        axes = figure.subplots()
        for k, name in enumerate(labelled(result)):
            amplitude, color = result["amplitude"][:, k], PALETTE[k % len(PALETTE)]
            axes.plot(f, np.where(stable, amplitude, np.nan), color=color, label=name)
            axes.plot(f, np.where(beside, amplitude, np.nan), ":", color=color)
        for jump in result.attributes["jumps"]:
            axes.axvline(jump, color="0.7", linewidth=0.8, zorder=0)
        axes.set_ylim(bottom=0)
        a = result.attributes
        axes.set_ylabel(f"amplitude under {a['input']} of {a['input_amplitude']:g} {a.get('input_unit', '')}".rstrip())
        axes.set_xlabel("frequency [Hz]")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02))
    return Path(path)
