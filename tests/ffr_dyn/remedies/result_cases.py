"""What result files, stress, pictures and real time say."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import h5py
import numpy as np
from remedy import CLOUD, HINGED, command, run, stressed
from said import Case
from synthetic import cloud

from ffr_dyn.analyses.inverse import inverse
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import ROS2
from ffr_dyn.pictures.animate import animate
from ffr_dyn.pictures.export import export
from ffr_dyn.pictures.film import Camera, film
from ffr_dyn.pictures.histories import plot, plot_path
from ffr_dyn.pictures.stress_report import stress_report
from ffr_dyn.realtime.deadline import measure_steps
from ffr_dyn.results.file import ResultWriter, load_result, save_result
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.results.stress import hot_spots, peaks, section_forces, stressed_surface, tensors
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import SectionMeasurement, StressMeasurement
from ffr_dyn.scene.stress_sensors import measure
from ffr_prep.body import BeamForces, FlexibleBody

p = partial
ROWS = Result(np.zeros(1), {"a": Quantity(np.zeros((1, 3)), "m", (Axis("xyz", ("x", "y", "z")),))})

# ---- files --------------------------------------------------------------------------------------------------------------


def read(change: Callable[[Path], object]) -> Result:
    """A result file, after something has happened to it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        save_result(ROWS, path)
        change(path)
        return load_result(path)


def piped(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def marked(**attributes: object) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        with h5py.File(path, "r+", locking=False) as file:
            file.attrs.update(attributes)

    return change


def written(values: dict[str, np.ndarray], begun: str = "", lost: str = "") -> None:
    """Rows of a result. What the writer uses of the system has no space from its beginning, or from its rows on."""
    with TemporaryDirectory() as folder:
        with failing(begun):
            writer = ResultWriter(Path(folder) / "run.nc", ROWS)
        with writer, failing(lost):
            writer.append(np.ones(1), values)
            writer.close()


def failing(name: str) -> AbstractContextManager[object]:
    return patch.object(os, name, no_space) if name else nullcontext()


def no_space(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


ROW = {"a": np.zeros((1, 3))}
FILES = [
    Case(p(read, piped), p(read, lambda path: None)),
    Case(p(read, lambda path: path.write_bytes(path.read_bytes()[:100])), p(read, lambda path: save_result(ROWS, path))),
    Case(p(read, marked(ffr_format="else")), p(read, lambda path: save_result(ROWS, path))),
    Case(p(read, marked(ffr_format_version=99)), p(read, marked())),
    Case(p(written, {}), p(written, ROW)),
    Case(p(written, {"a": np.zeros((1, 2))}), p(written, ROW)),
    Case(p(written, ROW, begun="posix_fallocate"), p(written, ROW)),
    Case(p(written, ROW, lost="posix_fallocate"), p(written, ROW)),
    Case(p(written, ROW, lost="fsync"), p(written, ROW)),
    Case(lambda: replace(ROWS, quantities={"a": ROWS.quantity("a"), "b": turned("xyz")}),
         lambda: replace(ROWS, quantities={"a": ROWS.quantity("a"), "b": turned("zyx")})),
]  # fmt: skip


def turned(name: str) -> Quantity:
    return Quantity(np.zeros((1, 3)), "m", (Axis(name, ("z", "y", "x")),))


# ---- stress -------------------------------------------------------------------------------------------------------------


def beams(model: FlexibleBody) -> FlexibleBody:
    rng, n = np.random.default_rng(2), model.n
    forces = BeamForces(rng.uniform(size=(4, 3, 3)), np.tile(np.eye(3), (4, 1, 1)), rng.normal(size=(4, 3, 6, n)))
    return replace(model, surface=replace(model.surface, beams=forces))


def scene(model: FlexibleBody, **more: object) -> Scene:
    return replace(CLOUD, bodies=(Body("cloud", model, q=(1e-3, 0)),), plane="none", **more)


MODEL = beams(stressed(cloud(2)))
CORNER = tuple(MODEL.surface.points[0].tolist())


@cache
def result(of: FlexibleBody = MODEL) -> Result:
    return run(scene(of), end=0.02)


@cache
def plain() -> Result:
    return run(CLOUD, end=0.02)


def lost() -> Result:
    q = Quantity(np.full((3, 2), np.nan), "m sqrt(kg)", result().quantity("cloud.q").axes)
    return replace(result(), quantities={**result().quantities, "cloud.q": q})


def sensed(sensor: object, of: FlexibleBody = MODEL) -> Result:
    return run(scene(of, measurements=(sensor,)), end=0.02)


def anisotropic() -> FlexibleBody:
    return replace(MODEL, surface=replace(MODEL.surface, moduli=0 * MODEL.surface.moduli))


def driven() -> Scene:
    return scene(MODEL, drivers=(Driver("motor", "hinge", polynomial(0, 1.0)),))


AT = StressMeasurement("s", "cloud", CORNER)
SECTION = SectionMeasurement("s", "cloud", CORNER)
STRESS = [
    Case(lambda: hot_spots(plain()), lambda: hot_spots(result())),
    Case(lambda: stressed_surface(result(), "clod"), lambda: stressed_surface(result(), "cloud")),
    Case(lambda: peaks(lost(), "cloud"), lambda: peaks(result(), "cloud")),
    Case(lambda: tensors(plain().geometry["cloud"], np.zeros((1, 2))),
         lambda: tensors(result().geometry["cloud"], np.zeros((1, 2)))),
    Case(lambda: hot_spots(result(), count=0), lambda: hot_spots(result(), count=1)),
    Case(lambda: section_forces(plain(), "cloud", 0), lambda: section_forces(result(), "cloud", 0)),
    Case(lambda: section_forces(result(), "cloud", 4), lambda: section_forces(result(), "cloud", 3)),
    Case(p(measure, "misses"), p(measure, "von-mises")),
    Case(lambda: sensed(replace(AT, what="strain"), anisotropic()),
         lambda: sensed(replace(AT, what="stress"), anisotropic())),
    Case(lambda: sensed(replace(AT, point=(900.0, 0, 0))), lambda: sensed(AT)),
    Case(lambda: sensed(AT, cloud(2)), lambda: sensed(AT)),
    Case(lambda: sensed(SECTION, stressed(cloud(2))), lambda: sensed(SECTION)),
    Case(lambda: hot_spots(kinematic(driven(), end=0.02, output_step=0.01)),
         lambda: hot_spots(inverse(driven(), end=0.02, output_step=0.01))),
]  # fmt: skip

# ---- pictures -----------------------------------------------------------------------------------------------------------


def reported(of: Result, **more: object) -> None:
    with TemporaryDirectory() as folder:
        stress_report(of, folder, **more)


def pictured(draw: Callable[..., object], *given: object, name: str = "a.png", **more: object) -> None:
    with TemporaryDirectory() as folder:
        draw(result(), *given, Path(folder) / name, **more)


def told(wrong: str, right: str) -> Case:
    """A command on the result file run.nc."""

    def said(line: str) -> None:
        with TemporaryDirectory() as folder:
            path = save_result(result(), Path(folder) / "run.nc")
            command(line.replace("run.nc", str(path)))

    return Case(p(said, wrong), p(said, right))


def shown(of: Callable[[], Result], **more: object) -> object:
    return film(of(), 3, **more)


def animated(name: str, **more: object) -> None:
    pictured(animate, name=name, **{"duration": 0.1, "fps": 20.0, "size": (64, 64), **more})


def without(*names: str) -> Result:
    """The result without some quantities."""
    kept = {name: quantity for name, quantity in result().quantities.items() if name not in names}
    return replace(result(), quantities=kept, geometry={})


def emptied() -> Result:
    kept = {name: replace(q, values=q.values[:0]) for name, q in result().quantities.items()}
    return replace(result(), time=np.zeros(0), quantities=kept)


def cut() -> Result:
    """A surface with one mode less."""
    surface = result().geometry["cloud"]
    return replace(
        result(), geometry={"cloud": replace(surface, Phi=surface.Phi[:, :, :1], stress=None, moduli=None, beams=None)}
    )


def bare() -> None:
    """A machine without the package for films."""
    with patch("importlib.util.find_spec", return_value=None):
        animated("film.mp4")


def blind() -> None:
    """A machine that cannot render."""
    with patch("ffr_dyn.pictures.render.pv.Plotter", side_effect=RuntimeError("no display")):
        animated("film.gif")


def both() -> Result:
    return run(Scene((Body("one", MODEL), Body("two", MODEL))), end=0.02)


def for_matlab(names: list[str] | None = None) -> None:
    """What MATLAB takes for one name."""
    two = dict.fromkeys(("rod-1.R", "rod_1.R"), Quantity(np.zeros(1), "m"))
    with TemporaryDirectory() as folder:
        export(Result(np.zeros(1), two), Path(folder) / "a.mat", names)


POSITION = "cloud.b.position"
PICTURES = [
    Case(p(pictured, plot, ()), p(pictured, plot, (POSITION,))),
    Case(p(pictured, plot, POSITION, against=POSITION), p(pictured, plot, POSITION, against=f"{POSITION}.x")),
    Case(p(pictured, plot, POSITION, name="a.bmp"), p(pictured, plot, POSITION)),
    Case(p(pictured, plot_path, "cloud.b", plane="xx"), p(pictured, plot_path, "cloud.b", plane="xy")),
    Case(lambda: plot_path(emptied(), "cloud.b", "a.png"), p(pictured, plot_path, "cloud.b")),
    Case(p(animated, "film.avi"), p(animated, "film.gif")),
    Case(p(animated, "film.gif", fps=100.0), p(animated, "film.gif", fps=50.0)),
    Case(p(animated, "film.gif", duration=-1.0), p(animated, "film.gif")),
    Case(p(animated, "film.gif", size=(8, 8)), p(animated, "film.gif")),
    Case(bare, p(animated, "film.gif")),
    Case(p(animated, "film.gif", plots=(POSITION,)), p(animated, "film.html", plots=(POSITION,))),
    Case(p(animated, "film.gif", arrows=("nothing",)), p(animated, "film.gif", arrows=())),
    Case(blind, p(animated, "film.html")),
    Case(p(shown, emptied), p(shown, result)),
    Case(p(shown, result, scale=-1.0), p(shown, result, scale=1.0)),
    Case(p(shown, result, limit=-1.0), p(shown, result, limit=1.0)),
    Case(p(shown, p(without, "cloud.R")), p(shown, result)),
    Case(p(shown, result, colour="red"), p(shown, result, colour="body")),
    Case(p(shown, plain, colour="von-mises"), p(shown, result, colour="von-mises")),
    Case(p(shown, cut), p(shown, result)),
    Case(p(shown, lost), p(shown, result)),
    Case(Camera((0, 0, 1), (0, 0, 1)).axes, Camera((1, 0, 0), (0, 0, 1)).axes),
    Case(
        lambda: reported(both(), points=[CORNER]),
        lambda: reported(both(), points=[CORNER], body="two"),
    ),
    Case(lambda: reported(result(), since=9.0), lambda: reported(result(), since=0.01)),
    told("stress run.nc --point 1,2 -o out", f"stress run.nc --point {','.join(map(str, CORNER))} -o out"),
    told("animate run.nc --scale big -o film.html", "animate run.nc --scale 2 -o film.html"),
    Case(p(for_matlab), p(for_matlab, ["rod-1.R"])),
    Case(p(shown, lambda: ROWS), p(pictured, plot, POSITION)),
]
DEADLINES = [
    Case(p(measure_steps, HINGED, ROS2(1e-3), duration=0.0), p(measure_steps, HINGED, ROS2(1e-3), duration=0.01)),
]
CASES = FILES + STRESS + PICTURES + DEADLINES
