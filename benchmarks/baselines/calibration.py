"""One calibration for every method: scores of left-out training demonstrations, pooled over all classes.

The score of an execution is the largest value its statistic reaches. Each class's statistics are divided by the median of
their own left-out scores, so that easy and hard classes can share a threshold; several statistics are brought to a common
scale and their maximum is judged. The threshold for a false alarm rate alpha is the ceil((n + 1)(1 - alpha))-th smallest of
the n pooled scores.
Source of the threshold: split conformal prediction; Vovk, Gammerman & Shafer, Algorithmic Learning in a Random World, 2005.
Left-out scores of the training demonstrations carry no finite-sample guarantee; the realised rate is measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Self

import numpy as np

from baselines.array_types import FloatArray

__all__ = ["Standardization", "threshold_for"]

TAIL = 0.9
"""Statistics are made comparable at this quantile of their pooled scores."""
LEAST = 1e-12
"""A scale below this is rounding."""
ROUNDING = 1e-9
"""101 · 0.99 is a little less than it should be."""


@dataclass(frozen=True, slots=True, eq=False)
class Standardization:
    """Divides statistics by what they reach undisturbed."""

    by_class: dict[str, FloatArray]
    """(C,) array for each class: median left-out score of each statistic."""
    pooled: FloatArray
    """(C,) array: a high quantile of the pooled scores after that."""

    @classmethod
    def fit(cls, scores: dict[str, FloatArray]) -> Self:
        """Take the scales from left-out scores, by class a (K, C) array."""
        by_class = {label: np.maximum(np.median(s, axis=0), LEAST) for label, s in scores.items()}
        relative = np.concatenate([s / by_class[label] for label, s in scores.items()])
        return cls(by_class, np.maximum(np.quantile(relative, TAIL, axis=0), LEAST))

    def apply(self, label: str, statistics: FloatArray) -> FloatArray:
        """The largest standardized statistic; (T, C) array to (T,) array."""
        return np.asarray((statistics / (self.by_class[label] * self.pooled)).max(axis=-1))


def threshold_for(scores: Sequence[float] | FloatArray, alpha: float) -> float:
    """The level that a further exchangeable score exceeds with probability at most `alpha`.

    With too few scores for that, the largest of them: the attainable rate is then 1 / (n + 1).

    Parameters
    ----------
    scores : (n,) array.
    """
    rank = ceil((len(scores) + 1) * (1 - alpha) - ROUNDING)
    return float(np.sort(scores)[min(rank, len(scores)) - 1])
