"""From per-step log-likelihoods to the number that is compared with a threshold.

The paper compares "the log-likelihood value" and does not say whether that of a step or that of all steps so far; both are
here by name. Densities have units, so positions are taken in units of each degree of freedom's range: ln p gains ln(range) for
each number seen.
"""

from collections.abc import Callable

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["LIKELIHOODS", "standardized_contributions"]

LIKELIHOODS: dict[str, Callable[[float, float], float]] = {
    "per_step": lambda so_far, now: now,
    "cumulative": lambda so_far, now: so_far + now,
}
"""By name: how the statistic of a step follows from that of the step before and the log-likelihood now."""


def standardized_contributions(contributions: FloatArray, innovations: FloatArray, ranges: FloatArray) -> FloatArray:
    """Log-likelihood of each degree of freedom with positions in units of their range.

    Parameters
    ----------
    contributions : (D,) array, nats; 0 where nothing was seen.
    innovations : (D,) array, data units; NaN where nothing was seen.
    ranges : (D,) array, data units.
    """
    return np.where(np.isnan(innovations), 0.0, contributions + np.log(ranges))
