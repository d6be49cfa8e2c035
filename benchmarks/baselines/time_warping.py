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
from scipy.ndimage import gaussian_filter1d

from baselines.alignment import Path, displacements
from baselines.array_types import FloatArray
from baselines.method import GridMethod, extended

__all__ = ["TimeWarpingDistance", "open_end_costs"]

SMOOTHING = 2.0
"""Usual distances are smoothed over so many % of the duration (std of the kernel)."""


class TimeWarpingDistance(GridMethod):
    """Open-end distance to the nearest training demonstration, in all and over the recent past."""

    def __init__(self, window: int = 8, recent: int = 10, velocity: float = 2.0, lag: int = 4, floor: float = 0.05) -> None:
        """
        Parameters
        ----------
        window : how far tempo may differ, % of the duration.
        recent : the increase of the distance over so many % of the duration is judged beside all of it.
        velocity : weight of displacements beside positions; 0: positions alone.
        lag : displacements over so many % of the duration.
        floor : least distance that training demonstrations are taken to have from one another, extents.
        """
        self.window, self.recent, self.velocity, self.lag, self.floor = window, recent, velocity, lag, floor

    def fit_paths(self, paths: Sequence[Path]) -> None:
        self.references = [self._signals(path) for path in paths]
        others = [self._distances(own, [r for r in self.references if r is not own]) for own in self.references]
        usual = np.sqrt(np.mean(np.square(extended(others)), axis=0))
        self.usual = gaussian_filter1d(usual, SMOOTHING, axis=0, mode="nearest") + self.floor

    def trace_path(self, path: Path) -> FloatArray:
        phase = np.minimum(np.arange(len(path.position)), len(self.usual) - 1)
        return self._distances(self._signals(path), self.references) / self.usual[phase]

    def _distances(self, signals: Sequence[FloatArray], references: Sequence[Sequence[FloatArray]]) -> FloatArray:
        """To the nearest reference, all and recent for each signal, (N, C) array."""
        channels = []
        for k, signal in enumerate(signals):
            costs = np.stack([open_end_costs(signal, reference[k], self.window) for reference in references])
            lengths = np.arange(1, len(signal) + 1)
            before = costs[:, np.maximum(lengths - 1 - self.recent, 0)]
            channels += [np.sqrt(costs.min(axis=0) / lengths), np.sqrt((costs - before).clip(0).min(axis=0) / self.recent)]
        return np.column_stack(channels)

    def _signals(self, path: Path) -> list[FloatArray]:
        """Seen from the start, and from the goal where one is commanded."""
        moved = self.velocity * displacements(path.position, self.lag)
        return [np.hstack([place, moved]) for place in (path.position, path.to_goal) if place.shape[1]]


def open_end_costs(signals: FloatArray, reference: FloatArray, window: int) -> FloatArray:
    """min_j C[i, j] for each sample; the reference stays at its end.

    Parameters
    ----------
    signals, reference : (N, F) and (M, F) arrays.
    window : grid points.

    Returns
    -------
    (N,) array, squared units of the signals.
    """
    # Of equal length, and with room for the window, so that its place does not depend on what is still to come.
    n = len(signals) + window
    rows, columns = (np.ascontiguousarray(s[np.minimum(np.arange(n), len(s) - 1)]) for s in (signals, reference))
    # dtaidistance counts the diagonal itself, takes the root of the costs, and keeps a border at the top and left.
    _, costs = dtw_ndim.warping_paths_fast(rows, columns, window=window + 1)
    return np.asarray(np.square(costs[1 : len(signals) + 1].min(axis=1)))
