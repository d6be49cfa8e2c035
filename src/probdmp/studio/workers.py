"""Warm processes for work that takes longer than a tick, with a time limit for each piece of it."""

import asyncio
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, get_context
from typing import Any, TypeVar

from probdmp.errors import InputError
from probdmp.fleet.work import one_thread_each
from probdmp.studio.limits import JOB_SECONDS

__all__ = ["TooLongError", "Workers"]

Result = TypeVar("Result")
LONGEST_END = 2.0
"""Seconds to wait for a process that was ended, in case that it does not."""


class TooLongError(InputError):
    """Work that was ended because it took longer than it may."""


def _prepare(warms_up: bool) -> None:
    """In a new process: what every piece of work needs, loaded; interruptions are for the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if warms_up:
        from probdmp.studio.jobs import warm_up

        warm_up()


class _Worker:
    """One process, that can be ended at any time."""

    def __init__(self, warms_up: bool) -> None:
        context = get_context("spawn")
        self._executor = ProcessPoolExecutor(1, mp_context=context, initializer=_prepare, initargs=(warms_up,))
        others = set(active_children())
        with one_thread_each():
            self._ready = self._executor.submit(os.getpid)
        self._processes = set(active_children()) - others

    async def run(self, work: Callable[..., Result], arguments: tuple[Any, ...], seconds: float) -> Result:
        await asyncio.wrap_future(self._ready)  # starting does not count
        return await asyncio.wait_for(asyncio.wrap_future(self._executor.submit(work, *arguments)), seconds)

    def end(self) -> None:
        """Now, whatever it is doing."""
        # Its threads have to be gone too: at the end of the program they would be woken, and may just be ending.
        ending = threading.Thread(target=self._executor.shutdown, kwargs={"cancel_futures": True}, daemon=True)
        ending.start()
        for process in self._processes:
            process.kill()
        ending.join(LONGEST_END)


class Workers:
    """Two processes, one for what a page waits for, one for what may take seconds; work waits for its turn.

    Parameters
    ----------
    seconds : for which a piece of work may go on; then its process is ended and replaced.
    warms_up : whether what the work needs is loaded beforehand.
    """

    def __init__(self, seconds: float = JOB_SECONDS, warms_up: bool = True) -> None:
        self._quick, self._long = _Post(seconds, warms_up), _Post(seconds, warms_up)

    def start(self) -> None:
        """Start the processes; they get ready in the background."""
        self._quick.start()
        self._long.start()

    def stop(self) -> None:
        """End them."""
        self._quick.stop()
        self._long.stop()

    async def run(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """What a function returns, or the error it raises.

        Raises
        ------
        TooLongError
            If it takes longer than allowed.
        InputError
            If its process dies.
        """
        return await self._quick.run(work, arguments)

    async def run_long(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """The same for what may take seconds."""
        return await self._long.run(work, arguments)


class _Post:
    """A process that is replaced when it has to be ended; one piece of work at a time."""

    def __init__(self, seconds: float, warms_up: bool) -> None:
        self._seconds, self._warms_up, self._turn = seconds, warms_up, asyncio.Lock()
        self._worker: _Worker | None = None

    def start(self) -> None:
        self._worker = _Worker(self._warms_up)

    def stop(self) -> None:
        if self._worker is not None:
            self._worker.end()
        self._worker = None

    async def run(self, work: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
        async with self._turn:
            if self._worker is None:
                raise InputError("a server that is running", "one that has stopped")
            try:
                return await self._worker.run(work, arguments, self._seconds)
            except (TimeoutError, BrokenProcessPool) as error:
                self._replace()
                wanted, hint = (
                    f"work of at most {self._seconds:g} s",
                    "Fewer or shorter strokes, or fewer basis functions, take less.",
                )
                if isinstance(error, TimeoutError):
                    raise TooLongError(wanted, f"more than {self._seconds:g} s", hint) from error
                raise InputError(wanted, "a process that ended, perhaps for lack of memory", hint) from error
            except asyncio.CancelledError:
                self._replace()  # it would go on for nobody
                raise

    def _replace(self) -> None:
        if self._worker is not None:
            self._worker.end()
            self._worker = _Worker(self._warms_up)
