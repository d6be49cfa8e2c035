"""Weights of their own for every demonstration, and the Gaussian from which they are drawn."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, channel_ranges, signals_on_phases
from probdmp.dmp import Primitive
from probdmp.dmp.responses import parameter_responses
from probdmp.dmp.transformation_system import POSITION
from probdmp.dmp.via_points import with_signals
from probdmp.learning.hierarchical import estimate_variation
from probdmp.learning.options import LearningOptions

__all__ = ["left_out_primitives", "varied_weights"]

MOST_PHASES = {"exact": 101, "semi_implicit_euler": 1001}
"""The path of the exact scheme hardly depends on its step, so a hundred will do; semi-implicit Euler learns at the step of the
data."""
LARGEST_PRECISION = 1e12
"""beta, relative to forcing terms that move the attractor by the range: there is no noise but that of the weights."""


def varied_weights(still: Primitive, demonstrations: Sequence[Demonstration], options: LearningOptions) -> Primitive:
    """The primitive with its variation; what the independent model needs of it is in the fields of that model.

    Parameters
    ----------
    still : the primitive to be, for its configuration, ranges and start.
    """
    configuration, names = still.configuration, options.channels
    of_channels = channel_ranges(demonstrations, names)
    ranges = np.concatenate([still.ranges, of_channels])
    estimate = estimate_variation(*_phase_paths(still, demonstrations, names), ranges, len(names), configuration.coupling)
    largest = LARGEST_PRECISION / (configuration.stiffness * ranges) ** 2
    varied = with_signals(still, *estimate[:3], names, largest[still.n_dof :], of_channels)
    return replace(
        varied,
        weight_precisions=configuration.n_basis / np.trace(varied.weight_covariances, axis1=-2, axis2=-1),
        forcing_precisions=largest[: still.n_dof],
        observation_variances=estimate.residuals[: still.n_dof],
    )


def left_out_primitives(primitive: Primitive, demonstrations: Sequence[Demonstration]) -> Iterator[Primitive]:
    """For each of the demonstrations that taught a primitive, the one that all the others teach: prior and all.

    Its sensor noise and what drives deviations are those of the whole.
    """
    names = primitive.channel_names
    responses, paths = _phase_paths(primitive, demonstrations, names)
    signals, d = primitive.signals, primitive.n_dof
    for k in range(len(demonstrations)):
        others = np.delete(paths, k, axis=0)
        estimate = estimate_variation(responses, others, signals.ranges, len(names), primitive.configuration.coupling)
        left = with_signals(primitive, *estimate[:3], names, signals.forcing_precisions[d:], signals.ranges[d:])
        yield left.with_signal_noise(signals.observation_variances, signals.forcing_precisions)


def _phase_paths(
    primitive: Primitive, demonstrations: Sequence[Demonstration], channels: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Responses (M, N + 2), and displacements from the start and channels (K, M, S) on M common phases."""
    n_phases = min(round(1 / primitive.phase_step) + 1, MOST_PHASES[primitive.configuration.discretization])
    responses = parameter_responses(primitive.configuration, 1 / (n_phases - 1), n_phases)[:, POSITION]
    paths = signals_on_phases(demonstrations, n_phases, channels)
    paths[..., : primitive.n_dof] -= paths[:, :1, : primitive.n_dof]
    return responses, paths
