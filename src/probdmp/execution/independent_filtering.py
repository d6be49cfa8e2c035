"""The paper's Kalman filter, of sensors of any kind: each degree of freedom by itself, or all of them as one system.

Where a sensor sees several degrees of freedom they are one system of 3 D states; what follows here is the same for both.
"""

from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.execution.joint_filtering import FilteredRecordings
from probdmp.execution.sensor_array import SensorArray, Values
from probdmp.gaussian import (
    AffineObservation,
    FilteredSequence,
    GaussianSequence,
    LinearGaussianModel,
    block_diagonal,
    couple_systems,
    filter_sequence,
    output_shares,
)
from probdmp.gaussian.smoothing import smooth_filtered

__all__ = ["filter_independent", "look_through", "of_each_dof", "sensed_system", "smooth_all_independent", "smooth_independent"]


def sensed_system(model: LinearGaussianModel, array: SensorArray) -> LinearGaussianModel:
    """A model with batch axes (*batch, D) as the sensors see it: with the same axes, or (*batch) if they couple its systems."""
    if array.is_coupled:
        return couple_systems(model, array.matrix[0], array.noise[0])
    return replace(model, observation_matrix=array.matrix, observation_covariance=array.noise)


def look_through(array: SensorArray, observation: FloatArray, mean: FloatArray, covariance: FloatArray) -> AffineObservation:
    """What an observation (*batch, O) says of the states of a sensed system, of the given mean and covariance."""

    def predicted() -> tuple[FloatArray, FloatArray]:
        if array.is_coupled:
            return mean, covariance
        return mean.reshape(*mean.shape[:-2], -1), block_diagonal(covariance)

    seen = array.look(observation, predicted)
    if not array.is_coupled:
        return seen
    believed = seen.believed if isinstance(seen.believed, bool) else seen.believed[..., 0, :]
    return AffineObservation(seen.values[..., 0, :], seen.matrix[..., 0, :, :], seen.covariance[..., 0, :, :], believed)


def of_each_dof(array: SensorArray, mean: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Moments of a sensed system by degree of freedom, (*batch, D, 3) and (*batch, D, 3, 3)."""
    if not array.is_coupled:
        return mean, covariance
    *batch, size = mean.shape
    n_dof, own = size // 3, np.arange(size // 3)
    blocks = covariance.reshape(*batch, n_dof, 3, n_dof, 3)[..., own, :, own, :]
    return mean.reshape(*batch, n_dof, 3), np.moveaxis(blocks, 0, -3)


def filter_independent(model: LinearGaussianModel, observed: FloatArray, array: SensorArray) -> FilteredRecordings:
    """Take in recordings, (T, N, O), NaN where nothing was measured, through a model with batch axes (N, D)."""
    forward = _forward(sensed_system(model, array), observed, array)

    def of_outputs(by_group: Values) -> Values:
        return by_group if array.is_coupled else array.flat(by_group.reshape(*by_group.shape[:-2], -1))

    innovations, covariances = of_outputs(forward.innovations), forward.innovation_covariances
    if not array.is_coupled:
        covariances = array.flat_covariances(block_diagonal(covariances))
    fused = of_outputs(forward.fused)
    if array.is_plain and not array.is_coupled:
        shares = forward.log_likelihoods
    else:
        shares = output_shares(np.where(fused, innovations, np.nan), covariances)
    filtered = GaussianSequence(*of_each_dof(array, *forward.filtered))
    return FilteredRecordings(filtered, innovations, covariances, fused, shares)


def smooth_independent(model: LinearGaussianModel, observed: FloatArray, array: SensorArray) -> GaussianSequence:
    """All states given all of the recordings, (T, N, O): (T, N, D, 3) and (T, N, D, 3, 3)."""
    system = sensed_system(model, array)
    return GaussianSequence(*of_each_dof(array, *smooth_filtered(system, _forward(system, observed, array))))


def smooth_all_independent(
    model: LinearGaussianModel, observed: FloatArray, array: SensorArray
) -> tuple[float, FloatArray, FloatArray]:
    """Log-likelihood of all recordings, nats, and moments of the states of all degrees of freedom together given all of each.

    Returns
    -------
    The means are (T, N, 3 D), the covariances (T, N, 3 D, 3 D).
    """
    system = sensed_system(model, array)
    forward = _forward(system, observed, array)
    means, covariances = smooth_filtered(system, forward)
    if not array.is_coupled:
        means, covariances = means.reshape(*means.shape[:-2], -1), block_diagonal(covariances)
    return float(forward.log_likelihoods.sum()), means, covariances


def _forward(system: LinearGaussianModel, observed: FloatArray, array: SensorArray) -> FilteredSequence:
    def look(mean: FloatArray, covariance: FloatArray, by_group: FloatArray) -> AffineObservation:
        observation = by_group if array.is_coupled else array.flat(by_group.reshape(*by_group.shape[:-2], -1))
        return look_through(array, observation, mean, covariance)

    grouped = observed if array.is_coupled else array.grouped(observed)
    if array.is_adaptive:
        return filter_sequence(system, grouped, look)
    silent = array.silent if array.is_coupled else array.grouped(np.where(array.silent, 1.0, 0.0)) == 1.0
    return filter_sequence(system, np.where(silent, np.nan, grouped))
