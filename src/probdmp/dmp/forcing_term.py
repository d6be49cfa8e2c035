"""The forcing term as a random function of the phase.

    f ~ N(phi^T mu_w, sigma_f^2),   sigma_f^2 = phi^T Sigma_w phi   (+ 1 / beta when `forcing_noise` is "predictive")

The paper speaks of a predictive distribution over f and leaves open whether the regression noise 1 / beta belongs to it.
Without it the variance is what is not known about the mean movement; with it, also how far single demonstrations
stray from the mean. Source: Bishop, Pattern Recognition and Machine Learning, equations 3.58 and 3.59.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp.basis import basis_features
from probdmp.dmp.primitive import Primitive

__all__ = ["ForcingTerm", "forcing_term"]


class ForcingTerm(NamedTuple):
    """Mean and variance of the forcing term, at the amplitude and phase step of the training data."""

    means: FloatArray
    """(*phases.shape, D) array, data units."""
    variances: FloatArray
    """(*phases.shape, D) array, data units squared."""


def forcing_term(primitive: Primitive, phases: FloatArray) -> ForcingTerm:
    """Evaluate the learned forcing term at phases x, an array of any shape."""
    features = basis_features(phases, primitive.configuration.n_basis)
    means = features @ primitive.weight_means.T
    variances = np.stack(
        [np.sum((features @ covariance) * features, axis=-1) for covariance in primitive.weight_covariances], axis=-1
    )
    if primitive.configuration.forcing_noise == "predictive":
        variances = variances + 1 / primitive.forcing_precisions
    return ForcingTerm(means, np.maximum(variances, 0.0))
