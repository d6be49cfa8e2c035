"""Executions with parameters that stay, tick by tick.

As long as everything is measured the gains of a schedule do; from the first reading that is missed on, what is known of the
parameters is conditioned on each observation.
"""

from copy import copy
from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp import Primitive, Task, stack_tasks
from probdmp.dmp.joint_model import joint_executions, state_rows
from probdmp.dmp.responses import continue_responses
from probdmp.execution.gain_schedule import SNAPSHOT_EVERY, GainSchedule, Snapshot, gain_schedule, single_execution
from probdmp.execution.joint_filtering import start_deviation, state_moments, update_joint
from probdmp.execution.plans import planned_states
from probdmp.execution.sensed_ticks import SensedTick, Tick
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import Belief, StaticUpdate, predict_deviation

__all__ = ["LATER_CHUNK", "JointFilter", "ScheduledFilter", "joint_filter"]

LATER_CHUNK = 64
"""Ticks that are prepared at a time once the movement is over."""
LONGEST_CHUNK = 4096
"""Ticks that are prepared before the movement begins, at most."""
LARGEST_SCHEDULE = 2**25
"""Numbers that the gains of an execution may be; with more of them it is filtered step by step."""


def joint_filter(
    primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray
) -> "JointFilter | ScheduledFilter":
    """The faster of the two that can do it.

    Parameters
    ----------
    chunk : for how many ticks it is prepared; the movement need not end then.
    """
    exact = JointFilter(primitive, task, dt, chunk, array)
    n_signals, n, r = exact.model.factors.shape
    n_numbers = chunk * (len(array.outputs) * (n_signals * (n + 3) + r) + r * r // SNAPSHOT_EVERY)
    if array.is_adaptive or n_numbers > LARGEST_SCHEDULE:
        return exact
    return ScheduledFilter(primitive, task, dt, chunk, array, exact)


class JointFilter:
    """Conditioning of parameters that stay and of what deviates from them; arguments as for `joint_filter`."""

    takes_any_values = False

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> None:
        self._configuration, self._array = primitive.configuration, array
        self._duration, self._phase_step = task.duration, float(dt / task.duration)
        executions = joint_executions(primitive, stack_tasks([task]), np.array([dt]), min(chunk, LONGEST_CHUNK) + 1)
        self.model, self._rows = single_execution(executions)
        self._transition, self._noise = (part[0] for part in executions.system.grouped(array.is_coupled))
        self._deviation = start_deviation(self.model, array.is_coupled)
        self._first, self._tick = 0, 0

    def step(self, observation: FloatArray) -> Tick:
        """Condition on what was measured; the parameters stay, what deviates from them goes on."""
        array, seen = self._array, self.observe(observation)
        mean, covariance = state_moments(self.model, self._deviation, self._row())
        innovations, fused = array.flat(seen.innovation), array.flat(seen.fused)
        said = (array.flat(seen.log_likelihoods), innovations, array.flat_covariances(seen.innovation_covariance), fused)
        return Tick(int(fused.sum()), mean, covariance, *said)

    def observe(self, observation: FloatArray) -> StaticUpdate:
        """The same without a look at the state of the next tick."""
        seen, deviation, *_ = update_joint(self.model, self._deviation, self._row(), observation, self._array)
        self.model = self.model._replace(belief=seen.belief)
        self._deviation = predict_deviation(deviation, self._transition, self._noise)
        self._tick += 1
        if self._tick - self._first == len(self._rows):
            # Responses are in phase units, rows in seconds; both go on from the last.
            scale = self._duration ** np.array([2.0, 1.0, 0.0])
            last = self._rows[-1, :, 1:] * scale[:, None]
            later = continue_responses(self._configuration, self._phase_step, LATER_CHUNK, self._tick - 1, last)
            self._rows, self._first = state_rows(later, self._duration), self._tick
        return seen

    def resumed(self, tick: int, snapshot: Snapshot) -> "JointFilter":
        """Another at that tick, as uncertain as the snapshot; where it is then is for `with_means` to say."""
        other = copy(self)
        other.model = self.model._replace(belief=Belief(self.model.belief.mean, snapshot.covariance))
        other._deviation, other._tick = snapshot.deviation, tick
        return other

    def with_means(self, latent: FloatArray, deviations: FloatArray) -> "JointFilter":
        """Another with these means of z, (r,), and of what deviates, (S, 3)."""
        other = copy(self)
        loading = self._deviation.loading
        offset = deviations.reshape(loading.shape[:-1]) - loading @ latent
        other.model = self.model._replace(belief=self.model.belief._replace(mean=latent))
        other._deviation = self._deviation._replace(offset=offset)
        return other

    def _row(self) -> FloatArray:
        return self._rows[self._tick - self._first]


class ScheduledTick(NamedTuple):
    """A tick with gains of a schedule; see `probdmp.execution.sensed_ticks.SensedTick`."""

    n_fused: int
    mean: FloatArray
    innovations: FloatArray
    schedule: GainSchedule
    tick: int

    @property
    def covariance(self) -> FloatArray:
        """(S, 3, 3) array."""
        assert self.schedule.predicted is not None, "it was asked for"
        return np.asarray(self.schedule.predicted[self.tick])

    @property
    def log_likelihood(self) -> float:
        """Nats."""
        return float(self.contributions.sum())

    @property
    def contributions(self) -> FloatArray:
        """(O,) array."""
        residual = np.where(self.fused, self.innovations, 0.0)
        distances = residual * (self.schedule.precisions[self.tick] @ residual)
        return np.asarray(self.schedule.share_constants[self.tick] - 0.5 * distances)

    @property
    def innovation_covariance(self) -> FloatArray:
        """(O, O) array."""
        return np.asarray(self.schedule.innovation_covariances[self.tick])

    @property
    def innovation_variances(self) -> FloatArray:
        """(O,) array."""
        return np.diagonal(self.innovation_covariance)

    @property
    def fused(self) -> BoolArray:
        """(O,) array."""
        return np.asarray(self.schedule.fused[self.tick])


class ScheduledFilter:
    """The same as long as everything is measured, with gains computed before; arguments as for `joint_filter`."""

    takes_any_values = False

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray, exact: JointFilter) -> None:
        self._exact, self._is_exact, self._silent = exact, False, array.silent
        tasks, seen = stack_tasks([task]), np.ones((chunk, len(array.outputs)), dtype=np.bool_)
        self._schedule = schedule = gain_schedule(primitive, tasks, dt, array, seen, with_states=True)
        plan = planned_states(joint_executions(primitive, tasks, np.array([dt]), chunk + 1))[:, 0]
        self._plan, self._expected = plan, plan.reshape(len(plan), -1) @ schedule.sensors.T
        self._n_parameters = plan.shape[1] * schedule.rows.shape[-1]
        self._moved = np.zeros(schedule.gains.shape[1])
        self._state: FloatArray = np.zeros(plan.shape[1:])
        self._tick, self._n_fused = 0, int(np.sum(~array.silent))

    def step(self, observation: FloatArray) -> SensedTick:
        """Take in an observation; from the first that misses something on, step by step."""
        if not self._is_exact and (self._tick == len(self._schedule.gains) or np.isnan(observation).any()):
            self._exact, self._is_exact = self._step_by_step(), True
        if self._is_exact:
            self._exact = copy(self._exact)
            return self._exact.step(observation)
        t, schedule = self._tick, self._schedule
        innovations = observation - self._expected[t] - schedule.sensors @ self._state.ravel()
        if self._silent.any():
            innovations[self._silent] = np.nan
        self._moved = self._moved + schedule.gains[t] @ np.where(schedule.fused[t], innovations, 0.0)
        parameters, deviations, _ = self._parts()
        deviations[:] = deviations @ schedule.transition.T
        self._state, self._tick = parameters @ schedule.rows[t + 1].T + deviations, t + 1
        return ScheduledTick(self._n_fused, self._plan[t + 1] + self._state, innovations, schedule, t)

    def _parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """x' (S, N + 3), d' (S, 3) and z' (r,)."""
        n_signals, n = self._state.shape[0], self._n_parameters
        parameters, rest = self._moved[:n].reshape(n_signals, -1), self._moved[n:]
        return parameters, rest[: 3 * n_signals].reshape(n_signals, 3), rest[3 * n_signals :]

    def _step_by_step(self) -> JointFilter:
        """From the last snapshot to where the execution is now."""
        schedule, now = self._schedule, self._tick
        nearest = len(schedule.snapshots) - 1 if now == len(schedule.gains) else now // SNAPSHOT_EVERY
        start = min(nearest * SNAPSHOT_EVERY, now) if now < len(schedule.gains) else now
        exact = self._exact.resumed(start, schedule.snapshots[nearest])
        for fused in schedule.fused[start:now]:
            exact.observe(np.where(fused, 0.0, np.nan))
        _, deviations, latent = self._parts()
        return exact.with_means(self._exact.model.belief.mean + latent, deviations)
