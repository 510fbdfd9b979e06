"""The declaration of an analysis, and the list of all: command line, scene files, schema and help are made from both.

An analysis is a frozen dataclass in the file of its function (`Static` in `ffr_dyn.analyses.static`). Its fields are what the
table [analysis] of a scene file may hold besides times and method; a field with an `option` is an option of the command, too.
`perform` does the analysis. One line in `LISTED` makes it known; code of one's own calls `register_analysis`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.results.result import Result
    from ffr_dyn.scene.scene import Scene

# The word in scene files and commands, the name of the module, and the class (with a capital letter) -> help in a sentence.
LISTED = {
    "forward": "Forward dynamics of SCENE, whatever analysis its file asks for; see `ffr-dyn run --help`.",
    "kinematic": "Positions, velocities and accelerations of SCENE, whose drivers prescribe all motion; bodies undeformed.",
    "assemble": "Positions and velocities of SCENE that meet joints and drivers, and what was changed of each body for it.",
    "static": "Static equilibrium of SCENE, with reactions and stability.",
    "inverse": "Forces that drive SCENE along its prescribed motion, and all reactions.",
    "mixed": "Motion and unknown forces of SCENE, some motions of which are known.",
    "linearise": "Eigenvalues and state-space matrices of SCENE about its start, its equilibrium or its steady motion.",
    "steady": "Steady motion of SCENE: bodies that rotate at a constant speed, deformed by it; at one speed or several.",
    "campbell": "Campbell diagram of SCENE: frequencies and damping over the speed, critical speeds, limits of stability.",
    "response": "Frequency response of SCENE: gain, phase and modes from an input to outputs; noise; Bode and Nyquist.",
    "forced": "Harmonic response of SCENE with all that is nonlinear: amplitudes over the frequency, jumps, stability.",
    "periodic": "Periodic motion of SCENE under drivers that turn evenly, and Floquet's multipliers: is it stable?",
}
_FOLDERS = dict.fromkeys(
    ("steady", "campbell", "response", "forced", "periodic"), "rotating"
)  # of the modules that do not lie beside this one
_REGISTERED: dict[str, type[Analysis]] = {}
EVENTS_SHOWN = 20


def option(flag: str, help: str, *, metavar: str | None = None, required: bool = False, **more: Any) -> dict[str, Any]:
    """Metadata of a field that is an option of the command: "--name", or "--yes/--no" for one of two values, or
    "--one/--two/--three" for one of several texts, whose help is "of the first | of the second | of the third".

    required : that a scene file gives it;  names : key of the file for entries that are names of things of the scene

    >>> metadata = fd.option("--speed", "Speed [rad/s].", metavar="W")  # of a field of an analysis
    """
    return {"flag": flag, "help": help, "metavar": metavar, "required": required, **more}


class Analysis:
    """A declaration of an analysis. Settings that it does not use, of those that all of its kind have, it ignores.

    resumable : whether a run can go on where a result file ends
    keeps     : whether the quantities to keep can be chosen
    example   : of the command
    """

    resumable: ClassVar[bool] = False
    keeps: ClassVar[bool] = True
    example: ClassVar[str] = ""

    def perform(self, scene: Scene, settings: Any, **how: Any) -> Result:
        """The analysis of a scene; `how` has `path`, and `progress` and `resume` where they make sense."""
        raise NotImplementedError

    def report(self, result: Result) -> list[str]:
        """The report of the result by a command, a line each."""
        return summary(result.attributes)


@dataclass(frozen=True)
class OverTime(Analysis):
    """An analysis from a start to an end (with `Settings`).

    integrates : whether it takes a method;  stabilised : and a stabilisation of the constraints

    >>> issubclass(fd.Forward, fd.OverTime)
    """

    integrates: ClassVar[bool] = False
    stabilised: ClassVar[bool] = False


@dataclass(frozen=True)
class OfMoment(Analysis):
    """An analysis at one time (with `MomentSettings`).

    counts : whether it tells how much of how much is done, by a `progress` of two numbers

    >>> issubclass(fd.Static, fd.OfMoment)
    """

    counts: ClassVar[bool] = False


Kind = TypeVar("Kind", bound=type[Analysis])


def register_analysis(kind: Kind) -> Kind:
    """Make an analysis known by the name of its class in lower case; a decorator for code of one's own.

    Raises InputError for a word that is taken, and for a class that is no analysis.

    >>> fd.register_analysis(Survey)  # a frozen dataclass derived from fd.OfMoment
    """
    if not issubclass(kind, (OverTime, OfMoment)):
        raise InputError(f"{kind.__name__} is no analysis: derive it from OverTime or OfMoment")
    word = word_of(kind)
    if word in LISTED or (word in _REGISTERED and _REGISTERED[word].__qualname__ != kind.__qualname__):
        raise InputError(f"there is an analysis {word!r} already; give the class {kind.__name__} another name")
    _REGISTERED[word] = kind
    return kind


def word_of(kind: type[Analysis]) -> str:
    """The word by which scene files and commands know an analysis."""
    return kind.__name__.lower()


def analyses() -> dict[str, str]:
    """The words of all analyses, and what each does in a sentence."""
    own = {word: (kind.__doc__ or word).strip().partition("\n")[0] for word, kind in _REGISTERED.items()}
    return {**LISTED, **own}


def analysis(word: str) -> type[Any]:
    """The class of an analysis. Raises InputError for a word that is none, with the nearest."""
    if word in _REGISTERED:
        return _REGISTERED[word]
    if word not in LISTED:
        close = get_close_matches(word, analyses(), 1)
        hint = f"did you mean {close[0]!r}?" if close else f"there are {', '.join(analyses())}"
        raise InputError(f"there is no analysis {word!r}; {hint}")
    module = ".".join(["ffr_dyn.analyses", *([_FOLDERS[word]] if word in _FOLDERS else []), word])
    kind: type[Any] = getattr(import_module(module), word.capitalize())
    return kind


def summary(attributes: Mapping[str, Any]) -> list[str]:
    """The report of an analysis by its attributes, a line each."""
    a = attributes
    lines = [
        f"scene        {a['title']}: {a['analysis']}, {a['degrees_of_freedom']} degrees of freedom",
        f"method       {a['method']}, {a.get('evaluations', 0)} evaluations of the equations of motion",
    ]
    if "computed" in a:
        lines.append(f"computed     {a['computed']}")
    if "largest_drift" in a:
        position, velocity = a["largest_drift"]
        lines.append(
            f"constraints  open by at most {position:.1e} (rate {velocity:.1e}); {a['projections']} projections"
        )
    if "accuracy" in a:
        lines.append(f"accuracy     {a['accuracy']}")
    if "stable" in a:
        lines.append(f"equilibrium  {'stable' if a['stable'] else 'unstable'}")
    passed = [f"event        {moment_in_words(event)}" for event in a.get("events", [])]
    more = [f"event        ... and {len(passed) - EVENTS_SHOWN} more"] if len(passed) > EVENTS_SHOWN else []
    return lines + passed[:EVENTS_SHOWN] + more + [f"note         {note}" for note in a["notes"]]


def moment_in_words(event: Mapping[str, Any]) -> str:
    """An event of a result: its name, time and error."""
    said = f"{event['event']} at t = {event['time']:.9g} s"
    if "error" not in event:
        return said
    return f"{said}, in doubt" if event["error"] is None else f"{said}, within {event['error']:.2g} s"
