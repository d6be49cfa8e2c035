"""Reading executions from a Parquet file piece by piece, with as little memory as one piece needs."""

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from probdmp.checks import IntArray
from probdmp.demonstrations.demonstration import LONGEST_RECORDING
from probdmp.errors import DataFileError
from probdmp.io.parquet_arrays import codes_of, plain_names, recoded
from probdmp.io.parquet_layout import ID, LABEL, STEP, TIME, layout_of, open_parquet
from probdmp.io.parquet_table import ExecutionTable, joined, table_of_lists, table_of_samples
from probdmp.io.read_ahead import read_ahead

__all__ = ["Executions", "ParquetExecutions", "Span"]

PIECE = 2**19
"""Samples that are read at a time, about: so few that their times and names stay at hand while they are looked at."""
TABLE = 2**24
"""Numbers that were measured in the executions that are handed over together, about."""
FOOTER = 2**26
"""Bytes of the end of a file, at most, by which it is known again."""
NONE_YET = object()
FEWEST = 2
"""Rows per execution, on average, below which rows of one are certainly not together."""


class Span(NamedTuple):
    """Executions that follow one another in a file."""

    start: int
    """First row."""
    stop: int
    """Row after the last one."""
    counts: IntArray | None
    """(N,) array: rows of each execution; None where a row is an execution."""
    ids: Any = None
    """(N) Arrow array: names of executions of several rows, where they need not be read again."""


class Executions(NamedTuple):
    """Where the N executions of a file are."""

    ids: Any
    """(N) Arrow array; null where an execution has none."""
    starts: IntArray
    """(N + 1,) array: execution i has the rows `starts[i]:starts[i + 1]`."""
    codes: IntArray
    """(N,) array: which of `labels` each has; -1 for none, or where they were not read."""
    labels: list[str]

    def __len__(self) -> int:
        return len(self.starts) - 1


class ParquetExecutions:
    """A Parquet file of executions, opened.

    Parameters
    ----------
    label : name of the column that says what movement an execution is.

    Raises
    ------
    DataFileError
        If it is not an undamaged Parquet file with such columns.
    MissingExtraError
        If pyarrow is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], label: str = LABEL) -> None:
        self.path = os.fspath(path)
        schema = open_parquet(path).schema_arrow
        self.layout = layout_of(schema, self.path, label)
        texts = [name for name in (ID, label) if name in schema.names]
        self._file = open_parquet(path, read_dictionary=texts)
        self.schema = schema
        groups = range(self._file.num_row_groups)
        self.bounds = np.cumsum([0, *(self._file.metadata.row_group(i).num_rows for i in groups)])
        """(G + 1,) array: row group i has the rows `bounds[i]:bounds[i + 1]`."""

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of the size and the end of the file, which says where and how large everything else is."""
        with open(self.path, "rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(size - 8, 0))
            footer = min(int.from_bytes(file.read(4), "little") + 8, size, FOOTER)
            file.seek(size - footer)
            return hashlib.sha256(str(size).encode() + file.read(footer)).hexdigest()

    @cached_property
    def samples_per_row(self) -> float:
        """How many samples a row has on average."""
        groups = [self._file.metadata.row_group(i) for i in range(len(self.bounds) - 1)]
        columns = range(self._file.metadata.num_columns)
        most = sum(max(group.column(i).num_values for i in columns) for group in groups)
        return most / max(int(self.bounds[-1]), 1)

    def executions(self, labels: bool = True) -> Executions:
        """Where executions are: reads their names only.

        Parameters
        ----------
        labels : whether what movement they are is read too.

        Raises
        ------
        DataFileError
            If rows of an execution are not together.
        """
        import pyarrow as pa

        ids, starts, codes, names = [], [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)], dict[str, int]()
        previous: object = NONE_YET
        label = self.layout.label if labels else None
        columns = [ID, *([label] if label else [])]
        for first, batch in read_ahead(self._batches(0, int(self.bounds[-1]), columns, PIECE)):
            begins = np.arange(len(batch)) if self.layout.is_dense else _begins(batch[ID], previous)
            previous = batch[ID][-1].as_py()
            ids.append(plain_names(batch[ID].take(pa.array(begins))))
            starts.append(first + begins)
            if label:
                own, texts = codes_of(batch[label])
                codes.append(recoded(own[begins], texts, names))
            self._check_together(sum(map(len, starts)), first + len(batch))
        every, n_rows = np.concatenate(starts), int(self.bounds[-1])
        kind = ids[0].type if ids else pa.string()
        found = np.concatenate(codes) if label else np.full(len(every), -1)
        return Executions(pa.chunked_array(ids, type=kind), np.append(every, n_rows), found, list(names))

    def read(self, span: Span, columns: Sequence[str]) -> Iterator[ExecutionTable]:
        """The executions of a span in their order, in as few tables as memory allows, about equally large.

        Parameters
        ----------
        columns : what was measured, of `layout.columns`, is wanted; what executions were told comes with it.

        Raises
        ------
        DataFileError
            If the file is damaged.
        """
        layout = self.layout
        clock = [TIME] if layout.has_times else [STEP]
        name = [ID] if span.ids is None else []
        names = [*name, *([layout.label] if layout.label else []), *clock, *columns, *layout.told]
        if span.counts is None:
            size = max(int(PIECE / max(self.samples_per_row, 1)), 1)
            batches = self._batches(span.start, span.stop, names, size)
            pieces: Iterator[ExecutionTable] = (table_of_lists(batch, layout, columns) for _, batch in batches)
        else:
            pieces = self._read_samples(span, span.counts, names, columns)
        n_executions = span.stop - span.start if span.counts is None else len(span.counts)
        n_samples = (span.stop - span.start) * (self.samples_per_row if span.counts is None else 1)
        return _together(pieces, ceil(n_executions / ceil((n_samples * len(columns) + 1) / TABLE)))

    def _read_samples(
        self, span: Span, counts: IntArray, names: Sequence[str], columns: Sequence[str]
    ) -> Iterator[ExecutionTable]:
        """Of executions that are too long, the first row only."""
        import pyarrow as pa

        ends = np.cumsum(np.where(counts > LONGEST_RECORDING, 1, counts))
        held: list[Any] = []
        n_read, base, done = 0, 0, 0
        for batch in self._without_rest(span, counts, names):
            held.append(batch)
            n_read += len(batch)
            complete = int(np.searchsorted(ends, n_read, side="right"))
            if complete == done or (n_read - base < PIECE and complete < len(counts)):
                continue
            rows, n_rows = pa.Table.from_batches(held), int(ends[complete - 1]) - base
            ids = None if span.ids is None else span.ids[done:complete]
            table = table_of_samples(rows.slice(0, n_rows), self.layout, columns, counts[done:complete], ids)
            held, base, done = rows.slice(n_rows).to_batches(), base + n_rows, complete
            del rows, batch  # or they would be kept while this waits to be asked for more
            yield table

    def _without_rest(self, span: Span, counts: IntArray, names: Sequence[str]) -> Iterator[Any]:
        """Batches of a span without all but the first row of executions that are too long."""
        starts = span.start + np.concatenate([[0], np.cumsum(counts)])
        cuts = [(int(starts[i]) + 1, int(starts[i + 1])) for i in np.flatnonzero(counts > LONGEST_RECORDING)]
        for first, batch in self._batches(span.start, span.stop, names, PIECE):
            position, end = first, first + len(batch)
            for begin, stop in [*cuts, (end, end)]:
                if position < min(begin, end):
                    yield batch.slice(position - first, min(begin, end) - position)
                position = max(position, min(stop, end))

    def _batches(self, start: int, stop: int, columns: Sequence[str], size: int) -> Iterator[tuple[int, Any]]:
        """Rows from `start` to `stop`, at most `size` at a time, with the number of the first of them."""
        groups = range(int(np.searchsorted(self.bounds, start, "right")) - 1, int(np.searchsorted(self.bounds, stop, "left")))
        if stop <= start:
            return
        position = int(self.bounds[groups[0]])
        with self._undamaged():
            for batch in self._file.iter_batches(size, row_groups=list(groups), columns=list(columns), use_threads=False):
                first, last = max(start, position), min(stop, position + len(batch))
                if last > first:
                    yield first, batch.slice(first - position, last - first)
                position += len(batch)
                if position >= stop:
                    break

    def _check_together(self, n_begun: int, n_rows: int) -> None:
        """Whether so few rows can be of so many executions; of a file in order of time, they are not for long."""
        enough = n_rows >= PIECE or n_rows == self.bounds[-1]
        if enough and not self.layout.is_dense and n_begun > 1 and n_rows < FEWEST * n_begun:
            hint = f"Sort the rows by {ID} and {TIME} first."
            expected = f"rows of an execution one after the other in {self.path}"
            raise DataFileError(expected, f"another {ID} {n_begun} times in {n_rows} rows", hint)

    @contextmanager
    def _undamaged(self) -> Iterator[None]:
        import pyarrow as pa

        try:
            yield
        except (pa.ArrowException, OSError) as error:
            reason = str(error).partition("\n")[0]
            raise DataFileError(f"an undamaged Parquet file at {self.path!r}", reason, "Copy or write it again.") from error


def _together(pieces: Iterable[ExecutionTable], size: int) -> Iterator[ExecutionTable]:
    """Tables joined until they have so many executions."""
    held: list[ExecutionTable] = []
    for piece in pieces:
        held.append(piece)
        if sum(map(len, held)) >= size:
            yield joined(held)
            held.clear()
    if held:
        yield joined(held)


def _begins(ids: Any, previous: object) -> IntArray:
    """Where in a batch another execution begins than that of the row before.

    Parameters
    ----------
    previous : of the last row before the batch, `NONE_YET` where it is the first.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    if pa.types.is_dictionary(ids.type):
        values = codes_of(ids)[0]
    else:
        values = (pc.fill_null(ids, 0) if ids.null_count else ids).to_numpy(zero_copy_only=False)
    changed = values[1:] != values[:-1]
    if ids.null_count:
        missing = np.asarray(pc.is_null(ids))
        changed |= missing[1:] != missing[:-1]
    begins = np.flatnonzero(changed) + 1
    return np.concatenate([[0], begins]) if previous is NONE_YET or ids[0].as_py() != previous else begins
