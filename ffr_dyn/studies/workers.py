"""Workers of a study on this machine: processes of their own, each of which does task after task.

A worker is this module as a command. Tasks come as pickles through its standard input, what came of them goes back through
its standard output, and it ends where its input does: with the study, however that ends. It keeps the bodies and the code
that it has loaded; one that dies is replaced, and its task done again. BLAS has one thread there.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, BinaryIO

from ffr_dyn.chart.runner import RETRIES, Failure, Item, tried
from ffr_dyn.functions.together import Say, alone, together
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import load_plugin, plugins

PATIENCE, IDLE = 5.0, 0.1  # s that a worker has to end in order, and that one without a task takes for it
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

Worker = subprocess.Popen[bytes]


class Crew:
    """Some workers, started when they are first needed; a `ffr_dyn.chart.runner.Pool`."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._all: list[Worker] = []
        self._idle: queue.LifoQueue[Worker | None] = queue.LifoQueue()
        for _ in range(count):
            self._idle.put(None)

    def results(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Iterator[tuple[int, Any]]:
        """See `Pool`."""
        for number, outcome in together(
            [partial(self._done, function, item) for item in items], self.count, give_up=self.end
        ):
            if isinstance(outcome, BaseException):
                raise outcome
            yield number, outcome

    def _done(self, function: Callable[[Item], Any], item: Item, say: Say) -> Any:
        """The result of a worker for an item, or of another one where it dies."""
        for _ in range(RETRIES + 1):
            worker = self._idle.get()
            try:
                worker = self._started() if worker is None else worker
                answer = _asked(worker, (function, item))
            except (EOFError, OSError, pickle.UnpicklingError):
                self._idle.put(None)
                say(0.0)  # which goes no further where all are given up
            else:
                self._idle.put(worker)
                return answer
        return Failure(f"its worker died {RETRIES + 1} times: out of memory, or killed from outside")

    def _started(self) -> Worker:
        packages = os.pathsep.join(path or os.getcwd() for path in sys.path)
        self._all.append(
            subprocess.Popen(
                [sys.executable, "-m", __name__, *plugins()],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, **_ONE_THREAD, "PYTHONPATH": packages},
                start_new_session=True,  # Ctrl-C is for the one who waits
            )
        )
        return self._all[-1]

    def end(self) -> None:
        """End all workers, whatever they do."""
        for worker in self._all:
            with suppress(OSError):
                _pipe(worker.stdin).close()
        for worker in self._all:
            try:
                worker.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                worker.kill()
                worker.wait()


@contextmanager
def crew(count: int) -> Iterator[Crew]:
    """So many workers, which end with the block. InputError for a number that is none."""
    if type(count) is not int or count < 1:
        raise InputError(f"there cannot be {count} workers; give 0 for this process, or how many")
    made = Crew(count)
    try:
        yield made
    finally:
        made.end()


def _asked(worker: Worker, task: tuple[Callable[[Any], Any], Any]) -> Any:
    """The answer of a worker, an InputError where it can do no task. Raises EOFError or OSError where it is dead."""
    pickle.dump(task, _pipe(worker.stdin))
    _pipe(worker.stdin).flush()
    return pickle.load(_pipe(worker.stdout))


def _pipe(stream: Any) -> BinaryIO:
    found: BinaryIO = stream
    return found


# ---- in the worker --------------------------------------------------------------------------------------------------


def _serve(tasks: BinaryIO, answers: BinaryIO, files: Sequence[str]) -> None:
    refused = _refused(files)
    waiting: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(tasks, waiting), daemon=True).start()
    with suppress(KeyboardInterrupt, BrokenPipeError), alone():  # who asked may be gone
        while (task := waiting.get()) is not None:
            function, item = task
            pickle.dump(refused or tried(function, item), answers)
            answers.flush()


def _refused(files: Sequence[str]) -> InputError | None:
    """Why a file that was loaded where the study runs cannot be loaded here; None where all can."""
    try:
        for file in files:
            load_plugin(file)
    except InputError as error:
        return InputError(f"a worker of the study cannot load what was loaded when it began. {error}")
    return None


def _read(tasks: BinaryIO, waiting: queue.SimpleQueue[Any]) -> None:
    """Tasks as they come; where there are no more, nobody waits for what is being done."""
    with suppress(EOFError, OSError):
        while True:
            waiting.put(pickle.load(tasks))
    waiting.put(None)
    time.sleep(IDLE)
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(PATIENCE)
    os._exit(1)


if __name__ == "__main__":
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print does not come between
    _serve(sys.stdin.buffer, replies, sys.argv[1:])
    os._exit(0)
