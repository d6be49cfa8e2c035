"""Learning as strokes come in: in a worker, the newest stroke first, older results ignored."""

import asyncio
import time
from collections.abc import Awaitable, Callable

from probdmp.errors import ProbDMPError
from probdmp.studio import jobs, views
from probdmp.studio.session import Session
from probdmp.studio.workers import Workers

__all__ = ["Learner"]


class Learner:
    """Keeps what was learned up to date with the demonstrations of one session.

    Parameters
    ----------
    on_change : called after something was learned or calibrated.
    """

    def __init__(self, session: Session, workers: Workers, on_learned: Callable[[str], Awaitable[None]]) -> None:
        self._session, self._workers, self._on_learned = session, workers, on_learned
        self._waiting: dict[str, float] = {}
        self._is_stale = False
        self._task: asyncio.Task[None] | None = None

    def learn(self, *labels: str) -> None:
        """Learn labels anew, as soon as may be; the last one first."""
        for label in labels:
            self._waiting.pop(label, None)
            self._waiting[label] = time.perf_counter()
        self.calibrate()

    def calibrate(self) -> None:
        """What is normal has changed: fit the detectors anew."""
        self._is_stale = True
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._work())

    async def settled(self) -> None:
        """Wait until there is nothing to do."""
        while self._task is not None and not self._task.done():
            await asyncio.wait([self._task])

    def close(self) -> None:
        """Stop."""
        if self._task is not None:
            self._task.cancel()

    async def _work(self) -> None:
        while self._waiting or self._is_stale:
            if self._waiting:
                label, since = self._waiting.popitem()
                await self._learn(label, since)
            else:
                self._is_stale = False
                await self._calibrate()

    async def _learn(self, label: str, since: float) -> None:
        session = self._session
        movement = session.movements.get(label)
        if movement is None:
            return
        if not movement.strokes:
            movement.learned = movement.before = None
            return
        version, settings = movement.version, session.settings
        session.send({"type": "learning", "label": label}, f"learning {label}")
        try:
            learned = await self._workers.run(jobs.learn, tuple(movement.strokes), settings.parameters)
        except ProbDMPError as error:
            if movement.version == version:
                movement.learned = None
                session.send({"type": "learning_failed", "label": label, "error": views.error_view(error)}, f"failed {label}")
            return
        if movement.version != version or session.movements.get(label) is not movement or label in self._waiting:
            return  # a newer stroke has come, and will be learned from
        movement.before, movement.learned = movement.learned, learned
        movement.seconds = time.perf_counter() - since
        await self._on_learned(label)

    async def _calibrate(self) -> None:
        session = self._session
        library = {label: p for label, p in session.library.items() if session.movements[label].strokes}
        strokes = {label: tuple(session.movements[label].strokes) for label in library}
        taught = {label: {d.fingerprint for d in strokes[label]} for label in library}
        if any(taught[label] != library[label].taught_by_ for label in library):
            return  # something failed to be learned from what is there now
        try:
            session.detectors = await self._workers.run(jobs.calibrate, library, strokes, session.settings.alpha)
            session.is_calibrated_late = ""
        except ProbDMPError as error:
            session.detectors, session.is_calibrated_late = {}, str(error)
        session.send(views.state_view(session), "state")
