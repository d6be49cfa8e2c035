"""A CSV file as lines of cells, from a stranger: bytes, lines and cells are bounded, and one line is in memory at a time.

UTF-8 with or without a byte order mark, UTF-16 with one. A cell ends on the line it began on, also in quotes: a quote that is
never closed then costs one line, not the file.
"""

import codecs
import csv
import io
import os
from collections.abc import Iterator

from probdmp.errors import DataFileError
from probdmp.io.regular_file import open_regular

__all__ = ["LARGEST_CSV", "LONGEST_LINE", "cells_of", "delimiter_of", "numbered_lines"]

LARGEST_CSV = 2**27
"""Bytes."""
LONGEST_LINE = 2**17
"""Characters; also the longest cell that the csv module takes."""

UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
"""What Python decodes to where bytes are no text."""
DELIMITERS = ("\t", ";")


def numbered_lines(path: str | os.PathLike[str]) -> Iterator[tuple[int, str]]:
    """The lines of a file that are not blank, without their ends, and their numbers, from 1.

    Raises
    ------
    DataFileError
        If it is not a regular file, not text, or beyond the limits.
    """
    name = os.fspath(path)
    with open_regular(path, LARGEST_CSV, DataFileError, follow_links=True) as file:
        encoding = "utf-16" if file.read(2) in UTF_16 else "utf-8-sig"
        file.seek(0)
        text = io.TextIOWrapper(file, encoding, errors="replace")  # also ends lines at any of \n, \r\n and \r
        number = 0
        while line := text.readline(LONGEST_LINE + 1):
            number += 1
            _check_line(line, f"on line {number} of {name}")
            if line.strip(" \n"):  # of tabs alone: a row of which nothing was measured
                yield number, line.removesuffix("\n")


def delimiter_of(header: str) -> str:
    """What separates the cells of a file: a tab or else a semicolon if its first line has one outside quotes, else a comma."""
    outside = "".join(header.split('"')[::2])
    return next((delimiter for delimiter in DELIMITERS if delimiter in outside), ",")


def cells_of(line: str, delimiter: str, place: str) -> list[str]:
    """The cells of a line, without spaces around them.

    Parameters
    ----------
    place : "on line 2 of f.csv", for messages.
    """
    try:
        (cells,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
    except (csv.Error, ValueError) as error:
        hint = "Double quotes inside a quoted cell, and end the cell on the line where it begins."
        raise DataFileError(f"cells with or without quotes {place}", f"{line!r:.60} ({error})", hint) from error
    return [cell.strip() for cell in cells]


def _check_line(line: str, place: str) -> None:
    if len(line) > LONGEST_LINE:
        hint = "Is it a table with one row for each sample, and with line ends?"
        raise DataFileError(f"at most {LONGEST_LINE} characters {place}", "more", hint)
    for wrong, what in (("\0", "a NUL character"), (REPLACEMENT, "bytes that are neither")):
        if wrong in line:
            where = f"{what} after {line.partition(wrong)[0][-20:]!r}"
            raise DataFileError(f"text in UTF-8, or UTF-16 with its mark, {place}", where, 'Save it as "CSV UTF-8".')
