"""Weights of their own for every demonstration, and the Gaussian from which they are drawn."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from probdmp.demonstrations import Demonstration, positions_on_phases
from probdmp.dmp import Primitive
from probdmp.dmp.responses import parameter_responses
from probdmp.dmp.transformation_system import POSITION
from probdmp.dmp.via_points import with_variation
from probdmp.learning.hierarchical import estimate_variation

__all__ = ["varied_weights"]

MOST_PHASES = {"exact": 101, "semi_implicit_euler": 1001}
"""The path of the exact scheme hardly depends on its step, so a hundred will do; semi-implicit Euler learns at the step of the
data."""
LARGEST_PRECISION = 1e12
"""beta, relative to forcing terms that move the attractor by the range: there is no noise but that of the weights."""


def varied_weights(still: Primitive, demonstrations: Sequence[Demonstration]) -> Primitive:
    """The primitive with its variation; what the independent model needs of it is in the fields of that model.

    Parameters
    ----------
    still : the primitive to be, for its configuration, ranges and start.
    """
    configuration = still.configuration
    n_phases = min(round(1 / still.phase_step) + 1, MOST_PHASES[configuration.discretization])
    responses = parameter_responses(configuration, 1 / (n_phases - 1), n_phases)[:, POSITION]
    paths = positions_on_phases(demonstrations, n_phases)
    variation = estimate_variation(responses, paths - paths[:, :1], still.ranges)
    varied = with_variation(still, variation)
    return replace(
        varied,
        weight_precisions=configuration.n_basis / np.trace(varied.weight_covariances, axis1=-2, axis2=-1),
        forcing_precisions=LARGEST_PRECISION / (configuration.stiffness * still.ranges) ** 2,
        observation_variances=variation.residual_variances,
    )
