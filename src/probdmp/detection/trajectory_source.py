"""The trajectory of one execution as a source of channel values."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray
from probdmp.detection.comparison import Comparison
from probdmp.detection.diagnosis import LOOKED_AT, Diagnosis, diagnose
from probdmp.detection.execution_ticks import ExecutionTicks
from probdmp.detection.innovation_watch import InnovationWatch, watched_sensors
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.profile import ExecutionProfile
from probdmp.detection.sensor_watch import SensorWatch
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS, TrajectoryFollower, TrajectoryModel
from probdmp.detection.trajectory_statistics import Displacement, Position
from probdmp.dmp import Primitive, Task
from probdmp.execution import Observed, SensorArray

__all__ = ["Expectation", "TrajectorySource", "watched_names"]

LOOKED_BACK = int(LOOKED_AT.max()) + 1
REMEMBERED = 2 * TICKS
"""Ticks from the start that are compared with other primitives."""
LATE = ("held", "paused", "slow")
"""Causes of a diagnosis by which a movement is late: then its channels are so too."""


@dataclass(frozen=True, slots=True, eq=False)
class Expectation:
    """What is expected of executions of a primitive."""

    primitive: Primitive
    profile: ExecutionProfile
    trajectory: TrajectoryModel
    """For executions that are told their goal, or for those that are not."""
    others: Comparison
    """The library that the primitive belongs to."""
    array: SensorArray
    """What observes executions."""

    @property
    def watched(self) -> tuple[str, ...]:
        """(W) names of what is judged: positions, learned channels, outputs of other sensors."""
        return watched_names(self.primitive, self.array)


def watched_names(primitive: Primitive, array: SensorArray) -> tuple[str, ...]:
    """(W) names of what is judged: positions, learned channels, outputs of other sensors."""
    others = [output for name in watched_sensors(array) for output in array.outputs[array.slices[name]]]
    return (*primitive.signals.names, *others)


class TrajectorySource:
    """The trajectory at each tick of the phase clock.

    Parameters
    ----------
    task, dt : of the execution.
    values : (T, C) array of what has been computed before of the trajectory, for recordings.
    """

    def __init__(self, expectation: Expectation, task: Task, dt: float, values: FloatArray | None = None) -> None:
        self._expectation, self._values = expectation, values
        self._watch = InnovationWatch(expectation.array, task, dt)
        self._ticks = ExecutionTicks(expectation.primitive, expectation.profile, task, dt)
        self._follower: TrajectoryFollower | None = None
        self._tick = -1
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
        return np.concatenate([values, self._watch.take()])

    def contributions(self, channel: int) -> FloatArray:
        """By where the execution is, or else by how it has moved lately; or by what the channel reads."""
        shares, n_signals = np.zeros(len(self._expectation.watched)), len(self._expectation.primitive.signals.names)
        trajectory, further = self._expectation.trajectory, channel - len(MOVEMENT_CHANNELS)
        if self._follower is None:
            return shares
        if further >= len(trajectory.feel):
            shares[n_signals:] = self._watch.contributions(further - len(trajectory.feel))
        elif further >= 0:
            statistic = trajectory.feel[further]
            window = self._follower.signals(self._tick, statistic.offsets)[0, 0]
            shares[:n_signals] = statistic.contributions(self._tick, window, self._follower.means)
        else:
            shares[: self._expectation.primitive.n_dof] = self._movement_contributions(self._follower, channel)
        return shares

    def _movement_contributions(self, follower: TrajectoryFollower, channel: int) -> FloatArray:
        trajectory = self._expectation.trajectory
        judge, offsets = trajectory.displacement.windows, Displacement.offsets
        if MOVEMENT_CHANNELS[channel] == "position":
            judge, offsets = trajectory.position.windows, Position.offsets
        unshifted = int(np.flatnonzero(judge.shifts == 0)[0])
        window = follower.window(self._tick, offsets)[0, 0]
        return judge.contributions(self._tick, unshifted, window, follower.means[:, : trajectory.model.means.shape[1]])

    def diagnose(self, channel: int, seen_since: int) -> Diagnosis:
        """From the last ticks; what a channel has noticed is about that channel, unless the movement is late."""
        if self._follower is None:
            return Diagnosis("motion", "off the path")
        primitive, model = self._expectation.primitive, self._expectation.trajectory.model
        d, further = primitive.n_dof, channel - len(MOVEMENT_CHANNELS)
        noise, means = self._expectation.profile.noise_stds[:d] / primitive.ranges, self._follower.means[:, :d]
        found = diagnose(model, means, self._recent, self._tick, noise, seen_since)
        if further < 0 or found.cause in LATE:
            return found
        if further >= len(primitive.channel_names):
            sensor = watched_sensors(self._expectation.array)[further - len(primitive.channel_names)]
            return Diagnosis("motion", f"unexpected readings of {sensor}")
        return Diagnosis("channel", f"unexpected {primitive.channel_names[further]}")

    def better(self) -> str:
        """Label of the primitive of the library that fits better, if there is one."""
        path = np.stack(self._history) * self._expectation.primitive.ranges
        times = np.arange(len(path)) * float(self._task.duration) / TICKS
        return self._expectation.others.better(self._expectation.primitive, times, path)

    @property
    def sensors(self) -> SensorWatch:
        """What watches the sensors."""
        return self._ticks.sensors
