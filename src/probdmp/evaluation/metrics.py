"""Rates with intervals: exact within one split, by bootstrap over classes where several splits reuse the recordings."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

__all__ = ["BOOTSTRAP", "CLOPPER_PEARSON", "Rate", "rate_of", "rate_over_classes"]

CLOPPER_PEARSON = "clopper_pearson"
BOOTSTRAP = "bootstrap_over_classes"

CONFIDENCE = 0.95
DRAWS = 2000


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something happened, as a fraction from 0 to 1."""

    count: int
    n: int
    rate: float
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end."""

    @property
    def in_percent(self) -> str:
        """The rate and its interval, for a table whose head says that they are percentages."""
        return f"{100 * self.rate:.1f} ({100 * self.low:.1f}–{100 * self.high:.1f})"

    def __str__(self) -> str:
        return f"{self.count}/{self.n} ({100 * self.rate:.1f} %, {100 * self.low:.1f}–{100 * self.high:.1f} %)"


@cache
def rate_of(count: int, n: int) -> Rate:
    """The rate of `count` in `n` >= 1 independent cases with its exact binomial interval.

    Source: Clopper & Pearson, Biometrika 26 (1934): quantiles of beta distributions.
    """
    from scipy.special import betaincinv  # scipy.stats has the interval, but takes a second and a half to load

    low = betaincinv(count, n - count + 1, (1 - CONFIDENCE) / 2) if count > 0 else 0.0
    high = betaincinv(count + 1, n - count, (1 + CONFIDENCE) / 2) if count < n else 1.0
    return Rate(count, n, count / n, float(low), float(high))


def rate_over_classes(happened: Sequence[bool], labels: Sequence[str], n_splits: int) -> Rate:
    """The rate over several splits of the same recordings, with an interval by bootstrap over classes.

    Executions of one class are alike and come back in every split, so they are no independent cases; classes are. 2000 draws,
    percentiles, seeded. Where every class has the same rate a draw of classes shows no spread, which does not mean that there
    is none: the interval is then the exact one of as many cases as one split has.
    Source: Davison & Hinkley 1997, Bootstrap Methods and their Application, section 3.8 (whole groups are resampled).

    Parameters
    ----------
    happened, labels : (n) whether it happened in each case, and the class of each.
    """
    _, classes = np.unique(np.asarray(labels), return_inverse=True)
    counts, sizes = np.bincount(classes, weights=np.asarray(happened, dtype=np.float64)), np.bincount(classes)
    count, n = int(counts.sum()), len(labels)
    if np.ptp(counts / sizes) == 0:
        size = max(round(n / n_splits), 1)
        one_split = rate_of(min(round(count / n_splits), size), size)
        return Rate(count, n, count / n, one_split.low, one_split.high)
    draws = np.random.default_rng(0).integers(len(sizes), size=(DRAWS, len(sizes)))
    rates = counts[draws].sum(axis=1) / sizes[draws].sum(axis=1)
    low, high = np.quantile(rates, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Rate(count, n, count / n, float(low), float(high))
