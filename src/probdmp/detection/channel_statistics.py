"""Does it feel as it should? A learned sensor channel, given how the movement has gone.

    channel     squared distance of c[t-l], l = 15, 12, ..., 0 ticks, from what is expected of it given y[t-l], l = 12, 6, 0,
                and given that the execution may be a little ahead or behind

Movement and channel are jointly Gaussian, so a force that goes with a larger movement is no surprise when the movement is
large, and one that goes wrong while the positions are as they should be is. Whether the movement is as it should be is for its
own statistics to say: only what the channel adds to the distance of both is counted,

    least over shifts of (q_movement + q_channel) - least over shifts of q_movement
"""

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.trajectory_statistics import SHIFT_STD
from probdmp.detection.window_maps import WindowInputs, linear_maps
from probdmp.detection.windows import inverse_of_cholesky, whitened

__all__ = ["ChannelStatistic"]

MOVEMENT_LAGS, CHANNEL_LAGS = np.array([12, 6, 0]), np.array([15, 12, 9, 6, 3, 0])
SHIFTS = np.arange(-6, 7, 3)


class ChannelStatistic:
    """One channel at work.

    Parameters
    ----------
    model : the Gaussian over movement and channels.
    signal : which of the signals the channel is.
    """

    offsets: IntArray = -np.unique(np.concatenate([MOVEMENT_LAGS, CHANNEL_LAGS]))[::-1]

    def __init__(self, model: PathModel, signal: int) -> None:
        n_signals, n_dof = model.means.shape[1], model.goal_gains.shape[-1]
        self._signal = signal
        lags = -self.offsets
        points = [(p, s) for s in range(n_dof) for p in np.flatnonzero(np.isin(lags, MOVEMENT_LAGS))]
        self._n_movement = len(points)
        points += [(p, signal) for p in np.flatnonzero(np.isin(lags, CHANNEL_LAGS))]
        self._chosen = np.array([p * n_signals + s for p, s in points])
        """Which entries of a window (P, S) are compared: those of the movement first."""
        ticks = np.arange(TICKS + int(SHIFTS.max()) + 1)[:, None, None] + self.offsets
        # Before the start there is no tempo: (T, shifts, P)
        self._ticks = np.where(ticks <= 0, 0, np.clip(ticks + SHIFTS[:, None], 0, TICKS))
        rows = (self._ticks[..., None] * n_signals + np.arange(n_signals)).reshape(*self._ticks.shape[:-1], -1)
        rows = rows[..., self._chosen]
        whole = model.covariance.reshape(model.means.size, -1)
        noise = np.diag(model.noise_variances[self._chosen % n_signals])
        self._covariances = whole[rows[..., :, None], rows[..., None, :]] + noise
        self._whitening = inverse_of_cholesky(self._covariances)
        means = model.means.ravel()[rows]
        gains = model.goal_gains.reshape(model.means.size, -1)[rows]
        shape, which = (-1, *self._whitening.shape[2:]), np.arange(rows.shape[0] * rows.shape[1]).reshape(rows.shape[:2])
        self.maps = linear_maps(
            self._whitening.reshape(shape),
            means.reshape(-1, means.shape[2]),
            gains.reshape(-1, *gains.shape[2:]),
            self._chosen % n_signals,
            which,
        )
        self._ends = np.array([0, self._n_movement, len(self._chosen)])
        self.seen_at = self.offsets[self._chosen // n_signals]
        """(E) tick of each of them relative to the one that is judged."""

    def weigh(self, inputs: WindowInputs, length: int) -> FloatArray:
        """Squared distance per number at the first ticks, (length, n) array, of executions of which nothing is unseen."""
        penalties, wanted = (SHIFTS / SHIFT_STD) ** 2, np.array([length, length])
        of_movement, of_both = self.maps.squares(inputs, self.seen_at, self._ends[1:], wanted, penalties)
        return np.asarray((of_both - of_movement) / len(CHANNEL_LAGS))

    def look(self, tick: int, window: FloatArray) -> float:
        """The same at one tick, of a window as in `WindowMaps.look`."""
        of_movement, of_channel = self.maps.look(tick, window, self._ends)
        of_movement += (SHIFTS / SHIFT_STD) ** 2
        return float((of_movement + of_channel).min() - of_movement.min()) / len(CHANNEL_LAGS)

    def judge(self, ticks: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Squared distance per number at the ticks (T,) of windows (n, T, P, S) from means (n, M, S): (n, T) array.

        NaN where the channel was not seen.
        """
        rows = np.minimum(ticks, len(self._ticks) - 1)
        residuals = self._residuals(rows, windows, means)
        white = np.matmul(self._whitening[rows], np.nan_to_num(residuals)[..., None])[..., 0]
        seen = ~np.isnan(residuals[:, :, 0])
        n, t = np.nonzero(~seen.all(axis=-1))
        if len(n):
            white[n, t] = whitened(self._covariances[rows[t]], residuals[n, t])[0]
        squares = white**2
        penalties = (SHIFTS / SHIFT_STD) ** 2
        of_movement = squares[..., : self._n_movement].sum(axis=-1) + penalties
        of_both = squares.sum(axis=-1) + penalties
        counts = seen[..., self._n_movement :].sum(axis=-1)
        added = (of_both.min(axis=-1) - of_movement.min(axis=-1)) / np.maximum(counts, 1)
        return np.where(counts > 0, added, np.nan)

    def contributions(self, tick: int, window: FloatArray, mean: FloatArray) -> FloatArray:
        """(S,) array: the squared distance of one window (P, S), signed by how what was seen last of the channel deviates."""
        shares, at = np.zeros(window.shape[1]), np.array([tick])
        value = np.nan_to_num(self.judge(at, window[None, None], mean[None])[0, 0])
        shares[self._signal] = value * self.signs(at, window[None], mean[None, np.clip(tick + self.offsets, 0, TICKS)])[0]
        return shares

    def signs(self, ticks: IntArray, windows: FloatArray, expected: FloatArray) -> FloatArray:
        """(n,) array: how what was seen last of the channel in windows (n, P, S) deviates from what is expected; or 0."""
        deviations = (windows - expected)[..., self._signal]
        seen, rows = ~np.isnan(deviations), np.arange(len(ticks))
        last = seen.shape[1] - 1 - np.argmax(seen[:, ::-1], axis=1)
        # There may be nothing now, where a sudden change is not believed yet.
        return np.where(seen.any(axis=1), np.sign(np.nan_to_num(deviations[rows, last])), 0.0)

    def _residuals(self, rows: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """What is compared minus its mean at each shift, (n, T, shifts, entries)."""
        expected = means[:, self._ticks[rows]]  # (n, T, shifts, P, S)
        deviations = windows[:, :, None] - expected
        return np.asarray(deviations.reshape(*deviations.shape[:3], -1)[..., self._chosen])
