"""Bayesian linear regression with its two precisions found by evidence maximisation.

    f = Phi w + e,   w ~ N(0, 1/alpha),  e ~ N(0, 1/beta)

    posterior        Sigma_w = (alpha + beta Phi^T Phi)^-1,  mu_w = beta Sigma_w Phi^T f
    fixed point      gamma = sum_i beta l_i / (alpha + beta l_i),
                     alpha = gamma / mu_w^T mu_w,   1/beta = |f - Phi mu_w|^2 / (n - gamma)

l_i are the eigenvalues of Phi^T Phi, computed once, so that an iteration costs as little as the number of weights.
Source: Bishop, Pattern Recognition and Machine Learning, sections 3.3 and 3.5.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["WeightPosterior", "log_evidence", "regress_weights"]

LARGEST_RATIO = 1e12
"""Of the mean square of the targets to 1 / beta, and of alpha to what targets of that size suggest."""
MOST_ITERATIONS = 1000
TOLERANCE = 1e-8


class WeightPosterior(NamedTuple):
    """What regression says about the weights of one degree of freedom."""

    mean: FloatArray
    """mu_w, (N,) array."""
    covariance: FloatArray
    """Sigma_w, (N, N) array."""
    alpha: float
    """Prior precision of the weights."""
    beta: float
    """Precision of the targets around their mean."""


def regress_weights(features: FloatArray, targets: FloatArray, resolution: float) -> WeightPosterior:
    """Posterior over weights, with alpha and beta by evidence maximisation.

    Parameters
    ----------
    features : Phi, (n, N) array.
    targets : f, (n,) array.
    resolution : size of targets that is as good as nothing, > 0; a movement that stands still has no others.
    """
    size = float(np.mean(targets**2)) + resolution**2
    eigenvalues, vectors = np.linalg.eigh(features.T @ features)
    eigenvalues = np.maximum(eigenvalues, 0.0)
    projected = vectors.T @ (features.T @ targets)
    energy, n = float(targets @ targets), len(targets)
    # Bounds, for targets that are nothing but noise, or not noisy at all.
    scale = float(eigenvalues.max()) / n / size
    largest_beta = LARGEST_RATIO / size
    alpha, beta = scale, 10 / size
    for _ in range(MOST_ITERATIONS):
        shrunk = beta / (alpha + beta * eigenvalues)
        weights = shrunk * projected
        gamma = float(np.sum(shrunk * eigenvalues))
        residual = energy - 2 * float(weights @ projected) + float(eigenvalues @ weights**2)
        before = np.array([alpha, beta])
        alpha = gamma / max(float(weights @ weights), gamma / (scale * LARGEST_RATIO))
        # n - gamma, without the cancellation where there are fewer targets than weights
        free = float(np.sum(alpha / (alpha + beta * eigenvalues[-n:]))) + max(n - len(eigenvalues), 0)
        beta = free / max(residual, free / largest_beta)
        if np.all(np.abs(np.log(before / [alpha, beta])) < TOLERANCE):
            break
    covariance = (vectors / (alpha + beta * eigenvalues)) @ vectors.T
    mean = vectors @ (beta / (alpha + beta * eigenvalues) * projected)
    return WeightPosterior(mean, (covariance + covariance.T) / 2, alpha, beta)


def log_evidence(features: FloatArray, targets: FloatArray, alpha: float, beta: float) -> float:
    """ln p(targets | alpha, beta), nats: what `regress_weights` maximises. Source: Bishop, equation 3.86."""
    n, n_weights = features.shape
    precision = alpha * np.eye(n_weights) + beta * features.T @ features
    weights = beta * np.linalg.solve(precision, features.T @ targets)
    misfit = beta / 2 * np.sum((targets - features @ weights) ** 2) + alpha / 2 * weights @ weights
    log_determinant = np.linalg.slogdet(precision)[1]
    return float((n_weights * np.log(alpha) + n * np.log(beta) - n * np.log(2 * np.pi) - log_determinant) / 2 - misfit)
