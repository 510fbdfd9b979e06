"""A force and a joint of the user's, in a module of their own: known everywhere, with no other file touched."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.compile.engine import load_at, new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.equations.forces import applied
from ffr_dyn.equations.layout import initial_state, layout
from ffr_dyn.integrators import RK4
from ffr_dyn.kernels.simd.force_kernel import force_kernel, kernel_of
from ffr_dyn.kernels.tables import OK
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.force_kinds import FORCES
from ffr_dyn.scene.forces import JointSpring
from ffr_dyn.scene.joints import COORDINATES, KINDS, NEEDS
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.schema import schema
from ffr_dyn.scene_file.write import save_scene
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import load_plugin

MASS, STIFFNESS, FREE, GRAVITY = 2.0, 4e4, 0.2, 9.81

FILE = """
gravity = [9.81, 0, 0]
[analysis]
end = 0.4
output_step = 0.01
step = 1e-3
method = "rk4"
[ground]
slot = [0, 0, 0]
wall = [-0.2, 0, 0]
[bodies.block]
mass = "2 kg"
inertia = [0.1, 0.1, 0.1]
points = {pin = [0, 0, 0]}
position = [0.02, 0, 0]
omega_bar = [0, 0, 3]
[joints.guide]
kind = "pin-in-slot"
i = "ground.slot"
j = "block.pin"
axis = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
[forces.pull]
kind = "cubic-spring"
i = "ground.wall"
j = "block.pin"
stiffness = "40 kN/m^3"
free_length = "200 mm"
"""


def example() -> str:
    """The worked example of CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return text.partition("<!-- toy.py -->\n```python\n")[2].partition("```")[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The user's module, loaded, and a scene file that needs it."""
    folder = tmp_path_factory.mktemp("user")
    (folder / "toy.py").write_text(example(), encoding="utf-8")
    (folder / "scene.toml").write_text(FILE, encoding="utf-8")
    load_plugin(str(folder / "toy.py"))
    yield folder
    FORCES[:] = [kind for kind in FORCES if kind.word != "cubic-spring"]
    for table in (KINDS, COORDINATES, NEEDS):
        table.pop("pin-in-slot")
    sys.modules.pop(f"ffr_plugin:{(folder / 'toy.py').resolve()}")


@pytest.fixture(scope="module")
def scene(folder):
    return load_scene(folder / "scene.toml")[0]


def test_a_scene_file_knows_the_new_kinds(folder, scene):
    (force,) = scene.forces
    assert (force.stiffness, force.free_length) == (pytest.approx(STIFFNESS), pytest.approx(FREE))
    assert "CubicSpringEntry" in json.dumps(schema())
    again = load_scene(save_scene(*load_scene(folder / "scene.toml"), folder / "again.toml"))[0]
    assert again.forces == scene.forces


def test_units_and_mistakes_are_those_of_the_declaration(folder):
    wrong = folder / "wrong.toml"
    wrong.write_text(FILE.replace('"200 mm"', '"3 kg"'), encoding="utf-8")
    with pytest.raises(InputError, match="free_length"):
        load_scene(wrong)


@pytest.mark.slow
def test_its_kernel_equals_its_law(scene):
    system, place = compile_scene(scene), layout(scene)
    x, v = initial_state(scene, place)
    engine = new_engine(system, x, v)
    assert load_at(engine, 0.0, x, v) == OK
    (twin,) = applied(scene, place, 0.0, x, v)
    assert twin.force == pytest.approx(-STIFFNESS * 0.02**3)
    np.testing.assert_allclose(engine.work.bodies.f, twin.generalised, atol=1e-12)


@pytest.mark.slow
def test_energy_is_kept_and_accounted_for(scene):
    outputs = ("default", "*.power", "*.work", "energy.*", "pull.*")
    result = integrate(scene, end=0.4, output_step=0.01, method=RK4(5e-4), outputs=outputs)
    total = result["energy.total"] + result["energy.springs"]
    moved = np.ptp(result["energy.kinetic"])
    assert moved > 0.5
    assert np.ptp(total) < 1e-7 * moved
    stored = result["energy.springs"] - result["energy.springs"][0]
    np.testing.assert_allclose(result["pull.work"], -stored, atol=1e-6 * moved)
    stretch = result["pull.length"] - FREE
    np.testing.assert_allclose(result["pull.tension"], STIFFNESS * stretch**3, atol=1e-9)
    rate = result["block.pin.velocity"][:, 0]
    np.testing.assert_allclose(result["pull.power"], -result["pull.tension"] * rate, atol=1e-9)
    np.testing.assert_allclose(
        result["guide.angle"], 3.0 * result.time, atol=1e-9
    )  # the joint leaves the pin free to turn
    np.testing.assert_allclose(result["block.R"][:, 1:], 0.0, atol=1e-12)


@pytest.mark.slow
def test_equilibrium_and_small_vibration_have_their_closed_forms(scene):
    held = replace(scene, forces=(*scene.forces, JointSpring("hold", "guide", stiffness=5.0)))
    at = scene_at(held, static(held))
    stretch = (MASS * GRAVITY / STIFFNESS) ** (1 / 3)
    assert at.bodies[0].position[0] == pytest.approx(stretch, rel=1e-8)
    found = linearise(at)
    assert found.frequencies.max() == pytest.approx(np.sqrt(3 * STIFFNESS * stretch**2 / MASS) / (2 * np.pi), rel=1e-6)


@pytest.mark.slow
def test_the_command_runs_it_when_it_is_told_of_the_module(folder):
    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "ffr_dyn.cli", *arguments]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)

    scene, out = str(folder / "scene.toml"), folder / "out.nc"
    refused = run("run", scene, "-o", str(out))
    assert refused.returncode == 2
    assert "no kind 'cubic-spring'" in refused.stderr
    done = run("--plugin", str(folder / "toy.py"), "run", scene, "-o", str(out), "--keep", "energy.*")
    assert done.returncode == 0, done.stderr
    result = load_result(out)
    assert np.ptp(result["energy.total"] + result["energy.springs"]) < 1e-5


@pytest.mark.parametrize("name", ["nothing.py", "no_such_module"])
def test_a_plugin_that_does_not_exist_is_named(name):
    with pytest.raises(InputError, match=name):
        load_plugin(name)


def test_two_kinds_cannot_have_one_word(folder):
    second = Path(folder / "second.py")
    second.write_text(example().replace("class CubicSpring", "class Other"), encoding="utf-8")
    with pytest.raises(InputError, match="cubic-spring"):
        load_plugin(str(second))


def test_a_kernel_of_other_arguments_is_refused_before_it_is_called():
    def old(at, k, x, f, load):
        return OK

    for wrong in (old, force_kernel(old)):
        with pytest.raises(InputError, match="old"):
            kernel_of(wrong)
