"""Scenes of one structure share tables, each with its own numbers: no bit is that of another scene, no check is left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from test_same_structure import LINK, crank, four_bar, slider_crank

import ffr_dyn as fd
from ffr_dyn.analyses.checkpoint import leaves
from ffr_dyn.compile import scene_tables
from ffr_dyn.compile.engine import new_engine
from ffr_dyn.compile.scene_tables import System, compile_scene
from ffr_dyn.consistency.assemble import assemble, flat_form
from ffr_dyn.functions.time_functions import table
from ffr_dyn.kernels.simd.table_address import pack
from ffr_dyn.results.quantities import catalogue, selected
from ffr_dyn.scene.scene import Scene


def sprung(stiffness: float, joint: str = "knee", **other: float) -> Scene:
    """The slider-crank with a stiff spring and a stop on a joint: rows of forces, kinks, curves of their own."""
    spring = fd.JointSpring("coil", joint, stiffness=stiffness, damping=0.1)
    stop = fd.JointStop("end", "guide", 1e5, 1e-3, upper=2.0 + 1e-3 * stiffness, coordinate="stroke")
    return replace(slider_crank(**other), forces=(spring, stop))


def moved(values: tuple[float, ...]) -> Scene:
    """The slider-crank with a motor that follows a table."""
    rows = np.arange(len(values)) * 0.1
    return replace(slider_crank(), drivers=(fd.Driver("motor", "bearing", table(rows, np.array(values))),))


def geared(ratio: float) -> Scene:
    """Two wheels that turn with each other."""
    wheels = tuple(replace(fd.Body(name, crank()), position=(k, 0, 0)) for k, name in enumerate(("one", "two")))
    pins = tuple(fd.Joint(f"pin{k}", "revolute", f"ground.P{k}", f"{body.name}.hub") for k, body in enumerate(wheels))
    gears = (fd.Coupling("gears", "pin0.angle", "pin1.angle", ratio=ratio),)
    return Scene(wheels, pins, couplings=gears, ground={"P0": (0, 0, 0), "P1": (1, 0, 0)})


# By name: two scenes that differ in numbers alone.
PAIRS: dict[str, tuple[Callable[[], Scene], Callable[[], Scene]]] = {
    "motor and load": (slider_crank, lambda: slider_crank(speed=31.0, push=7.0)),
    "body": (slider_crank, lambda: slider_crank(length=0.21, mass=0.7)),
    "gravity": (slider_crank, lambda: slider_crank(gravity=(1.0, -1.0, 0))),
    "forces": (lambda: sprung(10.0), lambda: sprung(20.0, speed=3.0)),
    "table": (lambda: moved((0.0, 0.1, 0.3, 0.7)), lambda: moved((0.0, 0.2, 0.3, 0.5))),
    "coupling": (lambda: geared(-2.0), lambda: geared(-0.5)),
}  # fmt: skip


def compiled(scene: Scene) -> System:
    return compile_scene(flat_form(scene, 0.0).scene)


@pytest.mark.parametrize("name", PAIRS)
def test_scenes_that_differ_in_numbers_alone_are_of_one_structure(name):
    """Tables that are copied and filled are those that are made for the scene alone."""
    first, second = PAIRS[name]
    known, found = compiled(first()), compiled(second())
    assert found.structure is known.structure
    np.testing.assert_array_equal(found.words, pack(found.model))
    scene_tables._KNOWN.known.clear()
    alone = compiled(second())
    assert alone.structure is not found.structure
    differing = []
    for (where, of), (_, wanted), (_, other) in zip(
        *(leaves(system.model, "model") for system in (found, alone, known)), strict=True
    ):
        assert (of.dtype, of.shape, of.tobytes()) == (wanted.dtype, wanted.shape, wanted.tobytes()), where
        differing += [where] if of.tobytes() != other.tobytes() else []
    assert differing


OTHERS = {
    "a name": lambda: replace(
        slider_crank(), joints=(replace(slider_crank().joints[0], name="pivot"), *slider_crank().joints[1:]), drivers=()
    ),
    "another joint": lambda: replace(
        slider_crank(), joints=(*slider_crank().joints[:3], fd.Joint("guide", "cylindrical", "ground.O", "slider.pin",
                                                                     axis=(1, 0, 0)))
    ),
    "another marker": lambda: replace(slider_crank(), loads=(fd.Load("gas", "crank.pin", force=(-3.0, 0, 0)),)),
    "axes of the body": lambda: replace(
        slider_crank(), loads=(fd.Load("gas", "slider.pin", force=(-3.0, 0, 0), axes="body"),)
    ),
    "damping": lambda: replace(slider_crank(), bodies=tuple(replace(b, damping=0.1) for b in slider_crank().bodies)),
    "another flexible body": lambda: slider_crank(replace(LINK)),
    "a longer table": lambda: moved((0.0, 0.1, 0.2)),
    "in space": lambda: slider_crank(plane="none"),
    "a spring": lambda: sprung(10.0),
    "the spring on another joint": lambda: sprung(10.0, "wrist"),
}  # fmt: skip


def test_all_others_have_structures_of_their_own():
    systems = {name: compiled(make()) for name, make in {"plain": slider_crank, **OTHERS}.items()}
    assert len({id(system.structure) for system in systems.values()}) == len(systems)
    for system in systems.values():
        assert set(selected(system, ("*",))) == set(catalogue(system))


def test_rows_of_stiff_forces_have_memory_of_their_own():
    """Of a method that takes them, beside one that does not."""
    for stiffness in (10.0, 20.0):
        found = assemble(sprung(stiffness))
        for method in (fd.ROS2(1e-4), fd.RK4(1e-5), None):
            engine = new_engine(found.system, found.x, found.v, method)
            np.testing.assert_array_equal(engine.words, pack(engine.tables))
            assert engine.work.rows.Phi.size == engine.system.model.rows.kind.size


REFUSED = {
    "open": lambda: replace(four_bar(0.5), ground={"O": (0, 0, 0), "P": (9, 0, 0)}),
    "no value": lambda: replace(slider_crank(), drivers=(fd.Driver("motor", "bearing", "1 / t"),)),
    "not finite": lambda: slider_crank(push=np.inf),
    "across": lambda: slider_crank(gravity=(0, -9.81, 0.5), plane="z"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_used_is_refused_in_a_structure_that_is_known(name):
    def told() -> str:
        with pytest.raises(fd.InputError) as error:
            assemble(REFUSED[name]())
        return str(error.value)

    scene_tables._KNOWN.known.clear()
    alone = told()
    for scene in (slider_crank(), four_bar(0.5)):
        assemble(scene)
    assert told() == alone


def test_structures_are_limited_in_number_and_large_ones_are_not_kept(monkeypatch):
    monkeypatch.setattr(scene_tables._KNOWN, "most", 2)
    for k in range(5):
        compiled(replace(slider_crank(), joints=slider_crank().joints[: 4 - k % 4], drivers=()))
        assert len(scene_tables._KNOWN.known) <= 2
    monkeypatch.setattr(scene_tables, "LARGE", 10)
    scene_tables._KNOWN.known.clear()
    assert compiled(slider_crank()).structure is not compiled(slider_crank()).structure
    assert not scene_tables._KNOWN.known
