"""The trajectory of one execution as a source of channel values."""

from collections import deque

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.diagnosis import Diagnosis
from probdmp.detection.execution_ticks import ExecutionTicks
from probdmp.detection.expectation import Expectation
from probdmp.detection.innovation_watch import InnovationWatch
from probdmp.detection.reasons import LOOKED_BACK, REMEMBERED, better_fits, reasons_for, signal_shares
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS, TrajectoryFollower
from probdmp.dmp import Task
from probdmp.execution import Observed

__all__ = ["TrajectorySource"]


class TrajectorySource:
    """The trajectory at each tick of the phase clock.

    Parameters
    ----------
    task, dt : of the execution.
    values : (T, C) array of what has been computed before of the trajectory, for recordings.
    """

    def __init__(self, expectation: Expectation, task: Task, dt: float, values: FloatArray | None = None) -> None:
        self._expectation, self._values = expectation, values
        if values is None:
            expectation.trajectory.prepare()
        self._watch = InnovationWatch(expectation.array, task, dt)
        self._ticks = ExecutionTicks(expectation.primitive, expectation.profile, task, dt)
        self._follower: TrajectoryFollower | None = None
        self._tick, self._latest = -1, np.zeros(0)
        self._task = task
        self._history: list[FloatArray] = []
        self._recent: deque[FloatArray] = deque(maxlen=LOOKED_BACK)

    def update(self, observed: Observed) -> list[FloatArray]:
        """Values at the ticks of the phase clock that are complete now."""
        self._watch.update(observed)
        return [self._advance(tick.values) for tick in self._ticks.advance(observed.time, observed.signals)]

    def _advance(self, signals: FloatArray) -> FloatArray:
        if self._follower is None:
            self._follower = self._expectation.trajectory.follow(self._ticks.goal)
        self._tick += 1
        displacement = signals[: self._expectation.primitive.n_dof]
        self._recent.append(displacement)
        if len(self._history) <= REMEMBERED:
            self._history.append(displacement)
        if self._values is None:
            values = self._follower.update(signals)
        else:
            self._follower.remember(signals)
            values = np.asarray(self._values[self._tick])
        self._latest = values
        return np.concatenate([values, self._watch.take()])

    def contributions(self, channel: int) -> FloatArray:
        """By the signals that the channel is about."""
        shares, n_signals = np.zeros(len(self._expectation.watched)), len(self._expectation.primitive.signals.names)
        trajectory, follower = self._expectation.trajectory, self._follower
        further = channel - len(MOVEMENT_CHANNELS) - len(trajectory.feel)
        if follower is None:
            return shares
        if further >= 0:
            shares[n_signals:] = self._watch.contributions(further)
        else:
            moment = np.array([channel]), np.array([self._tick]), self._latest[channel : channel + 1]
            shares[:n_signals] = signal_shares(
                trajectory, *moment, self._ticks.goal[None], lambda _, offsets: follower.signals(self._tick, offsets)[0]
            )[0]
        return shares

    def diagnose(self, channel: int, seen_since: int) -> Diagnosis:
        """From the last ticks."""
        if self._follower is None:
            return Diagnosis("motion", "off the path")
        means = self._follower.means[:, : self._expectation.primitive.n_dof]
        moment = np.array([self._tick]), np.array([channel]), np.array([seen_since])
        return reasons_for(self._expectation, means[None], np.stack(self._recent)[None], *moment)[0]

    def better(self) -> str:
        """Label of the primitive of the library that fits better, if there is one."""
        return better_fits(self._expectation, [np.stack(self._history)], np.array([self._task.duration]))[0]

    @property
    def sensors(self) -> SensorWatch:
        """What watches the sensors."""
        return self._ticks.sensors
