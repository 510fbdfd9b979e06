"""The formats in which other programs take and give flexible bodies, one entry each; writing and reading by suffix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.common.registry import Registry, Setting, Target, arguments, loaded

if TYPE_CHECKING:
    from ffr_prep.body import FlexibleBody


@dataclass(frozen=True)
class ExchangeFormat:
    """A format of another program.

    help     : suffixes and whose format it is
    suffixes : with the dot, as one writes them
    write    : function, or "package.module:function", of body, path, `surface` (whether to add its points as nodes) and the
               settings; None where the format can only be read
    read     : of a path, returns the body; None where the format can only be written
    left_out : of body and settings, returns in words what the file will not hold; None where there is nothing to say
    settings : of writing

    >>> entry = fp.ExchangeFormat("own", "Own text.", (".own",), write="own:write", read="own:read")
    """

    name: str
    help: str
    suffixes: tuple[str, ...]
    write: Target | None
    read: Target | None
    left_out: Target | None = None
    settings: tuple[Setting, ...] = ()


_ROOM = "ffr_prep.interchange"
EXCHANGE_FORMATS: Registry[ExchangeFormat] = Registry(
    "exchange format",
    (
        ExchangeFormat(
            "SID",
            ".SID_FEM: standard input data of flexible bodies",
            (".SID_FEM", ".sid"),
            f"{_ROOM}.sid:write_sid",
            f"{_ROOM}.sid:read_sid",
            f"{_ROOM}.sid:left_out",
            settings=(
                Setting(
                    "layout",
                    ("mode-major", "axis-major"),
                    "mode-major",
                    "Of the matrices Gr and Ge in a SID file; programs differ.",
                ),
            ),
        ),
        ExchangeFormat(
            "MBDyn",
            ".fem: data of MBDyn's modal joint",
            (".fem",),
            f"{_ROOM}.mbdyn:write_fem",
            f"{_ROOM}.mbdyn:read_fem",
            f"{_ROOM}.mbdyn:left_out",
            settings=(
                Setting(
                    "kind",
                    ("legacy", "full"),
                    "full",
                    "Of a .fem file: the inertia integrals, which a recent MBDyn reads, or lumped masses for older ones.",
                ),
            ),
        ),
    ),
)


def register_exchange_format(entry: ExchangeFormat) -> None:
    """Offer a format to `ffr-prep export` and `import`. Raises InputError for a name that is taken.

    >>> fp.register_exchange_format(fp.ExchangeFormat("own", "Own text.", (".own",), "own:write", None))
    """
    EXCHANGE_FORMATS.register(entry)


def check_settings(path: Path, names: Iterable[str]) -> None:
    """Raises InputError for a setting of another format than that of the suffix."""
    entry = _format_of(path)
    for name in names:
        owners = [one.name for one in EXCHANGE_FORMATS if name in {setting.name for setting in one.settings}]
        if entry.name not in owners:
            raise InputError(
                f"{path}: --{name} is for {' and '.join(owners)}, and this is a file of {entry.name}: leave it out"
            )


def export_body(body: FlexibleBody, path: Path, surface: bool, settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Write a body in the format of the suffix; what was left out, in words.

    Raises InputError for an unknown suffix, and what the format refuses.
    """
    entry = _format_of(path)
    if entry.write is None:
        raise InputError(f"{path}: {entry.name} can be read only; {_suffixes('write')} can be written")
    given = arguments(entry, settings)
    loaded(entry.write)(body, path, surface=surface, **given)
    own = () if entry.left_out is None else loaded(entry.left_out)(body, **given)
    return (*_without_place(body), *own)


def _without_place(body: FlexibleBody) -> Iterator[str]:
    """What no format holds, in words."""
    if body.parts:
        yield "the format has no parts: the body is written in one piece, for small deflections"
    if body.surface is not None and (body.surface.stress is not None or body.surface.beams is not None):
        yield "the format has no stress: that of the body, and section forces of beams, were left out"


def import_body(path: Path, *, units: str = "m-kg-s") -> FlexibleBody:
    """The body of a file, in the format of its suffix and in SI units.

    units : of the numbers in the file, a name in `ffr_prep.matrices.unit_systems.UNIT_SYSTEMS`

    Raises InputError for unknown ones, and what the format refuses.
    """
    from ffr_prep.interchange.body_units import in_si_units, large_in_words
    from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS

    if units not in UNIT_SYSTEMS:
        raise InputError(f"units {units!r} are not known; they are {', '.join(UNIT_SYSTEMS)}")
    entry = _format_of(path)
    if entry.read is None:
        raise InputError(f"{path}: {entry.name} can be written only; {_suffixes('read')} can be read")
    with reading(path, f"a file of {entry.name}"):
        body: FlexibleBody = loaded(entry.read)(path)
    return large_in_words(in_si_units(body, UNIT_SYSTEMS[units]), units)


def _suffixes(way: str) -> str:
    return ", ".join(of for entry in EXCHANGE_FORMATS if getattr(entry, way) is not None for of in entry.suffixes)


def _format_of(path: Path) -> ExchangeFormat:
    suffix = path.suffix.lower()
    found = [entry for entry in EXCHANGE_FORMATS if suffix in map(str.lower, entry.suffixes)]
    if not found:
        known = ", ".join(entry.suffixes[0] for entry in EXCHANGE_FORMATS)
        raise InputError(f"{path}: the format {path.suffix!r} is not known; write one of {known}")
    return found[-1]
