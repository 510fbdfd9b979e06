"""The pages of the two commands, made from the commands themselves."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

import click

HEAD = """# The command `{name}`

Made from the command itself: `{name} COMMAND --help` says the same.

"""


def page(name: str, group: click.Group) -> str:
    """Markdown: what the group says, and a section for each command."""
    context = click.Context(group, info_name=name)
    return HEAD.format(name=name) + "\n".join(_section(command, of) for command, of in _walk(group, context))


def _walk(group: click.Group, context: click.Context) -> Iterator[tuple[click.Command, click.Context]]:
    """The group itself, then all that it holds."""
    yield group, context
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if command is None or command.hidden:
            continue
        inner = click.Context(command, info_name=name, parent=context)
        if isinstance(command, click.Group):
            yield from _walk(command, inner)
        else:
            yield command, inner


def _section(command: click.Command, context: click.Context) -> str:
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    lines = [f"({anchor(context.command_path)})=", f"## `{context.command_path}`", "", *_prose(command.help or "")]
    lines += ["", "```text", usage, "```", ""]
    options = [
        option for option in command.get_params(context) if isinstance(option, click.Option) and not option.hidden
    ]
    if options:
        lines += ["| option | meaning |", "|---|---|", *(_row(option, context) for option in options), ""]
    return "\n".join([*lines, *_prose(command.epilog or ""), ""])


def anchor(path: str) -> str:
    """ "ffr-dyn run" -> "ffr-dyn-run"."""
    return path.replace(" ", "-")


def _row(option: click.Option, context: click.Context) -> str:
    record = option.get_help_record(context)
    names, said = record if record else (option.opts[0], "")
    required = " Must be given." if option.required else ""
    return f"| `{_safe(names)}` | {_marked(_safe(said))}{required} |"


def _safe(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _marked(text: str) -> str:
    """Text as it is, for Markdown: what it would read as marks are letters."""
    return re.sub(r"([*_<>\[\]])", r"\\\1", text)


def _prose(text: str) -> list[str]:
    """Paragraphs; those that click leaves as they are (marked by a backspace) are blocks of their own."""
    lines: list[str] = []
    for paragraph in re.split(r"\n\s*\n", inspect.cleandoc(text)):
        kept = re.sub(r"^\s*\x08\n", "", paragraph) if "\x08" in paragraph else None
        lines += [_marked(paragraph.strip()), ""] if kept is None else ["```text", kept.rstrip(), "```", ""]
    return lines
