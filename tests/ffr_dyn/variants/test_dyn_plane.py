"""Planar scenes: found, declared, and equal to the same scene computed in space."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble, flat_form, flattened
from ffr_dyn.functions.formula import parse
from ffr_dyn.functions.rotation import euler_parameters, rotation_matrix
from ffr_dyn.functions.time_functions import constant, harmonic, polynomial
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.state_formula import StateFormula
from ffr_dyn.variants.variant import with_basis
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

ALUMINIUM = Material("aluminium", E=7e10, nu=0.3, rho=2700.0)


def rod(name: str, length: float, *, stiffening: bool = False):
    """A flexible rod along x in the plane z = 0, higher than wide so that no frequencies coincide."""
    member = Member(rectangle(0.013, 0.02), ALUMINIUM, orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (length, 0, 0)], member, elements=6), a=(0, 0, 0), b=(length, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(name=name, reference=SimplySupported("a", "b"), reduction=CraigBampton(6), linear=not stiffening),
    )


def slider_crank(**changes) -> Scene:
    crank = rigid_body(
        "crank", mass=0.5, inertia=(1e-4, 5e-4, 5e-4), centre_of_mass=(0.05, 0, 0),
        points={"o": (0, 0, 0), "pin": (0.1, 0, 0)},
    )  # fmt: skip
    block = rigid_body("block", mass=0.4, inertia=(1e-4, 1e-4, 1e-4), points={"pin": (0, 0, 0)})
    parts = {
        "bodies": (
            Body("crank", crank),
            Body("rod", rod("rod", 0.3, **changes.pop("rod", {})), position=(0.1, 0, 0), damping=0.01),
            Body("block", block, position=(0.4, 0, 0)),
        ),
        "joints": (
            Joint("main", "revolute", "ground.O", "crank.o"),
            Joint("big", "revolute", "crank.pin", "rod.a"),
            Joint("small", "revolute", "rod.b", "block.pin"),
            Joint("guide", "translational", "ground.O", "block.pin", axis=(1.0, 0, 0)),
        ),
        "drivers": (Driver("motor", "main", polynomial(0.3, 40.0)),),
        "loads": (Load("push", "block.pin", force=(harmonic(amplitude=30.0, frequency=9.0), 0, 0)),),
        "springs": (SpringDamper("spring", "ground.P", "block.pin", stiffness=900.0, free_length=0.5),),
        "ground": {"O": (0, 0, 0), "P": (1.0, 0, 0)},
        "gravity": (0, -9.81, 0),
    }
    return Scene(**parts | changes)


@pytest.mark.parametrize("method", [RK4(5e-6), ROS2(5e-5)])
@pytest.mark.parametrize("stiffening", [False, True])
def test_motion_and_reactions_equal_the_spatial_ones(method, stiffening):
    scene = slider_crank(rod={"stiffening": stiffening})
    runs = [
        integrate(replace(scene, plane=plane), end=0.02, output_step=0.001, method=method) for plane in ("auto", "none")
    ]
    planar, spatial = runs
    assert any("planar" in note for note in planar.attributes["notes"])
    assert not any("planar" in note for note in spatial.attributes["notes"])
    across = ~planar["rod.q"].any(axis=0)
    assert 0 < across.sum() < across.size
    deflection = np.abs(spatial["rod.q"]).max()
    last_bits = (
        4 * np.finfo(float).eps * scene.bodies[1].model.size * np.sqrt(scene.bodies[1].model.mass)
    )  # of lengths, in q
    np.testing.assert_allclose(planar["rod.q"], spatial["rod.q"], rtol=0, atol=1e-10 * deflection + last_bits)
    rounding = {"rod.a.displacement": np.finfo(float).eps * np.abs(spatial["rod.b.displacement"]).max()}
    for name in ("rod.b.position", "block.R", "rod.a.displacement", "rod.omega_bar", "crank.p"):
        if max(np.abs(run[name]).max() for run in runs) < rounding.get(name, 0.0):
            continue  # both are zero on the scale of their kind: what is left of the end that the frame is fixed to
        np.testing.assert_allclose(planar[name], spatial[name], rtol=0, atol=1e-10 * np.abs(spatial[name]).max())
    for name in ("motor.moment", "main.force", "big.force", "small.force", "guide.force", "guide.moment"):
        np.testing.assert_allclose(planar[name], spatial[name], rtol=0, atol=1e-7 * np.abs(spatial["big.force"]).max())
    np.testing.assert_allclose(planar["energy.total"], spatial["energy.total"], rtol=1e-9)


def test_a_planar_body_has_three_coordinates_and_no_redundancy_is_invented():
    """A loop of rigid bodies in revolute joints is three times redundant in space, and not in the plane."""
    scene = slider_crank()
    ends = {"a": np.zeros(3), "b": np.array([0.3, 0, 0])}
    stiff = rigid_body("rod", mass=0.2, inertia=(1e-4, 2e-3, 2e-3), centre_of_mass=(0.15, 0, 0), points=ends)
    bodies = (scene.bodies[0], Body("rod", stiff, position=(0.1, 0, 0)), scene.bodies[2])
    planar, spatial = (assemble(replace(scene, bodies=bodies, plane=plane)) for plane in ("auto", "none"))
    assert sum("redundant" in note for note in spatial.notes) == 3
    assert not any("redundant" in note for note in planar.notes)
    assert planar.degrees_of_freedom == spatial.degrees_of_freedom == 0
    kept = {block.name: len(block.words) for block in planar.system.blocks}
    assert kept == {"main": 2, "big": 2, "small": 2, "guide": 2, "motor": 1}


@pytest.mark.parametrize("turn", [(0, 0, 0), (np.pi / 2, 0, 0), (0, np.pi / 2, 0)])
def test_the_plane_may_be_any_of_the_three(turn):
    """The scene turned as a whole, gravity too."""
    A = rotation_matrix(euler_parameters(turn, "turn"))
    scene = slider_crank(loads=(), springs=())
    bodies = tuple(replace(b, position=A @ b.position, rotation=A) for b in scene.bodies)
    joints = tuple(
        replace(j, axis=A @ frames(j)[0], axis_j=frames(j)[1]) if j.i.startswith("ground") else j for j in scene.joints
    )
    ground = {name: A @ at for name, at in scene.ground.items()}
    turned = replace(scene, bodies=bodies, joints=joints, ground=ground, gravity=A @ scene.gravity)
    runs = [integrate(s, end=0.01, output_step=0.001, method=ROS2(1e-4)) for s in (scene, turned)]
    assert all(any("planar" in note for note in run.attributes["notes"]) for run in runs)
    np.testing.assert_allclose(runs[1]["rod.b.position"] @ A, runs[0]["rod.b.position"], rtol=0, atol=1e-10)


def heavy_below(**changes):
    crank = rigid_body(
        "crank", mass=0.5, inertia=(1e-4, 5e-4, 5e-4), centre_of_mass=(0.05, 0, 0.01),
        points={"o": (0, 0, 0), "pin": (0.1, 0, 0)},
    )  # fmt: skip
    scene = slider_crank()
    return replace(scene, bodies=(Body("crank", crank), *scene.bodies[1:]), **changes)


SPATIAL = {
    "gravity across": lambda: slider_crank(gravity=(0, -9.81, 1.0)),
    "a force across": lambda: slider_crank(loads=(Load("push", "block.pin", force=(1.0, 0, 1.0)),)),
    "a moment in the plane": lambda: slider_crank(loads=(Load("push", "block.pin", moment=(1.0, 0, 0)),)),
    "a function of the user": lambda: slider_crank(loads=(Load("f", "block.pin", function=lambda t, s: (0, 0, 1)),)),
    "mass beside the plane": heavy_below,
    "a body that no joint holds": lambda: Scene(
        (Body("top", rigid_body("top", mass=1.0, inertia=(1, 2, 3)), omega_bar=(0, 0, 1.0)),)
    ),
    "a rod that may turn about itself": lambda: slider_crank(
        joints=tuple(replace(j, kind="spherical") if j.name in ("big", "small") else j for j in slider_crank().joints)
    ),
    "a spring aslant": lambda: slider_crank(ground={"O": (0, 0, 0), "P": (1.0, 0, 0.2)}),
}


@pytest.mark.parametrize("make", SPATIAL.values(), ids=list(SPATIAL))
def test_what_reaches_across_the_plane_is_computed_in_space(make):
    assert flattened(make(), 0.0)[0].plane == "none"


def drawn_aside(height: float, stiffening: bool, **changes) -> Scene:
    """The slider-crank of bodies that were drawn this far above the planes of their frames."""
    up = np.array((0, 0, height))
    member = Member(rectangle(0.013, 0.02), ALUMINIUM, orientation=(0, 1, 0))
    line = polyline([up, (0.3, 0, height)], member, elements=6)
    link = fp.reduce(
        fp.from_frame(named(line, a=up, b=(0.3, 0, height)), [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(name="rod", reference=SimplySupported("a", "b"), reduction=CraigBampton(6), linear=not stiffening),
    )
    rigid = {"crank": (0.5, {"o": (0, 0, height), "pin": (0.1, 0, height)}), "block": (0.4, {"pin": (0, 0, height)})}
    parts = {
        name: rigid_body(name, mass=mass, inertia=(1e-4, 5e-4, 5e-4), centre_of_mass=up, points=points)
        for name, (mass, points) in rigid.items()
    }
    bodies = tuple(replace(body, model=(parts | {"rod": link})[body.name]) for body in slider_crank().bodies)
    return slider_crank(bodies=bodies, ground={"O": up, "P": (1.0, 0, height)}, **changes)


@pytest.mark.slow
@pytest.mark.parametrize("stiffening", [False, True])
def test_a_plane_may_lie_beside_the_origins_of_the_bodies(stiffening):
    """Motion and reactions are those of the bodies in their own planes, and those computed in space."""
    assert flattened(drawn_aside(0.004, stiffening), 0.0)[0].plane == "z"
    scenes = [
        drawn_aside(0.004, stiffening),
        drawn_aside(0.0, stiffening),
        drawn_aside(0.004, stiffening, plane="none"),
    ]
    runs = [integrate(scene, end=0.02, output_step=1e-3, method=RK4(5e-6)) for scene in scenes]
    for other in runs[1:]:
        for name in ("rod.q", "rod.R", "rod.b.displacement", "big.force", "big.moment", "main.moment", "energy.total"):
            found, wanted = (run[name][:, :2] if name == "rod.R" else run[name] for run in (runs[0], other))
            size = np.abs(runs[1]["big.force"]).max() if name.endswith("moment") else np.abs(wanted).max()
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(runs[0]["rod.b.position"][:, 2], 0.004, rtol=0, atol=1e-12)


def test_a_declared_plane_leaves_out_what_is_across_and_refuses_what_cannot_be():
    assert flattened(heavy_below(plane="z"), 0.0)[0].plane == "z"
    with pytest.raises(InputError, match="gravity has the component 1"):
        flattened(slider_crank(gravity=(0, -9.81, 1.0), plane="z"), 0.0)
    scene = slider_crank(plane="z")
    leaning = [replace(body, rotation=(0.1, 0, 0)) if body.name == "rod" else body for body in scene.bodies]
    with pytest.raises(InputError, match=r"no axis of the frame of body 'rod' is along it"):
        flattened(replace(scene, bodies=tuple(leaning)), 0.0)
    with pytest.raises(InputError, match="driver 'motor' prescribes a motion across it"):
        flattened(slider_crank(plane="x"), 0.0)
    with pytest.raises(InputError, match="plane is 'w'"):
        slider_crank(plane="w")


def test_twists_of_a_tall_bar_are_across_a_declared_plane():
    """A section taller than wide moves mostly in the plane when it is twisted, and still turns its ends across it."""
    member = Member(rectangle(0.02, 0.06), ALUMINIUM, orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=12), a=(0, 0, 0), b=(1.0, 0, 0))
    ends = [InterfaceRegion("a"), InterfaceRegion("b")]
    tall = fp.reduce(
        fp.from_frame(frame, ends),
        fp.Request(name="link", reference=SimplySupported("a", "b"), reduction=CraigBampton(6)),
    )
    found = flattened(double_pendulum(tall), 0.0)[0]
    declared = flattened(double_pendulum(tall, plane="z"), 0.0)[0]
    assert found.plane == declared.plane == "z"
    assert [body.kept for body in found.bodies] == [body.kept for body in declared.bodies]


# ---- bodies of many modes ---------------------------------------------------------------------------------------------


def double_pendulum(link, **changes) -> Scene:
    return Scene(
        (Body("one", link, position=(0, 0, 0)), Body("two", link, position=(1.0, 0, 0))),
        (Joint("hip", "revolute", "ground.O", "one.a"), Joint("knee", "revolute", "one.b", "two.a")),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
        **changes,
    )


@pytest.fixture(scope="module")
def link():
    """32 modes, of which the highest turn their ends by a hundred times what the lowest do, with as much more rounding."""
    member = Member(rectangle(0.013, 0.02), ALUMINIUM, orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=12), a=(0, 0, 0), b=(1.0, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(name="link", reference=SimplySupported("a", "b"), reduction=CraigBampton(26)),
    )


def turned_modes(body, angle: float):
    """The body turned about its own axis, which mixes what stays in the plane with what leaves it."""
    A = rotation_matrix(euler_parameters((angle, 0, 0), "turn"))
    return replace(
        body,
        P_dm=A @ body.P_dm,
        rP_dm=np.einsum("ka,lb,abj->klj", A, A, body.rP_dm),
        PP_dm=np.einsum("ka,lb,abij->klij", A, A, body.PP_dm),
        rr_dm=A @ body.rr_dm @ A.T,
        interfaces=tuple(replace(i, phi_t=A @ i.phi_t, phi_r=A @ i.phi_r) for i in body.interfaces),
    )


def test_rounding_of_high_modes_does_not_make_a_scene_spatial(link):
    scene = double_pendulum(link)
    flat, _ = flattened(scene, 0.0)
    assert flat.plane == "z"
    assert link.n == 32
    assert flat.bodies[0].model.n == 14  # the others bend across the plane or twist
    for interface in flat.bodies[0].model.interfaces:
        assert not interface.phi_t[2].any()
        assert not interface.phi_r[:2].any()
    runs = [
        integrate(replace(scene, plane=plane), end=0.02, output_step=0.005, method=ROS2(1e-5))
        for plane in ("auto", "none")
    ]
    for name in ("two.b.position", "one.q"):
        np.testing.assert_allclose(runs[0][name], runs[1][name], rtol=0, atol=1e-9 * np.abs(runs[1][name]).max())


@pytest.mark.parametrize("stiffening", [False, True], ids=["linear", "second order"])
def test_a_force_sees_the_elastic_coordinates_that_its_body_has(stiffening):
    """Of linear bodies it had those of the modes that stay in the plane alone, counted anew: of another mode, or of none."""
    model, seen = rod("rod", 1.0, stiffening=stiffening), []

    def push(t, state):
        seen.append((state.q("one"), state.q_dot("two")))
        return 5.0 - 2e4 * state.q("one") @ np.arange(model.n)

    scene = double_pendulum(model, forces=(fd.Actuator("push", "hip", function=push),))
    runs = [
        integrate(replace(scene, plane=plane), end=0.02, output_step=0.005, method=ROS2(1e-4))
        for plane in ("auto", "none")
    ]
    assert [run.attributes["computed"][:12] for run in runs] == ["in the plane", "in space, as"]
    assert {part.size for parts in seen for part in parts} == {model.n}
    largest = np.abs(runs[1]["push.torque"] - 5.0).max()
    assert largest > 1e-3
    np.testing.assert_allclose(runs[0]["push.torque"], runs[1]["push.torque"], rtol=0, atol=1e-8 * largest)


@pytest.mark.parametrize(
    ("component", "said"), [(0, "in the plane, normal z"), (5, "in the plane, normal z"), (2, "'drag' may act")]
)
def test_formulas_of_the_motion_keep_to_the_plane_where_they_have_no_component_across_it(link, component, said):
    formulas = [constant(0.0)] * 6
    formulas[component] = parse("-0.1 * two.b.velocity.x", {}, "")
    drag = Load("drag", "two.b", function=StateFormula(tuple(formulas)))
    assert said in flat_form(double_pendulum(link, loads=(drag,)), 0.0).computed


@pytest.mark.parametrize(("angle", "plane"), [(1e-12, "z"), (1e-7, "none"), (1e-3, "none")])
def test_a_body_that_is_really_spatial_stays_so(link, angle, plane):
    assert flattened(double_pendulum(turned_modes(link, angle)), 0.0)[0].plane == plane


# ---- a hair off the plane ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[False, True], ids=["linear", "second order"])
def square(request):
    """A square bar whose double modes bend in any two planes."""
    member = Member(rectangle(0.02, 0.02), ALUMINIUM, orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=8), a=(0, 0, 0), b=(1.0, 0, 0))
    body = fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(
            name="link", reference=SimplySupported("a", "b"), reduction=CraigBampton(6), linear=not request.param
        ),
    )
    V, order = np.eye(body.n), np.argsort(body.omega2, kind="stable")
    for one, other in pairwise(order):
        if abs(body.omega2[one] / body.omega2[other] - 1) < 1e-9:
            V[np.ix_([one, other], [one, other])] = [[0.8, -0.6], [0.6, 0.8]]
    assert (np.eye(body.n) != V).sum() > 6
    return with_basis(body, V)


def test_double_modes_are_aligned_with_the_plane(square):
    scene = double_pendulum(square)
    flat, _ = flattened(scene, 0.0)
    assert flat.plane == "z"
    assert flat.bodies[0].model.n < square.n
    runs = [
        integrate(replace(scene, plane=plane), end=0.05, output_step=0.005, method=ROS2(2e-5))
        for plane in ("auto", "none")
    ]
    assert runs[0]["one.q"].shape == runs[1]["one.q"].shape
    for name in ("two.b.position", "one.q", "two.q_dot"):
        np.testing.assert_allclose(runs[0][name], runs[1][name], rtol=0, atol=1e-9 * np.abs(runs[1][name]).max())
    for name in ("hip.force", "knee.force"):
        a, b = (run[name][:, :2] for run in runs)
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * np.abs(b).max())


def test_a_deformed_start_is_that_of_the_scene(square):
    """Elastic coordinates of the scene are those of its own modes."""
    flat = flattened(double_pendulum(square), 0.0)[0].bodies[0]
    q = flat.frame.C @ (1e-3 * np.arange(1.0, flat.model.n + 1))
    scene = double_pendulum(square)
    scene = replace(scene, bodies=(replace(scene.bodies[0], q=q), scene.bodies[1]))
    first = integrate(scene, end=1e-4, output_step=1e-4, method=ROS2(1e-5))["one.q"][0]
    np.testing.assert_allclose(first, q, atol=1e-12)


@pytest.mark.parametrize("plane", ["auto", "z"])
@pytest.mark.parametrize("beside", [1e-12, 1e-9, 1e-7])
def test_bores_a_hair_off_are_in_the_plane(plane, beside):
    """Of a four-bar, on the ground and in its links."""
    side = beside * np.array([1.0, -0.7, 0.4, 0.2, -1.0])

    def bar(name: str, length: float, one: float, other: float):
        return rigid_body(
            name, mass=1.0, inertia=(1e-3, 0.1, 0.1), centre_of_mass=(length / 2, 0, 0),
            points={"a": (0, 0, one), "b": (length, 0, other)},
        )  # fmt: skip

    def linkage(side, **changes) -> Scene:
        return Scene(
            (
                Body("left", bar("left", 1.0, 0.0, side[0]), rotation=(0, 0, np.pi / 2)),
                Body("top", bar("top", 1.0, side[1], 0.0), position=(0, 1, side[2])),
                Body("right", bar("right", 1.0, side[3], 0.0), position=(1, 0, 0), rotation=(0, 0, np.pi / 2)),
            ),
            (
                Joint("o", "revolute", "ground.O", "left.a"),
                Joint("a", "revolute", "left.b", "top.a"),
                Joint("b", "revolute", "top.b", "right.b"),
                Joint("p", "revolute", "ground.P", "right.a"),
            ),
            (Driver("motor", "o", polynomial(np.pi / 2, 1.0)),),
            ground={"O": (0, 0, 0), "P": (1, 0, side[4])},
            gravity=(0, -9.81, 0),
            **changes,
        )

    found = assemble(linkage(side, plane=plane))
    assert found.system.scene.plane == "z"
    assert "normal z" in found.computed
    runs = [
        integrate(scene, end=0.1, output_step=0.01, method=RK4(1e-3))["top.b.position"]
        for scene in (linkage(side, plane=plane), linkage(0 * side))
    ]
    np.testing.assert_allclose(runs[0][:, :2], runs[1][:, :2], atol=1e-9)
    # What looks at it in space has its places in the plane as well; redundant joints could not be closed.
    assert fd.mobility(linkage(side, plane=plane)).rigid == 0
    held, still = (fd.static(scene)["o.moment"] for scene in (linkage(side, plane=plane), linkage(0 * side)))
    np.testing.assert_allclose(held, still, atol=1e-5)
    driven = fd.inverse(linkage(side, plane=plane), end=0.02, output_step=0.01, elastic=fd.QuasiStatic())
    swinging = fd.linearise(replace(linkage(side, plane=plane), drivers=()))
    assert np.isfinite(driven["motor.effort"]).all()
    assert len(swinging.eigenvalues) == 2


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda: slider_crank(gravity=(0, -9.81, 1.0)), "gravity has the component 1 m/s"),
        (heavy_below, "body 'crank' is not symmetric about it: o is 0.01 m off the plane through its centre of mass"),
        (
            lambda: slider_crank(ground={"O": (0, 0, 1e-3), "P": (1.0, 0, 0)}),
            r"joint 'main' runs aslant: its points are 0.001 m",
        ),
        (SPATIAL["a rod that may turn about itself"], "its joints leave a body free to move across it"),
        (lambda: slider_crank(plane="none"), "in space, as the scene says"),
    ],
)
def test_why_a_scene_is_computed_in_space(make, why):
    assert re.search(why, flat_form(make(), 0.0).computed)


def test_a_mode_that_mixes_the_plane_is_named(link):
    said = assemble(double_pendulum(turned_modes(link, 1e-3))).computed
    assert re.search(r"in space: .* normal z, as body 'one' is not symmetric about it: (mode \d+ \(|a product)", said)


def test_a_declared_plane_leaves_out_what_a_rough_mesh_does_across_it(link):
    """Modes that leave the plane by thousandths: the motion differs by the square, and no row of a joint holds a mode."""
    scene = double_pendulum(turned_modes(link, 1e-3))
    flat, blocks = flattened(replace(scene, plane="z"), 0.0)
    assert sum(len(block.words) for block in blocks) == 4
    assert flat.bodies[0].model.n == 14
    runs = [
        integrate(replace(scene, plane=plane), end=0.02, output_step=0.005, method=ROS2(1e-5))["two.b.position"]
        for plane in ("z", "none")
    ]
    np.testing.assert_allclose(runs[0][:, :2], runs[1][:, :2], atol=1e-6 * np.abs(runs[1]).max())


def test_a_declared_plane_does_not_halve_a_mode(link):
    """One of two modes of one frequency in any plane: half of its motion would be lost, and the rod be as good as stiff."""
    with pytest.raises(InputError, match=r"mode \d+ \(.*\) makes 0\.\d+ of its motion .*, of body 'one': reduce it"):
        flattened(double_pendulum(turned_modes(link, 0.6), plane="z"), 0.0)
    assert flattened(double_pendulum(turned_modes(link, 0.6)), 0.0)[0].plane == "none"


def test_every_analysis_over_a_plane_says_that_it_was_computed_there():
    scene, how = slider_crank(loads=()), {"end": 0.01, "output_step": 0.01}
    results = [
        fd.kinematic(scene, **how),
        fd.assembly(scene),
        fd.inverse(scene, elastic=fd.QuasiStatic(), **how),
        fd.reference(scene, method=fd.SciPy("DOP853"), **how),
        fd.forward(scene, method=ROS2(1e-3), check=False, **how),
    ]
    for found in results:
        assert "in the plane, normal z" in found.attributes["computed"], found.attributes["analysis"]
