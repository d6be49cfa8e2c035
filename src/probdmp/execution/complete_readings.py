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
    """M outputs that look at the same signals, of H parameters."""

    outputs: IntArray
    """(M,) array."""
    parameters: slice
    """Which of those of all signals."""
    designs: FloatArray
    """D^T, (H, M T) array."""
    weights: FloatArray
    """W of the readings of one output after the other, and below it -A of what is expected; (M T + H, H) array."""
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
            scores[part] = self._of(readings[part], expected[part].reshape(-1, len(self.gains)))
        return scores

    def _of(self, readings: FloatArray, expected: FloatArray) -> FloatArray:
        """The same with parameters (N, P)."""
        told, known = np.zeros_like(expected), [_side_by_side(group, readings, expected) for group in self.groups]
        for group, both in zip(self.groups, known, strict=True):
            told[:, group.parameters] = both @ group.weights
        unknown = told @ self.gains
        fitted = expected + unknown @ self.factor
        scores = self.constant - 0.5 * np.einsum("nr,nr->n", unknown, unknown)
        for group, both in zip(self.groups, known, strict=True):
            residuals = fitted[:, group.parameters] @ group.designs
            np.subtract(both[:, : residuals.shape[1]], residuals, out=residuals)
            scores += group.noise.log_likelihoods(residuals)
        return np.asarray(scores)


def _side_by_side(group: _Group, readings: FloatArray, expected: FloatArray) -> FloatArray:
    """What is read of the outputs of a group, one after the other, and what is expected of its parameters: (N, M T + H)."""
    (count, n_ticks, _), own = readings.shape, expected[:, group.parameters]
    both = np.empty((count, len(group.weights)))
    for i, output in enumerate(group.outputs):
        both[:, i * n_ticks : (i + 1) * n_ticks] = readings[..., output]
    both[:, -own.shape[1] :] = own
    return both


def complete_readings(executions: JointExecutions, array: SensorArray) -> CompleteReadings:
    """Of the first of a batch; sensors whose readings say the same whatever is believed: linear ones, without gates."""
    model = executions.model
    groups = tuple(_groups(executions, array))
    variances, directions = np.linalg.eigh(model.belief.covariance[0])
    blocks = model.factors[0].reshape(-1, len(variances))
    factor = blocks @ (directions * np.sqrt(np.maximum(variances, 0.0)))
    information = np.zeros((len(factor),) * 2)
    for group in groups:
        information[group.parameters, group.parameters] = -group.weights[-len(group.designs) :]
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
        designs = np.einsum("mkc,tcn->mtkn", sensors, rows).reshape(len(outputs) * n_ticks, -1)
        noise = reading_noise(
            system, system.variances[0, signals], sensors, array.covariance[np.ix_(outputs, outputs)], n_ticks
        )
        weights = noise.weighted(designs)
        stacked = np.concatenate([weights, -designs.T @ weights])
        yield _Group(outputs, slice(signals.start * n, signals.stop * n), designs.T.copy(), stacked, noise)
