"""What a failure detector must offer to be compared, and the part that the baselines share."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Protocol, Self

import numpy as np

from baselines.alignment import Alignment, Command, Path
from baselines.array_types import FloatArray
from probdmp import Demonstration

__all__ = ["GridMethod", "Method", "extended"]


class Method(Protocol):
    """A detector for one class of movement."""

    folds: int | None
    """Parts that the training demonstrations are split into for calibration; None: each alone, leave-one-out."""

    def fit(self, training: Sequence[Demonstration], commands: Sequence[Command]) -> Self:
        """Learn from undisturbed executions, each with its command."""

    def trace(self, execution: Demonstration, command: Command) -> FloatArray:
        """How anomalous an execution is after each sample, (T, C) array, ≥ 0: C statistics, more is worse.

        Row t depends on samples 0 to t alone.
        """


class GridMethod(ABC):
    """A method that works on the common grid of phases."""

    folds: int | None = None

    def fit(self, training: Sequence[Demonstration], commands: Sequence[Command]) -> Self:
        """Learn from undisturbed executions, each with its command."""
        self.alignment = Alignment.fit(training)
        self.fit_paths([self.alignment.path(d, c) for d, c in zip(training, commands, strict=True)])
        return self

    def trace(self, execution: Demonstration, command: Command) -> FloatArray:
        """How anomalous an execution is after each sample, (T, C) array."""
        path = self.alignment.path(execution, command)
        return self.trace_path(path)[path.reached]

    @abstractmethod
    def fit_paths(self, paths: Sequence[Path]) -> None:
        """Learn from paths."""

    @abstractmethod
    def trace_path(self, path: Path) -> FloatArray:
        """How anomalous a path is at each of its N grid points, (N, C) array."""


def extended(columns: Sequence[FloatArray]) -> FloatArray:
    """Sequences of different lengths as one (K, N, F) array; the shorter ones stay at their last value."""
    longest = max(len(c) for c in columns)
    return np.stack([c[np.minimum(np.arange(longest), len(c) - 1)] for c in columns])
