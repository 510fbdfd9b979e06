"""The front door `import ffr_prep as fp`: one table of names, which static checkers see as well, loaded one by one."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib.metadata import version
from types import ModuleType

import pytest
from places import ROOT

import ffr_prep as fp
from ffr_prep.common.front_door import front_door

HOME = {name: module for module, names in fp._BY_MODULE.items() for name in names.split()}


def names_for_checkers() -> dict[str, str]:
    """Name -> module of the imports that only checkers of types read."""
    source = ast.parse((ROOT / "ffr_prep" / "__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in source.body if isinstance(node, ast.If))
    return {
        alias.asname: node.module for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }


def test_table_exports_and_imports_for_checkers_are_the_same():
    assert names_for_checkers() == HOME
    assert sorted(fp.__all__) == sorted(["__version__", *HOME]) == dir(fp)
    assert sum(len(names.split()) for names in fp._BY_MODULE.values()) == len(HOME)


@pytest.mark.parametrize("name", HOME)
def test_every_name_is_what_it_says_and_explains_itself(name):
    found = getattr(fp, name)
    assert found.__doc__
    assert not isinstance(found, ModuleType)
    assert found.__name__ == name
    assert found.__module__.partition(".")[0] == "ffr_prep"


def test_no_name_is_that_of_a_room():
    """The import of a room sets an attribute of its name."""
    assert {path.name.removesuffix(".py") for path in (ROOT / "ffr_prep").iterdir()} & set(fp.__all__) == set()


def test_the_version_is_that_of_the_distribution():
    assert fp.__version__ == version("ffr")


def test_a_name_that_is_not_there_is_answered_with_the_nearest():
    with pytest.raises(AttributeError, match="no attribute 'read_mehs'; did you mean 'read_mesh'"):
        fp.read_mehs  # noqa: B018 - the attribute is the test
    with pytest.raises(AttributeError, match=r"dir\(ffr_prep\) lists what there is"):
        front_door("ffr_prep", {})[1]("xyz")
    assert not hasattr(fp, "__path_hooks__")


def test_a_name_loads_its_room_alone():
    code = "import sys, ffr_prep as fp; fp.Material; print(*(m in sys.modules for m in ('scipy', 'ffr_prep.mesh')))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_the_docstring_names_what_there_is():
    """Every name in backticks in the help is a name of the door."""
    words = {word.partition("(")[0] for word in fp.__doc__.split("`")[1::2]}
    assert {"reduce", "from_mesh", "CraigBampton"} <= words
    assert {word for word in words if word.isidentifier()} <= {"dir", "help", *fp.__all__}
