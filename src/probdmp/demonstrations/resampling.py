"""From recordings with their own clock to the constant rate that everything else assumes, and to common phases."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from probdmp.checks import FloatArray, check_array, check_seconds, shape_text
from probdmp.demonstrations.clock import sampled_on_grid
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, Demonstration, signals_of
from probdmp.errors import InputError

__all__ = ["CLOCK_TOLERANCE", "channel_from_times", "demonstration_from_times", "signals_on_phases"]

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


def signals_on_phases(demonstrations: Sequence[Demonstration], n_phases: int, channels: Sequence[str] = ()) -> FloatArray:
    """Positions and channels at n_phases times evenly spaced from first to last sample, along straight lines over what was
    measured.

    Returns
    -------
    (K, n_phases, S) array, units of each signal.
    """
    phases = np.linspace(0.0, 1.0, n_phases)
    tables = [signals_of(demonstration, channels) for demonstration in demonstrations]
    paths = np.empty((len(tables), n_phases, tables[0].shape[1]))
    for path, table in zip(paths, tables, strict=True):
        own = np.linspace(0.0, 1.0, len(table))
        for d, column in enumerate(table.T):
            seen = ~np.isnan(column)
            path[:, d] = np.interp(phases, own[seen], column[seen])
    return paths


def channel_from_times(demonstration: Demonstration, name: str, times: ArrayLike, values: ArrayLike) -> Demonstration:
    """The demonstration with one more channel, of a sensor with a clock of its own: each reading at the sample nearest to it.

    Parameters
    ----------
    times : (n,) array, seconds from the first sample of the demonstration.
    values : (n,) array, or (n, O) for outputs name_0, name_1, …. At samples without a reading the channel is NaN.

    Raises
    ------
    InputError
        If two readings fall on one sample, or one outside of the recording.
    """
    clock = check_array(times, "times", ("n",))
    table = check_array(
        values, f"values of {name!r:.50}", (len(clock), "O") if np.ndim(values) > 1 else (len(clock),), missing=True
    )
    table = table if table.ndim > 1 else table[:, None]
    places = np.round(clock / demonstration.dt).astype(np.int64)
    if len(places) and not 0 <= places.min() <= places.max() < demonstration.n_samples:
        hint = f"The recording lasts {demonstration.duration:g} s. Do both clocks begin together?"
        raise InputError("readings within the recording", f"some from {clock.min():g} to {clock.max():g} s", hint)
    if len(np.unique(places)) < len(places):
        hint = "Take every second one, say, or resample the demonstration to a smaller dt."
        raise InputError(f"at most one reading per sample of {demonstration.dt:g} s", "several", hint)
    columns = np.full((demonstration.n_samples, table.shape[1]), np.nan)
    columns[places] = table
    names = [name] if table.shape[1] == 1 else [f"{name}_{i}" for i in range(table.shape[1])]
    return replace(demonstration, channels={**demonstration.channels, **dict(zip(names, columns.T, strict=True))})
