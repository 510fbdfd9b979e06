"""Arrows of loads on surfaces, of torques and forces at joints, of bushings and gears: where they are and how large."""

import json
from functools import cache

import numpy as np
import pytest
from boxes import box_mesh
from browser import Page, needs_browser
from PIL import Image
from test_page import Content

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.pictures.arrows import loads_named, with_arrows
from ffr_dyn.pictures.connections import ArrowShown, Connections, connections
from ffr_dyn.pictures.film import body_points, film_at
from ffr_dyn.pictures.scene_view import scene_view
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.result import Result
from ffr_prep.common.errors import InputError

ON_I = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]).T  # axes of the bushing: y, z, x
SIZE = (1.0, 0.2, 0.02)


@cache
def blade(parts: int | None = None) -> fp.FlexibleBody:
    mesh = box_mesh("hex8", SIZE, (8, 3, 1))
    model = fp.from_mesh(
        mesh, fp.material("steel"), [fp.InterfaceRegion("root", "left"), fp.InterfaceRegion("tip", "right")]
    )
    reduction = fp.CraigBampton(4)
    return fp.reduce(model, fp.Request(name="blade", reference=fp.FixedTo("root"), reduction=reduction, parts=parts))


def upper(centres):
    return centres[:, 2] > SIZE[2] - 1e-6


def scene(*forces, parts: int | None = None) -> fd.Scene:
    """A blade on a hinge about z, geared to a wheel, with whatever can act."""
    wheel = fd.rigid_body("wheel", mass=1.0, inertia=0.01 * np.eye(3), points={"axle": (0, 0, 0)})
    return fd.Scene(
        (fd.Body("blade", blade(parts)), fd.Body("wheel", wheel, position=(-0.4, 0, 0))),
        (
            fd.Joint("hinge", "revolute", "ground.O", "blade.root"),
            fd.Joint("axle", "revolute", "ground.P", "wheel.axle"),
        ),
        forces=forces,
        couplings=(fd.Coupling("gear", "hinge.angle", "axle.angle", ratio=-2.0),),
        ground={"O": (0, 0.1, 0.01), "P": (-0.4, 0, 0), "M": (1.0, 0.1, 0.01)},
        name="all that acts",
    )


@cache
def run() -> Result:
    points = np.flatnonzero(blade().surface.points[:, 1] > SIZE[1] - 1e-9)
    forces = np.outer(1.0 + points, [0, -0.1, 0.02])
    return fd.forward(
        scene(
            fd.Pressure("wind", "blade", 2e3, triangles=upper, function=fd.harmonic(amplitude=1.0, frequency=12.5)),
            fd.Pressure("suction", "blade", -500.0, triangles=[0, 1]),
            fd.NodalForces("edge", "blade", points, forces, axes="global"),
            fd.NodalForces("jet", "blade", points[:3], forces[:3], function=lambda t: 1.0 + t, axes="body"),
            fd.ModalForce("shaker", "blade", np.eye(blade().n)[0], function=fd.polynomial(0, 1)),
            fd.JointSpring("spring", "hinge", stiffness=40.0, free=0.2),
            fd.Actuator("motor", "axle", force=fd.harmonic(amplitude=3.0, frequency=3.0)),
            fd.Bushing("mount", "ground.M", "blade.tip", (1e4, 2e4, 3e4, 1.0, 2.0, 3.0), axes=ON_I),
        ),
        end=0.06,
        output_step=2e-3,
        method=fd.ROS2(5e-4),
    )


def spread(name: str, result: Result | None = None):
    (found,) = (load for load in connections(result or run()).spread if load.name == name)
    return found


def arrow(name: str):
    (found,) = (one for one in connections(run()).arrows if one.name == name)
    return found


def drawn(row: int) -> np.ndarray:
    """(P, 3) the points of the blade in global axes."""
    (solid,) = (of for of in film_at(run(), run().time).solids if of.name == "blade")
    return solid.R[row] + body_points(solid, row, 1.0) @ solid.A[row].T


# ---- films as pictures ----------------------------------------------------------------------------------------------


def test_arrows_of_a_film_are_those_of_the_rows_and_between_them_in_between():
    beside, rows = connections(run()), run().time
    shown = film_at(run(), np.array([rows[3], 0.5 * (rows[3] + rows[4]), rows[-1]]))
    drawn = with_arrows(shown, beside, rows, ["wind", "motor.torque"])
    (wind,), (torque,) = (
        [(load, length) for load, length in beside.lengths(shown.size) if load.name == name]
        for name in ("wind", "motor.torque")
    )
    assert (drawn.forces.shape, drawn.moments.shape) == ((3, 16, 2, 3), (3, 1, 2, 3))
    for arrows, (load, length) in ((drawn.forces, wind), (drawn.moments, torque)):
        third, fourth, last = (np.stack(load.ends(row, length), axis=1) for row in (3, 4, -1))
        np.testing.assert_allclose(arrows, [third, 0.5 * (third + fourth), last], atol=1e-12)
    assert (drawn.low <= drawn.forces.min(axis=(0, 1, 2))).all()
    assert (drawn.high >= drawn.forces.max(axis=(0, 1, 2))).all()


def test_arrows_are_asked_for_by_name_or_pattern():
    beside = connections(run())
    assert loads_named(beside, ()) == frozenset()
    assert loads_named(beside, ["*"]) == {load.name for load in beside.loads}
    assert loads_named(beside, ["hinge"]) == {load.name for load in beside.loads if load.of == "hinge"}
    with pytest.raises(InputError, match="no arrow for 'hnge'; did you mean 'hinge'"):
        loads_named(beside, ["hnge"])


@pytest.mark.slow
def test_a_film_of_pictures_has_the_arrows_that_are_asked_for_and_no_others(tmp_path):
    """In the colour of forces, which nothing else has here; on the page they are switched on."""
    with_and_without = []
    for arrows in ((), ("wind",)):
        fd.animate(run(), tmp_path / "a.gif", arrows=arrows, duration=0.2, fps=25, size=(640, 480), colour="body")
        with Image.open(tmp_path / "a.gif") as picture:
            picture.seek(picture.n_frames // 2)
            red, _, blue = np.moveaxis(np.asarray(picture.convert("RGB")).astype(int), -1, 0)
        with_and_without.append(np.sum(red > blue + 60))
    assert with_and_without[1] > with_and_without[0] + 50
    page = fd.animate(run(), arrows=["wind"])
    assert {one["name"] for one in Content(page.text).about["arrows"] if one["shown"]} == loads_named(
        connections(run()), ["wind"]
    )
    with pytest.raises(InputError, match="histories are plotted beside the motion on a page"):
        fd.animate(run(), tmp_path / "b.gif", plots=["mount.force"])


def test_moments_that_no_force_here_could_miss_are_not_drawn_long():
    """A hinge has some 1e-7 N m by rounding about axes that nothing loads, and no other moment is there to measure it by."""
    at = np.zeros((2, 3))
    force, moment = (
        ArrowShown("h", name, unit, at, np.full((2, 3), size))
        for name, unit, size in (("f", "N", 7.0), ("m", "N m", 1e-7))
    )
    lengths = {load.name: length * load.largest for load, length in Connections((), (force, moment), {}).lengths(0.1)}
    assert lengths["f"] == pytest.approx(0.025)
    assert lengths["m"] < 1e-4
    assert dict(Connections((), (moment,), {}).lengths(0.1))[moment] * moment.largest == pytest.approx(0.025)


# ---- loads on surfaces ----------------------------------------------------------------------------------------------


def test_results_keep_the_function_of_a_load_on_a_body():
    t = run().time
    np.testing.assert_allclose(run()["wind.factor"], np.sin(25 * np.pi * t), atol=1e-12)
    np.testing.assert_allclose(run()["jet.factor"], 1.0 + t, atol=1e-12)
    np.testing.assert_allclose(run()["shaker.factor"], t, atol=1e-12)
    assert not {"edge.factor", "suction.factor"} & run().quantities.keys()  # constant: told with the scene


def test_arrows_of_a_pressure_end_on_the_deformed_surface_and_push_against_its_normals():
    wind, row = spread("wind"), 13
    begin, end = wind.ends(row, 1e-4)
    corners = np.array(run().attributes["connections"]["wind"]["spread"]["corners"])
    a, b, c = (drawn(row)[corners[:, k]] for k in range(3))
    np.testing.assert_allclose(end if run()["wind.factor"][row] > 0 else begin, (a + b + c) / 3, atol=1e-12)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    np.testing.assert_allclose((end - begin) / 1e-4, -2e3 * run()["wind.factor"][row] * normal, atol=30.0)
    assert wind.unit == "Pa"
    assert len(corners) == 16


def test_where_a_pressure_pulls_its_arrows_begin_on_the_surface():
    row = int(np.argmin(run()["wind.factor"]))
    assert run()["wind.factor"][row] < -0.5
    outer = drawn(row)[:, 2].max()
    begin, end = spread("wind").ends(row, 1e-4)
    assert (end[:, 2] > outer).all()
    assert (begin[:, 2] < outer + 1e-3).all()
    begin, end = spread("suction").ends(row, 1e-4)
    assert np.linalg.norm(end - begin, axis=1) == pytest.approx(0.05)
    distance = np.linalg.norm(drawn(row)[:, None] - begin, axis=2).min(axis=0)
    assert (distance < 0.1).all()


def test_arrows_of_nodal_forces_add_up_to_them():
    points = np.flatnonzero(blade().surface.points[:, 1] > SIZE[1] - 1e-9)
    assert len(points) > 16
    edge = spread("edge")
    assert len(edge.vector) == 16
    np.testing.assert_allclose(edge.vector.sum(axis=0), np.outer(1.0 + points, [0, -0.1, 0.02]).sum(axis=0))
    for row in (0, 20):
        begin, end = edge.ends(row, 1.0)
        np.testing.assert_allclose(end - begin, edge.vector, atol=1e-12)  # global axes, whichever way the blade turns
        distance = np.linalg.norm(drawn(row)[points][:, None] - begin, axis=2).min(axis=0)
        np.testing.assert_allclose(distance, 0, atol=1e-12)
    begin, end = spread("jet").ends(20, 1.0)
    A = rotation_matrix(run()["blade.p"][20])
    np.testing.assert_allclose(end - begin, (1 + run().time[20]) * spread("jet").vector @ A.T, atol=1e-9)


def test_a_pressure_on_a_body_in_parts_has_arrows_on_each():
    wind = fd.Pressure("wind", "blade", 2e3, triangles=upper)
    result = fd.forward(scene(wind, parts=2), end=4e-3, output_step=2e-3, method=fd.ROS2(5e-4))
    for part in (1, 2):
        begin, end = spread(f"wind_{part}", result).ends(0, 1e-4)
        assert end[:, 2] == pytest.approx(SIZE[2])
        assert begin[:, 2] == pytest.approx(SIZE[2] + 0.2)
        side = end[:, 0] > 0.5
        assert side.all() if part == 2 else not side.any()


def test_loads_of_which_a_result_kept_too_little_are_left_out():
    few = fd.forward(
        scene(fd.Pressure("wind", "blade", 1.0, function=fd.polynomial(0, 1))),
        end=2e-3,
        output_step=2e-3,
        method=fd.ROS2(1e-3),
        outputs=["*.R", "*.p", "*.q"],
    )
    assert connections(few).spread == ()


# ---- at joints ------------------------------------------------------------------------------------------------------


def test_torques_stand_along_the_axes_of_their_joints():
    spring, motor = arrow("spring.torque"), arrow("motor.torque")
    assert (spring.unit, motor.unit) == ("N m", "N m")
    np.testing.assert_allclose(spring.vector[:, 2], -40.0 * (run()["hinge.angle"] - 0.2), atol=1e-9)
    np.testing.assert_allclose(spring.at, run()["blade.root.position"], atol=1e-12)
    np.testing.assert_allclose(motor.vector, np.outer(3 * np.sin(6 * np.pi * run().time), [0, 0, 1]), atol=1e-9)
    np.testing.assert_allclose(motor.at, run()["wheel.axle.position"], atol=1e-12)


def test_a_gear_turns_both_of_its_joints():
    effort = run()["gear.effort"]
    np.testing.assert_allclose(arrow("gear.effort on axle").vector[:, 2], effort, rtol=1e-9)
    np.testing.assert_allclose(arrow("gear.effort on hinge").vector[:, 2], 2 * effort, rtol=1e-9)


def test_a_bushing_is_drawn_in_global_axes():
    given = run()["mount.force"]
    np.testing.assert_allclose(arrow("mount.force").vector, given @ ON_I.T, atol=1e-9 * np.abs(given).max())
    np.testing.assert_allclose(arrow("mount.force").at, run()["blade.tip.position"], atol=1e-12)
    assert arrow("mount.moment").unit == "N m"


def test_the_force_of_a_spring_along_a_guide_turns_with_it():
    """The guide is on a body that turns by a quarter about z."""
    arm = fd.rigid_body("arm", mass=1.0, inertia=np.eye(3), points={"a": (0, 0, 0)})
    block = fd.rigid_body("block", mass=1.0, inertia=np.eye(3), points={"p": (0, 0, 0)})
    joints = (
        fd.Joint("hinge", "revolute", "ground.O", "arm.a"),
        fd.Joint("guide", "translational", "arm.a", "block.p", axis=(1, 0, 0)),
    )
    turning = fd.Scene(
        (fd.Body("arm", arm), fd.Body("block", block, position=(0.3, 0, 0))),
        joints,
        (fd.Driver("motor", "hinge", fd.polynomial(0, np.pi / 2)),),
        forces=(fd.JointSpring("coil", "guide", stiffness=10.0, coordinate="stroke"),),
        ground={"O": (0, 0, 0)},
    )
    result = fd.forward(turning, end=1.0, output_step=0.5, method=fd.ROS2(1e-2))
    found = {one.name: one for one in connections(result).arrows}
    coil = found["coil.force"]
    assert coil.unit == "N"
    np.testing.assert_allclose(coil.vector[-1], [0, -10 * result["guide.stroke"][-1], 0], atol=1e-6)
    np.testing.assert_allclose(found["motor.moment"].vector, result["motor.moment"])


# ---- pages and pictures ---------------------------------------------------------------------------------------------


def test_what_a_result_says_of_its_loads_lasts_in_a_file(tmp_path):
    kept = connections(load_result(save_result(run(), tmp_path / "a.nc")))
    assert [load.name for load in kept.spread] == [load.name for load in connections(run()).spread]
    np.testing.assert_array_equal(kept.spread[0].ends(9, 1.0), connections(run()).spread[0].ends(9, 1.0))
    json.dumps(run().attributes["connections"])


def test_the_page_has_all_that_the_viewer_makes_arrows_of():
    page = Content(fd.animate(run()).text)
    items = {item["name"]: item for item in page.about["arrows"]}
    assert {"wind", "suction", "edge", "jet", "spring.torque", "motor.torque", "mount.force"} <= items.keys()
    item, wind = items["wind"], spread("wind")
    assert (item["unit"], item["turns"], item["shown"]) == ("Pa", True, False)
    np.testing.assert_allclose(page.array(*item["factor"]), wind.factor, atol=1e-4)
    np.testing.assert_allclose(page.array(*item["at"]).reshape(-1, 3), wind.at, atol=1e-7)
    moved = page.array(*item["moved"]).reshape(wind.moved.shape)
    np.testing.assert_allclose(moved, wind.moved, atol=1e-4 * np.abs(wind.moved).max())


def test_a_scene_shows_its_loads_before_it_runs(tmp_path):
    still = scene(
        fd.Pressure("wind", "blade", 2e3, triangles=upper),
        fd.Pressure("later", "blade", 1e3, triangles=[0], function=fd.polynomial(0, 1)),
        fd.JointSpring("spring", "hinge", stiffness=40.0, free=0.2),
    )
    seen = scene_view(still)
    assert {load.name for load in seen.beside.spread} == {"wind", "later"}
    assert {one.name for one in seen.beside.arrows} >= {"spring.torque"}
    assert "spring" not in {joint.name for joint in seen.beside.joints}
    fd.show(still, tmp_path / "a.png")
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(picture, 2, 0)
    assert ((red > 100) & (red > green + 40) & (green > blue + 20)).sum() > 300  # forces
    assert ((blue > 80) & (blue > red + 60)).sum() > 100  # moments


ENDS = (
    """(() => about.arrows.filter((one) => one.name === 'wind').flatMap((one) => exerted(one, place(state.time))))()"""
)


@needs_browser
@pytest.mark.slow
def test_the_viewer_draws_arrows_where_python_does_and_hides_them(tmp_path):
    fd.animate(run(), tmp_path / "a.html")
    browser = Page(tmp_path / "profile").open(tmp_path / "a.html")
    for row in (5, 27):
        browser.value(f"seek(rows[{row}])")
        begin, end = spread("wind").ends(row, 1e-4)
        places, vectors, inward = zip(*browser.value(ENDS), strict=True)
        np.testing.assert_allclose(np.array(vectors) * 1e-4, end - begin, atol=1e-4)
        np.testing.assert_allclose(np.where(np.array(inward)[:, None], end, begin), places, atol=1e-5)
    bare = browser.picture()
    browser.value("[...document.querySelectorAll('#lists details')].forEach((one) => { one.open = true; })")
    browser.value("document.querySelector(\"input[data-name='wind']\").click()")
    browser.value("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 100)))")
    assert browser.value("about.arrows.filter((one) => one.shown).map((one) => one.name)") == ["wind"]
    assert browser.picture() != bare
    assert browser.said == []
    assert browser.requests == []
    browser.close()
