"""A linear system driven by uncertain inputs and seen through noisy sensors.

    s[t] = A s[t-1] + B (u[t-1] + e[t-1]),   e[t] ~ N(0, U[t])        t = 1 .. T-1
    o[t] = C s[t] + v[t],                    v[t] ~ N(0, R)           t = 0 .. T-1
    s[0] ~ N(m0, V0)

Index convention: u[t-1] and U[t-1] drive s[t-1] to s[t]. There are T states and observations and T-1 inputs; the first
state has no input before it. The process noise is Q[t] = B U[t] B^T: with one input it has rank one, and nothing here
ever inverts it.

Every array may carry leading batch axes, written `*batch`: independent systems that are computed side by side, such as
the degrees of freedom of a robot or the executions of a data set. Time comes first in whatever depends on time.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, check_array
from probdmp.errors import InputError

__all__ = ["GaussianSequence", "LinearGaussianModel"]


class GaussianSequence(NamedTuple):
    """A Gaussian over the state at each time."""

    means: FloatArray
    """(T, *batch, n) array."""
    covariances: FloatArray
    """(T, *batch, n, n) array, symmetric."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearGaussianModel:
    """A controlled linear-Gaussian system; the equations and the index convention are in the module's docstring.

    n is the number of states, m of inputs, O of sensors. Batch axes broadcast against each other.
    """

    transition: FloatArray
    """A, (*batch, n, n)."""
    input_matrix: FloatArray
    """B, (*batch, n, m)."""
    inputs: FloatArray
    """u, (T-1, *batch, m); `inputs[t-1]` drives state t-1 to state t."""
    input_covariances: FloatArray
    """U, (T-1, *batch, m, m), positive semi-definite."""
    observation_matrix: FloatArray
    """C, (*batch, O, n)."""
    observation_covariance: FloatArray
    """R, (*batch, O, O), positive definite."""
    initial_mean: FloatArray
    """m0, (*batch, n)."""
    initial_covariance: FloatArray
    """V0, (*batch, n, n), positive semi-definite; zero for a known start."""

    @property
    def n_steps(self) -> int:
        """T, the number of states: one more than there are inputs."""
        return len(self.inputs) + 1

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """Shape of the batch axes."""
        return np.broadcast_shapes(
            self.transition.shape[:-2],
            self.input_matrix.shape[:-2],
            self.inputs.shape[1:-1],
            self.input_covariances.shape[1:-2],
            self.observation_matrix.shape[:-2],
            self.observation_covariance.shape[:-2],
            self.initial_mean.shape[:-1],
            self.initial_covariance.shape[:-2],
        )

    def timed_inputs(self) -> tuple[FloatArray, FloatArray]:
        """u and U with all batch axes, of length 1 where they have none: (T-1, *batch, m) and (T-1, *batch, m, m)."""
        n_batch = len(self.batch_shape)

        def spread(array: FloatArray, n_core: int) -> FloatArray:
            missing = n_batch + 1 + n_core - array.ndim
            return array.reshape(len(array), *(1,) * missing, *array.shape[1:])

        return spread(self.inputs, 1), spread(self.input_covariances, 2)

    def drifts(self) -> FloatArray:
        """B u[t] for every transition, (T-1, *batch, n)."""
        return np.matmul(self.input_matrix, self.timed_inputs()[0][..., None])[..., 0]

    def process_covariances(self) -> FloatArray:
        """Q[t] = B U[t] B^T for every transition, (T-1, *batch, n, n)."""
        b = self.input_matrix
        return b @ self.timed_inputs()[1] @ b.mT

    def check(self) -> None:
        """Refuse what the filter could only turn into NaN: it divides by R, which must be positive definite.

        Raises
        ------
        InputError
            If a number is not finite, or R is not symmetric and positive definite.
        """
        for field in fields(self):
            if not np.isfinite(getattr(self, field.name)).all():
                raise InputError(f"{field.name} finite", "NaN or infinity in it")
        r = self.observation_covariance
        if np.any(r != r.mT) or np.any(np.linalg.eigvalsh(r) <= 0):
            raise InputError(
                "observation_covariance symmetric and positive definite",
                "one that is not",
                "Give every sensor a variance above zero, if only a tiny one.",
            )

    def check_observations(self, observations: FloatArray | None) -> FloatArray:
        """Observations as a (T, *batch, O) array in which NaN marks what was not seen; nothing was without any."""
        n_sensors = self.observation_matrix.shape[-2]
        shape = (self.n_steps, *self.batch_shape, n_sensors)
        if observations is None:
            return np.full(shape, np.nan)
        hint = f"T = {self.n_steps} times first, then the batch, then {n_sensors} sensors."
        return check_array(observations, "observations", shape, missing=True, hint=hint)
