"""The shape of the project: which module may import which, what a start may load, and what a package contains."""

from __future__ import annotations

import ast
import fnmatch
import functools
import importlib.metadata
import importlib.util
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from places import ROOT

PACKAGES = ("ffr_prep", "ffr_dyn")
# What the dynamics may know of the preparation: the reduced body, and what both packages share.
DOOR = "ffr_prep.body"
SHARED = "ffr_prep.common"

# The floors of the house, from the ground up: a room imports from its own floor and from those below, never from above,
# and no two modules import each other, however late.
FLOORS = {
    "ffr_prep": (
        "common", "body", "solvers", "mesh", "model", "reduction", "solids", "structures", "matrices", "interchange",
        "report", "pipelines", "cli", "__main__",
    ),
    "ffr_dyn": (
        "functions", "scene", "variants", "equations", "kernels", "integrators", "compile", "closing", "results",
        "consistency", "linear", "pictures", "analyses", "realtime", "scene_file", "chart", "economy", "studies", "cli",
        "__main__",
    ),
}  # fmt: skip
MOST_FLAT, MOST_IN_A_FOLDER = 12, 20
LONGEST_FUNCTION, USUAL_FUNCTION = 60, 18  # lines: of any, of nine in ten
SCRIPTS = sorted([ROOT / "bootstrap.py", *(ROOT / "examples").glob("*.py"), *(ROOT / "benchmarks").glob("*.py")])
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

MESHERS_AND_PLOTTERS = {
    "dask",
    "gmsh",
    "imageio_ffmpeg",
    "matplotlib",
    "meshio",
    "pandas",
    "plotly",
    "pyNastran",
    "pyvista",
    "skfem",
    "vtk",
    "vtkmodules",
    "xarray",
}
HEAVY = {*MESHERS_AND_PLOTTERS, "PIL", "h5py", "numba", "pydantic", "scipy"}

# Modules of a distribution that another one, which is declared, cannot be without.
BROUGHT_BY = {"llvmlite": "numba", "pydantic_core": "pydantic", "vtkmodules": "pyvista"}
# What only the system's Python has, in processes of its own.
OF_THE_SYSTEM = {"petsc4py", "slepc4py"}


@dataclass(frozen=True)
class Import:
    """One imported name, as an absolute dotted name; deferred if it stands inside a function."""

    name: str
    deferred: bool


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


def imports(source: str, package: str) -> Iterator[Import]:
    """All imports of a module in `package`, wherever they stand; those for type checking only count as well."""
    tree = ast.parse(source)
    functions = [
        node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
    ]
    deferred = {id(inner) for function in functions for inner in ast.walk(function)}
    for node in ast.walk(tree):
        for name in names(node, package):
            yield Import(name, id(node) in deferred)


def names(node: ast.AST, package: str) -> list[str]:
    """The modules that a statement imports; `from a import b` means a.b where that is a module, and else a."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
    return [f"{base}.{alias.name}" if f"{base}.{alias.name}" in MODULES else base for alias in node.names]


@functools.cache
def imports_of(module: str) -> tuple[Import, ...]:
    path = MODULES[module]
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    return tuple(imports(path.read_text(encoding="utf-8"), package))


def top(name: str) -> str:
    return name.partition(".")[0]


def modules_of(package: str) -> list[str]:
    return [module for module in MODULES if top(module) == package]


# ---- reading imports ------------------------------------------------------------------------------------------------


def test_every_form_of_import_is_seen():
    source = """
import os.path, numpy as np
from ffr_prep import body
from . import vectors
from .. import scene
from ..functions import skew
def f():
    import gmsh
    from ffr_dyn.equations.state_view import StateView
class C:
    import plotly
"""
    found = {i.name: i.deferred for i in imports(source, "ffr_dyn.kernels")}
    at_once = [
        "os.path",
        "numpy",
        "ffr_prep.body",
        "ffr_dyn.kernels.vectors",
        "ffr_dyn.scene",
        "ffr_dyn.functions",
        "plotly",
    ]
    assert found == {**dict.fromkeys(at_once, False), "gmsh": True, "ffr_dyn.equations.state_view": True}


def test_the_inner_parts_of_numba_stay_behind_walls():
    used = {module: {i.name for i in imports_of(module)} for module in MODULES}
    inner = {m for m, names in used.items() if any(n.startswith("numba.") and n != "numba.extending" for n in names)}
    assert inner == {"ffr_dyn.kernels.simd.intrinsics", "ffr_prep.common.compile_cache"}
    below = {m for m, names in used.items() if top(m) == "ffr_dyn" and names & {"llvmlite", "numba.extending"}}
    assert below <= {module for module in MODULES if module.startswith("ffr_dyn.kernels.simd.")}


def test_the_modules_are_found():
    assert {
        DOOR,
        SHARED,
        "ffr_prep.cli",
        "ffr_dyn",
        "ffr_dyn.cli",
        "ffr_dyn.kernels",
        "ffr_dyn.analyses.forward",
    } <= set(MODULES)
    assert Import("ffr_prep.body", False) in imports_of("ffr_dyn.scene.scene")


# ---- who imports whom -----------------------------------------------------------------------------------------------


def intruders(package: str, foreign: str, allowed: set[str]) -> dict[str, set[str]]:
    """For each module of a package, what it imports from a foreign package and may not."""
    found = {m: {i.name for i in imports_of(m) if top(i.name) == foreign} - allowed for m in modules_of(package)}
    return {module: names for module, names in found.items() if names}


def modules_in(*rooms: str) -> set[str]:
    """The modules of rooms, the packages themselves included."""
    return {module for module in MODULES for room in rooms if module == room or module.startswith(f"{room}.")}


def test_the_dynamics_see_the_preparation_through_the_door_only():
    assert intruders("ffr_dyn", foreign="ffr_prep", allowed={DOOR} | modules_in(SHARED)) == {}
    assert "ffr_dyn.scene.scene" in intruders("ffr_dyn", foreign="ffr_prep", allowed=set())


def asked_kinds(source: str, kinds: set[str]) -> set[str]:
    """The kinds that `isinstance` is called with."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
            found |= {getattr(n, "id", getattr(n, "attr", "")) for n in ast.walk(node.args[1])} & kinds
    return found


def test_forces_are_asked_what_they_do_and_not_of_which_kind_they_are():
    """What depends on the kind of a force stands in its own file (`ffr_dyn.scene.forces.force`)."""
    import ffr_dyn.scene.forces  # noqa: F401 - which registers them
    from ffr_dyn.scene.force_kinds import FORCES

    kinds = {kind.__name__ for kind in FORCES}
    assert {"JointStop", "Bushing", "Load"} <= kinds
    assert asked_kinds("isinstance(f, JointStop | fd.Load) and isinstance(g, (int, Bushing))", kinds) == {
        "JointStop",
        "Load",
        "Bushing",
    }
    sources = {m: MODULES[m].read_text(encoding="utf-8") for m in modules_of("ffr_dyn") if "scene.forces" not in m}
    assert {m: asked for m, source in sources.items() if (asked := asked_kinds(source, kinds))} == {}


def test_the_preparation_knows_nothing_of_the_dynamics():
    assert intruders("ffr_prep", foreign="ffr_dyn", allowed=set()) == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_what_is_imported_from_the_project_exists(package):
    """A deferred import of a module that has gone is found before a user finds it."""
    assert intruders(package, foreign=package, allowed=set(MODULES)) == {}


def test_the_door_and_what_is_shared_need_numpy_and_the_standard_library_only():
    wanted = {top(i.name) for module in modules_in(DOOR) for i in imports_of(module)}
    assert wanted <= {"numpy", "ffr_prep", *sys.stdlib_module_names}
    inner = {i.name for module in modules_in(DOOR, SHARED) for i in imports_of(module) if top(i.name) in PACKAGES}
    assert inner <= modules_in(DOOR, SHARED)


# ---- the plan of the house ------------------------------------------------------------------------------------------


def graph() -> dict[str, set[str]]:
    """Who imports whom in the project, deferred imports and those for type checking included."""
    return {m: {i.name for i in imports_of(m) if i.name in MODULES and i.name != m} for m in MODULES}


def floor_of(module: str) -> tuple[str, int] | None:
    """Package and floor of a module; None for the package itself, the front door, which stands above all."""
    package, _, rest = module.partition(".")
    return (package, FLOORS[package].index(top(rest))) if rest else None


def test_every_room_has_its_floor():
    rooms = {package: {m.split(".")[1] for m in modules_of(package) if "." in m} for package in PACKAGES}
    assert {package: set(floors) for package, floors in FLOORS.items()} == rooms


def test_no_module_imports_another_that_imports_it():
    """No circle, deferred imports counted."""
    arrows = graph()
    assert sum(map(len, arrows.values())) > len(arrows)
    TopologicalSorter(arrows).prepare()


def test_arrows_run_down():
    up = []
    for module, wanted in graph().items():
        for other in wanted:
            here, there = floor_of(module), floor_of(other)
            if here and there and here[0] == there[0] and there[1] > here[1]:
                up.append(f"{module} -> {other}")
    assert up == []


def test_no_room_imports_a_door():
    """The doors `ffr_prep` and `ffr_dyn` stand above all rooms."""
    assert {module for module, wanted in graph().items() if wanted & set(PACKAGES)} == set()


def test_no_folder_is_a_warehouse():
    sizes = {path.parent: 0 for path in MODULES.values()}
    for path in MODULES.values():
        sizes[path.parent] += path.name != "__init__.py"
    assert {str(f): n for f, n in sizes.items() if n > (MOST_FLAT if f.parent == ROOT else MOST_IN_A_FOLDER)} == {}


def function_lengths() -> dict[str, int]:
    """Lines of every function of the packages, with decorators and docstring."""
    found = {}
    for module, path in MODULES.items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                found[f"{module}.{node.name}:{node.lineno}"] = node.end_lineno - node.lineno + 1
    return found


def test_functions_are_short():
    lengths = function_lengths()
    assert {name: n for name, n in lengths.items() if n > LONGEST_FUNCTION} == {}
    assert sorted(lengths.values())[len(lengths) * 9 // 10] <= USUAL_FUNCTION


# The comparison with another code, which the benchmarks' own libraries bring, is all that a test has of them.
OF_BENCHMARKS = {"test_against_exudyn.py"}


def test_files_of_tests_have_names_of_their_own():
    """pytest imports them by their names alone."""
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))


def test_tests_do_without_benchmarks():
    sources = {path: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")}
    named = {path: text for path, text in sources.items() if "benchmarks" in text}
    found = {path.name for path, text in named.items() for i in imports(text, "tests") if top(i.name) == "benchmarks"}
    assert found == OF_BENCHMARKS


# ---- what a start loads ---------------------------------------------------------------------------------------------


def loaded_by(statements: str) -> set[str]:
    """Names of all modules in a fresh interpreter that has run the statements."""
    code = f"import sys\n{statements}\nprint('modules:', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(done.stdout.rpartition("modules:")[2].split())


def libraries_of(modules: set[str]) -> set[str]:
    return {top(name) for name in modules}


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_loads_no_library(package):
    modules = loaded_by(f"import {package}")
    assert package in modules
    assert libraries_of(modules) & {*HEAVY, "numpy", "click"} == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_help_loads_no_heavy_library(package):
    """Help appears at once: what computes, meshes or draws is loaded by the command that needs it."""
    modules = loaded_by(
        f"import {package}.cli\nsys.argv = ['ffr', '--help']\ntry:\n  {package}.cli.main()\nexcept SystemExit: pass"
    )
    assert f"{package}.cli" in modules
    assert libraries_of(modules) & HEAVY == set()


def test_a_run_needs_no_mesher_and_no_plotter():
    """The dynamics run where the preparation's libraries are not installed."""
    modules = loaded_by(
        "import ffr_dyn.scene_file.read, ffr_dyn.analyses.forward, ffr_dyn.results.file, ffr_dyn.cli.progress_bar"
    )
    assert {m for m in modules if top(m) == "ffr_prep"} <= {"ffr_prep"} | modules_in(DOOR, SHARED)
    assert "numba" in modules
    assert libraries_of(modules) & MESHERS_AND_PLOTTERS == set()


def test_the_door_opens_with_numpy_alone():
    modules = loaded_by(f"import {DOOR}")
    assert "numpy" in modules
    assert libraries_of(modules) & {*HEAVY, "click"} == set()


# ---- what the project declares and contains -------------------------------------------------------------------------


def distribution_name(requirement: str) -> str:
    """The normalised name in a requirement such as "Scikit_Fem[all]>=10"."""
    return re.sub(r"[-_.]+", "-", re.split(r"[\s<>=!~;\[(]", requirement, maxsplit=1)[0]).lower()


def declared() -> set[str]:
    project = PROJECT["project"]
    optional = [
        requirement
        for extra in ("chart", "video", "nastran", "pardiso", "ida", "tables")
        for requirement in project["optional-dependencies"][extra]
    ]
    return {distribution_name(requirement) for requirement in [*project["dependencies"], *optional]}


def third_party() -> set[str]:
    """Top-level names of the libraries that the packages import."""
    names = {top(i.name) for module in MODULES for i in imports_of(module)}
    return {BROUGHT_BY.get(name, name) for name in names - set(sys.stdlib_module_names) - set(PACKAGES) - OF_THE_SYSTEM}


def test_every_library_is_declared_and_every_declared_one_is_used():
    extras = {
        "imageio_ffmpeg": ["imageio-ffmpeg"],
        "pyNastran": ["pyNastran"],
        "pypardiso": ["pypardiso"],
        "sksundae": ["scikit-sundae"],
        "dask": ["dask"],
        "pandas": ["pandas"],
        "xarray": ["xarray"],
    }
    owners = importlib.metadata.packages_distributions() | extras
    needed = {distribution_name(owners[name][0]) for name in third_party()}
    assert needed == declared()


def test_every_folder_of_modules_is_a_package_and_is_installed():
    find = PROJECT["tool"]["setuptools"]["packages"]["find"]
    folders = {path.parent for path in MODULES.values()}
    assert [folder for folder in folders if not (folder / "__init__.py").exists()] == []
    on_disk = {".".join(folder.relative_to(ROOT).parts) for folder in folders}
    assert {name for name in on_disk if any(fnmatch.fnmatch(name, pattern) for pattern in find["include"])} == on_disk


# What is neither a module nor the mark that says that types are given: parts of the page that shows films and scenes.
OF_A_PAGE = {f"ffr_dyn/pictures/web/{path.name}" for path in (ROOT / "ffr_dyn/pictures/web").iterdir()}


def test_the_packages_hold_modules_and_what_is_installed_with_them():
    """Anything else would be missing from an installed copy."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file()]
    others = [p.relative_to(ROOT).as_posix() for p in files if p.suffix != ".py" and "__pycache__" not in p.parts]
    assert set(others) <= {f"{package}/py.typed" for package in PACKAGES} | OF_A_PAGE
    data = PROJECT["tool"]["setuptools"]["package-data"]
    assert data == {"*": ["py.typed"], "ffr_dyn.pictures": ["web/*"]}
    assert {path.rpartition(".")[2] for path in OF_A_PAGE} == {"css", "html", "js"}


MACHINE = re.compile(
    r"(?<![\w.])/(home|Users|root|work|opt|tmp|mnt|srv)/\w"  # a folder of one machine
    r"|[A-Z]:\\\\?\w"
    r"|\blocalhost\b|\b\d{1,3}(\.\d{1,3}){3}\b"
    r"|https?://"  # the project fetches nothing: no module names a host
)


@pytest.mark.parametrize("text", ["/home/ann/x", '"/work/a"', r"C:\\data", "10.0.0.1", "http://a.b", "localhost"])
def test_names_of_machines_are_recognised(text):
    assert MACHINE.search(text)


@pytest.mark.parametrize("text", ["a/home/b", "m/s", "0.5.1", "out/work/x", "meshes/opt/x"])
def test_other_names_are_not(text):
    assert not MACHINE.search(text)


def test_no_module_names_a_machine():
    texts = {path: path.read_text(encoding="utf-8").splitlines() for path in [*MODULES.values(), *SCRIPTS]}
    found = [(str(path), line) for path, lines in texts.items() for line in lines if MACHINE.search(line)]
    assert found == []
