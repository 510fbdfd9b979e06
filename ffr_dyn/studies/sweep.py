"""A study run by run, here or on workers: bodies first, then the runs that the journal has not yet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from ffr_dyn.chart.runner import Failure, Pool, pool
from ffr_dyn.functions.together import processors
from ffr_dyn.studies.plan import Study, load_study, names_of_scene, recipe
from ffr_dyn.studies.runs import Point, Recipe, Row, Task, body_file, make, perform
from ffr_dyn.studies.table import Journal, Table, journal_of, save_table, table
from ffr_dyn.studies.workers import crew
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import reserved

MOST_IN_A_TASK = 64  # runs
TASKS = 16  # of every worker, at least, that their ends are near each other

Progress = Callable[[int, int], None]


def sweep(
    study: Study | str | Path,
    path: str | Path,
    *,
    cache: str | Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
    making: Progress | None = None,
) -> Table:
    """Run a study, and write its table (netCDF) to `path`.

    study    : `fd.study(...)`, or a study file
    cache    : folder of the bodies that are made; default: <path>.bodies. Workers elsewhere must see it
    workers  : local processes (default one for every processor; 0: here);  cluster: address of a Dask scheduler instead
    progress : called with (runs done, runs);  making: the same of bodies

    A study that was stopped or killed goes on with the same path; what is done is not done again, and the table is the same
    to the bit as one that was never stopped, with any number of workers. Runs that fail are rows with a message.

    Raises InputError for a study that cannot be run, a cluster that does not answer, the journal of another study;
    ComputationError where no run succeeds.

        table = fd.sweep("study.toml", "study.nc"); table["force"]

    >>> table = fd.sweep("study.toml", "study.nc", workers=2)
    """
    made = study if isinstance(study, Study) else load_study(study)
    path = Path(path)
    folder = Path(f"{path}.bodies") if cache is None else Path(cache)
    with reserved(path), Journal(path, made) as journal:
        left = [number for number in range(len(made.points)) if number not in journal.rows]
        if left:
            try:
                with _where(workers, cluster) as where:
                    points = _points(made, left, _bodies(made, left, folder, where, making or _silent))
                    _run(made, path, points, where, journal, progress or _silent)
            except KeyboardInterrupt as end:
                kept = f"{journal_of(path)} holds {len(journal.rows)} of {len(made.points)} runs"
                end.add_note(f"{kept}, and the same command goes on with them")
                raise
        found = table(made, journal.rows)
        if found.failed.size == len(found):
            journal_of(path).unlink()
            raise ComputationError(f"no run has succeeded; the first says: {found.messages[0]}")
        save_table(found, path)
        journal_of(path).unlink()
    return found


def _where(workers: int | None, cluster: str | None) -> AbstractContextManager[Pool]:
    if cluster is not None or workers == 0:
        return pool(workers, cluster)
    return crew(processors() if workers is None else workers)


def _silent(done: int, total: int) -> None:
    pass


# ---- bodies ---------------------------------------------------------------------------------------------------------


def _bodies(
    study: Study, left: Sequence[int], folder: Path, where: Pool, making: Progress
) -> Mapping[tuple[str, str], str]:
    """Files by body and line; "!" and a reason where one could not be made."""
    lines = {(name, recipe(study, name, study.points[k])): "" for k in left for name in study.recipes}
    if not lines:
        return {}
    folder.mkdir(parents=True, exist_ok=True)
    files = {key: str(body_file(key[1], study.folder, folder).resolve()) for key in lines}
    wanted = {file: Recipe(line, str(study.folder.resolve()), file) for (_, line), file in files.items()}
    missing = [one for one in wanted.values() if not Path(one.file).exists()]
    failed = {}
    for done, (k, why) in enumerate(where.results(make, missing), 1):
        making(done, len(missing))
        if why := why.reason if isinstance(why, Failure) else why:
            failed[missing[k].file] = f"!{why}"
    return {key: failed.get(file, file) for key, file in files.items()}


# ---- runs -----------------------------------------------------------------------------------------------------------


def _points(study: Study, left: Sequence[int], bodies: Mapping[tuple[str, str], str]) -> list[Point]:
    """Those of equal bodies beside each other, whose files a worker then reads once."""
    own, found = names_of_scene(study), []
    for k in left:
        point = study.points[k]
        texts = {name: repr(v) if isinstance(v, float) else str(v) for name, v in point.items() if name in own}
        files = {name: bodies[name, recipe(study, name, point)] for name in study.recipes}
        found.append(Point(k, point, texts, files))
    return sorted(found, key=lambda point: (sorted(point.bodies.items()), point.number))


def _run(study: Study, path: Path, points: list[Point], where: Pool, journal: Journal, progress: Progress) -> None:
    histories = ""
    if study.histories:
        Path(f"{path}.runs").mkdir(parents=True, exist_ok=True)
        histories = str(Path(f"{path}.runs").resolve())
    whole = Task(str(study.scene.resolve()), study.outputs, (), histories)
    tasks = [replace(whole, points=tuple(some)) for some in _shares(points)]
    total = len(study.points)
    for k, rows in where.results(perform, tasks):
        if isinstance(rows, Failure):
            rows = [Row(point.number, {}, rows.reason) for point in tasks[k].points]
        try:
            journal.add(rows)
        except OSError as error:
            raise InputError(
                f"{journal_of(path)}: {error.strerror or error}; make room, or choose another place, and run the same again: "
                "what is done is kept"
            ) from None
        progress(len(journal.rows), total)


def _shares(points: list[Point]) -> Iterator[list[Point]]:
    size = max(1, min(MOST_IN_A_TASK, len(points) // TASKS))
    yield from (points[k : k + size] for k in range(0, len(points), size))
