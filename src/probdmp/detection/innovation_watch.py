"""Sensors that measure neither a position nor a learned channel as it is: judged by the innovations of the filter.

    value of a sensor     mean of its squared innovations, in standard deviations, over the last 5 % of the movement

A velocity, or the place of the tool in a camera, follows from all states: what it should be is for the filter to say.
"""

from collections import deque

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.sources import NIS_WINDOW
from probdmp.dmp import Task
from probdmp.execution import Observed, SensorArray

__all__ = ["InnovationWatch", "watched_sensors"]


def watched_sensors(array: SensorArray) -> tuple[str, ...]:
    """Names of the sensors that are judged by their innovations."""
    return tuple(name for name in array.names if not array.is_direct(name))


class InnovationWatch:
    """The W sensors of one execution that are judged so."""

    def __init__(self, array: SensorArray, task: Task, dt: float) -> None:
        self._length = max(1, round(NIS_WINDOW * float(task.duration) / dt))
        self._parts = [array.slices[name] for name in watched_sensors(array)]
        self._recent: list[deque[float]] = [deque(maxlen=self._length) for _ in self._parts]
        self._signed: list[deque[FloatArray]] = [deque(maxlen=self._length) for _ in self._parts]
        self._latest, self._largest = np.full((2, len(self._parts)), np.nan)
        self._age = np.zeros(len(self._parts))

    def update(self, observed: Observed) -> None:
        """Take in one tick of the controller."""
        for i, (part, recent) in enumerate(zip(self._parts, self._recent, strict=True)):
            innovations = observed.innovations[part]
            squares = innovations**2 / observed.innovation_variances[part]
            seen = ~np.isnan(squares)
            self._age[i] += 1
            if seen.any():
                recent.append(float(squares[seen].mean()))
                self._signed[i].append(np.where(seen, np.sign(innovations) * squares, 0.0))
                self._latest[i], self._age[i] = sum(recent) / len(recent), 0
                self._largest[i] = np.fmax(self._largest[i], self._latest[i])

    def take(self) -> FloatArray:
        """(W,) array: the largest value of each sensor since this was last asked; NaN where it has measured nothing lately."""
        # Between readings the latest mean stands: a sensor that is slower than the ticks is no less surprising for that.
        standing = np.where(self._age < self._length, self._latest, np.nan)
        taken, self._largest = np.where(np.isnan(self._largest), standing, self._largest), np.full(len(self._parts), np.nan)
        return taken

    def contributions(self, sensor: int) -> FloatArray:
        """The same mean, signed and by output, of all W sensors one after another, zero but of this one."""
        shares = [np.zeros(part.stop - part.start) for part in self._parts]
        if self._signed[sensor]:
            shares[sensor] = np.mean(self._signed[sensor], axis=0)
        return np.concatenate(shares)
