"""From the times of many executions to the one constant rate that each of them has, as `csv_clock` does for a few.

Where times are even but for jitter of a tenth of a step, samples are kept as they are, and rows left out become missing
samples. Other executions are not to be used as they stand. All of it on flat arrays: execution i has the samples
`offsets[i]:offsets[i + 1]`, at least one.
"""

from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, FloatArray, IntArray
from probdmp.demonstrations.clock import EVEN, NEAR
from probdmp.demonstrations.demonstration import LONGEST_RECORDING

__all__ = ["EvenClocks", "even_clocks"]

EXACT = 1e-9
"""Fraction by which the mean step of a clock that begins at 0 may miss its second time, which is then the step."""


class EvenClocks(NamedTuple):
    """Where the samples of N executions belong."""

    steps: FloatArray
    """(N,) array, seconds between samples; NaN where there is no such step."""
    increase: BoolArray
    """(N,) array: whether the times are numbers that increase."""
    places: IntArray | None
    """(sum T,) array: at which multiple of the step each sample was taken; None where none was left out anywhere."""


def even_clocks(times: FloatArray, offsets: IntArray) -> EvenClocks:
    """The constant rates of executions.

    Parameters
    ----------
    times : (sum T,) array, seconds.
    """
    firsts, counts = offsets[:-1], np.diff(offsets)
    with np.errstate(invalid="ignore", over="ignore"):
        spans = times[offsets[1:] - 1] - times[firsts]
        usable = (counts >= 2) & np.isfinite(spans) & (spans > 0)
        means = np.where(usable, spans / np.maximum(counts - 1, 1), np.nan)
        seconds = times[firsts + np.minimum(counts - 1, 1)]
        exact = (times[firsts] == 0) & (np.abs(means - seconds) <= EXACT * seconds)
    steps = np.where(exact, seconds, _simplest(means))
    even = _is_even(times, offsets, steps)
    if even.all():  # and so they increase
        return EvenClocks(steps, even, None)
    with np.errstate(invalid="ignore", over="ignore"):
        gaps = _own_gaps(times, offsets)
        increase = (np.minimum.reduceat(gaps, firsts) > 0) | (counts < 2)  # NaN does not
    doubtful = np.flatnonzero(usable & increase & ~even)
    steps[~even] = np.nan
    if not len(doubtful):
        return EvenClocks(steps, increase, None)
    places = np.arange(len(times)) - np.repeat(firsts, counts)
    steps[doubtful], places[_samples_of(offsets, doubtful)] = _with_gaps(times, gaps, offsets, doubtful)
    return EvenClocks(steps, increase, places)


def _own_gaps(times: FloatArray, offsets: IntArray) -> FloatArray:
    """(sum T,) array: from each sample to the next one of its execution; from the last one, the first gap again."""
    gaps = np.empty_like(times)
    np.subtract(times[1:], times[:-1], out=gaps[:-1])
    gaps[offsets[1:] - 1] = gaps[offsets[:-1]]
    return gaps


def _simplest(steps: FloatArray) -> FloatArray:
    """Steps with few digits where these are as good, so that executions of one device agree."""
    two, six = _rounded(steps, 2), _rounded(steps, 6)
    return np.where(np.abs(two / np.where(steps > 0, steps, 1.0) - 1) <= NEAR, two, six)


def _rounded(values: FloatArray, digits: int) -> FloatArray:
    """In so many significant digits, to the nearest number that text with these digits gives."""
    different, where = np.unique(values, return_inverse=True)
    return np.array([float(f"{value:.{digits}g}") for value in different.tolist()])[where.reshape(values.shape)]


def _is_even(times: FloatArray, offsets: IntArray, steps: FloatArray) -> BoolArray:
    """(N,) array: whether each sample is at its place, the k-th one k steps after the first."""
    counts, firsts = np.diff(offsets), offsets[:-1]
    with np.errstate(invalid="ignore", over="ignore"):
        if len(counts) and (counts == counts[0]).all():
            clocks = times.reshape(len(counts), -1)
            misses = steps[:, None] * np.arange(counts[0])
            misses += clocks[:, :1]
            misses -= clocks
            astray = np.maximum(misses.max(axis=1), -misses.min(axis=1))
        else:
            ticks = np.arange(len(times)) - np.repeat(firsts, counts)
            astray = np.abs(times - np.repeat(times[firsts], counts) - ticks * np.repeat(steps, counts))
            astray = np.maximum.reduceat(astray, firsts)
        return np.asarray(astray <= EVEN * steps)


def _with_gaps(times: FloatArray, gaps: FloatArray, offsets: IntArray, which: IntArray) -> tuple[FloatArray, IntArray]:
    """The steps of some executions that are even but for samples left out, and the places of their samples.

    Returns
    -------
    (M,) array, seconds, NaN where times are not even; and the places of all samples of these executions.
    """
    counts = np.diff(offsets)[which]
    starts = np.concatenate([[0], np.cumsum(counts)])
    samples, owners = _samples_of(offsets, which), np.repeat(np.arange(len(which)), counts)
    order = np.lexsort((gaps[samples], owners))
    medians = gaps[samples][order[starts[:-1] + (counts - 1) // 2]]
    steps = _simplest(np.where(np.isfinite(medians) & (medians > 0), medians, np.nan))
    with np.errstate(invalid="ignore", over="ignore"):
        exact = (times[samples] - np.repeat(times[offsets[which]], counts)) / np.repeat(steps, counts)
        small = exact < LONGEST_RECORDING
        places = np.where(small, np.rint(np.where(small, exact, 0)), 0).astype(np.int64)
        wrong = ~small | (np.abs(exact - places) > EVEN)
    wrong[1:] |= (np.diff(places) < 1) & (np.diff(owners) == 0)
    astray = np.logical_or.reduceat(wrong, starts[:-1])
    ticks = np.arange(len(samples)) - np.repeat(starts[:-1], counts)
    return np.where(astray, np.nan, steps), np.where(np.repeat(astray, counts), ticks, places)


def _samples_of(offsets: IntArray, which: IntArray) -> IntArray:
    """Places in the flat arrays of all samples of some executions."""
    counts = np.diff(offsets)[which]
    ends = np.cumsum(counts)
    return np.arange(int(ends[-1])) + np.repeat(offsets[which] - ends + counts, counts)
