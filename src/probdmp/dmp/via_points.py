"""A movement made to pass through points: its joint Gaussian conditioned on them.

A via-point says y(t) = H(t) theta = position - start, up to its own noise, of every degree of freedom that it names. What the
demonstrations say about the rest of the movement follows, by the same algebra as while executing. Executions deviate from
H(t) theta (`probdmp.dmp.deviations`), at a via-point too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_number
from probdmp.dmp.channels import ChannelVariation
from probdmp.dmp.path_distribution import parameter_factor, signal_distribution
from probdmp.dmp.primitive import Primitive
from probdmp.dmp.responses import GOAL, START_VELOCITY, WEIGHTS, parameter_responses
from probdmp.dmp.transformation_system import POSITION
from probdmp.dmp.variation import Variation
from probdmp.errors import InputError, InputTypeError
from probdmp.gaussian import observe, unit_belief

__all__ = ["ViaPoint", "condition_primitive", "with_signals", "with_variation"]

ViaPoint = tuple[float, ArrayLike, ArrayLike]
"""Time, seconds of the learned duration; position, (D,), data units, NaN where free; std, a number or (D,), data units."""


def condition_primitive(primitive: Primitive, points: Sequence[ViaPoint]) -> Primitive:
    """The movement that passes through points, started where it was learned to start.

    Raises
    ------
    InputError, InputTypeError
        If the weights are not joint, a time lies outside the movement, or a point is not one.
    """
    if primitive.configuration.weight_uncertainty != "joint":
        raise InputError(
            'weight_uncertainty="joint" to condition a movement',
            f'"{primitive.configuration.weight_uncertainty}"',
            "Learn it with ProbabilisticDMP(), whose weights are hierarchical and joint: forcing terms that are redrawn at "
            "every step say nothing about the rest of a movement.",
        )
    (means, covariance), d = signal_distribution(primitive), primitive.n_dof
    factor = parameter_factor(covariance)
    factors = factor.reshape(*means.shape, -1)[:d]
    belief = unit_belief((), factor.shape[1])
    for time, position, std in _checked(primitive, points):
        row = _position_row(primitive, time)
        belief = observe(belief, position - primitive.start - means[:d] @ row, row @ factors, np.diag(std**2)).belief
    conditioned = factor @ belief.covariance @ factor.T
    signals = primitive.signals
    residuals = signals.observation_variances if signals.residual_variances is None else signals.residual_variances
    shifted = means + (factor @ belief.mean).reshape(means.shape)
    both = (conditioned + conditioned.T) / 2
    of_channels = (primitive.channel_names, signals.forcing_precisions[d:], signals.ranges[d:])
    varied = with_signals(primitive, shifted, both, residuals, *of_channels)
    return varied.with_signal_noise(signals.observation_variances, signals.forcing_precisions)


def with_signals(
    primitive: Primitive,
    means: FloatArray,
    covariance: FloatArray,
    residuals: FloatArray,
    channels: Sequence[str],
    channel_precisions: FloatArray,
    channel_ranges: FloatArray,
) -> Primitive:
    """The primitive with another Gaussian over the parameters of all its signals; channels measure with their residual noise.

    Parameters
    ----------
    means, covariance : as `signal_distribution` returns them.
    residuals : (S,) array, units of each signal squared.
    channels : (F) names.
    channel_precisions, channel_ranges : (F,) arrays, see `ChannelVariation`.
    """
    d, (_, n) = primitive.n_dof, means.shape
    theta, rest = np.delete(np.arange(d * n), np.arange(d) * n), slice(d * n, None)
    variation = Variation(means[:d, 1:], covariance[np.ix_(theta, theta)], residuals[:d])
    if not channels:
        return with_variation(primitive, variation)
    own, cross = covariance[rest, rest], covariance[rest, theta]
    left = residuals[d:]
    varied = ChannelVariation(tuple(channels), means[d:], own, cross, left, left, channel_precisions, channel_ranges)
    return with_variation(primitive, variation, varied)


def with_variation(primitive: Primitive, variation: Variation, channels: ChannelVariation | None = None) -> Primitive:
    """The primitive with another Gaussian over its parameters, and what the independent model needs of it in its own fields."""
    d, n = variation.means.shape
    blocks = variation.covariance.reshape(d, n, d, n)[np.arange(d), :, np.arange(d)]
    start_covariances = np.array(primitive.start_covariances)
    start_covariances[:, 0, 0] = blocks[:, START_VELOCITY, START_VELOCITY]
    return replace(
        primitive,
        weight_means=variation.means[:, WEIGHTS],
        weight_covariances=blocks[:, WEIGHTS, WEIGHTS],
        goal_displacements=variation.means[:, GOAL],
        goal=primitive.start + variation.means[:, GOAL],
        start_velocities=variation.means[:, START_VELOCITY],
        start_covariances=start_covariances,
        variation=variation,
        channels=channels,
    )


def _checked(primitive: Primitive, points: Sequence[ViaPoint]) -> list[tuple[float, FloatArray, FloatArray]]:
    if not isinstance(points, list | tuple) or not all(isinstance(p, list | tuple) and len(p) == 3 for p in points):
        raise InputTypeError("via-points as a list of (time, position, std)", f"{points!r:.100}")
    shape, checked = (primitive.n_dof,), []
    for given_time, given_position, given_std in points:
        time = check_number(given_time, "the time of a via-point as a number of seconds")
        if not 0 < time <= primitive.duration:
            hint = "It counts from the start, in seconds of the learned duration; the start itself is a matter of the task."
            raise InputError(f"0 < time <= {primitive.duration:g} s of a via-point", f"{time:g}", hint)
        position = check_array(given_position, "the position of a via-point", shape, missing=True)
        std = check_array(given_std, "the std of a via-point", shape if np.ndim(given_std) else ())
        if np.any(std <= 0):
            raise InputError("std > 0 of a via-point", f"{std.min():g}", "How far the movement may pass from it.")
        checked.append((time, position, np.broadcast_to(std, shape)))
    return checked


def _position_row(primitive: Primitive, time: float) -> FloatArray:
    """(1, H) of the position at a time, (N + 3,) array; on a straight line between two steps of the learned rate."""
    at = time / primitive.dt
    responses = parameter_responses(primitive.configuration, primitive.dt / primitive.duration, int(at) + 2)[-2:, POSITION]
    between = (int(at) + 1 - at) * responses[0] + (at - int(at)) * responses[1]
    return np.concatenate([np.ones(1), between])
