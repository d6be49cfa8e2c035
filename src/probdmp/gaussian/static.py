"""A Gaussian that stands still while it is observed: conditioning on one linear observation after the other.

    z ~ N(m, P),    o = G z + v,    v ~ N(0, R),  R diagonal

    e = o - G m,  S = G P G^T + R = L L^T,  W = P G^T L^-T:    m <- m + W L^-1 e,    P <- P - W W^T

It is the Kalman filter for a state that never changes, with a design G that does. The latent z is meant to have unit
variances: then nothing is lost in the difference but what rounding takes from one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray
from probdmp.gaussian.density import LOG_2PI

__all__ = ["Belief", "StaticUpdate", "linear_moments", "observe", "unit_belief"]

BoolArray = NDArray[np.bool_]


class Belief(NamedTuple):
    """What is known about z."""

    mean: FloatArray
    """m, (*batch, r)."""
    covariance: FloatArray
    """P, (*batch, r, r)."""


class StaticUpdate(NamedTuple):
    """What is known after an observation, and what that observation said."""

    belief: Belief
    innovation: FloatArray
    """e, (*batch, O); NaN where not seen."""
    innovation_covariance: FloatArray
    """S, (*batch, O, O), whether seen or not."""
    log_likelihoods: FloatArray
    """(*batch, O), nats: share of each sensor in the log density given the past, 0 where not seen; see `_shares`."""


def unit_belief(batch: tuple[int, ...], size: int) -> Belief:
    """Independent standard normal z, (*batch, size)."""
    return Belief(np.zeros((*batch, size)), np.broadcast_to(np.eye(size), (*batch, size, size)))


def observe(belief: Belief, observation: FloatArray, design: FloatArray, variances: FloatArray) -> StaticUpdate:
    """Take one observation into account.

    Parameters
    ----------
    observation : o, (*batch, O); NaN marks a sensor that was not seen, and nothing changes for its sake.
    design : G, (*batch, O, r).
    variances : the diagonal of R, (*batch, O), > 0.
    """
    seen = ~np.isnan(observation)
    innovation = observation - np.matmul(design, belief.mean[..., None])[..., 0]
    spread = belief.covariance @ design.mT
    covariance = design @ spread + variances[..., None] * np.eye(design.shape[-2])
    # A sensor that was not seen is one of unit variance that has to do with nothing: no gain, no density.
    both = seen[..., :, None] & seen[..., None, :]
    known = np.where(both, covariance, np.eye(seen.shape[-1]))
    cholesky = np.linalg.cholesky(known)
    whitening = np.linalg.inv(cholesky)
    residual = np.where(seen, innovation, 0.0)
    white = np.matmul(whitening, residual[..., None])
    gain = np.where(seen[..., None, :], spread, 0.0) @ whitening.mT
    log_determinant = 2 * np.sum(np.log(np.diagonal(cholesky, axis1=-2, axis2=-1)), axis=-1)
    return StaticUpdate(
        Belief(belief.mean + np.matmul(gain, white)[..., 0], belief.covariance - gain @ gain.mT),
        innovation,
        covariance,
        _shares(residual * np.matmul(whitening.mT, white)[..., 0], known, log_determinant, seen),
    )


def _shares(distances: FloatArray, covariance: FloatArray, log_determinant: FloatArray, seen: BoolArray) -> FloatArray:
    """ln N(e; 0, S), one share for each sensor: e_i (S^-1 e)_i, ln S_ii, and of what correlation adds to ln |S| equal parts.

    Independent sensors get their own density, whatever their order.
    """
    log_variances = np.log(np.diagonal(covariance, axis1=-2, axis2=-1))
    correlation = (log_determinant - log_variances.sum(axis=-1)) / np.maximum(seen.sum(axis=-1), 1)
    return np.where(seen, -0.5 * (distances + LOG_2PI + log_variances + correlation[..., None]), 0.0)


def linear_moments(belief: Belief, design: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (*batch, n) and covariance (*batch, n, n) of G z, for G (*batch, n, r)."""
    covariance = design @ belief.covariance @ design.mT
    return np.matmul(design, belief.mean[..., None])[..., 0], (covariance + covariance.mT) / 2
