"""The command `ffr-dyn stability`."""

from __future__ import annotations

from pathlib import Path

import click

from ffr_prep.common.errors import ComputationError, InputError

EXAMPLE = """\b
Example:
  ffr-dyn stability -o out/stability
  ffr-dyn stability drift baumgarte --quick -o out/stability
"""


@click.command(epilog=EXAMPLE)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for the pictures.")
@click.option("--quick", is_flag=True, help="Long runs cut short (1e6 steps and 1e5 turns to a fiftieth and less).")
def stability(names: tuple[str, ...], output: Path, quick: bool) -> None:
    """A gallery of instability: methods that fail where theory says so, and the remedies that hold.

    Each exhibit NAME (default: all) is computed now; its picture goes to OUTPUT/NAME.png, and predictions, measurements,
    failures and remedies are printed. Exit code 1 when one does not show what it claims.

    explicit-limit, index3-conditioning, drift, baumgarte, euler-angles, singular-four-bar, redundant-bricard, spin-up,
    reference-conditions, large-deformation, numerical-damping, long-time-energy, joint-damper, joint-friction, stiff-bushing,
    start-shock, fast-driver, coarse-rows, shared-step, aligned-cranks, stiffening-by-load, bent-in-parts
    """
    from ffr_gallery.exhibit import draw, lines
    from ffr_gallery.exhibits import EXHIBITS, SHORT

    unknown = [name for name in names if name not in EXHIBITS]
    if unknown:
        raise InputError(f"there is no exhibit {unknown[0]!r}; there are {', '.join(EXHIBITS)}")
    output.mkdir(parents=True, exist_ok=True)
    wrong = []
    for name in names or EXHIBITS:
        click.echo(f"{name} ...", err=True)
        exhibit = ({**EXHIBITS, **SHORT} if quick else EXHIBITS)[name]()
        draw(exhibit, output / f"{name}.png")
        for line in lines(exhibit):
            click.echo(line)
        wrong += [] if exhibit.holds else [name]
    if wrong:
        raise ComputationError(f"these exhibits do not show what they claim: {', '.join(wrong)}")
