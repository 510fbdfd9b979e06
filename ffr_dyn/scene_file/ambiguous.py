"""Names in formulas of the motion that mean two things, or that formulas cannot hold."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from ffr_dyn.scene_file.parameters import flattened
from ffr_dyn.scene_file.schema import fields_of_motion, tables
from ffr_dyn.scene_file.source import Source, origin
from ffr_prep.common.errors import InputError

_WORD = re.compile(r"[A-Za-z_]\w*")


def check_ambiguous(source: Source, quantities: set[str]) -> None:
    """InputError where a formula of the motion uses a name that is a parameter and a quantity of the scene, and a name with a
    minus in it, which it would take for a difference."""
    both = quantities & set(flattened(source.tree.get("parameters", {})))
    for keys, text in _formulas(source.tree):
        for name in sorted(both):
            if re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", text.replace("[", ".").replace("]", "")):
                raise InputError(
                    f"{origin(source, keys)}: {'.'.join(keys)}: {name!r} is a parameter, and what moves has a quantity of "
                    f"that name, too; give the parameter another (it is {text!r})"
                )
        if words := unreadable(text, source.tree):
            raise InputError(f"{origin(source, keys)}: {'.'.join(keys)}: {words} (it is {text!r})")


def unreadable(text: str, tree: Mapping[str, Any]) -> str:
    """That a formula names a body, a joint or a point as formulas cannot; empty where it does not."""
    bodies = tree.get("bodies", {}).values()
    points = [name for body in bodies if isinstance(body, dict) for name in body.get("points", {})]
    for before, names in ((r"(?<![\w.])", [*tree.get("bodies", {}), *tree.get("joints", {})]), (r"\.", points)):
        for name in names:
            if not _WORD.fullmatch(name) and re.search(rf"{before}{re.escape(name)}\.[A-Za-z_]", text):
                better = re.sub(r"^(?=\d)", "_", re.sub(r"\W", "_", name))
                return f"formulas cannot hold the name {name!r}: they have letters, digits and '_'; call it {better!r}"
    return ""


def _formulas(tree: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], str]]:
    """The texts that may depend on the motion, with their keys."""
    for table, kinds in tables().items():
        for name, entry in tree.get(table, {}).items():
            for kind in kinds:
                for key in fields_of_motion(kind.made) if kind.word == entry.get("kind", kinds[0].word) else ():
                    given = entry.get(key)
                    for k, one in enumerate(given if isinstance(given, list) else [given]):
                        text = one.get("formula") if isinstance(one, dict) else one
                        if isinstance(text, str):
                            yield (table, name, key, *([str(k + 1)] if isinstance(given, list) else [])), text
