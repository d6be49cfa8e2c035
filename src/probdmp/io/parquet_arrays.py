"""Columns of a Parquet file as NumPy arrays."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import BoolArray, FloatArray, IntArray

__all__ = ["codes_of", "list_lengths", "numbers_of", "plain_names", "recoded", "seconds_of", "steady", "told_once"]

PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def numbers_of(column: Any) -> FloatArray:
    """A column of numbers, or of lists of numbers one after the other; NaN for null."""
    import pyarrow as pa
    import pyarrow.compute as pc

    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if pa.types.is_nested(array.type):
        array = array.flatten()
    if array.type != pa.float64():
        array = pc.cast(array, pa.float64(), safe=False)
    if array.null_count:
        array = pc.fill_null(array, np.nan)
    return np.asarray(array.to_numpy(zero_copy_only=False), dtype=np.float64)


def seconds_of(column: Any) -> FloatArray:
    """A column of times: numbers as they are, timestamps in seconds since the first of them; NaN for null."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if not (pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type)):
        return numbers_of(column)
    ticks = column.cast(pa.int64())
    first = next((value for value in ticks if value.is_valid), pa.scalar(0))
    return numbers_of(pc.subtract(ticks, first)) / PER_SECOND[column.type.unit]


def list_lengths(column: Any) -> IntArray:
    """(N,) array: how many numbers each list of a column has; 0 for null."""
    import pyarrow as pa
    import pyarrow.compute as pc

    lengths = pc.fill_null(pc.list_value_length(column), 0)
    return np.asarray(pc.cast(lengths, pa.int64()).to_numpy(), dtype=np.int64)


def codes_of(column: Any) -> tuple[NDArray[np.signedinteger[Any]], list[str]]:
    """A column of text as numbers, -1 for null, and the text that each stands for."""
    import pyarrow as pa
    import pyarrow.compute as pc

    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if not pa.types.is_dictionary(array.type):
        array = pc.dictionary_encode(array)
    codes = pc.fill_null(array.indices, -1) if array.indices.null_count else array.indices
    return codes.to_numpy(zero_copy_only=False), array.dictionary.to_pylist()


def recoded(codes: IntArray, texts: Sequence[str], known: dict[str, int]) -> IntArray:
    """Numbers of texts, -1 for none, as numbers of all texts that are known, to which those of these are added."""
    return np.array([*(known.setdefault(text, len(known)) for text in texts), -1], dtype=np.int64)[codes]


def plain_names(column: Any) -> Any:
    """A column of names as one Arrow array without a dictionary."""
    import pyarrow as pa

    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    return array.dictionary_decode() if pa.types.is_dictionary(array.type) else array


def steady(values: NDArray[Any], offsets: IntArray) -> BoolArray:
    """(N,) array: whether all values of an execution are the same.

    Parameters
    ----------
    offsets : (N + 1) array: execution i has `values[offsets[i]:offsets[i + 1]]`, at least one.
    """
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    within = changes[offsets[np.searchsorted(offsets, changes)] != changes]
    same = np.ones(len(offsets) - 1, dtype=np.bool_)
    same[np.searchsorted(offsets, within) - 1] = False
    return same


def told_once(values: FloatArray, offsets: IntArray) -> tuple[FloatArray, BoolArray]:
    """The one number that is in the rows of each execution, (N,) array, NaN for none; and whether there are others too."""
    low, high = np.fmin.reduceat(values, offsets[:-1]), np.fmax.reduceat(values, offsets[:-1])
    return low, low < high
