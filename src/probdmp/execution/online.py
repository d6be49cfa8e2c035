"""Online execution with feedback: the paper's ExecuteAndMonitor (Meier & Schaal 2016, Algorithm 2).

One `step` takes what the sensors say now and returns the state to be reached at the next tick. Between them lie the Kalman
update and the prediction, so the innovation e reaches the command as A K e: the feedback term is not added, it follows.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_choice, check_number, check_seconds, freeze_arrays
from probdmp.dmp import Primitive, Task, step_count
from probdmp.dmp.phase import phases_at
from probdmp.dmp.transformation_system import ACCELERATION, POSITION, VELOCITY
from probdmp.execution.step_filters import STEP_FILTERS, StepFilter

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
    positions: FloatArray
    """(D,) array, data units: what was measured; NaN where nothing was."""
    contributions: FloatArray
    """(D,) array, nats: the share of each degree of freedom in the log-likelihood."""
    innovations: FloatArray
    """(D,) array, data units: measured minus predicted; NaN where not seen."""
    innovation_variances: FloatArray
    """(D,) array, data units squared: variance of the innovations, seen or not."""


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
    """Makes a monitor for a primitive."""

    def monitor(self, primitive: Primitive, task: Task, dt: float) -> Monitor: ...


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
    """(D,) array, nats: the share of each degree of freedom in the log-likelihood."""
    innovations: FloatArray
    """(D,) array, data units: measured minus predicted; NaN where not seen."""
    test_ratio: float
    """Statistic over threshold of the detector, above 1 for an alarm; NaN without a detector."""
    verdict: Judgement | None
    """What the detector says so far; None without a detector."""

    def __post_init__(self) -> None:
        freeze_arrays(self)  # they are views of the filter's own


class OnlineExecution:
    """A primitive in execution: call `step` once per tick.

    After an alarm, `on_alarm="continue"` goes on commanding the filtered movement. A blocked robot pulls the filter to where
    it is blocked, so what it is told to do next stays near the obstacle and the movement goes on from there.
    `on_alarm="hold"` commands the position that was due at the alarm, at rest, until `reset`.

    An observation that comes with a time is used at the tick nearest to it: ticks skipped are predicted, and one that is not
    newer than the last is dropped (`n_dropped` counts them). A clock that jumps by more than the movement lasts, or by which
    many in a row would be dropped, has been set: the observation is used at the next tick, and later times are understood
    relative to it.
    """

    def __init__(
        self, primitive: Primitive, task: Task, dt: float, detector: Detector | None = None, on_alarm: str = "continue"
    ) -> None:
        self.primitive, self.task, self.dt = primitive, task, check_seconds(dt, "dt")
        self._detector = detector
        self._on_alarm = check_choice(on_alarm, "on_alarm", ALARM_REACTIONS)
        self._chunk = step_count(float(task.duration), self.dt) + 1
        self.reset()

    def reset(self) -> None:
        """Back to the start, alarm cleared."""
        kind = STEP_FILTERS[self.primitive.configuration.weight_uncertainty]
        self._filter: StepFilter = kind(self.primitive, self.task, self.dt, self._chunk)
        self._monitor = self._detector.monitor(self.primitive, self.task, self.dt) if self._detector is not None else None
        self._step, self._clock_offset, self.n_dropped, self._n_late = 0, 0.0, 0, 0
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

    def step(self, observation: ArrayLike | None = None, time: float | None = None) -> ExecutionStep:
        """Take in what is measured now, get what is wanted next.

        The first call updates the initial state, without a prediction before it.

        Parameters
        ----------
        observation : (D,) array, data units; NaN for a degree of freedom that was not measured, None for none of them.
        time : seconds since the start at which it was measured; the next tick unless given.
        """
        shape = (self.primitive.n_dof,)
        if observation is None:
            measured = np.full(shape, np.nan)
        else:
            measured = check_array(observation, "observation", shape, missing=True)
        if time is not None:
            due = self._tick_of(check_number(time, "time as a number of seconds"))
            if due < self._step and self._last is not None:
                self.n_dropped += 1
                self._n_late += 1
                return self._last
            while self._step < due:
                self._advance(np.full(shape, np.nan))
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
        observed = Observed(t, time, phase, measured, seen.contributions, seen.innovations, seen.innovation_variances)
        test_ratio = self._monitor.update(observed) if self._monitor is not None else np.nan
        mean, covariance = self._filter.predict()
        self._step += 1
        desired = self._desired(mean)
        return ExecutionStep(
            time=self._step * self.dt,
            position=desired[:, POSITION],
            velocity=desired[:, VELOCITY],
            acceleration=desired[:, ACCELERATION],
            covariance=covariance,
            phase=phase,
            log_likelihood=float(seen.contributions.sum()),
            contributions=seen.contributions,
            innovations=seen.innovations,
            test_ratio=test_ratio,
            verdict=self.verdict,
        )

    def _desired(self, mean: FloatArray) -> FloatArray:
        """(D, 3) array: the predicted state, or rest at the position due at the alarm."""
        if self._on_alarm == "continue" or not self.failed:
            return mean
        if self._held is None:
            self._held = mean * np.eye(3)[POSITION]
        return self._held
