"""What the documentation shows must run."""

from __future__ import annotations

import ast
import re
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
import pytest
from places import ROOT
from synthetic import cloud
from test_dyn_stress import random_surface

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.cli import cli as dyn_cli
from ffr_dyn.results.file import load_result
from ffr_dyn.results.quantities import DEFAULT_OUTPUTS
from ffr_dyn.scene_file.read import load_scene
from ffr_prep.body import load_body, save_body
from ffr_prep.cli import cli as prep_cli
from ffr_prep.common.docstrings import blocks

DOORS = ("ffr_prep", "ffr_dyn")
ROOMS = ("docs", "docs/tutorials", "docs/howto")
PAGES = [f"{room}/{path.name}" for room in ROOMS for path in sorted((ROOT / room).glob("*.md"))]


def code(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.S)


@pytest.mark.parametrize("page", ["README.md", *PAGES])
def test_programs_use_the_front_doors_alone(page):
    """Everything else in the packages is private."""
    imports = [
        node
        for text in code(page, "python")
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    named = [
        name
        for node in imports
        for name in ([node.module or ""] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names])
    ]
    assert [name for name in named if name.partition(".")[0] in DOORS and name not in DOORS] == []
    assert [node for node in imports if isinstance(node, ast.ImportFrom) and node.module in DOORS] == []


SITE = [f"docs/{path.relative_to(ROOT / 'docs')}" for path in sorted((ROOT / "docs").rglob("*.md"))]
WRITTEN = [page for page in SITE if not page.startswith(("docs/made/", "docs/gallery/"))]


@pytest.mark.parametrize("page", WRITTEN)
def test_links_are_called_by_what_they_lead_to(page):
    """The site has titles, no files."""
    text = re.sub(r"^```.*?^```", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.S | re.M)
    assert re.findall(r"\[[^\]]*\.md`?\]\([^)]*\)", text) == []
    assert re.findall(r"docs/\w+\.md|[Tt]he site's page", text) == []


LONGEST_SENTENCE = 40  # words


def paragraphs(text: str) -> list[str]:
    """Of a page: without programs, tables, comments and formulas that stand alone."""
    text = re.sub(r"^```.*?^```|<!--.*?-->|\$\$.*?\$\$", "\n\n", text, flags=re.S | re.M)
    blocks = re.split(r"\n\s*\n|\n(?=[*-] |\d+\. |\||#)", text)
    return [" ".join(block.split()) for block in blocks if not block.startswith(("    ", "|", ":::"))]


def longest_sentence(paragraph: str, ends: str = ".!?…") -> str:
    """By its words; what stands between backticks is one, and letters and numbers of formulas are none."""
    text = re.sub(
        r"\b(al|eq|e\.g|Fig|i\.e|p|pp|vol)\.", r"\1", re.sub(r"\]\([^)]*\)", "]", re.sub(r"`[^`]*`", "code", paragraph))
    )
    return max(re.split(rf"[{ends}][*_\"’)\]]*\s+|\s[—–]\s", text), key=words)


def words(text: str) -> int:
    return len(re.findall(r"[^\W\d_]{2,}", text))


def test_sentences_are_counted_by_their_words():
    text = "A `b c` d (see [e](f.md)) is 2 x. Two sentences (e.g. this) are here."
    assert longest_sentence(text) == "Two sentences (e.g this) are here."
    assert words("A code [ab] is 2 x") == 3


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", *WRITTEN])
def test_sentences_of_pages_are_short(page):
    found = [longest_sentence(one) for one in paragraphs((ROOT / page).read_text(encoding="utf-8"))]
    assert [one for one in found if words(one) > LONGEST_SENTENCE] == []


@pytest.mark.parametrize("door", [fd, fp], ids=["fd", "fp"])
def test_sentences_of_docstrings_are_short(door):
    """Of all public names; in lists a semicolon ends one, too."""
    texts = [
        " ".join(text.split())
        for name in door.__all__
        for block in blocks(getattr(door, name).__doc__)
        for text in (block.values() if isinstance(block, dict) else [block])
        if not text.startswith((">>> ", "    "))
    ]
    found = [longest_sentence(text, ends=".!?…;:") for text in texts]
    assert [one for one in found if words(one) > LONGEST_SENTENCE] == []


def anchors(page: Path) -> set[str]:
    """What myst makes of the headings of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    headings = re.findall(r"^#+ (.*)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", WRITTEN)
def test_links_to_sections_of_other_pages_find_them(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for path, anchor in re.findall(r"\]\(([\w./]+\.md)#([^)]+)\)", text):
        assert anchor in anchors((ROOT / page).parent / path), f"{path}#{anchor}"


def printed(path: Path) -> list[str]:
    """Texts of a module that are no docstring."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = {ast.get_docstring(node, clean=False) for node in ast.walk(tree) if isinstance(node, documented)}
    constants = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    return [value for value in constants if isinstance(value, str) and value not in docstrings]


def helps(group: click.Group, name: str) -> list[str]:
    context = click.Context(group, info_name=name)
    commands = [group.get_command(context, word) for word in group.list_commands(context)]
    return [group.get_help(context), *(of.get_help(click.Context(of)) for of in commands if of)]


def test_what_is_printed_names_no_page_by_its_file():
    """Who has installed the package has no folder of pages."""
    modules = [path for package in DOORS for path in sorted((ROOT / package).rglob("*.py"))]
    texts = [text for path in modules for text in printed(path)]
    texts += helps(dyn_cli, "ffr-dyn") + helps(prep_cli, "ffr-prep")
    texts.append((ROOT / "docs" / "scene.schema.json").read_text(encoding="utf-8"))
    assert [text for text in texts if re.search(r"docs/\w+\.md", text)] == []


def test_the_scene_file_of_the_documentation_is_valid(tmp_path):
    text = code("docs/scene_file.md", "toml")[0].replace("big_eye", "a").replace("small_eye", "b")
    body = cloud(7)
    surface = random_surface(np.random.default_rng(1), n=body.n)  # with stress and section forces
    save_body(replace(body, surface=surface), tmp_path / "rod.ffr")
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    scene, settings = load_scene(tmp_path / "scene.toml")
    assert [i.name for i in scene.bodies[1].model.interfaces][-2:] == ["middle", "pivot"]
    assert [j.name for j in scene.joints] == ["main_bearing", "crank_pin", "slider_pin", "guide"]
    assert scene.bodies[1].model.n == 6
    assert settings.method.step == 1e-4


def test_the_default_outputs_of_the_documentation_are_those_of_the_program():
    marked = re.findall(r"^\| • (.*?) \|", (ROOT / "docs/scene_file.md").read_text(encoding="utf-8"), re.M)
    names = [name for line in marked for name in re.findall(r"`\w*(\.?\w*(?:\.\w+)?)`", line)]
    kept = {pattern.rpartition(".")[2] for pattern in DEFAULT_OUTPUTS}
    listed = {name.rpartition(".")[2] for name in names}
    assert kept - {"*"} <= listed


def test_the_readme_has_the_commands_that_set_everything_up():
    lines = [line.partition("#")[0].strip() for block in code("README.md", "sh") for line in block.splitlines()]
    assert lines[:2] == ["python3 bootstrap.py demo", "python3 bootstrap.py test"]


def test_the_python_example_of_the_readme_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    text = code("README.md", "python")[0].replace("end=2.0", "end=0.02")
    space: dict = {}
    exec(compile(text, "README", "exec"), space)
    assert space["result"]["rod.tip.position"].shape == (3, 3)
    assert (tmp_path / "pendulum.png").stat().st_size > 1000


@pytest.mark.slow
def test_the_main_job(tmp_path, monkeypatch):
    """The connecting rod example leaves everything it promises, and its numbers stay."""
    monkeypatch.setattr(sys, "argv", ["connecting_rod.py", str(tmp_path)])
    runpy.run_path(str(ROOT / "examples" / "connecting_rod.py"), run_name="__main__")
    made = {p.name for p in tmp_path.iterdir()}
    plots = {"slider_motion.png", "mid_rod_deflection.png", "reactions.png"}
    assert plots | {"rod.ffr", "result.nc", "motion.gif", "motion.html"} <= made
    rod = load_body(tmp_path / "rod.ffr")
    assert rod.mass == pytest.approx(0.688, abs=2e-3)
    result = load_result(tmp_path / "result.nc")
    last = result.time > 2 / 3 * result.time[-1]
    assert np.abs(result["rod.middle.displacement.y"][last]).max() == pytest.approx(7.84e-6, rel=0.01)
    assert np.abs(result["crank_pin.force"][last]).max() == pytest.approx(1.063e4, rel=0.01)
    first = result.time < 1 / 3 * result.time[-1]
    for name in ("rod.middle.displacement", "crank_pin.force"):  # it starts as it goes on
        assert np.abs(result[name][first]).max() == pytest.approx(np.abs(result[name][last]).max(), rel=1e-3)
    assert result["constraint.position"].max() < 1e-8
