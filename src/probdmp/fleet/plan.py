"""A file of executions, cut into parts that are scored by themselves."""

from math import ceil
from typing import NamedTuple

import numpy as np

from probdmp.checks import BoolArray, IntArray
from probdmp.io import Executions, ParquetExecutions, Span

__all__ = ["PART_SAMPLES", "PLAN", "Part", "parts_of", "repeated_ids"]

PART_SAMPLES = 2**23
"""Samples of a part, about: what a run that is killed loses at most, per process."""
PLAN = 2
"""Number of the way in which parts are cut: a run goes on only with parts that were cut in the same way."""
FIRST = 1 / 4
"""Of a part: how large the first one is, more than NEARBY."""
NEARBY = 1 / 8
"""Of a part: so far from where it should end, it ends with a row group instead, which is then read for one part alone."""


class Part(NamedTuple):
    """Executions that are scored together, and whose scores are kept together."""

    number: int
    first: int
    """Place of its first execution among those of the file."""
    n_executions: int
    span: Span
    repeated: IntArray
    """Places of executions in it whose name others in the file have too."""


def parts_of(file: ParquetExecutions, executions: Executions, samples: int = PART_SAMPLES) -> list[Part]:
    """The parts of a file: always the same for the same file and number of samples.

    Parameters
    ----------
    samples : of a part, about. Where rows are executions, each is taken to have as many as on average.
    """
    starts, repeated = executions.starts, repeated_ids(executions)
    per_row = file.samples_per_row if file.layout.is_dense else 1.0
    rows = max(int(samples / max(per_row, 1.0)), 1)
    # The first one is small: nothing can be scored while it is read.
    ends, nearby = np.arange(ceil(rows * FIRST), max(int(starts[-1]), 1), rows), int(rows * NEARBY)
    last = file.bounds[np.searchsorted(file.bounds, ends + nearby, side="right") - 1]
    # A part ends where the execution ends in which its last row is.
    cuts = np.searchsorted(starts, np.where(np.abs(last - ends) <= nearby, last, ends), side="left")
    edges = np.unique(np.concatenate([[0], cuts, [len(executions)]]))
    parts = []
    for index, (first, last) in enumerate(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)):
        span = Span(int(starts[first]), int(starts[last]), None)
        if not file.layout.is_dense:
            span = span._replace(counts=np.diff(starts[first : last + 1]), ids=executions.ids[first:last].combine_chunks())
        parts.append(Part(index, first, last - first, span, np.flatnonzero(repeated[first:last])))
    return parts


def repeated_ids(executions: Executions) -> BoolArray:
    """(N,) array: whether another execution has the same name."""
    import pyarrow.compute as pc

    ids, n = executions.ids, len(executions)
    if pc.all(pc.less(ids[:-1], ids[1:]), skip_nulls=False).as_py() or pc.count_distinct(ids, mode="all").as_py() == n:
        return np.zeros(n, dtype=bool)
    codes = ids.dictionary_encode().combine_chunks().indices
    known = np.asarray(pc.fill_null(codes, -1).to_numpy(zero_copy_only=False))
    counts = np.bincount(known + 1)
    return np.asarray((counts[known + 1] > 1) & (known >= 0))
