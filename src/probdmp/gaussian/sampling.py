"""Draws from the model: the initial state, then one uncertain input per step, then the sensors."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian.model import LinearGaussianModel

__all__ = ["sample_sequences"]


def _draw(rng: "np.random.Generator", covariance: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Zero-mean Gaussian draws of the given shape; semi-definite covariances are fine."""
    eigenvalues, eigenvectors = np.linalg.eigh(covariance)
    scaled = rng.standard_normal(shape) * np.sqrt(np.maximum(eigenvalues, 0))
    return np.matmul(eigenvectors, scaled[..., None])[..., 0]


def sample_sequences(model: LinearGaussianModel, n_samples: int, rng: "np.random.Generator") -> tuple[FloatArray, FloatArray]:
    """Draw whole sequences.

    Returns
    -------
    states : (n_samples, T, *batch, n) array.
    observations : (n_samples, T, *batch, O) array, the states seen through the sensors with their noise.
    """
    batch, n_states = model.batch_shape, model.transition.shape[-1]
    n_inputs, (inputs, input_covariances) = model.input_matrix.shape[-1], model.timed_inputs()
    a, b, c = model.transition, model.input_matrix, model.observation_matrix
    noise = _draw(rng, input_covariances, (n_samples, model.n_steps - 1, *batch, n_inputs))
    states = np.empty((n_samples, model.n_steps, *batch, n_states))
    states[:, 0] = model.initial_mean + _draw(rng, model.initial_covariance, (n_samples, *batch, n_states))
    for t in range(1, model.n_steps):  # u[t-1] drives s[t-1] to s[t]
        driven = np.matmul(b, (inputs[t - 1] + noise[:, t - 1])[..., None])
        states[:, t] = (np.matmul(a, states[:, t - 1][..., None]) + driven)[..., 0]
    sensed = np.matmul(c, states[..., None])[..., 0]
    return states, sensed + _draw(rng, model.observation_covariance, sensed.shape)
