"""Running variants: one after another in this process, or as Dask tasks in processes here or on a cluster.

Timing. Clocked is the integrator's compiled loop alone: assembly, output files and compilation are left out. A worker process
has one thread, so that nothing runs beside a run in its process; CPU time is that of the thread which runs it, wall time is
the clock's. Both are taken several times, and the diagram shows the median with the least and the greatest. Locally there are
half as many workers as processors: they do not share a core's pipelines, and neither is the machine saturated. With a busy
machine, trust CPU time.

Failures. A variant that its method cannot do, or that runs too long, has failed for good and says why. One that is lost,
with its worker or by an unforeseen error, is tried again, `RETRIES` times, and then recorded as failed. Neither stops the
others.
"""

from __future__ import annotations

import fnmatch
import logging
import re
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeVar

import numpy as np

from ffr_dyn.analyses.integration import fast_within, integrate
from ffr_dyn.analyses.trials.begin import Beginning, begun
from ffr_dyn.chart.measures import Measure
from ffr_dyn.chart.variants import Variant
from ffr_dyn.compile.first_use import ensure_compiled
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.step_error import least_ranges
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.functions.together import alone, processors
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.quantities import catalogue, selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import BodyError
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.registry import load_plugin, plugins

Item = TypeVar("Item")

RETRIES = 2
REPEATS, LEAST_SECONDS, MOST_REPEATS = 5, 0.2, 25  # a run is repeated until both is reached, or the most
LONG = 2.0  # s of CPU time, above which one repeat is enough
_ADDRESS = re.compile(r"inproc://\S+|([a-z]+://)?[^\s/]+:\d+")  # of a scheduler
_CONNECT = 10.0  # s to wait for the scheduler of a cluster


@dataclass(frozen=True)
class Span:
    """From `start` to `end` with a row every `output_step` [s].

    begin : the state in which a run begins, as of `forward`; each model has its own

    >>> with fd.pool() as workers: diagram = fd.work_precision(scene, fd.Span(0.5, 1e-3), workers)
    """

    end: float
    output_step: float
    start: float = 0.0
    begin: Beginning = "as-given"

    @property
    def integrated(self) -> dict[str, Any]:
        """What `integrate` is told of it."""
        return {"start": self.start, "end": self.end, "output_step": self.output_step}


@dataclass(frozen=True)
class Job:
    """A variant of a scene to be run.

    repeats : how often it is timed;  limit : wall time [s] that a run may take
    """

    scene: Scene
    variant: Variant
    span: Span
    measures: tuple[Measure, ...]
    stabilisation: Stabilisation = Projection()  # noqa: RUF009 - frozen
    repeats: int = REPEATS
    limit: float = 120.0


@dataclass(frozen=True)
class Outcome:
    """values (T, k) and scale by measure; wall and CPU time [s] of every repeat; evaluations of the equations of motion."""

    values: Mapping[str, Array]
    scales: Mapping[str, float]
    wall: tuple[float, ...]
    cpu: tuple[float, ...]
    evaluations: int

    @property
    def seconds(self) -> float:
        """Median CPU time."""
        return statistics.median(self.cpu)


@dataclass(frozen=True)
class Failure:
    """Why a variant has no outcome."""

    reason: str


@dataclass(frozen=True)
class Lost(Failure):
    """Nobody is left who could try it."""


# ---- one run ------------------------------------------------------------------------------------------------------


def perform(job: Job) -> Outcome | Failure:
    """Run a variant, and again for its times."""
    try:
        scene = job.variant.model.of(job.scene)
        method = job.variant.integrator()
        ensure_compiled(type(method))
        outputs = _outputs(scene, job)
        _warm_up(scene, method, job)
        assembled = begun(assemble(scene, time=job.span.start), job.span.start, job.span.begin)
        result, wall, cpu = _clocked(assembled, method, job, outputs)
        times = [(wall, cpu)]
        while _wants_more(times, job.repeats):
            times.append(_clocked(assembled, method, job, outputs)[1:])
    except (InputError, BodyError, ComputationError) as error:
        return Failure(str(error))
    values = {measure.name: measure.values(result) for measure in job.measures}
    bad = next((name for name, history in values.items() if not np.isfinite(history).all()), None)
    if bad is not None:
        return Failure(f"{bad} is not finite")
    return Outcome(
        values,
        _scales(job.measures, result),
        tuple(wall for wall, _ in times),
        tuple(cpu for _, cpu in times),
        int(result.attributes["evaluations"]),
    )


def _wants_more(times: list[tuple[float, float]], repeats: int) -> bool:
    spent = sum(cpu for _, cpu in times)
    if len(times) >= max(repeats, 1) and (spent > LEAST_SECONDS or len(times) >= MOST_REPEATS or repeats <= 1):
        return False
    return spent < LONG


def _outputs(scene: Scene, job: Job) -> tuple[str, ...]:
    """The quantities that the measures want and the variant has, as a rigid body has fewer, and those that tell scales."""
    system = assemble(scene, time=job.span.start).system
    wanted = dict.fromkeys(pattern for measure in job.measures for pattern in measure.outputs)
    return tuple(dict.fromkeys([*_matching(catalogue(system), wanted), *selected(system, ("default",))]))


def _matching(names: Iterable[str], patterns: Iterable[str]) -> list[str]:
    return [name for name in names if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)]


def _scales(measures: Sequence[Measure], result: Result) -> dict[str, float]:
    """Of the errors of each measure: its own, but no less than what counts as the range of something that does not move."""
    least, found = least_ranges(result), dict[str, float]()
    for measure in measures:
        of = [name for name in _matching(least, measure.outputs) if result.quantities[name].unit == measure.unit]
        found[measure.name] = max([measure.scale(result), *(least[name] for name in of)])
    return found


_WARM: set[type] = set()


def _warm_up(scene: Scene, method: Any, job: Job) -> None:
    """The first call of a method in a process loads its compiled code."""
    if type(method) in _WARM:
        return
    span = job.span
    integrate(scene, start=span.start, end=span.start + span.output_step, output_step=span.output_step, method=method)
    _WARM.add(type(method))


def _clocked(assembled: Assembled, method: Any, job: Job, outputs: tuple[str, ...]) -> tuple[Result, float, float]:
    began, stopwatch = time.monotonic(), Stopwatch()

    def watch(reached: float) -> None:
        if time.monotonic() - began > job.limit:
            raise ComputationError(f"took longer than {job.limit:g} s; it had reached t = {reached:.6g} s")

    system, span = assembled.system, job.span.integrated
    how: dict[str, Any] = {"stabilisation": job.stabilisation, "outputs": outputs, "assembled": assembled}
    how |= {"fast": fast_within(system, method, **span), "progress": watch, "stopwatch": stopwatch}
    result = integrate(system.scene, **span, method=method, **how)
    return result, stopwatch.wall, stopwatch.cpu


# ---- many runs ----------------------------------------------------------------------------------------------------


class Pool(Protocol):
    """The protocol of whatever runs jobs."""

    def results(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Iterator[tuple[int, Any]]:
        """(number of the item, what the function returned or a `Failure`), in the order in which they are done."""


class Here:
    """One after another in this process."""

    def results(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Iterator[tuple[int, Any]]:
        """See `Pool`."""
        for k, item in enumerate(items):
            yield k, tried(function, item)


def tried(function: Callable[[Item], Any], item: Item) -> Any:
    """The result of the function for an item, at the third attempt if need be, or a `Failure`."""
    for _ in range(RETRIES + 1):
        try:
            return function(item)
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
    return Failure(reason)


class Distributed:
    """Tasks of a Dask client."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def results(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Iterator[tuple[int, Any]]:
        """See `Pool`."""
        from dask.distributed import as_completed

        if files := plugins():
            self._client.register_plugin(_loading(files))
        futures = {
            self._client.submit(_by_itself, function, item, retries=RETRIES, pure=False): k
            for k, item in enumerate(items)
        }
        for future in as_completed(list(futures), loop=self._client.loop):  # type: ignore[no-untyped-call]
            if future.status == "finished":
                yield futures[future], future.result()
            elif future.status == "error":
                yield futures[future], Failure(_why(future.exception()))
            else:
                yield futures[future], Lost(f"the task was {future.status}: the cluster has gone")


def _by_itself(function: Callable[[Item], Any], item: Item) -> Any:
    """The result of the function for an item, with no threads: other workers take the other processors."""
    with alone():
        return function(item)


def _loading(files: Sequence[str]) -> Any:
    """What has workers of a cluster load the plugins that are loaded here, before they do anything."""
    from dask.distributed import WorkerPlugin

    class Loading(WorkerPlugin):  # type: ignore[misc]
        name = "plugins of ffr"

        def setup(self, worker: Any) -> None:
            for file in files:
                load_plugin(file)

    return Loading()


def _why(error: BaseException) -> str:
    if type(error).__name__ == "KilledWorker":
        return f"its worker died {RETRIES + 1} times: out of memory, or killed from outside"
    return f"{type(error).__name__}: {error}"


@contextmanager
def pool(workers: int | None = None, cluster: str | None = None) -> Iterator[Pool]:
    """The workers of a chart: a cluster by its address, local processes (default: half the processors), or none (0).

    Raises InputError where Dask is missing or no scheduler answers.

    >>> with fd.pool(workers=2) as workers: diagram = fd.work_precision(scene, fd.Span(0.5, 1e-3), workers)
    """
    if workers == 0 and cluster is None:
        yield Here()
        return
    if workers is not None and workers < 0:
        raise InputError(f"there cannot be {workers} workers; give 0 for this process, or how many")
    with _client(workers, cluster) as client:
        yield Distributed(client)


def default_workers() -> int:
    """Half the processors that this process may use, at least one."""
    return max(1, processors() // 2)


def _started(cluster: Callable[..., Any]) -> Any:
    """A cluster of local processes. Raises ComputationError where they do not come up, as when one is killed meanwhile."""
    try:
        return cluster(threads_per_worker=1, dashboard_address=":0", silence_logs=50)
    except RuntimeError as error:
        raise ComputationError(
            f"the workers did not start ({error}); try again, or run here with --workers 0"
        ) from None


@contextmanager
def _client(workers: int | None, cluster: str | None) -> Iterator[Any]:
    try:
        import dask
        from dask.distributed import Client, LocalCluster
    except ImportError:
        raise InputError(
            'running variants in parallel needs Dask: pip install "ffr[chart]"; --workers 0 runs them here, one by one'
        ) from None
    quiet = {"distributed.scheduler.allowed-failures": RETRIES, "logging.distributed": "critical"}
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # which has read its configuration already
    with dask.config.set(quiet):
        if cluster is None:
            count = default_workers() if workers is None else workers
            with _started(partial(LocalCluster, n_workers=count)) as local, Client(local) as client:  # type: ignore[no-untyped-call]
                yield client
            return
        if _ADDRESS.fullmatch(cluster) is None:
            raise InputError(
                f"{cluster!r} is no address of a scheduler; give the one that `dask scheduler` prints, such as tcp://host:8786"
            )
        try:
            client = Client(cluster, timeout=_CONNECT, set_as_default=False)  # type: ignore[no-untyped-call]
        except (OSError, ValueError) as error:
            raise InputError(
                f"no scheduler answers at {cluster!r} ({error}); start one with `dask scheduler` and workers with "
                "`dask worker ADDRESS --nthreads 1`, and give the address that it prints, such as tcp://host:8786"
            ) from None
        with client:
            yield client
