"""The options of ffr-prep that choose a reduction and ask for its quality, shared by its sub-commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ffr_prep.cli.options import PATH, bundle
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_prep.body import FlexibleBody
    from ffr_prep.reduction.component_modes import Reduction
    from ffr_prep.reduction.selection import Band, Selection

METHODS = (
    "craig-bampton",
    "guyan",
    "eigenmodes",
    "rubin",
    "characteristic",
    "attachment",
    "inertia-relief",
    "krylov",
)
NOTES = """\b
Reductions: --method may be repeated, and the space of all of them is taken.
  craig-bampton                  static shapes of every interface coordinate and N modes with all interfaces fixed:
                                 for bodies that joints load, the safe choice
  eigenmodes                     N modes under the reference conditions: for bodies without interface loads
  rubin                          N modes of the free body and the static response to interface loads: few modes suffice
                                 where joints leave the interfaces nearly free
  guyan                          static shapes of the interfaces alone: slow motion of light bodies
  characteristic                 craig-bampton with only the --interface-modes lowest shapes of the interfaces: for many
                                 interfaces
  attachment                     static response to forces and moments at the interfaces
  inertia-relief                 static response to acceleration and spin: exact sag, exact growth, exact stress under them
  krylov                         response to interface loads, matched to --moments derivatives at the frequencies --match
  FILE.npy                       displacement fields of your own, an array (nodes, 3, fields)
Modes: a number (--modes), all up to a frequency (--frequency), or as many as make the receptances at the interfaces
accurate (--accuracy 10,2000,0.05: from 10 to 2000 Hz to 5 per cent).
"""

reduction_options = bundle(
    click.option(
        "--method",
        "methods",
        multiple=True,
        default=("craig-bampton",),
        show_default=True,
        metavar="METHOD",
        help="See below; may be repeated.",
    ),
    click.option("--modes", type=click.IntRange(min=0), help="Normal modes to keep; default: 10."),
    click.option("--frequency", type=float, help="Keep all normal modes up to this frequency [Hz]."),
    click.option("--accuracy", metavar="LOW,HIGH,ERROR", help="Keep as many as the receptances in a band [Hz] need."),
    click.option(
        "--interface-modes", type=click.IntRange(min=0), default=6, show_default=True, help="Of characteristic."
    ),
    click.option("--moments", type=click.IntRange(min=1), default=2, show_default=True, help="Of krylov."),
    click.option("--match", default="0", show_default=True, metavar="F1,F2,...", help="Frequencies [Hz] of krylov."),
    click.option("--quality", type=PATH, help="Compare with the full model; folder for the pictures of it."),
    click.option(
        "--band", metavar="LOW,HIGH", help="Frequencies [Hz] of that comparison; default: those of --accuracy."
    ),
)


def reduction_of(options: Mapping[str, Any]) -> Reduction:
    """The reduction that the options describe; InputError for options that do not fit each other."""
    from ffr_prep.reduction.component_modes import Union

    parts = tuple(_part(method, options) for method in dict.fromkeys(options["methods"]))
    return parts[0] if len(parts) == 1 else Union(parts)


def band_of(options: Mapping[str, Any]) -> Band | None:
    """The band of the quality report; None where none is asked for."""
    from ffr_prep.reduction.selection import Band

    if options["quality"] is None:
        if options["band"] is not None:
            raise InputError(f"--band {options['band']} is for the quality report: add --quality FOLDER")
        return None
    text = options["band"] or (options["accuracy"] or "").rpartition(",")[0]
    if not text:
        raise InputError(
            "--quality needs the frequencies to compare: add --band LOW,HIGH in Hz, such as --band 10,2000"
        )
    return Band(*_numbers("--band", text, 2))


def draw_quality(body: FlexibleBody, folder: Path | None) -> None:
    """Write the pictures of the quality report, if one was asked for."""
    if folder is not None:
        from ffr_prep.report.quality_pictures import quality_pictures

        for path in quality_pictures(body, folder):
            click.echo(f"picture     {path}")


def _part(method: str, options: Mapping[str, Any]) -> Reduction:
    from ffr_prep.reduction.component_modes import CharacteristicModes, CraigBampton, Eigenmodes, Guyan, Rubin
    from ffr_prep.reduction.krylov import Krylov
    from ffr_prep.reduction.static_shapes import AttachmentModes, InertiaRelief

    if method.endswith(".npy"):
        return _user_vectors(Path(method))
    made: dict[str, Callable[[], Reduction]] = {
        "craig-bampton": lambda: CraigBampton(_modes(options)),
        "guyan": Guyan,
        "eigenmodes": lambda: Eigenmodes(_modes(options)),
        "rubin": lambda: Rubin(_modes(options)),
        "characteristic": lambda: CharacteristicModes(_modes(options), options["interface_modes"]),
        "attachment": AttachmentModes,
        "inertia-relief": InertiaRelief,
        "krylov": lambda: Krylov(options["moments"], tuple(_numbers("--match", options["match"]))),
    }
    if method not in made:
        raise InputError(f"--method {method} is not known: write one of {', '.join(METHODS)}, or FILE.npy")
    return made[method]()


def _modes(options: Mapping[str, Any]) -> Selection:
    from ffr_prep.reduction.selection import Accuracy, Band, UpTo

    given = [name for name in ("modes", "frequency", "accuracy") if options[name] is not None]
    if len(given) > 1:
        raise InputError(f"--{given[0]} and --{given[1]} both say how many modes to keep: give one of them")
    if given == ["frequency"]:
        return UpTo(options["frequency"])
    if given == ["accuracy"]:
        low, high, tolerance = _numbers("--accuracy", options["accuracy"], 3)
        return Accuracy(Band(low, high), tolerance)
    return int(options["modes"]) if given else 10


def _user_vectors(path: Path) -> Reduction:
    import numpy as np

    from ffr_prep.reduction.static_shapes import UserVectors

    try:
        return UserVectors(np.load(path, allow_pickle=False))
    except FileNotFoundError:
        raise InputError(f"--method {path}: the file does not exist") from None
    except (ValueError, EOFError) as error:
        raise InputError(f"--method {path} is not an array of numpy ({error})") from None


def _numbers(what: str, text: str, count: int | None = None) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError(f"{what} {text}: write numbers with commas between them, such as 10,2000") from None
    if count is not None and len(values) != count:
        raise InputError(f"{what} {text}: {count} numbers with commas between them are needed, not {len(values)}")
    return values
