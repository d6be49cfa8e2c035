"""Any Parquet file with a row for each sample, whoever wrote it: columns are named as in a CSV file, or chosen with `columns`.

    time     t, time or timestamp: a timestamp, or a number, seconds unless a unit says otherwise, as in "time [ms]"
    cut      demonstration, demo, trial, episode, execution, recording, execution_id or episode_index
    label    label, class or primitive: text
    numbers  all others; of lists that are equally long, `q` becomes q_0, q_1, … Units as "x [mm]", or as `unit` of the column

Case does not matter but for numbers; text and what is nested deeper is left out.
"""

import itertools
import os
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from probdmp.checks import IntArray
from probdmp.errors import DataFileError
from probdmp.io.archive import LARGEST_ARCHIVE
from probdmp.io.constant_rate import check_times
from probdmp.io.csv_header import PER_SECOND, split_unit
from probdmp.io.parquet_arrays import codes_of, seconds_of
from probdmp.io.parquet_columns import Roles, columns_of, roles_of
from probdmp.io.parquet_layout import is_moment, open_parquet, positions_told
from probdmp.io.recordings import MOST_COLUMNS, Recordings
from probdmp.io.selection import Selection
from probdmp.io.timed_recordings import Table, recordings_of

__all__ = ["read_foreign"]

UNIT_HINT = "Times in milliseconds? Name the column time [ms]; or time [s] if it is seconds."


def read_foreign(path: str | os.PathLike[str], selection: Selection) -> Recordings:
    """The content of such a file.

    Raises
    ------
    DataFileError
        If it is damaged, too large, or its times cannot be used.
    InputError
        If it has no times, and dt is not given.
    """
    name = os.fspath(path)
    file = open_parquet(path)
    schema, n_rows = file.schema_arrow, file.metadata.num_rows
    roles = roles_of(schema, name)
    if n_rows * (file.metadata.num_columns + 1) * 8 > LARGEST_ARCHIVE or file.metadata.num_columns > MOST_COLUMNS:
        got = f"{n_rows} rows of {file.metadata.num_columns}"
        raise DataFileError(f"at most {LARGEST_ARCHIVE} bytes of samples in {MOST_COLUMNS} columns in {name}", got)
    rows = _read(file, [title for title in (*roles[:3], *roles.numbers) if title is not None], name)
    columns, groups, units = columns_of(rows, roles.numbers, schema, name)
    starts, labels = _cut(rows, roles, name)
    clock, per_second = None, 1.0
    if roles.time is not None:
        clock, per_second = seconds_of(rows[roles.time]), PER_SECOND[split_unit(roles.time)[1].lower()]
    tables = []
    for i, (start, end) in enumerate(itertools.pairwise([*starts.tolist(), n_rows])):
        place = f"in rows {start} to {end - 1}"
        if clock is not None:
            check_times(clock[start:end], name, partial(_row, start))
        own = None if clock is None else clock[start:end] / per_second
        samples = {column: values[start:end] for column, values in columns.items()}
        tables.append(Table(samples, own, labels[i], place, units))
    told = roles.time is None or is_moment(schema.field(roles.time).type) or split_unit(roles.time)[1]
    return recordings_of(tables, positions_told(schema, columns), groups, selection.dt, name, "" if told else UNIT_HINT)


def _row(start: int, k: int) -> str:
    return f"in row {start + k}"


def _read(file: Any, titles: Sequence[str], name: str) -> Any:
    import pyarrow as pa

    try:
        return file.read(list(titles), use_threads=False)
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        raise DataFileError(f"an undamaged Parquet file at {name!r}", reason, "Copy or write it again.") from error


def _cut(rows: Any, roles: Roles, name: str) -> tuple[IntArray, list[str]]:
    """The first row of each demonstration, and its label."""
    keys: list[Any] = [codes_of(rows[title])[0] for title in (roles.cut, roles.label) if title is not None]
    changes = np.zeros(len(rows), dtype=np.bool_)
    changes[:1] = True
    for codes in keys:
        changes[1:] |= codes[1:] != codes[:-1]
    starts = np.flatnonzero(changes)
    if roles.cut is not None:
        seen = set(zip(*(codes[starts].tolist() for codes in keys), strict=True))
        if len(seen) < len(starts):
            hint = f"Sort the rows by {roles.cut!r}, then by time."
            raise DataFileError(f"each {roles.cut} in one piece in {name}", "more of one after another", hint)
    texts: Mapping[int, str] = {}
    if roles.label is not None:
        codes, values = codes_of(rows[roles.label])
        texts = dict(enumerate(values))
        return starts, [texts.get(code) or "" for code in codes[starts].tolist()]
    return starts, [""] * len(starts)
