"""The kernels for recordings in NumPy, a part of `_kernels_numpy`.

All arrays are C-contiguous; the last ones are written to.
"""

import numpy as np

from probdmp.checks import FloatArray, IntArray

__all__ = ["plain_recordings", "points_on_lines", "whiten"]


def plain_recordings(values: FloatArray, limits: FloatArray, is_plain: IntArray) -> None:
    """Whether recordings have no sample that repeats the one before, or is far from the line through the two before.

    Parameters
    ----------
    values : (N, T, S) array.
    limits : (S,) array: how far it may be.
    is_plain : written, (N,): 1 or 0; 0 too where a later sample than the second is NaN.
    """
    steps = values[:, 1:] - values[:, :-1]
    moves = steps.all(axis=(1, 2))
    jumps = steps[:, 1:] - steps[:, :-1]
    np.abs(jumps, out=jumps)
    is_plain[:] = moves & (jumps <= limits).all(axis=(1, 2))


def points_on_lines(
    values: FloatArray, after: IntArray, beyond: FloatArray, starts: FloatArray, ranges: FloatArray, points: FloatArray
) -> None:
    """Points between two samples of recordings, relative to their starts.

    Parameters
    ----------
    values : (N, T, S) array, finite.
    after, beyond : (K,) arrays: the second of the two samples, and how far before it a point is, as a part of the way.
    starts, ranges : (N, S) and (S,) arrays.
    points : written, (K, S, N).
    """
    ends, lines = np.take(values, after, axis=1), np.take(values, np.maximum(after - 1, 0), axis=1)
    lines -= ends
    lines *= beyond[:, None]
    lines += ends
    lines -= starts[:, None]
    lines /= ranges
    points[:] = np.moveaxis(lines, 0, -1)


def whiten(
    covariances: FloatArray,
    variances: FloatArray,
    phases: IntArray,
    aside: FloatArray,
    residuals: FloatArray,
    white: FloatArray,
    logarithms: FloatArray,
) -> bool:
    """Points measured on Gaussian paths as white noise, L^-1 r, of E accounts for each of K paths.

    By an account, points are at phases of the path, and pushed aside by g b, b ~ N(0, I), besides noise: the covariance of two
    of them, p and q, in L L^T is C[phase_p, phase_q] + g_p g_q I, and diag(variances) more where p = q.

    Parameters
    ----------
    covariances, variances : (K, M D, M D) and (K, D) arrays: of D numbers at M phases, and of the noise of each.
    phases, aside : (K, E, P) arrays: places below M, and g.
    residuals : r, (K, E, P, D); NaN where nothing was seen.
    white : written, (K, E, P, D); 0 where nothing was seen.
    logarithms : of the diagonal of L, written likewise.

    Returns
    -------
    Whether all covariances of what was seen are positive definite; else what is written is not to be used.
    """
    n_paths, n_accounts, n_points, dof = residuals.shape
    count, size = n_paths * n_accounts, n_points * dof
    own, flat = np.repeat(np.arange(n_paths), n_accounts), residuals.reshape(count, size)
    rows = (phases[..., None] * dof + np.arange(dof)).reshape(count, size)
    pushes = (aside[..., None, None] * np.eye(dof)).reshape(count, size, dof)
    noise = np.tile(variances, n_points)[own, :, None] * np.eye(size)
    found = covariances[own[:, None, None], rows[:, :, None], rows[:, None, :]] + noise + np.matmul(pushes, pushes.mT)
    # What was not seen is given a variance of its own and a residual of zero, which says nothing of the rest.
    seen = ~np.isnan(flat)
    found, known = np.where(seen[:, :, None] & seen[:, None, :], found, np.eye(size)), np.where(seen, flat, 0.0)
    # One more row under the matrix makes the factorisation find L^-1 r on its way: the last row of its factor is its transpose.
    bordered = np.empty((count, size + 1, size + 1))
    bordered[:, :size, :size], bordered[:, size, :size], bordered[:, :size, size] = found, known, known
    bordered[:, size, size] = np.finfo(np.float64).max / 4  # larger than any square
    try:
        factors = np.linalg.cholesky(bordered)
    except np.linalg.LinAlgError:
        return False
    white[:] = factors[:, size, :size].reshape(white.shape)
    logarithms[:] = np.log(np.diagonal(factors, axis1=1, axis2=2)[:, :size]).reshape(white.shape)
    return bool(np.isfinite(logarithms).all())
