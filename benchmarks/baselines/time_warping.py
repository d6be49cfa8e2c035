"""Dynamic time warping: distance of the execution so far to the nearest training demonstration.

    C[i, j] = |x[i] - r[j]|^2 + min(C[i-1, j], C[i, j-1], C[i-1, j-1]),  |i - j| <= window

Open-end: after i samples the execution may have come to any j of the reference r; its distance is min_j C[i, j]. The window
bounds how far tempo may differ: without it a movement that has stopped would match its stopping point for ever.
Source: Sakoe & Chiba, IEEE Trans. ASSP 26 (1978); open-end: Tormene et al., Artificial Intelligence in Medicine 45 (2009).
The matrix is computed by the package `dtaidistance`; row i of it depends on samples 0 to i alone.
"""

from collections.abc import Sequence

import numpy as np
from dtaidistance import dtw_ndim

from baselines.alignment import Path, displacements
from baselines.array_types import FloatArray
from baselines.method import GridMethod

__all__ = ["TimeWarpingDistance"]


class TimeWarpingDistance(GridMethod):
    """Open-end distance to the nearest training demonstration, in all and over the recent past."""

    def __init__(self, window: int = 8, recent: int = 10, velocity: float = 2.0, goal: float = 1.0, lag: int = 4) -> None:
        """
        Parameters
        ----------
        window : how far tempo may differ, % of the duration.
        recent : the increase of the distance over so many % of the duration is judged beside all of it.
        velocity : weight of displacements beside positions; 0: positions alone.
        goal : weight of the position from the goal, where one is commanded, beside that from the start.
        lag : displacements over so many % of the duration.
        """
        self.window, self.recent, self.velocity, self.goal, self.lag = window, recent, velocity, goal, lag

    def fit_paths(self, paths: Sequence[Path]) -> None:
        self.references = [self._signals(path) for path in paths]

    def trace_path(self, path: Path) -> FloatArray:
        signals = self._signals(path)
        costs = np.stack([self._open_end_costs(signals, reference) for reference in self.references])
        lengths = np.arange(1, len(signals) + 1)
        before = costs[:, np.maximum(np.arange(len(signals)) - self.recent, 0)]
        return np.column_stack([np.sqrt(costs.min(axis=0) / lengths), np.sqrt((costs - before).clip(0).min(axis=0))])

    def _open_end_costs(self, signals: FloatArray, reference: FloatArray) -> FloatArray:
        # Of equal length, and with room for the window, so that its place does not depend on what is still to come.
        n = len(signals) + self.window
        rows, columns = (np.ascontiguousarray(s[np.minimum(np.arange(n), len(s) - 1)]) for s in (signals, reference))
        _, paths = dtw_ndim.warping_paths_fast(rows, columns, window=self.window + 1)
        return np.asarray(np.square(paths[1 : len(signals) + 1].min(axis=1)))

    def _signals(self, path: Path) -> FloatArray:
        return np.hstack([path.position, self.goal * path.to_goal, self.velocity * displacements(path.position, self.lag)])
