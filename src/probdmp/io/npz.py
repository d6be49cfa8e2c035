"""Demonstrations in an `.npz` file; its layout is described in `npz_layout`."""

import io
import os
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probdmp.demonstrations import Demonstration, as_demonstrations
from probdmp.errors import DataFileError, InputError, InputTypeError
from probdmp.io.archive import LARGEST_ARCHIVE, read_archive
from probdmp.io.atomic import write_atomically
from probdmp.io.npz_layout import (
    MOST_COLUMNS,
    MOST_DEMONSTRATIONS,
    Recordings,
    check_recordings,
    listing,
    positions_by_name,
)

__all__ = ["read_npz", "write_npz"]


def read_npz(
    path: str | os.PathLike[str], label: str | None = None, columns: Sequence[str] | None = None
) -> list[Demonstration]:
    """Demonstrations from an `.npz` file.

    Parameters
    ----------
    label : keep only the demonstrations with this label.
    columns : names of the columns that are positions, in the order wanted; unless given, those that the file says.

    Raises
    ------
    DataFileError
        If the file is damaged, too large, not what it claims, or does not say which columns are positions.
    InputError, InputTypeError
        If no demonstration has the label, or the file has not the columns.
    """
    name = os.fspath(path)
    recordings = check_recordings(read_archive(path), name)
    names = _position_columns(recordings, columns, name)
    counts = Counter(recordings.labels)
    if label is not None and label not in counts:
        present = listing(f"{known!r} ({count})" for known, count in counts.items())
        raise InputError(f"label to be one of those in {name}: {present}", repr(label))
    wanted = [i for i, other in enumerate(recordings.labels) if label in (None, other)]
    return [_demonstration(recordings, i, names, name) for i in wanted]


def write_npz(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write demonstrations, replacing the file in one step; reading gives the same values back.

    Raises
    ------
    InputError, InputTypeError
        If there are none, they differ in dt, names, units or channels, or one file cannot hold them.
    """
    checked = _check_alike(demonstrations)
    first = checked[0]
    columns = [*first.names, *first.channels]
    if len(set(columns)) < len(columns) or len(columns) > MOST_COLUMNS or len(checked) > MOST_DEMONSTRATIONS:
        raise InputError(
            f"at most {MOST_DEMONSTRATIONS} demonstrations and {MOST_COLUMNS} columns with different names",
            f"{len(checked)} demonstrations with columns {listing(map(repr, columns))}",
        )
    tables = [np.column_stack([d.positions, *(d.channels[name] for name in first.channels)]) for d in checked]
    arrays: dict[str, Any] = {
        "data": np.concatenate(tables),
        "offsets": np.cumsum([0, *map(len, tables)]),
        "labels": _text_array([d.label for d in checked]),
        "dt": np.array(first.dt),
        "columns": _text_array(columns),
    }
    if first.units:
        arrays["units"] = _text_array(first.units)
    if positions_by_name(columns) != list(first.names):
        arrays["positions"] = _text_array(list(first.names))
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    if buffer.tell() > LARGEST_ARCHIVE:
        raise InputError(f"at most {LARGEST_ARCHIVE} bytes of demonstrations", f"{buffer.tell()}", "Write several files.")
    write_atomically(path, buffer.getvalue())


def _position_columns(recordings: Recordings, columns: Sequence[str] | None, name: str) -> tuple[str, ...]:
    known = listing(map(repr, recordings.columns))
    if columns is None:
        chosen = recordings.positions or positions_by_name(recordings.columns)
        if not chosen:
            hint = "Say which are positions: columns=[...], or --columns on the command line."
            raise DataFileError(f"columns named x, y, z or q… in {name}", known, hint)
        return tuple(chosen)
    if isinstance(columns, str):
        raise InputTypeError("columns as a list of names", repr(columns), f"Write columns={columns.split(',')!r}.")
    if not columns or len(set(columns)) < len(columns) or not set(columns) <= set(recordings.columns):
        raise InputError(f"columns to be different ones of {known} in {name}", repr(list(columns)))
    return tuple(columns)


def _demonstration(recordings: Recordings, i: int, names: tuple[str, ...], name: str) -> Demonstration:
    rows = recordings.data[recordings.offsets[i] : recordings.offsets[i + 1]]
    by_column = dict(zip(recordings.columns, rows.T, strict=True))
    positions = np.column_stack([by_column.pop(column) for column in names])
    label = recordings.labels[i]
    try:
        return Demonstration(positions, recordings.dt, label, names, recordings.units, by_column)
    except (InputError, InputTypeError) as error:
        raise DataFileError(f"{error.expected} in demonstration {i} ({label!r}) of {name}", error.got, error.hint) from error


def _check_alike(demonstrations: Sequence[Demonstration]) -> list[Demonstration]:
    checked = as_demonstrations(demonstrations)
    first = checked[0]
    for k, other in enumerate(checked):
        for what, wanted, got in (
            ("dt", first.dt, other.dt),
            ("units", first.units, other.units),
            ("channels", sorted(first.channels), sorted(other.channels)),
        ):
            if got != wanted:
                expected = f"demonstrations with the same {what} in one file, {wanted!r}"
                raise InputError(expected, f"{got!r} in demonstration {k}", "Write those that differ to another file.")
    return checked


def _text_array(text: str | list[str]) -> NDArray[Any]:
    array = np.array(text)
    if array.tolist() != text:
        raise InputError("labels, names and units as text that does not end in NUL", f"{text!r:.200}")
    return array
