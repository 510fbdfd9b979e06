"""The option `--plugin` of `ffr-dyn`: modules of the user, which make forces, joints and other kinds of things known."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from typing import Any

import click

from ffr_prep.common.errors import InputError


def load_plugin(name: str) -> None:
    """Import a module by its name or its file "name.py". Raises InputError where there is none.

    It is imported before a scene file is read; a scene file itself never names code that is run.
    """
    path = Path(name)
    if path.suffix != ".py":
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as error:
            raise InputError(
                f"--plugin {name}: {error}; give a file NAME.py or the name of an installed module"
            ) from None
        return
    if not path.is_file():
        raise InputError(f"--plugin {name}: there is no such file")
    known = getattr(sys.modules.get(path.stem), "__file__", None) if path.stem in sys.modules else ""
    if known == str(path.resolve()):
        return
    if known != "":
        raise InputError(f"--plugin {name}: a module {path.stem!r} is loaded already; give the file another name")
    spec: Any = importlib.util.spec_from_file_location(path.stem, path.resolve())
    sys.modules[path.stem] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)


def _load(context: click.Context, parameter: click.Parameter, names: tuple[str, ...]) -> None:
    for name in names:
        load_plugin(name)


plugin_option = click.option(
    "--plugin",
    multiple=True,
    metavar="FILE.py",
    expose_value=False,
    callback=_load,
    help="A Python file or module to load first, which makes forces, joints, ... of your own known; may be repeated.",
)
