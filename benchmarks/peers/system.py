"""One degree of freedom as plain arrays, in the manner that every package can be told."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian import LinearGaussianModel

__all__ = ["Score", "Smooth", "Stepper", "System", "systems_of"]

Score = Callable[[], FloatArray]
"""Scores the observations that it was made for: (N,) log-likelihoods, nats."""
Smooth = Callable[[], tuple[FloatArray, FloatArray]]
"""Smooths the observations that it was made for: means (N, T, n) and covariances (T, n, n), or (N, T, n, n)."""


class Stepper(Protocol):
    """Filters one execution of several degrees of freedom, tick by tick."""

    def step(self, observation: FloatArray) -> float:
        """Log-likelihood, nats, of a (D,) observation given the past; the state is then predicted to the next tick."""
        ...


class System(NamedTuple):
    """s[t] = A s[t-1] + d[t-1] + b e[t-1], o[t] = c s[t] + v[t], as in `probdmp.gaussian.model` with scalar e, o and v."""

    transition: FloatArray
    """A, (n, n)."""
    drifts: FloatArray
    """d, (T-1, n)."""
    input_vector: FloatArray
    """b, (n,)."""
    input_variances: FloatArray
    """Variance of e, (T-1,)."""
    observation_row: FloatArray
    """c, (n,)."""
    observation_variance: float
    """Variance of v."""
    initial_mean: FloatArray
    """(n,)."""
    initial_covariance: FloatArray
    """(n, n)."""

    @property
    def process_covariances(self) -> FloatArray:
        """Q[t] = b b^T times the variance of e[t], (T-1, n, n)."""
        return self.input_variances[:, None, None] * np.outer(self.input_vector, self.input_vector)

    @property
    def n_steps(self) -> int:
        """T."""
        return len(self.drifts) + 1


def systems_of(model: LinearGaussianModel) -> list[System]:
    """Each system of a model with batch axes (D), one input and one sensor."""
    (n_dof,) = model.batch_shape
    n = model.transition.shape[-1]
    drifts, variances = model.drifts(), model.timed_inputs()[1]

    def at(array: FloatArray, d: int, *shape: int) -> FloatArray:
        return np.ascontiguousarray(np.broadcast_to(array, (n_dof, *shape))[d])

    return [
        System(
            transition=at(model.transition, d, n, n),
            drifts=np.ascontiguousarray(np.broadcast_to(drifts, (len(drifts), n_dof, n))[:, d]),
            input_vector=at(model.input_matrix, d, n, 1)[:, 0],
            input_variances=np.ascontiguousarray(np.broadcast_to(variances, (len(drifts), n_dof, 1, 1))[:, d, 0, 0]),
            observation_row=at(model.observation_matrix, d, 1, n)[0],
            observation_variance=float(at(model.observation_covariance, d, 1, 1)[0, 0]),
            initial_mean=at(model.initial_mean, d, n),
            initial_covariance=at(model.initial_covariance, d, n, n),
        )
        for d in range(n_dof)
    ]
