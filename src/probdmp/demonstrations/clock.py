"""Clocks of recordings: whether they are even, and tables put onto an even one."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray

__all__ = ["EVEN", "NEAR", "even_step", "grid_places", "rounded", "sampled_on_grid", "typical_step"]

EVEN = 0.1
"""Fraction of a step by which the times of an even clock may miss their places: clocks are read late and printed rounded."""
EXACT = 1e-6
"""The same for a step that is taken from the first two times as it is."""
NEAR = 1e-3
"""Fraction by which a step may change to become one of two digits: 100.02 Hz is 100 Hz."""


def even_step(clocks: Sequence[FloatArray]) -> float | None:
    """The step, seconds, of which all times of all recordings are multiples but for jitter; None if there is none.

    Rows may be missing. Steps with few digits are preferred, so that recordings of one device agree.

    Parameters
    ----------
    clocks : (T_i,) arrays, seconds, each strictly increasing, with at least two times.
    """
    for candidate, tolerance in _candidates(clocks):
        if all(grid_places(clock, candidate, tolerance) is not None for clock in clocks):
            return candidate
    return None


def typical_step(clocks: Sequence[FloatArray]) -> float:
    """The median of all steps, seconds, in two digits; parameters as in `even_step`."""
    return rounded(float(np.median(np.concatenate([np.diff(clock) for clock in clocks]))), 2)


def grid_places(clock: FloatArray, step: float, tolerance: float = EVEN) -> NDArray[np.int64] | None:
    """Which multiple of the step after the first time each time is, (T,) array; None if one is none or two are the same."""
    with np.errstate(over="ignore"):
        exact = (clock - clock[0]) / step
    if exact[-1] >= 2**53:
        return None
    places = np.rint(exact).astype(np.int64)
    if np.any(np.abs(exact - places) > tolerance) or np.any(np.diff(places) < 1):
        return None
    return places


def sampled_on_grid(clock: FloatArray, table: FloatArray, grid: FloatArray) -> FloatArray:
    """A table at other times, along straight lines; a value is missing where one of its two neighbours is.

    Parameters
    ----------
    clock : (T,) array, seconds, strictly increasing, T ≥ 2.
    table : (T, C) array; NaN where a sample is missing.
    grid : (N,) array, seconds, within the clock but for rounding.

    Returns
    -------
    (N, C) array.
    """
    left = np.clip(np.searchsorted(clock, grid, side="right") - 1, 0, len(clock) - 2)
    share = np.clip((grid - clock[left]) / (clock[left + 1] - clock[left]), 0.0, 1.0)[:, None]
    # A neighbour without weight may be missing: NaN times zero is NaN.
    before, after = (1 - share) * table[left], share * table[left + 1]
    return np.where(share == 0, table[left], np.where(share == 1, table[left + 1], before + after))


def rounded(value: float, digits: int) -> float:
    """A number in so many significant digits."""
    return float(f"{value:.{digits}g}")


def _candidates(clocks: Sequence[FloatArray]) -> Iterator[tuple[float, float]]:
    """Steps to try, with the tolerance of each, the most exact and then the simplest first."""
    if clocks[0][0] == 0:
        yield float(clocks[0][1]), EXACT
    steps = np.concatenate([np.diff(clock) for clock in clocks])
    mean = float(sum(clock[-1] - clock[0] for clock in clocks)) / len(steps)
    for step in (mean, float(np.median(steps))):
        if abs(rounded(step, 2) / step - 1) <= NEAR:
            yield rounded(step, 2), EVEN
        yield rounded(step, 6), EVEN
