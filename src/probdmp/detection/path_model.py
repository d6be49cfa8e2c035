"""What is known about the path of an execution before it begins: a Gaussian over displacements at every tick.

    y(s) = (p(s) - p(0)) / range,    y ~ N(m, Sigma),    Sigma = H Sigma_theta H^T from the variation between demonstrations

Where the goal is told, the Gaussian is conditioned on ending there: the shape changes as the demonstrations say it does.
Where it is not, neither is the duration: that executions are slower or faster adds d^2 (s m'(s)) (s m'(s))^T, d the standard
deviation of log durations. Each sample, the first one included, may be off its time by c ticks, which moves it by c m'.
Positions are in units of each degree of freedom's range, so nothing here has a unit.
"""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray
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
    """Displacements from the start on M = TICKS + 1 phases, as fractions of the range."""

    means: FloatArray
    """m, (M, D) array, before a goal is told."""
    covariance: FloatArray
    """Sigma, (M, D, M, D) array; with a known goal, given that goal."""
    goal_gains: FloatArray
    """(M, D, D) array: how a goal moves the mean; zero where the goal is not told."""
    noise_variances: FloatArray
    """R, (D,) array."""

    def means_for(self, goals: FloatArray) -> FloatArray:
        """Mean paths of executions with goals (n, D), as displacements; NaN where not told. (n, M, D) array."""
        ahead = np.nan_to_num(goals - self.means[-1])
        return np.asarray(self.means + np.einsum("mde,ne->nmd", self.goal_gains, ahead))


def path_model(primitive: Primitive, profile: ExecutionProfile, knows_goal: bool) -> PathModel:
    """The Gaussian over paths of a primitive that was learned with its variation.

    Parameters
    ----------
    profile : what the demonstrations showed beside the path: noise, and how much slower or faster executions are.
    knows_goal : whether executions are told their goal and duration.
    """
    path = path_distribution(primitive, TICKS + 1)
    ranges = primitive.ranges
    means = path.means / ranges
    covariance = path.covariance / np.multiply.outer(ranges, ranges)[:, None, :]
    noise = (profile.noise_stds / ranges) ** 2 + NOISE_FLOOR**2
    gains = np.zeros((*means.shape, len(ranges)))
    if knows_goal:
        ending = covariance[:, :, -1]  # (M, D, D): with the end
        gains = ending @ np.linalg.inv(ending[-1] + np.diag(noise))
        covariance = covariance - np.einsum("mde,nfe->mdnf", gains, ending)
    else:
        phases = np.linspace(0.0, 1.0, TICKS + 1)
        stretch = profile.tempo_std * phases[:, None] * np.gradient(means, phases, axis=0)
        covariance = covariance + np.multiply.outer(stretch, stretch)
    clock = max(CLOCK_STD, CLOCK_SHARE * TICKS * primitive.phase_step)
    return PathModel(means, covariance + _clock_covariance(means, clock), gains, noise)


def _clock_covariance(means: FloatArray, clock: float) -> FloatArray:
    """What uncertain times of samples add, (M, D, M, D); displacements count from the first, so its error is in all others."""
    moved = clock * np.gradient(means, axis=0)
    covariance = np.zeros((*means.shape, *means.shape))
    covariance[1:, :, 1:, :] = np.multiply.outer(moved[0], moved[0])[None, :, None, :]
    ticks = np.arange(1, len(means))
    covariance[ticks, :, ticks, :] += moved[1:, :, None] * moved[1:, None, :]
    return covariance
