"""The smooth path behind a recording: positions, velocities, and how noisy the sensor was.

Learning a forcing term needs accelerations, and differentiating twice amplifies sensor noise by 1/dt^2. The choice made here
is the Savitzky-Golay filter: in a window around each sample a cubic is fitted by least squares. It leaves cubics untouched,
needs no boundary conditions and its window is a fraction of the movement, so that it does not depend on the sampling rate.
Source: Savitzky & Golay, Analytical Chemistry 36 (1964); the implementation is SciPy's.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import Demonstration
from probdmp.errors import InputError

__all__ = ["SmoothPath", "noise_stds", "sampled_between", "smooth_path", "without_noise"]

POLYNOMIAL_ORDER = 3
DENOISING_WINDOW = 7
"""Samples. A third of the noise variance is left; a longer window would cut corners of letters by many times their noise."""


class SmoothPath(NamedTuple):
    """A recording without its sensor noise."""

    positions: FloatArray
    """(T, D) array, data units."""
    velocities: FloatArray
    """(T, D) array, data units per second."""


def smooth_path(demonstration: Demonstration, window: float) -> SmoothPath:
    """Smooth and differentiate a recording.

    Parameters
    ----------
    window : length of the window as a fraction of the recording, 0 to 1. Windows of fewer than five samples, which a cubic
        fits almost or wholly through, leave the positions as they are.

    Raises
    ------
    InputError
        If the first or last sample or most of a degree of freedom is missing: start and goal are read there.
    """
    from scipy.signal import savgol_filter

    positions, dt = _without_gaps(demonstration), demonstration.dt
    n_samples = len(positions)
    length = 2 * int(window * n_samples / 2) + 1
    order = min(POLYNOMIAL_ORDER, n_samples - 1)
    if length <= order + 1:  # nothing to average over: central differences of the positions as they are
        return SmoothPath(positions, np.gradient(positions, dt, axis=0, edge_order=2))
    return SmoothPath(
        savgol_filter(positions, length, order, axis=0), savgol_filter(positions, length, order, deriv=1, delta=dt, axis=0)
    )


def noise_stds(positions: FloatArray) -> FloatArray:
    """Standard deviation of the sensor noise, estimated from the recording itself.

    The fourth difference removes movement and leaves white noise with 70 times its variance; the median resists the few
    samples at which the movement is sharp. Estimator: median |fourth difference| / 0.6745 / sqrt(70).

    Parameters
    ----------
    positions : (T, D) array, data units; NaN where a sample is missing.

    Returns
    -------
    (D,) array, data units; 0 for recordings of fewer than five samples.
    """
    if len(positions) < 5:
        return np.zeros(positions.shape[1])
    fourth = np.abs(np.diff(positions, 4, axis=0))
    known = np.where(np.all(np.isnan(fourth), axis=0), 0.0, fourth)
    return np.asarray(np.nanmedian(known, axis=0) / 0.6745 / np.sqrt(70))


def without_noise(positions: FloatArray) -> FloatArray:
    """The path behind a recording of any quality, for simulation: gaps bridged along straight lines, then barely smoothed.

    Parameters
    ----------
    positions : (T, D) array, data units; NaN where a sample is missing.

    Returns
    -------
    (T, D) array, data units; NaN where a degree of freedom was never measured. Recordings too short to smooth keep their
    noise.
    """
    from scipy.signal import savgol_filter

    n_samples, path = len(positions), np.array(positions)
    for column in path.T:
        seen = np.flatnonzero(~np.isnan(column))
        if len(seen):
            column[:] = np.interp(np.arange(n_samples), seen, column[seen])
            if n_samples >= DENOISING_WINDOW:
                column[:] = savgol_filter(column, DENOISING_WINDOW, POLYNOMIAL_ORDER)
    return path


def sampled_between(path: FloatArray, instants: FloatArray) -> FloatArray:
    """A path at instants between its samples, (T', D) array, by a cubic spline: straight lines would have visible corners.

    Parameters
    ----------
    path : (T, D) array, data units; a column of NaN stays one.
    instants : (T') array, in samples, 0 to T - 1.
    """
    from scipy.interpolate import make_interp_spline

    n_samples, order = len(path), min(POLYNOMIAL_ORDER, len(path) - 1)
    known = ~np.isnan(path).any(axis=0)
    sampled = np.full((len(instants), path.shape[1]), np.nan)
    if known.any():
        sampled[:, known] = make_interp_spline(np.arange(n_samples), path[:, known], order)(instants)
    return sampled


def _without_gaps(demonstration: Demonstration) -> FloatArray:
    """Positions with missing samples filled in along straight lines."""
    positions = np.array(demonstration.positions)
    missing = np.isnan(positions)
    if not missing.any():
        return positions
    for d, name in enumerate(demonstration.names):
        if missing[0, d] or missing[-1, d] or missing[:, d].mean() > 0.5:
            raise InputError(
                f"a demonstration whose {name} is measured at the first and last sample and at most of the others",
                f"{int(missing[:, d].sum())} of {len(positions)} samples missing",
                "Trim the recording, or leave it out: executions may have gaps, demonstrations only small ones.",
            )
        seen = np.flatnonzero(~missing[:, d])
        positions[:, d] = np.interp(np.arange(len(positions)), seen, positions[seen, d])
    return positions
