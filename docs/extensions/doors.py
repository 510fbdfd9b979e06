"""The pages of the two packages' public names, made from signatures and docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

from ffr_prep.common.docstrings import blocks

OTHERS = re.compile(r"^(?:>>> |\.\.\. |    )")


def page(package: Any, alias: str) -> str:
    """Markdown: the docstring of a package, then its names by the module in which they are."""
    lines = [f"# `import {package.__name__} as {alias}`", "", *_said(package.__doc__), ""]
    for module, names in package._BY_MODULE.items():
        lines += [f"## {_headline(module)}", ""]
        for name in names.split():
            lines += _name(package.__name__, alias, name, getattr(package, name))
    return "\n".join(lines)


def _headline(module: str) -> str:
    """The first sentence of a module's docstring, without its full stop, as the title of what is in it."""
    said = inspect.cleandoc(__import__(module, fromlist=["x"]).__doc__ or module)
    return _letters(re.split(r"[.:;](?:\s|$)", " ".join(said.split()), maxsplit=1)[0])


def _name(package: str, alias: str, name: str, thing: Any) -> list[str]:
    role = "class" if inspect.isclass(thing) else "function" if callable(thing) else "data"
    lines = ["", f"````{{py:{role}}} {package}.{name}{_signature(thing)}", "", *_said(thing.__doc__)]
    if role == "class":
        for member, of in _members(thing):
            lines += ["", f"**{member}** ", "", *_said(of)]
    return [*lines, "", "````", "", "```{eval-rst}", f".. minigallery:: {package}.{name}", "```", ""]


def _signature(thing: Any) -> str:
    """The names of the arguments and their defaults; what cannot be told in a word is left out."""
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return ""
    empty = inspect.Parameter.empty
    given = [
        p.replace(annotation=empty, default=p.default if p.default is empty or _is_short(p.default) else Ellipsis)
        for p in found.parameters.values()
        if not p.name.startswith("_")
    ]
    return str(found.replace(parameters=given, return_annotation=empty)).replace("Ellipsis", "...")


def _is_short(value: Any) -> bool:
    return isinstance(value, str | int | float | bool | None) or value == ()


def _members(thing: type) -> Iterator[tuple[str, str]]:
    """Methods and properties of a class with docstrings of their own."""
    for name, member in vars(thing).items():
        function = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        function = getattr(function, "func", function)  # of a cached property
        if name.startswith("_") or not callable(function) or inspect.isclass(function) or not function.__doc__:
            continue
        called = not isinstance(member, property) and inspect.isfunction(getattr(member, "__func__", member))
        yield f"{name}{_signature(member) if called else ''}".replace("*", r"\*"), function.__doc__


def _said(docstring: str | None) -> list[str]:
    """A docstring as Markdown: paragraphs, lists of names, programs."""
    lines: list[str] = []
    for block in blocks(docstring):
        if isinstance(block, dict):
            lines += [
                f"* {', '.join(f'`{name}`' for name in names)}: {_letters(text)}" for names, text in block.items()
            ]
        elif all(OTHERS.match(line) for line in block.split("\n")):
            language = "python" if ">>>" in block or " = " in block else "text"
            lines += [f"```{language}", inspect.cleandoc(block), "```"]
        else:
            lines.append(_mixed(block))
        lines.append("")
    return lines


def _mixed(block: str) -> str:
    """A paragraph, from where it is indented on a block of its own."""
    lines = block.split("\n")
    k = next((k for k, line in enumerate(lines) if OTHERS.match(line)), len(lines))
    plain, rest = "\n".join(lines[:k]), lines[k:]
    return _letters(plain) + ("\n\n```text\n" + inspect.cleandoc("\n" + "\n".join(rest)) + "\n```" if rest else "")


def _letters(text: str) -> str:
    """Text in which what Markdown would read as marks is letters, but for `code`."""
    pieces = re.split(r"(`[^`\n]*`)", text)
    return "".join(piece if k % 2 else re.sub(r"([*_<>\[\]$|])", r"\\\1", piece) for k, piece in enumerate(pieces))
