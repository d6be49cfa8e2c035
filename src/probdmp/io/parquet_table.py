"""Executions of a Parquet file as flat arrays, a few thousand at a time, without an object for each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import LARGEST_MAGNITUDE, SECONDS, BoolArray, FloatArray, IntArray
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, SHORTEST_RECORDING
from probdmp.io.parquet_arrays import codes_of, list_lengths, numbers_of, plain_names, recoded, seconds_of, steady, told_once
from probdmp.io.parquet_clock import even_clocks
from probdmp.io.parquet_layout import ID, STEP, TIME, ParquetLayout

__all__ = ["ExecutionTable", "joined", "table_of_lists", "table_of_samples"]


@dataclass(frozen=True, slots=True, eq=False)
class ExecutionTable:
    """N executions, one after the other."""

    ids: Any
    """(N) Arrow array."""
    codes: IntArray
    """(N,) array: which of `labels` each has; -1 for none."""
    labels: list[str]
    offsets: IntArray
    """(N + 1,) array: execution i has the samples `offsets[i]:offsets[i + 1]`, at least one."""
    counts: IntArray
    """(N,) array: how many samples there are in the file, without those that were left out of an even clock."""
    steps: FloatArray
    """(N,) array, seconds between samples."""
    columns: dict[str, list[FloatArray]]
    """What was measured, in P arrays of samples, one after the other; units of the file, NaN where nothing was measured."""
    pieces: IntArray
    """(P + 1,) array: executions `pieces[p]:pieces[p + 1]` are in array p of each column."""
    told: dict[str, FloatArray]
    """(N,) arrays; NaN where nothing was told."""
    problems: NDArray[np.object_]
    """(N,) array: why an execution cannot be used, text; "" where it can."""

    def __len__(self) -> int:
        return len(self.counts)

    def refuse(self, which: BoolArray, reason: str) -> None:
        """Note a reason for executions that have none yet."""
        self.problems[which & self.usable] = reason

    @property
    def usable(self) -> BoolArray:
        """(N,) array."""
        return np.asarray(self.problems == "", dtype=np.bool_)

    def measured(self, which: IntArray, names: Sequence[str]) -> FloatArray:
        """Columns of executions that are equally long, (n, T, C) array; NaN where a column is not in the file.

        Parameters
        ----------
        which : (n,) increasing.
        """
        length = int(np.diff(self.offsets[which[0] : which[0] + 2])[0])
        values = np.empty((len(which), length, len(names)))
        for p, some in self._by_piece(which):
            offsets = self.offsets[self.pieces[p] : self.pieces[p + 1] + 1]
            # Whole rows are copied at once where all executions, not only these, are equally long.
            by_rows = bool((np.diff(offsets) == length).all())
            own = which[some] - self.pieces[p]
            places = own if by_rows else (offsets[own] - offsets[0])[:, None] + np.arange(length)
            for i, name in enumerate(names):
                if name not in self.columns:
                    values[some, :, i] = np.nan
                    continue
                column = self.columns[name][p]
                values[some, :, i] = (column.reshape(-1, length) if by_rows else column)[places]
        return values

    def first(self, which: IntArray, name: str) -> FloatArray:
        """What executions, (n,) increasing, began with, (n,) array; NaN where a column is not in the file."""
        begun = np.full(len(which), np.nan)
        for p, some in self._by_piece(which) if name in self.columns else ():
            begun[some] = self.columns[name][p][self.offsets[which[some]] - self.offsets[self.pieces[p]]]
        return begun

    def execution(self, i: int) -> dict[str, FloatArray]:
        """All columns of one execution, (T,) arrays."""
        p = int(np.searchsorted(self.pieces, i, side="right")) - 1
        start, stop = (self.offsets[i : i + 2] - self.offsets[self.pieces[p]]).tolist()
        return {name: arrays[p][start:stop] for name, arrays in self.columns.items()}

    def _by_piece(self, which: IntArray) -> Iterator[tuple[int, slice]]:
        """Which of increasing places are in each piece."""
        for p, (begin, end) in enumerate(pairwise(np.searchsorted(which, self.pieces).tolist())):
            if end > begin:
                yield p, slice(begin, end)


def joined(tables: Sequence[ExecutionTable]) -> ExecutionTable:
    """Tables of one file as one, in their order; what was measured is not copied."""
    import pyarrow as pa

    if len(tables) == 1:
        return tables[0]
    labels: dict[str, int] = {}
    codes = [recoded(table.codes, table.labels, labels) for table in tables]
    bases = np.cumsum([0, *(table.offsets[-1] for table in tables)])
    offsets = [base + table.offsets[:-1] for base, table in zip(bases[:-1], tables, strict=True)]
    return ExecutionTable(
        pa.concat_arrays([table.ids for table in tables]),
        np.concatenate(codes),
        list(labels),
        np.append(np.concatenate(offsets), bases[-1]),
        np.concatenate([table.counts for table in tables]),
        np.concatenate([table.steps for table in tables]),
        {name: list(chain.from_iterable(table.columns[name] for table in tables)) for name in tables[0].columns},
        np.cumsum([0, *chain.from_iterable(np.diff(table.pieces) for table in tables)]),
        {name: np.concatenate([table.told[name] for table in tables]) for name in tables[0].told},
        np.concatenate([table.problems for table in tables]),
    )


def table_of_samples(
    rows: Any, layout: ParquetLayout, wanted: Sequence[str], counts: IntArray, ids: Any = None
) -> ExecutionTable:
    """From rows that are samples.

    Parameters
    ----------
    rows : Arrow table; of executions that are too long the first row only.
    wanted : columns to keep.
    counts : (N,) array: samples of each execution in the file.
    ids : (N) Arrow array; from the rows unless given.
    """
    offsets = np.concatenate([[0], np.cumsum(np.where(counts > LONGEST_RECORDING, 1, counts))])
    firsts = offsets[:-1]
    codes, labels = codes_of(rows[layout.label]) if layout.label else (np.full(len(rows), -1), [])
    told = {name: told_once(numbers_of(rows[name]), offsets) for name in layout.told}
    table = _timed(
        seconds_of(rows[TIME]),
        ExecutionTable(
            ids=plain_names(rows[ID].take(firsts)) if ids is None else ids,
            codes=codes[firsts],
            labels=labels,
            offsets=offsets,
            counts=counts,
            steps=np.full(len(counts), np.nan),
            columns={name: [numbers_of(rows[name])] for name in wanted},
            pieces=np.array([0, len(counts)]),
            told={name: values for name, (values, _) in told.items()},
            problems=np.full(len(counts), "", dtype=object),
        ),
    )
    table.refuse(~steady(codes, offsets), "Expected one primitive for all rows of an execution, got several.")
    for name, (_, several) in told.items():
        table.refuse(several, f"Expected the same {name} in all rows of an execution, got several.")
    return table


def table_of_lists(rows: Any, layout: ParquetLayout, wanted: Sequence[str]) -> ExecutionTable:
    """From rows that are executions; parameters as above."""
    names = [*wanted, *([TIME] if layout.has_times else [])]
    lengths = np.stack([list_lengths(rows[name]) for name in names])
    counts = lengths.max(axis=0)
    extents = np.maximum(counts, 1)
    columns = {name: [_aligned(numbers_of(rows[name]), own, extents)] for name, own in zip(names, lengths, strict=True)}
    codes, labels = codes_of(rows[layout.label]) if layout.label else (np.full(len(rows), -1), [])
    table = ExecutionTable(
        ids=plain_names(rows[ID]),
        codes=codes,
        labels=labels,
        offsets=np.concatenate([[0], np.cumsum(extents)]),
        counts=counts,
        steps=np.full(len(rows), np.nan) if layout.has_times else numbers_of(rows[STEP]),
        columns=columns,
        pieces=np.array([0, len(rows)]),
        told={name: numbers_of(rows[name]) for name in layout.told},
        problems=np.full(len(rows), "", dtype=object),
    )
    uneven = ((lengths != counts) & (lengths > 0)).any(axis=0)
    table.refuse(uneven, f"Expected lists of one length in {', '.join(names)}, got several.")
    return _timed(columns.pop(TIME)[0], table) if layout.has_times else _checked(table)


def _aligned(values: FloatArray, lengths: IntArray, counts: IntArray) -> FloatArray:
    """The values of lists, where all of them are as long as they should be; otherwise NaN in place of others."""
    if np.array_equal(lengths, counts):
        return values
    spread, fits = np.full(int(counts.sum()), np.nan), lengths == counts
    spread[np.repeat(fits, counts)] = values[np.repeat(fits, lengths)]
    return spread


def _timed(times: FloatArray, table: ExecutionTable) -> ExecutionTable:
    """With the constant rates of executions, and missing samples where rows were left out."""
    clocks = even_clocks(times, table.offsets)
    long_enough = (table.counts >= SHORTEST_RECORDING) & (table.counts <= LONGEST_RECORDING)
    table.refuse(long_enough & ~clocks.increase, "Expected times that increase, got some that do not, or are missing.")
    uneven = long_enough & np.isnan(clocks.steps)
    table.refuse(uneven, "Expected samples at one rate, perhaps with gaps, got uneven times. Resample them to a constant rate.")
    return _checked(_regridded(replace(table, steps=clocks.steps), clocks.places))


def _regridded(table: ExecutionTable, places: IntArray | None) -> ExecutionTable:
    """With missing samples where rows were left out."""
    if places is None:
        return table
    extents = places[table.offsets[1:] - 1] + 1
    offsets = np.concatenate([[0], np.cumsum(extents)])
    targets = places + np.repeat(offsets[:-1], np.diff(table.offsets))
    columns = {}
    for name, (values,) in table.columns.items():
        spread = np.full(int(offsets[-1]), np.nan)
        spread[targets] = values
        columns[name] = [spread]
    return replace(table, offsets=offsets, columns=columns)


def _checked(table: ExecutionTable) -> ExecutionTable:
    """With reasons noted for executions that are too short or too long, or whose numbers are none."""
    import pyarrow.compute as pc

    short, long = SHORTEST_RECORDING, LONGEST_RECORDING
    table.refuse(np.asarray(pc.is_null(table.ids)), "Expected an execution_id, got none.")
    extents = np.diff(table.offsets)
    wrong = (table.counts < short) | (np.maximum(table.counts, extents) > long)
    table.refuse(wrong, f"Expected {short} to {long} samples in an execution, got fewer or more.")
    shortest, longest = SECONDS
    wrong = ~((table.steps >= shortest) & (table.steps <= longest))
    table.refuse(wrong, f"Expected {shortest:g} to {longest:g} seconds between samples, got something else.")
    for name, (values,) in table.columns.items():
        if max(np.fmax.reduce(values, initial=0.0), -np.fmin.reduce(values, initial=0.0)) > LARGEST_MAGNITUDE:
            wrong = np.logical_or.reduceat(np.abs(values) > LARGEST_MAGNITUDE, table.offsets[:-1])
            table.refuse(wrong, f"Expected {name} finite, or null where it was not measured, got infinity or nearly so.")
    for name, values in table.told.items():
        table.refuse(np.abs(values) > LARGEST_MAGNITUDE, f"Expected {name} finite, or null, got infinity or nearly so.")
    return table
