"""Online execution with feedback: the paper's ExecuteAndMonitor (Meier & Schaal 2016, Algorithm 2).

One `step` takes what the sensors say now and returns the state to be reached at the next tick. Between them lie the Kalman
update and the prediction, so the innovation e reaches the command as A K e: the feedback term is not added, it follows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import BoolArray, FloatArray, check_choice, check_number, check_seconds, freeze_arrays
from probdmp.dmp import Primitive, Task, step_count
from probdmp.dmp.phase import phases_at
from probdmp.dmp.transformation_system import ACCELERATION, POSITION, VELOCITY
from probdmp.execution.readings import observation_of
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensor_reports import SensorCounts, SensorTrack, sensor_tracks
from probdmp.execution.step_filters import STEP_FILTERS, StepFilter
from probdmp.execution.trajectory import GaussianChannel, channels_of

__all__ = ["ExecutionStep", "Judgement", "Monitor", "Observed", "OnlineExecution"]

ALARM_REACTIONS = ("continue", "hold")
MOST_LATE = 10
"""Observations in a row that may come late before their clock is taken to have been set back."""


class Observed(NamedTuple):
    """What one tick has shown; the input of a monitor."""

    step: int
    """Ticks since the start."""
    time: float
    """Seconds since the start."""
    phase: float
    """x, from 1 down."""
    signals: FloatArray
    """(S,) array, units of each: what was measured of the positions and of the learned channels; NaN where nothing was."""
    contributions: FloatArray
    """(O,) array, nats: the share of each output of the sensors in the log-likelihood."""
    innovations: FloatArray
    """(O,) array, units of the outputs: measured minus predicted; NaN where not seen."""
    innovation_variances: FloatArray
    """(O,) array, units of the outputs squared: variance of the innovations, seen or not."""


class Judgement(Protocol):
    """What every verdict says."""

    @property
    def failed(self) -> bool: ...
    @property
    def time(self) -> float: ...
    @property
    def phase(self) -> float: ...
    @property
    def test_ratio(self) -> float: ...
    @property
    def contributions(self) -> FloatArray: ...


class Monitor(Protocol):
    """Judges an execution while it runs; `probdmp.detection` makes them."""

    def update(self, observed: Observed) -> float:
        """Take one tick into account; returns the test ratio, above 1 for an alarm."""
        ...

    @property
    def verdict(self) -> Judgement: ...


class Detector(Protocol):
    """Makes a monitor for a primitive and the outputs of the sensors that observe it."""

    def monitor(self, primitive: Primitive, task: Task, dt: float, outputs: tuple[str, ...]) -> Monitor: ...


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionStep:
    """What the controller is to reach at the next tick, and what this tick has shown."""

    time: float
    """Seconds since the start at which the desired state is due."""
    position: FloatArray
    """(D,) array, data units."""
    velocity: FloatArray
    """(D,) array, data units per second."""
    acceleration: FloatArray
    """(D,) array, data units per second squared."""
    covariance: FloatArray
    """(D, 3, 3) array over acceleration, velocity, position."""
    phase: float
    """x of the observation."""
    log_likelihood: float
    """Nats: density of the observation given the past; 0 without one."""
    contributions: FloatArray
    """(O,) array, nats: the share of each output of the sensors in the log-likelihood."""
    innovations: FloatArray
    """(O,) array, units of the outputs: measured minus predicted; NaN where not seen."""
    test_ratio: float
    """Statistic over threshold of the detector, above 1 for an alarm; NaN without a detector."""
    verdict: Judgement | None
    """What the detector says so far; None without a detector."""
    channels: Mapping[str, GaussianChannel]
    """What the learned channels should read at the next tick, by name, of one time each."""
    innovation_covariance: FloatArray
    """(O, O) array, units of the outputs multiplied: covariance of the innovations, seen or not."""
    fused: BoolArray
    """(O,) array: what was seen and believed."""
    array: SensorArray
    """The sensors."""

    def __post_init__(self) -> None:
        freeze_arrays(self)  # they are views of the filter's own

    @property
    def sensors(self) -> dict[str, SensorTrack]:
        """By name of each sensor: its innovation at this tick, how surprising it was, whether it was rejected."""
        return sensor_tracks(self.array, self.innovations[None], self.innovation_covariance[None], self.fused[None])


class OnlineExecution:
    """A primitive in execution: call `step` once per tick.

    After an alarm, `on_alarm="continue"` goes on commanding the filtered movement. A blocked robot pulls the filter to where
    it is blocked, so what it is told to do next stays near the obstacle and the movement goes on from there.
    `on_alarm="hold"` commands the position that was due at the alarm, at rest, until `reset`.

    All sensors are watched: log-likelihood, innovations and detector go by what all of them say. Those named in `feedback`
    also modulate the command; where they are not all, the command comes from a filter of its own that knows nothing of the
    others. With none, it is the movement as planned.

    An observation that comes with a time is used at the tick nearest to it: ticks skipped are predicted, and one that is not
    newer than the last is dropped (`n_dropped` counts them). A clock that jumps by more than the movement lasts, or by which
    many in a row would be dropped, has been set: the observation is used at the next tick, and later times are understood
    relative to it.

    Parameters
    ----------
    sensors : what observes it; positions and learned channels unless given.
    feedback : names of the sensors that modulate the command; all unless given.
    """

    def __init__(
        self,
        primitive: Primitive,
        task: Task,
        dt: float,
        detector: Detector | None = None,
        on_alarm: str = "continue",
        sensors: SensorArray | None = None,
        feedback: Sequence[str] | None = None,
    ) -> None:
        self.primitive, self.task, self.dt = primitive, task, check_seconds(dt, "dt")
        self.array = SensorArray(primitive) if sensors is None else sensors
        self._modulating = None if feedback is None else self.array.chosen(feedback)
        self._detector = detector
        self._on_alarm = check_choice(on_alarm, "on_alarm", ALARM_REACTIONS)
        self._chunk = step_count(float(task.duration), self.dt) + 1
        self.reset()

    def reset(self) -> None:
        """Back to the start, alarm cleared."""
        make = STEP_FILTERS[self.primitive.configuration.weight_uncertainty]
        self._filter: StepFilter = make(self.primitive, self.task, self.dt, self._chunk, self.array)
        self._commanding = self._filter
        if self._modulating is not None and not self._modulating.all():
            self._commanding = make(self.primitive, self.task, self.dt, self._chunk, self.array)
        self._monitor: Monitor | None = None
        if self._detector is not None:
            self._monitor = self._detector.monitor(self.primitive, self.task, self.dt, self.array.outputs)
        self._step, self._clock_offset, self.n_dropped, self._n_late = 0, 0.0, 0, 0
        self.sensor_counts = {name: SensorCounts() for name in self.array.names}
        """By name of each sensor: how many of its readings were used, rejected or missing so far."""
        self._held: FloatArray | None = None
        self._last: ExecutionStep | None = None

    @property
    def failed(self) -> bool:
        """Whether the detector has called this execution failed; it stays so until `reset`."""
        return self._monitor is not None and self._monitor.verdict.failed

    @property
    def verdict(self) -> Judgement | None:
        """What the detector says so far; None without a detector."""
        return self._monitor.verdict if self._monitor is not None else None

    def step(
        self, observation: ArrayLike | Mapping[str, ArrayLike | None] | None = None, time: float | None = None
    ) -> ExecutionStep:
        """Take in what is measured now, get what is wanted next.

        The first call updates the initial state, without a prediction before it.

        Parameters
        ----------
        observation : readings by name of their sensors, `{"position": [0.1, 0.2], "pen_force": 3.1}`, of those that have
            measured; or an array: of the first sensor, hence of the (D,) positions unless other sensors were given, or of all
            outputs. NaN: not measured; None: nothing was.
        time : seconds since the start at which it was measured; the next tick unless given.
        """
        measured = observation_of(self.array, observation)
        if time is not None:
            due = self._tick_of(check_number(time, "time as a number of seconds"))
            if due < self._step and self._last is not None:
                self.n_dropped += 1
                self._n_late += 1
                return self._last
            while self._step < due:
                self._advance(np.full(len(measured), np.nan))
        self._n_late = 0
        self._last = self._advance(measured)
        return self._last

    def _tick_of(self, time: float) -> int:
        """The tick that an observation belongs to; ticks before `self._step` are over."""
        ahead = (time - self._clock_offset) / self.dt - self._step
        if not abs(ahead) <= self._chunk or self._n_late >= MOST_LATE:  # a jump, or not a number
            if np.isfinite(time):
                self._clock_offset = time - self._step * self.dt
            return self._step
        return self._step + round(ahead)

    def _advance(self, measured: FloatArray) -> ExecutionStep:
        """One tick: update with what is measured (Alg. 2, lines 5-8), predict the next state (lines 3-4)."""
        t = self._step
        seen = self._filter.update(measured)
        time = t * self.dt
        phase = float(phases_at(np.asarray(time), self.task.duration))
        variances = np.diagonal(seen.innovation_covariance)
        signals = self.array.signals(measured)
        observed = Observed(t, time, phase, signals, seen.contributions, seen.innovations, variances)
        test_ratio = self._monitor.update(observed) if self._monitor is not None else np.nan
        for name, part in self.array.slices.items():
            self.sensor_counts[name].add(seen.innovations[part], seen.fused[part])
        mean, covariance = self._filter.predict()
        if self._modulating is not None and self._commanding is not self._filter:
            self._commanding.update(np.where(self._modulating, measured, np.nan))
            mean, covariance = self._commanding.predict()
        self._step += 1
        d = self.primitive.n_dof
        desired = self._desired(mean[:d])
        return ExecutionStep(
            time=self._step * self.dt,
            position=desired[:, POSITION],
            velocity=desired[:, VELOCITY],
            acceleration=desired[:, ACCELERATION],
            covariance=covariance[:d],
            phase=phase,
            log_likelihood=float(seen.contributions.sum()),
            contributions=seen.contributions,
            innovations=seen.innovations,
            test_ratio=test_ratio,
            verdict=self.verdict,
            channels=channels_of(self.primitive, mean[None], covariance[None]),
            innovation_covariance=seen.innovation_covariance,
            fused=seen.fused,
            array=self.array,
        )

    def _desired(self, mean: FloatArray) -> FloatArray:
        """(D, 3) array: the predicted state, or rest at the position due at the alarm."""
        if self._on_alarm == "continue" or not self.failed:
            return mean
        if self._held is None:
            self._held = mean * np.eye(3)[POSITION]
        return self._held
