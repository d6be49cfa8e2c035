"""Probabilistic movement primitive: Mahalanobis distance from the learned distribution of trajectories.

    w ~ N(mu, Sigma),  y(t) = Phi(t)^T w + noise

conditioned on the commanded start, and on the goal where one is commanded. The statistic is the distance of the position at
the phase, and of displacements over the last few per cent of the movement.
Source: Paraschos, Daniel, Peters & Neumann, Autonomous Robots 42 (2018); learned by the package `movement_primitives`.
"""

from collections.abc import Sequence

import numpy as np
from movement_primitives.promp import ProMP

from baselines.alignment import Path, displacements
from baselines.array_types import FloatArray
from baselines.method import GridMethod, extended

__all__ = ["MovementPrimitiveDistance"]

N_ITERATIONS = 50


class MovementPrimitiveDistance(GridMethod):
    """Distance from a ProMP."""

    def __init__(self, n_weights: int = 12, floor: float = 0.02, shrinkage: float = 0.3, lags: Sequence[int] = (5,)) -> None:
        """
        Parameters
        ----------
        n_weights : basis functions per degree of freedom.
        floor : standard deviation of measured positions that is added to the primitive's, extents.
        shrinkage : weight of a multiple of the identity in the covariance of the weights, which ten demonstrations do not
            determine.
        lags : displacements over so many per cent of the duration are judged beside the position; none: position alone.
        """
        self.n_weights, self.floor, self.shrinkage, self.lags = n_weights, floor, shrinkage, tuple(lags)

    def fit_paths(self, paths: Sequence[Path]) -> None:
        positions = extended([path.position for path in paths])
        self.times = np.linspace(0, 1, positions.shape[1])
        self.promp = ProMP(positions.shape[2], self.n_weights)
        self.promp.imitate([self.times] * len(positions), list(positions), n_iter=N_ITERATIONS)
        covariance, share = self.promp.weight_cov, self.shrinkage
        shrunk = (1 - share) * covariance + share * np.trace(covariance) / len(covariance) * np.eye(len(covariance))
        self.promp.from_weight_distribution(self.promp.weight_mean, shrunk)

    def trace_path(self, path: Path) -> FloatArray:
        n_dof = path.position.shape[1]
        noise = self.floor**2 * np.eye(n_dof)
        promp = self.promp.condition_position(np.zeros(n_dof), noise, t=0)
        if path.to_goal.shape[1]:
            promp = promp.condition_position(path.position[0] - path.to_goal[0], noise, t=1)
        n = len(self.times)
        mean = promp.mean_trajectory(self.times)
        covariance = promp.cov_trajectory(self.times).reshape(n_dof, n, n_dof, n).transpose(1, 3, 0, 2)
        now = np.minimum(np.arange(len(path.position)), n - 1)
        channels = [_distances(path.position - mean[now], covariance[now, now] + noise)]
        for lag in self.lags:
            past = np.minimum(np.maximum(np.arange(len(path.position)) - lag, 0), n - 1)
            change = covariance[now, now] + covariance[past, past] - covariance[now, past] - covariance[past, now]
            moved = displacements(path.position, lag) - (mean[now] - mean[past])
            channels.append(_distances(moved, change + 2 * noise))
        return np.column_stack(channels)


def _distances(deviations: FloatArray, covariances: FloatArray) -> FloatArray:
    """Mahalanobis distances; (N, D) and (N, D, D) arrays to (N,) array."""
    whitened = np.linalg.solve(covariances, deviations[..., None])[..., 0]
    return np.sqrt(np.einsum("nd,nd->n", deviations, whitened))
