"""What is published: one version and one list of dependencies everywhere; a wheel that works in a bare environment."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from places import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = ROOT / "recipe" / "recipe.yaml"
OTHER_NAMES = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}  # of conda-forge
SCENE = """
gravity = [0, -9.81, 0]
[analysis]
end = 0.1
output_step = 0.01
step = 1e-3
[ground]
wall = [0, 0, 0]
[bodies.rod]
mass = 1.0
inertia = [1e-4, 0.1, 0.1]
points = {pin = [-0.5, 0, 0]}
position = [0.5, 0, 0]
[joints.hinge]
kind = "revolute"
i = "ground.wall"
j = "rod.pin"
"""
PROGRAM = """
import ffr_dyn as fd, ffr_prep as fp
member = fp.Member(fp.circle(0.02), fp.material("steel"))
frame = fp.named(fp.polyline([(0, 0, 0), (1, 0, 0)], member, elements=4), root=(0, 0, 0))
model = fp.from_frame(frame, [fp.InterfaceRegion("root")])
body = fp.reduce(model, fp.Request(name="beam", reference=fp.FixedTo("root"), reduction=fp.Eigenmodes(2)))
EI = 2.1e11 * 3.14159265 * 0.01**4 / 4
assert abs(body.omega2[0] ** 0.5 / (1.87510407**2 * (EI / body.mass) ** 0.5) - 1) < 0.05
print(fp.__file__)
"""
TABLE = """
import ffr_dyn as fd
result = fd.load_result("swing.nc")
try:
    print(len(result.to_pandas()), result.to_xarray().sizes["time"])
except fd.InputError as error:
    print(error)
"""


def bounds(dependencies: list[str]) -> dict[str, str]:
    """Name -> the rest of a requirement."""
    return {re.split(r"[\[<>= ]", text)[0]: re.sub(r"^[\w-]+(\[\w+\])? ?", "", text) for text in dependencies}


def test_the_version_is_the_same_everywhere():
    version = PROJECT["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f'\n  version: "{version}"\n' in RECIPE.read_text(encoding="utf-8")
    assert f"## {version} " in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_recipe_and_the_oldest_versions_are_those_of_the_project():
    wanted = bounds(PROJECT["dependencies"])
    needed = RECIPE.read_text(encoding="utf-8").partition("  run:\n")[2].partition("\ntests:")[0]
    run = bounds(re.findall(r"^    - (.*)$", needed, re.M))
    assert run.pop("python") == PROJECT["requires-python"]
    assert run == {OTHER_NAMES.get(name, name): bound for name, bound in wanted.items()}
    lines = (ROOT / "constraints-oldest.txt").read_text(encoding="utf-8").splitlines()
    oldest = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert {name: f">={version}" for name, version in oldest.items()}.keys() == wanted.keys()
    for name, version in oldest.items():
        assert (version + ".0").startswith(re.findall(r">=([\d.]+)", wanted[name])[0])


def test_the_recipe_is_rendered():
    """By the program that builds it; without a network nothing is looked up."""
    stage0, variants = (pytest.importorskip(f"rattler_build.{name}") for name in ("stage0", "variant_config"))
    recipe = stage0.Stage0Recipe.from_file(str(RECIPE))
    (made,) = recipe.render(variants.VariantConfig({}))
    package = made.recipe.to_dict()["package"]
    assert package == {"name": PROJECT["name"], "version": PROJECT["version"]}


# ---- slow: from a wheel, outside the checkout -----------------------------------------------------------------------


def run(*command: object, cwd: Path) -> str:
    """What a command prints; the packages of the checkout are not on its path."""
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder of the wheel and the source distribution."""
    pytest.importorskip("build")
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--outdir", folder, ROOT, cwd=folder)
    return folder


@pytest.mark.slow
def test_the_distributions_hold_what_they_should(made):
    (wheel,), (source,) = made.glob("*.whl"), made.glob("*.tar.gz")
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names if ".dist-info" not in name} == {
        "ffr_prep",
        "ffr_dyn",
        "ffr_gallery",
    }
    assert "ffr_dyn/py.typed" in names
    assert [name for name in names if name.startswith("ffr_dyn/pictures/web/")]
    with tarfile.open(source) as packed:
        inside = {name.partition("/")[2] for name in packed.getnames()}
    for path in (
        "bootstrap.py",
        "docs/conf.py",
        "tests/places.py",
        "examples/gallery/mechanisms/plot_pendulum.py",
        "LICENSE",
    ):
        assert path in inside
    assert [name for name in inside if name.startswith(("docs/made", "docs/gallery", "build/"))] == []


VERSIONS = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["classifiers"]))
OLDEST = f"{VERSIONS[0]} with the oldest libraries"


def interpreter(version: str) -> str:
    """The Python of that version; a skip where it is not here."""
    for found in (shutil.which(f"python{version}"), sys.executable):
        asked = [found, "-c", "import ensurepip, sys; print('%d.%d' % sys.version_info[:2])"]
        if found and subprocess.run(asked, capture_output=True, text=True).stdout.strip() == version:
            return found
    pytest.skip(f"no Python {version} here")


@pytest.fixture(scope="module", params=[*VERSIONS, OLDEST])
def bare(request, made, tmp_path_factory):
    """Folder of the programs of an environment with the wheel and what it needs."""
    (wheel,) = made.glob("*.whl")
    folder = tmp_path_factory.mktemp("bare")
    oldest = ("-c", ROOT / "constraints-oldest.txt") if request.param == OLDEST else ()
    run(interpreter(request.param.partition(" ")[0]), "-m", "venv", folder, cwd=folder)
    run(folder / "bin" / "python", "-m", "pip", "install", "--quiet", *oldest, wheel, cwd=folder)
    return folder / "bin"


@pytest.mark.slow
def test_the_wheel_works_in_a_bare_environment(bare, tmp_path):
    (tmp_path / "swing.toml").write_text(SCENE, encoding="utf-8")
    for command in ("ffr-prep", "ffr-dyn"):
        assert PROJECT["version"] in run(bare / command, "--version", cwd=tmp_path)
    run(bare / "ffr-dyn", "run", "swing.toml", "-o", "swing.nc", cwd=tmp_path)
    assert "hinge.force" in run(bare / "ffr-dyn", "info", "swing.nc", cwd=tmp_path)
    run(bare / "ffr-dyn", "plot", "swing.nc", "hinge.force", "-o", "force.png", cwd=tmp_path)
    run(bare / "ffr-dyn", "animate", "swing.nc", "-o", "film.html", cwd=tmp_path)
    found = run(bare / "python", "-c", PROGRAM, cwd=tmp_path).strip()
    assert found.startswith(str(bare.parent))


@pytest.mark.slow
def test_extras_come_with_the_wheel(made, bare, tmp_path):
    """Without them a result says what it lacks; with them it is a table."""
    (wheel,) = made.glob("*.whl")
    (tmp_path / "swing.toml").write_text(SCENE, encoding="utf-8")
    run(bare / "ffr-dyn", "run", "swing.toml", "-o", "swing.nc", cwd=tmp_path)
    assert "pip install pandas" in run(bare / "python", "-c", TABLE, cwd=tmp_path)
    run(bare / "python", "-m", "pip", "install", "--quiet", f"{wheel}[tables]", cwd=tmp_path)
    assert run(bare / "python", "-c", TABLE, cwd=tmp_path).split() == ["11", "11"]
