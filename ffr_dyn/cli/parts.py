"""The command `ffr-dyn parts`."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ffr_dyn.cli.run import analysed, at_moment, parameter_option, scene_argument
from ffr_prep.common.entries import assignments
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.results.result import Result
    from ffr_dyn.scene.scene import Scene

STATES = ("*.q",)
_NOTES = """\b
Example:
  ffr-prep reduce blade.geo --material steel --interface root --interface tip -o blade.ffr
  ffr-dyn parts rotor.toml --angle 5deg --reduce
  ffr-dyn run rotor.toml
"""


@click.command(epilog=_NOTES)
@scene_argument
@parameter_option
@click.option(
    "--angle", default="0.2", show_default=True, help="That a part may turn within itself: 0.1 [rad], or 5deg."
)
@click.option(
    "--static", "at_rest", is_flag=True, help="Look at the static equilibrium, not at the analysis of the file."
)
@click.option(
    "--reduce",
    "reduced",
    is_flag=True,
    help="Reduce the bodies again, in place of their files, until the parts suffice.",
)
def parts(scene: Path, parameters: tuple[str, ...], angle: str, at_rest: bool, reduced: bool) -> None:
    """How many parts the flexible bodies of SCENE need, and the commands of ffr-prep that make them.

    No part may turn within itself by more than the angle, nor deflect by more than a tenth of its size: 0.2 rad means an
    error of 0.1 % of the deflection. Bodies that `ffr-prep reduce` or `reduce-structure` wrote keep their command; its
    files are looked for from the folder that one is in.
    """
    from ffr_dyn.analyses.static import Static
    from ffr_dyn.consistency.validity import check_angle, in_enough_parts, parts_needed
    from ffr_dyn.scene.parts import owner
    from ffr_dyn.scene_file.parameters import as_number
    from ffr_dyn.scene_file.read import body_files, load_scene

    given, allowed = assignments(parameters), as_number(angle, {}, "--angle", "rad")
    check_angle(allowed)
    files = body_files(scene, given)
    found, settings = load_scene(scene, given)
    if not any(body.model.n for body in found.bodies):
        raise InputError(f"{scene}: no body is flexible, so none needs parts; give bodies with a file that has modes")
    chosen = at_moment(settings, Static(), None, STATES) if at_rest else replace(settings, outputs=STATES)

    def make(counts: Mapping[str, int]) -> Scene:
        for file, words in _commands(files, counts).items():
            _perform(file, words)
        return load_scene(scene, given)[0]

    def analyse(loaded: Scene) -> Result:
        return analysed(loaded, chosen)

    if reduced:
        enough, _ = in_enough_parts(make, analyse, allowed)
        counts = Counter(owner(body) for body in enough.bodies if body.model.n)
    else:
        counts = Counter(parts_needed(found, analyse(found), allowed))
    for name, count in counts.items():
        click.echo(f"body         {name}: {f'{count} parts do' if count > 1 else 'one piece does'}")
    for file, words in {} if reduced else _commands(files, counts).items():
        click.echo(f"command      {_told(file, words)}")


def _commands(files: Mapping[str, Path], counts: Mapping[str, int]) -> dict[Path, list[str]]:
    """The words that make each file again with more than one part; none where it does not know the command."""
    from ffr_prep.body import load_body

    most: dict[Path, int] = {}
    for name, count in counts.items():
        if name in files and count > 1:
            most[files[name]] = max(count, most.get(files[name], 1))
    known = {file: load_body(file).provenance.get("command") for file in most}
    return {
        file: [*words, "--parts", str(most[file]), "-o", str(file)] if words else [] for file, words in known.items()
    }


def _told(file: Path, words: Sequence[str]) -> str:
    if not words:
        return f"{file} does not know the one that made it: make it again with as many parts"
    return f"ffr-prep {shlex.join(words)}"


def _perform(file: Path, words: Sequence[str]) -> None:
    told = _told(file, words)
    if not words:
        raise InputError(told)
    click.echo(f"command      {told}")
    if subprocess.run([sys.executable, "-m", "ffr_prep.cli", *words], check=False).returncode:
        raise InputError(f"{told} failed: run it in the folder from which its files are named")
