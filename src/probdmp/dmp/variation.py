"""How executions of one movement differ from each other: a joint Gaussian over its parameters.

theta = (T_d p'(0), g - p0, w) of every degree of freedom, D (N + 2) numbers, are drawn once per execution:

    theta ~ N(mean, covariance),    y[t] = p[t] - p0 = H[t] theta

The covariance couples degrees of freedom, start velocity, goal and weights. It is that of a new execution: how the
demonstrations differ, and what is not known about their mean.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, check_array, frozen
from probdmp.errors import InputError

__all__ = ["PathDistribution", "Variation", "check_semidefinite"]


class PathDistribution(NamedTuple):
    """A Gaussian over all signals on M phases: displacements from the start, and channels."""

    means: FloatArray
    """(M, S) array, units of each signal."""
    covariance: FloatArray
    """(M, S, M, S) array, units of the signals multiplied, without sensor noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Variation:
    """Mean and covariance of theta for a new execution; arrays are read-only.

    Raises
    ------
    InputError, InputTypeError
        If shapes disagree, a number is not finite, or a variance is negative.
    """

    means: FloatArray
    """(D, N + 2) array, data units: start velocity in phase units, goal minus start, weights."""
    covariance: FloatArray
    """(D (N + 2), D (N + 2)) array, data units squared, positive semi-definite; the order is that of `means.ravel()`."""
    residual_variances: FloatArray
    """(D,) array, data units squared, > 0: of what was recorded around the path that theta gives, sensor noise included."""

    def __post_init__(self) -> None:
        means = frozen(check_array(self.means, "means", ("D", "N + 2")))
        covariance = frozen(check_array(self.covariance, "covariance", (means.size, means.size)))
        residuals = frozen(check_array(self.residual_variances, "residual_variances", (len(means),)))
        check_semidefinite(covariance, "covariance")
        if np.any(residuals <= 0):
            raise InputError("residual_variances > 0", f"{residuals.min():g}")
        for name, value in (("means", means), ("covariance", covariance), ("residual_variances", residuals)):
            object.__setattr__(self, name, value)

    def arrays(self) -> dict[str, FloatArray]:
        """All that it holds, by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def check_semidefinite(covariances: FloatArray, name: str) -> None:
    """Refuse covariances, (*batch, n, n), that are not symmetric and positive semi-definite but for rounding."""
    slack = 1e-9 * np.max(np.abs(covariances), axis=(-2, -1), initial=0.0)
    asymmetry = np.max(np.abs(covariances - covariances.mT), axis=(-2, -1), initial=0.0)
    # No eigenvalue below -slack: a factorisation says so in a small part of the time that eigenvalues take.
    shift = np.where(slack > 0, slack, 1.0)[..., None, None] * np.eye(covariances.shape[-1])
    try:
        np.linalg.cholesky(covariances + shift)
        is_semidefinite = True
    except np.linalg.LinAlgError:
        is_semidefinite = False
    if np.any(asymmetry > slack) or not is_semidefinite:
        raise InputError(f"{name} symmetric and positive semi-definite", "one that is not", "Was it edited by hand?")
