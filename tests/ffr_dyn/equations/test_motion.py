"""The equations of motion as on paper against the compiled ones: whole scenes, with all they may have."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_dyn_forces import PAIRS, SPREAD, loaded
from test_dyn_kernels import DRIVE, chain, random_state
from test_dyn_plane import slider_crank
from test_dyn_singular import bricard

import ffr_prep as fp
from ffr_dyn.closing.constraints import constraints_of, rows_at
from ffr_dyn.compile.engine import evaluate_at, new_engine, record_row
from ffr_dyn.compile.scene_tables import System, compile_scene
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import RELAXATION, assemble
from ffr_dyn.equations.constraint_rows import blocks_of
from ffr_dyn.equations.inertia import energies, kept_integrals
from ffr_dyn.equations.layout import layout, to_body_axes
from ffr_dyn.equations.motion import equations_of_motion, position_rates
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.kernels.tables import OK
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import KINDS
from ffr_dyn.scene.scene import INERTIA_TERMS, Body, Scene
from ffr_prep.model.material import Material
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

T = 0.37
FRAMES = {"axis": (0.2, 1.0, 0.3), "axis_j": (1.0, -0.5, 0.4)}


def stiffened(body, seed: int = 4):
    """The body in a mean-axis form, where its motions carry no momentum, with a second-order part of some hundredths."""
    K = np.random.default_rng(seed).normal(size=(12 + 6 * len(body.interfaces), body.n, body.n))
    K[:6] = 0.0
    rP = 0.5 * (body.rP_dm + body.rP_dm.swapaxes(0, 1))
    return replace(body, stiffening=1e-2 * (K + K.transpose(0, 2, 1)), P_dm=0.0 * body.P_dm, rP_dm=rP)


def assert_twins(system: System, t: float, x, v, *, rtol: float = 1e-9) -> None:
    """Rows, accelerations and multipliers of the compiled evaluation, against those on paper."""
    engine = new_engine(system, x, v)
    assert evaluate_at(engine, t, x, v) == OK
    work, twin = engine.work, equations_of_motion(system.scene, t, x, v, system.blocks)
    for name in ("Phi", "nu", "gamma"):
        given = np.array([getattr(row, name) for row in twin.rows])
        np.testing.assert_allclose(
            getattr(work.rows, name), given, rtol=0, atol=1e-11 * max(1.0, np.abs(given).max(initial=0))
        )
    for found, given in ((work.bodies.acc, twin.acceleration), (work.rows.lam, twin.lam)):
        np.testing.assert_allclose(found, given, rtol=0, atol=rtol * np.abs(given).max(initial=1e-3))


DRIVEN = {
    "angle": ("revolute", Driver("drive", "tie", DRIVE)),
    "stroke": ("translational", Driver("drive", "tie", DRIVE, coordinate="stroke")),
    "path": ("spherical", PointDriver("drive", "one.a", "two.a", x=DRIVE, y=None, z=0.3)),
}
LOADS = (
    Load("global", "one.b", (1, harmonic(amplitude=2, frequency=1), 3), (0, 1, 2)),
    Load("body", "two.b", (1, 2, 3), function=lambda t, state: [t, 1, 2, 3, 4, 5], axes="body"),
)


@cache
def cases() -> dict[str, Scene]:
    """A scene of everything there is to a scene; all in states at random, far off their joints."""
    found = {kind: chain(kind=kind, **FRAMES) for kind in KINDS}
    found |= {f"driven {name}": replace(chain(kind=kind), drivers=(driver,)) for name, (kind, driver) in DRIVEN.items()}
    found |= {name: loaded(force) for name, force in (PAIRS | SPREAD).items()}
    arms = replace(
        found["cylindrical"], joints=tuple(replace(j, kind="cylindrical") for j in found["cylindrical"].joints)
    )
    for first, second in (("root.angle", "tie.angle"), ("root.stroke", "tie.angle")):
        found[f"coupled {first} {second}"] = replace(
            arms, couplings=(Coupling("gear", first, second, -1.5, offset=0.2),)
        )
    found["loads"] = replace(chain(), loads=LOADS)
    shaken = (harmonic(amplitude=1, frequency=2), 0.0, 3.0)
    found["shaken base"] = replace(chain(), base_acceleration=shaken)
    found["no joint"] = replace(chain(), joints=())
    bodies = chain().bodies
    for term in INERTIA_TERMS:
        found[f"without {term}"] = replace(chain(), bodies=tuple(replace(body, dropped=(term,)) for body in bodies))
    return found


@pytest.mark.parametrize("scene", cases().values(), ids=cases())
def test_the_compiled_motion_is_the_one_on_paper(scene):
    for seed in (3, 8):
        assert_twins(compile_scene(scene), T, *random_state(scene, seed))


STIFFENED = ("revolute", "screw", "distance", "driven angle", "coupled root.angle tie.angle", "loads", "bushing",
             "curved spring", "servo", "pressure", "shaken base", "no joint")  # fmt: skip


@pytest.mark.parametrize("name", STIFFENED)
def test_of_second_order_bodies_too(name):
    """Moments of mass, places and rotations of what acts at interfaces: joints, drivers, couplings and forces."""
    scene = cases()[name]
    plain = scene
    scene = replace(scene, bodies=tuple(replace(body, model=stiffened(body.model)) for body in scene.bodies))
    x, v = random_state(scene)
    assert_twins(compile_scene(scene), T, x, v)
    twins = [equations_of_motion(one, T, x, v).acceleration for one in (plain, scene)]
    assert np.abs(twins[1] - twins[0]).max() > 1e-3 * np.abs(twins[0]).max()


@pytest.fixture(scope="module")
def knee():
    """A bent frame, of 24 coordinates, with second-order terms as a reduction makes them: those of fast modes are large."""
    places = {"a": (0.0, 0.0, 0.0), "b": (0.5, 0.0, 0.0), "c": (1.0, 0.3, 0.0)}
    member = Member(rectangle(0.01, 0.004), Material("steel", 2.1e11, 0.3, 7850.0), (0, 1, 0))
    frame = named(polyline(list(places.values()), member, elements=12), **places)
    model = fp.from_frame(frame, [fp.InterfaceRegion(place) for place in places])
    return fp.reduce(model, fp.Request(name="knee", reference=fp.MeanAxis(), reduction=fp.CraigBampton(12)))


@pytest.mark.parametrize("name", dict.fromkeys([*KINDS, *STIFFENED, *(f"driven {name}" for name in DRIVEN)]))
def test_of_reduced_bodies_whose_markers_turn(knee, name):
    """What fast modes have of second order does not hide what slow ones have: all modes have the same energy here."""
    scene = cases()[name]
    scene = replace(scene, bodies=tuple(Body(body.name, knee, damping=0.01) for body in scene.bodies))
    x, v = random_state(scene)
    place = layout(scene)
    for b in range(2):
        x[place.q(b)], v[place.q_dot(b)] = np.sign([x[place.q(b)], v[place.q_dot(b)]]) / np.sqrt(knee.omega2)
    system = compile_scene(scene)
    assert_twins(system, T, x, v)
    twin = np.array([row.jacobian for row in equations_of_motion(scene, T, x, v, system.blocks).rows])
    found = rows_at(constraints_of(scene, list(system.blocks), T), x, v).J
    np.testing.assert_allclose(found, twin.reshape(found.shape), rtol=0, atol=1e-11 * np.abs(twin).max(initial=1.0))


@pytest.mark.parametrize("plane", ["auto", "none"])
@pytest.mark.parametrize("stiffening", [False, True])
def test_in_the_plane_and_in_space(plane, stiffening):
    """A slider-crank in its plane has three coordinates a body; in space three of its rows depend on others."""
    assembled = assemble(replace(slider_crank(rod={"stiffening": stiffening}), plane=plane))
    system = assembled.system
    assert (system.scene.plane == "z") == (plane == "auto")
    assert_twins(system, 0.0, assembled.x, assembled.v, rtol=1e-6)
    if assembled.all_rows is not None:
        assert_twins(assembled.all_rows, 0.0, assembled.x, assembled.v, rtol=1e-6)


def test_of_dependent_rows_the_smallest_multipliers_are_given():
    """Bricard's mechanism: a row too many in every position."""
    assembled = assemble(bricard())
    rows = sum(len(block.words) for block in blocks_of(assembled.system.scene))
    assert assembled.all_rows is not None
    assert assembled.all_rows.model.rows.kind.size == rows == assembled.system.model.rows.kind.size + 1
    assert assembled.all_rows.model.relaxation == RELAXATION
    assert_twins(assembled.all_rows, 0.0, assembled.x, assembled.v, rtol=1e-6)


def test_euler_parameters_keep_their_length_and_turn_by_the_angular_velocity():
    scene = chain(0, 2)
    x, v = random_state(scene)
    system = compile_scene(scene)
    rates = position_rates(system.layout, x, v)
    for b in range(2):
        assert x[system.layout.p(b)] @ rates[system.layout.p(b)] == pytest.approx(0.0, abs=1e-14)
        assert 2 * np.linalg.norm(rates[system.layout.p(b)]) == pytest.approx(np.linalg.norm(v[system.layout.omega(b)]))


@pytest.mark.parametrize("name", ["revolute", "shaken base", "without I3", "without I8"])
def test_recorded_energies_are_those_on_paper(name):
    scene = cases()[name]
    x, v = random_state(scene)
    system = compile_scene(scene)
    place, engine, record = system.layout, new_engine(system, x, v), new_record(system, 1)
    assert record_row(engine, T, record, 0) == OK
    y, total = to_body_axes(place, x, v), np.zeros(3)
    for b, body in enumerate(scene.bodies):
        own = np.concatenate([y[place.rigid(b)], y[place.q_dot(b)]])
        R, A, integrals = x[place.R(b)], rotation_matrix(x[place.p(b)]), kept_integrals(body)
        total += energies(integrals, R, A, x[place.q(b)], own, scene.gravity)
    np.testing.assert_allclose(record.energy[0], total, rtol=1e-12)
