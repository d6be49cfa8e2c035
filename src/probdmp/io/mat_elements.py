"""A MATLAB file of level 5 from a stranger: every element is measured before SciPy reads it.

SciPy believes the sizes that a file claims and follows nested cells as deep as they go. Here they are held against the bytes
that are there, compressed variables are unpacked up to a limit, and what is neither number, text, cell nor struct (objects,
functions, sparse matrices) is left out without being looked at. Layout: MAT-File Format, MathWorks, "Level 5 MAT-File Format".
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import NamedTuple

from probdmp.errors import DataFileError

__all__ = ["HEADER_BYTES", "LARGEST_MAT", "measured_variables"]

LARGEST_MAT = 2**29
"""Bytes, of the file and of what is in it unpacked."""
HEADER_BYTES = 128
DEEPEST = 16
"""Cells and structs within one another."""
MOST_ELEMENTS = 2**21
MATRIX, COMPRESSED = 14, 15
CELL, STRUCT, CHAR, NUMBERS = 1, 2, 4, range(6, 16)
"""Classes of arrays."""
ITEM_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}
"""By type of stored numbers."""
HINT = "Save it again with save(..., '-v7'); if it came from elsewhere, copy it again."


class _Element(NamedTuple):
    kind: int
    start: int
    stop: int


class _OtherClass(Exception):
    """An array of a class that is left out."""


@dataclass(slots=True)
class _Measured:
    """Bytes that elements are in, and how many of these there may still be."""

    data: bytes
    order: str
    """Of bytes: "<" or ">"."""
    name: str
    left: int = MOST_ELEMENTS
    bytes_left: int = LARGEST_MAT

    def words(self, element: _Element) -> tuple[int, ...]:
        """An element as whole numbers of 32 bits."""
        return struct.unpack_from(f"{self.order}{(element.stop - element.start) // 4}i", self.data, element.start)

    def elements(self, start: int, stop: int) -> Iterator[_Element]:
        """Those that follow one another, each within the bytes that there are."""
        while start < stop:
            self.left -= 1
            if self.left < 0 or stop - start < 8:
                raise _damaged(self.name, "an element that is cut off" if self.left >= 0 else "millions of elements")
            word, size = struct.unpack_from(f"{self.order}2I", self.data, start)
            kind, begin = word, start + 8
            if word >> 16:  # both in one word, and the data in the next one
                kind, size, begin = word & 0xFFFF, word >> 16, start + 4
            if begin + size > (stop if begin == start + 8 else start + 8):
                raise _damaged(self.name, f"an element of {size} bytes where {stop - begin} are left")
            yield _Element(kind, begin, begin + size)
            end = begin + size
            start = end if kind == COMPRESSED else start + 8 * -(-(end - start) // 8)


def measured_variables(data: bytes, name: str) -> tuple[bytes, list[str]]:
    """The variables of a file that can be read, uncompressed and with a header; and the names of those left out.

    Parameters
    ----------
    data : the file, with a header of level 5.
    name : of the file, for messages.

    Raises
    ------
    DataFileError
        If it is damaged, or larger than it may be.
    """
    order = "<" if data[126:128] == b"IM" else ">"
    whole = _Measured(data, order, name)
    kept, left_out, total = [data[:HEADER_BYTES]], [], 0
    for element in whole.elements(HEADER_BYTES, len(data)):
        inner = data[element.start : element.stop]
        if element.kind == COMPRESSED:
            inner = _unpacked(inner, LARGEST_MAT - total, name)
        elif element.kind == MATRIX:
            inner = struct.pack(f"{order}2I", MATRIX, len(inner)) + inner
        else:
            raise _damaged(name, f"an element of type {element.kind}")
        total += len(inner)
        if total > LARGEST_MAT:
            raise _too_large(name)
        variable = _Measured(inner, order, name, whole.left, LARGEST_MAT)
        outer = next(variable.elements(0, len(inner)), None)
        if outer is None or outer.kind != MATRIX:
            raise _damaged(name, "a variable that is no array")
        try:
            title = _check_array(variable, outer, 0)
        except _OtherClass as other:
            left_out.append(str(other))
            continue
        whole.left = variable.left
        if title:  # the workspace of functions has none
            kept.append(inner + b"\0" * (-len(inner) % 8))
    return b"".join(kept), left_out


def _unpacked(data: bytes, most: int, name: str) -> bytes:
    unpacker = zlib.decompressobj()
    try:
        inner = unpacker.decompress(data, most + 1)
    except zlib.error as error:
        raise _damaged(name, str(error)) from error
    if len(inner) > most:
        raise _too_large(name)
    if not unpacker.eof:
        raise _damaged(name, "a compressed variable that is cut off")
    return inner


def _check_array(within: _Measured, array: _Element, depth: int) -> str:
    """The name of an array whose parts are as long as they say."""
    if array.start == array.stop and depth:
        return ""  # an empty one
    if depth > DEEPEST:
        raise _damaged(within.name, f"cells more than {DEEPEST} deep")
    parts = list(within.elements(array.start, array.stop))
    if len(parts) < 3 or (parts[0].kind, parts[0].stop - parts[0].start) != (6, 8):
        raise _damaged(within.name, "an array without a head")
    kind = within.words(parts[0])[0] & 0xFF
    title = within.data[parts[2].start : parts[2].stop].decode(errors="replace")
    if kind not in (CELL, STRUCT, CHAR, *NUMBERS):
        raise _OtherClass(title)
    shape = within.words(parts[1])
    if parts[1].kind != 5 or not 2 <= len(shape) <= 32 or min(shape) < 0:
        raise _damaged(within.name, f"an array of shape {shape[:32]}")
    count, rest = prod(shape), parts[3:]
    within.bytes_left -= 8 * count
    if within.bytes_left < 0:
        raise _too_large(within.name)
    if kind in (CELL, STRUCT):
        _check_members(within, kind, count, rest, title, depth)
    elif not rest or any(not _holds(part, count, kind == CHAR) for part in rest):
        raise _damaged(within.name, f"{title!r:.50} of shape {shape} with other than {count} values")
    return title


def _check_members(within: _Measured, kind: int, count: int, rest: list[_Element], title: str, depth: int) -> None:
    n_fields, members = 1, rest
    if kind == STRUCT:
        width = within.words(rest[0])[:1] if rest and rest[0].kind == 5 else ()
        if len(rest) < 2 or not width or width[0] < 1:
            raise _damaged(within.name, f"a struct {title!r:.50} without fields")
        n_fields, members = (rest[1].stop - rest[1].start) // width[0], rest[2:]
    if len(members) != count * n_fields or any(member.kind != MATRIX for member in members):
        raise _damaged(within.name, f"{title!r:.50} of {count * n_fields} arrays with {len(members)}")
    for member in members:
        _check_nested(within, member, title, depth)


def _check_nested(within: _Measured, member: _Element, title: str, depth: int) -> None:
    try:
        _check_array(within, member, depth + 1)
    except _OtherClass as other:
        raise _OtherClass(title) from other


def _holds(part: _Element, count: int, is_text: bool) -> bool:
    """Whether as many values are stored as there should be; of text, at least a byte for each."""
    size = part.stop - part.start
    if is_text:
        return part.kind in (1, 2, 4, 16, 17, 18) and count <= size
    return part.kind in ITEM_BYTES and size == count * ITEM_BYTES[part.kind]


def _damaged(name: str, got: str) -> DataFileError:
    return DataFileError(f"an undamaged MATLAB file in {name}", got, HINT)


def _too_large(name: str) -> DataFileError:
    return DataFileError(f"at most {LARGEST_MAT} bytes unpacked in {name}", "more", "Split what it holds over several files.")
