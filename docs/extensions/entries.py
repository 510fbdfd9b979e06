"""The page of all entries of a scene file, made from its schema and from the examples beside the reference."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parent.parent / "reference" / "examples.toml"
HEAD = """# Entries of a scene file

Made from the declarations in the code, as is the [JSON schema](../scene.schema.json). [The scene file](../scene_file.md)
tells how its parts work together. A number may be given as text with a unit of the same dimension or as a formula of the
parameters; units are those that a plain number has. Keys without a default must be given.

"""
AT_THE_TOP = "Scene"
WORDS = {"string": "text", "integer": "whole number", "boolean": "true or false", "number": "number"}


def page(schema: dict[str, Any]) -> str:
    """Markdown: a section for each entry, with the table of its keys and an example."""
    definitions = {AT_THE_TOP: schema, **schema["$defs"]}
    places, examples = _places(schema), _examples()
    order = [AT_THE_TOP, *places, *sorted(set(definitions) - set(places) - {AT_THE_TOP})]
    return HEAD + "\n".join(
        _section(name, definitions[name], places.get(name), examples.get(name, "")) for name in order
    )


def title(name: str) -> str:
    """ "JointSpringEntry" -> "Joint spring"."""
    words = re.findall(r"[A-Z][a-z]*", name.removesuffix("Entry"))
    return " ".join(words).capitalize()


def _examples() -> dict[str, str]:
    found: dict[str, str] = tomllib.loads(EXAMPLES.read_text(encoding="utf-8"))
    return found


def _places(schema: dict[str, Any]) -> dict[str, str]:
    """Entry -> where it stands in the file, of those that are tables of the scene."""
    found: dict[str, str] = {}
    for table, of in schema["properties"].items():
        for name in re.findall(r'"\$ref": "#/\$defs/(\w+)"', json.dumps(of)):
            if name != "FunctionEntry":
                found.setdefault(name, f"[{table}]" if table in ("analysis", "chart") else f"[{table}.NAME]")
    return found


def _section(name: str, entry: dict[str, Any], place: str | None, example: str) -> str:
    lines = [f"({name})=", f"## {title(name)}", ""]
    kind = entry.get("properties", {}).get("kind", {}).get("const")
    if place:
        lines += [f"`{place}`" + (f' with `kind = "{kind}"`' if kind else ""), ""]
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
    return f"`{json.dumps(default)}`" if not isinstance(default, dict) else "its defaults"


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
        return "list of " + " and ".join(map(_kind, of["prefixItems"]))
    number = f"{of['minItems']} " if of.get("minItems") == of.get("maxItems") and "minItems" in of else ""
    return f"list of {number}{_many(_kind(of.get('items', {})))}"


def _many(kind: str) -> str:
    """The same of more than one: "number [m]" -> "numbers [m]"."""
    return re.sub(r"^(number|text|list|table|whole number)\b", r"\1s", kind)
