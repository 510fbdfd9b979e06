"""The marks by which bodies and studies are known: what they are made from, with the content of all files that it names."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ffr_dyn.scene_file.assignments import assigned
from ffr_dyn.scene_file.parameters import Parameters, flattened, substituted
from ffr_dyn.scene_file.source import PATHS, read_source
from ffr_dyn.studies.measures import mentions
from ffr_dyn.studies.plan import Study, as_texts, reached, recipe
from ffr_dyn.studies.sampling import Value
from ffr_prep.common.entries import places_of, value_at
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import plugins

KEY = 24  # hexadecimal digits of a body's name
_QUOTED = re.compile(rb"""["']([^"'\n]{1,1000})["']""")
_INPUT = re.compile(rb"""INPUT\s*=\s*["']?([^"',\r\n]+)""", re.IGNORECASE)
_INCLUDE = re.compile(rb"""^\s*INCLUDE\s+["']?([^"'\r\n]+)""", re.IGNORECASE | re.MULTILINE)
NAMING = {".toml": _QUOTED, ".geo": _QUOTED, ".inp": _INPUT} | dict.fromkeys(
    (".bdf", ".nas", ".dat", ".fem"), _INCLUDE
)  # files that name others

Contents = dict[Path, str]  # digests of files, each with those that it names


# ---- bodies ---------------------------------------------------------------------------------------------------------


def body_file(line: str, folder: Path, cache: Path, known: Contents | None = None) -> Path:
    """Where a body is kept: named by its line and by what is in the files that it names, and that these name.

    known : digests that need not be made again
    """
    words, known = shlex.split(line), {} if known is None else known
    digest = hashlib.sha256(repr(words).encode())
    for word in words[1:]:
        named = folder / word.rpartition("=")[2]
        if named.is_file():
            digest.update(_content(named, known).encode())
    return cache / f"{digest.hexdigest()[:KEY]}.ffr"


def _content(file: Path, known: Contents) -> str:
    """The digest of a file and of all that it names, directly or by way of others."""
    if file not in known:
        known[file] = ""  # one that names itself
        data = file.read_bytes()
        below = [_content(one, known) for one in _files_in(file, data)]
        known[file] = hashlib.sha256(data + "".join(below).encode()).hexdigest()
    return known[file]


def _files_in(path: Path, data: bytes) -> list[Path]:
    """The files that a structure file, a geometry script or an input file of another program names."""
    naming = NAMING.get(path.suffix.lower())
    said = {found[1].decode(errors="replace").strip() for found in naming.finditer(data)} if naming else set()
    return [file for file in (path.parent / name for name in sorted(said)) if "\0" not in str(file) and file.is_file()]


# ---- studies --------------------------------------------------------------------------------------------------------


def mark(made: Study) -> str:
    """The mark that tells a study from another: its points, outputs and recipes, its scene, the plugins, and all files that
    one of its runs reads."""
    known: Contents = {}
    lines = {
        (name, recipe(made, name, point))
        for name, line in made.recipes.items()
        for point in _distinct(made, [one for one in made.parameters if mentions(line, one)])
    }
    whole = [
        [sorted(point.items()) for point in made.points],
        [[one.name, one.quantity, one.how] for one in made.outputs],
        sorted((name, line, body_file(line, made.folder, Path(), known).name) for name, line in lines),
        read_source(made.scene).tree,
        {str(file): _content(file, known) for file in sorted(set(_files_of_scene(made)))},
        [_content(Path(file), known) for file in plugins()],
        made.histories,
    ]
    return hashlib.sha256(json.dumps(whole, sort_keys=True, default=str).encode()).hexdigest()


def _distinct(made: Study, names: Sequence[str]) -> list[dict[str, Value]]:
    """The different values that some parameters have together."""
    rows = dict.fromkeys(tuple(point[name] for name in names) for point in made.points)
    return [dict(zip(names, row, strict=True)) for row in rows]


def _files_of_scene(made: Study) -> Iterator[Path]:
    """The files that the runs read, whatever the parameters in their names."""
    source = read_source(made.scene)
    for values in _distinct(made, _naming(made, source.tree)):
        with suppress(InputError):  # what the run will say
            tree, own = assigned(source, as_texts(values))
            files = [Path(text) for _, text in _paths(substituted(tree, Parameters(own), ""))]
            yield from (file for file in files if file.is_file())


def _naming(made: Study, tree: Mapping[str, Any]) -> list[str]:
    """The parameters of a study that the name of a file depends on, be it by way of others."""
    paths = _paths(tree)
    own = reached([text for _, text in paths], flattened(tree.get("parameters", {})))
    return [name for name in made.parameters if name in own or name in dict(paths)]


def _paths(tree: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The entries that are names of files: where they stand, and what they say."""
    places = {name: keys for name, keys in places_of(tree).items() if keys[-1] in PATHS}
    found = {name: value_at(tree, keys) for name, keys in places.items()}
    return [(name, text) for name, text in found.items() if isinstance(text, str)]
