"""The trajectory of one execution as a source of channel values."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.comparison import Comparison
from probdmp.detection.diagnosis import LOOKED_AT, Diagnosis, diagnose
from probdmp.detection.execution_ticks import ExecutionTicks
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.detection.trajectory_model import CHANNELS, TrajectoryFollower, TrajectoryModel
from probdmp.detection.trajectory_statistics import Displacement, Position
from probdmp.dmp import Primitive, Task
from probdmp.execution import Observed

__all__ = ["Expectation", "TrajectorySource"]

LOOKED_BACK = int(LOOKED_AT.max()) + 1
REMEMBERED = 2 * TICKS
"""Ticks from the start that are compared with other primitives."""


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """What is expected of executions of a primitive."""

    primitive: Primitive
    profile: ExecutionProfile
    trajectory: TrajectoryModel
    """For executions that are told their goal, or for those that are not."""
    others: Comparison
    """The library that the primitive belongs to."""


class TrajectorySource:
    """The trajectory at each tick of the phase clock.

    Parameters
    ----------
    task, dt : of the execution.
    values : (T, C) array of what has been computed before, for recordings.
    """

    def __init__(self, expectation: Expectation, task: Task, dt: float, values: FloatArray | None = None) -> None:
        self._expectation, self._values = expectation, values
        self._ticks = ExecutionTicks(expectation.primitive, expectation.profile, task, dt)
        self._follower: TrajectoryFollower | None = None
        self._tick = -1
        self._task = task
        self._history: list[FloatArray] = []
        self._recent: deque[FloatArray] = deque(maxlen=LOOKED_BACK)

    def update(self, observed: Observed) -> list[FloatArray]:
        """Values at the ticks of the phase clock that are complete now."""
        return [self._advance(tick.values) for tick in self._ticks.advance(observed.time, observed.positions)]

    def _advance(self, displacement: FloatArray) -> FloatArray:
        if self._follower is None:
            self._follower = self._expectation.trajectory.follow(self._ticks.goal)
        self._tick += 1
        self._recent.append(displacement)
        if len(self._history) <= REMEMBERED:
            self._history.append(displacement)
        if self._values is None:
            return self._follower.update(displacement)
        self._follower.remember(displacement)
        return np.asarray(self._values[self._tick])

    def contributions(self, channel: int) -> FloatArray:
        """By where the execution is, or else by how it has moved lately."""
        if self._follower is None:
            return np.zeros(self._expectation.primitive.n_dof)
        trajectory = self._expectation.trajectory
        judge, offsets = trajectory.displacement.windows, Displacement.offsets
        if CHANNELS[channel] == "position":
            judge, offsets = trajectory.position.windows, Position.offsets
        unshifted = int(np.flatnonzero(judge.shifts == 0)[0])
        window = self._follower.window(self._tick, offsets)[0, 0]
        return judge.contributions(self._tick, unshifted, window, self._follower.means)

    def diagnose(self, seen_since: int) -> Diagnosis:
        """From the last ticks."""
        if self._follower is None:
            return Diagnosis("motion", "off the path")
        noise = self._expectation.profile.noise_stds / self._expectation.primitive.ranges
        model = self._expectation.trajectory.model
        return diagnose(model, self._follower.means, self._recent, self._tick, noise, seen_since)

    def better(self) -> str:
        """Label of the primitive of the library that fits better, if there is one."""
        path = np.stack(self._history) * self._expectation.primitive.ranges
        times = np.arange(len(path)) * float(self._task.duration) / TICKS
        return self._expectation.others.better(self._expectation.primitive, times, path)

    @property
    def sensors(self) -> SensorWatch:
        """What watches the sensors."""
        return self._ticks.sensors
