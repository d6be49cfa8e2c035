"""The variation between demonstrations, by MAP expectation maximisation over (mu, Sigma, R).

    theta_k ~ N(mu, Sigma),    y_k[t] = H[t] theta_k + e,    e ~ N(0, R),    theta_k's goal is where demonstration k ends
    E  posterior N(m_k, C) of every theta_k; the phases are common to all demonstrations, hence C is too
    M  mu = mean m_k,   Sigma = (1 - rho) [sum_k (m_k - mu)(m_k - mu)^T / (K - 1) + C] + rho Sigma_0,
       R = mean of (y_k[t] - H[t] m_k)^2 + H[t] C H[t]^T

The inverse-Wishart prior around Sigma_0 counts as much as rho / (1 - rho) (K - 1) demonstrations. With one demonstration
nothing is left but Sigma_0. The covariance of a new execution is (1 + 1 / K) Sigma: mu is not known better.
Source: Bishop, Pattern Recognition and Machine Learning, chapters 9 and 2.3.6; Lazaric & Ghavamzadeh, Bayesian multi-task
reinforcement learning, ICML 2010, for the same model of linear weights.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Variation
from probdmp.dmp.responses import GOAL
from probdmp.learning.variation_prior import prior_covariance

__all__ = ["estimate_variation"]

PRIOR_WEIGHT = 0.5
"""rho, between 0 and 1."""
SINGLE_STD = 0.1
"""How far executions are believed to stray, as a fraction of the range, where there is one demonstration only."""
LEAST_STD = 1e-3
"""Least root mean square by which demonstrations differ, as a fraction of the range."""
LEAST_RESIDUAL = 1e-5
"""Least standard deviation of the residual, as a fraction of the range."""
GOAL_TOLERANCE = 1e-4
"""Standard deviation with which the end of a demonstration is its goal, as a fraction of the range."""
MOST_ITERATIONS = 10
TOLERANCE = 0.01
"""Relative change of every R below which the iteration stops."""


class _Posteriors(NamedTuple):
    means: FloatArray
    """m_k, (K, D (N + 2))."""
    covariance: FloatArray
    """C, (D (N + 2), D (N + 2))."""


def estimate_variation(responses: FloatArray, displacements: FloatArray, ranges: FloatArray) -> Variation:
    """How executions of a movement differ, from demonstrations on common phases.

    Parameters
    ----------
    responses : H, (M, N + 2) array, of the position on M phases evenly spaced from 0 to 1.
    displacements : y, (K, M, D) array, data units: positions minus the start of each demonstration.
    ranges : (D,) array, data units.
    """
    k, m, d = displacements.shape
    y = displacements / ranges  # so that nothing below has a unit
    mean_path = y.mean(axis=0)
    variances = np.full(d, SINGLE_STD**2)
    if k > 1:
        variances = np.maximum(np.sum((y - mean_path) ** 2, axis=(0, 1)) / ((k - 1) * m), LEAST_STD**2)
    covariance = prior = prior_covariance(responses, mean_path, variances)
    residuals = np.maximum(0.01 * variances, LEAST_RESIDUAL**2)
    mean = _posteriors(responses, mean_path[None], np.zeros(len(prior)), 100 * prior, residuals).means[0]
    for _ in range(MOST_ITERATIONS):
        posteriors = _posteriors(responses, y, mean, covariance, residuals)
        mean = posteriors.means.mean(axis=0)
        if k > 1:
            deviations = posteriors.means - mean
            between = deviations.T @ deviations / (k - 1) + posteriors.covariance
            covariance = (1 - PRIOR_WEIGHT) * between + PRIOR_WEIGHT * prior
        before, residuals = residuals, np.maximum(_residual_variances(responses, y, posteriors), LEAST_RESIDUAL**2)
        if np.all(np.abs(residuals - before) <= TOLERANCE * before):
            break
    unit = np.repeat(ranges, responses.shape[1])
    covariance = (1 + 1 / k) * covariance * unit[:, None] * unit
    return Variation((mean * unit).reshape(d, -1), (covariance + covariance.T) / 2, residuals * ranges**2)


def _posteriors(
    responses: FloatArray, displacements: FloatArray, mean: FloatArray, covariance: FloatArray, residuals: FloatArray
) -> _Posteriors:
    """The E step: theta of every demonstration given its path, and its end, which is its goal.

    Parameters
    ----------
    mean, covariance : mu and Sigma, (D (N + 2)) and (D (N + 2), D (N + 2)).
    residuals : R, (D,), in units of the range squared, as all else.
    """
    (k, _, d), n = displacements.shape, responses.shape[1]
    goal = np.eye(n)[GOAL]
    # Sigma = F F^T: in terms of F no parameter is larger than another, and none needs to vary.
    eigenvalues, vectors = np.linalg.eigh(covariance)
    factor = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    information = np.kron(np.diag(1 / residuals), responses.T @ responses)
    information += np.kron(np.eye(d), np.outer(goal, goal)) / GOAL_TOLERANCE**2
    errors = displacements - responses @ mean.reshape(d, n).T[None]
    scores = np.einsum("kmd,mn->kdn", errors / residuals, responses)
    scores[..., GOAL] += (displacements[:, -1] - mean.reshape(d, n)[:, GOAL]) / GOAL_TOLERANCE**2
    precision = np.eye(len(mean)) + factor.T @ information @ factor
    gain = factor @ np.linalg.solve(precision, factor.T)
    return _Posteriors(mean + scores.reshape(k, -1) @ gain.T, (gain + gain.T) / 2)


def _residual_variances(responses: FloatArray, displacements: FloatArray, posteriors: _Posteriors) -> FloatArray:
    """R, (D,) array; the start, which is zero by definition, says nothing."""
    (k, m, d), n = displacements.shape, responses.shape[1]
    errors = displacements - np.einsum("mn,kdn->kmd", responses, posteriors.means.reshape(k, d, n))
    blocks = posteriors.covariance.reshape(d, n, d, n)[np.arange(d), :, np.arange(d)]
    spread = np.einsum("mn,dno,mo->d", responses, blocks, responses, optimize=True)
    return np.asarray((np.sum(errors**2, axis=(0, 1)) / k + spread) / (m - 1))
