"""The Gaussian over whole paths that a Gaussian over theta makes."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.primitive import Primitive
from probdmp.dmp.responses import GOAL, START_VELOCITY, WEIGHTS, parameter_responses
from probdmp.dmp.transformation_system import POSITION
from probdmp.dmp.variation import PathDistribution

__all__ = ["parameter_distribution", "parameter_factor", "path_distribution", "signal_distribution", "signal_factors"]

ROUNDING = 1e-15
"""Directions with less of the variance than this times their number are none."""


def parameter_distribution(primitive: Primitive) -> tuple[FloatArray, FloatArray]:
    """Mean (D (N + 2)) and covariance (D (N + 2), D (N + 2)) of theta, data units, for a new execution.

    As learned, if the primitive has a `Variation`. Pooled weights know nothing of executions that differ: then theta is as
    uncertain as the mean movement, with a known goal, and degrees of freedom are independent.
    """
    if primitive.variation is not None:
        return primitive.variation.means.ravel(), primitive.variation.covariance
    d, n = primitive.n_dof, primitive.configuration.n_basis + 2
    means, covariance = np.empty((d, n)), np.zeros((d, n, d, n))
    means[:, START_VELOCITY] = primitive.start_velocities
    means[:, GOAL] = primitive.goal - primitive.start
    means[:, WEIGHTS] = primitive.weight_means
    own = np.arange(d)
    covariance[own, START_VELOCITY, own, START_VELOCITY] = primitive.start_covariances[:, 0, 0]
    covariance[own, WEIGHTS, own, WEIGHTS] = primitive.weight_covariances
    return means.ravel(), covariance.reshape(d * n, d * n)


def signal_distribution(primitive: Primitive) -> tuple[FloatArray, FloatArray]:
    """Mean (S, N + 3) and covariance (S (N + 3), S (N + 3)) of (start, theta) of all signals, movements seen from their start.

    So the start of a degree of freedom is zero, and known; that of a channel is where its sensor begins.
    """
    mean, covariance = parameter_distribution(primitive)
    d, n, channels = primitive.n_dof, primitive.configuration.n_basis + 3, primitive.channels
    lifted = np.delete(np.arange(d * n), np.arange(d) * n)  # where theta is in x
    means, size = np.zeros(d * n), (d + len(primitive.channel_names)) * n
    means[lifted] = mean
    full = np.zeros((size, size))
    full[np.ix_(lifted, lifted)] = covariance
    if channels is not None:
        means = np.concatenate([means, channels.means.ravel()])
        full[d * n :, d * n :] = channels.covariance
        full[d * n :, lifted] = channels.cross_covariance
        full[lifted, d * n :] = channels.cross_covariance.T
    return means.reshape(-1, n), full


def parameter_factor(covariance: FloatArray) -> FloatArray:
    """F with F F^T = covariance, (n, r), r no larger than its rank; parameters may be of very different size."""
    stds = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    stds = np.where(stds > 0, stds, 1.0)
    eigenvalues, vectors = np.linalg.eigh(covariance / stds / stds[:, None])
    kept = eigenvalues > ROUNDING * len(covariance) * max(float(eigenvalues[-1]), 0.0)
    return np.asarray(stds[:, None] * vectors[:, kept] * np.sqrt(eigenvalues[kept]))


def signal_factors(covariance: FloatArray, n_signals: int) -> tuple[FloatArray, FloatArray]:
    """x[s] = F[s] z[s], z of unit variances, of which each signal has its own: F (S, n, W) and the covariance of z (S W, S W).

    Of the factor of all parameters each signal has the rows F[s] V[s], by singular values; z[s] = V[s] z, so z has covariance
    V V^T, without a division by what is small.
    """
    stds = np.sqrt(np.maximum(np.diagonal(covariance), 0.0)).reshape(n_signals, -1)
    stds = np.where(stds > 0, stds, 1.0)
    scaled = parameter_factor(covariance).reshape(*stds.shape, -1) / stds[..., None]
    left, values, right = np.linalg.svd(scaled, full_matrices=False)
    width = int(np.sum(values**2 > ROUNDING * len(covariance) * np.max(values, initial=0.0) ** 2, axis=-1).max())
    shown = np.concatenate(right[:, :width])
    return stds[..., None] * left[..., :width] * values[:, None, :width], shown @ shown.T


def path_distribution(primitive: Primitive, n_phases: int) -> PathDistribution:
    """All signals of a new execution on n_phases phases s evenly spaced from 0 to 1.

    Of the degrees of freedom it is the displacement from the start, y(s) = p(s) - p0; of channels their value.
    """
    mean, covariance = signal_distribution(primitive)
    responses = parameter_responses(primitive.configuration, 1 / (n_phases - 1), n_phases)[:, POSITION]
    designs = np.concatenate([np.ones((n_phases, 1)), responses], axis=1)
    n_signals, n = mean.shape
    half = np.einsum("mi,diej->mdej", designs, covariance.reshape(n_signals, n, n_signals, n))
    full = half @ designs.T  # (M, S, S, M)
    return PathDistribution(designs @ mean.T, np.moveaxis(full, -1, 2))
