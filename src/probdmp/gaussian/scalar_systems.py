"""Systems with one input and one sensor, which the kernels filter: a degree of freedom whose position is measured.

A `LinearGaussianModel` with batch axes is as many such systems as its batch has entries; here they have one axis.
"""

import math
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian import kernels
from probdmp.gaussian.model import LinearGaussianModel

__all__ = ["FilteredSystems", "ScalarSystems", "filter_scalar_systems", "is_scalar", "scalar_systems"]


class ScalarSystems(NamedTuple):
    """M independent systems of n states."""

    transition: FloatArray
    """A, (M, n, n) array."""
    input_vector: FloatArray
    """b, (M, n) array."""
    drifts: FloatArray
    """b times the mean input, (T-1, M, n) array."""
    input_variances: FloatArray
    """u, (T-1, M) array."""
    sensor: FloatArray
    """c, (M, n) array."""
    noise: FloatArray
    """r, (M,) array."""
    initial_mean: FloatArray
    """(M, n) array."""
    initial_covariance: FloatArray
    """(M, n, n) array."""


class FilteredSystems(NamedTuple):
    """What the Kalman filter says of M systems over T times."""

    means: FloatArray
    """(T, M, n) array: after each update."""
    covariances: FloatArray
    """(T, M, n, n) array: after each update."""
    innovations: FloatArray
    """e, (T, M) array; NaN where nothing was observed."""
    variances: FloatArray
    """S, (T, M) array, whether or not."""
    log_likelihoods: FloatArray
    """(T, M) array, nats; 0 where nothing was observed."""
    gains: FloatArray
    """K, (T, M, n) array; 0 where nothing was observed."""


def is_scalar(model: LinearGaussianModel) -> bool:
    """Whether a model is one of such systems."""
    n_sensors, n_states = model.observation_matrix.shape[-2:]
    return n_sensors == 1 and model.input_matrix.shape[-1] == 1 and n_states <= kernels.MOST_STATES


def scalar_systems(model: LinearGaussianModel) -> ScalarSystems:
    """The systems of a model, its batch axes flattened."""
    batch, n = model.batch_shape, model.transition.shape[-1]
    inputs, input_covariances = model.timed_inputs()
    steps, count = model.n_steps - 1, math.prod(batch)

    def of_systems(array: FloatArray, *core: int) -> FloatArray:
        return np.ascontiguousarray(np.broadcast_to(array, (*batch, *core))).reshape(count, *core)

    def timed(array: FloatArray, *core: int) -> FloatArray:
        return np.ascontiguousarray(np.broadcast_to(array, (steps, *batch, *core))).reshape(steps, count, *core)

    return ScalarSystems(
        of_systems(model.transition, n, n),
        of_systems(model.input_matrix[..., 0], n),
        timed(model.input_matrix[..., 0] * inputs, n),
        timed(input_covariances[..., 0, 0]),
        of_systems(model.observation_matrix[..., 0, :], n),
        of_systems(model.observation_covariance[..., 0, 0]),
        of_systems(model.initial_mean, n),
        of_systems(model.initial_covariance, n, n),
    )


def filter_scalar_systems(systems: ScalarSystems, observations: FloatArray) -> FilteredSystems:
    """Kalman filter of observations (T, M), NaN where there are none."""
    t, (m, n) = len(observations), systems.sensor.shape
    found = FilteredSystems(
        np.empty((t, m, n)), np.empty((t, m, n, n)), np.empty((t, m)), np.empty((t, m)), np.empty((t, m)), np.empty((t, m, n))
    )
    kernels.filter_systems(*systems, np.ascontiguousarray(observations), *found)
    return found
