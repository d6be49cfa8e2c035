"""Complete recordings of executions whose parameters are constant and unknown, each a single draw from one Gaussian.

    o - plan = G z + sum_s H_s eps_s + v,    z ~ N(0, P),  eps_s[t] ~ N(0, q_s),  v ~ N(0, R)

G says what the latent parameters do to all readings, H_s what is left over of the forcing term of signal s: impulses that go
on as A^k B. With Sigma = G P G^T + sum_s q_s H_s H_s^T + R = L L^T, L^-1 (o - plan) is white. Executions that last equally long
and are told the same kinds of things share L, and what the filter says of one reading after the other adds up to the same.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp.joint_model import JointExecutions
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian.density import LOG_2PI

__all__ = ["CompleteReadings", "complete_readings"]

BLOCK = 1024
"""Executions that are looked at side by side."""
PANEL = 64
"""Rows that are multiplied at once: L^-1 is a triangle."""


class CompleteReadings(NamedTuple):
    """The Gaussian over the readings of T ticks, of O outputs, of which M are measured at all."""

    measured: BoolArray
    """(O,) array."""
    whitening: FloatArray
    """L^-1, (T M, T M) array; readings are in their order in time, outputs of one tick together."""
    constant: float
    """Nats: the part of the log-likelihood that readings have no part in."""

    @property
    def n_bytes(self) -> int:
        """How much memory it takes."""
        return self.whitening.nbytes

    def log_likelihoods(self, readings: FloatArray) -> FloatArray:
        """Of readings (N, T, O) less those planned, (N,) array, nats."""
        (count, _, _), size = readings.shape, len(self.whitening)
        squares, is_whole = np.zeros(count), bool(self.measured.all())
        for first in range(0, count, BLOCK):
            block = readings[first : first + BLOCK]
            seen = (block if is_whole else block[..., self.measured]).reshape(len(block), size)
            for begin in range(0, size, PANEL):
                end = min(begin + PANEL, size)
                white = seen[:, :end] @ self.whitening[begin:end, :end].T
                squares[first : first + BLOCK] += np.einsum("nk,nk->n", white, white)
        return self.constant - 0.5 * squares


def complete_readings(executions: JointExecutions, array: SensorArray) -> CompleteReadings:
    """Of the first of a batch; sensors whose readings say the same whatever is believed: linear ones, without gates."""
    model, rows = executions.model, executions.rows[:, 0]
    measured, (n_ticks, n_signals) = ~array.silent, (len(rows), len(model.factors[0]))
    sensors = array.dense_matrix[measured].reshape(-1, n_signals, 3)
    size = n_ticks * len(sensors)
    designs = np.einsum("osk,tkn,snr->tor", sensors, rows, model.factors[0], optimize=True).reshape(size, -1)
    covariance = designs @ model.belief.covariance[0] @ designs.T
    covariance += np.kron(np.eye(n_ticks), array.covariance[np.ix_(measured, measured)])
    for s, impulses in enumerate(_impulses(executions, n_ticks)):
        responses = np.einsum("ok,tjk->toj", sensors[:, s], impulses).reshape(size, n_ticks)
        covariance += responses @ responses.T
    factor = np.linalg.cholesky(covariance)
    constant = -np.log(np.diagonal(factor)).sum() - size / 2 * LOG_2PI
    return CompleteReadings(measured, np.tril(np.linalg.inv(factor)), float(constant))


def _impulses(executions: JointExecutions, n_ticks: int) -> FloatArray:
    """Deviations at T ticks from unit noise of each of T steps, (S, T, T, 3) array: those of step j begin at tick j + 1."""
    system = executions.system
    transition, response = system.transition[0, 0], system.input_vector[0, 0]
    one = np.zeros((n_ticks, 3))  # and nothing before it
    for later in one[1:]:
        later[:], response = response, transition @ response
    since = np.arange(n_ticks)[:, None] - np.arange(n_ticks)
    scales = np.sqrt(system.variances[0])
    return np.asarray(scales[:, None, None, None] * one[np.maximum(since, 0)])
