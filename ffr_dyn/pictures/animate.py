"""Films of a result: a page with a viewer, or GIF and MP4 rendered off-screen by pyvista.

The pictures show the deformed bodies, flexible ones coloured by their elastic displacement beside the translucent
undeformed body, rigid ones plain; time and scale of the deformation are written in the picture. pyvista and matplotlib are
imported only when they are needed.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ffr_dyn.pictures.arrows import loads_named, with_arrows
from ffr_dyn.pictures.connections import connections
from ffr_dyn.pictures.film import Camera, Film, camera_for, film, film_at
from ffr_dyn.pictures.shades import shades
from ffr_dyn.pictures.viewer import Viewer
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import replacing

_SHORTEST, _LONGEST = 3.0, 6.0
_MOST_ROWS = 2000  # of a page


@dataclass(frozen=True)
class _Show:
    """A film and how it is shown: seconds per picture, camera, (width, height)."""

    film: Film
    seconds: float
    camera: Camera
    size: tuple[int, int]


def animate(
    result: Result,
    path: str | Path | None = None,
    *,
    scale: float | str = 1.0,
    fps: int = 25,
    duration: float | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] = (960, 640),
    colour: str = "deformation",
    limit: float | None = None,
    traces: Iterable[str] = (),
    plots: Iterable[str] = (),
    arrows: Iterable[str] = (),
) -> Viewer:
    """A film of the bodies of a result: the viewer, which a notebook shows; written where a path is given.

    path     : .html, the viewer as a page of its own; .gif, .mp4 (needs imageio-ffmpeg), pictures only
    scale    : [1] factor of the drawn deformation at the start; "auto": a round one for deflections of about 5 % of a body
    fps      : pictures per second of playing time, of .gif and .mp4; the viewer shows all rows, of a long result 2000
    duration : playing time [s]; by default the simulated time, but at least 3 s and at most 6 s
    camera   : by default chosen from the motion (`ffr_dyn.pictures.film.camera_for`)
    size     : width and height of the picture [pixels], even numbers for .mp4; the viewer fills its window
    colour   : "deformation": flexible bodies by elastic displacement; a measure of stress or strain such as "von-mises"
               (`ffr_dyn.scene.stress_sensors.MEASURES`): bodies with stress modes by it; "body": every body in a colour of
               its own. The viewer offers them all, and speed
    limit    : end of the colour bar [m, Pa or 1]; the largest value of the film when not given
    traces   : markers ("rod.small_eye") whose paths are drawn
    plots    : quantities ("crank_pin.force", "rod.tip.position.x") that the viewer plots beside the motion
    arrows   : joints, forces and motors ("crank_pin", "*") whose forces and moments are drawn, in pictures and, at the
               start, in the viewer, which can show all

    An existing file is replaced only by a complete new one. Raises InputError for settings or a result that cannot be
    drawn, ComputationError when this machine cannot render.

    Example: ``fd.animate(result, "out/motion.html", scale=50, plots=["crank_pin.force"])``

    >>> fd.animate(result, "film.html", scale="auto")
    """
    target = None if path is None else Path(path)
    write = None if target is None else _writer(target)
    _check_settings(fps, duration, size)
    title, view = str(result.attributes.get("title", "")), camera and camera.axes() and camera
    how: dict[str, Any] = {"scale": scale, "traces": tuple(traces), "colour": colour, "limit": limit}
    playing, frames = _pace(result, fps, duration)
    plots, arrows = tuple(plots), tuple(arrows)
    make = partial(_page, result, title, view, playing, plots, arrows, how)
    if target and write:
        _check_alone(target, plots)
        shown = with_arrows(film(result, frames, **how), connections(result), result.time, arrows)
        with replacing(target) as part:
            write(_Show(shown, playing / frames, view or camera_for(shown), size), part)
        return Viewer(make, title)
    text = make()
    viewer = Viewer(lambda: text, title)
    if target:
        viewer.save(target)
    return viewer


def _page(
    result: Result,
    title: str,
    camera: Camera | None,
    playing: float,
    plots: tuple[str, ...],
    arrows: tuple[str, ...],
    how: dict[str, Any],
) -> str:
    from ffr_dyn.pictures.page import Shown, page  # here, because matplotlib is slow to load

    result = _thinned(result)
    shown = film_at(result, result.time, **how)
    beside = connections(result)
    seen = loads_named(beside, arrows)
    content = Shown(shown, beside, shades(shown, how["colour"]), title, result, plots, arrows=seen)
    return page(content, camera or camera_for(shown), playing)


def _thinned(result: Result) -> Result:
    """At most so many rows as a page holds, the first and the last among them."""
    if result.time.size <= _MOST_ROWS:
        return result
    rows = np.unique(np.linspace(0, result.time.size - 1, _MOST_ROWS).astype(int))
    kept = {name: replace(of, values=of.values[rows]) for name, of in result.quantities.items()}
    return replace(result, time=result.time[rows], quantities=kept)


def _writer(path: Path) -> Callable[[_Show, Path], None] | None:
    """The function that writes pictures of this kind; None for a page."""
    writers = {".gif": _write_gif, ".mp4": _write_mp4, ".html": None}
    kind = path.suffix.lower()
    if kind not in writers:
        raise InputError(f"{path}: animations are written as {', '.join(writers)}, not {kind or 'without a suffix'}")
    if kind == ".mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise InputError(
            f"{path}: MP4 needs the package imageio-ffmpeg (pip install imageio-ffmpeg), or write .gif, .html"
        )
    return writers[kind]


def _check_settings(fps: int, duration: float | None, size: tuple[int, int]) -> None:
    if not 1 <= fps <= 50:
        raise InputError(f"fps is {fps}; it must lie between 1 and 50, the most that players of GIF files show")
    if duration is not None and not 0 < duration <= 3600:
        raise InputError(f"duration is {duration} s; it must be positive and at most 3600 s")
    if min(size) < 64 or max(size) > 4096:
        raise InputError(f"size is {size}; width and height must lie between 64 and 4096 pixels")


def _check_alone(path: Path, plots: tuple[str, ...]) -> None:
    """InputError for histories beside pictures, which have no room for them."""
    if plots:
        raise InputError(
            f"{path}: histories are plotted beside the motion on a page; write .html, or leave out {plots[0]!r}"
        )


def _pace(result: Result, fps: int, duration: float | None) -> tuple[float, int]:
    """Playing time [s] and number of pictures; one picture is enough for a result at one time."""
    simulated = float(np.ptp(result.time)) if result.time.size else 0.0
    playing = float(np.clip(simulated, _SHORTEST, _LONGEST)) if duration is None else duration
    return playing, max(2, round(playing * fps)) if simulated > 0 else 1


# ---- pictures ------------------------------------------------------------------------------------------------------


def _pictures(show: _Show) -> Iterator[Array]:
    from ffr_dyn.pictures.render import pictures

    return pictures(show.film, show.camera, show.size)


def _write_gif(show: _Show, path: Path) -> None:
    pictures = list(_pictures(show))
    palette = _shared_palette(pictures)
    indexed = [Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    # GIF counts in hundredths of a second: round the ends of the pictures, not their lengths, to keep the speed.
    ends = np.round(100 * show.seconds * np.arange(1, len(pictures) + 1))
    delays = (10 * np.diff(ends, prepend=0.0)).astype(int).tolist()
    indexed[0].save(path, "GIF", save_all=True, append_images=indexed[1:], duration=delays, loop=0, optimize=False)


def _shared_palette(pictures: list[Array], samples: int = 8) -> Image.Image:
    """White and 255 colours for the rest, from pictures spread over the film; one palette for all cannot flicker."""
    chosen = np.concatenate(
        [pictures[k].reshape(-1, 3) for k in np.linspace(0, len(pictures) - 1, samples).astype(int)]
    )
    # Pillow looks colours up in steps of four: without the near-white ones, white stays white.
    ink = chosen[(chosen < 248).any(axis=1)]
    rows = np.resize(ink, (-(-len(ink) // 256), 256, 3))
    few = Image.fromarray(rows).quantize(255, method=Image.Quantize.MEDIANCUT, kmeans=1)
    palette = Image.new("P", (1, 1))
    palette.putpalette([255, 255, 255, *(few.getpalette() or [])])
    return palette


def _write_mp4(show: _Show, path: Path) -> None:
    import imageio_ffmpeg

    stream = imageio_ffmpeg.write_frames(
        str(path), show.size, fps=1.0 / show.seconds, quality=8, macro_block_size=2, output_params=["-f", "mp4"]
    )
    stream.send(None)
    for picture in _pictures(show):
        stream.send(picture)
    stream.close()
