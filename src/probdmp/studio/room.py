"""A session with what is going on in it: learning, playing, tracing; asked by messages of its page."""

import asyncio
import secrets
import time

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection import FailureDetector
from probdmp.dmp import Task
from probdmp.errors import InputError, ProbDMPError
from probdmp.estimator import ProbabilisticDMP
from probdmp.execution import ExecutionStep, planned_recording
from probdmp.io.plain_values import plain
from probdmp.studio import jobs, views
from probdmp.studio.bands import asked_of, band_view
from probdmp.studio.frames import PLAYING, TRACING, frame_of
from probdmp.studio.learner import Learner
from probdmp.studio.limits import DT, FRAME_RATE
from probdmp.studio.origins import as_executed
from probdmp.studio.playing import Playing, faulty
from probdmp.studio.session import Session, TaskWish
from probdmp.studio.tracing import Tracing
from probdmp.studio.workers import Workers

__all__ = ["Room"]


class Room:
    """One session at work."""

    def __init__(self, session: Session, workers: Workers) -> None:
        self.session, self.workers = session, workers
        self.learner = Learner(session, workers, self.show_learned)
        self.playing: Playing | None = None
        self.tracing: Tracing | None = None
        self._show: asyncio.Task[None] | None = None
        self._recognising: asyncio.Task[None] | None = None
        self._simulated: FailureDetector | None = None
        self._sequence = 0

    def close(self) -> None:
        """Stop everything."""
        self.learner.close()
        self.stop()
        if self._recognising is not None:
            self._recognising.cancel()

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
        band = await asyncio.to_thread(band_view, label, movement, self.session.task_of(label))
        self.session.send(band, f"band {label}")

    async def show_learned(self, label: str) -> None:
        """The same of what was learned just now; it may be none for which the task of the page makes sense."""
        try:
            await self.show_band(label)
        except ProbDMPError as error:
            self.session.task = TaskWish()
            self.session.send({"type": "error", **views.error_view(error)})
            await self.show_band(label)

    def show_state(self) -> None:
        """Send all that the page needs to know."""
        self.session.send(views.state_view(self.session), "state")

    async def play(self, fault: str | None, onset: float, speed: float) -> None:
        """Begin to play the selected movement."""
        self.stop()
        label, learned = await self._ready(None)
        executed, task = asked_of(self.session.task, learned)
        detector = await self.detector_of(label, executed)
        prepared = (label, executed, task, detector, fault, onset, speed)
        self.playing = playing = await asyncio.to_thread(self._prepared, *prepared)
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

    async def _ready(self, label: str | None) -> tuple[str, ProbabilisticDMP]:
        """A label and what was learned of it, once that is up to date and watched."""
        chosen = self.session.selected if label is None else label
        if chosen is not None:
            await self.learner.ready(chosen)
        return self.session.learned(label)

    def _prepared(
        self,
        label: str,
        executed: ProbabilisticDMP,
        task: Task,
        detector: FailureDetector | None,
        fault: str | None,
        onset: float,
        speed: float,
    ) -> Playing:
        session, seed = self.session, secrets.randbits(32)
        rng = np.random.default_rng(seed)
        others = [s for name, strokes in session.all_strokes().items() if name != label for s in strokes]
        recording = faulty(planned_recording(executed.primitive_, task, DT, rng), fault, onset, label, others, seed)
        return Playing(executed, session.task.arguments, detector, recording, speed, rng)

    async def detector_of(self, label: str, executed: ProbabilisticDMP) -> FailureDetector | None:
        """What judges executions of a movement; through via-points it is another one than was taught, and is simulated."""
        detector, identity = self.session.detectors.get(label), executed.primitive_.identity
        for known in (detector, self._simulated):
            if known is not None and identity in {p.identity for p in known.primitives_.values()}:
                return known
        if not self.session.task.via:
            return None
        alpha = self.session.settings.alpha
        self._simulated = await self.workers.run_long(jobs.calibrate_by_simulation, executed, alpha)
        return self._simulated

    def shared_detector(self) -> FailureDetector | None:
        """The detector of all movements of the session, if there is one."""
        detectors = list(self.session.detectors.values())
        own = {p.primitive_.identity for p in self.session.library.values()}
        for detector in detectors:
            if own <= {p.identity for p in detector.primitives_.values()}:
                return detector
        return None

    async def _play(self, playing: Playing) -> None:
        """Frames until the pen has arrived."""
        shown = due = time.perf_counter()
        while not playing.is_over:
            due = max(due + 1 / FRAME_RATE, shown)  # of the last frame, so that what is slept too long does not add up
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            now = time.perf_counter()
            tick, shown = await asyncio.to_thread(playing.advance, now - shown), now
            self._show_tick(PLAYING, tick)
            if playing.has_news():
                self.session.send(views.verdict_view(playing.execution.verdict))
        self.session.send(views.verdict_view(playing.execution.verdict) | {"final": True})
        self.session.send({"type": "played", "completed": True})
        self.playing = self._show = None

    def _show_tick(self, kind: int, tick: tuple[ExecutionStep, FloatArray] | None) -> None:
        if tick is not None:
            self._sequence += 1
            if self.session.outbox is not None:
                self.session.outbox.show(frame_of(kind, self._sequence, *tick))

    async def begin_trace(self, label: str | None) -> None:
        """A person is going to draw a movement, the one with a label or whichever it turns out to be."""
        self.stop()
        self.tracing = None
        if label is None:
            self.tracing = Tracing()
            return
        name, learned = await self._ready(label)
        self.tracing = Tracing(name, learned, await self.detector_of(name, learned))

    async def trace(self, points: FloatArray) -> None:
        """More of what is drawn."""
        tracing = self._traced()
        self._show_tick(TRACING, await tracing.add(points))
        if tracing.execution is not None and tracing.has_news():
            self.session.send(views.verdict_view(tracing.execution.verdict))
        if self._recognising is None or self._recognising.done():
            self._recognising = asyncio.create_task(self._recognise(tracing, False))

    async def end_trace(self) -> None:
        """It has been drawn."""
        tracing, self.tracing = self._traced(), None
        if tracing.execution is not None:
            self.session.send(views.verdict_view(tracing.execution.verdict) | {"final": True})
        if self._recognising is not None:
            await asyncio.wait([self._recognising])
        await self._recognise(tracing, True)

    def _traced(self) -> Tracing:
        if self.tracing is None:
            raise InputError("trace_begin before what is drawn", "none")
        return self.tracing

    async def _recognise(self, tracing: Tracing, is_complete: bool) -> None:
        """Say which movement it looks like."""
        drawn, library = tracing.drawn, self.session.library
        if drawn is None or not library:
            return
        try:
            scores = await self.workers.run(jobs.recognise, library, drawn, is_complete)
        except ProbDMPError:
            return  # too short, or too slow: the next one may do
        if scores:
            best = max(scores, key=scores.__getitem__)
            self.session.send(
                plain({"type": "recognised", "label": best, "scores": scores, "final": is_complete}), "recognised"
            )

    async def replay(self, label: str, index: int) -> None:
        """Show an execution as the detector has seen it."""
        own, recording = self.session.recording(label, index)
        name, learned = await self._ready(own)
        detector = self.session.detectors.get(name)
        if detector is not None and not any(p.identity == learned.primitive_.identity for p in detector.primitives_.values()):
            detector = None
        recording = as_executed(recording, learned.primitive_)
        self.session.send(await self.workers.run_long(jobs.judge, name, learned, detector, recording), "replayed")

    async def compare(self, label: str, index: int) -> None:
        """Show an execution as recorded, filtered, smoothed."""
        own, recording = self.session.recording(label, index)
        name, learned = await self._ready(own)
        recording = as_executed(recording, learned.primitive_)
        self.session.send(await self.workers.run_long(jobs.compare, name, learned, recording), "compared")
