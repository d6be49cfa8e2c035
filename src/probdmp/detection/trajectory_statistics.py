"""Two distances of the trajectory from what is expected: of where it is, and of how it has moved lately.

    position        Is it where it should be now?      squared distance of y[t] from its mean
    displacement    Has it moved as it should?         the same of y[t] - y[t-l], l = 3, 6, ..., 15 ticks, least over a shift of
                                                       tempo, relative to how sloppy this execution has been before

One-step innovations know little of a failure: a filter with feedback explains it away. The larger, the more suspicious; NaN
where there is no evidence.
"""

import numpy as np

from probdmp.checks import FloatArray, IntArray
from probdmp.detection.path_model import PathModel
from probdmp.detection.phase_clock import TICKS
from probdmp.detection.window_maps import WindowInputs
from probdmp.detection.windows import PathWindows

__all__ = [
    "SHIFT_STD",
    "SLOPPINESS_DELAY",
    "Displacement",
    "Position",
    "make_relative",
    "sloppiness",
]

SHIFT_STD = 4.0
"""Ticks by which executions are ahead or behind."""
LAGS = np.array([3, 6, 9, 12, 15])
DISPLACEMENT_SHIFTS = np.arange(-6, 7, 2)
ORDINARY_SQUARE = 2.0
"""Squared displacement of an ordinary execution per degree of freedom, the least over shifts."""
ORDINARY_TICKS = 60.0
"""Ticks that an ordinary execution counts beside what has been seen of this one."""
SLOPPINESS_DELAY = int(LAGS.max())
"""Ticks before a window is over that are not asked how sloppy the execution is."""


START = np.zeros(1, dtype=np.int64)


class Position:
    """Where an execution is."""

    offsets = np.zeros(1, dtype=np.int64)

    def __init__(self, model: PathModel) -> None:
        self.windows, self._ends = PathWindows(model, self.offsets, START, TICKS + 1), np.array([0, model.means.shape[1]])

    def weigh(self, inputs: WindowInputs, length: int) -> FloatArray:
        """Squared distance at the first ticks, (length, n) array, of executions of which nothing is unseen."""
        (squares,) = self.windows.squares(inputs, self.offsets, np.ones(1, dtype=np.int64), np.array([length]), np.zeros(1))
        return squares

    def look(self, tick: int, window: FloatArray) -> float:
        """The same at one tick, of a window as in `WindowMaps.look`."""
        return float(self.windows.maps.look(tick, window, self._ends)[0, 0])

    def judge(self, ticks: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Squared distance at the ticks (T,) of windows (n, T, 1, D): (n, T) array."""
        white = self.windows.whiten(ticks, windows, means)
        return np.where(white.counts[..., 0, 0] > 0, white.squares[..., 0, 0], np.nan)


class Displacement:
    """How an execution has moved lately."""

    offsets = -np.append(0, LAGS[::-1])  # now first: then each difference depends on few points more than the one before
    penalties = (DISPLACEMENT_SHIFTS / SHIFT_STD) ** 2

    def __init__(self, model: PathModel) -> None:
        differences = np.hstack([np.ones((len(LAGS), 1)), -np.eye(len(LAGS))])
        self._dof = model.means.shape[1]
        self._ends = np.array([0, len(LAGS) * self._dof])
        n_places = TICKS + LAGS.max() + DISPLACEMENT_SHIFTS.max() + 1
        self.windows = PathWindows(model, self.offsets, DISPLACEMENT_SHIFTS, n_places, differences)

    def weigh(self, inputs: WindowInputs, length: int) -> FloatArray:
        """The same at the first ticks, (length, n) array, of executions of which nothing is unseen."""
        (squares,) = self.windows.squares(inputs, self.offsets, np.array([len(LAGS)]), np.array([length]), self.penalties)
        squares /= inputs.n_dof
        return squares

    def look(self, tick: int, window: FloatArray) -> float:
        """The same at one tick, of a window as in `WindowMaps.look`."""
        squares = self.windows.maps.look(tick, window, self._ends)[0]
        squares += self.penalties
        return float(squares.min()) / self._dof

    def judge(self, ticks: IntArray, windows: FloatArray, means: FloatArray) -> FloatArray:
        """Squared distance per degree of freedom, the least over shifts, of windows (n, T, P, D): (n, T) array."""
        white = self.windows.whiten(ticks, windows, means)
        squares = (white.squares[..., -1] + self.penalties).min(axis=-1)
        return np.where(white.counts[..., 0, -1] > 0, squares / windows.shape[-1], np.nan)


def sloppiness(total: FloatArray | float, count: FloatArray | float) -> FloatArray:
    """About 1 for an ordinary execution.

    Parameters
    ----------
    total, count : sum of its squared displacements before the window that is judged, and of how many.
    """
    return np.asarray((ORDINARY_TICKS * ORDINARY_SQUARE + total) / (ORDINARY_TICKS + count) / ORDINARY_SQUARE)


def make_relative(squares: FloatArray) -> None:
    """Divide squared displacements (T, n) by those that the same execution had shown before the window."""
    before = squares[:-SLOPPINESS_DELAY]
    unseen = np.isnan(before)
    if unseen.any():
        totals, counts = np.cumsum(np.where(unseen, 0.0, before), axis=0), np.cumsum(~unseen, axis=0)
    else:
        totals, counts = np.cumsum(before, axis=0), np.arange(1, len(before) + 1)[:, None]
    squares[:SLOPPINESS_DELAY] /= sloppiness(0.0, 0.0)
    squares[SLOPPINESS_DELAY:] /= sloppiness(totals, counts)
