"""Scenes that are looked at before they run."""

from dataclasses import replace

import numpy as np
import pytest
from browser import Page, needs_browser
from click.testing import CliRunner
from PIL import Image
from test_page import Content

import ffr_dyn as fd
from ffr_dyn.cli import cli
from ffr_dyn.pictures.scene_view import DECLARED, scene_view
from ffr_prep.common.errors import ComputationError, InputError


def link(length):
    ends = {"a": (0, 0, 0), "b": (length, 0, 0)}
    return fd.rigid_body("link", mass=1.0, inertia=0.1 * np.eye(3), points=ends)


def crank(offset=0.0, reach=1.0):
    """A crank and a rod to a slider; the rod is declared off by `offset` [m]."""
    return fd.Scene(
        (fd.Body("crank", link(0.3)), fd.Body("rod", link(reach), position=(0.3, offset, 0))),
        (
            fd.Joint("bearing", "revolute", "ground.O", "crank.a"),
            fd.Joint("pin", "revolute", "crank.b", "rod.a"),
            fd.Joint("guide", "point-on-line", "ground.O", "rod.b", axis=(1, 0, 0)),
        ),
        (fd.Driver("motor", "bearing", fd.polynomial(0, 10.0)),),
        loads=(
            fd.Load("gas", "rod.b", force=(-5.0, 0, 0)),
            fd.Load("wave", "rod.b", force=(fd.harmonic(amplitude=2.0, frequency=3.0), 0, 0)),
        ),
        springs=(fd.SpringDamper("spring", "ground.O", "rod.b", stiffness=10.0),),
        ground={"O": (0, 0, 0)},
        name="crank",
    )


def torn():
    """A rod that is held at two places which are too far apart."""
    scene = crank()
    more = (fd.Joint("wall", "spherical", "ground.far", "rod.b"),)
    return replace(scene, joints=scene.joints + more, ground={**scene.ground, "far": (5.0, 0, 0)})


def test_an_assembled_scene_is_drawn_once_with_all_that_is_named():
    seen = scene_view(crank())
    assert seen.trouble == ""
    assert seen.faint == frozenset()
    about = Content(fd.show(crank()).text).about
    assert {body["name"] for body in about["bodies"]} == {"crank", "rod"}
    joints = {"bearing (revolute, driven by motor)", "pin (revolute)", "guide (point-on-line)"}
    assert {joint["label"] for joint in about["joints"]} == joints | {"wave (Load)"}
    assert {arrow["name"] for arrow in about["arrows"]} == {"gas.force", "spring.tension"}
    assert {marker["name"] for marker in about["markers"]} == {"crank.a", "crank.b", "rod.a", "rod.b", "ground.O"}
    assert {trace["name"] for trace in about["traces"]} == {"spring (SpringDamper)"}


def hung(gravity):
    """A weight on a rope, free in space."""
    return fd.Scene(
        (fd.Body("weight", link(0.3), position=(0.1, 0.2, -1.0)),),
        (fd.Joint("rope", "distance", "ground.O", "weight.a", length=np.sqrt(1.05)),),
        ground={"O": (0, 0, 0)},
        gravity=gravity,
    )


def test_a_rope_is_drawn_from_end_to_end():
    assert {trace["name"] for trace in Content(fd.show(hung((0, 0, -9.81))).text).about["traces"]} == {
        "rope (distance)"
    }


@pytest.mark.parametrize(("gravity", "up"), [((0, 0, -9.81), 2), ((0, -9.81, 0), 1), ((9.81, 0, 0), 0)])
def test_up_is_against_gravity_also_of_a_scene_at_rest(gravity, up):
    camera = Content(fd.show(hung(gravity)).text).about["camera"]
    assert np.argmax(np.abs(camera["up"])) == up
    assert camera["up"][up] == -np.sign(gravity[up])
    assert np.abs(camera["direction"]).min() > 0.5


def test_a_planar_scene_is_seen_from_its_front():
    camera = Content(fd.show(replace(crank(), gravity=(0, -9.81, 0))).text).about["camera"]
    assert camera == {"direction": [0.2, 0.28, 1.0], "up": [0.0, 1.0, 0.0]}


def test_what_assembly_moves_is_drawn_twice():
    seen = scene_view(crank(offset=0.2))
    assert seen.faint == {f"crank{DECLARED}", f"rod{DECLARED}"}
    assert set(seen.apart) == {"pin: 0.2 m apart"}
    np.testing.assert_allclose(np.ptp(seen.apart["pin: 0.2 m apart"], axis=0), [0, 0.2, 0], atol=1e-12)
    np.testing.assert_allclose(seen.shown[f"rod{DECLARED}.R"], [[0.3, 0.2, 0]])
    assert abs(seen.shown["rod.R"][0, 1]) < 0.19
    bodies = Content(fd.show(crank(offset=0.2)).text).about["bodies"]
    assert [body["faint"] for body in bodies if body["name"].endswith(DECLARED)] == [True, True]


def test_what_cannot_be_assembled_is_drawn_as_declared():
    seen = scene_view(torn())
    assert "cannot be" in seen.trouble
    assert "wall: 3.7 m apart" in seen.apart
    assert seen.faint == frozenset()
    text = fd.show(torn()).text
    assert "cannot be" in text.split("</h1>")[0]


def test_a_picture_is_drawn_and_other_files_are_refused(tmp_path):
    fd.show(crank(offset=0.2), tmp_path / "a.png")
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    assert (np.ptp(picture, axis=2) > 40).sum() > 500
    with pytest.raises(InputError, match=r"drawn as \.html or \.png, not \.gif"):
        fd.show(crank(), tmp_path / "a.gif")
    with pytest.raises(InputError, match="not a Scene"):
        fd.show("crank.toml")


def test_a_body_alone_is_drawn_with_its_points():
    about = Content(fd.show(link(0.5)).text).about
    assert [body["name"] for body in about["bodies"]] == ["body"]
    assert {marker["name"] for marker in about["markers"]} == {"body.a", "body.b"}


def test_a_window_needs_a_display(monkeypatch):
    from ffr_dyn.pictures.scene_view import open_window

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ComputationError, match="no display for a window"):
        open_window(scene_view(crank()))


def test_the_command_writes_a_page_and_says_what_is_wrong(tmp_path):
    for scene, words in ((crank(), "picture"), (torn(), "drawn as declared")):
        scene = replace(scene, loads=scene.loads[:1])
        path = fd.save_scene(
            scene, fd.Settings(start=0.0, end=1.0, output_step=0.1, method=fd.ROS2(0.1)), tmp_path / "s.toml"
        )
        done = CliRunner().invoke(cli, ["show", str(path), "-o", str(tmp_path / "s.html")])
        assert done.exit_code == 0, done.output
        assert words in done.output
        assert (tmp_path / "s.html").exists()


@needs_browser
@pytest.mark.slow
def test_a_browser_draws_the_scene(tmp_path):
    fd.show(crank(offset=0.2), tmp_path / "a.html")
    page = Page(tmp_path / "profile")
    page.open(tmp_path / "a.html")
    assert page.value("about.bodies.length") == 4
    assert page.value("$('names').checked && getComputedStyle(document.querySelector('footer')).display === 'none'")
    assert page.said == []
    assert page.requests == []
    page.close()
