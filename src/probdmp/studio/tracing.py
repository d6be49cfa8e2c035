"""A movement that somebody draws, scored while it is drawn."""

import asyncio

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, LiveResampling
from probdmp.demonstrations.demonstration import SHORTEST_RECORDING
from probdmp.detection import FailureDetector
from probdmp.errors import InputError
from probdmp.estimator import ProbabilisticDMP
from probdmp.execution import ExecutionStep
from probdmp.studio.limits import DT, LONGEST_STROKE

__all__ = ["Tracing"]

TICKS_AT_ONCE = 8
"""After which others have their turn."""


class Tracing:
    """The pen of a person as the robot.

    Parameters
    ----------
    label : of the movement that is to be drawn; None: whichever it turns out to be.
    """

    def __init__(
        self, label: str | None = None, learned: ProbabilisticDMP | None = None, detector: FailureDetector | None = None
    ) -> None:
        self.label = label
        self.execution = None if learned is None else learned.execute(dt=DT, detector=detector)
        self._n_outputs = 2 if self.execution is None else len(self.execution.array.outputs)
        self._resampling, self._rows = LiveResampling(DT), [np.empty((0, 3))]
        self._said = ""

    async def add(self, points: FloatArray) -> tuple[ExecutionStep, FloatArray] | None:
        """The last tick and its readings (S,), if a movement is scored and points, (n, 4), made a tick due."""
        if points[-1, 0] - points[0, 0] > LONGEST_STROKE or self.duration > LONGEST_STROKE:
            raise InputError(f"a drawing of at most {LONGEST_STROKE:g} s", "a longer one", "Begin again.")
        rows = self._resampling.add(points[:, 0], points[:, 1:])
        self._rows.append(rows)
        last = None
        if self.execution is not None:
            for k, row in enumerate(rows[:, : self._n_outputs]):
                last = self.execution.step(row), row
                if k % TICKS_AT_ONCE == TICKS_AT_ONCE - 1:
                    await asyncio.sleep(0)
        return last

    @property
    def duration(self) -> float:
        """Seconds so far."""
        return sum(map(len, self._rows)) * DT

    @property
    def drawn(self) -> Demonstration | None:
        """What was drawn so far; None as long as it is hardly begun."""
        rows = np.concatenate(self._rows)
        return Demonstration(rows[:, :2], DT) if len(rows) >= SHORTEST_RECORDING else None

    def has_news(self) -> bool:
        """Whether there is an alarm, and it says something that it did not say when this was asked last."""
        is_alarm = self.execution is not None and self.execution.failed
        before, self._said = self._said, str(self.execution.verdict) if self.execution is not None and is_alarm else ""
        return self._said not in ("", before)
