"""Power balance of the examples: the work of all forces and drivers is the change of energy, to the integration tolerance."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.scene import Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_prep.body import save_body
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton

EXAMPLES = ROOT / "examples"


def connecting_rod(folder: Path) -> tuple[Scene, float]:
    """The scene of the example, and its step [s]."""
    sys.path.insert(0, str(EXAMPLES))
    try:
        import connecting_rod as example
    finally:
        sys.path.remove(str(EXAMPLES))
    return example.slider_crank(example.reduced_rod()), 2 * np.pi / example.SPEED / 4800


def pendulum(folder: Path) -> tuple[Scene, float]:
    """The scene file, with the body that its heading makes."""
    body = fp.reduce(
        fp.from_mesh(
            read_mesh(ROOT / "meshes" / "pendulum.geo"),
            Material("strip", E=7e10, nu=0.3, rho=5540),
            [InterfaceRegion("hinge"), InterfaceRegion("tip")],
        ),
        fp.Request(name="pendulum", reference=SimplySupported("hinge", "tip"), reduction=CraigBampton(8)),
    )
    (folder / "out" / "pendulum").mkdir(parents=True)
    (folder / "examples").mkdir()
    save_body(body, folder / "out" / "pendulum" / "pendulum.ffr")
    shutil.copy(EXAMPLES / "pendulum.toml", folder / "examples")
    scene, settings = load_scene(folder / "examples" / "pendulum.toml")
    return scene, settings.method.step


SCENES = {"connecting_rod.py": connecting_rod, "pendulum.toml": pendulum}


def test_every_example_with_a_motion_is_here():
    files = [path for path in EXAMPLES.iterdir() if path.suffix in (".py", ".toml")]
    assert {path.name for path in files if "forward(" in (text := path.read_text()) or "[analysis]" in text} == {
        *SCENES
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_work_is_the_change_of_energy(name, tmp_path):
    """At the example's own step, and at the second order of ROS2 with half of it."""
    scene, step = SCENES[name](tmp_path)
    errors = []
    for h in (step, step / 2):
        result = integrate(
            scene, end=400 * step, output_step=20 * step, method=ROS2(h), outputs=("*.work", "*.power", "energy.*")
        )
        works = {name.removesuffix(".work"): result[name] for name in result.quantities if name.endswith(".work")}
        assert {f"{name}.power" for name in works} == {name for name in result.quantities if name.endswith(".power")}
        change = result["energy.total"] - result["energy.total"][0]
        largest = max(np.abs(values).max() for values in (result["energy.kinetic"], *works.values()))
        errors.append(np.abs(change - sum(works.values())).max() / largest)
    assert errors[0] < 5e-6
    assert errors[1] < errors[0] / 3
