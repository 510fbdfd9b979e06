"""The examples of the site's gallery: short, with a title, a source and a check. The build of the site runs them."""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize

import pytest
from places import ROOT

GALLERY = ROOT / "examples" / "gallery"
EXAMPLES = sorted(GALLERY.glob("*/plot_*.py"))
MOST_LINES = 25
ALLOWED = {"ffr_prep", "ffr_dyn", "numpy", "scipy", "matplotlib", "skfem", "pandas", "xarray", "h5py"}
SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}

pytestmark = pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)


def lines_of_code(text: str) -> int:
    """Lines with code on them: no blank ones, comments, or the docstring."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    used = {line for t in tokens if t.type not in SILENT for line in range(t.start[0], t.end[0] + 1)}
    first = ast.parse(text).body[0]
    return len(used - set(range(first.lineno, first.end_lineno + 1)))


def imported(tree: ast.Module) -> set[str]:
    names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    return {*names, *(node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))}


def test_an_example_is_short(path):
    assert lines_of_code(path.read_text(encoding="utf-8")) <= MOST_LINES


def test_an_example_has_a_title_and_names_the_source_of_its_number(path):
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    title, line, *rest = said.splitlines()
    assert set(line) == {"="}
    assert len(line) == len(title)
    assert re.search(r"^Sources?\b", "\n".join(rest), re.M)


def test_an_example_ends_with_its_check(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert isinstance(tree.body[-1], ast.Assert)


def test_an_example_uses_the_front_doors_alone(path):
    found = imported(ast.parse(path.read_text(encoding="utf-8")))
    top = {name.partition(".")[0] for name in found}
    assert top - sys.stdlib_module_names <= ALLOWED
    assert {name for name in found if name.startswith(("ffr_prep.", "ffr_dyn."))} == set()
