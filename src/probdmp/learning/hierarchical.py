"""The variation between demonstrations, by MAP expectation maximisation over (mu, Sigma, R).

    theta_k ~ N(mu, Sigma),    y_k[t] = H[t] theta_k + e,    e ~ N(0, R),    theta_k's goal is where demonstration k ends
    E  posterior N(m_k, C) of every theta_k; the phases are common to all demonstrations, hence C is too
    M  mu = mean m_k,   Sigma = (1 - rho) [sum_k (m_k - mu)(m_k - mu)^T / (K - 1) + C] + rho Sigma_0,
       R = mean of (y_k[t] - H[t] m_k)^2 + H[t] C H[t]^T

theta_k holds the parameters of all signals of demonstration k: its degrees of freedom, seen from their start, and its sensor
channels, whose start is a parameter like the others and whose end is nobody's goal.

Sigma may couple signals, or hold that they vary independently: then what was found between them is left out. With
`coupling="auto"` the likelier of the two is taken, by the density of each demonstration given what the others teach.

The inverse-Wishart prior around Sigma_0 counts as much as rho / (1 - rho) (K - 1) demonstrations. With one demonstration
nothing is left but Sigma_0. The covariance of a new execution is (1 + 1 / K) Sigma: mu is not known better.
Source: Bishop, Pattern Recognition and Machine Learning, chapters 9 and 2.3.6; Lazaric & Ghavamzadeh, Bayesian multi-task
reinforcement learning, ICML 2010, for the same model of linear weights.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.responses import GOAL
from probdmp.learning.variation_prior import prior_covariance

__all__ = ["SignalEstimate", "estimate_variation"]

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


COMPARED_PHASES = 26
"""Phases of a demonstration by which the two ways to couple signals are compared; those between say little more."""


class SignalEstimate(NamedTuple):
    """The Gaussian over the parameters of a new execution, as `probdmp.dmp.path_distribution.signal_distribution` has it."""

    means: FloatArray
    """(S, N + 3) array, units of each signal."""
    covariance: FloatArray
    """(S (N + 3), S (N + 3)) array."""
    residuals: FloatArray
    """(S,) array, units squared: of what was recorded around the paths of the parameters."""
    is_coupled: bool
    """Whether signals vary together."""


class _Posteriors(NamedTuple):
    means: FloatArray
    """m_k, (K, P)."""
    prior: FloatArray
    """Sigma of the E step, (P, P)."""
    spread: FloatArray
    """Sigma U^T, (P, Q), U the part of the designs that says all that they say of the parameters."""
    solved: FloatArray
    """(1 + U Sigma U^T)^-1 U Sigma, (Q, P)."""

    def covariance(self) -> FloatArray:
        """C, (P, P)."""
        posterior = self.prior - self.spread @ self.solved
        return (posterior + posterior.T) / 2

    def own_covariances(self, n_signals: int) -> FloatArray:
        """Those blocks of C that belong to one signal each, (S, n, n)."""
        n, own = len(self.prior) // n_signals, np.arange(n_signals)
        blocks = self.prior.reshape(n_signals, n, n_signals, n)[own, :, own]
        taken = self.spread.reshape(n_signals, n, -1) @ self.solved.reshape(-1, n_signals, n).swapaxes(0, 1)
        return np.asarray(blocks - (taken + taken.mT) / 2)


class _Problem(NamedTuple):
    """All in units of each signal's range, so that nothing has a unit."""

    designs: FloatArray
    """H = Q U, (M, n) array, n parameters of each signal; with channels a column of ones goes first."""
    paths: FloatArray
    """y, (K, M, S)."""
    roots: FloatArray
    """U, (q, n) array, q <= n."""
    told: FloatArray
    """Q^T y, (K, q, S): what paths say of the parameters."""
    has_goal: FloatArray
    """(S,) one for degrees of freedom, which end at their goal; zero for channels."""
    goal: int
    """Which parameter that is."""

    def mean(self) -> "_Problem":
        """The same of the mean path alone."""
        return self._replace(paths=self.paths.mean(axis=0, keepdims=True), told=self.told.mean(axis=0, keepdims=True))


def estimate_variation(
    responses: FloatArray, paths: FloatArray, ranges: FloatArray, n_channels: int = 0, coupling: str = "full"
) -> SignalEstimate:
    """How executions of a movement differ, from demonstrations on common phases.

    Parameters
    ----------
    responses : H, (M, N + 2) array, of the position on M phases evenly spaced from 0 to 1.
    paths : y, (K, M, S) array, units of each signal: positions minus the start of each demonstration, then channels.
    ranges : (S,) array, units of each signal.
    n_channels : F, how many of the signals are channels.
    coupling : `"full"`, `"none"` or `"auto"`.
    """
    k, m, n_signals = paths.shape
    designs = np.concatenate([np.ones((m, 1)), responses], axis=1) if n_channels else responses
    has_goal = np.where(np.arange(n_signals) < n_signals - n_channels, 1.0, 0.0)
    orthogonal, roots = np.linalg.qr(designs)
    goal = designs.shape[1] - responses.shape[1] + GOAL
    problem = _Problem(designs, paths / ranges, roots, orthogonal.T @ (paths / ranges), has_goal, goal)
    mean_path = problem.paths.mean(axis=0)
    variances = np.full(n_signals, SINGLE_STD**2)
    if k > 1:
        variances = np.maximum(np.sum((problem.paths - mean_path) ** 2, axis=(0, 1)) / ((k - 1) * m), LEAST_STD**2)
    prior = prior_covariance(responses, mean_path, variances, n_channels)
    is_coupled = coupling != "none"
    mean, covariance, residuals, posteriors = _maximize(problem, prior, variances, is_coupled)
    if coupling == "auto" and k > 2 and n_signals > 1 and not _is_coupling_likelier(problem, prior, residuals, posteriors):
        is_coupled = False
        mean, covariance, residuals, _ = _maximize(problem, prior, variances, is_coupled)
    unit = np.repeat(ranges, designs.shape[1])
    covariance = (1 + 1 / k) * covariance * unit[:, None] * unit
    means, covariance = _with_starts((mean * unit).reshape(n_signals, -1), (covariance + covariance.T) / 2, n_channels)
    return SignalEstimate(means, covariance, residuals * ranges**2, is_coupled)


def _maximize(
    problem: _Problem, prior: FloatArray, variances: FloatArray, is_coupled: bool
) -> tuple[FloatArray, FloatArray, FloatArray, _Posteriors]:
    """mu (P), Sigma (P, P) and R (S), and what is then known of the demonstrations."""
    residuals, covariance = np.maximum(0.01 * variances, LEAST_RESIDUAL**2), prior
    mean = _posteriors(problem.mean(), np.zeros(len(prior)), 100 * prior, residuals).means[0]
    for _ in range(MOST_ITERATIONS):
        posteriors = _posteriors(problem, mean, covariance, residuals)
        mean = posteriors.means.mean(axis=0)
        if len(problem.paths) > 1:
            covariance = _between(posteriors, prior, len(variances), is_coupled)
        before, residuals = residuals, np.maximum(_residual_variances(problem, posteriors), LEAST_RESIDUAL**2)
        if np.all(np.abs(residuals - before) <= TOLERANCE * before):
            break
    return mean, covariance, residuals, posteriors


def _between(posteriors: _Posteriors, prior: FloatArray, n_signals: int, is_coupled: bool) -> FloatArray:
    """Sigma of the M step."""
    deviations = posteriors.means - posteriors.means.mean(axis=0)
    between = deviations.T @ deviations / (len(deviations) - 1) + posteriors.covariance()
    covariance = (1 - PRIOR_WEIGHT) * between + PRIOR_WEIGHT * prior
    if not is_coupled:
        size = len(prior) // n_signals
        covariance = covariance * np.kron(np.eye(n_signals), np.ones((size, size)))
    return covariance


def _is_coupling_likelier(problem: _Problem, prior: FloatArray, residuals: FloatArray, posteriors: _Posteriors) -> bool:
    """Whether demonstrations are likelier given the others if signals vary together."""
    k, m, n_signals = problem.paths.shape
    rows = np.unique(np.linspace(1, m - 1, COMPARED_PHASES).round().astype(int))
    whole = np.kron(np.eye(n_signals), problem.designs[rows])
    noise = np.repeat(residuals, len(rows))
    gain = 0.0
    for left_out in range(k):
        others = posteriors._replace(means=np.delete(posteriors.means, left_out, axis=0))
        error = problem.paths[left_out, rows].T.ravel() - whole @ others.means.mean(axis=0)
        for is_coupled in (True, False):
            covariance = whole @ ((1 + 1 / (k - 1)) * _between(others, prior, n_signals, is_coupled)) @ whole.T
            factor = np.linalg.cholesky(covariance + np.diag(noise))
            square = np.sum(np.linalg.solve(factor, error) ** 2)
            gain += (-0.5 if is_coupled else 0.5) * (square + 2 * np.log(np.diagonal(factor)).sum())
    return bool(gain > 0)


def _with_starts(means: FloatArray, covariance: FloatArray, n_channels: int) -> tuple[FloatArray, FloatArray]:
    """With the start of each signal as its first parameter; without channels there is none yet, and it is zero."""
    if n_channels:
        return means, covariance
    n_signals, n = means.shape
    kept = np.delete(np.arange(n_signals * (n + 1)), np.arange(n_signals) * (n + 1))
    full = np.zeros((n_signals * (n + 1),) * 2)
    full[np.ix_(kept, kept)] = covariance
    return np.concatenate([np.zeros((n_signals, 1)), means], axis=1), full


def _posteriors(problem: _Problem, mean: FloatArray, covariance: FloatArray, residuals: FloatArray) -> _Posteriors:
    """The E step: theta of every demonstration given its path, and its end, which is its goal.

    Parameters
    ----------
    mean, covariance : mu and Sigma, (P) and (P, P).
    residuals : R, (S,), in units of the range squared, as all else.
    """
    n_signals, n = len(residuals), problem.roots.shape[1]
    goals = np.broadcast_to(np.eye(n)[problem.goal], (n_signals, 1, n))
    rows = np.concatenate([np.broadcast_to(problem.roots, (n_signals, *problem.roots.shape)), goals], axis=1)
    precisions = np.concatenate([np.tile(residuals**-0.5, (len(problem.roots), 1)), problem.has_goal[None] / GOAL_TOLERANCE])
    seen = np.concatenate([problem.told, problem.paths[:, -1:]], axis=1)
    seen = (seen - (rows @ mean.reshape(n_signals, n, 1))[..., 0].T) * precisions
    rows = rows * precisions.T[..., None]  # now with unit noise
    told = np.moveaxis(seen, 2, 1).reshape(len(seen), -1)
    # C = Sigma - Sigma U^T (1 + U Sigma U^T)^-1 U Sigma: Sigma may be singular, and no parameter needs to vary.
    by_signal = covariance.reshape(-1, n_signals, n).swapaxes(0, 1) @ rows.mT
    spread = by_signal.swapaxes(0, 1).reshape(len(mean), -1)
    size = spread.shape[1]
    inner = np.eye(size) + np.matmul(rows, spread.reshape(n_signals, n, -1)).reshape(size, -1)
    solved = np.linalg.solve(inner, np.concatenate([spread.T, told.T], axis=1))
    means = mean + (spread @ solved[:, len(mean) :]).T
    return _Posteriors(means, covariance, spread, solved[:, : len(mean)])


def _residual_variances(problem: _Problem, posteriors: _Posteriors) -> FloatArray:
    """R, (S,) array; the start of a degree of freedom, which is zero by definition, says nothing."""
    (k, m, n_signals), n = problem.paths.shape, problem.roots.shape[1]
    means = posteriors.means.reshape(k, n_signals, n)
    errors = problem.paths - problem.designs @ means.mT
    spread = np.sum((problem.roots @ posteriors.own_covariances(n_signals)) * problem.roots, axis=(1, 2))
    return np.asarray((np.sum(errors**2, axis=(0, 1)) / k + spread) / (m - problem.has_goal))
