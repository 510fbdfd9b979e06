"""The front door of a package: its public names, each loaded when it is first used (PEP 562)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def front_door(
    package: str, by_module: Mapping[str, str]
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """`__all__`, `__getattr__` and `__dir__` of a package: the names in `by_module` (module -> names) and `__version__`."""
    module_of = {name: module for module, names in by_module.items() for name in names.split()}
    public = ["__version__", *module_of]

    def loaded(name: str) -> Any:
        if name == "__version__":
            from importlib.metadata import version

            value: Any = version("ffr")
        elif name in module_of:
            value = getattr(import_module(module_of[name]), name)
        else:
            from difflib import get_close_matches

            close = get_close_matches(name, public, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"dir({package}) lists what there is"
            raise AttributeError(f"module {package!r} has no attribute {name!r}; {hint}", name=name)
        setattr(sys.modules[package], name, value)
        return value

    return public, loaded, lambda: sorted(public)
