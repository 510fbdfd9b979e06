"""The front door `import ffr_dyn as fd`: one table of names, all of which resolve, and none of which a room hides."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib.metadata import version

import pytest
from places import ROOT

import ffr_dyn as fd
from ffr_dyn.analyses.registry import LISTED
from ffr_dyn.integrators import methods

HOME = {name: module for module, names in fd._BY_MODULE.items() for name in names.split()}
SOURCE = ast.parse((ROOT / "ffr_dyn" / "__init__.py").read_text(encoding="utf-8"))


def names_for_checkers() -> dict[str, str]:
    """Name -> module of the imports that are read by checkers of types only."""
    block = next(node for node in SOURCE.body if isinstance(node, ast.If))
    return {
        alias.asname: node.module for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }


def test_table_exports_and_imports_for_checkers_are_the_same():
    assert names_for_checkers() == HOME
    assert set(fd.__all__) == {"__version__", *HOME}
    assert len(fd.__all__) == len(set(fd.__all__))
    assert dir(fd) == sorted(fd.__all__)


@pytest.mark.parametrize("name", HOME)
def test_every_name_resolves_and_says_what_it_is(name):
    found = getattr(fd, name)
    assert found.__doc__
    assert not isinstance(found, type(sys))


def test_no_name_is_that_of_a_room():
    """The import of a room sets an attribute of its name."""
    rooms = {path.name.removesuffix(".py") for path in (ROOT / "ffr_dyn").iterdir()}
    assert rooms & set(fd.__all__) == set()


def test_version_is_that_of_the_distribution():
    assert fd.__version__ == version("ffr")


def test_a_name_that_is_not_there_is_answered_with_the_nearest():
    with pytest.raises(AttributeError, match="did you mean 'forward'"):
        fd.foward  # noqa: B018 - the attribute is the test
    assert not hasattr(fd, "__wrapped__")


def test_a_name_loads_its_room_alone():
    code = (
        "import sys, ffr_dyn as fd; fd.Joint; print(*(m in sys.modules for m in ('numba', 'h5py', 'ffr_dyn.analyses')))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"] * 3


# ---- the pages use the door alone -----------------------------------------------------------------------------------

ALLOWED = {"import ffr_dyn as fd", "import ffr_prep as fp", "from dask_jobqueue import SLURMCluster"}
PAGES = (
    "analyses",
    "chart",
    "economy",
    "forces",
    "integrators",
    "realtime",
    "rotating",
    "scene_file",
    "stress",
    "studies",
)


@pytest.mark.parametrize("page", PAGES)
def test_pages_use_the_door_alone(page):
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    for block in re.findall(r"```python\n(.*?)```", text, re.S):
        imported = [node for node in ast.walk(ast.parse(block)) if isinstance(node, ast.Import | ast.ImportFrom)]
        assert {ast.unparse(node) for node in imported} <= ALLOWED
    assert {name for name in re.findall(r"\bfd\.(\w+)", text) if name not in fd.__all__} == set()


def test_pages_name_every_analysis_and_method():
    analysed, integrated = ((ROOT / "docs" / f"{page}.md").read_text() for page in ("analyses", "integrators"))
    assert [word for word in LISTED if f"`ffr-dyn {word}`" not in analysed] == []
    assert [name for name, made in methods().items() if f"| `{name}` `{made.__name__}` |" not in integrated] == []
