"""From the times in a CSV file to the one constant rate of its demonstrations.

Where times are even, but for jitter of a tenth of a step, samples are kept as they are, and rows left out become missing
samples. Otherwise all columns are resampled along straight lines, at the median step or at the `dt` asked for. Whatever
changes what was recorded is said in a `RecordingWarning`, but for a rate that was asked for.
"""

import warnings
from collections.abc import Sequence

import numpy as np

from probdmp.checks import LARGEST_MAGNITUDE, FloatArray, check_seconds
from probdmp.demonstrations.clock import NEAR, even_step, grid_places, sampled_on_grid, typical_step
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, SHORTEST_RECORDING
from probdmp.demonstrations.resampling import CLOCK_TOLERANCE
from probdmp.errors import DataFileError, InputError, RecordingWarning
from probdmp.io.csv_header import Header
from probdmp.io.csv_table import Block

__all__ = ["constant_rate"]

SLOWEST = 1.0
"""Seconds between samples beyond which a time without a unit is taken to be in another one."""


def constant_rate(header: Header, blocks: Sequence[Block], dt: float | None, name: str) -> tuple[float, list[FloatArray]]:
    """Seconds between samples, and the tables (T, C) of the demonstrations without their times.

    Parameters
    ----------
    dt : seconds between samples: those of the rows in a file without times, those wanted in one with times.

    Raises
    ------
    DataFileError, InputError
        If a demonstration is too short or too long, times do not increase, or there are neither times nor a dt.
    """
    step = None if dt is None else check_seconds(dt, "dt")
    for block in blocks:
        _check_rows(block, name)
    if header.time is None:
        if step is None:
            hint = "Say how far apart the samples are: dt=0.01 for 100 Hz, --dt 0.01 on the command line."
            raise InputError(f"a column named time or t in {name}, or dt", "neither", hint)
        return step, [block.table for block in blocks]
    clocks = [_clock(block, header, name) for block in blocks]
    own = even_step(clocks)
    wanted = step or own or typical_step(clocks)
    if not header.time_unit and step is None and wanted >= SLOWEST:
        hint = "Say the unit in the header, such as time [ms], or time [s] if it is seconds."
        raise DataFileError(f"times in seconds in {name}", f"{wanted:g} between samples", hint)
    check_seconds(wanted, f"the step between times in {name}")
    for clock, block in zip(clocks, blocks, strict=True):
        for spacing in {wanted, own or wanted}:
            _check_length(clock, block, spacing, name)
    pairs = [(clock, block.table[:, 1:]) for clock, block in zip(clocks, blocks, strict=True)]
    if own is not None:
        pairs = _completed(pairs, own, name)
    elif step is None:
        _warn_uneven(clocks, wanted, name)
    if own is None or abs(wanted / own - 1) > NEAR:
        return wanted, [_resampled(clock, table, wanted) for clock, table in pairs]
    return wanted, [table for _, table in pairs]


def _check_rows(block: Block, name: str) -> None:
    if len(block.lines) < SHORTEST_RECORDING:
        rows = f"{len(block.lines)} on {_span(block)}"
        hint = "Does every row begin another demonstration? Then leave that column out."
        raise DataFileError(f"at least {SHORTEST_RECORDING} rows per demonstration in {name}", rows, hint)


def _clock(block: Block, header: Header, name: str) -> FloatArray:
    """(T,) array, seconds, strictly increasing."""
    times = block.table[:, 0]
    wrong = np.flatnonzero(np.abs(times) > LARGEST_MAGNITUDE)
    if len(wrong):
        got = f"{times[wrong[0]]:g} on line {block.lines[wrong[0]]}"
        raise DataFileError(f"times of at most {LARGEST_MAGNITUDE:g} in {name}", got, "Correct them.")
    wrong = np.flatnonzero(np.isnan(times))
    if len(wrong):
        raise DataFileError(f"a time on line {block.lines[wrong[0]]} of {name}", "none", "Fill it in, or leave the row out.")
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if len(wrong):
        i = int(wrong[0])
        got = f"{times[i]:.10g} followed by {times[i + 1]:.10g} on line {block.lines[i + 1]}"
        hint = "Sort the rows and drop repeated ones. Another demonstration? Number them in a column demonstration."
        raise DataFileError(f"times that increase in {name}", got, hint)
    return times / header.per_second


def _check_length(clock: FloatArray, block: Block, step: float, name: str) -> None:
    span = (clock[-1] - clock[0]) / step
    if span >= LONGEST_RECORDING - 1:
        got = f"{span + 1:.3g} at {step:g} s, on {_span(block)}"
        raise DataFileError(f"at most {LONGEST_RECORDING} samples per demonstration in {name}", got, "Cut it into pieces.")
    if span + 0.5 < SHORTEST_RECORDING - 1:
        got = f"{clock[-1] - clock[0]:g} s at {step:g} s, on {_span(block)}"
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


def _span(block: Block) -> str:
    return f"lines {block.lines[0]} to {block.lines[-1]}"
