"""Online execution with feedback: the paper's ExecuteAndMonitor (Meier & Schaal 2016, Algorithm 2).

One `step` takes what the sensors say now and returns the state to be reached at the next tick. Between them lie the Kalman
update and the prediction, so the innovation e reaches the command as A K e: the feedback term is not added, it follows.
"""

import math
from collections.abc import Mapping, Sequence
from copy import copy
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_choice, check_number, check_seconds
from probdmp.dmp import Primitive, Task, step_count
from probdmp.dmp.phase import phase_at
from probdmp.dmp.transformation_system import POSITION
from probdmp.execution.execution_step import ExecutionStep, Judgement, Plan
from probdmp.execution.readings import observation_of
from probdmp.execution.sensed_ticks import SensedTick
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensor_reports import SensorCounts
from probdmp.execution.step_filters import PlainFilter, step_filter

__all__ = ["Monitor", "Observed", "OnlineExecution"]

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
        if self._modulating is not None and self._modulating.all():
            self._modulating = None
        self._detector = detector
        self._on_alarm = check_choice(on_alarm, "on_alarm", ALARM_REACTIONS)
        self._n_outputs = len(self.array.outputs)
        self._plan = Plan(primitive, self.array, float(task.duration), self.dt)
        self._chunk = step_count(self._plan.duration, self.dt) + 1
        self._fresh = step_filter(primitive, task, self.dt, self._chunk, self.array)
        self.reset()

    def reset(self) -> None:
        """Back to the start, alarm cleared."""
        self._filter = copy(self._fresh)
        self._commanding = self._filter if self._modulating is None else copy(self._fresh)
        self._monitor: Monitor | None = None
        if self._detector is not None:
            self._monitor = self._detector.monitor(self.primitive, self.task, self.dt, self.array.outputs)
        self._plain = self._filter if isinstance(self._filter, PlainFilter) else None
        self._is_alone = self._monitor is None and self._modulating is None
        self._step, self._clock_offset, self.n_dropped, self._n_late = 0, 0.0, 0, 0
        self._counts, self._n_counted = {name: SensorCounts() for name in self.array.names}, 0
        self._held: FloatArray | None = None
        self._last: ExecutionStep | None = None

    @property
    def sensor_counts(self) -> dict[str, SensorCounts]:
        """By name of each sensor: how many of its readings were used, rejected or missing so far."""
        n_complete = self._step - self._n_counted
        if n_complete:  # of ticks at which nothing was missing no count is kept
            for counts in self._counts.values():
                counts.add_fused(n_complete)
            self._n_counted = self._step
        return self._counts

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
        if time is None and self._plain is not None:  # which looks at it by itself
            seen = self._plain.take(observation)
            if seen is not None:
                return self._reached(seen, seen) if self._is_alone else self._judged(np.array(observation), seen)
        measured = observation_of(self.array, observation)
        if time is not None:
            due = self._tick_of(check_number(time, "time as a number of seconds"))
            if due < self._step and self._last is not None:
                self.n_dropped += 1
                self._n_late += 1
                return self._last
            while self._step < due:
                self._advance(np.full(len(measured), np.nan))
        return self._advance(measured)

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
        return self._judged(measured, self._filter.step(measured))

    def _judged(self, measured: FloatArray, seen: SensedTick) -> ExecutionStep:
        """What becomes of a tick that was filtered; what is measured is the monitor's to keep."""
        commanded, test_ratio, verdict, held = seen, math.nan, None, None
        if self._monitor is not None:
            test_ratio = self._monitor.update(self._observed(measured, seen))
            verdict = self._monitor.verdict
        if self._modulating is not None:
            commanded = self._commanding.step(np.where(self._modulating, measured, np.nan))
        if self._on_alarm == "hold" and verdict is not None and verdict.failed:
            held = self._hold(commanded)
        return self._reached(seen, commanded, test_ratio, verdict, held)

    def _reached(
        self,
        seen: SensedTick,
        commanded: SensedTick,
        test_ratio: float = math.nan,
        verdict: Judgement | None = None,
        held: FloatArray | None = None,
    ) -> ExecutionStep:
        """What comes out of a tick, which is over then."""
        if seen.n_fused != self._n_outputs:
            self._count(seen)
        reached = tuple.__new__(ExecutionStep, (self._step, test_ratio, verdict, seen, commanded, held, self._plan))
        self._last, self._n_late = reached, 0
        self._step += 1
        return reached

    def _observed(self, measured: FloatArray, seen: SensedTick) -> Observed:
        time, signals = self._step * self.dt, self.array.signals(measured)
        phase = phase_at(time, self._plan.duration)
        return Observed(self._step, time, phase, signals, seen.contributions, seen.innovations, seen.innovation_variances)

    def _count(self, seen: SensedTick) -> None:
        innovations, fused, counts = seen.innovations, seen.fused, self.sensor_counts
        for name, part in self.array.slices.items():
            counts[name].add(innovations[part], fused[part])
        self._n_counted += 1

    def _hold(self, commanded: SensedTick) -> FloatArray:
        """(D, 3) array: rest at the position due at the alarm."""
        if self._held is None:
            self._held = commanded.mean[: self.primitive.n_dof] * np.eye(3)[POSITION]
        return self._held
