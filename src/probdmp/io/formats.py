"""Which module reads and writes which file, by suffix."""

import os
from collections.abc import Callable, Sequence
from pathlib import PurePath
from typing import NamedTuple

from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError
from probdmp.io.csv import read_csv, write_csv
from probdmp.io.npz import read_npz, write_npz
from probdmp.io.parquet import read_parquet, write_parquet

__all__ = ["FORMATS", "Format", "read_demonstrations", "write_demonstrations"]


class Format(NamedTuple):
    """How a kind of file becomes demonstrations, and back."""

    read: Callable[[str | os.PathLike[str], str | None, Sequence[str] | None, float | None], list[Demonstration]]
    write: Callable[[str | os.PathLike[str], Sequence[Demonstration]], None]


FORMATS = {
    ".npz": Format(read_npz, write_npz),
    ".csv": Format(read_csv, write_csv),
    ".parquet": Format(read_parquet, write_parquet),
}
"""By suffix."""


def read_demonstrations(
    path: str | os.PathLike[str],
    label: str | None = None,
    columns: Sequence[str] | None = None,
    dt: float | None = None,
) -> list[Demonstration]:
    """Demonstrations from a file of any known format.

    Parameters
    ----------
    label : keep only the demonstrations with this label; those without any get it.
    columns : names of the columns that are positions, in the order wanted; by default x, y, z and q….
    dt : seconds between samples, for a CSV file: needed if it has no times, otherwise what to resample to.

    Raises
    ------
    DataFileError
        If the file is damaged, hostile, or does not say which columns are positions.
    InputError, InputTypeError
        If the suffix is unknown, no demonstration has the label, the file has not the columns, or dt does not go with it.

    Warns
    -----
    RecordingWarning
        If times in the file are not even and samples had to be put in or resampled.
    """
    return _format(path).read(path, label, columns, dt)


def write_demonstrations(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write demonstrations in the format that the suffix names, replacing the file in one step.

    Raises
    ------
    InputError, InputTypeError
        If the suffix is unknown, or the format cannot hold the demonstrations.
    """
    _format(path).write(path, demonstrations)


def _format(path: str | os.PathLike[str]) -> Format:
    suffix = PurePath(path).suffix.lower()
    if suffix not in FORMATS:
        hint = "Other programs, spreadsheets too, can save their tables as .csv."
        raise InputError(f"a file name that ends in {' or '.join(FORMATS)}", repr(os.fspath(path)), hint)
    return FORMATS[suffix]
