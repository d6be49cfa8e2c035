"""Density of a Gaussian residual of which some entries were not seen."""

import numpy as np

from probdmp.checks import BoolArray, FloatArray

__all__ = ["gaussian_log_density", "invert_covariance", "log_density_shares", "output_shares"]

LOG_2PI = float(np.log(2 * np.pi))


def invert_covariance(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse and log-determinant of positive definite matrices.

    Parameters
    ----------
    covariance : (*batch, O, O) array.

    Returns
    -------
    ((*batch, O, O) array, (*batch) array).
    """
    if covariance.shape[-1] == 1:  # one sensor, the usual case: a division instead of a factorisation
        return 1 / covariance, np.log(covariance[..., 0, 0])
    cholesky = np.linalg.cholesky(covariance)
    whitening = np.linalg.inv(cholesky)
    log_determinant = 2 * np.sum(np.log(np.diagonal(cholesky, axis1=-2, axis2=-1)), axis=-1)
    return whitening.mT @ whitening, log_determinant


def gaussian_log_density(
    residual: FloatArray, precision: FloatArray, log_determinant: FloatArray, n_seen: FloatArray
) -> FloatArray:
    """ln N(residual; 0, S), given S^-1 and ln |S|.

    Parameters
    ----------
    residual : (*batch, O) array, zero where nothing was seen.
    precision : S^-1, (*batch, O, O) array.
    log_determinant : ln |S|, (*batch) array.
    n_seen : (*batch) array, how many entries were seen; with none the log density is 0.

    Returns
    -------
    (*batch) array, nats.
    """
    distance = np.sum(residual * np.matmul(precision, residual[..., None])[..., 0], axis=-1)
    return -0.5 * (distance + log_determinant + n_seen * LOG_2PI)


def log_density_shares(
    residual: FloatArray, weighted: FloatArray, covariance: FloatArray, cholesky: FloatArray, seen: BoolArray
) -> FloatArray:
    """ln N(e; 0, S), one share for each entry: e_i (S^-1 e)_i, ln S_ii, and of what correlation adds to ln |S| equal parts.

    Independent entries get their own density, whatever their order.

    Parameters
    ----------
    residual, weighted : e and S^-1 e, (*batch, O) arrays, zero where nothing was seen.
    covariance, cholesky : S and its factor, (*batch, O, O) arrays, those of the identity where nothing was seen.

    Returns
    -------
    (*batch, O) array, nats; 0 where nothing was seen.
    """
    log_variances = np.log(np.diagonal(covariance, axis1=-2, axis2=-1))
    log_determinant = 2 * np.sum(np.log(np.diagonal(cholesky, axis1=-2, axis2=-1)), axis=-1)
    correlation = (log_determinant - log_variances.sum(axis=-1)) / np.maximum(seen.sum(axis=-1), 1)
    return np.where(seen, -0.5 * (residual * weighted + LOG_2PI + log_variances + correlation[..., None]), 0.0)


def output_shares(innovations: FloatArray, covariances: FloatArray) -> FloatArray:
    """The same of innovations (*batch, O), NaN where nothing was seen, and their covariances (*batch, O, O)."""
    seen = ~np.isnan(innovations)
    known = np.where(seen[..., :, None] & seen[..., None, :], covariances, np.eye(seen.shape[-1]))
    residual = np.where(seen, innovations, 0.0)
    weighted = np.linalg.solve(known, residual[..., None])[..., 0]
    return log_density_shares(residual, weighted, known, np.linalg.cholesky(known), seen)
