"""The options of ffr-prep that choose a reduction and ask for its quality, shared by its sub-commands."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli.options import bundle
from ffr_prep.cli.settings import numbers, written
from ffr_prep.common.command import OUTPUT_FILE
from ffr_prep.common.errors import InputError
from ffr_prep.reduction.registry import MODES, REDUCTIONS, SELECTING, check_taken, method_of, takes
from ffr_prep.reduction.registry import reduction_of as reduction_made

if TYPE_CHECKING:
    from ffr_prep.body import Damping, FlexibleBody
    from ffr_prep.reduction.basis import Reduction
    from ffr_prep.reduction.selection import Band

NOTES = """\b
Reductions: --method may be repeated, and the space of all of them is taken.
{reduction}
Modes: a number (--modes), all up to a frequency (--frequency), or as many as make the receptances at the interfaces
accurate (--accuracy 10,2000,0.05: from 10 to 2000 Hz to 5 per cent).
"""

reduction_options = bundle(
    click.option(
        "--method",
        "methods",
        multiple=True,
        default=(next(iter(REDUCTIONS)).name,),
        show_default=True,
        metavar="METHOD",
        help="See below; may be repeated.",
    ),
    click.option("--modes", type=click.IntRange(min=0), help=f"Normal modes to keep; default: {MODES}."),
    click.option("--frequency", type=float, help="Keep all normal modes up to this frequency [Hz]."),
    click.option(
        "--accuracy",
        callback=numbers(3),
        metavar="LOW,HIGH,ERROR",
        help="Keep as many as the receptances in a band [Hz] need.",
    ),
    click.option("--quality", type=OUTPUT_FILE, help="Compare with the full model; folder for the pictures of it."),
    click.option(
        "--band",
        callback=numbers(2),
        metavar="LOW,HIGH",
        help="Frequencies [Hz] of that comparison; default: those of --accuracy.",
    ),
)


damping_options = bundle(
    click.option(
        "--rayleigh",
        callback=numbers(2),
        metavar="ALPHA,BETA",
        help="Damping alpha M + beta K, in 1/s and s: 2.0,1e-6.",
    ),
    click.option(
        "--loss-factor", type=float, default=0.0, help="Of the material: damping that loses as much at each mode."
    ),
    click.option(
        "--damping",
        callback=numbers(),
        metavar="Z1,Z2,...",
        help="Damping ratios of the modes, the last of all others: 0.01.",
    ),
    click.option(
        "--damping-band",
        "damping_bands",
        multiple=True,
        callback=lambda _, __, texts: [_band_of_damping(text) for text in texts],
        metavar="HZ:RATIO",
        help="Damping ratio of the modes up to a frequency, the last beyond, too: 100:0.005; repeat, ascending.",
    ),
)


def _band_of_damping(text: str) -> tuple[float, float]:
    try:
        frequency, ratio = map(float, text.split(":"))
    except ValueError:
        raise InputError(f"--damping-band {text}: write a frequency in Hz and a ratio, such as 100:0.005") from None
    return frequency, ratio


def damping_of(options: Mapping[str, Any]) -> Damping:
    """The damping that the options describe; InputError for what is none."""
    from ffr_prep.body import Damping

    alpha, beta = options["rayleigh"] or (0.0, 0.0)
    return Damping(alpha, beta, options["loss_factor"], options["damping_bands"], options["damping"] or ())


def reduction_of(options: Mapping[str, Any]) -> Reduction:
    """The reduction that the options describe; InputError for options that do not fit each other."""
    methods = list(dict.fromkeys(options["methods"]))
    check_taken([*(name for name in SELECTING if options[name] is not None), *written(REDUCTIONS)], methods)
    return reduction_made(
        [
            {"method": method} | {name: value for name, value in options.items() if takes(method_of(method), name)}
            for method in methods
        ]
    )


def band_of(options: Mapping[str, Any]) -> Band | None:
    """The band of the quality report; None where none is asked for."""
    from ffr_prep.reduction.selection import Band

    if options["quality"] is None:
        if options["band"] is not None:
            raise InputError("--band is for the quality report: add --quality FOLDER")
        return None
    ends = options["band"] or (options["accuracy"] or ())[:2]
    if not ends:
        raise InputError(
            "--quality needs the frequencies to compare: add --band LOW,HIGH in Hz, such as --band 10,2000"
        )
    return Band(*ends)


def draw_quality(body: FlexibleBody, folder: Path | None) -> None:
    """Write the pictures of the quality report, if one was asked for."""
    if folder is not None:
        from ffr_prep.report.quality_pictures import quality_pictures

        for path in quality_pictures(body, folder):
            click.echo(f"picture     {path}")
