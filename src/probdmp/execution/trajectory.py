"""Trajectories with their uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from probdmp.checks import BoolArray, FloatArray, freeze_arrays
from probdmp.dmp import Primitive
from probdmp.dmp.transformation_system import ACCELERATION, POSITION, VELOCITY
from probdmp.execution.sensor_array import SensorArray
from probdmp.execution.sensor_reports import SensorTrack, sensor_tracks

__all__ = ["HALF_BAND", "GaussianChannel", "GaussianTrajectory", "TrackedTrajectory", "channels_of"]

HALF_BAND = 1.96
"""Standard deviations on either side of the mean that hold 95 % of a Gaussian."""


@dataclass(frozen=True, slots=True, eq=False)
class GaussianChannel:
    """A Gaussian over the value of a sensor channel at each time."""

    means: FloatArray
    """(T,) array, units of the channel."""
    stds: FloatArray
    """(T,) array, units of the channel."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def channels_of(primitive: Primitive, means: FloatArray, covariances: FloatArray) -> dict[str, GaussianChannel]:
    """The channels, by name, from the states of all signals, (T, S, 3) and (T, S, 3, 3)."""
    d = primitive.n_dof
    values, variances = means[:, d:, POSITION], covariances[:, d:, POSITION, POSITION]
    return {
        name: GaussianChannel(values[:, i].copy(), np.sqrt(np.maximum(variances[:, i], 0.0)))
        for i, name in enumerate(primitive.channel_names)
    }


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
    channels: Mapping[str, GaussianChannel] = field(default_factory=dict, kw_only=True)
    """What is expected of sensor channels that were learned with the movement, by name."""

    def __post_init__(self) -> None:
        freeze_arrays(self)
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))

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
    """What the Kalman filter says about a recorded execution; means and covariances are those after each update.

    Outputs are what the sensors measure, O numbers: the positions of the degrees of freedom, and the learned channels, unless
    other sensors were given.
    """

    log_likelihoods: FloatArray
    """(T,) array, nats: density of what was seen and believed at each step given the past; 0 where nothing was."""
    contributions: FloatArray
    """(T, O) array, nats: the share of each output in the log-likelihood."""
    innovations: FloatArray
    """(T, O) array, units of the outputs: measured minus predicted; NaN where not seen."""
    innovation_covariances: FloatArray
    """(T, O, O) array, units of the outputs multiplied: covariance of the innovations, seen or not."""
    fused: BoolArray
    """(T, O) array: what was seen and believed."""
    array: SensorArray
    """The sensors."""

    @property
    def innovation_variances(self) -> FloatArray:
        """(T, O) array, units of the outputs squared."""
        return np.diagonal(self.innovation_covariances, axis1=-2, axis2=-1)

    @property
    def outputs(self) -> tuple[str, ...]:
        """(O) names of the outputs."""
        return self.array.outputs

    @property
    def sensors(self) -> dict[str, SensorTrack]:
        """By name of each sensor: its innovations, how surprising they were, what was rejected."""
        return sensor_tracks(self.array, self.innovations, self.innovation_covariances, self.fused)
