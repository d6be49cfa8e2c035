"""From per-step log-likelihoods to the number that is compared with a threshold.

The paper compares "the log-likelihood value" and does not say whether that of a step or that of all steps so far; both are
here by name. Densities have units, so the outputs of sensors are taken in units of their range: ln p gains ln(range) for each
number seen.
"""

import operator
from collections.abc import Callable

import numpy as np

from probdmp.checks import FloatArray

__all__ = ["LIKELIHOODS", "standardized_contributions"]


def _latest(so_far: float, now: float) -> float:
    return now


LIKELIHOODS: dict[str, Callable[[float, float], float]] = {"per_step": _latest, "cumulative": operator.add}
"""By name: how the statistic of a step follows from that of the step before and the log-likelihood now."""


def standardized_contributions(
    contributions: FloatArray, innovations: FloatArray, innovation_variances: FloatArray, scales: FloatArray
) -> FloatArray:
    """Log-likelihood of each output of the sensors in units of its range.

    What was not seen counts as it was expected to, -(1 + ln 2 pi S) / 2: a sensor that is lost is no failure of the movement.

    Parameters
    ----------
    contributions : (O,) array, nats.
    innovations : (O,) array, units of the outputs; NaN where nothing was seen.
    innovation_variances : S, (O,) array, units squared.
    scales : (O,) array, units of the outputs: their ranges.
    """
    expected = -0.5 * (1 + np.log(2 * np.pi * innovation_variances))
    return np.where(np.isnan(innovations), expected, contributions) + np.log(scales)
