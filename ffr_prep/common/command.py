"""Shared by the commands of both packages: how they end, which files they read, and which they may write."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.interrupts import ending_in_order, ignore_further
from ffr_prep.common.outputs import command_inputs, note_input, reserved
from ffr_prep.common.reading import ENDINGS, TOO_MANY_DIGITS


class InputPath(click.Path):
    """A file to read, which no output of the same command may replace."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = super().convert(value, param, ctx)
        note_input(os.fsdecode(path))
        return path


class FiniteRange(click.FloatRange):
    """A number between limits; not-a-number, which no comparison catches, is none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


INPUT_FILE = InputPath()
OUTPUT_FILE = click.Path(path_type=Path)


def reserve(option: str, path: Path | None, suffixes: Sequence[str] = (), usual: str = "") -> None:
    """Before the work, not after it: InputError for a file that could not be written, or not in a known format.

    usual : ending of what is written where any is allowed but those of other kinds of files, one of which would be lost
    Until the command ends no other one writes to it.
    """
    if path is None:
        return
    if str(path) == "-":
        raise InputError(f"{option} -: nothing is written to the standard output; name a file")
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError(
            f"{option} {path}: it is written as {' or '.join(suffixes)}, not {path.suffix or 'without a suffix'}"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"{option} {path}: the folder {path.parent} cannot be written to; choose another place")
    try:
        click.get_current_context().with_resource(reserved(path))
    except InputError as error:
        raise type(error)(f"{option} {error}") from None
    check_ending(option, path, usual)


def check_ending(option: str, path: Path, usual: str) -> None:
    """InputError for an output called like a file of another kind, which would be lost; usual : the ending it has, or ""."""
    kind = ENDINGS.get(path.suffix.lower())
    if kind is not None and usual not in ("", path.suffix.lower()):
        raise InputError(f"{option} {path}: by its ending this is {kind}; what is written here ends in {usual}")


def run_command(group: click.Group, program: str, arguments: Sequence[str] | None = None) -> None:
    """Run a command line. Exit code 2 for bad input, 1 for a failed computation or a signal; one line, no traceback."""
    try:
        with ending_in_order(), command_inputs():
            group.main(arguments, prog_name=program, standalone_mode=False)
            if sys.stdout is not None:  # closed by who started us
                sys.stdout.flush()
    except BrokenPipeError:  # who read our output has enough, such as `head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except (click.Abort, KeyboardInterrupt) as error:
        ignore_further()
        asked = error.__cause__ or error  # click gives its own in place of ours
        kept = "; ".join(getattr(asked, "__notes__", ["nothing was written"]))
        _leave(program, f"interrupted{f' by {asked}' if str(asked) else ''}; {kept}", 1)
    except Exception as error:
        _leave(program, *_last_words(program, error))


def _last_words(program: str, error: Exception) -> tuple[str, int]:
    """The last line that a command prints for an error, and its exit code."""
    if isinstance(error, InputError):
        return str(error), 2
    if isinstance(error, ComputationError):
        return str(error), 1
    if isinstance(error, click.UsageError):
        where = error.ctx.command_path if error.ctx else program
        return f"{error.format_message()} ({where} --help tells more)", 2
    if isinstance(error, click.ClickException):
        return error.format_message(), error.exit_code
    if isinstance(error, OSError):
        where = error.filename2 or error.filename
        if where is None:
            return f"what is printed cannot be written ({error.strerror or error}); files that are told are whole", 1
        return f"{os.fsdecode(where)}: {error.strerror or error}; choose another place", 2
    if TOO_MANY_DIGITS in str(error):
        return "a number has too many digits; give a smaller one", 2
    if isinstance(error, MemoryError):
        return "not enough memory: make the model smaller, such as by a coarser mesh", 1
    return f"{unforeseen(error)}; this is a mistake of the program: please report it, with what you gave it", 1


def unforeseen(error: BaseException) -> str:
    """Kind, text and origin of an error that nobody has thought of."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    code = None if trace is None else trace.tb_frame.f_code
    place = "" if trace is None or code is None else f" at {Path(code.co_filename).name}:{trace.tb_lineno}"
    text = " ".join(str(error).split())[:300]
    return f"{type(error).__name__}{f': {text}' if text else ''}{place}"


def _leave(program: str, message: str, code: int) -> None:
    click.echo(f"{program}: {message}", err=True)
    sys.exit(code)
