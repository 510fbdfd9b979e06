"""A study run by run, here or on workers: bodies first, then the runs that the journal has not yet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from ffr_dyn.chart.runner import Failure, Lost, Pool, pool
from ffr_dyn.functions.together import processors
from ffr_dyn.studies.identity import Contents, body_file
from ffr_dyn.studies.plan import Study, as_texts, load_study, names_of_scene, recipe
from ffr_dyn.studies.runs import Full, Point, Recipe, Row, Task, make, perform
from ffr_dyn.studies.table import Journal, Table, journal_of, save_table, table
from ffr_dyn.studies.workers import crew
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import made_folder, reserved

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
    ComputationError where no run succeeds; the table has their messages.

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
        save_table(found, path)
        journal_of(path).unlink()
        if not any(row.values for row in journal.rows.values()):
            raise ComputationError(
                f"no run has succeeded; the first says: {found.messages[0]} ({path} has all messages)"
            )
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
    made_folder("the folder of bodies", folder)
    known: Contents = {}
    files = {key: str(body_file(key[1], study.folder, folder, known).resolve()) for key in lines}
    wanted = {file: Recipe(line, str(study.folder.resolve()), file) for (_, line), file in files.items()}
    missing = [one for one in wanted.values() if not Path(one.file).exists()]
    failed = {}
    for done, (k, why) in enumerate(where.results(make, missing), 1):
        making(done, len(missing))
        _check(why)
        if why := why.reason if isinstance(why, Failure) else why:
            failed[missing[k].file] = f"!{why}"
    return {key: failed.get(file, file) for key, file in files.items()}


# ---- runs -----------------------------------------------------------------------------------------------------------


def _points(study: Study, left: Sequence[int], bodies: Mapping[tuple[str, str], str]) -> list[Point]:
    """Those of equal bodies beside each other, whose files a worker then reads once."""
    own, found = names_of_scene(study), []
    for k in left:
        point = study.points[k]
        texts = as_texts({name: value for name, value in point.items() if name in own})
        files = {name: bodies[name, recipe(study, name, point)] for name in study.recipes}
        found.append(Point(k, point, texts, files))
    return sorted(found, key=lambda point: (sorted(point.bodies.items()), point.number))


def _run(study: Study, path: Path, points: list[Point], where: Pool, journal: Journal, progress: Progress) -> None:
    histories = ""
    if study.histories:
        histories = str(made_folder("the folder of histories", f"{path}.runs").resolve())
    whole = Task(str(study.scene.resolve()), study.outputs, (), histories)
    lost = _performed(whole, _shares(points), where, journal, progress)
    _performed(whole, [[point] for task in lost for point in task.points], where, journal, progress)


def _performed(
    whole: Task, shares: Iterable[Sequence[Point]], where: Pool, journal: Journal, progress: Progress
) -> list[Task]:
    """Put the rows of all shares into the journal. Returns the tasks of several runs that no worker has survived: one of
    them brings it down, and takes the others along."""
    tasks, lost = [replace(whole, points=tuple(some)) for some in shares], list[Task]()
    for k, found in where.results(perform, tasks):
        if isinstance(found, Lost):
            _check(found)
        rows = found.rows if isinstance(found, Full) else found
        if isinstance(found, Failure):
            if len(tasks[k].points) > 1:
                lost.append(tasks[k])
                continue
            rows = [Row(tasks[k].points[0].number, {}, found.reason)]
        try:
            journal.add(rows)
        except OSError as error:
            raise InputError(
                f"{journal.path}: {error.strerror or error}; make room, or choose another place, and run the same again: "
                "what is done is kept"
            ) from None
        _check(found)
        progress(len(journal.rows), journal.runs)
    return lost


def _check(found: object) -> None:
    """Raises an error where a worker has no room for what it writes, or where there are no workers any more."""
    if isinstance(found, Full):
        raise InputError(
            f"{found.reason}; make room, or choose another place, and run the same again: what is done is kept"
        )
    if isinstance(found, Lost):
        raise ComputationError(
            f"{found.reason}; start another, and run the same again, with its address: what is done is kept"
        )


def _shares(points: list[Point]) -> Iterator[list[Point]]:
    size = max(1, min(MOST_IN_A_TASK, len(points) // TASKS))
    yield from (points[k : k + size] for k in range(0, len(points), size))
