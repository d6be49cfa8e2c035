"""Three questions about the trajectory, asked at every tick: channels in which a failure shows.

    position        Is it where it should be now?      squared distance of y[t] from its mean
    displacement    Has it moved as it should?         the same of y[t] - y[t-l], l = 3, 6, ..., 15 ticks, least over a shift of
                                                       tempo, relative to how sloppy this execution has been before
    standstill_L    Has it stopped L ticks ago?        ln p(the last L ticks | at rest) / p(the last L ticks | all before)

The forecast from all that came before is a multivariate t over the path, mixed over shifts of tempo, so it knows how large,
how slanted, how late and how careless this very execution is. One-step innovations know little of a failure: a filter with
feedback explains it away. A larger value is more suspicious in every channel; NaN is no evidence either way.
"""

from math import lgamma, log, pi

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.windows import PathWindows

__all__ = [
    "AHEAD",
    "BEFORE",
    "CHANNELS",
    "FLOORS",
    "HANDICAPS",
    "HORIZONS",
    "LAST_STANDSTILL",
    "MEMORY",
    "SLOPPINESS_DELAY",
    "Displacement",
    "Forecast",
    "Position",
    "relative_to_sloppiness",
    "sloppiness",
]

HORIZONS = (6, 10, 16)
"""L: ticks after which a forecast is looked at."""
CHANNELS = ("position", "displacement", *(f"standstill_{horizon}" for horizon in HORIZONS))
FLOORS = np.array([0.0, 0.0, *(1.0 for _ in HORIZONS)])
"""Values up to which a channel is not suspicious: a standstill has to be likelier than its contrary."""
HANDICAPS = np.array([2.0, 0.0, *(2.0 for _ in HORIZONS)])
"""Nats of surprise by which a channel stands back behind displacement. What the others are for, a movement that ends elsewhere
or stands still, becomes plain sooner or later; a push passes, and the false alarms that may be had are better spent on it."""

LAGS = np.array([3, 6, 9, 12, 15])
DISPLACEMENT_SHIFTS = np.arange(-6, 7, 2)
ORDINARY_SQUARE = 2.0
"""Squared displacement of an ordinary execution per degree of freedom, the least over shifts."""
ORDINARY_TICKS = 60.0
"""Ticks that an ordinary execution counts beside what has been seen of this one."""
SLOPPINESS_DELAY = int(LAGS.max())
"""Ticks before a window is over that are not asked how sloppy the execution is."""

BEFORE = np.array([36, 26, 18, 12, 8, 4, 0])
AHEAD = np.array([1, 2, 3, 4, 6, 8, 10, 13, 16])
FORECAST_SHIFTS = np.arange(-8, 9, 4)
SHIFT_STD = 4.0
"""Ticks by which executions are ahead or behind."""
DEGREES_OF_FREEDOM = 4.0
"""Of the multivariate t: how much executions differ in their overall sloppiness."""
REST_STD = 0.01
"""How much what is at rest may still move, as a fraction of the range."""
LAST_STANDSTILL = 93
"""From this tick on the movement may be coming to its end, and standing still is no evidence."""

MEMORY = int(BEFORE.max() + AHEAD.max()) + 1
"""Ticks that have to be remembered while executing."""


class Position:
    """Where an execution is."""

    offsets = np.zeros(1, dtype=np.int64)

    def __init__(self, model: PathModel) -> None:
        self.windows = PathWindows(model, self.offsets, np.zeros(1, dtype=np.int64), TICKS + 1)

    def judge(self, ticks: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Squared distance at the ticks (T,) of windows (n, T, 1, D): (n, T) array."""
        white = self.windows.whiten(ticks, windows, means)
        return np.where(white.counts[..., 0, 0] > 0, white.squares[..., 0, 0], np.nan)


class Displacement:
    """How an execution has moved lately."""

    offsets = -np.append(LAGS[::-1], 0)

    def __init__(self, model: PathModel) -> None:
        differences = np.hstack([-np.eye(len(LAGS)), np.ones((len(LAGS), 1))])
        n_places = TICKS + LAGS.max() + DISPLACEMENT_SHIFTS.max() + 1
        self.windows = PathWindows(model, self.offsets, DISPLACEMENT_SHIFTS, n_places, differences)

    def judge(self, ticks: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Squared distance per degree of freedom, the least over shifts, of windows (n, T, P, D): (n, T) array."""
        white = self.windows.whiten(ticks, windows, means)
        squares = (white.squares[..., -1] + (DISPLACEMENT_SHIFTS / SHIFT_STD) ** 2).min(axis=-1)
        return np.where(white.counts[..., 0, -1] > 0, squares / windows.shape[-1], np.nan)


def sloppiness(total: FloatArray, count: FloatArray) -> FloatArray:
    """About 1 for an ordinary execution.

    Parameters
    ----------
    total, count : sum of its squared displacements before the window that is judged, and of how many.
    """
    return np.asarray((ORDINARY_TICKS * ORDINARY_SQUARE + total) / (ORDINARY_TICKS + count) / ORDINARY_SQUARE)


def relative_to_sloppiness(squares: FloatArray) -> FloatArray:
    """Squared displacements relative to those that the same execution had shown before the window, (n, T)."""
    before = np.zeros((2, *squares.shape))
    seen = ~np.isnan(squares)
    for sums, values in zip(before, (np.nan_to_num(squares), seen), strict=True):
        sums[:, SLOPPINESS_DELAY:] = np.cumsum(values, axis=1)[:, :-SLOPPINESS_DELAY]
    return squares / sloppiness(*before)


class Forecast:
    """How an execution goes on from a place, foreseen from all that came before."""

    offsets = np.concatenate([-BEFORE, AHEAD])

    def __init__(self, model: PathModel) -> None:
        self.windows = PathWindows(model, self.offsets, FORECAST_SHIFTS, LAST_STANDSTILL)
        dof = model.means.shape[1]
        sizes = np.arange(len(self.offsets) * dof + 1)
        gammas = np.array([lgamma((DEGREES_OF_FREEDOM + size) / 2) - lgamma(DEGREES_OF_FREEDOM / 2) for size in sizes])
        self._t_constants = gammas - sizes / 2 * log(DEGREES_OF_FREEDOM * pi)
        prior = np.exp(-((FORECAST_SHIFTS / SHIFT_STD) ** 2) / 2)
        self._log_prior = np.log(prior / prior.sum())
        ahead = len(AHEAD)
        self._rest_whitening = np.linalg.inv(np.linalg.cholesky(np.ones((ahead, ahead)) + np.eye(ahead)))
        self._rest_stds = np.sqrt(REST_STD**2 + model.noise_variances)

    def judge(self, places: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """ln p(at rest since the place) / p(gone on) for every point ahead that windows (n, T, P, D) hold: (n, T, points)."""
        white = self.windows.whiten(places, windows, means)
        scaled = np.log1p(white.squares / DEGREES_OF_FREEDOM) * (DEGREES_OF_FREEDOM + white.counts) / 2
        densities = self._t_constants[white.counts] + white.log_determinants - scaled + self._log_prior[:, None]
        mixed = np.logaddexp.reduce(densities, axis=2)  # (n, T, P)
        going_on = mixed[..., len(BEFORE) :] - mixed[..., len(BEFORE) - 1, None]
        return self._at_rest(windows[:, :, len(BEFORE) - 1 :]) - going_on

    def _at_rest(self, since: FloatArray) -> FloatArray:
        """Log-density of the points after the first, (n, T, 1 + points, D), if they are all where it is; (n, T, points).

        NaN from the first point on that was not seen; what came before it is judged as if the window ended there.
        """
        moved = (since[:, :, 1:] - since[:, :, :1]) / self._rest_stds
        points, dof = moved.shape[2:]
        whitening = self._rest_whitening[:points, :points]
        unseen = np.logical_or.accumulate(np.isnan(moved).any(axis=-1), axis=-1)
        squares = np.cumsum(np.sum(np.matmul(whitening, np.nan_to_num(moved)) ** 2, axis=-1), axis=-1)
        squares[unseen] = np.nan
        scales = np.cumsum(np.log(np.diagonal(whitening))) * dof - np.arange(1, points + 1) * np.log(self._rest_stds).sum()
        return np.asarray(scales - squares / 2 - np.arange(1, points + 1) * dof / 2 * log(2 * pi))
