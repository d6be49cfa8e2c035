"""Gains of executions whose parameters are constant and unknown: what does not depend on readings, computed once.

How much a reading says, and about what, follows from the model, the time and which readings there are; not from what they read.
So executions of one primitive that last equally long, are told the same kinds of things and miss the same readings share all
gains. Each is then filtered by a linear recursion for what deviates from its plan: of the parameters x' and of the states
around them d',

    e[t] = o[t] - C (plan[t] + s[t]),   s[t] = rows[t] x'[t] + d'[t]
    (x', d') <- (x', A d') + K[t] e[t]
"""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp import Primitive, Task
from probdmp.dmp.joint_model import joint_executions
from probdmp.execution.joint_steps import JointSystem
from probdmp.execution.plans import kind_of_task
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import AffineObservation, AugmentedTick, augmented_tick, block_diagonal, no_observations
from probdmp.gaussian.density import log_density_shares
from probdmp.kept import Kept

__all__ = ["GainSchedule", "gain_schedule", "kind_of"]

MOST_KEPT_BYTES = 2**28
"""Of all schedules together that are kept for later executions."""
_KEPT: Kept["GainSchedule"] = Kept(MOST_KEPT_BYTES)
BLOCK = 1024
"""Executions that are filtered side by side."""


@dataclass(frozen=True, slots=True, eq=False)
class GainSchedule:
    """Gains for T ticks; P parameters and 3 S states of all signals, O outputs."""

    rows: FloatArray
    """(T + 1, 3, N + 3) array: the states of a signal as functions of its parameters; there is one more than ticks."""
    transition: FloatArray
    """A of what deviates, (3, 3) array."""
    gains: FloatArray
    """K, (T, P + 3 S, O) array; 0 for what is not seen."""
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

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        return self.gains.nbytes + self.rows.nbytes + self.innovation_covariances.nbytes

    def innovations(self, readings: FloatArray) -> FloatArray:
        """Of readings (T, N, O) less those planned, (T, N, O); what the schedule takes for seen must be there."""
        (n_ticks, count, _), n_states = readings.shape, self.sensors.shape[1]
        n_signals, n_parameters = n_states // 3, n_states // 3 * self.rows.shape[-1]
        moved, innovations = np.zeros((count, n_parameters + n_states)), np.empty(readings.shape)
        of_parameters = moved[:, :n_parameters].reshape(count, n_signals, -1)
        of_deviations = moved[:, n_parameters:].reshape(count, n_signals, 3)
        for t in range(n_ticks):
            now = of_parameters @ self.rows[t].T + of_deviations
            innovations[t] = readings[t] - now.reshape(count, -1) @ self.sensors.T
            of_deviations[:] = of_deviations @ self.transition.T
            moved += np.where(self.fused[t], innovations[t], 0.0) @ self.gains[t].T
        return innovations

    def log_likelihoods(self, readings: FloatArray) -> FloatArray:
        """Of complete readings (N, T, O) less those planned, (N,) array, nats."""
        squares = np.empty(len(readings))
        for first in range(0, len(readings), BLOCK):
            innovations = self.innovations(readings[first : first + BLOCK].swapaxes(0, 1))
            e = np.where(self.fused[:, None], innovations, 0.0)
            squares[first : first + BLOCK] = np.einsum("tno,top,tnp->n", e, self.precisions, e, optimize=True)
        return float(self.share_constants.sum()) - 0.5 * squares


def gain_schedule(primitive: Primitive, task: Task, dt: float, array: SensorArray, seen: BoolArray) -> GainSchedule:
    """The gains of executions like one; those computed last are kept.

    Parameters
    ----------
    task : a batch of one: only its duration and what is told of it count.
    array : sensors whose readings say the same whatever is believed: linear ones, without gates.
    seen : (T, O) array, what is measured when.
    """
    key = (*kind_of(primitive, task, dt, array), seen.shape, seen.tobytes())
    return _KEPT.get(key, lambda: _computed(primitive, task, dt, array, seen))


def kind_of(primitive: Primitive, task: Task, dt: float, array: SensorArray) -> tuple[Hashable, ...]:
    """What executions have in common that share their gains; arguments as above."""
    sensors = (array.dense_matrix.tobytes(), array.covariance.tobytes(), array.silent.tobytes())
    return *kind_of_task(primitive, task, dt), *sensors


def _computed(primitive: Primitive, task: Task, dt: float, array: SensorArray, seen: BoolArray) -> GainSchedule:
    n_ticks, n_outputs = seen.shape
    executions = joint_executions(primitive, task, np.array([dt]), n_ticks + 1)
    system = JointSystem(executions, array)
    n_states = 3 * len(system.blocks)
    gains = np.zeros((n_ticks, system.model.means.size + n_states, n_outputs))
    spreads, fused = np.empty((n_ticks, n_outputs, n_outputs)), np.empty((n_ticks, n_outputs), dtype=np.bool_)
    now = system.look(system.rows[0])
    state = no_observations(system.model.belief, now)
    for t, readings in enumerate(np.where(seen & ~array.silent, 0.0, np.nan)):
        ahead = system.look(system.rows[t + 1])
        observed = AffineObservation(array.grouped(readings), array.matrix, array.noise)
        state, found = augmented_tick(state, now, ahead, system.moves, observed, with_gains=True)
        gains[t] = _gains(found, state.deviation.loading, system, array)
        fused[t] = array.flat(found.fused)
        spreads[t] = array.flat_covariances(found.innovation_covariance)
        now = ahead
    both = fused[:, :, None] & fused[:, None, :]
    known, nothing = np.where(both, spreads, np.eye(n_outputs)), np.zeros((n_ticks, n_outputs))
    constants = log_density_shares(nothing, nothing, known, np.linalg.cholesky(known), fused)
    own = executions.system.transition[0, 0]
    return GainSchedule(system.rows, own, gains, array.dense_matrix, fused, spreads, np.linalg.inv(known), constants)


def _gains(found: AugmentedTick, loading: FloatArray, system: JointSystem, array: SensorArray) -> FloatArray:
    """K of x' and of d' one step ahead, (P + 3 S, O)."""
    blocks, moves, of_z = system.blocks, system.moves, found.gains.T
    of_parameters = blocks @ of_z.reshape(len(blocks), blocks.shape[-1], -1)
    own = block_diagonal(moves.transition @ found.deviation_gains)
    of_deviations = own + (loading @ of_z.reshape(len(loading), loading.shape[-1], -1)).reshape(own.shape)
    return array.flat(np.concatenate([of_parameters.reshape(-1, own.shape[-1]), of_deviations]))
