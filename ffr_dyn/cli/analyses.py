"""The command of every analysis, made of its declaration (`ffr_dyn.analyses.registry`), and `ffr-dyn check` and `methods`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import Field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

import click

from ffr_dyn.cli.run import (
    INTEGRATION,
    at_moment,
    changed,
    file_option,
    keep_option,
    method_options,
    output_option,
    over_time,
    parameter_option,
    perform,
    resume_option,
    scene_argument,
    span_options,
    time_option,
    with_options,
)
from ffr_prep.common.docstrings import prose
from ffr_prep.common.entries import assignments
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.analyses.efforts import Effort

_FORCES = """\b
Forces are written as
  name=joint.angle, name=joint.stroke    along a joint coordinate
  name=body.interface:x,y,z              at a marker, along a global direction

"""


@click.command()
@scene_argument
@parameter_option
@time_option
def check(scene: Path, parameters: tuple[str, ...], time: float | None) -> None:
    """Mobility of SCENE: degrees of freedom, free motions, redundant rows of joints, drivers that contradict."""
    from ffr_dyn.analyses.static import Static
    from ffr_dyn.consistency.mobility import mobility
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(parameters))
    for line in mobility(loaded, time=at_moment(settings, Static(), time, ()).time).lines():
        click.echo(line)


@click.command("methods")
def list_methods() -> None:
    """The integrators by name, with their orders and what they do to stiff modes."""
    from ffr_dyn.integrators import methods

    for name, method in methods().items():
        steps = "chooses its steps" if method.controlled else "steps of one length"
        forces = "elastic and stiff forces implicit" if method.takes_forces else "elastic forces implicit"
        elastic = forces if method.implicit else "explicit"
        click.echo(f"{name:18} order {method.order}, {steps}, {elastic}")


# ---- from declarations ----------------------------------------------------------------------------------------------


class Later(click.Command):
    """The command of an analysis, which is imported when the command is used: the list of all needs its help alone."""

    def make_context(self, info_name: Any, args: Any, parent: Any = None, **extra: Any) -> click.Context:
        return analysis_command(str(self.name)).make_context(info_name, args, parent=parent, **extra)


def commands() -> dict[str, click.Command]:
    """A command for each analysis that is known now."""
    from ffr_dyn.analyses.registry import analyses

    return {word: Later(word, short_help=text.partition("; see ")[0], help=text) for word, text in analyses().items()}


def analysis_command(word: str) -> click.Command:
    """The command of an analysis: options from what it needs and from its fields."""
    from ffr_dyn.analyses.registry import OverTime, analyses, analysis

    made = analysis(word)
    named = any(f.metadata.get("flag") == "--output" for f in fields(made))
    options = [
        scene_argument,
        file_option if named else output_option,
        parameter_option,
        *([keep_option] if made.keeps else []),
    ]
    if issubclass(made, OverTime):
        options += [*span_options, *(method_options if made.integrates else [])]
    else:
        options.append(time_option)
    options += [resume_option] * made.resumable
    forces = _FORCES if any(_is_force(made, f) for f in fields(made)) else ""
    example = f"\b\nExample:\n  {made.example}\n" if made.example else ""

    @click.command(word, help=f"{analyses()[word]}\n\n{prose(made.__doc__)}", epilog=forces + example)
    @with_options(*options, *_own_options(made))
    def command(scene: Path, **given: Any) -> None:
        _analyse(made, scene, given)

    return command


def _own_options(made: Any) -> Iterator[Any]:
    for f in fields(made):
        if isinstance(f.default, str) and "/" in f.metadata.get("flag", ""):
            for word, said in zip(f.metadata["flag"].split("/"), f.metadata["help"].split(" | "), strict=True):
                yield click.option(word, f.name, flag_value=word.lstrip("-"), default=None, help=said)
        elif "flag" in f.metadata:
            several = "/" not in f.metadata["flag"] and get_type_hints(made)[f.name] not in (int, float, str)
            kind = None if several or "/" in f.metadata["flag"] else get_type_hints(made)[f.name]
            yield click.option(
                f.metadata["flag"], f.name, help=f.metadata["help"], metavar=f.metadata["metavar"], multiple=several,
                type=kind, default=None,
            )  # fmt: skip


def _is_force(made: Any, f: Field[Any]) -> bool:
    return f.metadata.get("metavar") == "FORCE"


def _analyse(made: Any, scene: Path, given: Mapping[str, Any]) -> None:
    """Perform the analysis of a command on a scene file; its own settings of that analysis hold where no option is given."""
    from ffr_dyn.analyses.registry import OverTime, word_of
    from ffr_dyn.scene_file.read import load_scene

    loaded, settings = load_scene(scene, assignments(given["parameters"]))
    own = {f.name: _value(made, f, given[f.name]) for f in fields(made) if given.get(f.name) not in (None, ())}
    analysis = replace(settings.analysis, **own) if isinstance(settings.analysis, made) else made(**own)
    keep = given.get("keep", ())
    if issubclass(made, OverTime):
        found: Any = over_time(settings, analysis, keep, given["end"], given["output_step"])
    else:
        found = at_moment(settings, analysis, given["time"], keep)
    changes = {key: given[key] for key in INTEGRATION if key in given}
    # A result of the file's own analysis, such as a long run, is not replaced by that of another.
    ending = ".nc" if isinstance(settings.analysis, made) else f".{word_of(made)}.nc"
    perform(loaded, changed(found, changes), given["output"] or scene.with_suffix(ending), given.get("resume", False))


def _value(made: Any, f: Field[Any], given: Any) -> Any:
    """The value of a field from what its option gives."""
    if not _is_force(made, f):
        return given
    return tuple(force_of(text) if "=" in text or not f.metadata.get("names") else text for text in given)


def force_of(text: str) -> Effort:
    """A force as the command line writes it. Raises InputError that shows how."""
    from ffr_dyn.analyses.efforts import JointEffort, MarkerEffort

    name, equals, rest = text.partition("=")
    place, colon, along = rest.partition(":")
    if not (name and equals and place):
        raise InputError(f"{text!r} is not a force: write name=joint.angle or name=body.interface:x,y,z")
    if not colon:
        joint, _, coordinate = place.rpartition(".")
        return JointEffort(name, joint, coordinate)
    try:
        direction = tuple(float(number) for number in along.split(","))
    except ValueError:
        raise InputError(f"{text!r}: the direction {along!r} is not three numbers with commas between") from None
    return MarkerEffort(name, place, direction)
