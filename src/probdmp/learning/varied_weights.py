"""Weights of their own for every demonstration, and the Gaussian from which they are drawn."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, positions_on_phases
from probdmp.dmp import Primitive, Variation
from probdmp.dmp.responses import parameter_responses
from probdmp.dmp.transformation_system import POSITION
from probdmp.dmp.via_points import with_variation
from probdmp.learning.hierarchical import estimate_variation

__all__ = ["left_out_variations", "varied_weights"]

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
    responses, displacements = _phase_paths(still, demonstrations)
    variation = estimate_variation(responses, displacements, still.ranges)
    varied = with_variation(still, variation)
    return replace(
        varied,
        weight_precisions=configuration.n_basis / np.trace(varied.weight_covariances, axis1=-2, axis2=-1),
        forcing_precisions=LARGEST_PRECISION / (configuration.stiffness * still.ranges) ** 2,
        observation_variances=variation.residual_variances,
    )


def left_out_variations(primitive: Primitive, demonstrations: Sequence[Demonstration]) -> Iterator[Variation]:
    """For each of the demonstrations that taught a primitive, the variation that all the others teach: prior and all."""
    responses, displacements = _phase_paths(primitive, demonstrations)
    for k in range(len(demonstrations)):
        yield estimate_variation(responses, np.delete(displacements, k, axis=0), primitive.ranges)


def _phase_paths(primitive: Primitive, demonstrations: Sequence[Demonstration]) -> tuple[FloatArray, FloatArray]:
    """Responses (M, N + 2) and displacements from the start (K, M, D) on M common phases."""
    n_phases = min(round(1 / primitive.phase_step) + 1, MOST_PHASES[primitive.configuration.discretization])
    responses = parameter_responses(primitive.configuration, 1 / (n_phases - 1), n_phases)[:, POSITION]
    paths = positions_on_phases(demonstrations, n_phases)
    return responses, paths - paths[:, :1]
