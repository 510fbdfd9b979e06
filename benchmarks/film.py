"""Size and speed of films: pages of the connecting rod, of a chain of 32 links and of a body of 20,000 triangles.

    python -m benchmarks.film [--folder out/films]

Pictures a second are those of Chromium without a graphics card (SwiftShader), at 1280 x 800 pixels, while the film plays with
edges and colours by stress or displacement.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import ffr_dyn as fd
from benchmarks.scenes import chain, connecting_rod
from examples.connecting_rod import motion, reduced_rod
from ffr_dyn.pictures.film import film_at
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Quantity, Result, mode_axis
from ffr_prep.body import Surface
from tests.browser import BROWSER, Page

LINKS, SECONDS = 32, 6.0


def links() -> Result:
    """Round bars of 0.3 m, hinged end to end, released at rest."""
    scene = chain(connecting_rod("rigid", 6).body, LINKS, "revolute")
    return fd.forward(scene, end=0.6, output_step=2e-3, method=fd.ROS2(1e-4))


def plate(rows: int = 400, modes: int = 20, side: int = 100) -> Result:
    """A square of 2 x side^2 triangles that swings in `modes` modes."""
    x, y = np.meshgrid(*[np.linspace(0, 1, side + 1)] * 2, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    k = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = (of.ravel() for of in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    waves = [(i, j) for i in range(1, 6) for j in range(1, 5)][:modes]
    Phi = np.zeros((len(points), 3, modes))
    for m, (i, j) in enumerate(waves):
        Phi[:, 2, m] = np.sin(np.pi * i * points[:, 0]) * np.sin(np.pi * j * points[:, 1])
    t = np.linspace(0, 4, rows)
    q = 0.05 / np.arange(1, modes + 1) * np.sin(np.outer(t, 3 + np.arange(modes)))
    quantities = {
        "plate.R": Quantity(np.zeros((rows, 3)), "m", (XYZ,)),
        "plate.p": Quantity(np.tile(np.eye(4)[0], (rows, 1)), "1", (EULER_PARAMETERS,)),
        "plate.q": Quantity(q, "m sqrt(kg)", (mode_axis("plate", modes),)),
    }
    return Result(t, quantities, {"plate": Surface(points, triangles, Phi)}, {"title": "plate"})


def played(page: Page, path: Path) -> float:
    """Pictures a second."""
    page.open(path.resolve())
    page.value("play(true)")
    time.sleep(3.0)  # the first pictures take longer
    drawn, began = page.value("state.drawn"), time.monotonic()
    time.sleep(SECONDS)
    rate = (page.value("state.drawn") - drawn) / (time.monotonic() - began)
    assert not page.said, page.said
    assert not page.requests, page.requests
    return rate


def films(folder: Path) -> Iterator[tuple[str, Path, Result, float]]:
    """Name, page, result and seconds to write it."""
    made = (
        ("connecting rod", lambda: motion(reduced_rod()), "von-mises"),
        ("chain of 32", links, "deformation"),
        ("plate", plate, "deformation"),
    )
    for name, result_of, colour in made:
        result, path = result_of(), folder / f"{name.replace(' ', '_')}.html"
        began = time.monotonic()
        fd.animate(result, path, scale="auto", colour=colour)
        yield name, path, result, time.monotonic() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("out/films"))
    folder = parser.parse_args().folder
    print("film             rows  triangles   size [MB]   written in [s]   pictures a second")
    for name, path, result, seconds in films(folder):
        triangles = sum(len(solid.surface.triangles) for solid in film_at(result, result.time[:1]).solids)
        rate = "no browser"
        if BROWSER:
            with TemporaryDirectory(ignore_cleanup_errors=True) as own:
                page = Page(Path(own))
                rate = f"{played(page, path):.1f}"
                page.close()
        print(
            f"{name:15} {result.time.size:5d} {triangles:10d} {path.stat().st_size / 1e6:11.2f} {seconds:16.1f} {rate:>19}"
        )


if __name__ == "__main__":
    main()
