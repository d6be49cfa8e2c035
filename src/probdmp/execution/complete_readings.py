"""Complete recordings of executions whose parameters are constant and unknown: how likely they are, by what fits them best.

    o = D x + e,    x = m + F u,    u ~ N(0, I),    e ~ N(0, V)

D says what the parameters x of all signals do to all readings, V is what deviations and sensors add, and m, what is expected of
x, follows from what an execution is told. With W = V^-1 D, the posterior mean of u is linear in what is read and in m,

    u' = (I + F^T A F)^-1 F^T (W^T o - A m),    A = D^T W

and p(o) = p(o | u) p(u) / p(u | o) holds for any u, so for this one too:

    ln p(o) = ln N(o - D (m + F u'); 0, V) - |u'|^2 / 2 - ln |I + F^T A F| / 2

No large numbers cancel, and an error of u' counts only squared. Executions that last equally long and are told the same kinds
of things share all but o and m. V is that of each group of outputs alone, see `probdmp.execution.reading_noise`.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.dmp.joint_model import JointExecutions
from probdmp.execution.reading_noise import ReadingNoise, reading_noise
from probdmp.execution.sensor_array import SensorArray

__all__ = ["CompleteReadings", "complete_readings"]

BLOCK = 256
"""Executions that are looked at side by side: what is computed of them stays in the cache of a processor."""


class _Group(NamedTuple):
    """M outputs that look at the same K signals, of H = K (N + 3) parameters."""

    outputs: IntArray
    """(M,) array."""
    parameters: slice
    """Which of those of all signals."""
    designs: FloatArray
    """D, (M, T, H) array."""
    weights: FloatArray
    """W, (M, T, H) array."""
    information: FloatArray
    """A, (H, H) array."""
    noise: ReadingNoise


class CompleteReadings(NamedTuple):
    """The Gaussian over the readings of T ticks, of all S signals, of P = S (N + 3) parameters; u has r entries."""

    groups: tuple[_Group, ...]
    gains: FloatArray
    """Of W^T o - A m in u', (P, r) array."""
    factor: FloatArray
    """F^T, (r, P) array."""
    constant: float
    """Nats: what the determinant adds."""

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        return 2 * self.gains.nbytes + sum(2 * group.designs.nbytes + group.noise.n_bytes for group in self.groups)

    def log_likelihoods(self, readings: FloatArray, expected: FloatArray) -> FloatArray:
        """Of readings (N, T, O) of executions of whose parameters m, (N, S, N + 3), is expected; (N,) array, nats."""
        scores = np.empty(len(readings))
        for first in range(0, len(readings), BLOCK):
            part = slice(first, first + BLOCK)
            by_output = np.ascontiguousarray(np.moveaxis(readings[part], -1, 0))
            scores[part] = self._of(by_output, expected[part].reshape(by_output.shape[1], -1))
        return scores

    def _of(self, readings: FloatArray, expected: FloatArray) -> FloatArray:
        """The same of readings (O, N, T) and parameters (N, P)."""
        told = np.zeros_like(expected)
        for group in self.groups:
            own = told[:, group.parameters]
            np.matmul(expected[:, group.parameters], -group.information, out=own)
            for output, weights in zip(group.outputs, group.weights, strict=True):
                own += readings[output] @ weights
        unknown = told @ self.gains
        fitted = expected + unknown @ self.factor
        scores = self.constant - 0.5 * np.einsum("nr,nr->n", unknown, unknown)
        for group in self.groups:
            residuals = np.matmul(fitted[:, group.parameters], group.designs.mT)
            for output, residual in zip(group.outputs, residuals, strict=True):
                np.subtract(readings[output], residual, out=residual)
            scores += group.noise.log_likelihoods(residuals)
        return np.asarray(scores)


def complete_readings(executions: JointExecutions, array: SensorArray) -> CompleteReadings:
    """Of the first of a batch; sensors whose readings say the same whatever is believed: linear ones, without gates."""
    model = executions.model
    groups = tuple(_groups(executions, array))
    variances, directions = np.linalg.eigh(model.belief.covariance[0])
    blocks = model.factors[0].reshape(-1, len(variances))
    factor = blocks @ (directions * np.sqrt(np.maximum(variances, 0.0)))
    information = np.zeros((len(factor),) * 2)
    for group in groups:
        information[group.parameters, group.parameters] = group.information
    precision = np.eye(len(variances)) + factor.T @ information @ factor
    gains, constant = np.linalg.solve(precision, factor.T), -0.5 * np.linalg.slogdet(precision)[1]
    return CompleteReadings(groups, gains.T.copy(), factor.T.copy(), float(constant))


def _groups(executions: JointExecutions, array: SensorArray) -> Iterator[_Group]:
    """Outputs that say something, by the signals that they look at."""
    rows, system = executions.rows[:, 0], executions.system
    (n_ticks, _, n), n_signals = rows.shape, system.variances.shape[-1]
    by_group = array.grouped(np.where(array.silent, np.nan, np.arange(len(array.silent))))
    together = n_signals // len(by_group)
    for g, row in enumerate(by_group):
        outputs, signals = row[~np.isnan(row)].astype(np.intp), slice(g * together, (g + 1) * together)
        if not len(outputs):
            continue
        sensors = array.dense_matrix[outputs].reshape(len(outputs), n_signals, 3)[:, signals]
        designs = np.einsum("mkc,tcn->mtkn", sensors, rows).reshape(len(outputs), n_ticks, -1)
        noise = reading_noise(
            system, system.variances[0, signals], sensors, array.covariance[np.ix_(outputs, outputs)], n_ticks
        )
        weights = noise.weighted(designs)
        information = np.einsum("mth,mti->hi", designs, weights, optimize=True)
        yield _Group(outputs, slice(signals.start * n, signals.stop * n), designs, weights, information, noise)
