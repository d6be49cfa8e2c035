"""Cutting what stands still before and after a movement, which would otherwise become part of what is learned."""

from dataclasses import replace

import numpy as np

from probdmp.checks import FloatArray, check_fraction
from probdmp.demonstrations.demonstration import SHORTEST_RECORDING, Demonstration

__all__ = ["trim_still_ends"]

WINDOW = 0.05
"""Seconds over which speed is measured: noise of one sample hardly counts, and a movement hardly changes."""
STILL = 1e-12
"""A recording that moves less than this fraction of its distance from zero has moved by rounding."""


def trim_still_ends(demonstration: Demonstration, slowest: float = 0.03) -> Demonstration:
    """The demonstration from where it begins to move to where it comes to rest.

    Speed is the distance, over all degrees of freedom, from a sample to the one 0.05 s later, per time. Kept is everything
    from the first to the last such window in which the movement is faster than a fraction of its peak speed; so up to 0.05 s of
    standing still stays on either side, and all pauses in between. Gaps are bridged along straight lines, so that a movement
    within a gap counts; what is missing at the ends is cut. Trimming again changes nothing. A recording that never moves, or of
    which too little would remain, is returned as it is. Where sensor noise is faster than that fraction, nothing is cut; a
    larger one then helps.

    Parameters
    ----------
    slowest : fraction of the peak speed up to which it stands still, 0 to 1.

    Raises
    ------
    InputError, InputTypeError
        If the fraction is none.
    """
    check_fraction(slowest, "slowest")
    start, end = 0, demonstration.n_samples
    while True:
        first, last = _moving(demonstration.positions[start:end], demonstration.dt, slowest)
        if (first, last) == (0, end - start) or last - first < SHORTEST_RECORDING:
            break
        start, end = start + first, start + last
    if (start, end) == (0, demonstration.n_samples):
        return demonstration
    channels = {name: values[start:end] for name, values in demonstration.channels.items()}
    return replace(demonstration, positions=demonstration.positions[start:end], channels=channels)


def _moving(positions: FloatArray, dt: float, slowest: float) -> tuple[int, int]:
    """From which sample to before which one it moves; all of them if it never does.

    Parameters
    ----------
    positions : (T, D) array; NaN where a sample is missing.
    """
    seen = ~np.isnan(positions)
    known = positions[:, seen.any(axis=0)]
    complete = np.flatnonzero(seen[:, seen.any(axis=0)].all(axis=1))
    if not known.size or not len(complete):
        return 0, len(positions)
    path = _bridged(known)
    window = min(max(round(WINDOW / dt), 1), len(path) - 1)
    scale = float(np.abs(path).max()) or 1.0
    distances = np.linalg.norm((path[window:] - path[:-window]) / scale, axis=1)
    fast = np.flatnonzero(distances > max(slowest * distances.max(), STILL))
    if not len(fast):
        return 0, len(positions)
    first, last = int(fast[0]), int(fast[-1]) + window
    # A gap that the movement begins or ends in stays whole, with the sample beside it.
    before, after = complete[complete <= first], complete[complete >= last]
    first = int(before[-1]) if len(before) else int(complete[0])
    last = int(after[0]) if len(after) else int(complete[-1])
    return (first, last + 1) if last > first else (0, len(positions))


def _bridged(positions: FloatArray) -> FloatArray:
    """With straight lines over gaps, constant beyond the first and the last sample of each degree of freedom."""
    rows = np.arange(len(positions))
    columns = [np.interp(rows, rows[~np.isnan(c)], c[~np.isnan(c)]) for c in positions.T]
    return np.column_stack(columns)
