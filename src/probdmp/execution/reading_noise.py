"""What deviations and sensors add to the readings of outputs that look at the same signals, when parameters are known.

    e = sum_s H_s eps_s + v,    eps_s[t] ~ N(0, q_s),  v ~ N(0, R),    V = sum_s q_s H_s H_s^T + R

H_s says what is left over of the forcing term of signal s: impulses that go on as A^k B. One output of one signal is a system
that the Kalman filter whitens tick by tick, with gains that all executions share; of several a triangle L^-1 does, V = L L^T.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.deviations import DeviationSystem
from probdmp.gaussian import LinearGaussianModel, SharedGains, score_series, shared_gains, smooth_series
from probdmp.gaussian.density import LOG_2PI

__all__ = ["ReadingNoise", "reading_noise"]

PANEL = 64
"""Rows that are multiplied at once: L^-1 is a triangle."""


class SeriesNoise(NamedTuple):
    """Of one output of one signal."""

    gains: SharedGains

    @property
    def n_bytes(self) -> int:
        """About how much memory it takes."""
        return self.gains.closed_loop.nbytes + self.gains.predicted_covariances.nbytes + self.gains.covariances.nbytes

    def weighted(self, designs: FloatArray) -> FloatArray:
        """V^-1 times designs (T, H): R^-1 times what is left of them when the deviation that explains them best is gone."""
        systems, columns = self.gains.systems, np.ascontiguousarray(designs.T)
        deviations = smooth_series(self.gains, columns[..., None]).means[:, :, 0]
        return (designs - (deviations @ systems.sensor[0]).T) / systems.noise

    def log_likelihoods(self, residuals: FloatArray) -> FloatArray:
        """Of e of each execution, (N, T); (N,) array, nats."""
        return score_series(self.gains, residuals[..., None])


class DenseNoise(NamedTuple):
    """Of M outputs, one after the other, in T ticks each."""

    whitening: FloatArray
    """L^-1, (M T, M T) array."""
    constant: float
    """Nats: the part of the log-likelihood that readings have no part in."""

    @property
    def n_bytes(self) -> int:
        """How much memory it takes."""
        return self.whitening.nbytes

    def weighted(self, designs: FloatArray) -> FloatArray:
        """V^-1 times designs (M T, H)."""
        return self.whitening.T @ (self.whitening @ designs)

    def log_likelihoods(self, residuals: FloatArray) -> FloatArray:
        """Of e of each execution, (N, M T); (N,) array, nats."""
        squares = np.zeros(len(residuals))
        for begin in range(0, len(self.whitening), PANEL):
            end = begin + PANEL
            white = residuals[:, :end] @ self.whitening[begin:end, :end].T
            squares += np.einsum("nk,nk->n", white, white)
        return self.constant - 0.5 * squares


ReadingNoise = SeriesNoise | DenseNoise


def reading_noise(
    system: DeviationSystem, variances: FloatArray, sensors: FloatArray, noise: FloatArray, n_ticks: int
) -> ReadingNoise:
    """Of the first of a batch of executions.

    Parameters
    ----------
    variances : q of K signals, (K,) array.
    sensors : C, (M, K, 3) array: how outputs look at the states of each signal.
    noise : R, (M, M) array.
    n_ticks : T.
    """
    transition, response = system.transition[0, 0], system.input_vector[0, 0]
    if sensors.shape[:2] == (1, 1):
        inputs, variance = np.zeros((n_ticks - 1, 1)), np.full((n_ticks - 1, 1, 1), variances[0])
        model = LinearGaussianModel(
            transition, response[:, None], inputs, variance, sensors[0], noise, np.zeros(3), np.zeros((3, 3))
        )
        return SeriesNoise(shared_gains(model))
    covariance = np.kron(noise, np.eye(n_ticks))
    impulses = _impulses(transition, response, n_ticks)
    for s, variance in enumerate(variances):
        responses = np.einsum("mc,tjc->mtj", sensors[:, s], impulses).reshape(-1, n_ticks)
        covariance += variance * responses @ responses.T
    factor = np.linalg.cholesky(covariance)
    constant = -np.log(np.diagonal(factor)).sum() - len(factor) / 2 * LOG_2PI
    return DenseNoise(np.tril(np.linalg.inv(factor)), float(constant))


def _impulses(transition: FloatArray, response: FloatArray, n_ticks: int) -> FloatArray:
    """Deviations at T ticks from a unit impulse in each of T steps, (T, T, 3) array: those of step j begin at tick j + 1."""
    one = np.zeros((n_ticks, 3))  # and nothing before it
    for later in one[1:]:
        later[:], response = response, transition @ response
    since = np.arange(n_ticks)[:, None] - np.arange(n_ticks)
    return one[np.maximum(since, 0)]
