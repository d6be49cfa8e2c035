"""The fixed-interval smoother: the state at each time given the whole recording.

    l[T-1] = 0, L[T-1] = 0;  backwards:
    l[t-1] = A^T (C^T S^-1 e + (I - K C)^T l[t]),    L[t-1] = A^T (C^T S^-1 C + (I - K C)^T L[t] (I - K C)) A   at t
    smoothed mean = m + V l,   smoothed covariance = V - V L V                 (m, V filtered)

Only S is ever inverted, so a rank-one process noise and an exactly known start need no jitter.
Source: Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973), the modified
Bryson-Frazier form; Durbin & Koopman, Time Series Analysis by State Space Methods, section 4.4.
"""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.gaussian import kernels
from probdmp.gaussian.density import invert_covariance
from probdmp.gaussian.filtering import FilteredSequence, filter_sequence
from probdmp.gaussian.model import GaussianSequence, LinearGaussianModel

__all__ = ["smooth_filtered", "smooth_sequence"]


def smooth_sequence(model: LinearGaussianModel, observations: FloatArray) -> GaussianSequence:
    """The state at each time given all observations, before and after.

    Parameters
    ----------
    observations : (T, *batch, O) array; NaN marks what was not seen.
    """
    return smooth_filtered(model, filter_sequence(model, observations))


def smooth_filtered(model: LinearGaussianModel, forward: FilteredSequence) -> GaussianSequence:
    """The backward pass alone, for a recording that has been filtered with the same model."""
    means, covariances = (np.ascontiguousarray(x) for x in forward.filtered)
    # What was not fused has a zero row in C and a unit variance, as in the filter.
    fused, identity = forward.fused, np.eye(forward.fused.shape[-1])
    c = np.where(fused[..., None], forward.matrices, 0.0)
    s = np.where(fused[..., :, None] & fused[..., None, :], forward.innovation_covariances, identity)
    weighted = c.mT @ invert_covariance(s)[0]  # C^T S^-1
    scores = np.matmul(weighted, np.where(fused, forward.innovations, 0.0)[..., None])[..., 0]
    retentions = np.eye(means.shape[-1]) - forward.gains @ c
    smoothed = GaussianSequence(np.empty_like(means), np.empty_like(covariances))

    def of_systems(of_state: FloatArray) -> FloatArray:  # the batch as one axis
        return of_state.reshape(len(means), -1, *of_state.shape[means.ndim - 1 :])

    kernels.smooth_backwards(
        np.ascontiguousarray(np.broadcast_to(model.transition, covariances.shape[1:])).reshape(-1, *covariances.shape[-2:]),
        *map(of_systems, (scores, weighted @ c, retentions, means, covariances, *smoothed)),
    )
    return smoothed
