"""How far several moments of an execution, taken together, lie from the Gaussian over its path.

A window is the path at a few ticks around a place, or differences between them. An execution may run a little ahead of the
mean movement or behind it, so a window is compared with the model at the same place and at several shifts of it. All
covariances are factorised once: Sigma_window + R = L L^T, and z = L^-1 (window - mean) is white. Points come in order of time,
so the first entries of z say how likely the beginning of a window is, whatever follows.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS

__all__ = ["PathWindows", "WhiteWindows", "gather", "inverse_of_cholesky"]


class WhiteWindows(NamedTuple):
    """Windows as white noise; all arrays (n, T, S, L): executions, places, shifts, points of the window."""

    squares: FloatArray
    """Squared Mahalanobis distance of the points up to each one."""
    log_determinants: FloatArray
    """ln det L^-1 of the points up to each one."""
    counts: FloatArray
    """How many numbers were seen up to each one."""


def gather(paths: FloatArray, places: IntArray, offsets: IntArray) -> FloatArray:
    """Paths (n, T, D) at ticks places + offsets: (n, places, offsets, D). Before the start a movement is where it starts."""
    return paths[:, np.clip(places[:, None] + offsets, 0, paths.shape[1] - 1)]


def inverse_of_cholesky(covariances: FloatArray) -> FloatArray:
    """L^-1 of positive definite matrices L L^T (…, n, n), by forward substitution on all of them at once."""
    factors = np.linalg.cholesky(covariances)
    inverses = np.zeros_like(covariances)
    for i in range(covariances.shape[-1]):
        scale = 1 / factors[..., i, i]
        inverses[..., i, i] = scale
        above = np.matmul(factors[..., i, None, :i], inverses[..., :i, :i])[..., 0, :]
        inverses[..., i, :i] = -scale[..., None] * above
    return inverses


class PathWindows:
    """Windows of one shape at every place of a movement.

    Parameters
    ----------
    model : the Gaussian over paths.
    offsets : (P,) ticks of the model at which the points should be, relative to the place.
    shifts : (S,) ticks by which an execution may be ahead.
    n_places : places 0, 1, …; a later one is judged as the last.
    combination : (L, P) array, from points to what is compared; the points themselves unless given.
    """

    def __init__(
        self, model: PathModel, offsets: IntArray, shifts: IntArray, n_places: int, combination: FloatArray | None = None
    ) -> None:
        self.offsets, self.shifts = np.asarray(offsets), np.asarray(shifts)
        self._combination = combination
        ticks = np.arange(n_places)[:, None, None] + self.offsets
        # Before the start there is no tempo: (T, S, P)
        self._ticks = np.where(ticks <= 0, 0, np.clip(ticks + self.shifts[:, None], 0, TICKS))
        n_ticks, self._dof = model.means.shape
        self._whole = model.covariance.reshape(n_ticks * self._dof, -1)
        self._noise = np.diag(np.tile(model.noise_variances, len(self.offsets)))
        self._whitening = inverse_of_cholesky(self._covariances(self._ticks))

    def _covariances(self, ticks: IntArray) -> FloatArray:
        """Of windows at ticks (…, S, P) of the movement, noise included: (…, S, L D, L D) array."""
        rows = (ticks[..., None] * self._dof + np.arange(self._dof)).reshape(*ticks.shape[:-1], -1)
        covariances = self._whole[rows[..., :, None], rows[..., None, :]] + self._noise
        if self._combination is None:
            return covariances
        combination = np.kron(self._combination, np.eye(self._dof))
        return np.asarray(combination @ covariances @ combination.T)

    def whiten(self, places: IntArray, windows: FloatArray, means: FloatArray) -> WhiteWindows:
        """Compare windows with the model.

        Parameters
        ----------
        places : (T,) ticks; one beyond the last place is judged as the last.
        windows : (n, T, P, D) array of displacements; NaN where nothing was seen. Where points are compared, not differences,
            the first few suffice.
        means : (n, M, D) array, mean paths of the executions.
        """
        rows = np.minimum(places, len(self._ticks) - 1)
        residuals = self._residuals(rows, windows, means)
        points, dof = residuals.shape[-2:]
        size = points * dof
        flat = residuals.reshape(*residuals.shape[:3], size)
        whitening = self._whitening[rows][..., :size, :size]
        # (T, S, n, size): matrix products are far faster than sums over indices
        white = np.moveaxis(np.matmul(whitening, np.moveaxis(np.nan_to_num(flat), 0, -1)), -1, 0)
        diagonal = np.broadcast_to(np.log(np.diagonal(whitening, axis1=-2, axis2=-1)), flat.shape).copy()
        seen = ~np.isnan(flat)
        for n, t in np.argwhere(~seen.all(axis=(2, 3))):
            white[n, t], diagonal[n, t] = self._without_unseen(rows[t], flat[n, t], size)
        shape = (*flat.shape[:3], points, dof)
        sums = [np.cumsum(x.reshape(shape).sum(axis=-1), axis=-1) for x in (white**2, diagonal, seen)]
        return WhiteWindows(*sums)

    def contributions(self, place: int, shift: int, window: FloatArray, mean: FloatArray) -> FloatArray:
        """(D,) array: signed share of each degree of freedom in the squared distance of one window, (P, D).

        The sign is that of the deviation of the last point; the magnitudes add up to the squared distance, or nearly so where
        shares of different signs cancel.
        """
        rows = np.minimum(np.array([place]), len(self._ticks) - 1)
        residuals = np.nan_to_num(self._residuals(rows, window[None, None], mean[None])[0, 0, shift])
        size = residuals.size
        whitening = self._whitening[rows[0], shift, :size, :size]
        weighed = (whitening.T @ (whitening @ residuals.ravel())).reshape(residuals.shape)
        return np.abs((residuals * weighed).sum(axis=0)) * np.sign(residuals[-1])

    def _residuals(self, rows: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """What is compared minus its mean at each shift, (n, T, S, L, D)."""
        points = windows.shape[2]
        deviations = np.asarray(windows[:, :, None] - means[:, self._ticks[rows][..., :points]])  # (n, T, S, P, D)
        if self._combination is None:
            return deviations
        if not np.isnan(windows).any():
            return np.asarray(np.matmul(self._combination, deviations))
        unseen = np.matmul(np.abs(self._combination), np.isnan(deviations)) > 0
        return np.where(unseen, np.nan, np.matmul(self._combination, np.nan_to_num(deviations)))

    def _without_unseen(self, row: int, residuals: FloatArray, size: int) -> tuple[FloatArray, FloatArray]:
        """What was seen of a window whitened by itself: z and the logarithms of the diagonal, (S, size), zero elsewhere."""
        seen = ~np.isnan(residuals[0])
        white, diagonal = np.zeros((2, len(self.shifts), size))
        if seen.any():
            covariances = self._covariances(self._ticks[row])[:, :size, :size][:, seen][:, :, seen]
            inverse = inverse_of_cholesky(covariances)
            white[:, seen] = np.matmul(inverse, residuals[:, seen][..., None])[..., 0]
            diagonal[:, seen] = np.log(np.diagonal(inverse, axis1=-2, axis2=-1))
        return white, diagonal
