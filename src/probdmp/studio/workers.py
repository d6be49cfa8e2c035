"""Warm processes for work that takes longer than a tick, with a time limit for each piece of it."""

import asyncio
import os
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing import get_context
from typing import Any, TypeVar

from probdmp.errors import InputError
from probdmp.studio.limits import JOB_SECONDS

__all__ = ["Workers"]

Result = TypeVar("Result")


def _prepare() -> None:
    """In a new process: what every piece of work needs, loaded; interruptions are for the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import probdmp.studio.jobs

    probdmp.studio.jobs.warm_up()


class _Worker:
    """One process, known by its number so that it can be ended."""

    def __init__(self) -> None:
        self._executor = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_prepare)
        self._number = self._executor.submit(os.getpid)

    async def run(self, work: Callable[..., Result], arguments: tuple[Any, ...], seconds: float) -> Result:
        await asyncio.wrap_future(self._number)  # starting does not count
        return await asyncio.wait_for(asyncio.wrap_future(self._executor.submit(work, *arguments)), seconds)

    def end(self) -> None:
        """Now, whatever it is doing."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        if self._number.done() and not self._number.cancelled() and self._number.exception() is None:
            with suppress(ProcessLookupError):
                os.kill(self._number.result(), signal.SIGKILL)


class Workers:
    """A few processes; work waits for one that is free, in the order in which it was asked for.

    Parameters
    ----------
    count : of processes.
    seconds : for which a piece of work may go on; then its process is ended and replaced.
    """

    def __init__(self, count: int = 2, seconds: float = JOB_SECONDS) -> None:
        self._count, self._seconds = count, seconds
        self._free: asyncio.Queue[_Worker] = asyncio.Queue()
        self._all: set[_Worker] = set()

    def start(self) -> None:
        """Start the processes; they get ready in the background."""
        for _ in range(self._count):
            self._add()

    def stop(self) -> None:
        """End them."""
        for worker in self._all:
            worker.end()
        self._all.clear()

    async def run(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """What a function of `probdmp.studio.jobs` returns, or the error it raises.

        Raises
        ------
        InputError
            If it takes longer than allowed, or its process dies.
        """
        worker = await self._free.get()
        try:
            return await worker.run(work, arguments, self._seconds)
        except (TimeoutError, BrokenProcessPool) as error:
            worker = self._replaced(worker)
            late = isinstance(error, TimeoutError)
            got = f"more than {self._seconds:g} s" if late else "a process that ended, perhaps for lack of memory"
            hint = "Fewer or shorter strokes, or fewer basis functions, take less."
            raise InputError(f"work of at most {self._seconds:g} s", got, hint) from error
        except asyncio.CancelledError:
            worker = self._replaced(worker)
            raise
        finally:
            if worker in self._all:
                self._free.put_nowait(worker)

    def _add(self) -> None:
        worker = _Worker()
        self._all.add(worker)
        self._free.put_nowait(worker)

    def _replaced(self, worker: _Worker) -> _Worker:
        worker.end()
        if worker in self._all:
            self._all.remove(worker)
            worker = _Worker()
            self._all.add(worker)
        return worker
