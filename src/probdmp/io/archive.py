"""NumPy's `.npz`, a zip of arrays, from a stranger: everything is measured before it is read.

Limits: `LARGEST_ARCHIVE` bytes unpacked, `LARGEST_DIRECTORY` bytes for the list of members, and only the two
compressions whose output zipfile bounds while it unpacks. Nothing is ever unpickled.
"""

import io
import os
import struct
import zipfile
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from probdmp.errors import DataFileError
from probdmp.io.regular_file import open_regular

__all__ = ["LARGEST_ARCHIVE", "read_archive"]

LARGEST_ARCHIVE = 2**29
"""Bytes, half a gibibyte: of the file, and of all its arrays together."""
LARGEST_DIRECTORY = 2**14
"""Bytes; an archive of five arrays takes about 300."""

HINT = "Write it with probdmp.write_demonstrations or numpy.savez; if it came from elsewhere, copy it again."


def read_archive(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """All arrays of an `.npz` file by name, of any dtype but objects.

    Raises
    ------
    DataFileError
        If it is not a regular file or an undamaged archive of arrays, or is beyond the limits.
    """
    name = os.fspath(path)
    with open_regular(path, LARGEST_ARCHIVE, DataFileError, follow_links=True) as file:
        _check_directory_size(file, name)
        try:
            with zipfile.ZipFile(file) as archive:
                _check_members(archive.infolist(), name)
                payloads = {member.filename: _payload(archive, member) for member in archive.infolist()}
        except DataFileError:
            raise
        except Exception as error:  # a hostile archive makes zipfile raise a dozen kinds
            raise DataFileError(f"an undamaged .npz archive in {name}", _reason(error), HINT) from error
    return {member.removesuffix(".npy"): _array(payload, f"{member!r} in {name}") for member, payload in payloads.items()}


def _check_directory_size(file: BinaryIO, name: str) -> None:
    """Refuse a long list of members before zipfile reads it.

    The end record is the last 22 bytes unless a comment follows; the 20 before may point to a zip64 record, which overrides
    it and is for larger files.
    """
    file.seek(max(0, file.seek(0, os.SEEK_END) - 42))
    tail = file.read(42)
    locator, record = tail[:-22], tail[-22:]
    if record[:4] != b"PK\5\6" or record[-2:] != b"\0\0" or locator[:4] == b"PK\6\7":
        raise DataFileError(f"an .npz archive in {name}", "something else, or a part of one", HINT)
    (size,) = struct.unpack_from("<I", record, 12)
    if size > LARGEST_DIRECTORY:
        raise DataFileError(f"a list of members of at most {LARGEST_DIRECTORY} bytes in {name}", f"{size} bytes", HINT)


def _check_members(members: list[zipfile.ZipInfo], name: str) -> None:
    total = sum(member.file_size for member in members)
    if total > LARGEST_ARCHIVE:
        raise DataFileError(f"at most {LARGEST_ARCHIVE} bytes unpacked in {name}", f"{total} bytes", "Split it.")
    if len({member.filename for member in members}) < len(members):
        raise DataFileError(f"every array once in {name}", "two of the same name", HINT)
    for member in members:
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            kind = f"compression {member.compress_type}"
            raise DataFileError(f"{member.filename!r} in {name} stored or deflated", kind, HINT)


def _payload(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    with archive.open(member) as file:
        # Asked for its size, not for everything: a member that would unpack to more than it says stays bounded.
        return file.read(member.file_size)


def _array(payload: bytes, place: str) -> NDArray[Any]:
    """An array that shares the bytes of an `.npy` file; unlike numpy.load, nothing is allocated for a shape that lies."""
    stream = io.BytesIO(payload)
    try:
        read_header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[npy.read_magic(stream)]
        shape, fortran_order, dtype = read_header(stream)
        if dtype.hasobject:
            raise DataFileError(f"{place} as numbers or text", "Python objects, which are never loaded", HINT)
        array: NDArray[Any] = np.ndarray(shape, dtype, payload, stream.tell(), order="F" if fortran_order else "C")
    except DataFileError:
        raise
    except Exception as error:  # a hostile header makes NumPy's parser raise a dozen kinds
        raise DataFileError(f"{place} as an .npy array", _reason(error), HINT) from error
    if stream.tell() + array.nbytes != len(payload):
        raise DataFileError(f"{place} with {array.nbytes} bytes of data", f"{len(payload) - stream.tell()}", HINT)
    return array


def _reason(error: Exception) -> str:
    return f"{type(error).__name__}: {error!s:.200}"
