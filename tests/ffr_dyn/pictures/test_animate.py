"""Animations: what is drawn is R + A(p)(u_0 + scale Phi q), and the files hold it."""

import importlib.util
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from ffr_dyn.pictures.animate import animate
from ffr_dyn.pictures.film import Camera, camera_for, displacements, drawn_points, film
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Quantity, Result, mode_axis
from ffr_prep.body import Surface
from ffr_prep.common.errors import ComputationError, InputError

LENGTH, WIDTH, SPEED = 1.0, 0.1, 2.0


def box_surface(stations=13, modes=1):
    """A slender box along x; mode j bends it in y like sin(j pi x / L) [1/sqrt(kg)]."""
    x = np.repeat(np.linspace(0.0, LENGTH, stations), 4)
    y = np.tile([-0.5, 0.5, 0.5, -0.5], stations) * WIDTH
    z = np.tile([-0.5, -0.5, 0.5, 0.5], stations) * WIDTH
    quads = [
        [4 * i + k, 4 * i + (k + 1) % 4, 4 * (i + 1) + (k + 1) % 4, 4 * (i + 1) + k]
        for i in range(stations - 1)
        for k in range(4)
    ]
    end = 4 * (stations - 1)
    quads += [[3, 2, 1, 0], [end, end + 1, end + 2, end + 3]]
    triangles = [[q[a], q[b], q[c]] for q in quads for a, b, c in ((0, 1, 2), (0, 2, 3))]
    Phi = np.zeros((4 * stations, 3, modes))
    for j in range(modes):
        Phi[:, 1, j] = np.sin((j + 1) * np.pi * x / LENGTH)
    return Surface(np.stack([x, y, z], axis=1), triangles, Phi)


def euler_parameters(rotation):
    """Scalar first, on both sheets by turns: p and -p are the same rotation."""
    p = np.roll(rotation.as_quat(), 1, axis=1)
    return p * np.where(np.arange(len(p)) % 3 == 0, -1.0, 1.0)[:, None]


def rotating_box(axis=(0.0, 0.0, 1.0), amplitude=0.01, rows=21, modes=1):
    t = np.linspace(0.0, 1.0, rows)
    rotation = Rotation.from_rotvec(np.outer(SPEED * t, axis))
    quantities = {
        "rod.R": Quantity(0.2 * np.cross(axis, np.outer(t, [1.0, 0.5, 0.3])), "m", (XYZ,)),
        "rod.p": Quantity(euler_parameters(rotation), "1", (EULER_PARAMETERS,)),
    }
    if modes:
        q = amplitude * np.stack([np.sin((j + 5) * t) for j in range(modes)], axis=1)
        quantities["rod.q"] = Quantity(q, "m sqrt(kg)", (mode_axis("rod", modes),))
    tip = quantities["rod.R"].values + rotation.apply([LENGTH, 0.0, 0.0])
    quantities["rod.tip.position"] = Quantity(tip, "m", (XYZ,))
    return Result(t, quantities, {"rod": box_surface(modes=modes)})


def pendulum_of_markers():
    """A body without a surface, known by four markers on a line, named in another order than they lie."""
    t = np.linspace(0.0, 1.0, 11)
    line = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    places = {"tip": 3.0, "root": 0.0, "middle": 2.0, "quarter": 1.0}
    quantities = {
        "arm.R": Quantity(line, "m", (XYZ,)),
        "arm.p": Quantity(np.tile([1.0, 0, 0, 0], (11, 1)), "1", (EULER_PARAMETERS,)),
    }
    quantities |= {f"arm.{name}.position": Quantity(place * line, "m", (XYZ,)) for name, place in places.items()}
    return Result(t, quantities)


def without(result, name):
    return replace(result, quantities={key: value for key, value in result.quantities.items() if key != name})


# ---- the law ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [0.0, 1.0, 20.0])
@pytest.mark.parametrize("axis", [(0, 0, 1), (0.6, 0, 0.8)])
def test_points_are_drawn_where_the_formula_puts_them(scale, axis):
    result = rotating_box(axis, modes=2)
    shown = film(result, result.time.size, scale=scale)
    (solid,) = shown.solids
    u_0, Phi = solid.surface.points, solid.surface.Phi
    for k, t in enumerate(result.time):
        turned = Rotation.from_rotvec(SPEED * t * np.array(axis))
        u = u_0 + scale * np.einsum("pij,j->pi", Phi, result["rod.q"][k])
        np.testing.assert_allclose(drawn_points(solid, k, scale), result["rod.R"][k] + turned.apply(u), atol=1e-14)
        elastic = np.linalg.norm(Phi @ result["rod.q"][k], axis=1)
        np.testing.assert_allclose(displacements(solid, k), elastic, atol=1e-16)


def test_between_rows_the_body_turns_without_growing():
    result = rotating_box((0.6, 0, 0.8), amplitude=0.0)
    (solid,) = film(result, 101).solids
    size = np.linalg.norm(np.diff(solid.surface.points, axis=0), axis=1)
    for k in range(101):
        points = drawn_points(solid, k, 1.0)
        np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), size, rtol=1e-12)
        exact = Rotation.from_rotvec(SPEED * 0.01 * k * np.array([0.6, 0, 0.8])).as_matrix()
        # Halfway between rows 0.1 rad apart, normalised linear interpolation is off by less than 1e-5 rad.
        np.testing.assert_allclose(solid.A[k], exact, atol=1e-5)


@pytest.mark.parametrize("axis", [(0.6, 0, 0.8), (0, 0, 0)])
def test_the_whole_motion_fits_in_the_box_of_the_film(axis):
    shown = film(rotating_box(axis, amplitude=0.05), 40, scale=3.0)
    (solid,) = shown.solids
    drawn = np.concatenate([drawn_points(solid, k, 3.0) for k in range(40)])
    assert (drawn >= shown.low).all()
    assert (drawn <= shown.high).all()
    assert np.linalg.norm(np.ptp(drawn, axis=0)) > 0.6 * shown.size


@pytest.mark.parametrize("amplitude", [1e-7, 3e-5, 2e-4, 1.1e-3, 4e-3, 9e-3])
def test_the_automatic_scale_is_round_and_shows_about_five_per_cent(amplitude):
    shown = film(rotating_box(amplitude=amplitude), 20, scale="auto")
    digits = f"{shown.scale:.10e}".split("e")[0]
    assert float(digits) in (1.0, 2.0, 5.0)
    share = shown.scale * shown.deflection / shown.solids[0].size
    assert 0.05 / np.sqrt(2.5) <= share <= 0.05 * np.sqrt(2.5)


def test_the_automatic_scale_never_reduces_and_leaves_rigid_bodies_alone():
    assert film(rotating_box(amplitude=0.2), 5, scale="auto").scale == 1.0
    assert film(rotating_box(modes=0), 5, scale="auto").scale == 1.0
    assert film(rotating_box(amplitude=0.0), 5, scale="auto").scale == 1.0


# ---- camera -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("normal", "right", "up"), [("z", "x", "y"), ("y", "x", "z"), ("x", "y", "z")])
def test_planar_motion_is_seen_from_its_front(normal, right, up):
    unit = dict(zip("xyz", np.eye(3), strict=True))
    _, to_the_right, upwards = camera_for(film(rotating_box(unit[normal], amplitude=0.0), 20)).axes()
    assert to_the_right @ unit[right] > 0.95
    assert upwards @ unit[up] > 0.95


def test_spatial_motion_is_seen_from_a_corner():
    direction, _, up = camera_for(film(rotating_box((0.6, 0, 0.8)), 20)).axes()
    assert np.abs(direction).min() > 0.3
    assert up[2] > 0.7


def test_the_axes_of_a_camera_are_orthonormal_and_right_handed():
    direction, right, up = Camera((1.0, 2.0, 3.0), (0.0, 1.0, 1.0)).axes()
    np.testing.assert_allclose(
        np.stack([right, up, direction]) @ np.stack([right, up, direction]).T, np.eye(3), atol=1e-15
    )
    np.testing.assert_allclose(np.cross(right, up), direction, atol=1e-15)
    with pytest.raises(InputError, match="must not be parallel"):
        Camera((0.0, 2.0, 0.0), (0.0, 1.0, 0.0)).axes()


# ---- bodies without a surface, words in the picture ----------------------------------------------------------------


def test_a_body_without_a_surface_joins_neighbouring_markers():
    (link,) = film(pendulum_of_markers(), 11).links
    places = [3, 0, 2, 1]
    assert {frozenset((places[a], places[b])) for a, b in link.pairs} == {frozenset((k, k + 1)) for k in range(3)}
    np.testing.assert_allclose(link.points[4], np.outer(places, pendulum_of_markers()["arm.R"][4]), atol=1e-15)


def test_a_single_marker_is_joined_to_the_origin_of_the_body():
    result = pendulum_of_markers()
    for name in ("tip", "root", "quarter"):
        result = without(result, f"arm.{name}.position")
    (link,) = film(result, 11).links
    np.testing.assert_allclose(link.points[:, 1], 2 * link.points[:, 0], atol=1e-15)
    assert link.pairs.tolist() == [[0, 1]]


def test_a_body_whose_markers_are_at_one_place_is_a_cross_along_its_axes():
    """A dot would show nothing of its rotation."""
    result = pendulum_of_markers()
    for name in ("tip", "root", "quarter", "middle"):
        result = without(result, f"arm.{name}.position")
    (dot,) = film(result, 11).links
    assert len(np.unique(dot.points[4], axis=0)) == 1
    (link,) = film(replace(result, attributes={**result.attributes, "length": 0.5}), 11).links
    arms = link.points[4] - result["arm.R"][4]
    assert sorted(map(tuple, link.pairs.tolist())) == [(0, k) for k in range(1, 7)]
    np.testing.assert_allclose(np.linalg.norm(arms[1:], axis=1), 0.15, rtol=1e-12)
    np.testing.assert_allclose(arms[1:4], 0.15 * link.A[4].T, atol=1e-15)
    np.testing.assert_allclose(arms[4:], -arms[1:4], atol=1e-15)


def test_time_and_scale_are_written_with_fitting_digits():
    shown = film(rotating_box(), 5, scale=20)
    assert [shown.clock(k) for k in (0, 1)] == ["0.00 s", "0.25 s"]
    assert shown.scale_note() == "deformation × 20"
    assert film(rotating_box(), 5).scale_note() == ""
    fast = rotating_box()
    assert film(replace(fast, time=fast.time * 3e-3), 5).clock(1) == "0.75 ms"


# ---- what is refused ----------------------------------------------------------------------------------------------


def spoiled():
    result = rotating_box()
    q = np.array(result["rod.q"])
    q[3] = np.nan
    return replace(result, quantities={**result.quantities, "rod.q": replace(result.quantities["rod.q"], values=q)})


@pytest.mark.parametrize(
    ("make", "settings", "message"),
    [
        (rotating_box, {"scale": -1.0}, "scale is -1.0"),
        (rotating_box, {"scale": np.inf}, "scale is inf"),
        (rotating_box, {"scale": "big"}, "scale is 'big'"),
        (rotating_box, {"fps": 0}, "fps is 0"),
        (rotating_box, {"fps": 60}, "fps is 60"),
        (rotating_box, {"duration": 0.0}, "duration is 0.0"),
        (rotating_box, {"size": (10, 640)}, r"size is \(10, 640\)"),
        (rotating_box, {"colour": "red"}, "colour is 'red'; it must be one of: deformation, body"),
        (rotating_box, {"traces": ["rod.tp"]}, r"did you mean .*rod\.tip\.position"),
        (rotating_box, {"camera": Camera((0, 0, 1), (0, 0, 2))}, "must not be parallel"),
        (spoiled, {}, "'rod' has poses or elastic coordinates that are not finite"),
        (lambda: Result([0.0], {}), {}, "the result has no body"),
        (lambda: Result([], {}), {}, "no rows"),
        (
            lambda: replace(rotating_box(), geometry={"rod": box_surface(modes=2)}),
            {},
            "has 1 elastic coordinates, but its surface has 2 mode shapes",
        ),
        (lambda: without(rotating_box(), "rod.q"), {}, r"no quantity 'rod\.q'"),
    ],
)
def test_what_cannot_be_animated_is_named(tmp_path, make, settings, message):
    with pytest.raises(InputError, match=message):
        animate(make(), tmp_path / "a.html", **settings)
    assert not list(tmp_path.iterdir())


def test_other_kinds_of_file_are_refused(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"a\.avi: animations are written as \.gif, \.mp4, \.html"):
        animate(rotating_box(), tmp_path / "a.avi")
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(InputError, match="MP4 needs the package imageio-ffmpeg"):
        animate(rotating_box(), tmp_path / "a.mp4")


# ---- GIF ----------------------------------------------------------------------------------------------------------

SMALL = {"size": (240, 160), "duration": 0.5, "fps": 20}


def filmed(result, path, **settings):
    """The path of a film."""
    animate(result, path, **settings)
    return path


def frames_of(path):
    with Image.open(path) as image:
        frames, delays = [], []
        for k in range(image.n_frames):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
            delays.append(image.info["duration"])
    return frames, delays


def test_a_gif_has_the_frames_the_speed_and_the_size_asked_for(tmp_path):
    path = tmp_path / "new" / "a.gif"
    animate(rotating_box(), path, size=(240, 160), duration=1.0, fps=12, scale="auto")
    frames, delays = frames_of(path)
    assert len(frames) == 12
    assert sum(delays) == 1000
    assert set(delays) == {80, 90}
    for before, after in pairwise(frames):
        assert before.shape == (160, 240, 3)
        assert (np.abs(before - after).max(axis=2) > 60).sum() > 20
    assert (frames[0][80, 3] == 255).all()


def test_the_same_result_makes_the_same_gif(tmp_path):
    first = filmed(rotating_box(), tmp_path / "a.gif", **SMALL).read_bytes()
    assert first == filmed(rotating_box(), tmp_path / "b.gif", **SMALL).read_bytes()


def middle_of(frames):
    """The part of the pictures where the body is: no text, no axes, no bar."""
    return np.stack(frames)[:, 25:125, 40:195]


def test_deformation_is_coloured_and_the_undeformed_body_is_a_ghost(tmp_path):
    still = rotating_box((0.0, 0.0, 0.0), amplitude=0.1)
    plain = middle_of(frames_of(filmed(still, tmp_path / "a.gif", colour="body", **SMALL))[0])
    coloured = middle_of(frames_of(filmed(still, tmp_path / "b.gif", **SMALL))[0])
    alone = middle_of(frames_of(filmed(still, tmp_path / "c.gif", scale=0.0, colour="body", **SMALL))[0])

    def colours(images):
        saturation = np.ptp(images, axis=-1)
        return (saturation > 90).sum()

    assert colours(plain) == 0
    assert colours(coloured) > 200
    grey = (np.ptp(plain, axis=-1) < 6) & (plain.max(axis=-1) > 150) & (plain.max(axis=-1) < 240)
    grey_alone = (np.ptp(alone, axis=-1) < 6) & (alone.max(axis=-1) > 150) & (alone.max(axis=-1) < 240)
    assert grey.sum() > 5 * grey_alone.sum() + 100


def outlines(images):
    """Left, right, top and bottom edge [pixels] of what is not white in each picture."""
    edges = []
    for image in images:
        rows, columns = np.nonzero((image < 200).any(axis=-1))
        edges.append([columns.min(), columns.max() + 1, rows.min(), rows.max() + 1])
    return np.array(edges, dtype=float)


@pytest.mark.parametrize("amplitude", [0.0, 0.1])
def test_bodies_are_pictured_at_the_pose_and_with_the_deformation_of_the_formula(amplitude, monkeypatch):
    from ffr_dyn.pictures import render

    monkeypatch.setattr(render, "_caption", lambda *_: lambda _: None)
    monkeypatch.setattr(render.pv.Plotter, "add_axes", lambda *_, **__: None)
    shown = film(rotating_box(amplitude=amplitude), 9, colour="body")
    camera = camera_for(shown)
    seen = outlines(render.pictures(shown, camera, (240, 160)))
    _, right, up = camera.axes()
    points = [drawn_points(shown.solids[0], k, 1.0) for k in range(9)]
    across, down = (np.array([[(p @ a).min(), (p @ a).max()] for p in points]) for a in (right, -up))
    # A parallel projection: pixels = offset + pixels per metre * metres, with one factor for both directions.
    metres = np.concatenate([across, down], axis=1)
    unknowns = np.stack([metres.ravel(), np.tile([1, 1, 0, 0], 9), np.tile([0, 0, 1, 1], 9)], axis=1)
    fitted = np.linalg.lstsq(unknowns, seen.ravel(), rcond=None)[0]
    assert fitted[0] > 60
    np.testing.assert_allclose(unknowns @ fitted, seen.ravel(), atol=2.0)
    assert np.ptp(seen, axis=0).max() > 40


def test_markers_and_traces_are_drawn(tmp_path):
    def orange(frames):
        red, green, blue = np.moveaxis(middle_of(frames), -1, 0)
        return ((red > 180) & (green < 130) & (blue < 60)).sum(axis=(1, 2))

    bare = filmed(pendulum_of_markers(), tmp_path / "a.gif", **SMALL)
    traced = filmed(pendulum_of_markers(), tmp_path / "b.gif", traces=["arm.tip"], **SMALL)
    assert orange(frames_of(bare)[0]).max() == 0
    assert orange(frames_of(traced)[0]).min() > 30
    assert (middle_of(frames_of(bare)[0]) < 200).any(axis=-1).sum() > 500


def test_a_result_at_one_time_is_one_picture(tmp_path):
    assert len(frames_of(filmed(rotating_box(rows=1), tmp_path / "a.gif", **SMALL))[0]) == 1


def test_a_machine_that_cannot_render_is_told_what_it_lacks(tmp_path, monkeypatch):
    from ffr_dyn.pictures import render

    (tmp_path / "a.gif").write_bytes(b"old")

    def fail(**_):
        raise RuntimeError("no EGL")

    monkeypatch.setattr(render.pv, "Plotter", fail)
    with pytest.raises(ComputationError, match=r"no EGL.*libegl1 libgl1-mesa-dri libgl1.*\.html"):
        animate(rotating_box(), tmp_path / "a.gif", **SMALL)
    monkeypatch.undo()
    monkeypatch.setattr(render, "_grab", lambda *_: np.zeros((160, 240, 3), np.uint8))
    with pytest.raises(ComputationError, match="pictures stay black"):
        animate(rotating_box(), tmp_path / "a.gif", **SMALL)
    assert (tmp_path / "a.gif").read_bytes() == b"old"
    assert [item.name for item in tmp_path.iterdir()] == ["a.gif"]


def test_nothing_heavy_is_loaded_before_it_is_needed():
    heavy = {"pyvista", "vtkmodules", "plotly", "matplotlib"}
    code = f"import sys, ffr_dyn.pictures.animate; sys.exit(str({heavy} & sys.modules.keys() or ''))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == ""
