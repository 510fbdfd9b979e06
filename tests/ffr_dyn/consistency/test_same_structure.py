"""What scenes share with those before them changes no bit: bodies, ordered graphs, what crosses a plane; nothing stale."""

from __future__ import annotations

import copy
import gc
import os
import pickle
import subprocess
import sys
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_own_frames import rod
from test_turned_stiffening import FIXED

import ffr_dyn as fd
from ffr_dyn.analyses.checkpoint import fingerprint
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.closing.constraints import constraints_of, rows_at
from ffr_dyn.compile import elimination, row_tables, scene_tables
from ffr_dyn.compile.engine import new_engine
from ffr_dyn.consistency import across
from ffr_dyn.consistency.assemble import assemble, flat_form
from ffr_dyn.equations.constraint_rows import blocks_of
from ffr_dyn.equations.constraint_rows import rows_at as readable_rows
from ffr_dyn.equations.layout import initial_state, moved
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.kernels.simd.table_address import pack
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, constructors, remembered, rigid_body, save_body

LINK = rod(FIXED)


def crank(length: float = 0.15, mass: float = 0.2) -> FlexibleBody:
    points = {"hub": (0, 0, 0), "pin": (length, 0, 0)}
    return rigid_body("crank", mass=mass, inertia=(1e-4, 2e-4, 2e-4), points=points)


def slider_crank(
    link: FlexibleBody = LINK,
    *,
    length: float = 0.15,
    mass: float = 0.2,
    speed: float = 20.0,
    push: float = -3.0,
    **other,
) -> Scene:
    """A crank, a flexible link and a slider, with a motor and a force."""
    slider = rigid_body("slider", mass=1.0, inertia=(1e-3,) * 3, points={"pin": (0, 0, 0)})
    return Scene(
        (
            Body("crank", crank(length, mass)),
            Body("link", link, position=(length, 0, 0)),
            Body("slider", slider, position=(length + 1.2, 0, 0)),
        ),
        (
            fd.Joint("bearing", "revolute", "ground.O", "crank.hub"),
            fd.Joint("knee", "revolute", "crank.pin", "link.left"),
            fd.Joint("wrist", "revolute", "link.right", "slider.pin"),
            fd.Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
        ),
        (fd.Driver("motor", "bearing", polynomial(0.0, speed)),),
        loads=(fd.Load("gas", "slider.pin", force=(push, 0, 0)),),
        ground={"O": (0, 0, 0)},
        **{"gravity": (0, -9.81, 0), **other},
    )


def turned_link() -> Scene:
    """The link as a pendulum that swings in the plane across y."""
    hinge = fd.Joint("hinge", "revolute", "ground.O", "link.left", axis=(0, 1, 0))
    return Scene((Body("link", LINK),), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0, 0, -9.81))


def four_bar(angle: float) -> Scene:
    """A parallelogram of rigid bars, singular where it is flat (angle 0) and regular elsewhere."""
    bars = {name: rigid_body(name, mass=1.0, inertia=(0.1,) * 3, centre_of_mass=(0.5 * length, 0, 0),
                             points={"a": (0, 0, 0), "b": (length, 0, 0)})
            for name, length in (("left", 1.0), ("top", 2.0), ("right", 1.0))}  # fmt: skip
    end = np.array([np.cos(angle), np.sin(angle), 0.0])
    places = {"left": (0, 0, 0), "top": end, "right": (2, 0, 0)}
    turns = {"left": angle, "top": 0.0, "right": angle}
    ties = {
        "one": ("ground.O", "left.a"),
        "two": ("left.b", "top.a"),
        "three": ("top.b", "right.b"),
        "four": ("ground.P", "right.a"),
    }
    return Scene(
        tuple(Body(name, bar, position=places[name], rotation=(0, 0, turns[name])) for name, bar in bars.items()),
        tuple(fd.Joint(name, "revolute", *ends) for name, ends in ties.items()),
        ground={"O": (0, 0, 0), "P": (2, 0, 0)},
        gravity=(0, -9.81, 0),
    )


def softer(link: FlexibleBody) -> FlexibleBody:
    """The link with one number changed."""
    return replace(link, omega2=link.omega2 * np.append(0.9, np.ones(link.n - 1)))


# By name: scenes that have bodies, structures or numbers in common, one with another.
SCENES = {
    "plain": slider_crank,
    "faster": lambda: slider_crank(speed=31.0),
    "pushed": lambda: slider_crank(push=7.0),
    "longer": lambda: slider_crank(length=0.21),
    "heavier": lambda: slider_crank(mass=0.7),
    "softer": lambda: slider_crank(softer(LINK)),
    "damped": lambda: replace(
        slider_crank(), bodies=tuple(replace(b, damping=0.02) for b in slider_crank().bodies)
    ),
    "linear": lambda: replace(
        slider_crank(), bodies=tuple(replace(b, stiffening=False) for b in slider_crank().bodies)
    ),
    "fewer": lambda: fd.vary(slider_crank(), modes={"link": 3}),
    "dropped": lambda: fd.vary(slider_crank(), drop={"link": ["I9"]}),
    "aslant gravity": lambda: slider_crank(gravity=(0, -9.81, 0.5)),
    "in space": lambda: slider_crank(plane="none"),
    "no motor": lambda: replace(slider_crank(), drivers=()),
    "ball": lambda: replace(
        slider_crank(), joints=(*slider_crank().joints[:2], fd.Joint("wrist", "spherical", "link.right", "slider.pin"),
                                slider_crank().joints[3]),
    ),
    "across y": turned_link,
    "four-bar": lambda: four_bar(0.5),
    "four-bar, flat": lambda: four_bar(0.0),
}  # fmt: skip


def digest(scene: Scene) -> str:
    """Of all that assembly makes of a scene, and of a short run."""
    found = assemble(scene)
    run = fd.forward(scene, end=2e-3, output_step=1e-3, method=fd.ROS2(5e-4), check=False)
    histories = [run[name].tobytes() for name in run.quantities]
    rows = None if found.all_rows is None else found.all_rows.model
    said = found.notes, found.redundant, found.computed, found.degrees_of_freedom, run.attributes["notes"]
    return fingerprint(
        found.system.model, rows and fingerprint(rows), found.x.tobytes(), found.v.tobytes(), said, histories
    )


def forget() -> None:
    """As in a new process, but for what bodies remember."""
    for memory in (across._KNOWN, scene_tables._KNOWN):
        memory.known.clear()
    for function in (elimination._eliminated, row_tables._pattern, constructors._rigid):
        function.cache_clear()


def anew(scene: Scene) -> Scene:
    """The scene with bodies that remember nothing."""
    return replace(scene, bodies=tuple(replace(body, model=replace(body.model)) for body in scene.bodies))


@pytest.fixture(scope="module")
def alone() -> dict[str, str]:
    """Digests of all scenes, each by itself."""
    found = {}
    for name, make in SCENES.items():
        forget()
        found[name] = digest(anew(make()))
    return found


def test_the_scenes_differ(alone):
    assert len(set(alone.values())) == len(SCENES)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_scene_changes_a_bit_of_another_that_follows(alone, seed):
    """The same bodies in other structures, the same structures with other numbers, in any order and twice."""
    forget()
    order = [*SCENES, *SCENES]
    np.random.default_rng(seed).shuffle(order)
    for name in order:
        assert digest(SCENES[name]()) == alone[name], f"{name} after {order[: order.index(name)]}"


@pytest.mark.slow
def test_a_new_process_gives_the_same_bits(tmp_path):
    """A scene first in its process, and after others of its structure with other numbers."""
    save_body(LINK, tmp_path / "link.ffr")
    script = (
        "import sys\n"
        "import test_same_structure as t\n"
        "from ffr_prep.body import load_body\n"
        "link = load_body(sys.argv[1])\n"
        "for speed in map(float, sys.argv[2].split(',')):\n"
        "    print(t.digest(t.slider_crank(link, speed=speed, length=0.1 + speed / 1000)))\n"
    )
    first, *_ = printed(script, tmp_path / "link.ffr", "12")
    *_, last = printed(script, tmp_path / "link.ffr", "17,3,40,12")
    assert first == last


def printed(script: str, body: Path, speeds: str) -> list[str]:
    command = [sys.executable, "-c", script, str(body), speeds]
    known = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=600, env=known).stdout.split()


def test_what_crosses_a_plane_is_looked_at_once_for_scenes_that_say_the_same(monkeypatch):
    looked = []
    look = across._looked_at
    monkeypatch.setattr(across, "_looked_at", lambda rows: (looked.append(rows.scene.plane), look(rows))[1])
    forget()
    assemble(slider_crank())
    first = len(looked)
    assert first > 0
    for scene in (slider_crank(speed=3.0), slider_crank(push=9.0), slider_crank(mass=0.3)):
        assemble(scene)
    assert len(looked) == first
    assemble(slider_crank(length=0.2))
    assert len(looked) == 2 * first


@pytest.mark.parametrize("name", SCENES)
def test_compiled_rows_are_the_readable_ones(name, monkeypatch):
    """Values, rates, right-hand sides and Jacobians, as dense and as sparse matrices."""
    scene = flat_form(SCENES[name](), 0.3).scene
    blocks = blocks_of(scene)
    for few in (60, 0):
        monkeypatch.setattr("ffr_dyn.closing.constraints.FEW", few)
        rows, rng = constraints_of(scene, blocks, 0.3), np.random.default_rng(4)
        x, v = initial_state(scene, rows.place)
        for _ in range(2):
            x, v = moved(rows.place, x, 0.05 * rng.normal(size=v.size)), rng.normal(size=v.size)
            found, wanted = rows_at(rows, x, v), readable_rows(scene, rows.place, blocks, x, v, 0.3)
            J = found.J if few else found.J.toarray()
            np.testing.assert_allclose(found.Phi, [row.Phi for row in wanted], rtol=0, atol=1e-12)
            np.testing.assert_allclose(found.nu, [row.nu for row in wanted], rtol=0, atol=1e-10)
            np.testing.assert_allclose(found.gamma, [row.gamma for row in wanted], rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(J, [row.jacobian for row in wanted], rtol=1e-11, atol=1e-12)


# ---- what a body remembers -------------------------------------------------------------------------------------------


def test_a_body_remembers_what_was_made_of_it_and_no_copy_does():
    body, made = crank(), []
    for _ in range(3):
        assert remembered(body, "answer", lambda: (made.append(1), 42)[1]) == 42
    assert len(made) == 1
    for other in (replace(body), pickle.loads(pickle.dumps(body)), copy.deepcopy(body), crank(mass=0.25)):
        assert remembered(other, "answer", lambda: 43) == 43
    assert remembered(body, "another", lambda: 44) == 44


def test_equal_rigid_bodies_are_one_and_others_are_not():
    assert crank() is crank()
    assert crank(mass=0.3).mass == 0.3
    assert crank(length=0.2).interface("pin").position.tolist() == [0.2, 0.0, 0.0]
    below, above = (rigid_body("b", mass=1.0, inertia=(1, 1, 1), points={"p": (0, zero, 0)}) for zero in (-0.0, 0.0))
    assert np.signbit([below.interface("p").position[1], above.interface("p").position[1]]).tolist() == [True, False]


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)
@pytest.mark.parametrize("method", [None, fd.RK4(1e-4), fd.ROS2(1e-4), fd.DormandPrince()], ids=repr)
def test_memory_that_is_copied_says_where_it_is(make, method):
    """Copied words of tables are those of the tables: addresses, shapes, numbers."""
    found = assemble(make())
    for _ in range(2):
        engine = new_engine(found.system, found.x, found.v, method)
        np.testing.assert_array_equal(engine.words, pack(engine.tables))


def test_a_body_remembers_no_more_than_it_should():
    body = crank()
    for k in range(1000):
        assert remembered(body, k, lambda k=k: k) == k
    assert len(vars(body)["what follows"]) <= 64


def test_a_body_that_is_used_by_none_is_gone():
    """Neither what it remembers nor what is remembered of scenes keeps it."""
    link = replace(LINK)
    gone = weakref.ref(link)
    assemble(slider_crank(link))
    del link
    gc.collect()
    assert gone() is None


def test_a_scene_without_functions_is_gone_at_once():
    """Nothing of it refers to itself: its memory does not wait for the garbage collector."""
    gc.disable()
    try:
        scene = slider_crank()
        gone = weakref.ref(scene), weakref.ref(assemble(scene).system)
        integrate(scene, end=2e-3, output_step=1e-3, method=fd.ROS2(1e-4))
        del scene
        assert [ref() for ref in gone] == [None, None]
    finally:
        gc.enable()


# ---- results of which the rows are kept ------------------------------------------------------------------------------


def test_quantities_that_are_computed_when_asked_for_are_those_of_a_file(tmp_path):
    how = {
        "end": 0.01,
        "output_step": 1e-3,
        "method": fd.ROS2(2.5e-4),
        "outputs": ("default", "*.power", "*.orientation"),
    }
    now, later = fd.forward(slider_crank(), **how, path=tmp_path / "run.nc"), fd.forward(slider_crank(), **how)
    sent = pickle.loads(pickle.dumps(later))
    assert list(now.quantities) == list(later.quantities) == list(sent.quantities)
    assert now.attributes["errors"] == later.attributes["errors"]
    for name, quantity in now.quantities.items():
        for other in (later, sent):
            assert other[name].tobytes() == quantity.values.tobytes(), name
            assert (other.quantity(name).unit, other.quantity(name).axes) == (quantity.unit, quantity.axes)
    with pytest.raises(fd.InputError, match=r"no quantity 'slider\.pin\.place'"):
        later["slider.pin.place"]
    assert "nothing" not in later.quantities
