"""What is known about the path of an execution before it begins: a Gaussian over displacements at every tick.

    y(s) = (p(s) - p(0)) / range,    y ~ N(m, Sigma),    Sigma = H Sigma_theta H^T from the variation between demonstrations

Where the goal is told, the Gaussian is conditioned on ending there: the shape changes as the demonstrations say it does.
Where it is not, neither is the duration: that executions are slower or faster adds d^2 (s m'(s)) (s m'(s))^T, d the standard
deviation of log durations. Each sample, the first one included, may be off its time by c ticks, which moves it by c m'.
Channels that were learned with the movement stand beside the displacements as they are. All are in units of their range, so
nothing here has a unit.
"""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.profile import ExecutionProfile
from probdmp.dmp import Primitive, path_distribution

__all__ = ["PathModel", "path_model"]

NOISE_FLOOR = 0.01
"""Standard deviation of what a path is measured with at the least, as a fraction of the range."""
CLOCK_STD = 0.3
"""c, ticks, at the least: standard deviation of the time at which a sample was really taken."""
CLOCK_SHARE = 12**-0.5
"""And this share of the time between samples: a sample may have been taken at any moment of its own step."""


@dataclass(frozen=True, slots=True, eq=False)
class PathModel:
    """Displacements from the start, and channels, on M = TICKS + 1 phases, as fractions of their range: S signals."""

    means: FloatArray
    """m, (M, S) array, before a goal is told."""
    covariance: FloatArray
    """Sigma, (M, S, M, S) array; with a known goal, given that goal."""
    goal_gains: FloatArray
    """(M, S, D) array: how a goal moves the mean; zero where the goal is not told."""
    noise_variances: FloatArray
    """R, (S,) array."""

    def ahead(self, goals: FloatArray) -> FloatArray:
        """How far goals (n, D), as displacements, lie from the mean one, (n, D) array; 0 where not told."""
        return np.nan_to_num(goals - self.means[-1, : goals.shape[-1]])

    def means_for(self, goals: FloatArray) -> FloatArray:
        """Mean paths of executions with goals (n, D), as displacements; NaN where not told. (n, M, S) array."""
        return np.asarray(self.means + np.einsum("mde,ne->nmd", self.goal_gains, self.ahead(goals)))

    def means_at(self, ticks: IntArray, goals: FloatArray) -> FloatArray:
        """The same at ticks (n, P) of each execution alone: (n, P, S) array."""
        return np.asarray(self.means[ticks] + np.matmul(self.goal_gains[ticks], self.ahead(goals)[:, None, :, None])[..., 0])

    def of_movement(self) -> "PathModel":
        """Without the channels."""
        d = self.goal_gains.shape[-1]
        covariance = np.ascontiguousarray(self.covariance[:, :d, :, :d])
        return PathModel(self.means[:, :d], covariance, self.goal_gains[:, :d], self.noise_variances[:d])


def path_model(primitive: Primitive, profile: ExecutionProfile, knows_goal: bool) -> PathModel:
    """The Gaussian over paths of a primitive that was learned with its variation.

    Parameters
    ----------
    profile : what the demonstrations showed beside the path: noise, and how much slower or faster executions are.
    knows_goal : whether executions are told their goal and duration.
    """
    path = path_distribution(primitive, TICKS + 1)
    ranges, d = primitive.signals.ranges, primitive.n_dof
    means = path.means / ranges
    covariance = path.covariance / np.multiply.outer(ranges, ranges)[:, None, :]
    noise = (profile.noise_stds / ranges) ** 2 + NOISE_FLOOR**2
    gains = np.zeros((*means.shape, d))
    if knows_goal:
        ending = covariance[:, :, -1, :d]  # (M, S, D): with the end
        gains = ending @ np.linalg.inv(ending[-1, :d] + np.diag(noise[:d]))
        covariance = covariance - np.einsum("mde,nfe->mdnf", gains, ending)
    else:
        phases = np.linspace(0.0, 1.0, TICKS + 1)
        stretch = profile.tempo_std * phases[:, None] * np.gradient(means, phases, axis=0)
        covariance = covariance + np.multiply.outer(stretch, stretch)
    clock = max(CLOCK_STD, CLOCK_SHARE * TICKS * primitive.phase_step)
    return PathModel(means, covariance + _clock_covariance(means, clock, d), gains, noise)


def _clock_covariance(means: FloatArray, clock: float, n_dof: int) -> FloatArray:
    """What uncertain times of samples add, (M, S, M, S); displacements count from the first, so its error is in all others."""
    moved = clock * np.gradient(means, axis=0)
    covariance = np.zeros((*means.shape, *means.shape))
    first = np.where(np.arange(means.shape[1]) < n_dof, moved[0], 0.0)
    covariance[1:, :, 1:, :] = np.multiply.outer(first, first)[None, :, None, :]
    ticks = np.arange(1, len(means))
    covariance[ticks, :, ticks, :] += moved[1:, :, None] * moved[1:, None, :]
    return covariance
