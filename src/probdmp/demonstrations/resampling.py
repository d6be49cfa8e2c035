"""From recordings with their own clock to the constant rate that everything else assumes, and to common phases."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_seconds, shape_text
from probdmp.demonstrations.clock import sampled_on_grid
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, Demonstration
from probdmp.errors import InputError

__all__ = ["CLOCK_TOLERANCE", "demonstration_from_times", "positions_on_phases"]

CLOCK_TOLERANCE = 1e-3
"""Fraction of a step by which the last time may miss a sample."""


def demonstration_from_times(
    times: ArrayLike,
    positions: ArrayLike,
    dt: float | None = None,
    label: str = "",
    names: tuple[str, ...] = (),
    units: str = "",
) -> Demonstration:
    """A demonstration from time-stamped samples, resampled along straight lines.

    Parameters
    ----------
    times : (T,) array, seconds, strictly increasing.
    positions : (T, D) array, data units.
    dt : seconds between the new samples; about the median spacing of `times` unless given, so that the last sample is kept.

    Raises
    ------
    InputError
        If times do not increase, or the recording would have too many samples.
    """
    path = check_array(positions, "positions", ("T", "D"), hint="One row per time.")
    clock = check_array(times, "times", (len(path),), hint="One time per row of positions.")
    if len(clock) < 2 or path.shape[1] < 1:
        raise InputError("at least two samples of at least one degree of freedom", shape_text(path.shape))
    steps = np.diff(clock)
    if np.any(steps <= 0):
        first = int(np.argmax(steps <= 0))
        raise InputError(
            "times that increase strictly",
            f"{clock[first]!r} s followed by {clock[first + 1]!r} s at sample {first + 1}",
            "Sort the samples and drop repeated ones.",
        )
    since = clock - clock[0]  # clocks count from 1970, and a double then resolves a quarter of a microsecond
    if dt is None:
        dt = float(since[-1]) / max(round(float(since[-1]) / float(np.median(steps))), 1)
    step = check_seconds(dt, "dt")
    n_steps = float(since[-1]) / step + CLOCK_TOLERANCE
    if n_steps >= LONGEST_RECORDING:
        raise InputError(f"at most {LONGEST_RECORDING} samples", f"{n_steps:.3g}", "Choose a larger dt, or cut.")
    grid = step * np.arange(int(n_steps) + 1, dtype=np.float64)
    return Demonstration(sampled_on_grid(since, path, grid), step, label, names, units)


def positions_on_phases(demonstrations: Sequence[Demonstration], n_phases: int) -> FloatArray:
    """Positions at n_phases times evenly spaced from first to last sample, along straight lines over what was measured.

    Returns
    -------
    (K, n_phases, D) array, data units.
    """
    phases = np.linspace(0.0, 1.0, n_phases)
    paths = np.empty((len(demonstrations), n_phases, demonstrations[0].n_dof))
    for path, demonstration in zip(paths, demonstrations, strict=True):
        own = np.linspace(0.0, 1.0, demonstration.n_samples)
        for d, column in enumerate(demonstration.positions.T):
            seen = ~np.isnan(column)
            path[:, d] = np.interp(phases, own[seen], column[seen])
    return paths
