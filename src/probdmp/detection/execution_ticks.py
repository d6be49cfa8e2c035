"""From the measurements of one execution to its displacements at each tick of the phase clock."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.phase_clock import PhaseClock, Tick
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.dmp import Primitive, Task

__all__ = ["ExecutionTicks"]


class ExecutionTicks:
    """Turns the samples of one execution into ticks; what a sensor cannot have measured is left out."""

    def __init__(self, primitive: Primitive, profile: ExecutionProfile, task: Task, dt: float) -> None:
        duration = float(task.duration)
        ranges, self._n_dof = primitive.signals.ranges, primitive.n_dof
        self.sensors = SensorWatch(profile, ranges, self._n_dof, duration, dt)
        self._clock = PhaseClock(profile.usual_gaps, duration, dt)
        self._ranges, self._start = ranges, np.where(np.arange(len(ranges)) < self._n_dof, np.nan, 0.0)
        self._task, self._has_started, self._has_begun = task, False, False
        self.goal = np.full(self._n_dof, np.nan)
        """(D,) array: displacement of the goal as a fraction of the range; NaN where it is not told, or the start was not seen
        by the first tick."""

    def advance(self, time: float, measured: FloatArray) -> list[Tick]:
        """Take in a sample (S,), units of each signal; returns the ticks that are complete."""
        believed = self.sensors.believe(measured)
        # Displacements count from where the execution was first seen, not from where it was told to be; channels from zero.
        if not self._has_started:
            self._start = np.where(np.isnan(self._start), believed, self._start)
            self._has_started = not np.isnan(self._start).any()
        ticks = self._clock.advance(time, (believed - self._start) / self._ranges)
        if ticks and not self._has_begun:
            d = self._n_dof
            self._has_begun, self.goal = True, (self._task.goal - self._start[:d]) / self._ranges[:d]
        return ticks
