"""Learning as strokes come in: in a worker, the newest stroke first, older results ignored."""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from probdmp.detection import FailureDetector
from probdmp.errors import ProbDMPError
from probdmp.studio import jobs, views
from probdmp.studio.session import Session
from probdmp.studio.workers import TooLongError, Workers

__all__ = ["Learner"]

EACH_BY_ITSELF = (
    "There are too many strokes to compare all letters in time: each letter is watched by itself, and an alarm does not say "
    "which other one fits better. With fewer letters, or fewer strokes of each, it does."
)


class Learner:
    """Keeps what was learned up to date with the demonstrations of one session.

    Parameters
    ----------
    on_learned : called with the label after something was learned.
    """

    def __init__(self, session: Session, workers: Workers, on_learned: Callable[[str], Awaitable[None]]) -> None:
        self._session, self._workers, self._on_learned = session, workers, on_learned
        self._waiting: dict[str, float] = {}
        self._is_stale = False
        self._news = asyncio.Event()
        self._learning: asyncio.Task[None] | None = None
        self._calibrating: asyncio.Task[None] | None = None
        self._too_many: float = math.inf
        """Demonstrations that took too long to calibrate together."""

    def learn(self, *labels: str) -> None:
        """Learn labels anew, as soon as may be; the last one first."""
        for label in labels:
            self._waiting.pop(label, None)
            self._waiting[label] = time.perf_counter()
        if self._learning is None or self._learning.done():
            self._learning = asyncio.create_task(self._learn_all())
        self.calibrate()

    def calibrate(self) -> None:
        """What is normal has changed: fit the detectors anew."""
        self._is_stale = True
        if self._calibrating is None or self._calibrating.done():
            self._calibrating = asyncio.create_task(self._calibrate_all())

    async def ready(self, label: str) -> None:
        """Wait until a label is learned and watched as well as it will be, or until there is nothing to do."""
        while tasks := self._tasks():
            if self._is_watched(label):
                return
            self._news.clear()
            news = asyncio.create_task(self._news.wait())
            await asyncio.wait([*tasks, news], return_when=asyncio.FIRST_COMPLETED)
            news.cancel()

    async def settled(self) -> None:
        """Wait until there is nothing to do."""
        while tasks := self._tasks():
            await asyncio.wait(tasks)

    def close(self) -> None:
        """Stop."""
        for task in self._tasks():
            task.cancel()

    def _tasks(self) -> list[asyncio.Task[None]]:
        """What is going on."""
        return [task for task in (self._learning, self._calibrating) if task is not None and not task.done()]

    def _is_watched(self, label: str) -> bool:
        movement, detector = self._session.movements.get(label), self._session.detectors.get(label)
        if label in self._waiting or movement is None or movement.learned is None or detector is None:
            return False
        return any(p.identity == movement.learned.primitive_.identity for p in detector.primitives_.values())

    async def _learn_all(self) -> None:
        while self._waiting:
            await self._learn(*self._waiting.popitem())

    async def _calibrate_all(self) -> None:
        while self._is_stale:
            if self._learning is not None and not self._learning.done():
                await asyncio.wait([self._learning])
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
        """The selected movement by itself, which is soon done; then all together, which can tell them apart."""
        session = self._session
        library = {label: p for label, p in session.library.items() if session.movements[label].strokes}
        strokes = {label: tuple(session.movements[label].strokes) for label in library}
        found = {}
        for label, movement in session.movements.items():
            if movement.given_detector is not None and movement.learned is not None and not movement.strokes:
                found[label] = movement.given_detector
        await self._simulated(found)
        chosen = session.selected if session.selected in library else None
        try:
            if chosen is not None and len(library) > 1:
                alone = {chosen: library[chosen]}, {chosen: strokes[chosen]}
                session.detectors = {**session.detectors, **found} | await self._calibrated(*alone)
                self._news.set()
            if not self._is_stale and library:
                found |= await self._all_calibrated(library, strokes)
            kept = {label: d for label, d in session.detectors.items() if label in session.movements}
            session.detectors, session.calibration_problem = kept | found, ""
            self._news.set()
        except ProbDMPError as error:
            session.calibration_problem = str(error)
        session.send(views.state_view(session), "state")

    async def _all_calibrated(self, library: dict[str, Any], strokes: dict[str, Any]) -> dict[str, FailureDetector]:
        """Together; or each by itself, those that have changed, where that took too long before."""
        count = sum(map(len, strokes.values()))
        if count < self._too_many:
            try:
                together = await self._calibrated(library, strokes)
            except TooLongError:
                if len(library) == 1:
                    raise
                self._too_many = count
            else:
                self._session.calibration_note = ""
                return together
        self._session.calibration_note = EACH_BY_ITSELF
        return await self._each_calibrated(library, strokes)

    async def _each_calibrated(self, library: dict[str, Any], strokes: dict[str, Any]) -> dict[str, FailureDetector]:
        session, found = self._session, {}
        for label, learned in library.items():
            known = session.detectors.get(label)
            own = [] if known is None else [p.identity for p in known.primitives_.values()]
            if known is not None and own == [learned.primitive_.identity] and known.false_alarm_rate == session.settings.alpha:
                found[label] = known
            elif not self._is_stale:  # else all begins anew
                found |= await self._calibrated({label: learned}, {label: strokes[label]})
        return found

    async def _calibrated(self, library: dict[str, Any], strokes: dict[str, Any]) -> dict[str, FailureDetector]:
        return await self._workers.run_long(jobs.calibrate, library, strokes, self._session.settings.alpha)

    async def _simulated(self, found: dict[str, FailureDetector]) -> None:
        """Detectors of movements that came without demonstrations and without a detector."""
        session = self._session
        for label, movement in list(session.movements.items()):
            learned = movement.learned
            if learned is None or movement.strokes or label in found:
                continue
            with suppress(ProbDMPError):
                found[label] = await self._workers.run_long(jobs.calibrate_by_simulation, learned, session.settings.alpha)
