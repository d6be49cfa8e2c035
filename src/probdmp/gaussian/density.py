"""Density of a Gaussian residual of which some entries were not seen."""

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["gaussian_log_density", "invert_covariance"]

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
