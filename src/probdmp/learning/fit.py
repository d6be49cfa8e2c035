"""Learning a primitive, the steps in order."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations import Demonstration, mean_ranges, noise_stds, smooth_path, stack_signals
from probdmp.dmp import Configuration, Primitive, Task, demonstrated_tasks, linear_gaussian_model
from probdmp.dmp.joint_model import joint_executions, mean_positions
from probdmp.dmp.transformation_system import POSITION
from probdmp.errors import InputError
from probdmp.gaussian import LinearGaussianModel, filter_sequence
from probdmp.learning.forcing_targets import forcing_targets, scheme_velocities
from probdmp.learning.observation_noise import ObservationNoise, estimate_observation_noise
from probdmp.learning.options import FitReport, LearningOptions
from probdmp.learning.pooled_weights import pooled_weights
from probdmp.learning.residual_noise import with_residual_noise
from probdmp.learning.varied_weights import varied_weights
from probdmp.learning.weight_regression import WeightPosterior

__all__ = ["fit_primitive"]

OBSERVATION_NOISE_FLOOR = 1e-12
"""Least R, as a fraction of the squared range."""


def fit_primitive(
    demonstrations: Sequence[Demonstration], configuration: Configuration, options: LearningOptions
) -> tuple[Primitive, FitReport]:
    """Learn a primitive from K demonstrations, each with its own start, goal, duration and length."""
    if options.weight_model == "hierarchical" and configuration.scaling == "paper":
        hint = "Scaled by each goal, a movement is not linear in goal and weights, which vary together. "
        hint += 'Use weight_model="pooled", or ProbabilisticDMP.as_published().'
        raise InputError('scaling="none" with weight_model="hierarchical"', 'scaling="paper"', hint)
    if options.channels and configuration.weight_uncertainty != "joint":
        hint = "A forcing term that is redrawn at every step says nothing about the channels."
        raise InputError('weight_uncertainty="joint" with channels', repr(configuration.weight_uncertainty), hint)
    paths = [smooth_path(d, options.smoothing) for d in demonstrations]
    velocities = [scheme_velocities(p, d.dt, configuration.discretization) for p, d in zip(paths, demonstrations, strict=True)]
    tasks = demonstrated_tasks(demonstrations)
    still = _still_primitive(demonstrations, tasks, configuration, np.stack([v[0] for v in velocities]))
    if options.weight_model == "hierarchical":
        moving = varied_weights(still, demonstrations, options)
    else:
        targets = [
            forcing_targets(path.positions, v, goal, d.dt, configuration)
            for path, v, goal, d in zip(paths, velocities, tasks.goal, demonstrations, strict=True)
        ]
        moving = _regressed(still, pooled_weights(still, tasks, targets))
    return _with_observation_noise(moving, tasks, demonstrations)


def _with_observation_noise(
    moving: Primitive, tasks: Task, demonstrations: Sequence[Demonstration]
) -> tuple[Primitive, FitReport]:
    """The primitive with its R, and how far its rollouts are from the demonstrations."""
    observed, dts = stack_signals(demonstrations, moving.channel_names), np.array([d.dt for d in demonstrations])
    joint = moving.configuration.weight_uncertainty == "joint"
    if joint and moving.variation is not None:
        rollouts = mean_positions(joint_executions(moving, tasks, dts, len(observed)))
    else:
        model = linear_gaussian_model(moving, tasks, dts, len(observed))
        rollouts = filter_sequence(model).filtered.means[..., POSITION]
    d = moving.n_dof
    squared_errors = _squared_errors(observed[..., :d], rollouts[..., :d])
    relative_errors = np.sqrt(squared_errors) / moving.ranges
    if not joint:
        noise = _observation_noise(model, observed, squared_errors, moving.ranges)
        return replace(moving, observation_variances=noise.variances), FitReport(relative_errors, noise)
    if moving.variation is None:  # what the mean movement leaves unexplained
        variances = np.maximum(squared_errors.mean(axis=0), OBSERVATION_NOISE_FLOOR * moving.ranges**2)
        moving = replace(moving, observation_variances=variances)
    if moving.configuration.forcing_noise == "predictive":
        moving = with_residual_noise(moving, tasks, dts, observed)
    return moving, FitReport(relative_errors, None)


def _squared_errors(observed: FloatArray, rollouts: FloatArray) -> FloatArray:
    """Mean squared distance of each demonstration from its rollout, (K, D), data units squared."""
    return np.asarray(np.nanmean((observed - rollouts) ** 2, axis=0))


def _regressed(still: Primitive, posteriors: Sequence[WeightPosterior]) -> Primitive:
    """The primitive with what regression says about its weights."""
    return replace(
        still,
        weight_means=np.stack([p.mean for p in posteriors]),
        weight_covariances=np.stack([p.covariance for p in posteriors]),
        weight_precisions=np.array([p.alpha for p in posteriors]),
        forcing_precisions=np.array([p.beta for p in posteriors]),
    )


def _still_primitive(
    demonstrations: Sequence[Demonstration], tasks: Task, configuration: Configuration, start_velocities: FloatArray
) -> Primitive:
    """All of the primitive but its forcing term and sensor noise.

    Parameters
    ----------
    start_velocities : (K, D) array, data units per second.
    """
    first, k, dts = demonstrations[0], len(demonstrations), np.array([d.dt for d in demonstrations])
    phase_velocities = start_velocities * tasks.duration[:, None]
    start_covariances = np.zeros((first.n_dof, 2, 2))
    if k > 1:
        start_covariances[:, 0, 0] = np.var(phase_velocities, axis=0, ddof=1)
        start_covariances[:, 1, 1] = np.var(tasks.start, axis=0, ddof=1)
    ranges = mean_ranges(demonstrations)
    return Primitive(
        configuration=configuration,
        weight_means=np.zeros((first.n_dof, configuration.n_basis)),
        weight_covariances=np.zeros((first.n_dof, configuration.n_basis, configuration.n_basis)),
        weight_precisions=np.ones(first.n_dof),
        forcing_precisions=np.ones(first.n_dof),
        observation_variances=ranges**2,
        goal_displacements=np.mean(tasks.goal - tasks.start, axis=0),
        ranges=ranges,
        start=np.mean(tasks.start, axis=0),
        goal=np.mean(tasks.goal, axis=0),
        start_velocities=np.mean(phase_velocities, axis=0),
        start_covariances=start_covariances,
        duration=float(np.mean(tasks.duration)),
        dt=float(dts[0] if np.all(dts == dts[0]) else np.mean(dts)),  # the mean of 20 times 0.01 is not quite 0.01
        phase_step=float(np.mean(dts / tasks.duration)),
        n_demonstrations=k,
        names=first.names,
        units=first.units,
    )


def _observation_noise(
    model: LinearGaussianModel, observed: FloatArray, squared_errors: FloatArray, ranges: FloatArray
) -> ObservationNoise:
    """R by EM.

    Parameters
    ----------
    observed : (T, K, D) array, data units.
    squared_errors : (K, D) array, data units squared: mean squared distance of each demonstration from its rollout.
    """
    unknown = observed.copy()
    unknown[0] = np.nan  # the commanded start is this very sample: it would count as measured without error
    # The sensor alone, or all that the mean movement leaves unexplained: EM begins with whichever is likelier.
    sensor = np.mean([noise_stds(path) ** 2 for path in np.moveaxis(observed, 1, 0)], axis=0)
    return estimate_observation_noise(
        model, unknown, (sensor, squared_errors.mean(axis=0)), OBSERVATION_NOISE_FLOOR * ranges**2
    )
