"""Pages of all entries of a file, made from its schema and from the examples beside the reference."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from ffr_dyn.scene_file.schema import schema as scene_schema
from ffr_dyn.studies.plan import BodyRecipe, StudyFile
from ffr_prep.common.docstrings import meanings, prose
from ffr_prep.model.material import KEYS, material_keys
from ffr_prep.pipelines.structure_schema import structure_schema

REFERENCE = Path(__file__).resolve().parent.parent / "reference"
SCENE = """# Entries of a scene file

Made from the declarations in the code, as is the [JSON schema](../scene.schema.json). [The scene file](../scene_file.md)
tells how its parts work together. A number may be given as text with a unit of the same dimension or as a formula of the
parameters; units are those that a plain number has. Keys without a default must be given.

"""
STRUCTURE = """# Entries of a structure file

Made from the declarations in the code. [Beams, plates and bodies of several kinds](../structural.md) tells how its parts work
together. Numbers are in the unit that stands beside their meaning, or a text has its own: `d = "50 mm"`. Keys without a
default must be given.

"""
MATERIAL = """# Entries of a material file

Made from the declarations in the code. `--material FILE.toml` reads it; [Materials](../materials.md) tells more.

"""
STUDY = """# Entries of a study file

Made from the declarations in the code. [Studies](../studies.md) tells how its parts work together. Keys without a default
must be given.

"""
WORDS = {"string": "text", "integer": "whole number", "boolean": "true or false", "number": "number"}


@dataclass(frozen=True)
class FileKind:
    """A kind of file: the word of its page and of its examples, what stands above its entries, and its schema, whose root
    has the name `top`; without one the entries of $defs are each a whole file."""

    word: str
    head: str
    schema: dict[str, Any]
    top: str | None = None

    @property
    def entries(self) -> dict[str, Any]:
        """Name -> its schema."""
        return ({self.top: self.schema} if self.top else {}) | self.schema.get("$defs", {})

    @property
    def examples(self) -> dict[str, str]:
        """Name -> an example, or several."""
        found: dict[str, str] = tomllib.loads((REFERENCE / f"{self.word}_examples.toml").read_text(encoding="utf-8"))
        return found


def kinds() -> list[FileKind]:
    """All kinds of files that people write."""
    materials = {"$defs": {f"{kind}Material": _material(*keys) for kind, keys in material_keys().items()}}
    return [
        FileKind("scene", SCENE, scene_schema(), "Scene"),
        FileKind("structure", STRUCTURE, structure_schema().model_json_schema(), "Structure"),
        FileKind("material", MATERIAL, materials),
        FileKind("study", STUDY, _described(StudyFile, {"BodyRecipe": BodyRecipe}), "Study"),
    ]


def _material(needed: set[str], allowed: set[str]) -> dict[str, Any]:
    number = {"anyOf": [{"type": "number"}, {"type": "string"}]}
    words = {"name": {"type": "string"}, "elasticity": _rows(6), "axes": _rows(3)}
    order = [key for key in KEYS if key in needed | allowed]
    return {
        "description": "The whole file.",
        "required": sorted(needed),
        "properties": {key: {**words.get(key, number), "description": KEYS[key]} for key in order},
    }


def _rows(count: int) -> dict[str, Any]:
    row = {"type": "array", "items": {"type": "number"}, "minItems": count, "maxItems": count}
    return {"type": "array", "items": row}


def _described(model: type[BaseModel], inside: dict[str, type[BaseModel]]) -> dict[str, Any]:
    """The schema of a file whose keys are described in the docstrings of its models."""
    made = model.model_json_schema()
    for of, entry in [(model, made), *((inside[name], entry) for name, entry in made.get("$defs", {}).items())]:
        entry["description"] = prose(of.__doc__)
        for key, text in meanings(of.__doc__).items():
            entry["properties"][key]["description"] = text
    return made


def page(kind: FileKind) -> str:
    """Markdown: a section for each entry, with the table of its keys and an example."""
    places, examples = _places(kind.schema), kind.examples
    order = dict.fromkeys([*([kind.top] if kind.top else []), *places, *sorted(kind.entries)])
    return kind.head + "\n".join(
        _section(name, kind.entries[name], places.get(name) or _parents(kind, name), examples.get(name, ""))
        for name in order
    )


def title(name: str) -> str:
    """ "JointSpringEntry" -> "Joint spring"."""
    words = re.findall(r"[A-Z][a-z]*", name.removesuffix("Entry"))
    return " ".join(words).capitalize()


def _places(schema: dict[str, Any]) -> dict[str, str]:
    """Entry -> where it stands in the file, of those that are tables of the scene."""
    found: dict[str, str] = {}
    for table, of in schema.get("properties", {}).items():
        for name in re.findall(r'"\$ref": "#/\$defs/(\w+)"', json.dumps(of)):
            if name != "FunctionEntry":
                found.setdefault(name, _heading(table, of))
    return found


def _heading(table: str, of: dict[str, Any]) -> str:
    """How a table of the file begins."""
    several = [option.get("type") for option in of.get("anyOf", [of])]
    if "array" in several:
        return f"`[[{table}]]`"
    return f"`[{table}.NAME]`" if "object" in several else f"`[{table}]`"


def _parents(kind: FileKind, name: str) -> str:
    """The keys of other entries that hold this one."""
    within = [
        f"`{key}` of [{title(other).lower()}](#{other})"
        for other, entry in kind.entries.items()
        for key, of in entry["properties"].items()
        if other != kind.top and f'"#/$defs/{name}"' in json.dumps(of)
    ]
    return ", ".join(within)


def _section(name: str, entry: dict[str, Any], place: str | None, example: str) -> str:
    lines = [f"({name})=", f"## {title(name)}", ""]
    kind = entry.get("properties", {}).get("kind", {}).get("const")
    if place:
        lines += [place + (f' with `kind = "{kind}"`' if kind else ""), ""]
    lines += [_text(entry.get("description", "")), "", "| key | value | default | meaning |", "|---|---|---|---|"]
    required = entry.get("required", [])
    for key, of in entry["properties"].items():
        default = "" if key in required else _value(of.get("default"))
        lines.append(f"| `{key}` | {_kind(of)} | {default} | {_text(of['description']).replace('|', chr(92) + '|')} |")
    if example:
        lines += ["", "```toml", example.strip(), "```"]
    return "\n".join([*lines, ""])


def _text(said: str) -> str:
    """A docstring's prose as Markdown: indented lines are formulas."""
    return re.sub(r"(?m)^( {4,}\S.*(?:\n {4,}\S.*)*)", lambda m: f"```text\n{m[1]}\n```", said).replace("*", r"\*")


def _value(default: Any) -> str:
    if default in (None, [], {}):
        return "none"
    inner = default[0] if isinstance(default, list) else default
    return "its defaults" if isinstance(inner, dict) else f"`{json.dumps(default)}`"


def _kind(of: dict[str, Any]) -> str:
    """What stands for a value, in words."""
    unit = f" [{of['unit']}]" if "unit" in of else ""
    if "$ref" in of:
        name = of["$ref"].rpartition("/")[2]
        return f"[{title(name).lower()}](#{name})"
    if "const" in of:
        return f"`{json.dumps(of['const'])}`"
    if "enum" in of:
        return ", ".join(f"`{json.dumps(word)}`" for word in of["enum"])
    options = [option for option in of.get("anyOf", of.get("oneOf", [])) if option.get("type") != "null"]
    if options:
        return _choice(options) + unit
    if of.get("type") == "array":
        return _list(of)
    if of.get("type") == "object":
        held = of.get("additionalProperties", {})
        return "table of " + _many(_kind(held)) if isinstance(held, dict) and held else "table"
    return WORDS.get(of.get("type", ""), "any") + unit


def _choice(options: list[dict[str, Any]]) -> str:
    """Numbers, which may be texts, once."""
    if [option.get("type") for option in options] == ["number", "string"]:
        return "number"
    if [option.get("type") for option in options[:2]] == ["number", "string"]:
        options = [options[0], *options[2:]]
    return " or ".join(dict.fromkeys(map(_kind, options)))


def _list(of: dict[str, Any]) -> str:
    if "prefixItems" in of:
        parts = list(map(_kind, of["prefixItems"]))
        return f"list of {len(parts)} {_many(parts[0])}" if len({*parts}) == 1 else "list of " + " and ".join(parts)
    number = f"{of['minItems']} " if of.get("minItems") == of.get("maxItems") and "minItems" in of else ""
    return f"list of {number}{_many(_kind(of.get('items', {})))}"


def _many(kind: str) -> str:
    """The same of more than one: "number [m]" -> "numbers [m]"."""
    return re.sub(r"^(number|text|list|table|whole number)\b", r"\1s", kind)
