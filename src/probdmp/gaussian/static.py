"""A Gaussian that stands still while it is observed: conditioning on one linear observation after the other.

    z ~ N(m, P),    o = G z + v,    v ~ N(0, R)

    e = o - G m,  S = G P G^T + R = L L^T,  W = P G^T L^-T:    m <- m + W L^-1 e,    P <- P - W W^T

It is the Kalman filter for a state that never changes, with a design G that does. The latent z is meant to have unit
variances: then nothing is lost in the difference but what rounding takes from one.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray
from probdmp.gaussian.density import log_density_shares

__all__ = ["Belief", "StaticUpdate", "linear_moments", "observe", "unit_belief"]


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
    fused: BoolArray
    """(*batch, O): what was seen and believed."""
    gain: FloatArray
    """W of what was fused, (*batch, r, O): z moves by W L^-1 e."""
    whitening: FloatArray
    """L^-1, (*batch, O, O)."""
    log_likelihoods: FloatArray
    """(*batch, O), nats: share of each sensor in the log density given the past, 0 where not seen; see `log_density_shares`."""


def unit_belief(batch: tuple[int, ...], size: int) -> Belief:
    """Independent standard normal z, (*batch, size)."""
    return Belief(np.zeros((*batch, size)), np.broadcast_to(np.eye(size), (*batch, size, size)))


def observe(
    belief: Belief, observation: FloatArray, design: FloatArray, noise: FloatArray, believed: BoolArray | bool = True
) -> StaticUpdate:
    """Take one observation into account.

    Parameters
    ----------
    observation : o, (*batch, O); NaN marks a sensor that was not seen, and nothing changes for its sake.
    design : G, (*batch, O, r).
    noise : R, (*batch, O, O), positive definite.
    believed : (*batch, O): what is not is compared with what was expected, and then treated as if it had not been seen.
    """
    seen = _common(~np.isnan(observation) & believed, belief.covariance.shape[:-2])
    innovation = observation - np.matmul(design, belief.mean[..., None])[..., 0]
    spread = belief.covariance @ design.mT
    covariance = design @ spread + noise
    # A sensor that was not seen is one of unit variance that has to do with nothing: no gain, no density.
    both = seen[..., :, None] & seen[..., None, :]
    known = np.where(both, covariance, np.eye(seen.shape[-1]))
    cholesky = np.linalg.cholesky(known)
    whitening = np.asarray(np.linalg.inv(cholesky), dtype=np.float64)
    residual = np.where(seen, innovation, 0.0)
    white = np.matmul(whitening, residual[..., None])
    gain = np.where(seen[..., None, :], spread, 0.0) @ whitening.mT
    return StaticUpdate(
        Belief(belief.mean + np.matmul(gain, white)[..., 0], belief.covariance - gain @ gain.mT),
        innovation,
        covariance,
        seen,
        gain,
        whitening,
        log_density_shares(residual, np.matmul(whitening.mT, white)[..., 0], known, cholesky, seen),
    )


def _common(seen: BoolArray, batch: tuple[int, ...]) -> BoolArray:
    """Of a batch (N) with one covariance, where the same is seen of all: that, with a batch axis of length 1."""
    if batch == (1,) and len(seen) > 1 and np.all(seen == seen[0]):
        return seen[:1]
    return seen


def linear_moments(belief: Belief, design: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (*batch, n) and covariance (*batch, n, n) of G z, for G (*batch, n, r)."""
    covariance = design @ belief.covariance @ design.mT
    return np.matmul(design, belief.mean[..., None])[..., 0], (covariance + covariance.mT) / 2
