"""Rates with exact intervals."""

from dataclasses import dataclass

__all__ = ["Rate", "rate_of"]

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something happened, as a fraction from 0 to 1."""

    count: int
    n: int
    rate: float
    low: float
    """Lower end of the 95 % Clopper-Pearson interval."""
    high: float
    """Upper end."""

    def __str__(self) -> str:
        return f"{self.count}/{self.n} ({100 * self.rate:.1f} %, {100 * self.low:.1f}–{100 * self.high:.1f} %)"


def rate_of(count: int, n: int) -> Rate:
    """The rate of `count` in `n` >= 1 independent cases with its exact binomial interval.

    Source: Clopper & Pearson, Biometrika 26 (1934); the implementation is SciPy's.
    """
    from scipy.stats import binomtest

    interval = binomtest(count, n).proportion_ci(CONFIDENCE, method="exact")
    return Rate(count, n, count / n, float(interval.low), float(interval.high))
