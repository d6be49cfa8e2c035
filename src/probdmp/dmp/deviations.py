"""What the parameters of an execution leave over is a movement too.

The forcing term of an execution is f[t] = phi[t]^T w + eps[t]: its own weights, constant and unknown, and what N basis
functions cannot say, white noise eps ~ N(0, 1 / beta). The system is linear, so eps adds a deviation to the path of theta,

    p[t] = p0 + H[t] theta + d[t],    d[t] = A d[t-1] + B eps[t-1],   d[0] = 0

with A and B of the transformation system: a robot that was pushed deviates, and comes back as the spring and damper tell it to.
beta belongs to the phase step of the training data and is corrected for another one as in `probdmp.dmp.state_space`, so the
bands of position and velocity hardly depend on the control rate; that of the acceleration grows as 1 / sqrt(dt).
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.primitive import Primitive
from probdmp.dmp.transformation_system import DISCRETIZATIONS
from probdmp.gaussian import block_diagonal

__all__ = ["DeviationSystem", "deviation_system", "lasting_variances"]


class DeviationSystem(NamedTuple):
    """How the deviations of all signals move, each independently of the others."""

    transition: FloatArray
    """A, (*batch, 1, 3, 3)."""
    input_vector: FloatArray
    """B, (*batch, 1, 3)."""
    variances: FloatArray
    """Of eps, (*batch, S) array, units of the signal squared."""

    @property
    def noise(self) -> FloatArray:
        """Q = B var(eps) B^T, (*batch, S, 3, 3)."""
        b = self.input_vector
        return np.asarray(self.variances[..., None, None] * b[..., :, None] * b[..., None, :])

    def driven(self, n_steps: int) -> FloatArray:
        """Covariances of a deviation that unit noise drives, (T, *batch, 3, 3) array: sums of A^j B B^T A^jT."""
        transition, moved = self.transition[..., 0, :, :], self.input_vector[..., 0, :]
        covariances = np.zeros((n_steps, *transition.shape))
        for t in range(1, n_steps):
            covariances[t] = moved[..., :, None] * moved[..., None, :]
            moved = np.matmul(transition, moved[..., None])[..., 0]
        return np.cumsum(covariances, axis=0)

    def grouped(self, are_coupled: bool) -> tuple[FloatArray, FloatArray]:
        """A and Q of the groups of states that are filtered together, (*batch, G, n, n): of each signal, or of all at once."""
        if not are_coupled:
            return self.transition, self.noise
        noise = self.noise
        transition = block_diagonal(np.broadcast_to(self.transition, noise.shape))
        return transition[..., None, :, :], block_diagonal(noise)[..., None, :, :]


def deviation_system(primitive: Primitive, duration: FloatArray, dt: FloatArray) -> DeviationSystem:
    """The deviations of executions; there are none with `forcing_noise="posterior"`.

    Parameters
    ----------
    duration, dt : (*batch) arrays, seconds.
    """
    configuration = primitive.configuration
    scheme, alpha_z = DISCRETIZATIONS[configuration.discretization], configuration.alpha_z
    system = scheme.step(alpha_z, duration, dt)
    learned = scheme.noise_variance(np.asarray(alpha_z * primitive.phase_step))
    variances = (scheme.noise_variance(alpha_z * dt / duration) / learned)[..., None] / primitive.signals.forcing_precisions
    if configuration.forcing_noise == "posterior":
        variances = np.zeros_like(variances)
    return DeviationSystem(system.transition[..., None, :, :], system.input_vector[..., None, :], variances)


def lasting_variances(primitive: Primitive) -> FloatArray:
    """Variance of the position of a deviation that has gone on for long, about; (S,) array, units of the signal squared.

    Of p'' = -alpha p' - alpha^2 / 4 p + noise of density S, in units of the duration, it is 2 S / alpha^3.
    """
    if primitive.configuration.forcing_noise == "posterior":
        return np.zeros(len(primitive.signals.names))
    return np.asarray(2 * primitive.phase_step / primitive.configuration.alpha_z**3 / primitive.signals.forcing_precisions)
