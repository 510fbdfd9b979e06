"""Pages of films: what the viewer is given says where every point is at every row; and what it draws in a browser."""

import base64
import json
import re
import zlib
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from io import BytesIO

import numpy as np
import pytest
from browser import Page, needs_browser
from PIL import Image
from scipy.spatial.transform import Rotation
from test_animate import box_surface, pendulum_of_markers, rotating_box

import ffr_dyn as fd
from ffr_dyn.pictures.film import displacements, drawn_points, film_at
from ffr_dyn.pictures.morphs import is_closed, morph, sharp_edges
from ffr_dyn.pictures.page import decimated, rods
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Quantity, Result, mode_axis
from ffr_dyn.results.stress import values_at
from ffr_dyn.scene.stress_sensors import MEASURES
from ffr_prep.body import QuadraticField

KINDS = {"f4": "<f4", "i2": "<i2", "u4": "<u4", "u1": "u1"}


class Content:
    """What a page holds: `about`, and its arrays."""

    def __init__(self, text):
        found = {
            key: re.search(rf'id="{key}">(.*?)</script>', text, re.DOTALL).group(1) for key in ("about", "numbers")
        }
        self.about, self.bytes = json.loads(found["about"]), zlib.decompress(base64.b64decode(found["numbers"]))

    def array(self, kind, offset, length, scale=1.0):
        found = np.frombuffer(self.bytes, KINDS["i2" if kind == "h2" else kind], length, offset)
        return found * scale if kind == "h2" else found

    def points(self, number, row, scale):
        """(P, 3) of a body at a row, as the viewer makes them."""
        body = self.about["bodies"][number]
        surface = self.about["surfaces"][body["surface"]]
        scales = np.array(surface["scales"])
        shapes = self.array(*surface["shapes"]).reshape(surface["points"][2] // 3, len(scales), 3)
        linear = np.arange(len(scales)) < surface["linear"]
        rows = len(self.array(*self.about["times"]))
        weights = self.array(*body["weights"]).reshape(rows, len(scales))[row] * scales
        whole, first = (self.posed(self.about["bodies"][k], row) for k in (number, body["frame"]))
        points = self.array(*surface["points"]).reshape(-1, 3).astype(float)
        inner, outer = (1.0, scale) if body["parted"] else (scale, 1.0)
        moved = points + np.einsum("pkc,k->pc", shapes, weights * np.where(linear, inner, inner**2))
        rest = first[0] + points @ first[1].T
        return rest + outer * (whole[0] + moved @ whole[1].T - rest)

    def posed(self, body, row):
        pose = self.array(*body["pose"]).reshape(-1, 7)[row].astype(float)
        return pose[:3], Rotation.from_quat(np.roll(pose[3:], -1)).as_matrix()


def content(result, **settings):
    return Content(fd.animate(result, **settings).text)


def second_order_box(modes=2):
    """The rotating box with a second order and stress of some size."""
    rng, surface = np.random.default_rng(2), box_surface(modes=modes)
    count = len(surface.points)
    weights = rng.normal(size=(3, modes, modes))
    second = QuadraticField(rng.normal(size=(count, 3, 3)), weights + weights.transpose(0, 2, 1))
    smooth = np.einsum("p,cj->pcj", surface.points[:, 0] + 0.3, rng.normal(size=(6, modes)) * 1e9)
    moduli = np.tile([2e11, 0.3], (count, 1))
    whole = replace(surface, second=second, stress=smooth, moduli=moduli)
    return replace(rotating_box((0.6, 0, 0.8), amplitude=0.02, modes=modes), geometry={"rod": whole})


# ---- the law ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [0.0, 1.0, 20.0])
@pytest.mark.parametrize("make", [rotating_box, second_order_box])
def test_a_page_puts_points_where_the_film_does(make, scale):
    result = make()
    shown, page = film_at(result, result.time), content(result, scale=scale)
    (solid,) = shown.solids
    for row in (0, 7, 20):
        expected = drawn_points(solid, row, scale)
        size = max(np.abs(expected).max(), scale * shown.deflection)
        np.testing.assert_allclose(page.points(0, row, scale), expected, rtol=0, atol=3e-4 * size)


def parted():
    """The box in two parts, each with a pose of its own."""
    rng, t = np.random.default_rng(4), np.linspace(0.0, 1.0, 9)
    quantities, geometry = {}, {}
    for k in (1, 2):
        turned = Rotation.from_rotvec(np.outer(t, [0.0, 0.1 * k, 1.0]))
        quantities[f"rod_{k}.R"] = Quantity(0.02 * k * np.outer(t, [1.0, 2.0, 0.0]), "m", (XYZ,))
        quantities[f"rod_{k}.p"] = Quantity(np.roll(turned.as_quat(), 1, axis=1), "1", (EULER_PARAMETERS,))
        q = 0.01 * rng.normal(size=(9, 2))
        quantities[f"rod_{k}.q"] = Quantity(q, "m sqrt(kg)", (mode_axis(f"rod_{k}", 2),))
        geometry[f"rod_{k}"] = box_surface(modes=2)
    return Result(t, quantities, geometry, {"parts": {"rod": ["rod_1", "rod_2"]}})


@pytest.mark.parametrize("scale", [0.0, 1.0, 5.0])
def test_parts_are_drawn_between_the_undeformed_whole_and_where_they_are(scale):
    result = parted()
    (solid,) = film_at(result, result.time).solids
    page = content(result, scale=scale)
    drawn = np.concatenate([page.points(k, 6, scale) for k in (0, 1)])
    np.testing.assert_allclose(drawn, drawn_points(solid, 6, scale), rtol=0, atol=1e-3)


def test_rigid_bodies_with_a_surface_move_without_shapes():
    result = rotating_box(modes=0)
    page = content(result)
    assert page.about["surfaces"][0]["scales"] == []
    assert [colour["words"] for colour in page.about["colours"]] == ["body", "speed"]
    (solid,) = film_at(result, result.time).solids
    np.testing.assert_allclose(page.points(0, 9, 1.0), drawn_points(solid, 9, 1.0), rtol=0, atol=1e-6)


def test_few_shapes_do_what_many_did():
    """Of 30 shapes with histories of rank two, and a third of no size, two are left."""
    rng = np.random.default_rng(1)
    shapes, histories = rng.normal(size=(40, 3, 30)), rng.normal(size=(90, 2)) @ rng.normal(size=(2, 30))
    found = morph(shapes, histories, 10)
    assert found.shapes.shape == (40, 3, 2)
    assert np.abs(found.weights).max() == pytest.approx(1.0)
    expected = np.einsum("pck,tk->tpc", shapes, histories)
    made = np.einsum("pck,k,tk->tpc", found.shapes, found.scales, found.weights)
    np.testing.assert_allclose(made, expected, rtol=0, atol=2e-4 * np.abs(expected).max())
    assert morph(shapes, 0 * histories, 10).shapes.shape == (40, 3, 0)
    assert morph(shapes[:, :, :0], histories[:, :0], 10).weights.shape == (90, 0)


def test_the_sharp_edges_of_a_box_are_its_twelve():
    surface = box_surface(stations=5)
    edges = sharp_edges(surface.points, surface.triangles)
    assert len(edges) == 4 * 4 + 2 * 4
    along = surface.points[edges[:, 1]] - surface.points[edges[:, 0]]
    assert ((np.abs(along) > 1e-12).sum(axis=1) == 1).all()


def test_a_box_is_closed_and_its_parts_are_not():
    surface = box_surface(stations=5)
    turned = surface.triangles[:, ::-1]
    inside = [is_closed(surface.points, of) for of in (surface.triangles, turned)]
    assert sorted(inside) == [False, True]
    assert not is_closed(surface.points, surface.triangles[1:])
    assert not is_closed(surface.points, np.concatenate([surface.triangles[1:], surface.triangles[:1, ::-1]]))
    rod, _ = rods(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]]), 0.1)
    assert is_closed(rod.points, rod.triangles)


def test_free_edges_are_sharp():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    assert len(sharp_edges(points, np.array([[0, 1, 2], [0, 2, 3]]))) == 4


def test_bodies_without_a_surface_are_rods_between_their_markers():
    result = pendulum_of_markers()
    page = content(result)
    surface, owner = rods(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]]), 0.1)
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    volume = np.einsum("ti,ti->", np.cross(a, b), c) / 6
    assert volume > 0  # faces look outwards
    assert set(owner) == {0, 1}
    places = [result[f"arm.{name}.position"][5] for name in ("tip", "root", "middle", "quarter")]
    points = page.points(0, 5, 1.0)
    for place in places:
        assert np.linalg.norm(points - place, axis=1).min() < 0.2


# ---- the page -----------------------------------------------------------------------------------------------------


class References(HTMLParser):
    """Collects whatever a browser would fetch."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        self.found += [(tag, key, value) for key, value in attrs if key in ("src", "href", "data", "srcset", "action")]


def test_a_page_holds_everything_and_fetches_nothing(tmp_path):
    result = rotating_box()
    viewer = fd.animate(result, tmp_path / "a.html", scale=20.0, traces=["rod.tip"], plots=["rod.tip.position.y"])
    assert (tmp_path / "a.html").read_text("utf-8") == viewer.text
    references = References()
    references.feed(viewer.text)
    assert references.found == []
    assert "default-src 'none'" in viewer.text
    page = Content(viewer.text)
    (trace,) = page.about["traces"]
    np.testing.assert_allclose(page.array(*trace["points"]).reshape(-1, 3), result["rod.tip.position"], atol=1e-6)
    (chosen,) = (series for series in page.about["series"] if series["chosen"])
    values = page.array(*chosen["values"])[chosen["column"] :: chosen["of"]]
    np.testing.assert_allclose(values, result["rod.tip.position.y"], atol=1e-4)


def test_the_viewer_is_small():
    """Lines of JavaScript but for comments, and the shaders."""
    scripts = [of for of in files("ffr_dyn.pictures").joinpath("web").iterdir() if of.name.endswith(".js")]
    lines = [line for of in scripts if of.name != "shaders.js" for line in of.read_text("utf-8").splitlines()]
    assert len([line for line in lines if not re.match(r"\s*(//|/\*\*.*\*/|$)", line)]) <= 500
    assert max(map(len, lines)) <= 150


def test_titles_cannot_break_a_page():
    viewer = fd.animate(replace(rotating_box(), attributes={"title": "</script><b>"}))
    assert "</script><b>" not in viewer.text
    assert "&lt;/script>" in viewer.text


def test_a_page_is_small_whatever_the_number_of_rows_and_always_the_same():
    long = rotating_box(rows=5001)
    page = content(long)
    times = page.array(*page.about["times"])
    assert (len(times), times[0], times[-1]) == (2000, 0.0, 1.0)
    first = fd.animate(long).text
    assert len(first) < 400_000
    assert first == fd.animate(long).text


def test_equal_surfaces_are_stored_once():
    result = rotating_box()
    other = {name.replace("rod", "arm"): of for name, of in result.quantities.items() if not name.endswith(".q")}
    q = replace(result.quantity("rod.q"), values=-2 * result["rod.q"], axes=(mode_axis("arm", 1),))
    both = replace(
        result,
        quantities={**result.quantities, **other, "arm.q": q},
        geometry={"rod": box_surface(), "arm": box_surface()},
    )
    page = content(both)
    assert [body["surface"] for body in page.about["bodies"]] == [0, 0]
    for k, solid in enumerate(film_at(both, both.time).solids):
        np.testing.assert_allclose(page.points(k, 9, 1.0), drawn_points(solid, 9, 1.0), rtol=0, atol=1e-4)


def test_a_large_surface_is_simplified_to_some_of_its_points(monkeypatch):
    from ffr_dyn.pictures import page

    surface = box_surface(stations=400)
    coarse, _ = decimated(surface, 0.25)
    assert 0.2 < len(coarse.triangles) / len(surface.triangles) < 0.3
    own = {tuple(point): k for k, point in enumerate(surface.points)}
    kept = [own[tuple(point)] for point in coarse.points]
    np.testing.assert_array_equal(coarse.Phi, surface.Phi[kept])
    np.testing.assert_allclose(np.ptp(coarse.points, axis=0), np.ptp(surface.points, axis=0), atol=0.01)
    monkeypatch.setattr(page, "MOST_TRIANGLES", 1000)
    drawn = content(replace(rotating_box(), geometry={"rod": surface})).about["surfaces"][0]["triangles"][2] / 3
    assert drawn <= 1000


def pendulum():
    """A run of a driven arm with a load and a spring."""
    arm = fd.rigid_body("arm", mass=1.0, inertia=0.1 * np.eye(3), points={"hinge": (0, 0, 0), "tip": (1.0, 0, 0)})
    scene = fd.Scene(
        (fd.Body("arm", arm),),
        (fd.Joint("hinge", "revolute", "ground.wall", "arm.hinge", axis=(0, 0, 1)),),
        loads=(
            fd.Load("weight", "arm.tip", force=(0, -5.0, 0), axes="body"),
            fd.Load("gust", "arm.tip", force=(fd.harmonic(amplitude=2.0, frequency=1.0), 0, 0)),
            fd.Load("drag", "arm.tip", function=lambda t, state: -0.1 * state.velocity("arm.tip")),
        ),
        springs=(fd.SpringDamper("spring", "ground.hook", "arm.tip", stiffness=20.0, free_length=0.5),),
        ground={"wall": (0, 0, 0), "hook": (1.0, 2.0, 0)},
        name="pendulum",
    )
    return fd.forward(scene, end=0.5, output_step=0.02, method=fd.ROS2(1e-2))


def test_joints_forces_and_markers_are_where_the_result_has_them():
    result = pendulum()
    page = content(result)
    (joint,) = page.about["joints"]
    assert joint["label"] == "hinge (revolute)"
    np.testing.assert_allclose(page.array(*joint["axis"]).reshape(-1, 3), [[0, 0, 1]] * len(result.time), atol=1e-4)
    arrows = {arrow["name"]: arrow for arrow in page.about["arrows"]}
    assert set(arrows) == {"hinge.force", "weight.force", "gust.force", "drag.force", "spring.tension"}
    gust, drag = (page.array(*arrows[f"{name}.force"]["vector"]).reshape(-1, 3) for name in ("gust", "drag"))
    np.testing.assert_allclose(gust[:, 0], 2.0 * np.sin(2 * np.pi * result.time), atol=1e-3)
    np.testing.assert_allclose(drag, -0.1 * result["arm.tip.velocity"], atol=1e-3 * np.abs(drag).max())
    force = page.array(*arrows["hinge.force"]["vector"]).reshape(-1, 3)
    np.testing.assert_allclose(force, result["hinge.force"], atol=1e-3 * np.abs(result["hinge.force"]).max())
    pull, tip = page.array(*arrows["spring.tension"]["vector"]).reshape(-1, 3), result["arm.tip.position"]
    line = np.array([1.0, 2.0, 0.0]) - tip
    line *= (result["spring.tension"] / np.linalg.norm(line, axis=1))[:, None]
    np.testing.assert_allclose(pull, line, atol=1e-3 * np.abs(line).max())
    weight = page.array(*arrows["weight.force"]["vector"]).reshape(-1, 3)
    assert np.einsum("ti,ti->t", weight, tip) == pytest.approx(0.0, abs=1e-2)  # it follows the arm
    assert {marker["name"] for marker in page.about["markers"]} == {
        "arm.hinge",
        "arm.tip",
        "ground.wall",
        "ground.hook",
    }


# ---- in a browser -------------------------------------------------------------------------------------------------


@pytest.fixture
def browser(tmp_path):
    page = Page(tmp_path / "profile")
    yield page
    assert page.said == []
    assert page.requests == []
    page.close()


MOVED = """(() => {
  draw();
  const body = about.bodies[%d], size = about.surfaces[body.surface].size, found = new Float32Array(5 * size);
  gl.bindBuffer(gl.ARRAY_BUFFER, body.moved);
  gl.getBufferSubData(gl.ARRAY_BUFFER, 0, found);
  gl.bindBuffer(gl.ARRAY_BUFFER, null);
  return Array.from(found);
})()"""


def drawn(browser, number=0):
    """(P, 3) places of the points on the graphics card, and (P,) what colours them."""
    found = np.reshape(browser.value(MOVED % number), (-1, 5))
    return found[:, :3], found[:, 3]


def coloured_by(browser, words):
    browser.value(f"setColouring(about.colours.findIndex((colour) => colour.words === {words!r}))")


@needs_browser
@pytest.mark.slow
def test_the_viewer_moves_points_and_colours_them_by_the_formulas(browser, tmp_path):
    result = second_order_box()
    fd.animate(result, tmp_path / "a.html", scale=3.0, colour="von-mises")
    (solid,) = film_at(result, result.time).solids
    browser.open(tmp_path / "a.html")
    browser.value("seek(rows[13])")
    places = drawn(browser)[0]
    expected = drawn_points(solid, 13, 3.0)
    np.testing.assert_allclose(places, expected, rtol=0, atol=1e-3 * np.abs(expected).max())
    for words, name in (("von Mises stress", "von-mises"), ("signed max principal stress", "signed-max-principal")):
        coloured_by(browser, words)
        values = values_at(solid.surface, solid.q[13:14], MEASURES[name])[:, 0]
        np.testing.assert_allclose(drawn(browser)[1], values, rtol=0, atol=2e-3 * np.abs(values).max())
    coloured_by(browser, "elastic displacement")
    np.testing.assert_allclose(
        drawn(browser)[1], displacements(solid, 13), rtol=0, atol=1e-3 * displacements(solid, 13).max()
    )
    coloured_by(browser, "speed")
    step = result.time[14] - result.time[13]
    speed = np.linalg.norm(drawn_points(solid, 14, 1.0) - drawn_points(solid, 13, 1.0), axis=1) / step
    np.testing.assert_allclose(drawn(browser)[1], speed, rtol=0, atol=0.05 * speed.max())


@needs_browser
@pytest.mark.slow
def test_strain_and_components_are_coloured_by_the_formulas(browser, tmp_path):
    result = second_order_box()
    (solid,) = film_at(result, result.time).solids
    for name in ("tresca", "yz", "strain-xy", "strain-min-principal"):
        fd.animate(result, tmp_path / f"{name}.html", colour=name)
        browser.open(tmp_path / f"{name}.html")
        browser.value("seek(rows[6])")
        values = values_at(solid.surface, solid.q[6:7], MEASURES[name])[:, 0]
        np.testing.assert_allclose(drawn(browser)[1], values, rtol=0, atol=3e-3 * np.abs(values).max())


@needs_browser
@pytest.mark.slow
def test_controls_work(browser, tmp_path):
    fd.animate(pendulum(), tmp_path / "a.html", plots=["hinge.force"], duration=2.0)
    browser.open(tmp_path / "a.html")
    assert browser.value("state.time") == 0
    browser.click("#forward")
    assert browser.value("state.time") == pytest.approx(0.02)
    browser.click("#back")
    assert browser.value("state.time") == pytest.approx(0.0)
    browser.click("#play")
    browser.until("state.time > 0.1")
    browser.click("#play")
    stopped = browser.value("state.time")
    assert browser.value("new Promise((done) => setTimeout(() => done(state.time), 300))") == stopped
    browser.click("#loop")
    browser.value("$('speed').value = '8'; $('speed').onchange(); play(true)")
    browser.until("!state.playing")
    assert browser.value("state.time") == pytest.approx(0.5)
    before = browser.value("camera.axes.flat()")
    browser.drag(700, 250, 60, 30)
    assert browser.value("camera.axes.flat()") != before
    axes = np.reshape(browser.value("camera.axes.flat()"), (3, 3))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    browser.click("button[data-view='z']")
    np.testing.assert_allclose(np.reshape(browser.value("camera.axes.flat()"), (3, 3)), np.eye(3), atol=1e-12)
    shown = browser.picture()
    browser.click("input[data-name='arm']")
    assert browser.value("about.bodies[0].shown") is False
    browser.value("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 100)))")
    assert browser.picture() != shown
    assert browser.value("chosen().length") == 3
    assert browser.value("$('histories').style.display") == "block"
    x, width = browser.value("(() => { const b = $('plots').getBoundingClientRect(); return [b.x, b.width]; })()")
    y = browser.value("$('plots').getBoundingClientRect().y")
    browser.drag(x + 74 + 0.5 * (width - 86), y + 60, 1, 0)
    assert browser.value("state.time") == pytest.approx(0.25, abs=0.01)
    browser.value("$('scaling').value = 0; $('scaling').oninput()")
    assert browser.value("state.scale") == 0


def orange(browser):
    """Pixels of the colour of forces."""
    red, green, blue = np.moveaxis(np.asarray(Image.open(BytesIO(browser.picture())).convert("RGB")).astype(int), 2, 0)
    return ((red > 190) & (np.abs(green - 94) < 15) & (blue < 25)).sum()


@needs_browser
@pytest.mark.slow
def test_forces_are_drawn_as_arrows(browser, tmp_path):
    fd.animate(pendulum(), tmp_path / "a.html")
    browser.open(tmp_path / "a.html")
    assert orange(browser) == 0
    browser.value("about.arrows.forEach((arrow) => { arrow.shown = true; }); draw()")
    assert orange(browser) > 50


@needs_browser
@pytest.mark.slow
def test_a_notebook_shows_a_film_in_a_frame_of_its_own(browser, tmp_path):
    text = f"<!DOCTYPE html><html><body>{fd.animate(rotating_box())._repr_html_()}</body></html>"
    (tmp_path / "a.html").write_text(text, encoding="utf-8")
    browser.open(tmp_path / "a.html")
    browser.until("frames[0].document.body.dataset.ready === 'yes'")
