"""The variables of a MATLAB file as plain Python values; nothing in it is ever executed or unpickled."""

import io
import os
import warnings
from typing import Any

import numpy as np

from probdmp.errors import DataFileError, RecordingWarning
from probdmp.io.mat_elements import HEADER_BYTES, HINT, LARGEST_MAT, measured_variables
from probdmp.io.recordings import listing
from probdmp.io.regular_file import open_regular

__all__ = ["Value", "read_variables"]

Value = Any
"""Numbers as array of floats, text as str, a struct as dict, a cell or an array of structs as list; None if complex."""

OBJECTS = "Strings with double quotes, tables and dates are objects: use char(…), table2struct(…) and numbers."
HDF5 = b"\x89HDF\r\n\x1a\n"


def read_variables(path: str | os.PathLike[str]) -> dict[str, Value]:
    """All variables of a file that are numbers, text, cells or structs.

    Raises
    ------
    DataFileError
        If it is not an undamaged MATLAB file of version 5 to 7, or holds nothing of the kind.

    Warns
    -----
    RecordingWarning
        If it also has variables that are objects, or hold one.
    """
    name = os.fspath(path)
    with open_regular(path, LARGEST_MAT, DataFileError, follow_links=True) as file:
        data = file.read(os.fstat(file.fileno()).st_size)  # as much memory is set aside as is asked for
    _check_version(data, name)
    kept, left_out = measured_variables(data, name)
    variables = {key: _plain(value) for key, value in _loaded(kept, name).items() if not key.startswith("__")}
    if not variables:
        objects = f"objects alone: {', '.join(left_out)}" if left_out else "none"
        raise DataFileError(f"variables with numbers in {name}", f"{objects:.200}", f"Save arrays, cells or structs. {OBJECTS}")
    if left_out:
        text = f"{name}: {listing(map(repr, left_out), 10)} left out, which are objects or hold one. {OBJECTS}"
        warnings.warn(text, RecordingWarning, stacklevel=2)
    return variables


def _check_version(data: bytes, name: str) -> None:
    if HDF5 in (data[:8], data[512:520]) or data.startswith(b"MATLAB 7.3"):
        hint = "Save it again in MATLAB with save('file.mat', '-v7')."
        raise DataFileError(f"a MATLAB file of version 7 or before in {name}", "version 7.3, which is HDF5", hint)
    marks = {b"IM": b"\x00\x01", b"MI": b"\x01\x00"}
    if len(data) < HEADER_BYTES or marks.get(data[126:128]) != data[124:126] or not all(data[:4]):
        what = "something else, or version 4" if data else "an empty file"
        raise DataFileError(f"a MATLAB file of version 5 to 7 in {name}", what, HINT)


def _loaded(data: bytes, name: str) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # such as a variable that is there twice
            return loadmat(io.BytesIO(data))  # type: ignore[arg-type]  # files are welcome, though the stubs have names only
    except Exception as error:  # a hostile file makes the parser raise a dozen kinds
        raise DataFileError(f"an undamaged MATLAB file in {name}", f"{type(error).__name__}: {error!s:.200}", HINT) from error


def _plain(value: Any) -> Value:
    array = np.asarray(value)
    if array.dtype.names is not None:
        records = [{key: _plain(record[key]) for key in array.dtype.names} for record in array.ravel(order="F")]
        return records[0] if len(records) == 1 else records
    if array.dtype == object:
        return [_plain(item) for item in array.ravel(order="F")]
    if array.dtype.kind == "U":
        texts = [str(text).rstrip() for text in array.ravel(order="F")]
        return texts[0] if len(texts) == 1 else texts or ""
    return array.astype(np.float64) if array.dtype.kind in "fiub" else None
