"""The reductions that the command line and structure files offer; one entry each.

Nothing else lists them: options, keys, help and messages are made from these entries.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import Registry, Setting, Target, arguments, loaded

if TYPE_CHECKING:
    from ffr_prep.reduction.basis import Reduction

MODES = 10  # of what keeps normal modes, when nothing is said
SELECTING = ("modes", "frequency", "accuracy")
OF_FILES = "FILE"


@dataclass(frozen=True)
class ReductionMethod:
    """A reduction by its name.

    name     : the word of --method and of `method` in a structure file; "FILE.xyz" stands for all files of a suffix
    target   : class, or "package.module:Class", of a `Reduction`, called with its settings (of a file, with its path)
    help     : what it keeps, and what it is for
    selects  : whether its argument `modes` says how many normal modes it keeps: --modes, --frequency or --accuracy
    settings : what else it can be given

    >>> fp.register_reduction(fp.ReductionMethod("own", "own:Own", "Shapes of one's own."))
    """

    name: str
    target: Target
    help: str
    selects: bool = False
    settings: tuple[Setting, ...] = ()


_FOLDER = "ffr_prep.reduction.methods"
REDUCTIONS: Registry[ReductionMethod] = Registry(
    "reduction",
    (
        ReductionMethod(
            "craig-bampton",
            f"{_FOLDER}.craig_bampton:CraigBampton",
            "static shapes of every interface coordinate and N modes with all interfaces fixed: for bodies that joints load, "
            "the safe choice",
            selects=True,
        ),
        ReductionMethod(
            "eigenmodes",
            f"{_FOLDER}.eigenmodes:Eigenmodes",
            "N modes under the reference conditions: for bodies without interface loads",
            selects=True,
        ),
        ReductionMethod(
            "rubin",
            f"{_FOLDER}.rubin:Rubin",
            "N modes of the free body and the static response to interface loads: few modes suffice where joints leave the "
            "interfaces nearly free",
            selects=True,
        ),
        ReductionMethod(
            "guyan",
            f"{_FOLDER}.guyan:Guyan",
            "static shapes of the interfaces alone: slow motion of light bodies",
        ),
        ReductionMethod(
            "characteristic",
            f"{_FOLDER}.characteristic:CharacteristicModes",
            "craig-bampton with only the --interface-modes lowest shapes of the interfaces: for many interfaces",
            selects=True,
            settings=(Setting("interface_modes", int, 6, "Of characteristic.", least=0),),
        ),
        ReductionMethod(
            "attachment",
            f"{_FOLDER}.attachment:AttachmentModes",
            "static response to forces and moments at the interfaces",
        ),
        ReductionMethod(
            "inertia-relief",
            f"{_FOLDER}.inertia_relief:InertiaRelief",
            "static response to acceleration and spin: exact sag, exact growth, exact stress under them",
        ),
        ReductionMethod(
            "krylov",
            f"{_FOLDER}.krylov:Krylov",
            "response to interface loads, matched to --moments derivatives at the frequencies --match",
            settings=(
                Setting("moments", int, 2, "Of krylov.", least=1),
                Setting("match", "numbers", (0.0,), "Frequencies [Hz] of krylov.", argument="frequencies"),
            ),
        ),
        ReductionMethod(
            f"{OF_FILES}.npy",
            f"{_FOLDER}.user_vectors:read_user_vectors",
            "displacement fields of your own, an array (nodes, 3, fields)",
        ),
    ),
)


def register_reduction(entry: ReductionMethod) -> None:
    """Offer a reduction to command line and structure files. Raises InputError for a name that is taken.

    >>> fp.register_reduction(fp.ReductionMethod("own", "own:Own", "Shapes of one's own."))
    """
    REDUCTIONS.register(entry)


def method_of(word: str) -> ReductionMethod:
    """The entry that a word or the name of a file stands for; InputError lists what there is."""
    known = REDUCTIONS.entries
    found = known.get(word) or known.get(OF_FILES + Path(word).suffix)
    if found is None or word.startswith(f"{OF_FILES}."):
        raise InputError(f"the method {word} is not known: write one of {', '.join(known)}")
    return found


def reduction_of(requests: Sequence[Mapping[str, Any]], folder: Path = Path()) -> Reduction:
    """One reduction, or the union of several, from the values of settings by name and the `method` of each.

    folder : what names of files are relative to

    Raises InputError for an unknown method, and for settings that cannot be used or say the same twice.
    """
    from ffr_prep.reduction.methods.union import Union

    for request in requests:
        check_taken([name for name, value in request.items() if value is not None], [request["method"]])
    parts = tuple(_made(method_of(request["method"]), request, folder) for request in requests)
    return parts[0] if len(parts) == 1 else Union(parts)


def check_taken(names: Iterable[str], methods: Sequence[str]) -> None:
    """Raises InputError for a value by the name of a setting, or of how many normal modes to keep, that no method takes."""
    for name in names:
        owners = [entry.name for entry in REDUCTIONS if takes(entry, name)]
        if not owners or any(takes(method_of(method), name) for method in methods):
            continue
        if name in SELECTING:
            raise InputError(
                f"{name} says which normal modes to keep, and {' and '.join(methods)} keeps none: leave it out, or add the "
                "method craig-bampton"
            )
        raise InputError(
            f"{name} is a setting of {' and '.join(owners)}, and not of {' and '.join(methods)}: leave it out, or take the "
            f"method {owners[0]}"
        )


def takes(entry: ReductionMethod, name: str) -> bool:
    """Whether a method has a use for a value of this name."""
    return entry.selects if name in SELECTING else any(setting.name == name for setting in entry.settings)


def _made(entry: ReductionMethod, given: Mapping[str, Any], folder: Path) -> Reduction:
    from ffr_prep.reduction.selection import selection_of

    made: Reduction
    if entry.name.startswith(f"{OF_FILES}."):
        made = loaded(entry.target)(folder / given["method"])
    else:
        modes = {"modes": selection_of(given, MODES)} if entry.selects else {}
        made = loaded(entry.target)(**modes, **arguments(entry, given))
    return made
