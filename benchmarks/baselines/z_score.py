"""Band around the mean: how many standard deviations an execution is from the training demonstrations at the same phase.

    z[t] = max_d |y[t, d] - mean_d(t)| / std_d(t)

of the position from the start, of that from the goal where one is commanded, and of the displacement over the last few
per cent of the movement.
"""

from collections.abc import Sequence

import numpy as np

from baselines.alignment import Path, displacements
from baselines.array_types import FloatArray
from baselines.method import GridMethod, extended

__all__ = ["ZScoreBand"]


class ZScoreBand(GridMethod):
    """Mean and standard deviation at each phase."""

    def __init__(self, floor: float = 0.02, lags: Sequence[int] = (5,)) -> None:
        """
        Parameters
        ----------
        floor : least standard deviation, extents.
        lags : displacements over so many per cent of the duration are judged beside the position; none: position alone.
        """
        self.floor, self.lags = floor, tuple(lags)

    def fit_paths(self, paths: Sequence[Path]) -> None:
        signals = [extended(columns) for columns in zip(*(self._signals(path) for path in paths), strict=True)]
        self.means = [s.mean(axis=0) for s in signals]
        self.stds = [np.hypot(s.std(axis=0, ddof=1), self.floor) for s in signals]

    def trace_path(self, path: Path) -> FloatArray:
        phase = np.minimum(np.arange(len(path.position)), len(self.means[0]) - 1)
        scores = [
            np.abs(signal - mean[phase]) / std[phase]
            for signal, mean, std in zip(self._signals(path), self.means, self.stds, strict=True)
        ]
        return np.column_stack([score.max(axis=1) for score in scores])

    def _signals(self, path: Path) -> list[FloatArray]:
        places = [p for p in (path.position, path.to_goal) if p.shape[1]]
        return places + [displacements(path.position, lag) for lag in self.lags]
