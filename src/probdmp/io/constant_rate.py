"""From times to the one constant rate of the demonstrations of a file, whatever its format.

Where times are even, but for jitter of a tenth of a step, samples are kept as they are, and rows left out become missing
samples. Otherwise all columns are resampled along straight lines, at the median step or at the `dt` asked for. Whatever
changes what was recorded is said in a `RecordingWarning`, but for a rate that was asked for.
"""

import itertools
import warnings
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray, check_seconds
from probdmp.demonstrations.clock import NEAR, even_step, grid_places, sampled_on_grid, typical_step
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, SHORTEST_RECORDING
from probdmp.demonstrations.resampling import CLOCK_TOLERANCE
from probdmp.errors import DataFileError, RecordingWarning
from probdmp.io.recordings import Recordings

__all__ = ["TimedTable", "at_constant_rate", "check_times", "resampled"]

SLOWEST = 1.0
"""Seconds between samples beyond which a time without a unit is taken to be in another one."""


class TimedTable(NamedTuple):
    """The samples of one demonstration and when they were taken."""

    clock: FloatArray
    """(T,) array, seconds, strictly increasing."""
    table: FloatArray
    """(T, C) array; NaN where a sample is missing."""
    place: str
    """Where it is in the file, for messages: "on lines 2 to 9", "in demonstration 3"."""


def check_times(times: FloatArray, name: str, place: Callable[[int], str], hint: str = "") -> None:
    """Refuse times that are missing, beyond all bounds, or do not increase.

    Parameters
    ----------
    times : (T,) array, any unit.
    place : where the sample of an index is, for messages: "on line 12".
    hint : what to do about times that do not increase.

    Raises
    ------
    DataFileError
        If they are not what they should be.
    """
    wrong = np.flatnonzero(np.abs(times) > LARGEST_MAGNITUDE)
    if len(wrong):
        got = f"{times[wrong[0]]:g} {place(int(wrong[0]))}"
        raise DataFileError(f"times of at most {LARGEST_MAGNITUDE:g} in {name}", got, "Correct them.")
    wrong = np.flatnonzero(np.isnan(times))
    if len(wrong):
        raise DataFileError(f"a time {place(int(wrong[0]))} of {name}", "none", "Fill it in, or leave the row out.")
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if len(wrong):
        i = int(wrong[0])
        got = f"{times[i]:.10g} followed by {times[i + 1]:.10g} {place(i + 1)}"
        raise DataFileError(f"times that increase in {name}", got, hint or "Sort the samples and drop repeated ones.")


def at_constant_rate(
    recordings: Sequence[TimedTable], dt: float | None, name: str, unit_hint: str = ""
) -> tuple[float, list[FloatArray]]:
    """Seconds between samples, and the tables (T, C) of the demonstrations at that rate.

    Parameters
    ----------
    dt : seconds between samples that are wanted; those of the file unless given.
    unit_hint : where seconds are but assumed: what to do if steps are so long that they are probably in another unit.

    Raises
    ------
    DataFileError
        If a demonstration is too short or too long, or times are in another unit.

    Warns
    -----
    RecordingWarning
        If samples had to be put in, or were resampled without being asked for.
    """
    if dt is not None and len(recordings) > 1:  # each from its own rate
        return dt, [table for recording in recordings for table in at_constant_rate([recording], dt, name)[1]]
    clocks = [recording.clock for recording in recordings]
    own = even_step(clocks)
    wanted = dt or own or typical_step(clocks)
    if unit_hint and dt is None and wanted >= SLOWEST:
        raise DataFileError(f"times in seconds in {name}", f"{wanted:g} between samples", unit_hint)
    check_seconds(wanted, f"the step between times in {name}")
    for recording in recordings:
        for spacing in {wanted, own or wanted}:
            _check_length(recording, spacing, name)
    pairs = [(recording.clock, recording.table) for recording in recordings]
    if own is not None:
        pairs = _completed(pairs, own, name)
    elif dt is None:
        _warn_uneven(clocks, wanted, name)
    if own is None or abs(wanted / own - 1) > NEAR:
        return wanted, [_resampled(clock, table, wanted) for clock, table in pairs]
    return wanted, [table for _, table in pairs]


def resampled(recordings: Recordings, dt: float | None, name: str) -> Recordings:
    """The content of a file that has a rate of its own, at the one asked for, if any; parameters and errors as above."""
    if dt is None or dt == recordings.dt:
        return recordings
    data = np.asarray(recordings.data, dtype=np.float64)
    spans = list(itertools.pairwise(recordings.offsets))
    tables = [
        TimedTable(recordings.dt * np.arange(end - start, dtype=np.float64), data[start:end], f"in demonstration {i}")
        for i, (start, end) in enumerate(spans)
        if end - start >= SHORTEST_RECORDING
    ]
    if len(tables) < len(spans):
        return recordings  # is refused as it would be at its own rate
    step, found = at_constant_rate(tables, dt, name)
    return recordings._replace(data=np.concatenate(found), offsets=[0, *itertools.accumulate(map(len, found))], dt=step)


def _check_length(recording: TimedTable, step: float, name: str) -> None:
    clock, place = recording.clock, recording.place
    span = (clock[-1] - clock[0]) / step
    if span >= LONGEST_RECORDING - 1:
        got = f"{span + 1:.3g} at {step:g} s, {place}"
        raise DataFileError(f"at most {LONGEST_RECORDING} samples per demonstration in {name}", got, "Cut it into pieces.")
    if span + 0.5 < SHORTEST_RECORDING - 1:
        got = f"{clock[-1] - clock[0]:g} s at {step:g} s, {place}"
        hint = "Choose a smaller dt. Milliseconds? Name the unit: time [ms]."
        raise DataFileError(f"at least {SHORTEST_RECORDING} samples per demonstration in {name}", got, hint)


def _completed(pairs: Sequence[tuple[FloatArray, FloatArray]], step: float, name: str) -> list[tuple[FloatArray, FloatArray]]:
    """Even clocks and tables, with rows of missing samples for those left out."""
    complete = []
    for clock, table in pairs:
        places = grid_places(clock, step)
        assert places is not None, "the clock is even"
        filled = np.full((places[-1] + 1, table.shape[1]), np.nan)
        filled[places] = table
        complete.append((clock[0] + step * np.arange(len(filled), dtype=np.float64), filled))
    left_out = sum(len(filled) for _, filled in complete) - sum(len(table) for _, table in pairs)
    if left_out:
        text = f"{name}: {left_out} rows are left out of an even clock of {step:g} s: taken as samples that are missing."
        warnings.warn(text, RecordingWarning, stacklevel=2)
    return complete


def _resampled(clock: FloatArray, table: FloatArray, step: float) -> FloatArray:
    since = clock - clock[0]
    grid = step * np.arange(int(since[-1] / step + CLOCK_TOLERANCE) + 1, dtype=np.float64)
    return sampled_on_grid(since, table, grid)


def _warn_uneven(clocks: Sequence[FloatArray], step: float, name: str) -> None:
    steps = np.concatenate([np.diff(clock) for clock in clocks])
    warnings.warn(
        f"{name}: samples are {steps.min():.3g} to {steps.max():.3g} s apart: resampled along straight lines every {step:g} s; "
        f"another dt (--dt on the command line) says otherwise.",
        RecordingWarning,
        stacklevel=2,
    )
