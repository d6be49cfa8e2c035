"""Independent systems side by side as one system, for sensors that see several of them at once."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian.model import LinearGaussianModel

__all__ = ["block_diagonal", "couple_systems"]


def block_diagonal(blocks: FloatArray) -> FloatArray:
    """Blocks (*batch, G, a, b) along the diagonal of a matrix, (*batch, G a, G b)."""
    *batch, n_groups, rows, columns = blocks.shape
    whole = np.zeros((*batch, n_groups, rows, n_groups, columns))
    np.einsum("...gagb->...gab", whole)[...] = blocks  # a view of the diagonal
    return whole.reshape(*batch, n_groups * rows, n_groups * columns)


def couple_systems(
    model: LinearGaussianModel, observation_matrix: FloatArray, observation_covariance: FloatArray
) -> LinearGaussianModel:
    """The systems along the last batch axis, D of n states, as one of D n states that are seen together.

    Parameters
    ----------
    observation_matrix : C, (*batch, O, D n), of the coupled states.
    observation_covariance : R, (*batch, O, O).
    """
    batch = model.batch_shape
    inputs, input_covariances = model.timed_inputs()

    def spread(array: FloatArray, n_core: int, timed: int = 0) -> FloatArray:
        core = array.shape[array.ndim - n_core :]
        return np.broadcast_to(array, (*array.shape[:timed], *batch, *core))

    def joined(array: FloatArray) -> FloatArray:
        *kept, n_systems, size = array.shape
        return array.reshape(*kept, n_systems * size)

    return LinearGaussianModel(
        transition=block_diagonal(spread(model.transition, 2)),
        input_matrix=block_diagonal(spread(model.input_matrix, 2)),
        inputs=joined(spread(inputs, 1, timed=1)),
        input_covariances=block_diagonal(spread(input_covariances, 2, timed=1)),
        observation_matrix=observation_matrix,
        observation_covariance=observation_covariance,
        initial_mean=joined(spread(model.initial_mean, 1)),
        initial_covariance=block_diagonal(spread(model.initial_covariance, 2)),
    )
