"""The doors through which files come in: what is read is noted, checked for size, and never ends in a traceback."""

from __future__ import annotations

import stat
import tomllib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import note_input

_MOST_TOML, _MOST_TEXT = 1 << 25, 1 << 31  # bytes
_DEEPEST = 40  # tables and lists within each other
_LARGEST = 1 << 63
_SHOWN, _LISTED = 200, 5
_CAD = "a CAD file, of which `ffr-prep reduce` makes a body"
_MESH = "a mesh, of which `ffr-prep reduce` makes a body"
ENDINGS = {
    ".ffr": "a body file, which a scene names (file = ...) and `ffr-prep info` describes",
    ".nc": "a result file, which `ffr-dyn info`, `plot` and `animate` show",
    ".toml": "a text such as a scene, which `ffr-dyn run` analyses",
    **dict.fromkeys((".sid_fem", ".sid"), "a body of another program, which `ffr-prep import` reads"),
    ".fem": "a body of MBDyn, which `ffr-prep import` reads, or a mesh",
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".brep", ".geo"), _CAD),
    **dict.fromkeys((".inp", ".bdf", ".nas", ".dat", ".msh", ".med", ".unv", ".vtu", ".frd"), _MESH),
}
_MARKS = (BOM_UTF16_LE, BOM_UTF16_BE)
TOO_MANY_DIGITS = "int_max_str_digits"  # in a ValueError of Python for thousands of them
MANY = 50_000_000  # of numbers that are listed one by one


@contextmanager
def reading(path: str | Path, what: str, *damage: type[Exception]) -> Iterator[None]:
    """A file is read within the block, as `what` it should be. Whatever goes wrong becomes an InputError that names it.

    damage : errors by which a reader of a library says that the file is none of its kind. Any other that is not one of our
             own is a mistake of the program, and the message asks for a report
    """
    check_ordinary(path, what)
    try:
        yield
    except (InputError, ComputationError, KeyboardInterrupt):
        raise
    except RecursionError:
        raise InputError(f"{path} is nested too deeply for {what}") from None
    except OverflowError:
        raise _too_large(path, what) from None
    except MemoryError:
        raise InputError(f"{path} announces more than fits in memory: is it {what}, and complete?") from None
    except Exception as error:
        if TOO_MANY_DIGITS in str(error):
            raise _too_large(path, what) from None
        why = " ".join(f"{type(error).__name__}: {error}".split())[:_SHOWN]
        if isinstance(error, damage):
            raise InputError(f"{path} is not {what} ({why}); is it complete?") from None
        raise InputError(
            f"{path} cannot be read as {what} ({why}); is it complete? If it is sound, please report it with the file"
        ) from error


def _too_large(path: str | Path, what: str) -> InputError:
    return InputError(f"{path} holds a number that is too large for {what}")


def not_of_its_ending(path: str | Path, what: str, fault: str) -> str:
    """Why a file cannot be read as `what`, a kind of file: for one whose ending is of another kind that, else the fault."""
    kind = ENDINGS.get(Path(path).suffix.lower(), what)
    return f"{path} {fault}" if kind.startswith(what) else f"{path} is not {what} but, by its ending, {kind}"


def check_ordinary(path: str | Path, what: str) -> None:
    """InputError for what does not exist, or is no file with an end; notes the file as an input of the command."""
    try:
        mode = Path(path).stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path} does not exist; give {what}{nearest_file(path)}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{str(path)[:_SHOWN]!r} cannot be read ({error})") from None
    if not stat.S_ISREG(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "no ordinary file"
        raise InputError(f"{path} is {kind}; give {what}")
    note_input(path)


def nearest_file(path: str | Path) -> str:
    """A hint at the file that is meant by one that does not exist: the nearest of its kind in its folder, or all; empty
    where there is none."""
    path = Path(path)
    try:
        there = sorted(one.name for one in path.parent.iterdir() if one.suffix == path.suffix and path.suffix)
    except OSError:
        return f"; there is no folder {str(path.parent)!r}" if not path.parent.exists() else ""
    close = get_close_matches(path.name, there, 1)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; in its folder are {', '.join(there[:_LISTED])}" if there else ""


def read_text(path: str | Path, what: str, most: int = _MOST_TEXT) -> str:
    """A text in UTF-8, in UTF-16 where it begins with the mark of that, otherwise in Latin-1."""
    with reading(path, what):
        size = Path(path).stat().st_size
        if size > most:
            raise InputError(f"{path} has {size / 1e6:.0f} MB; {what} has at most {most / 1e6:.0f}")
        content = Path(path).read_bytes()
        for code in ("utf-16",) if content.startswith(_MARKS) else ("utf-8-sig", "latin-1"):
            with suppress(UnicodeDecodeError):
                return content.decode(code)
        raise InputError(f"{path} begins as text in UTF-16 and is none; write it in UTF-8")


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """A TOML file. Raises InputError for one that is none, is nested too deeply or has numbers that no integer holds."""
    with reading(path, what):
        text = Path(path).read_bytes()
        if len(text) > _MOST_TOML:
            raise InputError(f"{path} has {len(text) / 1e6:.0f} MB; {what} has at most {_MOST_TOML / 1e6:.0f}")
        try:
            tree = tomllib.loads(text.decode("utf-16" if text.startswith(_MARKS) else "utf-8-sig"))
        except ValueError as error:
            if TOO_MANY_DIGITS in str(error):
                raise _too_large(path, what) from None
            fault = f"is not a readable TOML file: {str(error)[:_SHOWN]}"
            if isinstance(error, UnicodeDecodeError):
                fault = "is not text in UTF-8; save it so"
            ours = what if Path(path).suffix.lower() != ".toml" else "a text"
            raise InputError(not_of_its_ending(path, ours, fault)) from None
        _check_tree(path, tree)
        return tree


def _check_tree(path: str | Path, tree: dict[str, Any]) -> None:
    level: list[tuple[str, Any]] = [("", tree)]
    for _ in range(_DEEPEST):
        level = [pair for key, item in level for pair in _below(key, item)]
        for key, item in level:
            if type(item) is int and not -_LARGEST <= item < _LARGEST:
                raise InputError(f"{path}: {key.strip('.')} is an integer beyond 64 bits; write it with a point")
    if level:
        raise InputError(f"{path}: {level[0][0][1:60]}... is nested more than {_DEEPEST} deep")


def _below(key: str, item: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(item, dict):
        yield from ((f"{key}.{name}", value) for name, value in item.items())
    elif isinstance(item, list):
        yield from ((key, value) for value in item)


def check_count(count: int, what: str, most: int = MANY) -> None:
    """InputError for so many of something that no memory holds them, before it is taken."""
    if count > most:
        raise InputError(f"{count} {what} are too many; there may be {most}")
