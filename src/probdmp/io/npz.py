"""Demonstrations in an `.npz` file; its layout is described in `npz_layout`."""

import io
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probdmp.demonstrations import Demonstration
from probdmp.errors import InputError
from probdmp.io.archive import LARGEST_ARCHIVE, read_archive
from probdmp.io.atomic import write_atomically
from probdmp.io.constant_rate import resampled
from probdmp.io.npz_layout import check_recordings
from probdmp.io.recordings import check_alike, demonstrations_of, positions_by_name
from probdmp.io.selection import EVERYTHING, Selection

__all__ = ["read_npz", "write_npz"]


def read_npz(path: str | os.PathLike[str], selection: Selection = EVERYTHING) -> list[Demonstration]:
    """Demonstrations from an `.npz` file.

    Raises
    ------
    DataFileError
        If the file is damaged, too large, not what it claims, or does not say which columns are positions.
    InputError, InputTypeError
        If no demonstration has the label, the file has not the columns.
    """
    name = os.fspath(path)
    recordings = resampled(check_recordings(read_archive(path), name), selection.dt, name)
    return demonstrations_of(recordings, selection, name)


def write_npz(path: str | os.PathLike[str], demonstrations: Sequence[Demonstration]) -> None:
    """Write demonstrations, replacing the file in one step; reading gives the same values back.

    Raises
    ------
    InputError, InputTypeError
        If there are none, they differ in dt, names, units or channels, or one file cannot hold them.
    """
    checked = check_alike(demonstrations)
    first = checked[0]
    columns = [*first.names, *first.channels]
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


def _text_array(text: str | list[str]) -> NDArray[Any]:
    array = np.array(text)
    if array.tolist() != text:
        raise InputError("labels, names and units as text that does not end in NUL", f"{text!r:.200}")
    return array
