"""A session with what is going on in it: learning, playing, tracing; asked by messages of its page."""

import asyncio
import secrets
import time
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

import numpy as np

from probdmp.errors import ProbDMPError
from probdmp.execution import planned_recording
from probdmp.studio import views
from probdmp.studio.bands import asked_of, band_view
from probdmp.studio.frames import PLAYING, frame_of
from probdmp.studio.learner import Learner
from probdmp.studio.limits import DT, FRAME_RATE
from probdmp.studio.playing import Playing, faulty
from probdmp.studio.session import Session
from probdmp.studio.tracing import Tracing
from probdmp.studio.workers import Workers

__all__ = ["Room"]


class Room:
    """One session at work."""

    def __init__(self, session: Session, workers: Workers) -> None:
        self.session, self.workers = session, workers
        self.learner = Learner(session, workers, self.show_band)
        self.playing: Playing | None = None
        self.tracing: Tracing | None = None
        self._show: asyncio.Task[None] | None = None
        self._sequence = 0

    def close(self) -> None:
        """Stop everything."""
        self.learner.close()
        self.stop()

    def stop(self) -> None:
        """Stop playing."""
        if self._show is not None:
            self._show.cancel()
        self.playing = self._show = None

    async def show_band(self, label: str) -> None:
        """Send what was learned of a label."""
        movement = self.session.movements.get(label)
        if movement is None or movement.learned is None:
            return
        band = await asyncio.to_thread(band_view, self.session, label, movement)
        self.session.send(band, f"band {label}")

    def show_state(self) -> None:
        """Send all that the page needs to know."""
        self.session.send(views.state_view(self.session), "state")

    async def play(self, fault: str | None, onset: float, speed: float) -> None:
        """Begin to play the selected movement."""
        self.stop()
        await self.learner.settled()
        label, learned = self.session.learned(None)
        self.playing = playing = await asyncio.to_thread(self._prepared, label, fault, onset, speed)
        self.session.send(
            {
                "type": "playing",
                "label": label,
                "duration": float(playing.execution.task.duration),
                "names": list(playing.names),
                "alpha": self.session.settings.alpha,
                "threshold": 1.0,
            }
        )
        self._show = asyncio.create_task(self._play(playing))

    def _prepared(self, label: str, fault: str | None, onset: float, speed: float) -> Playing:
        session, seed = self.session, secrets.randbits(32)
        _, learned = session.learned(label)
        executed, task = asked_of(session, learned)
        rng = np.random.default_rng(seed)
        others = [s for name, strokes in session.all_strokes().items() if name != label for s in strokes]
        recording = faulty(planned_recording(executed.primitive_, task, DT, rng), fault, onset, label, others, seed)
        return Playing(executed, session.task.arguments, self._detector(label, executed), recording, speed, rng)

    def _detector(self, label: str, executed: Any) -> Any:
        detector = self.session.detectors.get(label)
        known = set() if detector is None else {p.identity for p in detector.primitives_.values()}
        return detector if executed.primitive_.identity in known else None

    async def _play(self, playing: Playing) -> None:
        """Frames until the pen has arrived."""
        shown = time.perf_counter()
        while not playing.is_over:
            await asyncio.sleep(max(0.0, shown + 1 / FRAME_RATE - time.perf_counter()))
            now = time.perf_counter()
            tick, shown = playing.advance(now - shown), now
            if tick is not None and self.session.outbox is not None:
                self._sequence += 1
                self.session.outbox.show(frame_of(PLAYING, self._sequence, *tick))
            if playing.has_new_alarm():
                self.session.send(views.verdict_view(playing.execution.verdict))
        self.session.send(views.verdict_view(playing.execution.verdict) | {"final": True})
        self.session.send({"type": "played", "completed": True})
        self.playing = None
