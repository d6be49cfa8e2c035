"""Filter, smoother, rollout and samples of executions whose parameters are constant and unknown.

Each observation says something about the parameters, hence about all of the movement, past and future. Degrees of freedom
vary together, so what one of them shows is used for the others too.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive
from probdmp.dmp.joint_model import JointExecutions, JointModel, state_designs
from probdmp.dmp.transformation_system import POSITION
from probdmp.gaussian import GaussianSequence, linear_moments, observe

__all__ = [
    "FilteredRecordings",
    "filter_joint",
    "joint_moments",
    "sample_joint",
    "state_moments",
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


def filter_joint(
    primitive: Primitive, executions: JointExecutions, observed: FloatArray
) -> tuple[FilteredRecordings, JointExecutions]:
    """Take in recordings, (T, N, D), NaN where nothing was measured; also returns the executions given all of them."""
    model, columns = executions.model, []
    for rows, measured in zip(executions.rows, observed, strict=True):
        offsets, designs = state_designs(model, rows)
        residuals = measured - offsets[..., POSITION]
        seen = observe(model.belief, residuals, designs[..., POSITION, :], primitive.observation_variances)
        model = model._replace(belief=seen.belief)
        variances = np.diagonal(seen.innovation_covariance, axis1=-2, axis2=-1)
        columns.append(
            (*state_moments(model, rows), seen.innovation[..., None], variances[..., None, None], seen.log_likelihoods)
        )
    means, covariances, innovations, variances, log_likelihoods = (np.stack(c) for c in zip(*columns, strict=True))
    filtered = FilteredRecordings(GaussianSequence(means, covariances), innovations, variances, log_likelihoods)
    return filtered, executions._replace(model=model)


def joint_moments(executions: JointExecutions) -> GaussianSequence:
    """All states given what is known: (T, N, D, 3) and (T, N, D, 3, 3); a rollout, or after `filter_joint` a smoother."""
    moments = [state_moments(executions.model, rows) for rows in executions.rows]
    return GaussianSequence(np.stack([m for m, _ in moments]), np.stack([c for _, c in moments]))


def state_moments(model: JointModel, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (*batch, D, 3) and covariance (*batch, D, 3, 3) of the states of one time."""
    offsets, designs = state_designs(model, rows)
    belief = model.belief
    shared = belief._replace(mean=belief.mean[..., None, :], covariance=belief.covariance[..., None, :, :])
    means, covariances = linear_moments(shared, designs)
    return offsets + means, covariances


def sample_joint(executions: JointExecutions, n_samples: int, rng: np.random.Generator) -> FloatArray:
    """Draw paths of the first execution, (n_samples, T, D) array, data units."""
    (means, factors, belief), rows = executions
    eigenvalues, vectors = np.linalg.eigh(belief.covariance[0])
    drawn = rng.standard_normal((n_samples, len(eigenvalues))) * np.sqrt(np.maximum(eigenvalues, 0.0))
    unknown = means[0] + np.einsum("dnr,sr->sdn", factors[0], belief.mean[0] + drawn @ vectors.T)
    return np.asarray(np.einsum("tn,sdn->std", rows[:, 0, POSITION], unknown, optimize=True))
