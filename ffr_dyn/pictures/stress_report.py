"""The report of `ffr-dyn stress` on a result: hot spots in words, tables, histories and a coloured picture."""

from __future__ import annotations

import base64
import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path

import numpy as np
from PIL import Image

from ffr_dyn.pictures.film import Camera, film_at, measure_colours
from ffr_dyn.pictures.histories import plot
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Quantity, Result, mode_axis, write_csv
from ffr_dyn.results.stress import (
    HotSpot,
    SectionPeak,
    beams_of,
    hot_spots,
    peaks,
    section_histories,
    section_peaks,
    stress_histories,
    stressed_bodies,
    stressed_surface,
)
from ffr_dyn.results.stress_error import stress_error
from ffr_dyn.results.wholes import with_wholes
from ffr_dyn.scene.stress_sensors import Measure, measure, nearest_element
from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import replacing
from ffr_prep.common.units import readable

Places = dict[str, Array]

_SIZE = (1200, 800)
_TOLD = 5.0  # % of the largest stress that may be missing without a remedy beside it
_VIEWS = {
    0: Camera((1.0, 0.30, 0.45), (0.0, 0.0, 1.0)),
    1: Camera((0.30, -1.0, 0.45), (0.0, 0.0, 1.0)),
    2: Camera((0.25, 0.40, 1.0), (0.0, 1.0, 0.0)),
}


@dataclass(frozen=True)
class StressReport:
    """Hot spots, the largest section forces by body of beams, and the files that were written.

    errors : by body the largest von Mises stress [Pa] that its shapes leave out, where that is known, and the largest that
             they show
    lacks  : by body what else its stress does not hold, in words
    """

    quantity: str
    spots: tuple[HotSpot, ...]
    sections: dict[str, tuple[SectionPeak, ...]]
    files: tuple[Path, ...]
    errors: dict[str, tuple[float, float]] = field(default_factory=dict)
    lacks: dict[str, str] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        """The report in words, and its pictures, for a notebook."""
        pictures = [base64.b64encode(file.read_bytes()).decode() for file in self.files if file.suffix == ".png"]
        shown = "".join(f'<img src="data:image/png;base64,{picture}" width="600">' for picture in pictures)
        return f"<pre>{escape(chr(10).join(report_lines(self)))}</pre>{shown}"


def stress_report(
    result: Result,
    folder: str | Path,
    *,
    body: str | None = None,
    quantity: str = "von-mises",
    points: Sequence[Sequence[float]] = (),
    count: int = 5,
    since: float | None = None,
) -> StressReport:
    """Find the hot spots of a result and write tables, plots and pictures to a folder.

    body     : the body to look at; all with stress modes when not given, but points need one
    quantity : one of `ffr_dyn.scene.stress_sensors.MEASURES`
    points   : places (3,) [m] in the body frame whose histories are wanted; the hot spots when not given
    count    : of hot spots, at most
    since    : leave out what was before this time [s], such as the transient at the start

    Written: hot_spots.csv, history.csv and history.png of the quantity, <body>.png with the largest values over the run
    in colour, and of beams <body>_section_forces.csv and .png of the element nearest to the first point, or else of the
    one with the largest bending moment.
    Raises InputError for names and points that do not exist, ComputationError when this machine cannot render.

    >>> report = fd.stress_report(result, "stress")
    """
    folder, result = Path(folder), with_wholes(result if since is None else _later(result, since))
    bodies = stressed_bodies(result) if body is None else (body,)
    if len(bodies) > 1 and len(points):
        raise InputError(f"points are in the frame of one body; say which: {', '.join(bodies)}")
    spots = hot_spots(result, quantity, bodies=bodies, count=count)
    places = {bodies[0]: _named("point", points)} if len(points) else _places(spots)
    files = [_spot_table(spots, quantity, folder / "hot_spots.csv"), *_histories(result, places, quantity, folder)]
    beams = [name for name in bodies if result.geometry[name].beams is not None]
    files += [file for name in beams for file in _section_files(result, name, points, folder)]
    files += [_peak_picture(result, name, spots, quantity, folder / f"{name}.png") for name in bodies]
    sections = {name: section_peaks(result, name) for name in beams}
    errors, lacks = dict(_errors(result, bodies)), {name: said for name in bodies if (said := _lacks(result, name))}
    return StressReport(quantity, spots, sections, tuple(files), errors, lacks)


def _lacks(result: Result, body: str) -> str:
    names = result.attributes.get("parts", {}).get(body, [body])
    known = result.attributes.get("stress_lacks", {})
    return "; ".join(dict.fromkeys(known[name] for name in names if name in known))


def _errors(result: Result, bodies: Sequence[str]) -> Iterator[tuple[str, tuple[float, float]]]:
    for name in bodies:
        error = stress_error(result, name)
        if error is not None:
            yield name, (error, float(peaks(result, name)[0].max()))


def report_lines(report: StressReport) -> list[str]:
    """The report in words.

    Raises InputError for a report of an unknown measure.

    >>> print(*fd.report_lines(report), sep="\\n")  # of what `fd.stress_report` returned
    """
    return [*_lines(report, measure(report.quantity))]


def _lines(report: StressReport, of: Measure) -> Iterator[str]:
    factor, unit = readable(of.unit, abs(report.spots[0].value))
    yield f"hot spots   {of.words} [{unit or '1'}], place in the body frame [m], time [s]"
    width = max(len(spot.body) for spot in report.spots)
    for k, spot in enumerate(report.spots):
        at = ", ".join(f"{x:9.5g}" for x in spot.position)
        yield f"{k + 1:7d}     {factor * spot.value:10.4g}  {spot.body:{width}}  ({at})  {spot.time:.6g}"
    yield from (_accuracy(body, *of) for body, of in report.errors.items())
    yield from (f"accuracy    {body}: {said}" for body, said in report.lacks.items())
    for body, sections in report.sections.items():
        yield f"sections    largest section forces of {body}"
        for peak in sections:
            unit = "N" if peak.force[0] in "NQ" else "N m"
            where = f"element {peak.element}, {peak.place}"
            yield f"{peak.force:>7}     {peak.value:10.4g} {unit:3}  {where:24}  {peak.time:.6g}"
    for file in report.files:
        yield f"file        {file}"


def _accuracy(body: str, error: float, largest: float) -> str:
    """What the shapes of a body leave out of the stress of its own inertia, and what mends it."""
    factor, unit = readable("Pa", error)
    share = 100 * error / largest if largest else 0.0
    told = (
        f"accuracy    {body}: its shapes leave out up to {factor * error:.2g} {unit} of the stress of its own inertia"
    )
    of = f", {share:.2g} % of the largest" if largest else ""
    mend = "; reduce it with --method craig-bampton --method inertia-relief" if share > _TOLD else ""
    return f"{told}{of}{mend}"


# ---- tables and histories -----------------------------------------------------------------------------------------


def _later(result: Result, since: float) -> Result:
    rows = result.time >= since
    if not rows.any():
        raise InputError(f"the result ends at {result.time[-1]:g} s; nothing is left from {since:g} s on")
    kept = {name: replace(of, values=of.values[rows]) for name, of in result.quantities.items()}
    return replace(result, time=result.time[rows], quantities=kept)


def _named(word: str, positions: Sequence[Sequence[float]]) -> Places:
    return {f"{word} {k + 1}": np.array(position, float) for k, position in enumerate(positions)}


def _places(spots: Sequence[HotSpot]) -> dict[str, Places]:
    """The places of the hot spots by body, named by their rank."""
    places: dict[str, Places] = {}
    for name, position in _named("spot", [spot.position for spot in spots]).items():
        body = spots[int(name.split()[1]) - 1].body
        places.setdefault(body, {})[name] = position
    return places


def _spot_table(spots: Sequence[HotSpot], quantity: str, path: Path) -> Path:
    unit = measure(quantity).unit
    rows = [(k + 1, s.body, s.point, *s.position, s.row, s.time, s.value) for k, s in enumerate(spots)]
    heading = ("rank", "body", "point", "x [m]", "y [m]", "z [m]", "row", "time [s]", f"{quantity} [{unit}]")
    with replacing(path) as part, open(part, "w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows([heading, *rows])
    return path


def _histories(result: Result, places: dict[str, Places], quantity: str, folder: Path) -> list[Path]:
    """Table with the tensors and plot of the quantity at all places."""
    found: dict[str, Quantity] = {}
    for body, named in places.items():
        found |= stress_histories(result, body, named, quantity).quantities
    histories = Result(result.time, found)
    shown = [name for name in found if name.endswith(f".{quantity}")]
    words = measure(quantity).words
    title, picture = f"{words[0].upper() + words[1:]} at {len(shown)} points", folder / "history.png"
    plot(histories, shown, picture, title=title)
    return [write_csv(histories, folder / "history.csv"), picture]


def _section_files(result: Result, body: str, points: Sequence[Sequence[float]], folder: Path) -> list[Path]:
    """Section forces of the element nearest to the first point, or else of the one with the largest bending moment."""
    bending = max(section_peaks(result, body)[4:], key=lambda peak: abs(peak.value))
    element = nearest_element(beams_of(result, body), np.array(points[0], float)) if len(points) else bending.element
    histories = section_histories(result, body, element)
    middle = [name for name in histories.quantities if ".middle." in name]
    picture = folder / f"{body}_section_forces.png"
    plot(histories, middle, picture, title=f"Section forces, element {element}")
    return [write_csv(histories, folder / f"{body}_section_forces.csv"), picture]


# ---- picture ------------------------------------------------------------------------------------------------------


def _peak_picture(result: Result, body: str, spots: Sequence[HotSpot], quantity: str, path: Path) -> Path:
    """The body at rest in its own frame, coloured by the largest values over the run, its hot spots numbered."""
    from ffr_dyn.pictures.render import pictures  # here, because pyvista is slow to load

    values, _ = peaks(result, body, quantity)
    of = measure(quantity)
    largest = float(np.abs(values).max())
    shades = measure_colours(of, largest, frozenset([body]), lambda solid, frame: values) if largest else None
    numbered = {str(k + 1): np.array(s.position) for k, s in enumerate(spots) if s.body == body}
    shown = film_at(_at_rest(result, body), np.zeros(1), scale=0.0, colour="body")
    camera = _view(shown.high - shown.low, next(iter(numbered.values()), shown.centre) - shown.centre)
    towards, surface = camera.axes()[0], result.geometry[body]
    marks = {f"({k})" if behind(surface, at, towards) else k: at for k, at in numbered.items()}
    heading = _heading(result, body, of.words) + ("     (n): hidden" if set(marks) - set(numbered) else "")
    shown = replace(shown, colouring=shades, marks=marks, heading=heading)
    (picture,) = pictures(shown, camera, _SIZE)
    with replacing(path) as part:
        Image.fromarray(picture).save(part, "PNG")
    return path


def behind(surface: Surface, point: Array, towards: Array) -> bool:
    """Whether an eye far away in the direction `towards` (3,) sees a point (3,) of the undeformed surface covered by it.

    Intersections of a ray with triangles: Moller & Trumbore 1997.
    """
    corners = surface.points[surface.triangles]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(towards, second)
    volume = np.einsum("ti,ti->t", first, across)
    crossed = np.abs(volume) > 1e-12 * np.linalg.norm(np.cross(first, second), axis=1)
    first, second, across, volume = first[crossed], second[crossed], across[crossed], volume[crossed]
    offset = point - corners[crossed, 0]
    turned = np.cross(offset, first)
    u, v = np.einsum("ti,ti->t", offset, across) / volume, turned @ towards / volume
    distance = np.einsum("ti,ti->t", second, turned) / volume
    size = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 1e-6 * size)).any())


def _heading(result: Result, body: str, words: str) -> str:
    factor, unit = readable("s", float(result.time[-1]))
    first, last = factor * result.time[[0, -1]]
    return f"{body}: largest {words} from {first:.4g} to {last:.4g} {unit}"


def _at_rest(result: Result, body: str) -> Result:
    surface = stressed_surface(result, body)
    n = surface.Phi.shape[2]
    still = {
        f"{body}.R": Quantity(np.zeros((1, 3)), "m", (XYZ,)),
        f"{body}.p": Quantity(np.eye(4)[:1], "1", (EULER_PARAMETERS,)),
        f"{body}.q": Quantity(np.zeros((1, n)), "m sqrt(kg)", (mode_axis(body, n),)),
    }
    return Result(np.zeros(1), still, {body: surface})


def _view(extent: Array, hottest: Array) -> Camera:
    """Across the thinnest direction of the body, from the side where the hottest place is."""
    axis = int(np.argmin(extent))
    camera = _VIEWS[axis]
    side = np.sign(camera.direction[axis]) * np.sign(hottest[axis])
    if side >= 0:
        return camera
    turned = np.array(camera.direction)
    turned[axis] *= -1
    return Camera(tuple(turned.tolist()), camera.up)
