"""Demonstrations in a Parquet file; its layout is described in `parquet_layout`."""

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
from probdmp.io.parquet_layout import DURATION, ID, LABEL, POSITIONS, STEP, TIME, UNIT, require_pyarrow
from probdmp.io.parquet_table import ExecutionTable
from probdmp.io.recordings import Recordings, check_alike, demonstrations_of, positions_by_name

__all__ = ["read_parquet", "write_parquet"]

NUMBER_BYTES = 8


def read_parquet(
    path: str | os.PathLike[str], label: str | None = None, columns: Sequence[str] | None = None, dt: float | None = None
) -> list[Demonstration]:
    """Demonstrations from a Parquet file, all of it; `probdmp.fleet` reads files that are larger than memory.

    Parameters
    ----------
    label : keep only the demonstrations of this primitive; those without any get it.
    columns : names of the columns that are positions, in the order wanted; unless given, those that the file says.
    dt : not to be given; for formats that do not keep one.

    Raises
    ------
    DataFileError
        If the file is damaged, too large, not what it claims, or an execution in it cannot be used.
    InputError, InputTypeError
        If no demonstration has the label, the file has not the columns, or a dt is given.
    MissingExtraError
        If pyarrow is not installed.

    Warns
    -----
    RecordingWarning
        If samples that were left out of an even clock had to be put in.
    """
    if dt is not None:
        hint = "A Parquet file has its own, which is not to be overruled."
        raise InputError(f"no dt for {os.fspath(path)}", f"{dt!r}", hint)
    file = ParquetExecutions(path)
    tables, executions = _read_all(file)
    steps = {float(step) for table in tables for step in table.steps}
    if len(steps) > 1:
        hint = "Write executions with other rates to other files, or resample them first."
        raise DataFileError(f"one rate for all executions in {file.path}", f"dt of {sorted(steps)!r:.100}", hint)
    data = [np.column_stack([table.columns[name] for name in file.layout.columns]) for table in tables]
    lengths = np.concatenate([np.diff(table.offsets) for table in tables])
    recordings = Recordings(
        data=np.concatenate(data),
        offsets=[0, *np.cumsum(lengths).tolist()],
        labels=[executions.labels[code] or "" if code >= 0 else "" for code in executions.codes.tolist()],
        dt=steps.pop(),
        columns=list(file.layout.columns),
        units=[file.layout.units.get(name, "") for name in file.layout.columns],
        positions=list(file.layout.positions),
    )
    return demonstrations_of(recordings, label, columns, file.path)


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
