"""Options of the command line from the settings of registered entries, those of plug-ins as well."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import click

from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import Registry, Setting

_COLUMN, _WIDTH = 33, 118


def numbers(count: int | None = None) -> Callable[[click.Context, click.Parameter, str | None], Any]:
    """A callback that reads an option of numbers with commas between them, of a given count, if there is one."""

    def read(_: click.Context, option: click.Parameter, text: str | None) -> tuple[float, ...] | None:
        if text is None:
            return None
        what = f"{option.opts[0]} {text}"
        try:
            values = tuple(float(word) for word in text.split(","))
        except ValueError:
            raise InputError(f"{what}: write numbers with commas between them, such as 10,2000") from None
        if count not in (None, len(values)):
            raise InputError(f"{what}: {count} numbers with commas between them are needed, not {len(values)}")
        return values

    return read


class NotesCommand(click.Command):
    """A command in whose notes "{reduction}" becomes the names and help of the registry of reductions, and so on.

    They are made when the command runs, so that they hold what --plugin adds.
    """

    def __init__(self, *args: Any, registries: Sequence[Registry[Any]], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.registries = registries

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The notes, with the help of the entries."""
        plain = self.epilog
        for registry in self.registries:
            self.epilog = (self.epilog or "").replace(f"{{{registry.what}}}", _help_of(registry))
        super().format_epilog(ctx, formatter)
        self.epilog = plain


class EntriesCommand(NotesCommand):
    """One with an option for each setting of the entries as well."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """The options of its own and those of the entries, before --help."""
        *own, last = super().get_params(ctx)
        return [*own, *(option_of(setting) for registry in self.registries for setting in registry.settings()), last]


def written(registry: Registry[Any]) -> list[str]:
    """Names of the settings of its entries that the command line gives, defaults not among them."""
    context = click.get_current_context(silent=True)
    given = click.core.ParameterSource.COMMANDLINE
    return [s.name for s in registry.settings() if context and context.get_parameter_source(s.name) == given]


def _help_of(registry: Registry[Any]) -> str:
    """A name and what it is for, line by line."""
    lines = []
    for entry in registry:
        first, *rest = textwrap.wrap(entry.help, _WIDTH - _COLUMN)
        lines += [f"  {entry.name:<{_COLUMN - 3}} {first}", *(" " * _COLUMN + line for line in rest)]
    return "\n".join(lines)


def option_of(setting: Setting) -> click.Option:
    """The option --name of a setting."""
    names = (f"--{setting.name.replace('_', '-')}", setting.name)
    if setting.kind is bool:
        return click.Option(names, is_flag=True, default=setting.default, help=setting.help)
    shown: dict[str, Any] = {"default": setting.default, "show_default": True, "help": setting.help}
    if setting.kind == "numbers":
        shown |= {"default": ",".join(f"{x:g}" for x in setting.default), "metavar": "X1,X2,...", "callback": numbers()}
        return click.Option(names, **shown)
    if isinstance(setting.kind, tuple):
        return click.Option(names, type=click.Choice(setting.kind), **shown)
    of_int = setting.kind is int and setting.least is not None
    return click.Option(names, type=click.IntRange(min=setting.least) if of_int else setting.kind, **shown)
