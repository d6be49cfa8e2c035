"""Demonstrations in a Parquet file: in the layout that `parquet_layout` describes, or in any table, see `parquet_foreign`."""

import io
import json
import os
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError, RecordingWarning
from probdmp.io.archive import LARGEST_ARCHIVE
from probdmp.io.atomic import write_atomically
from probdmp.io.parquet_executions import Executions, ParquetExecutions, Span
from probdmp.io.parquet_foreign import read_foreign
from probdmp.io.parquet_layout import DURATION, ID, LABEL, POSITIONS, STEP, TIME, UNIT, layout_of, open_parquet, require_pyarrow
from probdmp.io.parquet_table import ExecutionTable
from probdmp.io.recordings import check_alike, demonstrations_of, positions_by_name
from probdmp.io.selection import EVERYTHING, Selection
from probdmp.io.timed_recordings import Table, recordings_of

__all__ = ["read_parquet", "write_parquet"]

NUMBER_BYTES = 8


def read_parquet(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """Demonstrations from a Parquet file, all of it; `probdmp.fleet` reads files that are larger than memory.

    Raises
    ------
    DataFileError
        If the file is damaged, too large, not what it claims, or an execution in it cannot be used.
    InputError, InputTypeError
        If no demonstration has the label, the file has not the columns.
    MissingExtraError
        If pyarrow is not installed.

    Warns
    -----
    RecordingWarning
        If samples that were left out of an even clock had to be put in.
    """
    name = os.fspath(path)
    schema = open_parquet(path).schema_arrow
    if ID not in schema.names or (selection.dt is not None and not layout_of(schema, name).is_dense):
        return demonstrations_of(read_foreign(path, selection), selection, name)
    file = ParquetExecutions(path)
    tables, executions = _read_all(file)
    steps = np.concatenate([table.steps for table in tables]).tolist()
    labels = [executions.labels[code] or "" if code >= 0 else "" for code in executions.codes.tolist()]
    if selection.dt is None and len(set(steps)) > 1:
        hint = "Resample them to one: dt=0.01, --dt 0.01 on the command line."
        raise DataFileError(f"one rate for all executions in {name}", f"dt of {sorted(set(steps))!r:.100}", hint)
    samples = [(table.execution(i), int(n)) for table in tables for i, n in enumerate(np.diff(table.offsets))]
    own = [
        Table(columns, step * np.arange(n, dtype=np.float64), label, f"in execution {i + 1}", file.layout.units)
        for i, ((columns, n), step, label) in enumerate(zip(samples, steps, labels, strict=True))
    ]
    recordings = recordings_of(own, file.layout.positions, {}, selection.dt or steps[0], name)
    return demonstrations_of(recordings, selection, name)


def _read_all(file: ParquetExecutions) -> tuple[list[ExecutionTable], Executions]:
    """Every execution of a file, none of which may be unusable."""
    import pyarrow.compute as pc

    executions, layout = file.executions(), file.layout
    n_rows = int(file.bounds[-1])
    if not layout.columns or not len(executions):
        raise DataFileError(f"executions in {file.path}", f"{n_rows} rows with no column that was measured")
    if n_rows * (len(layout.columns) + 2) * NUMBER_BYTES > LARGEST_ARCHIVE:
        hint = "Learn from it piece by piece: probdmp fit --by primitive."
        raise DataFileError(f"at most {LARGEST_ARCHIVE} bytes of samples in {file.path}", f"{n_rows} rows", hint)
    if pc.count_distinct(executions.ids, mode="all").as_py() < len(executions):
        raise DataFileError(f"each {ID} once in {file.path}", "one in several places", "Sort the rows, or number them anew.")
    counts = None if layout.is_dense else np.diff(executions.starts)
    tables = list(file.read(Span(0, n_rows, counts), layout.columns))
    for table in tables:
        for i in np.flatnonzero(~table.usable)[:1]:
            where = f"Execution {table.ids[int(i)].as_py()!r}."
            raise DataFileError(f"executions that can be used in {file.path}", f"this: {table.problems[i]}", where)
    left_out = sum(int(np.diff(table.offsets).sum() - table.counts.sum()) for table in tables)
    if left_out:
        text = f"{file.path}: {left_out} rows are left out of even clocks: taken as samples that are missing."
        warnings.warn(text, RecordingWarning, stacklevel=3)
    return tables, executions


def write_parquet(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write demonstrations, one row per sample, replacing the file in one step; reading gives the same values back.

    Raises
    ------
    InputError, InputTypeError
        If there are none, they differ in dt, names, units or channels, or a column has a name that has another meaning.
    MissingExtraError
        If pyarrow is not installed.
    """
    require_pyarrow()
    import pyarrow as pa
    import pyarrow.parquet as pq

    checked = check_alike(demonstrations)
    first = checked[0]
    columns = [*first.names, *first.channels]
    reserved = {ID, LABEL, TIME, STEP, DURATION, *(f"{start}_{name}" for start in ("start", "goal") for name in columns)}
    if not reserved.isdisjoint(columns) or "" in columns:
        raise InputError(f"columns not named {', '.join(sorted(reserved)[:5])} …", repr(columns), "Rename them.")
    lengths = [demonstration.n_samples for demonstration in checked]
    labels = pa.array([d.label for d in checked]).dictionary_encode()
    values: dict[str, Any] = {
        ID: np.repeat(np.arange(len(checked)), lengths),
        LABEL: labels.take(pa.array(np.repeat(np.arange(len(checked)), lengths))),
        TIME: np.concatenate([d.times for d in checked]),
        **{name: np.concatenate([d.positions[:, i] for d in checked]) for i, name in enumerate(first.names)},
        **{name: np.concatenate([d.channels[name] for d in checked]) for name in first.channels},
    }
    units = {name: {UNIT: first.units.encode()} for name in first.names if first.units}
    arrays = {name: pa.array(value) for name, value in values.items()}
    fields = [pa.field(name, array.type, metadata=units.get(name)) for name, array in arrays.items()]
    plain = positions_by_name(columns) == list(first.names)
    metadata = None if plain else {POSITIONS: json.dumps(first.names).encode()}
    buffer = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(list(arrays.values()), schema=pa.schema(fields, metadata)), buffer)
    write_atomically(path, buffer.getvalue())
