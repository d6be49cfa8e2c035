"""What the arrays of a demonstration file must be.

    data       (sum T, C) numbers, NaN where a sample is missing
    offsets    (n + 1) whole numbers: demonstration i is data[offsets[i]:offsets[i + 1]]
    labels     (n) text
    dt         number, seconds
    columns    (C) text
    units      text, optional: unit of the positions
    positions  (D) text, optional: which columns are positions, where their names do not say so

`recordings` says which columns are positions.
"""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probdmp.errors import DataFileError
from probdmp.io.archive import HINT
from probdmp.io.recordings import MOST_COLUMNS, MOST_DEMONSTRATIONS, Recordings, listing

__all__ = ["check_recordings"]

LAYOUT = {
    "data": ("fiu", 2),
    "offsets": ("iu", 1),
    "labels": ("U", 1),
    "dt": ("fiu", 0),
    "columns": ("U", 1),
    "units": ("U", 0),
    "positions": ("U", 1),
}
"""Kinds of dtype and number of axes."""
KINDS = {"fiu": "real numbers", "iu": "whole numbers", "U": "text"}
WIDEST_NUMBER = 8
"""Bytes; what is wider may not fit into a float64."""
DEFAULTS = {"units": np.array(""), "positions": np.array([], dtype=str)}


def check_recordings(arrays: dict[str, NDArray[Any]], name: str) -> Recordings:
    """The content of a file from its arrays.

    Parameters
    ----------
    name : of the file, for messages.

    Raises
    ------
    DataFileError
        If an array is missing, of the wrong kind or shape, or the arrays contradict each other.
    """
    arrays = DEFAULTS | arrays
    for key, (kinds, n_axes) in LAYOUT.items():
        expected = f"array {key!r} of {KINDS[kinds]} with {n_axes} axes in {name}"
        if key not in arrays:
            raise DataFileError(expected, f"only the arrays {listing(map(repr, sorted(arrays)))}", HINT)
        array = arrays[key]
        wide = kinds != "U" and array.dtype.itemsize > WIDEST_NUMBER
        if array.dtype.kind not in kinds or array.ndim != n_axes or wide:
            raise DataFileError(expected, f"dtype {array.dtype} and shape {array.shape}", HINT)
    _check_lengths(arrays, name)
    for key, (kinds, _) in LAYOUT.items():
        if kinds == "U" and np.any(_code_points(arrays[key]) > sys.maxunicode):
            raise DataFileError(f"array {key!r} of text in {name}", "a number that is no character", HINT)
    values = {key: arrays[key].tolist() for key in LAYOUT if key != "data"}
    units = [values.pop("units")] * len(values["columns"])
    recordings = Recordings(data=arrays["data"], units=units, **values)
    for key, columns in (("columns", recordings.columns), ("positions", recordings.positions)):
        if len(set(columns)) < len(columns) or not set(columns) <= set(recordings.columns):
            raise DataFileError(f"different names of columns as {key!r} in {name}", listing(map(repr, columns)), HINT)
    return recordings


def _check_lengths(arrays: dict[str, NDArray[Any]], name: str) -> None:
    data, offsets, labels, columns = (arrays[key] for key in ("data", "offsets", "labels", "columns"))
    if not 1 <= len(labels) <= MOST_DEMONSTRATIONS or len(offsets) != len(labels) + 1:
        expected = f"1 to {MOST_DEMONSTRATIONS} labels and one offset more in {name}"
        raise DataFileError(expected, f"{len(labels)} labels and {len(offsets)} offsets", HINT)
    if offsets[0] != 0 or offsets[-1] != len(data) or np.any(offsets[1:] <= offsets[:-1]):
        expected = f"offsets that increase from 0 to the {len(data)} rows of data in {name}"
        raise DataFileError(expected, np.array2string(offsets, threshold=10), HINT)
    if len(columns) != data.shape[1] or max(len(columns), len(arrays["positions"])) > MOST_COLUMNS:
        expected = f"one name for each of the {data.shape[1]} columns of data, at most {MOST_COLUMNS}, in {name}"
        raise DataFileError(expected, f"{len(columns)} names", HINT)


def _code_points(text: NDArray[Any]) -> NDArray[np.uint32]:
    """Characters as numbers: NumPy makes invalid ones into strings unchecked."""
    return np.frombuffer(text.tobytes(), np.dtype(np.uint32).newbyteorder(text.dtype.byteorder))
