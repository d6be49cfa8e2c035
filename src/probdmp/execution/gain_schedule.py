"""Gains of executions whose parameters are constant and unknown: what does not depend on readings, computed once.

How much a reading says, and about what, follows from the model, the time and which readings there are; not from what they read.
So executions of one primitive that last equally long, are told the same kinds of things and miss the same readings share all
gains. Each is then filtered by a linear recursion for what deviates from its plan: of the parameters x', of the states around
them d', and of the latent z',

    e[t] = o[t] - C (plan[t] + s[t]),   s[t] = rows[t] x'[t] + d'[t]
    (x', d', z') <- (x', d', z') + K[t] e[t],    then d' <- A d'
"""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.joint_model import JointExecutions, JointModel, joint_executions
from probdmp.execution.joint_filtering import start_deviation, state_moments, update_joint
from probdmp.execution.kept import Kept
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import AugmentedUpdate, Belief, Deviation, predict_deviation
from probdmp.gaussian.density import log_density_shares

__all__ = ["GainSchedule", "Snapshot", "gain_schedule", "kind_of", "single_execution"]

SNAPSHOT_EVERY = 16
"""Ticks between those of which all is kept, so that an execution can go on without the schedule."""
MOST_KEPT_BYTES = 2**28
"""Of all schedules together that are kept for later executions."""
_KEPT: Kept["GainSchedule"] = Kept(MOST_KEPT_BYTES)
BLOCK = 1024
"""Executions that are filtered side by side."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What is known before the observation of a tick, but for what readings say."""

    covariance: FloatArray
    """Of z, (r, r) array."""
    deviation: Deviation
    """Its offset is of no use."""


@dataclass(frozen=True, slots=True, eq=False)
class GainSchedule:
    """Gains for T ticks; P parameters and 3 S states of all signals, O outputs."""

    rows: FloatArray
    """(T + 1, 3, N + 3) array: the states of a signal as functions of its parameters; there is one more than ticks."""
    transition: FloatArray
    """A of what deviates, (3, 3) array."""
    gains: FloatArray
    """K, (T, P + 3 S + r, O) array; 0 for what is not seen."""
    sensors: FloatArray
    """C, (O, 3 S) array."""
    fused: BoolArray
    """(T, O) array."""
    innovation_covariances: FloatArray
    """S, (T, O, O) array."""
    precisions: FloatArray
    """S^-1 of what is seen, (T, O, O) array; 1 in the diagonal for what is not."""
    share_constants: FloatArray
    """(T, O) array, nats: the part of each output's share in the log-likelihood that readings have no part in."""
    predicted: FloatArray | None
    """(T, S, 3, 3) array: covariances of the states one tick later; None where nobody asks for them."""
    snapshots: tuple[Snapshot, ...]
    """Before the ticks 0, SNAPSHOT_EVERY, …, and after the last."""

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        kept = sum(s.covariance.nbytes + s.deviation.loading.nbytes for s in self.snapshots)
        return kept + self.gains.nbytes + self.rows.nbytes + self.innovation_covariances.nbytes

    def innovations(self, readings: FloatArray) -> FloatArray:
        """Of readings (T, N, O) less those planned, (T, N, O); what the schedule takes for seen must be there."""
        (n_ticks, count, _), n_states = readings.shape, self.sensors.shape[1]
        n_signals, n_parameters = n_states // 3, n_states // 3 * self.rows.shape[-1]
        kept = n_parameters + n_states
        moved, innovations = np.zeros((count, kept)), np.empty(readings.shape)
        of_parameters = moved[:, :n_parameters].reshape(count, n_signals, -1)
        of_deviations = moved[:, n_parameters:].reshape(count, n_signals, 3)
        for t in range(n_ticks):
            now = of_parameters @ self.rows[t].T + of_deviations
            innovations[t] = readings[t] - now.reshape(count, -1) @ self.sensors.T
            moved += np.where(self.fused[t], innovations[t], 0.0) @ self.gains[t, :kept].T
            of_deviations[:] = of_deviations @ self.transition.T
        return innovations

    def log_likelihoods(self, readings: FloatArray) -> FloatArray:
        """Of complete readings (N, T, O) less those planned, (N,) array, nats."""
        squares = np.empty(len(readings))
        for first in range(0, len(readings), BLOCK):
            innovations = self.innovations(readings[first : first + BLOCK].swapaxes(0, 1))
            e = np.where(self.fused[:, None], innovations, 0.0)
            squares[first : first + BLOCK] = np.einsum("tno,top,tnp->n", e, self.precisions, e, optimize=True)
        return float(self.share_constants.sum()) - 0.5 * squares


def single_execution(executions: JointExecutions) -> tuple[JointModel, FloatArray]:
    """The model of the first of a batch, without the batch axis, and its rows (T, 3, N + 3)."""
    model, rows, _ = executions
    belief = Belief(model.belief.mean[0], model.belief.covariance[0])
    return JointModel(model.means[0], model.factors[0], belief), rows[:, 0]


def gain_schedule(
    primitive: Primitive, task: Task, dt: float, array: SensorArray, seen: BoolArray, with_states: bool = False
) -> GainSchedule:
    """The gains of executions like one; those computed last are kept.

    Parameters
    ----------
    task : a batch of one: only its duration and what is told of it count.
    array : sensors whose readings say the same whatever is believed: linear ones, without gates.
    seen : (T, O) array, what is measured when.
    with_states : whether to compute how certain the states are, which takes the longest.
    """
    key = (*kind_of(primitive, task, dt, array), seen.shape, seen.tobytes(), with_states)
    return _KEPT.get(key, lambda: _computed(primitive, task, dt, array, seen, with_states))


def kind_of(primitive: Primitive, task: Task, dt: float, array: SensorArray) -> tuple[Hashable, ...]:
    """What executions have in common that share their gains; arguments as above."""
    told = [np.isnan(part).tobytes() for part in (task.start, task.goal, task.start_velocity) if part is not None]
    sensors = (array.dense_matrix.tobytes(), array.covariance.tobytes(), array.silent.tobytes())
    return primitive.identity, float(task.duration[0]), dt, *told, *sensors


def _computed(
    primitive: Primitive, task: Task, dt: float, array: SensorArray, seen: BoolArray, with_states: bool
) -> GainSchedule:
    n_ticks, n_outputs = seen.shape
    executions = joint_executions(primitive, task, np.array([dt]), n_ticks + 1)
    model, rows = single_execution(executions)
    transition, noise = (part[0] for part in executions.system.grouped(array.is_coupled))
    deviation = start_deviation(model, array.is_coupled)
    factors, r = model.factors, model.factors.shape[-1]
    n_states = 3 * len(factors)
    gains = np.zeros((n_ticks, factors.shape[0] * factors.shape[1] + n_states + r, n_outputs))
    spreads = np.empty((n_ticks, n_outputs, n_outputs))
    fused = np.empty((n_ticks, n_outputs), dtype=np.bool_)
    predicted = np.empty((n_ticks, len(factors), 3, 3)) if with_states else None
    snapshots = []
    for t, readings in enumerate(np.where(seen, 0.0, np.nan)):
        if t % SNAPSHOT_EVERY == 0:
            snapshots.append(Snapshot(model.belief.covariance, deviation))
        update = update_joint(model, deviation, rows[t], readings, array)
        gains[t] = _gains(update, array, factors)
        fused[t] = array.flat(update.seen.fused)
        spreads[t] = array.flat_covariances(update.seen.innovation_covariance)
        model = model._replace(belief=update.seen.belief)
        deviation = predict_deviation(update.deviation, transition, noise)
        if predicted is not None:
            predicted[t] = state_moments(model, deviation, rows[t + 1])[1]
    snapshots.append(Snapshot(model.belief.covariance, deviation))
    both = fused[:, :, None] & fused[:, None, :]
    known, nothing = np.where(both, spreads, np.eye(n_outputs)), np.zeros((n_ticks, n_outputs))
    constants = log_density_shares(nothing, nothing, known, np.linalg.cholesky(known), fused)
    densities = (spreads, np.linalg.inv(known), constants)
    own = executions.system.transition[0, 0]
    return GainSchedule(rows, own, gains, array.dense_matrix, fused, *densities, predicted, tuple(snapshots))


def _gains(update: AugmentedUpdate, array: SensorArray, factors: FloatArray) -> FloatArray:
    """K of x', d' and z', (P + 3 S + r, O)."""
    n_groups, n, size = update.gains.shape
    of_z = update.seen.gain @ update.seen.whitening
    own = np.zeros((n_groups, n, n_groups, size))
    own[np.arange(n_groups), :, np.arange(n_groups)] = update.gains
    r = factors.shape[-1]
    of_deviations = own.reshape(n_groups * n, -1) + update.deviation.loading.reshape(-1, r) @ of_z
    return array.flat(np.concatenate([factors.reshape(-1, r) @ of_z, of_deviations, of_z]))
