"""Scoring parts of a file, in this process or in others."""

import io
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, NamedTuple, TypeVar

import numpy as np

from probdmp import __version__
from probdmp.errors import DataFileError, ProbDMPError
from probdmp.fleet.plan import Part
from probdmp.fleet.scorer import Scorer
from probdmp.fleet.scores import ENCODED
from probdmp.io import ParquetExecutions

__all__ = ["Assignment", "Worker", "one_thread_each", "process_pool", "score_here", "score_in_processes"]

Item = TypeVar("Item")
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""What keeps the linear algebra of several processes from getting in each other's way."""
WAITING = 2
"""Parts that are handed to each process at a time: the one it works at, and the next."""


class Assignment(NamedTuple):
    """What a worker has to know once."""

    model: bytes
    """The model file."""
    name: str
    """Its name, for messages."""
    path: str
    """Of the executions."""
    fingerprint: str
    """Of the executions, so that no worker reads another file under the same name."""
    version: str
    """Of probdmp, so that all workers score in the same way."""


class Worker:
    """Scores parts, one after the other.

    Parameters
    ----------
    threads : that score the executions of a part at the same time.

    Raises
    ------
    DataFileError, ModelFileError
        If the files cannot be used.
    """

    def __init__(self, assignment: Assignment, threads: int = 1) -> None:
        if assignment.version != __version__:
            hint = "Install the same on every worker."
            raise ProbDMPError(f"probdmp {assignment.version} on all workers", f"{__version__} on one of them", hint)
        self._scorer = Scorer(assignment.model, assignment.name, threads)
        self._file = ParquetExecutions(assignment.path)
        if self._file.fingerprint != assignment.fingerprint:
            hint = "Every worker must see the same file, and nobody may write to it meanwhile."
            raise DataFileError(f"the same executions at {assignment.path!r} for all workers", "others", hint)
        self._columns = self._scorer.columns(self._file.layout, self._file.path)

    def scores(self, parts: Iterable[Part]) -> Iterator[tuple[int, bytes]]:
        """Of each part its index and its scores, a Parquet file; the next is read and begun meanwhile."""
        from threadpoolctl import threadpool_limits

        done: list[Any] = []
        with threadpool_limits(1, "blas"):  # threads share executions; those of the linear algebra would be in their way
            for number, ended in _one_behind(self._begun(parts)):
                done.append(ended())
                del ended  # or the executions that are scored would be kept while others are read
                if number is not None:
                    yield number, _payload(done)
                    done.clear()

    def _begun(self, parts: Iterable[Part]) -> Iterator[tuple[int | None, Callable[[], Any]]]:
        """Of each table what waits for its scores, with the number of the part that ends with it."""
        for part in parts:
            n_begun = 0
            for table in self._file.read(part.span, self._columns):
                again = np.isin(np.arange(n_begun, n_begun + len(table)), part.repeated)
                table.refuse(again, "Expected each execution_id once, its rows together, got it in several places of the file.")
                n_begun += len(table)
                yield part.number if n_begun == part.n_executions else None, self._scorer.begin(table)


def score_here(assignment: Assignment, parts: Sequence[Part]) -> Iterator[tuple[int, bytes]]:
    """In this process, on all processors that it may use."""
    yield from Worker(assignment, processors()).scores(parts)


def score_in_processes(assignment: Assignment, parts: Sequence[Part], jobs: int) -> Iterator[tuple[int, bytes]]:
    """In several processes on this machine, as they get done.

    Raises
    ------
    ProbDMPError
        If one of them is killed.
    """
    waiting: set[Future[tuple[int, bytes]]] = set()
    with process_pool(jobs, assignment) as pool:
        for part in parts:
            waiting.add(pool.submit(_score, part))
            if len(waiting) >= WAITING * jobs:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        yield from (future.result() for future in waiting)


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def process_pool(jobs: int, assignment: Assignment | None = None) -> Iterator[ProcessPoolExecutor]:
    """Processes that end with this one, whose linear algebra has one thread each.

    Raises
    ------
    ProbDMPError
        If one of them is killed.
    """
    context = multiprocessing.get_context("spawn")
    with one_thread_each():
        pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin, initargs=(assignment,))
        try:
            yield pool
        except BrokenProcessPool as error:
            hint = "Was there enough memory? Call it again, perhaps with fewer --jobs."
            raise ProbDMPError("all processes to live until the end", "one that was killed", hint) from error
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """The linear algebra of processes that are started meanwhile has one thread."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # read by what a process imports, so they cannot be told later
    try:
        yield
    finally:
        os.environ.update({name: value for name, value in before.items() if value is not None})
        for name in (name for name, value in before.items() if value is None):
            del os.environ[name]


_worker: Worker | None = None
"""Of a process that was started by `score_in_processes`."""


def _begin(assignment: Assignment | None) -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    if assignment is not None:
        global _worker
        _worker = Worker(assignment)


def _end_with(parent: Any) -> None:
    """A process whose parent was killed would wait for work for ever."""
    parent.join()
    os._exit(1)


def _score(part: Part) -> tuple[int, bytes]:
    assert _worker is not None, "the process was initialized"
    return next(_worker.scores([part]))


def _one_behind(items: Iterator[Item]) -> Iterator[Item]:
    """The items, each when the next one is there."""
    waiting: list[Item] = []
    for item in items:
        yield from waiting
        waiting = [item]
    yield from waiting


def _payload(tables: list[Any]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(pa.concat_tables(tables).unify_dictionaries().combine_chunks(), buffer, use_dictionary=ENCODED)
    return buffer.getvalue()
