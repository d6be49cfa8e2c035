"""The calibrated detector at work on one execution; recordings go through the same code."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration
from probdmp.detection.calibration import Calibration
from probdmp.detection.diagnosis import diagnose
from probdmp.detection.phase_clock import PhaseClock, Tick
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.detection.trajectory_model import TrajectoryFollower, TrajectoryModel
from probdmp.detection.trajectory_statistics import CHANNELS
from probdmp.detection.verdict import Verdict
from probdmp.dmp import Primitive, Task
from probdmp.execution import Observed

__all__ = ["ExecutionTicks", "Expectation", "TrajectoryMonitor"]


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """What is expected of an execution of a primitive."""

    primitive: Primitive
    profile: ExecutionProfile
    trajectory: TrajectoryModel
    """For executions that are told their goal, or for those that are not."""


class ExecutionTicks:
    """From the measurements of one execution to its displacements at each tick of the phase clock."""

    def __init__(self, expectation: Expectation, task: Task, dt: float) -> None:
        primitive, duration = expectation.primitive, float(task.duration)
        self.sensors = SensorWatch(expectation.profile, primitive.ranges, duration, dt)
        self._clock = PhaseClock(primitive.n_dof, duration, dt)
        self._ranges, self._start = primitive.ranges, np.full(primitive.n_dof, np.nan)
        self._goal = task.goal

    def advance(self, time: float, measured: FloatArray) -> list[Tick]:
        """Take in a sample (D,), data units; returns the ticks that are complete."""
        believed = self.sensors.believe(measured)
        # Displacements count from where the execution was first seen, not from where it was told to be.
        self._start = np.where(np.isnan(self._start), believed, self._start)
        return self._clock.advance(time, (believed - self._start) / self._ranges)

    @property
    def goal(self) -> FloatArray:
        """(D,) array: displacement of the goal as a fraction of the range; NaN where it is not told or the start not seen."""
        return np.asarray((self._goal - self._start) / self._ranges)

    @classmethod
    def of_recording(cls, expectation: Expectation, task: Task, recording: Demonstration) -> tuple[FloatArray, FloatArray]:
        """The ticks (T, D) of a whole recording, and its goal (D,)."""
        ticks = cls(expectation, task, recording.dt)
        path = [tick.values for t, row in enumerate(recording.positions) for tick in ticks.advance(t * recording.dt, row)]
        return np.stack(path), ticks.goal


class Follower(Protocol):
    """Gives the values of all channels, tick by tick."""

    def update(self, displacement: FloatArray) -> FloatArray: ...
