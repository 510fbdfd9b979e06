"""Lists of what is one of several: reductions, file formats. One entry makes command line, schema, help and messages.

An entry names a function or class as "package.module:name", which is imported when it is first used, so that a start
stays light. Python code of one's own, given as --plugin FILE.py, adds entries in the same way.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any, Generic, Literal, Protocol, TypeVar

from ffr_prep.common.errors import InputError

_SHOWN = 20

Target = str | Callable[..., Any]


class Entry(Protocol):
    """Whatever has a name by which it is asked for and a help text; it may have `settings`, a tuple of `Setting`."""

    @property
    def name(self) -> str: ...

    @property
    def help(self) -> str: ...


E = TypeVar("E", bound=Entry)


@dataclass(frozen=True)
class Setting:
    """A setting of an entry: the option --NAME of the command line, the key NAME of a file.

    name     : with underscores
    kind     : int, float, bool, "numbers" (several, with commas between them on the command line), or a tuple of words
    help     : in one line
    least    : of an int
    argument : what the function or class of the entry calls it, where that is another name

    >>> setting = fp.Setting("moments", int, 2, "How many moments are matched.", least=1)
    """

    name: str
    kind: type | tuple[str, ...] | Literal["numbers"]
    default: Any
    help: str
    least: int | None = None
    argument: str | None = None

    @property
    def type(self) -> Any:
        """The type of its values."""
        if self.kind == "numbers":
            return tuple[float, ...]
        return Literal[self.kind] if isinstance(self.kind, tuple) else self.kind


class Registry(Generic[E]):
    """Entries of one kind by their names, in order; `register` adds another."""

    def __init__(self, what: str, entries: tuple[E, ...]) -> None:
        """`what` they are, for messages."""
        self.what = what
        self.entries: dict[str, E] = {entry.name: entry for entry in entries}

    def __iter__(self) -> Iterator[E]:
        return iter(self.entries.values())

    def register(self, entry: E) -> None:
        """Add an entry. Raises InputError for a name that is taken, and for another meaning of a known setting."""
        if entry.name in self.entries:
            raise InputError(f"the {self.what} {entry.name!r} is there already: give it another name")
        known = {setting.name: setting for setting in self.settings()}
        for setting in settings_of(entry):
            if known.get(setting.name, setting) != setting:
                raise InputError(
                    f"{self.what} {entry.name!r}: its setting {setting.name!r} means something else elsewhere"
                )
        self.entries[entry.name] = entry

    def settings(self) -> tuple[Setting, ...]:
        """The settings of all entries, each once."""
        return tuple({setting.name: setting for entry in self for setting in settings_of(entry)}.values())


def settings_of(entry: Entry) -> tuple[Setting, ...]:
    """The settings of an entry, none for a kind that has none."""
    found: tuple[Setting, ...] = getattr(entry, "settings", ())
    return found


def arguments(entry: Entry, given: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments for the function or class of an entry among the values of settings by name."""
    return {s.argument or s.name: given.get(s.name, s.default) for s in settings_of(entry)}


def loaded(target: Target) -> Any:
    """The function or class of an entry, imported now if it is given as "package.module:name"."""
    if not isinstance(target, str):
        return target
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)


_PLUGIN = "ffr_plugin:"  # before the path, in the name of the module


def plugins() -> list[str]:
    """Files of Python that were loaded, for other processes to do the same."""
    return [name.removeprefix(_PLUGIN) for name in sys.modules if name.startswith(_PLUGIN)]


def load_plugin(path: str | Path) -> None:
    """Run a file of Python, once, which registers entries. Raises InputError for a file that fails.

    >>> fd.load_plugin("own.py")
    """
    path = Path(path)
    name = f"{_PLUGIN}{path.resolve()}"
    if name in sys.modules:
        return
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise InputError(f"--plugin {path}: give a file of Python (.py) that exists")
    sys.modules[name] = module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise InputError(f"--plugin {path} fails with {type(error).__name__}: {error}") from error


def choice(name: str, known: Mapping[str, object]) -> str:
    """Names to choose from, the near ones first."""
    near = get_close_matches(name, known, n=3, cutoff=0.5)
    shown = [*near, *(other for other in known if other not in near)]
    more = f" and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
    names = ", ".join(repr(one) for one in shown[:_SHOWN]) + more
    return (f"did you mean {near[0]!r}? There" if near else "there") + f" are: {names or 'none'}"
