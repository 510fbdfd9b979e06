"""Pictures of mode shapes: one each, and a sheet with all of them.

The body is rendered off-screen by VTK, in parallel projection; title, colour bar, axes and length bar are set around it
by matplotlib. No display is needed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ffr_prep.body import FlexibleBody, Surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import check_folder, replacing

COLOUR_MAP = "viridis"
_LARGEST = 0.08  # of the diagonal of the body: deflection that is seen well and still looks like the body
_SHARP = 30.0  # degrees between faces that count as an edge
_MARGIN = 1.06
_PIXELS = (1600, 900)
_DPI = 150
_GHOST, _GHOST_EDGES, _INK = "#e3e5e9", "#9aa0a8", "#222222"
_PACKAGES = "libegl1 libgl1-mesa-dri libgl1"


@dataclass(frozen=True)
class Camera:
    """Parallel projection: unit vectors (3,) to the right, up and towards the viewer; what is seen, in metres.

    centre : (3,) point in the middle of the picture [m]; height : of the picture [m]
    """

    right: Array
    up: Array
    towards: Array
    centre: Array
    height: float


def mode_pictures(
    body: FlexibleBody, folder: str | Path, modes: Sequence[int] | None = None, scale: float | str = "auto"
) -> list[Path]:
    """Draw mode shapes into a folder, a picture for each mode and the sheet "modes.png"; returns the files.

    modes : numbers from 1; the first six without it
    scale : factor on the mode shapes [m sqrt(kg)], or "auto" for one that makes each shape well visible

    Raises InputError for a body without modes or surface or for modes it does not have, ComputationError where this
    machine cannot render.

    >>> fp.mode_pictures(body, "modes")
    """
    numbers = list(range(1, min(body.n, 6) + 1)) if modes is None else list(modes)
    surface, folder = _drawable(body, numbers), Path(folder)
    check_folder("the folder of pictures", folder)
    factors = [_factor(surface, k, scale) for k in numbers]
    shapes = [surface.Phi[:, :, k - 1] for k in numbers]
    camera = camera_of(surface.points, [factor * shape for factor, shape in zip(factors, shapes, strict=True)])
    images = list(_render(surface, shapes, factors, camera))
    folder.mkdir(parents=True, exist_ok=True)
    paths = list[Path]()
    for k, shape, factor, image in zip(numbers, shapes, factors, images, strict=True):
        paths.append(folder / f"mode_{k:02d}.png")
        save_figure(_picture(body, k, shape, factor, image, camera), paths[-1])
    paths.append(folder / "modes.png")
    save_figure(_sheet(body, numbers, images, camera), paths[-1])
    return paths


def _drawable(body: FlexibleBody, numbers: Sequence[int]) -> Surface:
    if body.surface is None:
        raise InputError(f"body {body.name!r} has no surface to draw; make it again with ffr-prep reduce")
    wrong = [k for k in numbers if not 1 <= k <= body.n]
    if wrong or not numbers:
        raise InputError(
            f"body {body.name!r} has {body.n} modes, numbered from 1; mode {wrong or 'none'} was asked for"
        )
    return body.surface


def _factor(surface: Surface, k: int, scale: float | str) -> float:
    if scale != "auto":
        if not (isinstance(scale, Real) and np.isfinite(scale) and scale != 0):
            raise InputError(
                f"the scale of the mode shapes is {scale!r}; it must be a number other than zero, or 'auto'"
            )
        return float(scale)
    largest = np.linalg.norm(surface.Phi[:, :, k - 1], axis=1).max()
    return float(_LARGEST * np.linalg.norm(np.ptp(surface.points, axis=0)) / largest)


# ---- view ---------------------------------------------------------------------------------------------------------


def camera_of(points: Array, displacements: Sequence[Array]) -> Camera:
    """Oblique view of the broad side of the body: its longest axis to the right, its thinnest towards the viewer."""
    towards_side, vertical = _axes(np.ptp(points, axis=0))
    horizontal = np.cross(vertical, towards_side)
    azimuth, elevation = np.radians(-32.0), np.radians(26.0)
    level = np.cos(azimuth) * towards_side + np.sin(azimuth) * horizontal
    towards = np.cos(elevation) * level + np.sin(elevation) * vertical
    right = np.cross(vertical, towards) / np.linalg.norm(np.cross(vertical, towards))
    up = np.cross(towards, right)
    seen = np.concatenate([points, *(points + moved for moved in displacements)])
    across, along = seen @ right, seen @ up
    middle = [(values.max() + values.min()) / 2 for values in (across, along, seen @ towards)]
    height = _MARGIN * max(np.ptp(along), np.ptp(across) * _PIXELS[1] / _PIXELS[0])
    return Camera(right, up, towards, np.array([right, up, towards]).T @ middle, float(height))


def _axes(extent: Array) -> tuple[Array, Array]:
    """Axes of the body that point towards the viewer and up; z is up unless it is the thin direction."""
    order = np.argsort(-np.round(extent / extent.max(), 1), kind="stable")
    thin = 1 if extent.min() > 0.8 * extent.max() else order[2]
    up = 2 if thin != 2 else order[1]
    sign = 1.0 if thin == 2 else -1.0
    return sign * np.eye(3)[thin], np.eye(3)[up]


# ---- rendering ----------------------------------------------------------------------------------------------------


def _render(surface: Surface, shapes: Sequence[Array], factors: Sequence[float], camera: Camera) -> Iterator[Array]:
    """(height, width, 3) pictures of the deformed body, coloured by displacement, before its undeformed ghost."""
    pv = off_screen()
    faces = np.hstack([np.full((len(surface.triangles), 1), 3), surface.triangles]).ravel()
    ghost = pv.PolyData(surface.points, faces)
    edges = ghost.extract_feature_edges(_SHARP, boundary_edges=False, manifold_edges=False)
    look = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": _SHARP}
    behind = shot(pv, camera, [(ghost, {"color": _GHOST, **look}), (edges, {"color": _GHOST_EDGES, "line_width": 2})])
    for shape, factor in zip(shapes, factors, strict=True):
        deformed = pv.PolyData(surface.points + factor * shape, faces)
        deformed["displacement"] = np.linalg.norm(shape, axis=1)
        colours = {"scalars": "displacement", "cmap": COLOUR_MAP, "clim": [0.0, _top(shape)], "specular": 0.15}
        yield _over(shot(pv, camera, [(deformed, colours | look | {"show_scalar_bar": False})]), behind)


def shot(pv: Any, camera: Camera, shown: Sequence[tuple[Any, dict[str, Any]]], *, smooth: bool = True) -> Array:
    """(height, width, 4) picture of meshes with their looks, without a background; ComputationError where VTK fails.

    smooth : edges are; without it every pixel has the colour of one mesh
    """
    try:
        plotter = pv.Plotter(off_screen=True, window_size=_PIXELS, lighting="three lights")
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa") if smooth else plotter.disable_anti_aliasing()
        for mesh, look in shown:
            plotter.add_mesh(mesh, **look)
        _aim(plotter, camera)
        picture = np.asarray(plotter.screenshot(return_img=True, transparent_background=True))
        plotter.close()
    except Exception as error:  # VTK raises nothing more specific
        raise ComputationError(
            f"no picture can be rendered ({error}); on Debian: apt-get install {_PACKAGES}"
        ) from None
    return picture


def _over(front: Array, behind: Array) -> Array:
    """The front picture over the one behind it, over white."""
    picture = np.full((*front.shape[:2], 3), 255.0)
    for layer in (behind, front):
        alpha = layer[..., 3:] / 255.0
        picture = alpha * layer[..., :3] + (1 - alpha) * picture
    return np.round(picture).astype(np.uint8)


def off_screen() -> Any:
    """PyVista, made ready to render without a display; ComputationError where VTK cannot be loaded."""
    if not os.environ.get("DISPLAY"):
        # VTK tries X first and complains; EGL needs no display. It reads the variable when its window is made.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        import pyvista  # here, so that the variable is set before
    except ImportError as error:
        raise ComputationError(f"VTK cannot be loaded ({error}); on Debian: apt-get install {_PACKAGES}") from None
    return pyvista


def _aim(plotter: Any, camera: Camera) -> None:
    plotter.enable_parallel_projection()
    distance = 10 * camera.height
    plotter.camera_position = [camera.centre + distance * camera.towards, camera.centre, camera.up]
    plotter.camera.parallel_scale = camera.height / 2
    plotter.reset_camera_clipping_range()


def _top(shape: Array) -> float:
    return float(np.linalg.norm(shape, axis=1).max())


# ---- page ---------------------------------------------------------------------------------------------------------


def _picture(body: FlexibleBody, k: int, shape: Array, factor: float, image: Array, camera: Camera) -> Figure:
    figure = Figure(figsize=(11.0, 7.0), dpi=_DPI)
    axes = figure.add_axes((0.01, 0.08, 0.86, 0.78))
    _show(axes, image)
    _length_bar(axes, camera, image.shape[0])
    draw_triad(figure.add_axes((0.885, 0.03, 0.11, 0.17)), camera)
    figure.text(0.03, 0.945, f"Mode {k}", fontsize=20, fontweight="bold", color=_INK, va="center")
    figure.text(0.155, 0.945, f"{body.frequencies[k - 1]:.5g} Hz", fontsize=20, color=_INK, va="center")
    note = f"{body.name}: {_conditions(body)}shape drawn × {factor:.3g} m√kg"
    figure.text(0.03, 0.895, note, fontsize=11, color="#555555", va="center")
    colours = ScalarMappable(Normalize(0.0, _top(shape)), COLOUR_MAP)
    bar = figure.colorbar(colours, cax=figure.add_axes((0.895, 0.27, 0.02, 0.55)))
    bar.set_label("displacement per elastic coordinate [1/√kg]", fontsize=11, color=_INK)
    bar.ax.tick_params(labelsize=11)
    bar.outline.set_visible(False)
    return figure


def _sheet(body: FlexibleBody, numbers: Sequence[int], images: Sequence[Array], camera: Camera) -> Figure:
    columns = min(len(numbers), 3 if len(numbers) > 4 else 2)
    rows = -(-len(numbers) // columns)
    figure = Figure(figsize=(5.2 * columns, 0.9 + 3.15 * rows), dpi=_DPI)
    top = 1 - 0.8 / figure.get_figheight()
    grid = figure.add_gridspec(rows, columns, left=0.01, right=0.99, bottom=0.01, top=top, hspace=0.16, wspace=0.03)
    for cell, (k, image) in enumerate(zip(numbers, images, strict=True)):
        axes = figure.add_subplot(grid[cell // columns, cell % columns])
        _show(axes, image)
        axes.set_title(f"Mode {k}:  {body.frequencies[k - 1]:.5g} Hz", fontsize=13, color=_INK, pad=4)
        if cell == 0:
            _length_bar(axes, camera, image.shape[0])
    name = f"{body.name}: mode shapes, {_conditions(body)}"
    title = name + "coloured by displacement, from none (dark) to the largest (bright)"
    figure.text(0.015, 1 - 0.3 / figure.get_figheight(), title, fontsize=12, color=_INK, va="center")
    return figure


def _conditions(body: FlexibleBody) -> str:
    """The reference conditions in words, since modes belong to them."""
    settings = dict(body.provenance.get("reference", {}))
    words = {
        "FixedTo": "fixed to {interface}",
        "SimplySupported": "supported at {pin} and {roller}",
        "MeanAxis": "mean axis",
    }
    return words[settings["type"]].format(**settings) + ", " if settings.get("type") in words else ""


def _show(axes: Any, image: Array) -> None:
    axes.imshow(image, interpolation="lanczos")
    axes.set_axis_off()


def _length_bar(axes: Any, camera: Camera, pixels: int) -> None:
    """A bar of a round length, true for what lies parallel to the picture."""
    width = camera.height * _PIXELS[0] / _PIXELS[1]
    power = 10.0 ** np.floor(np.log10(width / 5))
    length = max(m * power for m in (1, 2, 5) if m * power <= width / 5)
    per_metre = pixels / camera.height
    left, below = 0.03 * _PIXELS[0], 1.01 * _PIXELS[1]
    axes.add_patch(Rectangle((left, below), length * per_metre, 5, color=_INK, lw=0, clip_on=False))
    label = f"{1000 * length:.4g} mm" if length < 1 else f"{length:.4g} m"
    axes.text(left + length * per_metre + 12, below + 3, label, ha="left", va="center", fontsize=11, color=_INK)


def draw_triad(axes: Any, camera: Camera) -> None:
    """The axes of the body frame as seen by the camera."""
    for name, colour, axis in zip("xyz", ("#C0392B", "#1E8449", "#2455A4"), np.eye(3), strict=True):
        tip = np.array([axis @ camera.right, axis @ camera.up])
        axes.annotate("", xy=tip, xytext=(0, 0), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2})
        label = tip * (1 + 0.24 / max(float(np.hypot(*tip)), 0.3))
        axes.text(label[0], label[1], name, color=colour, fontsize=13, ha="center", va="center")
    axes.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal")
    axes.set_axis_off()


def save_figure(figure: Figure, path: Path) -> None:
    """Write the figure as a PNG; an existing file is replaced only by a complete new one."""
    with mpl.rc_context({"font.family": "DejaVu Sans"}):
        FigureCanvasAgg(figure)
        with replacing(path) as part:
            figure.savefig(part, format="png", facecolor="white")
