"""Animations of a result: GIF and MP4 rendered off-screen by pyvista, or an interactive page.

The pictures show the deformed bodies, flexible ones coloured by their elastic displacement beside the translucent
undeformed body, rigid ones plain; time and scale of the deformation are written in the picture.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.film import Camera, Film, film
from ffr_dyn.result import Array, Result

_SHORTEST, _LONGEST = 3.0, 6.0
_PAGE_FRAMES = 80
COLOURS = ("deformation", "body")


def animate(
    result: Result,
    path: str | Path,
    *,
    scale: float | str = 1.0,
    fps: int = 25,
    duration: float | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] = (960, 640),
    colour: str = "deformation",
    traces: Iterable[str] = (),
) -> Path:
    """Animate the bodies of a result; the suffix of path decides: .gif, .mp4 (needs imageio-ffmpeg) or .html.

    scale    : factor of the drawn deformation; "auto": a round one for deflections of about 5 % of a body
    fps      : pictures per second of playing time; a page holds at most 80 pictures, whatever the rate
    duration : playing time [s]; by default the simulated time, but at least 3 s and at most 6 s
    camera   : by default chosen from the motion (`ffr_dyn.film.camera_for`); it does not move
    size     : width and height of the picture [pixels]
    colour   : "deformation": flexible bodies by elastic displacement; "body": every body in a colour of its own
    traces   : markers ("rod.small_eye") whose paths are drawn

    Raises InputError for settings or a result that cannot be drawn, SimulationError when this machine cannot render.
    """
    path = Path(path)
    writer = _writer(path)
    if colour not in COLOURS:
        raise InputError(f"colour is {colour!r}; it must be one of {', '.join(COLOURS)}")
    if not 1 <= fps <= 50:
        raise InputError(f"fps is {fps!r}; it must lie between 1 and 50, what players of GIF files can show")
    if min(size) < 64 or max(size) > 4096:
        raise InputError(f"size is {size}; width and height must lie between 64 and 4096 pixels")
    simulated = float(np.ptp(result.time)) if result.time.size else 0.0
    playing = float(np.clip(simulated, _SHORTEST, _LONGEST)) if duration is None else duration
    if not 0 < playing <= 3600:
        raise InputError(f"duration is {duration!r}; it must be positive and at most 3600 s")
    frames = max(2, round(playing * fps)) if simulated > 0 else 1
    frames = min(frames, _PAGE_FRAMES) if path.suffix.lower() == ".html" else frames
    shown = film(result, frames, scale=scale, traces=traces)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".part")
    writer(shown, temporary, playing / frames, camera, size, colour)
    os.replace(temporary, path)
    return path


Writer = Callable[[Film, Path, float, Camera | None, tuple[int, int], str], None]


def _writer(path: Path) -> Writer:
    writers: dict[str, Writer] = {".gif": _write_gif, ".mp4": _write_mp4, ".html": _write_html}
    kind = path.suffix.lower()
    if kind not in writers:
        raise InputError(f"{path}: animations are written as {', '.join(writers)}, not {kind or 'without a suffix'}")
    if kind == ".mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise InputError(f"{path}: MP4 needs the package imageio-ffmpeg (pip install imageio-ffmpeg); or write .gif, .html")
    return writers[kind]


def _write_gif(
    shown: Film, path: Path, seconds: float, camera: Camera | None, size: tuple[int, int], colour: str
) -> None:
    palette = _palette(_pictures(_key_frames(shown), camera, size, colour))
    pictures = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in _all(shown, camera, size, colour))
    # GIF counts in hundredths of a second: round the times of the pictures, not the differences, to keep the speed.
    ends = np.round(100 * seconds * np.arange(1, shown.times.size + 1)).astype(int)
    delays = 10 * np.diff(ends, prepend=0)
    first = next(pictures)
    first.save(path, "GIF", save_all=True, append_images=pictures, duration=delays.tolist(), loop=0, optimize=False)
