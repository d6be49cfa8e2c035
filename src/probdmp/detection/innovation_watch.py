"""Sensors that measure neither a position nor a learned channel as it is: judged by the innovations of the filter.

    value of a sensor     mean of its squared innovations, in standard deviations, over the last 5 % of the movement

A velocity, or the place of the tool in a camera, follows from all states: what it should be is for the filter to say.
"""

from collections import deque

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.sources import NIS_WINDOW, signed_squares
from probdmp.dmp import Task
from probdmp.execution import Observed, SensorArray

__all__ = ["InnovationWatch", "watched_sensors"]


def watched_sensors(array: SensorArray) -> tuple[str, ...]:
    """Names of the sensors that are judged by their innovations."""
    return tuple(name for name in array.names if not array.is_direct(name))


class InnovationWatch:
    """The W sensors of one execution that are judged so."""

    def __init__(self, array: SensorArray, task: Task, dt: float) -> None:
        length = max(1, round(NIS_WINDOW * float(task.duration) / dt))
        self._parts = [array.slices[name] for name in watched_sensors(array)]
        self._recent: list[deque[float]] = [deque(maxlen=length) for _ in self._parts]
        self._largest = np.full(len(self._parts), np.nan)
        self._last: Observed | None = None

    def update(self, observed: Observed) -> None:
        """Take in one tick of the controller."""
        self._last = observed
        for i, (part, recent) in enumerate(zip(self._parts, self._recent, strict=True)):
            squares = observed.innovations[part] ** 2 / observed.innovation_variances[part]
            seen = ~np.isnan(squares)
            if seen.any():
                recent.append(float(squares[seen].mean()))
                self._largest[i] = np.fmax(self._largest[i], sum(recent) / len(recent))

    def take(self) -> FloatArray:
        """(W,) array: the largest value of each sensor since this was last asked; NaN where it has measured nothing."""
        taken, self._largest = self._largest, np.full(len(self._parts), np.nan)
        return taken

    def contributions(self, sensor: int) -> FloatArray:
        """Signed squared innovations of the outputs of all W sensors, one after another, zero but of this one."""
        if self._last is None:
            return np.zeros(sum(part.stop - part.start for part in self._parts))
        squares = signed_squares(self._last)
        shares = [squares[part] * (i == sensor) for i, part in enumerate(self._parts)]
        return np.concatenate(shares)
