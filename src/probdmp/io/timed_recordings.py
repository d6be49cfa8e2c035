"""Tables of samples, each with a clock of its own, as the content of a file at one rate."""

import itertools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import SHORTEST_RECORDING
from probdmp.errors import DataFileError, InputError, RecordingWarning
from probdmp.io.constant_rate import TimedTable, at_constant_rate
from probdmp.io.recordings import MOST_COLUMNS, MOST_DEMONSTRATIONS, Recordings, listing

__all__ = ["Table", "recordings_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """One demonstration as it is in a file."""

    columns: Mapping[str, FloatArray]
    """(T,) arrays by name; NaN where a sample is missing."""
    clock: FloatArray | None
    """(T,) array, seconds, strictly increasing; None where the file has no times."""
    label: str
    place: str
    """Where it is in the file, for messages: "in demonstration 3"."""
    units: Mapping[str, str] = field(default_factory=dict)
    """By column, where the file says it."""


def recordings_of(
    tables: Sequence[Table],
    positions: Sequence[str],
    groups: Mapping[str, Sequence[str]],
    dt: float | None,
    name: str,
    unit_hint: str = "",
) -> Recordings:
    """The content of a file, with the columns that all its demonstrations have.

    Parameters
    ----------
    positions : which columns are positions, if the file says so.
    groups : names that stand for several columns.
    dt : seconds between samples, where that is asked for.
    unit_hint : as for `at_constant_rate`.

    Raises
    ------
    DataFileError
        If there are none or too many, or they have no columns in common.
    InputError
        If there are neither times nor dt.

    Warns
    -----
    RecordingWarning
        If some have other columns too, or times are not even.
    """
    if not 1 <= len(tables) <= MOST_DEMONSTRATIONS:
        raise DataFileError(f"1 to {MOST_DEMONSTRATIONS} demonstrations in {name}", str(len(tables)))
    columns = [column for column in tables[0].columns if all(column in table.columns for table in tables)]
    if not columns or len(columns) > MOST_COLUMNS:
        expected = f"1 to {MOST_COLUMNS} columns of numbers that all demonstrations have in {name}"
        raise DataFileError(expected, f"{len(columns)}; the first has {listing(map(repr, tables[0].columns), 10)}")
    others = dict.fromkeys(column for table in tables for column in table.columns if column not in columns)
    if others:
        text = f"{name}: columns that only some demonstrations have, left out: {listing(map(repr, others), 10)}."
        warnings.warn(text, RecordingWarning, stacklevel=3)
    data = [np.column_stack([table.columns[column] for column in columns]) for table in tables]
    for table, samples in zip(tables, data, strict=True):
        if len(samples) < SHORTEST_RECORDING:
            expected = f"at least {SHORTEST_RECORDING} samples per demonstration in {name}"
            raise DataFileError(expected, f"{len(samples)} {table.place}")
    step, at_rate = _at_constant_rate(tables, data, dt, name, unit_hint)
    return Recordings(
        data=np.concatenate(at_rate),
        offsets=[0, *itertools.accumulate(map(len, at_rate))],
        labels=[table.label for table in tables],
        dt=step,
        columns=columns,
        units=[tables[0].units.get(column, "") for column in columns],
        positions=[column for column in positions if column in columns],
        groups={key: names for key, names in groups.items() if set(names) <= set(columns)},
    )


def _at_constant_rate(
    tables: Sequence[Table], data: Sequence[FloatArray], dt: float | None, name: str, unit_hint: str
) -> tuple[float, Sequence[FloatArray]]:
    timed = [
        TimedTable(table.clock, samples, table.place)
        for table, samples in zip(tables, data, strict=True)
        if table.clock is not None
    ]
    if len(timed) == len(tables):
        return at_constant_rate(timed, dt, name, unit_hint)
    if dt is None or timed:
        got = "times in some demonstrations only" if timed else "neither"
        hint = "Say how far apart the samples are: dt=0.01 for 100 Hz, --dt 0.01 on the command line."
        raise InputError(f"times in {name}, or dt", got, hint)
    return dt, data
