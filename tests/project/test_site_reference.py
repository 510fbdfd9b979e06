"""The reference of the site: every key of a scene file has its meaning, a place on the page, and an example."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import click
import pytest
from places import ROOT
from pydantic import TypeAdapter

import ffr_dyn
import ffr_prep
from ffr_dyn.cli import cli as dyn_cli
from ffr_dyn.scene_file.schema import scene_entry
from ffr_prep.cli import cli as prep_cli

SCHEMA: dict[str, Any] = json.loads((ROOT / "docs" / "scene.schema.json").read_text(encoding="utf-8"))
ENTRIES = {"Scene": SCHEMA, **SCHEMA["$defs"]}
EXAMPLES = tomllib.loads((ROOT / "docs" / "reference" / "examples.toml").read_text(encoding="utf-8"))
ONE_SCENE = {"bodies": {}, "analysis": {"end": 1, "output_step": 0.1}}
INSIDE_FORWARD = {"EventEntry", "StabilisationEntry", "TolerancesEntry"}
INSIDE_MIXED = {"JointEffortEntry", "MarkerEffortEntry", "CausalEntry", "BoundedEntry"}


@pytest.fixture(scope="module")
def makers():
    """What makes the pages of the site."""
    sys.path.insert(0, str(ROOT / "docs" / "extensions"))
    try:
        return SimpleNamespace(**{name: import_module(name) for name in ("commands", "doors", "entries")})
    finally:
        sys.path.pop(0)


@pytest.fixture(scope="module")
def page(makers):
    return makers.entries.page(SCHEMA)


def snippets(name: str) -> list[dict[str, Any]]:
    return [tomllib.loads(text) for text in EXAMPLES[name].split("# ------ or")]


def whole(name: str, part: dict[str, Any]) -> dict[str, Any]:
    """A scene that holds the example."""
    analysis = {**ONE_SCENE["analysis"], **({"method": "dopri5"} if name == "TolerancesEntry" else {})}
    if name in INSIDE_MIXED:
        analysis |= {"kind": "mixed", "unknown": {"torque": {"joint": "hinge"}}}
    inside = name in INSIDE_FORWARD | INSIDE_MIXED
    given = part.get("analysis", {})
    return {**ONE_SCENE, **part, "analysis": {**analysis, **given} if inside else given or analysis}


def keys_given(of: Any, keys: set[str]) -> set[str]:
    """Those keys that stand anywhere in an example."""
    if isinstance(of, dict):
        return {key for key in of if key in keys}.union(*(keys_given(value, keys) for value in of.values()))
    return set().union(*(keys_given(value, keys) for value in of)) if isinstance(of, list) else set()


@pytest.mark.parametrize("name", ENTRIES)
def test_every_key_says_what_it_means(name):
    assert [key for key, of in ENTRIES[name]["properties"].items() if len(of.get("description", "")) < 4] == []
    assert ENTRIES[name].get("description")


@pytest.mark.parametrize("name", ENTRIES)
def test_every_key_is_on_the_page(page, name):
    section = re.split(r"\n\(\w+\)=\n", page.partition(f"({name})=\n")[2])[0]
    assert [key for key in ENTRIES[name]["properties"] if f"| `{key}` |" not in section] == []
    assert "```toml" in section


@pytest.mark.parametrize("name", ENTRIES)
def test_the_examples_of_an_entry_have_all_of_its_keys_and_are_valid(name, tmp_path, monkeypatch):
    keys = set(ENTRIES[name]["properties"])
    given = list(snippets(name))
    assert keys - set().union(*(keys_given(part, keys) for part in given)) <= {"kind"}
    (tmp_path / "angle.csv").write_text("0, 0\n1, 0.1\n2, 0\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    adapter = TypeAdapter(scene_entry())
    for part in given:
        adapter.validate_python(whole(name, part), context={"parameters": {"length": 0.3}})


def test_no_example_is_of_nothing():
    assert set(EXAMPLES) == set(ENTRIES)


def test_links_of_the_page_lead_to_its_sections(page):
    anchors = set(re.findall(r"^\((\w+)\)=$", page, re.M))
    assert set(re.findall(r"\]\(#(\w+)\)", page)) <= anchors


# ---- commands and public names --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "group"), [("ffr-prep", prep_cli), ("ffr-dyn", dyn_cli)])
def test_every_command_and_option_is_on_the_page(makers, name, group):
    page = makers.commands.page(name, group)
    context = click.Context(group, info_name=name)
    for word in group.list_commands(context):
        command = group.get_command(context, word)
        assert f"## `{name} {word}`" in page
        options = [of for of in command.params if isinstance(of, click.Option) and not of.hidden]
        assert [of.opts for of in options if not any(flag in page for flag in of.opts)] == []


@pytest.mark.parametrize(("package", "alias"), [(ffr_prep, "fp"), (ffr_dyn, "fd")])
def test_every_public_name_is_on_the_page(makers, package, alias):
    page = makers.doors.page(package, alias)
    named = set(re.findall(rf"^`{{4}}{{py:\w+}} {package.__name__}\.(\w+)", page, re.M))
    assert named == set(package.__all__) - {"__version__"}


def test_signatures_are_short_and_types_left_out(makers):
    text = makers.doors._signature(ffr_dyn.forward)
    assert text.startswith("(scene, *, end, output_step, method=None, start=0.0, stabilisation=...")
    assert "Integrator" not in text
