"""Trajectories with their uncertainty."""

from dataclasses import dataclass

import numpy as np

from probdmp.checks import FloatArray, freeze_arrays
from probdmp.dmp.transformation_system import ACCELERATION, POSITION, VELOCITY

__all__ = ["HALF_BAND", "GaussianTrajectory", "TrackedTrajectory"]

HALF_BAND = 1.96
"""Standard deviations on either side of the mean that hold 95 % of a Gaussian."""


@dataclass(frozen=True, slots=True, eq=False)
class GaussianTrajectory:
    """A Gaussian over acceleration, velocity and position at each time, of each degree of freedom by itself."""

    times: FloatArray
    """(T,) array, seconds from the start."""
    means: FloatArray
    """(T, D, 3) array: acceleration, velocity, position in data units and seconds."""
    covariances: FloatArray
    """(T, D, 3, 3) array."""
    names: tuple[str, ...]
    """(D) names of the degrees of freedom."""
    units: str
    """Unit of the positions, free text."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def positions(self) -> FloatArray:
        """(T, D) array, data units."""
        return self.means[..., POSITION]

    @property
    def velocities(self) -> FloatArray:
        """(T, D) array, data units per second."""
        return self.means[..., VELOCITY]

    @property
    def accelerations(self) -> FloatArray:
        """(T, D) array, data units per second squared."""
        return self.means[..., ACCELERATION]

    @property
    def position_stds(self) -> FloatArray:
        """(T, D) array, data units."""
        return self._stds(POSITION)

    @property
    def velocity_stds(self) -> FloatArray:
        """(T, D) array, data units per second."""
        return self._stds(VELOCITY)

    @property
    def acceleration_stds(self) -> FloatArray:
        """(T, D) array, data units per second squared; it grows as 1 / sqrt(dt)."""
        return self._stds(ACCELERATION)

    def _stds(self, row: int) -> FloatArray:
        return np.sqrt(np.maximum(self.covariances[..., row, row], 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class TrackedTrajectory(GaussianTrajectory):
    """What the Kalman filter says about a recorded execution; means and covariances are those after each update."""

    log_likelihoods: FloatArray
    """(T,) array, nats: density of what was seen at each step given the past; 0 where nothing was."""
    contributions: FloatArray
    """(T, D) array, nats: the share of each degree of freedom in the log-likelihood."""
    innovations: FloatArray
    """(T, D) array, data units: measured minus predicted; NaN where not seen."""
    innovation_variances: FloatArray
    """(T, D) array, data units squared: variance of the innovations, seen or not."""

    @property
    def innovation_covariances(self) -> FloatArray:
        """(T, D, D) array, data units squared: diagonal; with joint weights, what degrees of freedom share is left out."""
        return self.innovation_variances[..., None] * np.eye(len(self.names))
