"""Sensors that go wrong while the movement does not: samples lost or taken at the wrong instant, stuck and spiking sensors."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.extent import largest_extent
from probdmp.demonstrations.smoothing import sampled_between, without_noise

__all__ = ["dropout", "jitter", "spikes", "stuck_sensor"]

DROPPED = 0.2
"""Fraction of the samples from the onset on that are lost one by one."""
GAP = 0.05
"""Fraction of the movement that is lost in one piece."""
SPIKED = 0.02
"""Fraction of the samples from the onset on that are outliers."""
FEWEST_SPIKES = 3
SPIKE_SIZES = (0.2, 0.5)
"""Least and largest outlier, as fractions of the range."""


def dropout(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Samples are lost: from `onset` on 20 % of them at random, and one gap of 5 % of the movement.

    Parameters
    ----------
    positions : (T, D) array, data units.

    Returns
    -------
    (T, D) array, NaN in the rows that are lost.
    """
    n = len(positions) - onset
    gap = min(n, max(1, round(GAP * len(positions))))
    begin = onset + int(rng.integers(n - gap + 1))
    lossy = np.array(positions)
    lossy[onset + rng.choice(n, round(DROPPED * n), replace=False)] = np.nan
    lossy[begin : begin + gap] = np.nan
    return lossy


def jitter(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Samples from `onset` on are taken up to half a step too early or too late, while the clock says they are not.

    The movement is interpolated; every sample keeps its own noise.

    Parameters
    ----------
    positions : (T, D) array, data units.

    Returns
    -------
    (T, D) array.
    """
    nominal = np.arange(onset, len(positions), dtype=np.float64)
    instants = np.clip(nominal + rng.uniform(-0.5, 0.5, len(nominal)), 0, len(positions) - 1)
    moved, path = np.array(positions), without_noise(positions)
    moved[onset:] += sampled_between(path, instants) - path[onset:]
    return moved


def stuck_sensor(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """One degree of freedom repeats the last value measured before `onset` exactly, for good.

    Parameters
    ----------
    positions : (T, D) array, data units.

    Returns
    -------
    (T, D) array; unchanged if nothing was measured before the onset.
    """
    stuck = np.array(positions)
    seen = ~np.isnan(positions[:onset])
    alive = np.flatnonzero(seen.any(axis=0))
    if len(alive):
        d = int(rng.choice(alive))
        stuck[onset:, d] = positions[np.flatnonzero(seen[:, d])[-1], d]
    return stuck


def spikes(positions: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Single outliers of 20 to 50 % of the range from `onset` on, each in one degree of freedom and none beside another.

    Parameters
    ----------
    positions : (T, D) array, data units.

    Returns
    -------
    (T, D) array with outliers in 2 % of the samples from the onset on that were measured, at least 3; fewer where there is no
    room for them.
    """
    spiked = np.array(positions)
    rows = onset + np.flatnonzero(~np.isnan(positions[onset:]).any(axis=1))
    count = min(max(FEWEST_SPIKES, round(SPIKED * len(rows))), (len(rows) + 1) // 2)
    # Choose without neighbours: from a row shortened by one place for each spike but the first, then widened again.
    places = np.sort(rng.choice(len(rows) - max(count - 1, 0), count, replace=False)) + np.arange(count)
    sizes = rng.uniform(*SPIKE_SIZES, count) * rng.choice([-1, 1], count) * largest_extent(positions)
    spiked[rows[places], rng.integers(positions.shape[1], size=count)] += sizes
    return spiked
