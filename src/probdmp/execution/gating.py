"""Whether a reading may be believed: innovation, its variance, and their test ratio, sensor by sensor.

    ratio = e^T S^-1 e / limit,    limit: the squared length that n standard normal numbers exceed as rarely as one exceeds
                                          `gate` standard deviations

For one number that is e^2 / (gate^2 S), as in PX4's estimator; above 1 the reading is rejected.
"""

from functools import lru_cache
from math import erfc, sqrt

import numpy as np

from probdmp.checks import FloatArray, frozen

__all__ = ["REPORTED_GATE", "gate_limits", "gate_ratios"]

REPORTED_GATE = 5.0
"""Standard deviations to which readings are compared for reports where a sensor has no gate."""


def gate_ratios(innovations: FloatArray, covariances: FloatArray, gate: float | None) -> FloatArray:
    """Test ratios of the readings of one sensor, (*batch) array; NaN where nothing was measured.

    Parameters
    ----------
    innovations : (*batch, O) array; NaN where an output was not measured.
    covariances : (*batch, O, O) array.
    gate : standard deviations; `REPORTED_GATE` if None.
    """
    seen = ~np.isnan(innovations)
    known = np.where(seen[..., :, None] & seen[..., None, :], covariances, np.eye(seen.shape[-1]))
    residual = np.where(seen, innovations, 0.0)
    squares = np.sum(residual * np.linalg.solve(known, residual[..., None])[..., 0], axis=-1)
    limits = gate_limits(REPORTED_GATE if gate is None else gate, seen.shape[-1])
    counts = seen.sum(axis=-1)
    return np.where(counts > 0, squares / limits[counts], np.nan)


@lru_cache(maxsize=64)
def gate_limits(gate: float, n_outputs: int) -> FloatArray:
    """Squared lengths that 0, 1, …, n standard normal numbers exceed as rarely as one exceeds `gate` in either direction."""
    return frozen(np.array([_limit(gate, n) for n in range(n_outputs + 1)]))


def _limit(gate: float, n_numbers: int) -> float:
    if n_numbers <= 1:
        return gate**2
    from scipy.special import gammainccinv

    share = erfc(gate / sqrt(2))
    # Beyond 37 standard deviations the share is zero in floating point: then the plain square is as good.
    return float(2 * gammainccinv(n_numbers / 2, share)) if share > 0 else gate**2 + n_numbers - 1
