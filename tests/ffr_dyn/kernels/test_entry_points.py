"""Entry points: declared once, typed, and enough for a method of one's own."""

from __future__ import annotations

import importlib.util
import re
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators.rk4 import RK4
from ffr_dyn.kernels import integrator_api
from ffr_dyn.kernels.entry_points import evaluate, solve
from ffr_dyn.kernels.simd.entry_point import ENTRY_POINTS
from ffr_dyn.kernels.simd.table_address import Packed
from ffr_dyn.kernels.tables import Tables
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body


def test_numbers_follow_the_list():
    assert [entry.number for entry in ENTRY_POINTS.values()] == list(range(len(ENTRY_POINTS)))
    assert ENTRY_POINTS["evaluate"] is evaluate


def test_all_are_given_the_tables_first_and_forms_share_their_arguments():
    for entry in ENTRY_POINTS.values():
        assert entry.general.kinds[0][0] == Packed(Tables)
        assert all(form.kinds == entry.general.kinds for _, form in entry.forms)
    assert solve.forms


def example() -> str:
    """The method in the docstring of the interface."""
    return textwrap.dedent(
        re.search(r"\n\n(    @method_step\n.*?)\n\nThe state", integrator_api.__doc__ or "", re.S)[1]
    )


def written(folder: Path) -> Any:
    """Its compiled step."""
    names = ", ".join(integrator_api.__all__)
    path = folder / "euler.py"
    path.write_text(f"from ffr_dyn.kernels.integrator_api import {names}\n\n\n{example()}\n")
    spec = importlib.util.spec_from_file_location("euler", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.euler_step


def pendulum() -> Scene:
    bob = rigid_body(
        "bob", mass=1.0, inertia=np.eye(3) * 1e-3, points={"pivot": np.array([-1.0, 0.0, 0.0]), "centre": np.zeros(3)}
    )
    hinge = Joint("hinge", "revolute", "ground.O", "bob.pivot")
    return Scene((Body("bob", bob, position=(1.0, 0, 0)),), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))


def test_the_method_that_the_interface_shows_swings_a_pendulum(tmp_path):
    euler_step = written(tmp_path)

    @dataclass(frozen=True)
    class Euler:
        """Explicit Euler."""

        step: float
        numbers: ClassVar[tuple[float, ...]] = ()
        order: ClassVar[int] = 1
        implicit: ClassVar[bool] = False
        takes_forces: ClassVar[bool] = False
        reach: ClassVar[float] = 0.0
        controlled: ClassVar[bool] = False
        repeatable: ClassVar[bool] = False
        stage_count: ClassVar[int] = 1
        row_stages: ClassVar[int] = 0
        keeps_terms: ClassVar[bool] = False
        do_step: ClassVar[Any] = euler_step

    def end(method: Any) -> np.ndarray:
        run = integrate(pendulum(), end=0.2, output_step=0.1, method=method)
        return run["bob.centre.position"][-1]

    exact = end(RK4(1e-4))
    errors = [np.abs(end(Euler(h)) - exact).max() for h in (1e-3, 5e-4)]
    assert errors[0] < 5e-3
    assert 0.4 < errors[1] / errors[0] < 0.6
