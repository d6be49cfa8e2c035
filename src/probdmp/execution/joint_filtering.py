"""Filter, smoother, rollout and samples of executions whose parameters are constant and unknown.

Each observation says something about the parameters, hence about all of the movement, past and future. All signals vary
together, so what one of them shows is used for the others too.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.dmp.joint_model import JointExecutions, JointModel, state_designs
from probdmp.dmp.transformation_system import POSITION
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import (
    AugmentedUpdate,
    Deviation,
    GaussianSequence,
    block_diagonal,
    linear_moments,
    no_deviation,
    observe_deviation,
    predict_deviation,
    smooth_deviations,
)

__all__ = [
    "FilteredRecordings",
    "filter_joint",
    "joint_covariances",
    "joint_position_covariances",
    "sample_joint",
    "smooth_all_joint",
    "smooth_joint",
    "start_deviation",
    "state_moments",
    "update_joint",
]


class FilteredRecordings(NamedTuple):
    """What the filter says about N recordings, in T times."""

    filtered: GaussianSequence
    """The states of all signals given the observations up to and including each time: (T, N, S, 3) and (T, N, S, 3, 3)."""
    innovations: FloatArray
    """(T, N, O) array; NaN where not seen."""
    innovation_covariances: FloatArray
    """(T, N, O, O) array."""
    fused: BoolArray
    """(T, N, O) array: what was seen and believed."""
    log_likelihoods: FloatArray
    """(T, N, O) array, nats: the share of each output in the log-likelihood of a time given the past."""


class _Now(NamedTuple):
    """What is known at one time."""

    model: JointModel
    deviation: Deviation


def filter_joint(executions: JointExecutions, observed: FloatArray, array: SensorArray) -> FilteredRecordings:
    """Take in recordings, (T, N, O), NaN where nothing was measured."""
    columns = []
    for now, rows, update in _filtered(executions, observed, array):
        seen = update.seen
        of_outputs = (array.flat(seen.innovation), array.flat_covariances(seen.innovation_covariance))
        columns.append((*state_moments(*now, rows), *of_outputs, array.flat(seen.fused), array.flat(seen.log_likelihoods)))
    means, covariances, *rest = (np.stack(column) for column in zip(*columns, strict=True))
    return FilteredRecordings(GaussianSequence(means, covariances), *rest)


def smooth_joint(executions: JointExecutions, observed: FloatArray, array: SensorArray) -> GaussianSequence:
    """All states given all of the recordings, (T, N, O): (T, N, S, 3) and (T, N, S, 3, 3)."""
    updates, model = [], executions.model
    for now, _, update in _filtered(executions, observed, array):
        updates.append(update)
        model = now.model
    smoothed = smooth_deviations(updates, executions.system.grouped(array.is_coupled)[0])
    moments = [state_moments(model, d, rows) for d, rows in zip(smoothed, executions.rows, strict=True)]
    return GaussianSequence(*(np.stack(m) for m in zip(*moments, strict=True)))


def smooth_all_joint(
    executions: JointExecutions, observed: FloatArray, array: SensorArray
) -> tuple[float, FloatArray, FloatArray]:
    """Log-likelihood of all recordings, nats, and moments of the states of all signals together given all of each.

    Returns
    -------
    The means are (T, N, 3 S), the covariances (T, N, 3 S, 3 S).
    """
    steps = [(now, update) for now, _, update in _filtered(executions, observed, array)]
    smoothed = smooth_deviations([update for _, update in steps], executions.system.grouped(array.is_coupled)[0])
    last = steps[-1][0].model
    moments = [all_moments(last, d, rows) for d, rows in zip(smoothed, executions.rows, strict=True)]
    log_likelihood = float(sum(update.seen.log_likelihoods.sum() for _, update in steps))
    means, covariances = (np.stack(m) for m in zip(*moments, strict=True))
    return log_likelihood, means, covariances


def joint_covariances(executions: JointExecutions) -> FloatArray:
    """Of all states given what is known before they begin, (T, N, S, 3, 3) array."""
    (_, factors, belief), rows, system = executions
    of_parameters = factors @ belief.covariance[:, None] @ factors.mT  # (N, S, N + 3, N + 3)
    half = np.matmul(rows[:, :, None], of_parameters)
    covariances = np.matmul(half, rows[:, :, None].mT)
    covariances = (covariances + covariances.mT) / 2
    return covariances + system.variances[..., None, None] * system.driven(len(rows))[:, :, None]


def joint_position_covariances(executions: JointExecutions) -> FloatArray:
    """Of positions, what signals share too: (T, N, S, S) array, units of the signals multiplied."""
    (_, factors, belief), rows, system = executions
    positions = rows[..., POSITION, :]
    designs = np.matmul(positions[:, :, None, None], factors)[..., 0, :]  # (T, N, S, r)
    covariances = designs @ belief.covariance @ designs.mT
    own = system.variances * system.driven(len(rows))[..., POSITION, POSITION, None]
    return np.asarray((covariances + covariances.mT) / 2 + own[..., None] * np.eye(own.shape[-1]))


def start_deviation(model: JointModel, are_coupled: bool) -> Deviation:
    """An execution begins where its parameters say."""
    *batch, n_signals, _ = model.means.shape
    groups, size = (1, 3 * n_signals) if are_coupled else (n_signals, 3)
    return no_deviation((*batch, groups), size, model.factors.shape[-1])


def update_joint(
    model: JointModel, deviation: Deviation, rows: FloatArray, measured: FloatArray, array: SensorArray
) -> AugmentedUpdate:
    """Condition on the observations (*batch, O) of one time.

    Parameters
    ----------
    rows : (*batch, 3, N + 3) array, see `state_rows`.
    """
    kinds, n_groups = array.kinds, array.matrix.shape[0]
    offsets, designs = state_designs(model, rows[..., kinds, :])

    def predicted() -> tuple[FloatArray, FloatArray]:
        return all_moments(model, deviation, rows)

    values, sensors, noise, believed = array.look(measured, predicted)
    # Only the kinds of states that are seen at all: the others have columns of zeros in C.
    shape = (*sensors.shape[:-1], -1, 3)
    seen = sensors.reshape(shape)[..., kinds].reshape(*sensors.shape[:-1], -1)
    batch = offsets.shape[:-2]
    known = np.matmul(seen, offsets.reshape(*batch, n_groups, -1, 1))[..., 0]
    of_z = seen @ designs.reshape(*batch, n_groups, seen.shape[-1], designs.shape[-1])
    return observe_deviation(model.belief, deviation, values - known, of_z, sensors, noise, believed)


def state_moments(model: JointModel, deviation: Deviation, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (*batch, S, 3) and covariance (*batch, S, 3, 3) of the states of one time."""
    offsets, designs = state_designs(model, rows)
    (mean, covariance), own = model.belief, deviation.covariance
    designs = designs + deviation.loading.reshape(designs.shape)
    flat = designs.reshape(*designs.shape[:-3], -1, designs.shape[-1])  # one product for all signals
    means = np.matmul(flat, mean[..., None])[..., 0].reshape(offsets.shape)
    covariances = (flat @ covariance).reshape(designs.shape) @ designs.mT
    covariances = (covariances + covariances.mT) / 2
    if own.shape[-1] > 3:  # one group of all signals
        n_signals = offsets.shape[-2]
        blocks = own.reshape(*own.shape[:-3], n_signals, 3, n_signals, 3)
        own = np.moveaxis(blocks[..., np.arange(n_signals), :, np.arange(n_signals), :], 0, -3)
    return offsets + deviation.offset.reshape(offsets.shape) + means, covariances + own


def all_moments(model: JointModel, deviation: Deviation, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same of the states of all signals together: (*batch, 3 S) and (*batch, 3 S, 3 S)."""
    offsets, designs = state_designs(model, rows)
    batch, r = offsets.shape[:-2], designs.shape[-1]
    means, covariances = linear_moments(
        model.belief, (designs + deviation.loading.reshape(designs.shape)).reshape(*batch, -1, r)
    )
    return (offsets + deviation.offset.reshape(offsets.shape)).reshape(*batch, -1) + means, covariances + block_diagonal(
        deviation.covariance
    )


def sample_joint(executions: JointExecutions, n_samples: int, rng: np.random.Generator) -> FloatArray:
    """Draw the states of the first execution, (n_samples, T, S, 3) array."""
    (means, factors, belief), rows, system = executions
    eigenvalues, vectors = np.linalg.eigh(belief.covariance[0])
    drawn = rng.standard_normal((n_samples, len(eigenvalues))) * np.sqrt(np.maximum(eigenvalues, 0.0))
    unknown = means[0] + np.einsum("dnr,sr->sdn", factors[0], belief.mean[0] + drawn @ vectors.T)
    states = np.asarray(np.einsum("tkn,sdn->stdk", rows[:, 0], unknown, optimize=True))
    inputs = rng.standard_normal(states.shape[:-1]) * np.sqrt(system.variances[0])
    deviations = np.zeros((*inputs[:, 0].shape, 3))
    for t in range(1, states.shape[1]):  # eps[t-1] drives d[t-1] to d[t]
        deviations = deviations @ system.transition[0, 0].T + inputs[:, t - 1, :, None] * system.input_vector[0, 0]
        states[:, t] += deviations
    return states


def _filtered(
    executions: JointExecutions, observed: FloatArray, array: SensorArray
) -> Iterator[tuple[_Now, FloatArray, AugmentedUpdate]]:
    """What is known after each time, its rows, and what it has shown."""
    model, (transition, noise) = executions.model, executions.system.grouped(array.is_coupled)
    deviation = start_deviation(model, array.is_coupled)
    for t, (rows, measured) in enumerate(zip(executions.rows, observed, strict=True)):
        if t > 0:
            deviation = predict_deviation(deviation, transition, noise)
        update = update_joint(model, deviation, rows, measured, array)
        model, deviation = model._replace(belief=update.seen.belief), update.deviation
        yield _Now(model, deviation), rows, update
