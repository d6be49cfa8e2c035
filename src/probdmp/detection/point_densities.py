"""How likely points of a path are under a Gaussian over it, by several accounts of where they are on it.

By an account, points are at phases of the path, and pushed aside by g b, b ~ N(0, I), g of each point: the residuals r from the
mean there have the covariance C[phases, phases] + g g^T + R = L L^T, and z = L^-1 r is white. Paths vary more than a Gaussian
says, so densities are those of a multivariate t.
"""

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.evidence import DEGREES_OF_FREEDOM
from probdmp.detection.windows import whitened_points

__all__ = ["densities_of_points"]


def densities_of_points(
    covariances: FloatArray, noise_variances: FloatArray, phases: IntArray, aside: FloatArray, residuals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Log-densities (K, E) but for a constant, and z squared (K, E, P, D), 0 where nothing was seen.

    Parameters
    ----------
    covariances, noise_variances : (K, M, D, M, D) and (K, D) arrays: of K paths, and what points are measured with.
    phases, aside : (K, E, P) arrays, E accounts for each path: where points are, and g.
    residuals : (K, E, P, D) array; NaN where nothing was seen, which is the same by every account.
    """
    white, logarithms = whitened_points(covariances, noise_variances, phases, aside, residuals)
    squares, nu, shape = np.square(white, out=white), DEGREES_OF_FREEDOM, (*phases.shape[:2], -1)
    n_seen = np.count_nonzero(~np.isnan(residuals), axis=(2, 3))
    heights = (nu + n_seen) / 2 * np.log1p(squares.reshape(shape).sum(axis=-1) / nu)
    return -logarithms.reshape(shape).sum(axis=-1) - heights, squares
