"""The rows of a CSV file as numbers, cut into demonstrations.

A missing sample is an empty cell, nan, na, n/a or null. Where cells are separated by semicolons or tabs, numbers may have a
decimal comma; a file that has decimal points too is refused, since one of the two may separate thousands.
"""

import itertools
import math
import os
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.errors import DataFileError
from probdmp.io.csv_header import EXAMPLE, Header, parse_header
from probdmp.io.csv_lines import cells_of, delimiter_of, numbered_lines
from probdmp.io.recordings import MOST_DEMONSTRATIONS

__all__ = ["Block", "read_blocks"]

MOST_CELLS = 2**25
MISSING = {"", "nan", "na", "n/a", "null"}


class Block(NamedTuple):
    """The rows of one demonstration."""

    label: str
    table: FloatArray
    """(T, C) array; NaN where a sample is missing. The time comes first if there is one."""
    lines: tuple[int, ...]
    """(T) numbers of the lines they stand on."""


@dataclass(slots=True)
class _Rows:
    """What is read so far."""

    header: Header
    delimiter: str
    name: str
    keys: list[tuple[str, str]] = field(default_factory=list)
    """(n) demonstration and label."""
    starts: list[int] = field(default_factory=list)
    """(n) rows at which demonstrations begin."""
    lines: "array[int]" = field(default_factory=lambda: array("q"))
    cells: "array[float]" = field(default_factory=lambda: array("d"))
    separators: dict[str, int] = field(default_factory=dict)
    """Decimal comma and point, if both might be: the line where each is first seen."""
    seen: set[tuple[str, str]] = field(default_factory=set)


def read_blocks(path: str | os.PathLike[str]) -> tuple[Header, list[Block]]:
    """The header of a file and its demonstrations as tables.

    Raises
    ------
    DataFileError
        If the file is not such a table; the message names line and column.
    """
    name = os.fspath(path)
    lines = numbered_lines(path)
    number, first = next(lines, (0, ""))
    if not number:
        raise DataFileError(f"a table in {name}", "an empty file", EXAMPLE)
    first = first.lstrip("# ")  # numpy.savetxt makes the header a comment
    delimiter = delimiter_of(first)
    place = f"on line {number} of {name}"
    rows = _Rows(parse_header(cells_of(first, delimiter, place), place), delimiter, name)
    for number, line in lines:
        _add(rows, number, line)
    if not rows.lines:
        raise DataFileError(f"rows of samples in {name}", "a header alone", EXAMPLE)
    return rows.header, list(_blocks(rows))


def _add(rows: _Rows, number: int, line: str) -> None:
    header, place = rows.header, f"on line {number} of {rows.name}"
    cells = cells_of(line, rows.delimiter, place)
    if len(cells) != len(header.titles):
        hint = "Separate cells by semicolons if numbers have decimal commas." if rows.delimiter == "," else "Complete the row."
        expected = f"{len(header.titles)} cells {place}, as many as the header has"
        raise DataFileError(expected, f"{len(cells)}: {line!r:.60}", hint)
    if len(header.titles) == 1 and rows.lines and number > rows.lines[-1] + 1:
        raise DataFileError(f"no blank line before line {number} of {rows.name}", "one", "Write nan for a missing sample.")
    key = tuple("" if i is None else cells[i] for i in (header.cut, header.label))
    if not rows.keys or key != rows.keys[-1]:
        _begin(rows, (key[0], key[1]), place)
    chosen = header.measured
    if len(rows.cells) > MOST_CELLS - len(chosen):
        raise DataFileError(f"at most {MOST_CELLS} numbers in {rows.name}", "more", "Split it into several files.")
    rows.lines.append(number)
    try:
        if "_" in line:
            raise ValueError("float() takes 1_000")
        rows.cells.extend([float(cells[i]) for i in chosen])
    except ValueError:
        rows.cells.extend([_number(rows, i, cells[i], number) for i in chosen])
    if rows.delimiter != "," and "." not in rows.separators and any("." in cells[i] for i in chosen):
        _note_separator(rows, ".", number)


def _begin(rows: _Rows, key: tuple[str, str], place: str) -> None:
    if rows.header.cut is not None:
        if key in rows.seen:
            got = f"more of {key[0]!r} after another"
            raise DataFileError(f"a demonstration in one piece {place}", got, "Sort the rows by demonstration, then by time.")
        rows.seen.add(key)
    if len(rows.keys) == MOST_DEMONSTRATIONS:
        expected = f"at most {MOST_DEMONSTRATIONS} demonstrations in {rows.name}"
        raise DataFileError(expected, "more", "Is the column that says which a count of rows? Leave it out.")
    rows.keys.append(key)
    rows.starts.append(len(rows.lines))


def _number(rows: _Rows, column: int, cell: str, number: int) -> float:
    """A cell in another spelling than Python's."""
    if cell.lower() in MISSING:
        return math.nan
    text = cell
    if rows.delimiter != "," and "," in cell:
        text = cell.replace(",", ".")
        _note_separator(rows, ",", number)
    try:
        if "_" in cell:
            raise ValueError
        return float(text)
    except ValueError:
        kind = f"a number in column {rows.header.titles[column]!r} on line {number} of {rows.name}"
        hint = "Leave the cell empty for a missing sample, and text columns out; units go behind names: x [mm]."
        raise DataFileError(kind, f"{cell!r:.60}", hint) from None


def _note_separator(rows: _Rows, separator: str, number: int) -> None:
    rows.separators.setdefault(separator, number)
    if len(rows.separators) == 2:
        at = rows.separators
        got = f"a comma on line {at[',']} and a point on line {at['.']}"
        raise DataFileError(f"numbers with decimal points or with decimal commas in {rows.name}", got, "Write points only.")


def _blocks(rows: _Rows) -> Iterator[Block]:
    table = np.frombuffer(rows.cells).reshape(len(rows.lines), len(rows.header.measured))
    infinite = np.argwhere(np.isinf(table))
    if len(infinite):
        row, column = infinite[0].tolist()
        title = rows.header.titles[rows.header.measured[column]]
        expected = f"a finite number in column {title!r} on line {rows.lines[row]} of {rows.name}"
        raise DataFileError(expected, "infinity", "Leave the cell empty for a missing sample.")
    for (_, label), (start, end) in zip(rows.keys, itertools.pairwise([*rows.starts, len(rows.lines)]), strict=True):
        yield Block(label, table[start:end], tuple(rows.lines[start:end]))
