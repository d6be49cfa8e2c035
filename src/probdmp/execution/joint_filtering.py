"""Filter, smoother, rollout and samples of executions whose parameters are constant and unknown.

Each observation says something about the parameters, hence about all of the movement, past and future. Degrees of freedom
vary together, so what one of them shows is used for the others too.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive
from probdmp.dmp.joint_model import JointExecutions, JointModel, position_designs, state_designs
from probdmp.dmp.transformation_system import POSITION
from probdmp.gaussian import (
    AugmentedUpdate,
    Deviation,
    GaussianSequence,
    linear_moments,
    no_deviation,
    observe_deviation,
    predict_deviation,
    smooth_deviations,
)

__all__ = [
    "FilteredRecordings",
    "filter_joint",
    "joint_position_covariances",
    "roll_out_joint",
    "sample_joint",
    "smooth_joint",
    "start_deviation",
    "state_moments",
    "update_joint",
]


class FilteredRecordings(NamedTuple):
    """What the filter says about N recordings, in T times."""

    filtered: GaussianSequence
    """The states given the observations up to and including each time: (T, N, D, 3) and (T, N, D, 3, 3)."""
    innovations: FloatArray
    """(T, N, D, 1) array; NaN where not seen."""
    innovation_covariances: FloatArray
    """(T, N, D, 1, 1) array: of each degree of freedom by itself."""
    log_likelihoods: FloatArray
    """(T, N, D) array, nats: the share of each degree of freedom in the log-likelihood of a time given the past."""


class _Now(NamedTuple):
    """What is known at one time."""

    model: JointModel
    deviation: Deviation


def filter_joint(primitive: Primitive, executions: JointExecutions, observed: FloatArray) -> FilteredRecordings:
    """Take in recordings, (T, N, D), NaN where nothing was measured."""
    columns = []
    for now, rows, update in _filtered(primitive, executions, observed):
        seen = update.seen
        variances = np.diagonal(seen.innovation_covariance, axis1=-2, axis2=-1)
        columns.append(
            (*state_moments(*now, rows), seen.innovation[..., None], variances[..., None, None], seen.log_likelihoods)
        )
    means, covariances, innovations, variances, log_likelihoods = (np.stack(c) for c in zip(*columns, strict=True))
    return FilteredRecordings(GaussianSequence(means, covariances), innovations, variances, log_likelihoods)


def smooth_joint(primitive: Primitive, executions: JointExecutions, observed: FloatArray) -> GaussianSequence:
    """All states given all of the recordings, (T, N, D): (T, N, D, 3) and (T, N, D, 3, 3)."""
    updates, model = [], executions.model
    for now, _, update in _filtered(primitive, executions, observed):
        updates.append(update)
        model = now.model
    smoothed = smooth_deviations(updates, executions.system.transition)
    moments = [state_moments(model, d, rows) for d, rows in zip(smoothed, executions.rows, strict=True)]
    return GaussianSequence(*(np.stack(m) for m in zip(*moments, strict=True)))


def roll_out_joint(executions: JointExecutions) -> GaussianSequence:
    """All states given what is known before they begin: (T, N, D, 3) and (T, N, D, 3, 3)."""
    moments, deviation, noise = [], start_deviation(executions.model), executions.system.noise
    for t, rows in enumerate(executions.rows):
        if t > 0:
            deviation = predict_deviation(deviation, executions.system.transition, noise)
        moments.append(state_moments(executions.model, deviation, rows))
    return GaussianSequence(*(np.stack(m) for m in zip(*moments, strict=True)))


def joint_position_covariances(executions: JointExecutions) -> FloatArray:
    """Of `roll_out_joint`, what degrees of freedom share too: (T, N, D, D) array, data units squared."""
    model, deviation = executions.model, start_deviation(executions.model)
    covariances = []
    for t, rows in enumerate(executions.rows):
        if t > 0:
            deviation = predict_deviation(deviation, executions.system.transition, executions.system.noise)
        shared = linear_moments(model.belief, position_designs(model, rows)[1])[1]
        own = deviation.covariance[..., POSITION, POSITION]  # nothing was observed, so deviations owe nothing to z
        covariances.append(shared + own[..., None] * np.eye(own.shape[-1]))
    return np.stack(covariances)


def start_deviation(model: JointModel) -> Deviation:
    """An execution begins where its parameters say."""
    return no_deviation(model.means.shape[:-1], 3, model.factors.shape[-1])


def update_joint(
    model: JointModel, deviation: Deviation, rows: FloatArray, measured: FloatArray, variances: FloatArray
) -> AugmentedUpdate:
    """Condition on positions (*batch, D) of one time.

    Parameters
    ----------
    rows : (*batch, 3, N + 3) array, see `state_rows`.
    variances : R, (D,) array.
    """
    offsets, designs = position_designs(model, rows)
    return observe_deviation(model.belief, deviation, measured - offsets, designs, POSITION, variances)


def state_moments(model: JointModel, deviation: Deviation, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (*batch, D, 3) and covariance (*batch, D, 3, 3) of the states of one time."""
    offsets, designs = state_designs(model, rows)
    belief = model.belief
    shared = belief._replace(mean=belief.mean[..., None, :], covariance=belief.covariance[..., None, :, :])
    means, covariances = linear_moments(shared, designs + deviation.loading)
    return offsets + deviation.offset + means, covariances + deviation.covariance


def sample_joint(executions: JointExecutions, n_samples: int, rng: np.random.Generator) -> FloatArray:
    """Draw paths of the first execution, (n_samples, T, D) array, data units."""
    (means, factors, belief), rows, system = executions
    eigenvalues, vectors = np.linalg.eigh(belief.covariance[0])
    drawn = rng.standard_normal((n_samples, len(eigenvalues))) * np.sqrt(np.maximum(eigenvalues, 0.0))
    unknown = means[0] + np.einsum("dnr,sr->sdn", factors[0], belief.mean[0] + drawn @ vectors.T)
    paths = np.asarray(np.einsum("tn,sdn->std", rows[:, 0, POSITION], unknown, optimize=True))
    inputs = rng.standard_normal(paths.shape) * np.sqrt(system.variances[0])
    deviations = np.zeros((*inputs[:, 0].shape, 3))
    for t in range(1, paths.shape[1]):  # eps[t-1] drives d[t-1] to d[t]
        deviations = deviations @ system.transition[0, 0].T + inputs[:, t - 1, :, None] * system.input_vector[0, 0]
        paths[:, t] += deviations[..., POSITION]
    return paths


def _filtered(
    primitive: Primitive, executions: JointExecutions, observed: FloatArray
) -> Iterator[tuple[_Now, FloatArray, AugmentedUpdate]]:
    """What is known after each time, its rows, and what it has shown."""
    (model, _, system), noise = executions, executions.system.noise
    deviation = start_deviation(model)
    for t, (rows, measured) in enumerate(zip(executions.rows, observed, strict=True)):
        if t > 0:
            deviation = predict_deviation(deviation, system.transition, noise)
        update = update_joint(model, deviation, rows, measured, primitive.observation_variances)
        model, deviation = model._replace(belief=update.seen.belief), update.deviation
        yield _Now(model, deviation), rows, update
