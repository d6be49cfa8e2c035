"""Executions filtered with the gains of a schedule: many side by side, or one tick by tick."""

from functools import lru_cache

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.joint_model import JointExecutions
from probdmp.execution.gain_schedule import GainSchedule

__all__ = ["innovation_map", "planned_outputs", "planned_states", "scheduled_innovations", "scheduled_log_likelihoods"]

LARGEST_MAP = 2048
"""Numbers of an execution up to which its log-likelihood is one product with a matrix."""
BLOCK = 1024
"""Executions that are filtered side by side."""


def planned_states(executions: JointExecutions) -> FloatArray:
    """The states expected without observations, (T, N, S, 3) array; rows may have a batch axis of length 1."""
    model, rows = executions.model, executions.rows
    means = model.means + np.matmul(model.factors, model.belief.mean[:, None, :, None])[..., 0]
    if rows.shape[1] == 1:
        return np.asarray(np.einsum("tkn,bsn->tbsk", rows[:, 0], means, optimize=True))
    return np.asarray(np.einsum("tbkn,bsn->tbsk", rows, means, optimize=True))


def planned_outputs(executions: JointExecutions, sensors: FloatArray) -> FloatArray:
    """What is expected of sensors C (O, 3 S) without observations, (N, T, O) array; rows have a batch axis of length 1."""
    model, rows = executions.model, executions.rows[:, 0]
    means = model.means + np.matmul(model.factors, model.belief.mean[:, None, :, None])[..., 0]
    by_state = sensors.reshape(len(sensors), -1, 3)
    outputs = np.einsum("osk,tkn->tosn", by_state, rows).reshape(len(rows) * len(sensors), -1)
    return np.asarray(means.reshape(len(means), -1) @ outputs.T).reshape(-1, len(rows), len(sensors))


def scheduled_innovations(schedule: GainSchedule, readings: FloatArray) -> FloatArray:
    """Of readings (T, N, O) less those planned, (T, N, O); what the schedule takes for seen must be there."""
    (n_ticks, count, _), n_states = readings.shape, schedule.sensors.shape[1]
    n_signals, n_parameters = n_states // 3, n_states // 3 * schedule.rows.shape[-1]
    kept = n_parameters + n_states
    moved, innovations = np.zeros((count, kept)), np.empty(readings.shape)
    of_parameters = moved[:, :n_parameters].reshape(count, n_signals, -1)
    of_deviations = moved[:, n_parameters:].reshape(count, n_signals, 3)
    for t in range(n_ticks):
        now = of_parameters @ schedule.rows[t].T + of_deviations
        innovations[t] = readings[t] - now.reshape(count, -1) @ schedule.sensors.T
        moved += np.where(schedule.fused[t], innovations[t], 0.0) @ schedule.gains[t, :kept].T
        of_deviations[:] = of_deviations @ schedule.transition.T
    return innovations


def scheduled_log_likelihoods(schedule: GainSchedule, readings: FloatArray) -> FloatArray:
    """Of complete readings (N, T, O) less those planned, (N,) array, nats."""
    count, n_numbers = len(readings), readings[0].size
    squares = np.empty(count)
    constant = float(schedule.share_constants.sum())
    for first in range(0, count, BLOCK):
        block = readings[first : first + BLOCK]
        if n_numbers <= LARGEST_MAP:
            white = np.where(schedule.fused, block, 0.0).reshape(-1, n_numbers) @ innovation_map(schedule).T
            squares[first : first + BLOCK] = np.einsum("nk,nk->n", white, white)
        else:
            innovations = scheduled_innovations(schedule, block.swapaxes(0, 1))
            e = np.where(schedule.fused[:, None], innovations, 0.0)
            squares[first : first + BLOCK] = np.einsum("tno,top,tnp->n", e, schedule.precisions, e, optimize=True)
    return constant - 0.5 * squares


@lru_cache(maxsize=64)
def innovation_map(schedule: GainSchedule) -> FloatArray:
    """M, (T O, T O), lower triangular: M readings are independent standard normal numbers; zero for what is not seen.

    Readings are in their order in time, outputs of one tick together.
    """
    n_ticks, n_outputs = schedule.fused.shape
    size = n_ticks * n_outputs
    impulses = np.eye(size).reshape(size, n_ticks, n_outputs).swapaxes(0, 1)
    found = scheduled_innovations(schedule, impulses)  # (T, T O, O): of a unit reading at one time
    whitening = np.linalg.cholesky(schedule.precisions).mT
    white = whitening @ np.where(schedule.fused[:, None], found, 0.0).swapaxes(1, 2)
    return np.ascontiguousarray(white.reshape(size, size))
