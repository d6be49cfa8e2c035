"""How far a movement reaches: the unit in which everything unit-free is measured."""

from collections.abc import Sequence

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import Demonstration, signals_of
from probdmp.errors import InputError

__all__ = ["channel_ranges", "largest_extent", "mean_ranges"]

RANGES = (1e-40, 1e40)
"""Least and largest, data units: precisions and variances must stay finite."""
STILL = 1e-12
"""A degree of freedom that moves less than this fraction of its distance from zero has moved by rounding."""


def mean_ranges(demonstrations: Sequence[Demonstration]) -> FloatArray:
    """Mean extent of each degree of freedom over the demonstrations, (D,) array, data units, > 0.

    A degree of freedom that never moves takes the largest range of the others; if none moves, its distance from zero, or 1.

    Raises
    ------
    InputError
        If a range is so small or large that its square would not be finite.
    """
    extents = np.mean([np.nanmax(d.positions, axis=0) - np.nanmin(d.positions, axis=0) for d in demonstrations], axis=0)
    magnitudes = np.max([np.nanmax(np.abs(d.positions), axis=0) for d in demonstrations], axis=0)
    still = extents <= STILL * magnitudes
    ranges = np.where(still, (magnitudes.max() or 1.0) if still.all() else extents.max(), extents)
    if not RANGES[0] <= ranges.min() <= ranges.max() <= RANGES[1]:
        got = f"from {ranges.min():g} to {ranges.max():g}"
        raise InputError(f"movement over {RANGES[0]:g} to {RANGES[1]:g} units", got, "Rescale the data, to metres say.")
    return np.asarray(ranges)


def channel_ranges(demonstrations: Sequence[Demonstration], channels: Sequence[str]) -> FloatArray:
    """Mean extent of sensor channels over the demonstrations, (F,) array, > 0; each in its own unit.

    One that never changes takes its distance from zero, or 1.
    """
    found = []
    for name in channels:
        columns = [signals_of(d, [name])[:, -1] for d in demonstrations]
        extent = float(np.mean([np.nanmax(c) - np.nanmin(c) for c in columns]))
        magnitude = float(max(np.nanmax(np.abs(c)) for c in columns))
        found.append(extent if extent > STILL * magnitude else magnitude or 1.0)
        if not RANGES[0] <= found[-1] <= RANGES[1]:
            raise InputError(f"channel {name!r} over {RANGES[0]:g} to {RANGES[1]:g} units", f"{found[-1]:g}", "Rescale it.")
    return np.array(found, dtype=np.float64)


def largest_extent(positions: FloatArray) -> float:
    """How far one recording reaches along the axis along which it reaches furthest, data units.

    Parameters
    ----------
    positions : (T, D) array, data units; NaN where a sample is missing.
    """
    columns = [column[~np.isnan(column)] for column in positions.T]
    return float(max((np.ptp(column) for column in columns if len(column)), default=0.0))
