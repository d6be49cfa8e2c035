"""Isolation forest on windows: how quickly random splits set a moment apart from the training demonstrations.

A moment is described by its phase, position, and displacements over the last few per cent of the movement.
Source: Liu, Ting & Zhou, ICDM 2008; the forest is scikit-learn's.
"""

from collections.abc import Sequence

import numpy as np
from sklearn.ensemble import IsolationForest

from baselines.alignment import Path, displacements
from baselines.array_types import FloatArray
from baselines.method import GridMethod, extended

__all__ = ["WindowForest"]


class WindowForest(GridMethod):
    """Anomaly score of windows."""

    def __init__(
        self, lags: Sequence[int] = (3, 6, 9, 12), n_trees: int = 200, floor: float = 0.02, relative: bool = True
    ) -> None:
        """
        Parameters
        ----------
        lags : displacements over so many % of the duration.
        floor : least standard deviation, extents.
        relative : describe a moment by its deviation from the training demonstrations at the same phase.
        """
        self.lags, self.n_trees, self.floor, self.relative = tuple(lags), n_trees, floor, relative

    def fit_paths(self, paths: Sequence[Path]) -> None:
        windows = extended([self._windows(path) for path in paths])
        self.mean = windows.mean(axis=0)
        self.std = np.hypot(windows.std(axis=0, ddof=1), self.floor)
        rows = np.concatenate([self._features(w) for w in windows])
        self.forest = IsolationForest(n_estimators=self.n_trees, random_state=0).fit(rows)

    def trace_path(self, path: Path) -> FloatArray:
        return -self.forest.score_samples(self._features(self._windows(path)))[:, None]

    def _windows(self, path: Path) -> FloatArray:
        return np.hstack([path.position, path.to_goal, *(displacements(path.position, lag) for lag in self.lags)])

    def _features(self, windows: FloatArray) -> FloatArray:
        phase = np.minimum(np.arange(len(windows)), len(self.mean) - 1)
        described = (windows - self.mean[phase]) / self.std[phase] if self.relative else windows
        return np.column_stack([phase / (len(self.mean) - 1), described])
