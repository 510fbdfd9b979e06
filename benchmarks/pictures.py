"""The pictures of the README and of docs/stress.md that show the connecting rod of examples/connecting_rod.py.

    python -m benchmarks.pictures [--folder docs/pictures]

connecting_rod.png : the rod at one moment of the third turn, its deformation enlarged, coloured by elastic displacement
stress.png         : the largest von Mises stress of the third turn, as `ffr-dyn stress` draws it

The third picture of that folder, work_precision, is drawn by `python -m benchmarks.chart`.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from examples.connecting_rod import TURN, motion, reduced_rod
from ffr_dyn.pictures.film import camera_for, film_at
from ffr_dyn.pictures.render import pictures
from ffr_dyn.pictures.stress_report import stress_report
from ffr_dyn.results.result import Result

SIZE = (1200, 720)
MOMENT = 688 / 240 * TURN  # [s], where the rod is bent most
ENLARGED, LIMIT = 500.0, 10e-6  # factor of the deformation, end of the colour bar [m]


def deformed(result: Result, path: Path) -> Path:
    """The mechanism at one moment."""
    shown = film_at(result, np.array([MOMENT]), scale=ENLARGED, limit=LIMIT)
    (picture,) = pictures(shown, camera_for(shown), SIZE)
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(path, "PNG")
    return path


def stressed(result: Result, path: Path) -> Path:
    """The rod, coloured by its largest stress of the third turn."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as folder:
        stress_report(result, folder, since=2 * TURN, count=3)
        return Path(shutil.copyfile(Path(folder) / "rod.png", path))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("docs/pictures"))
    folder = parser.parse_args().folder
    result = motion(reduced_rod())
    print(deformed(result, folder / "connecting_rod.png"))
    print(stressed(result, folder / "stress.png"))


if __name__ == "__main__":
    main()
