"""The reference of the site: every key of a file that people write has its meaning, a place on a page, and an example."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from importlib import import_module
from typing import Any

import click
import matplotlib.pyplot as plt
import pytest
from places import ROOT
from pydantic import TypeAdapter

import ffr_dyn
import ffr_prep
from ffr_dyn.cli import cli as dyn_cli
from ffr_dyn.scene_file.schema import scene_entry
from ffr_dyn.studies.plan import StudyFile
from ffr_prep.cli import cli as prep_cli
from ffr_prep.model.material import parse_material
from ffr_prep.pipelines.structure_schema import structure_schema

sys.path.insert(0, str(ROOT / "docs" / "extensions"))
try:
    commands, doors, entries = map(import_module, ("commands", "doors", "entries"))
finally:
    sys.path.pop(0)

KINDS = {kind.word: kind for kind in entries.kinds()}
ALL = [(word, name) for word, kind in KINDS.items() for name in kind.entries]
PAGES = {word: entries.page(kind) for word, kind in KINDS.items()}
ONE_SCENE = {"bodies": {}, "analysis": {"end": 1, "output_step": 0.1}}
INSIDE_FORWARD = {"EventEntry", "StabilisationEntry", "TolerancesEntry"}
INSIDE_MIXED = {"JointEffortEntry", "MarkerEffortEntry", "CausalEntry", "BoundedEntry"}


def snippets(word: str, name: str) -> list[dict[str, Any]]:
    return [tomllib.loads(text) for text in KINDS[word].examples[name].split("# ------ or")]


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


@pytest.mark.parametrize(("word", "name"), ALL)
def test_every_key_says_what_it_means(word, name):
    entry = KINDS[word].entries[name]
    assert [key for key, of in entry["properties"].items() if len(of.get("description", "")) < 4] == []
    assert entry.get("description")


@pytest.mark.parametrize(("word", "name"), ALL)
def test_every_key_is_on_the_page(word, name):
    section = re.split(r"\n\(\w+\)=\n", PAGES[word].partition(f"({name})=\n")[2])[0]
    assert [key for key in KINDS[word].entries[name]["properties"] if f"| `{key}` |" not in section] == []
    assert "```toml" in section


@pytest.mark.parametrize(("word", "name"), ALL)
def test_the_examples_of_an_entry_have_all_of_its_keys(word, name):
    keys = set(KINDS[word].entries[name]["properties"])
    assert keys - set().union(*(keys_given(part, keys) for part in snippets(word, name))) <= {"kind"}


@pytest.mark.parametrize("name", KINDS["scene"].entries)
def test_examples_of_scenes_are_valid(name, tmp_path, monkeypatch):
    (tmp_path / "angle.csv").write_text("0, 0\n1, 0.1\n2, 0\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    adapter = TypeAdapter(scene_entry())
    for part in snippets("scene", name):
        adapter.validate_python(whole(name, part), context={"parameters": {"length": 0.3}})


@pytest.mark.parametrize("name", KINDS["structure"].entries)
def test_examples_of_structures_are_valid(name):
    for part in snippets("structure", name):
        structure_schema().model_validate(
            {"geometry": {"file": "portal.geo"}, "ties": [["a", "b"]] * ("solids" in part), **part}
        )


@pytest.mark.parametrize("name", KINDS["material"].entries)
def test_examples_of_materials_are_valid(name, tmp_path):
    (tmp_path / "own.toml").write_text(KINDS["material"].examples[name], encoding="utf-8")
    assert parse_material(str(tmp_path / "own.toml")).rho > 0


@pytest.mark.parametrize("name", KINDS["study"].entries)
def test_examples_of_studies_are_valid(name):
    for part in snippets("study", name):
        StudyFile.model_validate({"scene": "a.toml", "parameters": {}, "outputs": {}, **part})


def test_numbers_of_structures_and_materials_have_units():
    """Beside their meaning, [1] where they have none; but for counts and places that a vector says."""
    plain = {"numbers", "size", "interface_modes", "moments"}
    for word in ("structure", "material"):
        for entry in KINDS[word].entries.values():
            for key, of in entry["properties"].items():
                if '"number"' in json.dumps(of) and '"integer"' not in json.dumps(of) and key not in plain:
                    assert "[" in of["description"] or "$ref" in json.dumps(of), key


@pytest.mark.parametrize("word", KINDS)
def test_no_example_is_of_nothing(word):
    assert set(KINDS[word].examples) == set(KINDS[word].entries)


def test_links_of_the_pages_lead_to_their_sections():
    anchors = [anchor for page in PAGES.values() for anchor in re.findall(r"^\((\w+)\)=$", page, re.M)]
    assert len(anchors) == len(set(anchors))
    for page in PAGES.values():
        assert set(re.findall(r"\]\(#(\w+)\)", page)) <= set(re.findall(r"^\((\w+)\)=$", page, re.M))


# ---- commands and public names --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "group"), [("ffr-prep", prep_cli), ("ffr-dyn", dyn_cli)])
def test_every_command_and_option_is_on_the_page(name, group):
    page = commands.page(name, group)
    context = click.Context(group, info_name=name)
    for word in group.list_commands(context):
        command = group.get_command(context, word)
        assert f"## `{name} {word}`" in page
        options = [of for of in command.params if isinstance(of, click.Option) and not of.hidden]
        assert [of.opts for of in options if not any(flag in page for flag in of.opts)] == []


@pytest.mark.parametrize(("package", "alias"), [(ffr_prep, "fp"), (ffr_dyn, "fd")])
def test_every_public_name_is_on_the_page(package, alias):
    page = doors.page(package, alias)
    named = set(re.findall(rf"^`{{4}}{{py:\w+}} {package.__name__}\.(\w+)", page, re.M))
    assert named == set(package.__all__) - {"__version__"}


def test_signatures_are_short_and_types_left_out():
    text = doors._signature(ffr_dyn.forward)
    assert text.startswith("(scene, *, end, output_step, method=None, start=0.0, stabilisation=...")
    assert "Integrator" not in text


# ---- pictures -------------------------------------------------------------------------------------------------------


def test_axes_of_a_picture_that_say_nothing_are_named(monkeypatch):
    """But for those that share what is along them with a panel that says it, and colour bars."""
    pytest.importorskip("sphinx_gallery")
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "extensions"))
    films = import_module("films")
    plt.close("all")
    figure, (upper, lower) = plt.subplots(2, 1, sharex=True)
    upper.set_ylabel("force [N]")
    lower.set_xlabel("time [s]")
    assert films.unlabelled() == ["the y axis"]
    lower.set_ylabel("error [N]")
    figure.colorbar(upper.scatter([0, 1], [0, 1], c=[0, 1]), ax=upper)
    assert films.unlabelled() == []
    plt.close("all")
