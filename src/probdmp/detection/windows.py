"""How far several moments of an execution, taken together, lie from the Gaussian over its path.

A window is the path at a few ticks around a place, or differences between them. An execution may run a little ahead of the
mean movement or behind it, so a window is compared with the model at the same place and at several shifts of it. All
covariances are factorised once: Sigma_window + R = L L^T, and z = L^-1 (window - mean) is white. Points come in order of time,
so the first entries of z say how likely the beginning of a window is, whatever follows.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.window_maps import WindowInputs, linear_maps
from probdmp.gaussian import kernels

__all__ = ["PathWindows", "WhiteWindows", "gather", "inverse_of_cholesky", "whitened", "whitened_points"]

LOSSY_AT_ONCE = 64
"""Windows of which something was not seen that are factorised at once."""
SUBSTITUTED = 8
"""Rows up to which a triangle is inverted row by row."""


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
    """L^-1 of positive definite matrices L L^T (…, n, n), all of them at once."""
    factors = np.asarray(np.linalg.cholesky(covariances), dtype=np.float64)
    inverses = np.zeros_like(factors)
    _invert_triangles(factors, inverses)
    return inverses


def whitened(covariances: FloatArray, residuals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """L^-1 r of positive definite matrices L L^T (…, n, n) and residuals (…, n), and the logarithms of the diagonals of L.

    Of each it is what was seen, where residuals are not NaN, whitened by itself; zero elsewhere.
    """
    count, size = covariances[..., 0, 0].size, residuals.shape[-1]
    # One point of n numbers on each path
    phases, aside, certain = np.zeros((count, 1, 1), dtype=np.int64), np.zeros((count, 1, 1)), np.zeros((count, size))
    one = covariances.reshape(count, 1, size, 1, size), certain, phases, aside, residuals.reshape(count, 1, 1, size)
    white, logarithms = whitened_points(*one)
    return white.reshape(residuals.shape), logarithms.reshape(residuals.shape)


def whitened_points(
    covariances: FloatArray, noise_variances: FloatArray, phases: IntArray, aside: FloatArray, residuals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The same of points on K paths, by E accounts of each; arrays as of `probdmp.detection.point_densities`."""
    white, logarithms = np.empty((2, *residuals.shape))
    n_numbers = covariances.shape[1] * covariances.shape[2]
    flat = covariances.reshape(-1, n_numbers, n_numbers)
    given = (np.ascontiguousarray(array) for array in (flat, noise_variances, phases, aside, residuals))
    if not kernels.whiten(*given, white, logarithms):
        raise np.linalg.LinAlgError("Matrix is not positive definite")
    return white, logarithms


def _invert_triangles(factors: FloatArray, inverses: FloatArray) -> None:
    """Forward substitution in lower triangles (…, n, n); large ones by halves, which are matrix products."""
    size = factors.shape[-1]
    if size > SUBSTITUTED:
        half = size // 2
        first, second = slice(0, half), slice(half, size)
        for part in (first, second):
            _invert_triangles(factors[..., part, part], inverses[..., part, part])
        coupled = np.matmul(factors[..., second, first], inverses[..., first, first])
        np.negative(np.matmul(inverses[..., second, second], coupled), out=inverses[..., second, first])
        return
    for i in range(size):
        scale = 1 / factors[..., i, i]
        inverses[..., i, i] = scale
        above = np.matmul(factors[..., i, None, :i], inverses[..., :i, :i])[..., 0, :]
        inverses[..., i, :i] = -scale[..., None] * above


class WindowTicks(NamedTuple):
    """Where windows of one shape lie on a movement, which is the same for every model; read-only."""

    ticks: IntArray
    """(T, S, P) array: ticks of the points at every place and shift."""
    distinct: IntArray
    """(U, P) array: the same without repetition. A place at one shift is another place at another, but near the ends."""
    of_each: IntArray
    """(T, S) array: which of them each one is."""
    pairs: IntArray
    """(U, P, P) array: every two points of each of them, as `tick_pairs`."""


def tick_pairs(ticks: IntArray) -> IntArray:
    """Every two points of windows at ticks (…, P) as rows of a table of all pairs of ticks: (…, P, P) array."""
    return np.asarray(ticks[..., :, None] * (TICKS + 1) + ticks[..., None, :])


@lru_cache(maxsize=64)
def window_ticks(offsets: Sequence[int], shifts: Sequence[int], n_places: int) -> WindowTicks:
    """Arguments as for `PathWindows`."""
    ticks = np.arange(n_places)[:, None, None] + np.array(offsets)
    # Before the start there is no tempo.
    ticks = np.where(ticks <= 0, 0, np.clip(ticks + np.array(shifts)[:, None], 0, TICKS))
    distinct, of_each = np.unique(ticks.reshape(-1, len(offsets)), axis=0, return_inverse=True)
    found = WindowTicks(ticks, distinct, np.ascontiguousarray(of_each.reshape(ticks.shape[:2])), tick_pairs(distinct))
    for array in found:
        array.flags.writeable = False
    return found


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
        self._ticks, ticks, of_each, pairs = window_ticks(tuple(self.offsets.tolist()), tuple(self.shifts.tolist()), n_places)
        self._dof = model.means.shape[1]
        self._of_pairs = model.covariance.swapaxes(1, 2).reshape(-1, self._dof, self._dof)
        self._noise = np.diag(np.tile(model.noise_variances, len(self.offsets)))
        compared = whitening = inverse_of_cholesky(self._covariances(pairs))
        if combination is not None:
            whitening = compared @ np.kron(combination, np.eye(self._dof))
        means = model.means[ticks].reshape(len(ticks), -1)
        gains = model.goal_gains[ticks].reshape(*means.shape, -1)
        signals = np.tile(np.arange(self._dof), len(self.offsets))
        self.maps = linear_maps(whitening, means, gains, signals, of_each)
        self._whitening = self.maps.maps[..., -len(signals) :] if combination is None else compared
        """(U, L D, L D) array: L^-1 of what is compared."""

    def _covariances(self, pairs: IntArray) -> FloatArray:
        """Of windows with points in these pairs (…, P, P), noise included: (…, L D, L D) array."""
        size = pairs.shape[-1] * self._dof
        # One row of a table of all pairs is copied at once, far faster than numbers from here and there.
        blocks = np.take(self._of_pairs, pairs, axis=0)  # (…, P, P, D, D)
        covariances = blocks.swapaxes(-3, -2).reshape(*pairs.shape[:-2], size, size)
        covariances += self._noise
        if self._combination is None:
            return covariances
        combination = np.kron(self._combination, np.eye(self._dof))
        return np.asarray(combination @ covariances @ combination.T)

    @property
    def log_determinants(self) -> FloatArray:
        """ln det L^-1 of the points up to each one, of windows of which all was seen: (T, S, P); without a combination."""
        diagonal = np.log(np.diagonal(self.maps.maps[..., -len(self.maps.signals) :], axis1=1, axis2=2))
        sums = np.cumsum(diagonal.reshape(len(diagonal), -1, self._dof).sum(axis=-1), axis=-1)
        return np.asarray(sums[self.maps.which])

    def squares(
        self, inputs: WindowInputs, offsets: IntArray, points: IntArray, wanted: IntArray, penalties: FloatArray
    ) -> list[FloatArray]:
        """Squared Mahalanobis distances of the first points of windows at the first places, least over shifts.

        Parameters
        ----------
        offsets : (P) ticks at which the points of a window are seen, relative to its place.
        inputs : of D signals or more, of which the first D are meant; what was not seen counts as zero.
        points : (J) increasing: distances of so many points are asked for.
        wanted : (J) at how many places each of them is; not increasing.
        penalties : (S) what is added for each shift.

        Returns
        -------
        J arrays (wanted, n), of executions side by side.
        """
        return self.maps.squares(inputs, np.repeat(offsets, self._dof), points * self._dof, wanted, penalties)

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
        whitening = self._whitening[self.maps.which[rows]][..., :size, :size]
        # (T, S, n, size): matrix products are far faster than sums over indices
        white = np.moveaxis(np.matmul(whitening, np.moveaxis(np.nan_to_num(flat), 0, -1)), -1, 0)
        diagonal = np.broadcast_to(np.log(np.diagonal(whitening, axis1=-2, axis2=-1)), flat.shape).copy()
        seen = ~np.isnan(flat)
        lossy = np.argwhere(~seen.all(axis=(2, 3)))
        for begin in range(0, len(lossy), LOSSY_AT_ONCE):
            n, t = lossy[begin : begin + LOSSY_AT_ONCE].T
            white[n, t], diagonal[n, t] = self._without_unseen(rows[t], flat[n, t])
        shape = (*flat.shape[:3], points, dof)
        sums = [np.cumsum(x.reshape(shape).sum(axis=-1), axis=-1) for x in (white**2, diagonal, seen)]
        return WhiteWindows(*sums)

    def contributions(self, place: int, shift: int, window: FloatArray, mean: FloatArray) -> FloatArray:
        """(D,) array: signed share of each degree of freedom in the squared distance of one window, (P, D).

        The sign is that of the deviation of the last point; the magnitudes add up to the squared distance, or nearly so where
        shares of different signs cancel.
        """
        ticks = self.ticks(np.array([place]), shift)
        return self.shares(np.array([place]), shift, window[None] - mean[ticks])[0]

    def ticks(self, places: IntArray, shift: int) -> IntArray:
        """Of the model, at which windows at places (n,) should be: (n, P) array."""
        return np.asarray(self._ticks[np.minimum(places, len(self._ticks) - 1), shift])

    def shares(self, places: IntArray, shift: int, deviations: FloatArray) -> FloatArray:
        """The contributions in n windows at places (n,), that are (n, P, D) from their means: (n, D) array."""
        compared = np.nan_to_num(self._compared(deviations))
        rows = np.minimum(places, len(self._ticks) - 1)
        whitening = self._whitening[self.maps.which[rows, shift]]
        flat = compared.reshape(len(rows), -1, 1)
        weighed = np.matmul(whitening.mT, np.matmul(whitening, flat)).reshape(compared.shape)
        return np.abs((compared * weighed).sum(axis=1)) * np.sign(compared[:, -1])

    def _residuals(self, rows: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """What is compared minus its mean at each shift, (n, T, S, L, D)."""
        points = windows.shape[2]
        deviations = np.asarray(windows[:, :, None] - means[:, self._ticks[rows][..., :points]])  # (n, T, S, P, D)
        return self._compared(deviations)

    def _compared(self, deviations: FloatArray) -> FloatArray:
        """Of points (…, P, D), what is compared: (…, L, D), NaN where a point was not seen."""
        if self._combination is None:
            return deviations
        unseen = np.isnan(deviations)
        if not unseen.any():
            return np.asarray(np.matmul(self._combination, deviations))
        lost = np.matmul(np.abs(self._combination), unseen) > 0
        return np.where(lost, np.nan, np.matmul(self._combination, np.where(unseen, 0.0, deviations)))

    def _without_unseen(self, rows: IntArray, residuals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What was seen of windows (W, S, size) whitened by itself: z and the logarithms of the diagonal, zero elsewhere."""
        size = residuals.shape[-1]
        white, logarithms = whitened(self._covariances(tick_pairs(self._ticks[rows]))[..., :size, :size], residuals)
        return white, -logarithms
