"""What is believed about the variation between demonstrations before any was seen: Sigma_0, block by block.

    weights          variance proportional to 1 / c_i^2, c_i the centre of the basis function in x; independent
    goal             and start velocity: independent; of channels also the start
    tempo            the mean movement m(s) run through at an uneven pace: y(s) = m(s + delta(s)), so that y - m is about
                     m'(s) delta(s), delta a Gaussian process that vanishes at both ends; it couples everything

Each of the first ones, pushed through the responses H, is scaled to a given share of the mean square by which
demonstrations differ along the path, v. So the prior has no unit. The tempo term is brought into the space of the weights
by least squares, with the weights' prior as the ridge.
"""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.basis import basis_centers
from probdmp.dmp.responses import GOAL, START_VELOCITY

__all__ = ["prior_covariance"]

WEIGHT_SHARE = 0.6
GOAL_SHARE = 0.1
VELOCITY_SHARE = 0.01
START_SHARE = 0.3
"""Of channels; movements are seen from their start."""
TEMPO_STD = 0.025
"""Standard deviation of delta in the middle of the movement, as a fraction of its duration."""
TEMPO_SCALE = 0.1
"""Over which fraction of the duration the pace is uneven in one way."""
RIDGE = 1e-4
"""Of the projection of the tempo term, as a fraction of v."""


def prior_covariance(
    responses: FloatArray, mean_path: FloatArray, path_variances: FloatArray, n_channels: int = 0
) -> FloatArray:
    """Sigma_0 of the parameters of all signals.

    Parameters
    ----------
    responses : H, (M, N + 2) array, of the position on M phases evenly spaced from 0 to 1.
    mean_path : m, (M, S) array, units of each signal.
    path_variances : v, (S,) array, units squared.
    n_channels : F, how many of the signals, the last ones, are channels.

    Returns
    -------
    (S (N + 2), S (N + 2)) array, units of the signals multiplied; with channels (S (N + 3), S (N + 3)), the start first.
    """
    n_parameters, n_signals = responses.shape[1], len(path_variances)
    shares = np.append([VELOCITY_SHARE, GOAL_SHARE], WEIGHT_SHARE * np.ones(n_parameters - 2))
    shapes = np.append([1.0, 1.0], basis_centers(n_parameters - 2) ** -2.0)
    powers = shapes * np.mean(responses**2, axis=0)
    total = np.append(powers[[START_VELOCITY, GOAL]], np.full(n_parameters - 2, powers[2:].sum()))
    unit = shares * shapes / total
    projection = _projection(responses, unit)
    variances = np.tile(unit, (n_signals, 1))
    if n_channels:
        starts = np.where(np.arange(n_signals) < n_signals - n_channels, 0.0, START_SHARE)
        variances = np.concatenate([starts[:, None], variances], axis=1)
        projection = np.concatenate([np.zeros((1, len(responses))), projection])
    covariance = np.diag((path_variances[:, None] * variances).ravel())
    tangent = np.gradient(mean_path, 1 / (len(responses) - 1), axis=0)
    lifted = np.concatenate([projection * tangent[:, d] for d in range(n_signals)])
    tempo = TEMPO_STD**2 * lifted @ _tempo_kernel(len(responses)) @ lifted.T
    return np.asarray(covariance + (tempo + tempo.T) / 2)


def _projection(responses: FloatArray, unit: FloatArray) -> FloatArray:
    """From a path, (M,), to the start velocity and weights that make it, (N + 2, M); the goal stays."""
    spread = responses * np.where(np.arange(len(unit)) == GOAL, 0.0, unit)
    return np.asarray(np.linalg.solve(responses @ spread.T + RIDGE * np.eye(len(responses)), spread).T)


def _tempo_kernel(n_phases: int) -> FloatArray:
    """Covariance of delta / its standard deviation: smooth, and zero at both ends of the movement; (M, M) array."""
    s = np.linspace(0.0, 1.0, n_phases)
    kernel = np.exp(-((s[:, None] - s) ** 2) / (2 * TEMPO_SCALE**2))
    ends = kernel[:, [0, -1]]
    return np.asarray(kernel - ends @ np.linalg.solve(ends[[0, -1]], ends.T))
